"""Error of a film's frequencies and of its largest displacement that its mesh causes, by a finer mesh.

The natural frequencies on both meshes, of order 2 in the size of the elements, are extrapolated (Richardson): with n and
m > n elements the error on the first mesh is (f_m - f_n)/(1 - (n/m)^2). The largest displacement of a motion in many modes
depends on how their phases meet. After many periods a small error of a frequency decides that. So its error is taken from
linear responses: on the finer mesh, and on the mesh itself with its frequencies moved, in steps, by up to their errors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fsm.analyses.natural import natural_modes
from fsm.analyses.reduced import reduced_model
from fsm.ancf.reduced import ReducedModel
from fsm.ancf.system import AncfSystem
from fsm.solve.modal import Modes

__all__ = ["MeshError", "OnMesh", "mesh_error"]

_MODES = 40
"""Modes of the linear responses, if the case asks for no more."""
_STEPS = 8
"""Steps in which the frequencies are moved."""
_COARSE = 0.05
"""Error from which on a finer mesh is advised."""


@dataclass(frozen=True, eq=False)
class OnMesh:
    """A film at rest on one mesh.

    Attributes
    ----------
    system : AncfSystem
    elements : number of elements in the direction that is refined
    deflection : m
        Normal displacement of the probe at a configuration.
    """

    system: AncfSystem
    elements: int
    deflection: Callable[[np.ndarray], float]

    def modes(self, count: int) -> Modes:
        """The lowest natural modes."""
        return natural_modes(self.system, self.system.initial()[0], count)

    def largest(self, model: ReducedModel, duration: float, step: float) -> float:
        """Largest deflection of the linear motion, m."""
        if not duration:
            return 0.0
        response = model.respond(duration, step, self.system.loading.forcings)
        shape = np.array([self.deflection(model.rest + mode) for mode in model.shapes]) - self.deflection(model.rest)
        return float(np.abs(response.amplitude @ shape).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class MeshError:
    """What the mesh puts a vibration off by.

    Attributes
    ----------
    frequencies : (n,) array, Hz
        Of the natural modes on the mesh itself.
    modes : (n,) array
        Error of each, over it.
    amplitude : of the largest displacement at the probe, over it; None if nothing moves
    """

    frequencies: np.ndarray
    modes: np.ndarray
    amplitude: float | None

    def at(self, frequency: float) -> float:
        """Error of a frequency (Hz): that of the natural mode nearest to it."""
        return float(self.modes[int(np.argmin(np.abs(self.frequencies - frequency)))])

    def warnings(self, frequency: float | None) -> list[str]:
        """Warning, if any, that the mesh is coarse for the frequency or the largest displacement."""
        found = {"largest displacement": self.amplitude, "frequency": None if frequency is None else self.at(frequency)}
        large = [f"{name} off by about {100.0 * e:.2g} %" for name, e in found.items() if e is not None and e > _COARSE]
        return [f"the mesh of the film is coarse: {', '.join(large)}; give more deployed.elements_across"] if large else []


def mesh_error(own: OnMesh, finer: OnMesh, count: int, duration: float, step: float) -> MeshError | None:
    """Error of a film's vibration; None where one of the meshes has a mode without stiffness.

    Parameters
    ----------
    own, finer : OnMesh
    count : modes whose errors are wanted
    duration : s
        Of the vibration.
    step : s
        Of the linear responses.
    """
    first, second = own.modes(max(count, _MODES)), finer.modes(max(count, _MODES))
    both = min(len(first.squared), len(second.squared))
    if np.any(first.squared <= 0.0) or np.any(second.squared <= 0.0):
        return None
    whole = 1.0 / (1.0 - (own.elements / finer.elements) ** 2)
    change = whole * (second.frequencies[:both] / first.frequencies[:both] - 1.0)
    model, other = reduced_model(own.system, first, False), reduced_model(finer.system, second, False)
    errors, largest = [], own.largest(model, duration, step)
    if largest:
        errors.append(whole * abs(finer.largest(other, duration, step) / largest - 1.0))
    for part in np.linspace(0.0, 1.0, _STEPS + 1)[1:] if largest else ():
        squared = model.squared.copy()
        squared[:both] *= (1.0 + part * change) ** 2
        errors.append(abs(own.largest(replace(model, squared=squared), duration, step) / largest - 1.0))
    wanted = min(count, both)
    return MeshError(first.frequencies[:wanted], np.abs(change[:wanted]), max(errors, default=None))
