"""What a solve is told to begin with and to hand over, and what it does: states, the ends of its steps, what it took."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from fsm.solve.ledger import Ledger
from fsm.solve.renewal import State
from fsm.solve.status import Event, Outcome
from fsm.system import DriveState, Observation

__all__ = ["Beginning", "Saved", "Statistics", "StepEnd", "Wanted"]


@dataclass(frozen=True)
class Saved:
    """A state that was asked for: time (s), q, u, what was observed, and the ledger's numbers (J)."""

    time: float
    q: np.ndarray
    u: np.ndarray
    observation: Observation
    dissipated: float
    work: float
    error: float
    pair_energy: np.ndarray


@dataclass(frozen=True)
class StepEnd:
    """End of a step.

    Attributes
    ----------
    time, q, u : s, (nq,) and (nu,) arrays
    steps : int
        So far.
    events : so far
    state : dict of arrays, or None
        At a renewal point (`fsm.solve.renewal`) what another solve goes on with from here.
    """

    time: float
    q: np.ndarray
    u: np.ndarray
    steps: int
    events: tuple[Event, ...] = ()
    state: State | None = None


@dataclass(frozen=True)
class Wanted:
    """What a solve is to hand over.

    Attributes
    ----------
    save_times : increasing times, s
    on_save : called with each saved state, in order
    on_step : called after every step
    """

    save_times: Sequence[float]
    on_save: Callable[[Saved], None]
    on_step: Callable[[StepEnd], None] | None


@dataclass(frozen=True)
class Beginning:
    """What a solve begins or goes on with.

    Attributes
    ----------
    start : time, q, u; the system's initial state if absent
    ledger, seen : changed in place; a ledger is opened if there is none
    after : StepEnd
        A renewal point of another solve of the same system to go on from, with its ledger and what it had seen there, as
        that one did: to the bit.
    """

    start: tuple[float, np.ndarray, np.ndarray] | None
    ledger: Ledger | None
    seen: list[tuple[DriveState, np.ndarray]]
    after: StepEnd | None


@dataclass
class Statistics:
    """What a solve took, and the curve at every point looked at.

    `seen` holds the drives and contact forces at the ends of all steps (and Gauss points in them), in order of time;
    `newton_iterations` of SciPy's methods are evaluations of the right-hand side over the stages of one iteration.
    """

    method: str
    outcome: Outcome = Outcome.FINISHED
    steps: int = 0
    force_evaluations: int = 0
    jacobian_evaluations: int = 0
    factorisations: int = 0
    newton_iterations: int = 0
    wall_time: float = 0.0
    smallest_step: float = math.inf
    rejected: int = 0
    seen: list[tuple[DriveState, np.ndarray]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
