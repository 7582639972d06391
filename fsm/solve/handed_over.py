"""What a solve is told to begin with and to hand over, and what it does: states, the ends of its steps, what it took."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fsm.solve.ledger import Ledger
from fsm.solve.renewal import State
from fsm.solve.status import Event, Outcome
from fsm.system import Before, DriveState, Observation, System

__all__ = ["Beginning", "CurvePoint", "Saved", "Statistics", "StepEnd", "Wanted", "inertia_counts"]

_INERTIAL = 1e-2
"""Inertial forces over the force of the drives, up to which that force counts as quasi-static."""


@dataclass(frozen=True)
class Saved:
    """A state that was asked for: time (s), q, u, what was observed, and the ledger's numbers (J).

    `before` is the state at the start of a quasi-static step, from which rates are differences; None of a motion.
    `program_time` is the time at which loads and drives are taken, if it is another: on a path by arc length it goes back.
    """

    time: float
    q: np.ndarray
    u: np.ndarray
    observation: Observation
    dissipated: float
    work: float
    error: float
    pair_energy: np.ndarray
    before: Before | None = None
    program_time: float | None = None

    @property
    def acting(self) -> float:
        """Time at which loads and drives are taken, s."""
        return self.time if self.program_time is None else self.program_time


class CurvePoint(NamedTuple):
    """Drives and contacts at a point of a solve, at or between the ends of its steps.

    Attributes
    ----------
    drive : DriveState
    pair_force : (n_pairs,) array, N
    time : s
    path : int
        Even: number of a path, times two, along which forces are quasi-static: equilibria, or motion whose inertia does not
        count (`inertia_counts`), of a snap only near a stable equilibrium. Odd: motion between two paths.
    panels, creases : J
        Elastic energy.
    """

    drive: DriveState
    pair_force: np.ndarray
    time: float = 0.0
    path: int = 0
    panels: float = 0.0
    creases: float = 0.0

    @classmethod
    def after(
        cls, points: Sequence[CurvePoint], time: float, seen: Observation, dynamic: bool, jumped: bool = False
    ) -> CurvePoint:
        """The point that follows others; `jumped`: it is on another equilibrium path than the last one."""
        path = points[-1].path if points else 0
        if path % 2 != int(dynamic):
            path += 1
        elif jumped and not dynamic:
            path += 2
        stored = seen.energy.potential
        return cls(seen.drive, seen.pairs.force, time, path, stored.get("panels", 0.0), stored.get("creases", 0.0))


def inertia_counts(system: System, t: float, q: np.ndarray, u: np.ndarray, seen: Observation) -> bool:
    """Whether the inertial forces M u' of a motion, summed by magnitude, are more than `_INERTIAL` of the drives' force.

    On a strip that snaps they are 1e-4 of it where the motion has died and about all of it in a spike.
    """
    if not len(seen.drive.force):
        return False
    inertial = np.abs(system.force(t, q, u) / system.scales().of_forces).sum()
    return bool(inertial > _INERTIAL * np.abs(seen.drive.force).max())


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
    seen: list[CurvePoint]
    after: StepEnd | None


@dataclass
class Statistics:
    """What a solve took, and the curve at every point looked at.

    `seen` holds what a curve has at the ends of all steps (and Gauss points in them), in the order of time;
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
    seen: list[CurvePoint] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
