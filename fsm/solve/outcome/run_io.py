"""Input and output of a solve: initial state, saved states, ends of steps, statistics."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np

from fsm.solve.interface.records import DriveState, Observation
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.restart_points import State
from fsm.solve.outcome.status import Event, Outcome
from fsm.solve.stepping.model import INERTIAL
from fsm.text.short_repr import ShortRepr
from fsm.text.shown_units import travel_text

Number: TypeAlias = Any
"""Number of a state, or array (n,) of several states."""


@dataclass(frozen=True, repr=False)
class SavedState(ShortRepr):
    """Saved state: time (s), q, u, observation, and numbers of the energy balance (J).

    `observation` is computed at the first use if `observed` is a function.
    `before` is the state at the start of a quasi-static step; rates are differences from it. In dynamics `before` is None.
    `program_time` is the time of loads and drives if it differs from `time`, as on a path by arc length. `at_rest`: all
    velocities are zero, also those of drives. `negative_pivots` is the number of negative pivots of the stiffness, if the
    solver has counted them. `final`: the solve ends at this state, before the requested end. `memory`: internal variables of
    a state that the solver has passed already; the system has later ones, so the receiver restores them. Numbers and arrays
    of several states have a first axis, see `OutputRequest.several`. `numerical` is the numerical dissipation so far, J.
    `element_memory`: that of several states which a kernel has passed, for `System.in_turn`.
    """

    time: Number
    q: np.ndarray
    u: np.ndarray
    observed: Observation | Callable[[], Observation]
    dissipated: Number
    work: Number
    error: Number
    pair_energy: np.ndarray
    before: tuple[Number, np.ndarray] | None = None
    program_time: Number | None = None
    at_rest: bool = False
    negative_pivots: int | np.ndarray | None = None
    final: bool = False
    memory: np.ndarray | None = None
    numerical: Number = 0.0
    element_memory: np.ndarray | None = None

    @cached_property
    def observation(self) -> Observation:
        """Observation of the state."""
        return self.observed if isinstance(self.observed, Observation) else self.observed()

    @property
    def acting(self) -> Number:
        """Time at which loads and drives are evaluated, s."""
        return self.time if self.program_time is None else self.program_time


def observed_at(system: System, t: float, q: np.ndarray, u: np.ndarray, memory: np.ndarray) -> Observation:
    """Observation of an earlier state with its internal variables; the system keeps its present ones."""
    present = system.memory()
    system.restore(memory)
    observed = system.observe(t, q, u)
    system.restore(present)
    return observed


class CurvePoint(NamedTuple):
    """Drives and contacts at a point of a solve, at or between the ends of its steps.

    Attributes
    ----------
    drive : DriveState
    pair_force : (n_pairs,) array, N
    time : s
    path : int
        Even: twice the number of a quasi-static path, that is equilibria, or motion with negligible inertia
        (`inertia_counts`); a snap counts only near a stable equilibrium. Odd: motion between two paths.
    panels, creases : J
        Elastic energy of the panels and of the creases.
    """

    drive: DriveState
    pair_force: np.ndarray
    time: float = 0.0
    path: int = 0
    panels: float = 0.0
    creases: float = 0.0

    @classmethod
    def after(
        cls, points: Sequence[CurvePoint], time: float, observed: Observation, dynamic: bool, jumped: bool = False
    ) -> CurvePoint:
        """Next point of a curve; `jumped`: it is on another equilibrium path than the last point."""
        path = cls.path_after(points, dynamic, jumped)
        stored = observed.energy.potential
        return cls(observed.drive, observed.pairs.force, time, path, stored.get("panels", 0.0), stored.get("creases", 0.0))

    @staticmethod
    def path_after(points: Sequence[CurvePoint], dynamic: bool, jumped: bool = False) -> int:
        """Number of the path of the next point of a curve."""
        path = points[-1].path if points else 0
        if path % 2 != int(dynamic):
            return path + 1
        return path + 2 if jumped and not dynamic else path


def time_and_travel(system: System, t: float, drive: DriveState) -> str:
    """Time (s), and travels or turns of all drives, for messages."""
    turning = [system.drive_turns(k) for k in range(len(drive.travel))]
    travels = ", ".join(
        f"{'turn' if turns else 'travel'} {travel_text(turns, float(x))}"
        for turns, x in zip(turning, drive.travel, strict=True)
    )
    return f"at t = {t:.6g} s" + (f" ({travels})" if travels else "")


def inertia_counts(system: System, t: float, q: np.ndarray, u: np.ndarray, observed: Observation) -> bool:
    """Whether the inertial forces M u', summed by magnitude, exceed `INERTIAL` times the drive force.

    Inertial forces of driven bodies are a part of the drive force. On a strip that snaps, the ratio of inertial force
    to drive force is 1e-4 after the motion has decayed, and about 1 at a peak of the force.
    """
    if not len(observed.drive.force):
        return False
    force, without_inertia = system.balance(t, q, u)
    scales = system.scales()
    inertial = np.abs(force / scales.force_scale).sum()
    inertial += np.abs((observed.drive.force - without_inertia) / scales.of_drives).max()
    return bool(inertial > INERTIAL * np.abs(observed.drive.force / scales.of_drives).max())


@dataclass(frozen=True)
class AcceptedStep:
    """End of a step.

    Attributes
    ----------
    time, q, u : s, (nq,) and (nu,) arrays
    steps : int
        Number of steps so far.
    events : events so far
    state : dict of arrays, or None
        Restart data, at a restart point (`fsm.solve.outcome.restart_points`).
    passed : times (s) and configurations at the ends of the steps before this one, with `each_step`
    """

    time: float
    q: np.ndarray
    u: np.ndarray
    steps: int
    events: tuple[Event, ...] = ()
    state: State | None = None
    passed: tuple[tuple[float, np.ndarray], ...] = ()


class Watch(Protocol):
    """Events of a run, `[[event]]`, each of which happens once when its condition becomes true."""

    def next_time(self, system: Any, t: float) -> float:
        """First time after t (s) on which a condition of an event to come depends."""
        ...

    def values(self, system: Any, state: SavedState) -> np.ndarray:
        """Values (m,), positive where the condition of an event to come is true; the system is in that state."""
        ...

    def happen(self, system: Any, numbers: np.ndarray, state: SavedState) -> bool:
        """Do what events (their numbers) demand; whether the step ends."""
        ...


@dataclass(frozen=True)
class OutputRequest:
    """Requested output of a solve.

    Attributes
    ----------
    save_times : increasing times, s
    on_save : called with each saved state, in order
    several : bool
        Whether `on_save` receives several states of a path at once, which `fsm.solve.interface.records.row_of` separates.
    on_step : called after some steps
    each_step : bool
        Whether `on_step` receives the ends of all steps, of which few are taken in one kernel; if not, it receives the last
        one of many.
    watch : events of the run
    """

    save_times: Sequence[float]
    on_save: Callable[[SavedState], None]
    on_step: Callable[[AcceptedStep], None] | None
    each_step: bool = False
    watch: Watch | None = None
    several: bool = False


@dataclass(frozen=True, repr=False)
class InitialState(ShortRepr):
    """Initial state of a solve, or a restart point from which it continues.

    Attributes
    ----------
    start : time, q, u; the system's initial state if absent
    energy_balance, points : energy balance and curve, changed in place; a new balance is opened if absent
    after : AcceptedStep
        Restart point of an earlier solve of the same system, with its energy balance and curve. The results are then
        equal to the last bit to those of a solve without interruption.
    """

    start: tuple[float, np.ndarray, np.ndarray] | None
    energy_balance: EnergyBalance | None
    points: list[CurvePoint]
    after: AcceptedStep | None


@dataclass(repr=False)
class Statistics(ShortRepr):
    """Counters of a solve, and its curve.

    `points` holds the points of the curve at the ends of all steps, and at Gauss points in them, in the order of time.
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
    points: list[CurvePoint] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
