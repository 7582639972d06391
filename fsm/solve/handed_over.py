"""What a solve hands over: states that were asked for, the ends of its steps, and what it took."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from fsm.solve.renewal import State
from fsm.solve.status import Event, Outcome
from fsm.system import DriveState, Observation

__all__ = ["Saved", "Statistics", "StepEnd"]


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
