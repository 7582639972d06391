"""System of a case in a state of its result."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.analyses.choose import analysis_of
from fsm.case.models.case import Case
from fsm.errors import CaseError, Fault
from fsm.model.system.system import SegmentSystem
from fsm.results.solution import Solution
from fsm.solve.interface.system import System


class SystemOfRecord(NamedTuple):
    """System in a saved state.

    Attributes
    ----------
    system : System
        System of the step, with the internal variables of the state.
    time : s, at which loads and drives are evaluated
    q, u : (nq,), (nu,) arrays
    """

    system: System
    time: float
    q: np.ndarray
    u: np.ndarray


def system_of_record(case: Case, solution: Solution, record: int, source: str) -> SystemOfRecord:
    """Compile the case of a result, and set its internal variables to those of a record.

    Parameters
    ----------
    case, solution : the case of the result, and the result
    record : number of the record, from 0; negative numbers count from the end
    source : name of the result in messages

    Raises
    ------
    CaseError
        The result has no such record, or no internal variables that this state needs, such as those of contacts.
    """
    count = len(solution)
    if not -count <= record < count:
        raise CaseError(f"has no record {record}; its records are 0 to {count - 1}", source)
    analysis = analysis_of(case, source)
    analysis.initialise([])
    record %= count
    number = max(int(solution.step[record]) - 1, 0)
    states, found = None, None
    for k in range(number + 1):
        records = np.flatnonzero(solution.step == k + 1)
        here = record if k == number else int(records[-1]) if len(records) else -1
        system = analysis.enter(k, states)
        if here < 0:
            continue  # a step without records, such as natural modes: nothing has moved
        found = _restored(analysis.system, system, solution, here, source)
        if k < number:
            if found.time < analysis.steps()[k].end * (1.0 - 1e-9):
                analysis.cut(k, found.time)  # an event has ended the step
            states = analysis.leave(system, found.time, found.q, found.u)
    assert found is not None
    return found


def _restored(whole: System, system: System, solution: Solution, record: int, source: str) -> SystemOfRecord:
    """System of a step in the state of a record."""
    t, q, u = float(solution.program_time[record]), solution.q[record], solution.u[record]
    t = float(solution.time[record]) if np.isnan(t) else t
    memory, length = solution.memory[record], len(system.element_memory())
    if length > len(memory):
        text = "has no internal variables of elements (multipliers of locked directions, hysteresis, latches), as files of "
        text += "earlier versions of fsm; take forces and channels of the result, or run the case again"
        raise CaseError(Fault("state/memory", text), source)
    if system is not whole:
        assert isinstance(whole, SegmentSystem) and isinstance(system, SegmentSystem)
        q, u = system.from_states(whole.all_states(t, q, u))
    system.restore(memory[:length])
    if isinstance(system, SegmentSystem) and system.contacts:
        text = "the state of contacts is not stored in records; take forces and channels of the result"
        raise CaseError(Fault("contact", text), source)
    return SystemOfRecord(system, t, q, u)
