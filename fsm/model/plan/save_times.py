"""Times at which a run saves its states."""

from __future__ import annotations

import math

import numpy as np

from fsm.case.models.solve import Save
from fsm.case.plan.record_count import record_count
from fsm.model.bodies.drive import Travel

_INTERVALS = 200
"""Number of intervals between the records of a step whose spacing is not given."""


def save_times(save: Save, program: Travel | None, end: float, start: float = 0.0) -> list[float]:
    """Times (s) at which a step saves states; its first and its last time are always included.

    Parameters
    ----------
    save : Save
    program : program of the first drive that acts, if there is one
    end, start : times at which the step ends and starts, s

    Raises
    ------
    CaseError
        Too many times to store.
    """
    gone = 0.0 if program is None else program.gone(start)
    way = 0.0 if program is None else program.gone(end) - gone
    if save.every is not None and program is not None and way > 0.0:
        record_count(way, save.every, "save.every")
        first = math.floor(gone / save.every * (1.0 + 1e-12)) + 1
        last = math.floor((gone + way) / save.every * (1.0 + 1e-12))
        times = [start, *(program.time_of(k * save.every) for k in range(first, last + 1))]
    elif save.interval is not None:
        count = record_count(end - start, save.interval, "save.interval")
        times = [start + k * save.interval for k in range(count + 1)]
    elif program is not None and way > 0.0:
        times = [program.time_of(float(x)) for x in np.linspace(gone, gone + way, _INTERVALS + 1)[1:]]
    else:
        times = [float(t) for t in np.linspace(start, end, _INTERVALS + 1)]
    if program is not None:
        times = sorted({*times, *program.reversals()})
    times = [start, *(t for t in times if start < t <= end)]
    if times[-1] < end * (1 - 1e-12):
        times.append(end)
    return times
