"""Error of a motion with impacts, from the same motion with larger steps.

The solver controls the error of each step. Impacts amplify the errors of earlier steps, so neither the tolerance nor the
energy balance gives the error of the motion. The motion is therefore solved again with ten times the tolerance (or twice a
fixed step) and half as many steps in an impact. The stated error is the difference of both motions. For a method of
second order the true error is a third of this difference or less. In a chaotic motion the error is as large as the
difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fsm.errors import EnergyAbort, NotConverged
from fsm.segments.system import SegmentSystem
from fsm.solve.run_io import AcceptedStep, SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

__all__ = ["MotionError", "motion_error"]

_LOOSER, _LONGER = 10.0, 2.0
"""Ratios of the tolerances, and of fixed steps and steps in an impact."""
_LARGE = 0.02
"""Error above which there is a warning."""


@dataclass(frozen=True)
class MotionError:
    """Error of the positions at the records, relative to the largest displacement.

    Attributes
    ----------
    largest : -
    since : s
        First record with an error above 2 %; None if there is none.
    """

    largest: float
    since: float | None

    def warnings(self) -> list[str]:
        """Warning, if any, about an error above 2 %."""
        if self.since is None:
            return []
        return [
            f"positions have an error of about {100.0 * self.largest:.2g} % of the largest displacement, above "
            f"{100.0 * _LARGE:g} % from t = {self.since:.4g} s on: impacts amplify the errors of steps; reduce solve.rtol. "
            "If the error remains, small changes of the case change the motion as much"
        ]


def motion_error(
    system: SegmentSystem,
    settings: Settings,
    times: Sequence[float],
    states: np.ndarray,
    on_step: Callable[[AcceptedStep], None] | None = None,
) -> MotionError | None:
    """Solve a motion again with larger steps, and compare the positions.

    Parameters
    ----------
    system : system in its initial state
    settings : settings of the first solve
    times, states : (n,), (n, nq) records of the first solve: s, and configurations
    on_step : called after each step

    Returns
    -------
    MotionError or None
        None if the second solve fails, or if nothing moves.
    """
    looser = replace(settings, rtol=_LOOSER * settings.rtol)
    if settings.step is not None:
        looser = replace(settings, step=_LONGER * settings.step)
    system.contacts.coarsen(_LONGER)
    own = [_positions(system, t, q) for t, q in zip(times, states, strict=True)]
    other: list[np.ndarray] = []

    def on_save(saved: SavedState) -> None:
        other.append(_positions(system, saved.time, saved.q))

    try:
        simulate(system, looser, times, on_save, on_step)
    except (NotConverged, EnergyAbort):
        return None
    displacement = max((float(np.abs(at - own[0]).max(initial=0.0)) for at in own), default=0.0)
    if not displacement:
        return None
    error = np.array([np.abs(a - b).max(initial=0.0) for a, b in zip(own, other, strict=True)]) / displacement
    above = np.flatnonzero(error > _LARGE)
    return MotionError(float(error.max()), float(times[above[0]]) if len(above) else None)


def _positions(system: SegmentSystem, t: float, q: np.ndarray) -> np.ndarray:
    """Corners of all plates, or positions of all bodies if there are no plates, m."""
    corners = system.shape(t, q)
    return corners if corners.size else system.body_poses(q)[:, : 3 if system.spatial else 2]
