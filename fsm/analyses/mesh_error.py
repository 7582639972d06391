"""Error of a film's frequencies and of its largest displacement due to the mesh, by comparison with another mesh.

The natural frequencies on both meshes have an error of order p in the size of the elements (Richardson extrapolation).
With m/n times the elements in a direction the error on the first mesh is (f_m - f_n)/(1 - (n/m)^p). The order is the lowest
of those that films of the kind show (`validation/errors`): 2 for a taut film; 0.4 with patches; 0.3 if parts are wrinkled
or slack. Edges of these parts cross elements, and the change of a single mode from mesh to mesh is irregular: small by
coincidence in a third of the modes. The change of each mode then counts as at least half of the largest one. The slope of
a film has a kink at the edge of a patch, over a length of sqrt(D/N) (bending stiffness D, tension N) that elements do not
resolve, and its stress is singular at the corners.

The largest displacement of a motion in many modes depends on the phases of these modes. After many periods the phases
depend on small errors of frequencies. The error is therefore computed from linear responses: one on the other mesh, and
some on the mesh itself with frequencies changed in steps up to their errors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fsm.analyses.natural import natural_modes
from fsm.analyses.reduced import reduced_model
from fsm.model.nodes.system.reduced import ReducedModel
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.modal import Modes

_MODES = 40
"""Smallest number of modes of the linear responses."""
_STEPS = 8
"""Number of steps in which the frequencies are changed."""
_COARSE = 0.05
"""Error above which a finer mesh is advised."""
_LOWEST = 3
"""Natural modes whose errors a warning names."""
_SOFTEST = 0.1
"""Largest relative change of a frequency."""
_COINCIDENCE = 0.5
"""Smallest change of a mode relative to the largest change, if changes are irregular."""
_RESPONSE = 5e4
"""Largest number of steps of a linear response."""


@dataclass(frozen=True, eq=False)
class OnMesh:
    """A film at rest on one mesh.

    Attributes
    ----------
    system : AncfSystem
    deflection : m
        Normal displacement of the probe at a configuration.
    """

    system: AncfSystem
    deflection: Callable[[np.ndarray], float]

    def modes(self, count: int) -> Modes:
        """Lowest natural modes of the film."""
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
    """Errors of a vibration due to the mesh.

    Attributes
    ----------
    frequencies : (n,) array, Hz
        Natural frequencies on the mesh itself.
    modes : (n,) array
        Relative error of each frequency; NaN if the mode has no stiffness on one of the meshes.
    amplitude : relative error of the largest displacement at the probe; None without motion, or if a mode has no stiffness
    finer : whether the comparison mesh is finer
    """

    frequencies: np.ndarray
    modes: np.ndarray
    amplitude: float | None
    finer: bool = True

    def at(self, frequency: float) -> float | None:
        """Relative error of the natural mode nearest to a frequency (Hz); None if it is not known."""
        known = np.isfinite(self.modes)
        if not known.any():
            return None
        return float(self.modes[known][int(np.argmin(np.abs(self.frequencies[known] - frequency)))])

    def warnings(self, frequency: float | None, remedy: str) -> list[str]:
        """Warning, if any, that the mesh is coarse for the frequency, the largest displacement, or the lowest modes."""
        lowest = self.modes[:_LOWEST][np.isfinite(self.modes[:_LOWEST])]
        found = {
            "largest displacement": self.amplitude,
            "frequency": None if frequency is None else self.at(frequency),
            "natural frequencies": float(lowest.max()) if len(lowest) else None,
        }
        large = [f"{name}: error about {100.0 * e:.2g} %" for name, e in found.items() if e is not None and e > _COARSE]
        return [f"the mesh of the film is coarse: {', '.join(large)}; {remedy}"] if large else []


def mesh_error(
    own: OnMesh, other: OnMesh, ratio: float, order: float, irregular: bool, count: int, duration: float, step: float
) -> MeshError:
    """Error of a film's vibration.

    Parameters
    ----------
    own, other : OnMesh
        Films on the mesh itself and on the comparison mesh, which is finer or coarser.
    ratio : ratio of the numbers of elements in a direction, of the comparison mesh over the mesh itself
    order : order of the natural frequencies in the size of the elements
    irregular : whether the change of a single mode from mesh to mesh may be small by coincidence
    count : number of modes
    duration : s
        Duration of the vibration.
    step : s
        Step of the linear responses; it is increased if there were more than `_RESPONSE` steps.
    """
    first, second = own.modes(max(count, _MODES)), other.modes(max(count, _MODES))
    both = min(len(first.squared), len(second.squared))
    stiff = (first.squared[:both] > 0.0) & (second.squared[:both] > 0.0)
    whole = 1.0 / (1.0 - ratio**-order)
    change = np.full(both, np.nan)
    change[stiff] = whole * (second.frequencies[:both][stiff] / first.frequencies[:both][stiff] - 1.0)
    wanted = min(count, both)
    if irregular:
        least = _COINCIDENCE * np.nanmax(np.abs(change[:wanted]), initial=0.0)
        change = np.copysign(np.maximum(np.abs(change), least), change)
    amplitude = None
    if np.all(first.squared > 0.0) and np.all(second.squared > 0.0):
        amplitude = _of_amplitude(own, other, (first, second), change, abs(whole), duration, max(step, duration / _RESPONSE))
    return MeshError(first.frequencies[:wanted], np.abs(change[:wanted]), amplitude, ratio > 1.0)


def _of_amplitude(
    own: OnMesh, other: OnMesh, found: tuple[Modes, Modes], change: np.ndarray, whole: float, duration: float, step: float
) -> float | None:
    """Error of the largest displacement; see the module docstring."""
    model, second = (reduced_model(on.system, modes, False) for on, modes in zip((own, other), found, strict=True))
    largest = own.largest(model, duration, step)
    if not largest:
        return None
    errors = [whole * abs(other.largest(second, duration, step) / largest - 1.0)]
    for part in np.linspace(0.0, 1.0, _STEPS + 1)[1:]:
        squared = model.squared.copy()
        squared[: len(change)] *= np.maximum(1.0 + part * change, _SOFTEST) ** 2
        errors.append(abs(own.largest(replace(model, squared=squared), duration, step) / largest - 1.0))
    return max(errors)
