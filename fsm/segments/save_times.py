"""Times at which a run saves its states."""

from __future__ import annotations

import numpy as np

from fsm.scene.case import Case
from fsm.scene.record_count import record_count
from fsm.segments.drive import PrescribedMotion

__all__ = ["save_times"]


def save_times(case: Case, motion: PrescribedMotion | None, end: float) -> list[float]:
    """Times (s) at which a run saves states; the first and the last time are always included.

    Parameters
    ----------
    case : Case
    motion : motion of the first drive, if there is one
    end : time at which the run ends, s

    Raises
    ------
    CaseError
        Too many times to store.
    """
    save = case.save
    if save.every is not None and motion is not None:
        count = record_count(motion.travel, save.every, "save.every")
        times = [motion.time_of(k * save.every) for k in range(count + 1)]
    elif save.interval is not None:
        times = [k * save.interval for k in range(record_count(end, save.interval, "save.interval") + 1)]
    elif motion is not None:
        times = [motion.time_of(float(x)) for x in np.linspace(0.0, motion.travel, 201)]
    else:
        times = [float(t) for t in np.linspace(0.0, end, 201)]
    if motion is not None:
        times = sorted({*times, *motion.program.reversals()})
    times = [0.0, *(t for t in times[1:] if t <= end)]
    if times[-1] < end * (1 - 1e-12):
        times.append(end)
    return times
