"""Fixed step of the full model of a film, and two errors in its summary: of the fixed step, and of a force at a point."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fsm.errors import EnergyAbort, NotConverged
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.text.shown_units import shown

_COMPARED = 80
"""Number of steps that are solved again; with the default step these take twice the duration of a pulse."""
_WHOLE = 4.0 / 3.0
"""Ratio of the error to the difference from a solution with half the step, for a method of second order."""
_LARGE = 0.02
"""Error above which the step is halved, and above which there is a warning."""


@dataclass(frozen=True)
class SummaryErrors:
    """Step and errors of the displacements at the probes, over the largest displacement there.

    Attributes
    ----------
    step : s
    of_step : error due to the step; None if a step fails, or if there is no motion
    of_point : difference between a force at a point and a force spread over an element; None if not computed
    """

    step: float
    of_step: float | None
    of_point: float | None

    def warnings(self) -> list[str]:
        """Warnings, if any, that these errors are above 2 %."""
        found = []
        if self.of_step is not None and self.of_step > _LARGE:
            shorter = self.step * math.sqrt(_LARGE / self.of_step)  # these methods are of second order
            found.append(
                f"displacements have an error of about {100.0 * self.of_step:.2g} % with steps of {shown(self.step, 's')} "
                f"(bound {100.0 * _LARGE:.0f} %); reduce solve.step to {shown(shorter, 's')}"
            )
        if self.of_point is not None and self.of_point > _LARGE:
            found.append(
                f"displacements depend on the mesh: they differ by {100.0 * self.of_point:.2g} % if the force is spread "
                "over an element, because a force at a point has no limit; give impact.size"
            )
        return found


def summary_errors(
    system: AncfSystem,
    spread: AncfSystem | None,
    settings: Settings,
    probes: Callable[[np.ndarray], np.ndarray],
    halved: int = 0,
) -> SummaryErrors:
    """Errors of the full model over its first 80 steps.

    Parameters
    ----------
    system : AncfSystem
    spread : system with the force spread over an element; None if the case already spreads it over a larger area
    settings : Settings
        Settings with a fixed step.
    probes : function of a configuration: displacements (n, 3)
    halved : largest number of times that the step is halved to reach an error below 2 %
    """
    assert settings.step is not None
    step = settings.step
    count = max(1, min(_COMPARED, int(settings.end_time / step * (1.0 + 1e-9))))
    times = [k * step for k in range(count + 1)]

    def moved(of: AncfSystem, step: float) -> np.ndarray:
        samples: list[np.ndarray] = []
        simulate(
            of, replace(settings, end_time=times[-1], step=step), times, lambda saved: samples.append(probes(saved.q))
        )
        return np.array(samples)

    try:
        found = moved(system, step)
        for left in range(halved, -1, -1):
            finer = moved(system, 0.5 * step)
            largest = float(np.abs(finer).max(initial=0.0))
            if not largest:
                return SummaryErrors(step, None, None)
            error = _WHOLE * float(np.abs(found - finer).max()) / largest
            if error <= _LARGE or not left:
                break
            step, found = 0.5 * step, finer
        of_point = 0.0 if spread is None else float(np.abs(found - moved(spread, step)).max()) / largest
    except (NotConverged, EnergyAbort):  # the run itself reports this failure
        return SummaryErrors(step, None, None)
    return SummaryErrors(step, error, of_point)
