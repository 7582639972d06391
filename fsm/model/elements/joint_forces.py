"""Springs, dampers, friction, stops, latches and motors on the coordinates of joints, and springs between two points. The
group, its table, and its kernels.

A coordinate is an angle with all its turns, a displacement, or a length (`fsm.interactions.openings`). The laws are those
of `fsm.model.elements.joint_laws`. A latch is a stop against the way back, which acts from the first accepted state on in
which the coordinate has reached it, until its effort exceeds the one at which it opens.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fsm.interactions.openings import TURN, opening
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.jit import kernel
from fsm.kernels.programs import Program, table_of
from fsm.kernels.scatter import add_block
from fsm.model.bodies.arrays import DAMPING, DOF, FORCE, POSES, RATES, STIFFNESS, STORED, pattern_of
from fsm.model.elements import joint_laws as law
from fsm.model.elements.element_group import LAST, ElementGroup, ElementKernels, bodies_of
from fsm.model.elements.joint_events import WORDS, note_events, part_before_event

_OF_LATCH = 1e-5
"""Largest error of the effort of a latch in a step, relative to that at which it opens, whatever the tolerance."""


@kernel
def _coordinate(poses: np.ndarray, own: np.ndarray, i: int, gradient: np.ndarray, hessian: np.ndarray) -> float:
    """Coordinate of a row, with all its turns, and its derivatives."""
    bodies, kind = bodies_of(own), integers_1d(own, law.KINDS)[i]
    c = opening(kind, poses[bodies[i, 0]], poses[bodies[i, 1]], floats_2d(own, law.LINES)[i], 0.0, gradient, hessian)
    if kind == TURN:
        c += 2.0 * np.pi * np.round((law.kept(own, law.COORDINATE, i) - c) / (2.0 * np.pi))
    return float(c)


@kernel
def _rate(rates: np.ndarray, own: np.ndarray, i: int, gradient: np.ndarray) -> float:
    bodies, total = bodies_of(own), 0.0
    for side in range(2):
        for k in range(6):
            total += gradient[6 * side + k] * rates[bodies[i, side], k]
    return total


@kernel
def _rate_or_mean(table: np.ndarray, own: np.ndarray, i: int, c: float, gradient: np.ndarray, per_second: float) -> float:
    """Present rate, or the mean rate since the last state."""
    if per_second > 0.0:
        return float((c - floats_1d(own, LAST)[i]) * per_second)
    return float(_rate(floats_2d(table, RATES), own, i, gradient))


@kernel(inline=True)
def _holds(own: np.ndarray) -> float:
    """-1 in motions whose forces are smooth up to the first event of a step, else 0; see `law_at`."""
    return -floats_1d(own, law.HELD)[0]


@kernel(inline=True)
def _push(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> tuple[float, float]:
    """Add the forces; returns the dissipated power and the input power, both at the rates of the forces."""
    force, bodies, gradient, hessian = floats_2d(table, FORCE), bodies_of(own), np.empty(12), np.empty((0, 12))
    held, total, power = _holds(own), 0.0, 0.0
    for i in range(bodies.shape[0]):
        c = _coordinate(floats_2d(table, POSES), own, i, gradient, hessian)
        rate = _rate_or_mean(table, own, i, c, gradient, per_second)
        effort, _, _, _, lost, put_in = law.law_at(own, i, t, c, rate, held)
        total += lost
        power += put_in
        for side in range(2):
            for k in range(6):
                force[bodies[i, side], k] -= effort * gradient[6 * side + k]
    return total, power


@kernel
def _force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    _push(table, own, t, per_second)
    return 0.0


@kernel
def _both(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    lost, put_in = _push(table, own, t, 0.0)
    floats_1d(table, STORED)[2] += put_in
    return lost


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    force, rates, bodies, dof = floats_2d(table, FORCE), floats_2d(table, RATES), bodies_of(own), integers_1d(table, DOF)
    stiffness, damping, p = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING), pattern_of(table)
    gradient, hessian, block, turned = np.empty(12), np.empty((12, 12)), np.empty((12, 12)), np.empty(12)
    for i in range(bodies.shape[0]):
        c = _coordinate(floats_2d(table, POSES), own, i, gradient, hessian)
        rate = _rate_or_mean(table, own, i, c, gradient, per_second)
        effort, by_c, by_rate, _, _, _ = law.law_at(own, i, t, c, rate, 0.0)
        for side in range(2):
            for k in range(6):
                force[bodies[i, side], k] -= effort * gradient[6 * side + k]
        for n in range(12):
            turned[n] = 0.0
            for m in range(12):
                if per_second == 0.0:
                    turned[n] += hessian[m, n] * rates[bodies[i, m // 6], m % 6]
        for m in range(12):
            for n in range(12):
                block[m, n] = gradient[m] * (by_c * gradient[n] + by_rate * turned[n]) + effort * hessian[m, n]
        add_block(block, dof, bodies[i], p.rows, p.columns, stiffness)
        if by_rate == 0.0:
            continue
        for m in range(12):
            for n in range(12):
                block[m, n] = by_rate * gradient[m] * gradient[n]
        add_block(block, dof, bodies[i], p.rows, p.columns, damping)
    return 0.0


@kernel
def _keep(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    last, gradient, hessian = floats_1d(own, LAST), np.empty(12), np.empty((0, 12))
    for i in range(last.shape[0]):
        last[i] = _coordinate(floats_2d(table, POSES), own, i, gradient, hessian)
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Add the energy, which counts as energy of panels and joints; at the end of a step without that of latches that open
    there.
    """
    gradient, hessian, total, poses = np.empty(12), np.empty((0, 12)), 0.0, floats_2d(table, POSES)
    for i in range(bodies_of(own).shape[0]):
        c = _coordinate(poses, own, i, gradient, hessian)
        total += law.law_at(own, i, t, c, 0.0, 0.0)[3]
        if per_second > 0.0:
            total -= law.released(own, i, c, _rate(floats_2d(table, RATES), own, i, gradient))
    floats_1d(table, STORED)[0] += total
    return 0.0


@kernel
def _lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Dissipated power; adds the input power of motors and moving free lengths at the present rates."""
    gradient, hessian, total, poses = np.empty(12), np.empty((0, 12)), 0.0, floats_2d(table, POSES)
    over = per_second if per_second > 0.0 else _holds(own)
    for i in range(bodies_of(own).shape[0]):
        c = _coordinate(poses, own, i, gradient, hessian)
        middle = 0.5 * (c + floats_1d(own, LAST)[i]) if per_second > 0.0 else c
        rate = _rate_or_mean(table, own, i, c, gradient, per_second)
        _, _, _, _, lost, put_in = law.law_at(own, i, t, middle, rate, over)
        total += lost
        if per_second > 0.0:
            put_in = law.law_at(own, i, t, c, _rate(floats_2d(table, RATES), own, i, gradient), 0.0)[5]
            total += law.mean_loss_of_stops(own, i, floats_1d(own, LAST)[i], c, rate)
            kept_loss = law.lost_in_step(own, i, floats_1d(own, LAST)[i], c, rate)
            kept_loss += law.released(own, i, c, _rate(floats_2d(table, RATES), own, i, gradient))
            kept_loss *= per_second
            floats_1d(table, STORED)[3] += kept_loss
            total += kept_loss
        floats_1d(table, STORED)[2] += put_in
    return total


@kernel
def _part(table: np.ndarray, own: np.ndarray, t: float, step: float) -> float:
    """Shorten a step that passes an event, so that it ends there."""
    gradient, hessian, part, held = np.empty(12), np.empty((0, 12)), 2.0, _holds(own) < 0.0
    for i in range(bodies_of(own).shape[0]):
        c = _coordinate(floats_2d(table, POSES), own, i, gradient, hessian)
        part = min(part, part_before_event(own, i, c, _rate(floats_2d(table, RATES), own, i, gradient), step, held))
    return part if part <= 1.0 else 0.0


@kernel
def _accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Count the turns, keep the state of all laws, close and open latches, and note events."""
    gradient, hessian = np.empty(12), np.empty((0, 12))
    for i in range(bodies_of(own).shape[0]):
        c = _coordinate(floats_2d(table, POSES), own, i, gradient, hessian)
        rate = _rate(floats_2d(table, RATES), own, i, gradient)
        law.remember(own, i, c, rate, note_events(own, i, t, c, rate))
    return 0.0


@kernel
def joint_states(own: np.ndarray, poses: np.ndarray, rates: np.ndarray, t: float, found: np.ndarray) -> None:
    """Write coordinate, rate, effort, and efforts of stop and latch, harness, and motor of each row, (m, 6)."""
    gradient, hessian = np.empty(12), np.empty((0, 12))
    for i in range(found.shape[0]):
        c = _coordinate(poses, own, i, gradient, hessian)
        rate = _rate(rates, own, i, gradient)
        found[i, 0], found[i, 1], found[i, 2] = c, rate, law.law_at(own, i, t, c, rate, 0.0)[0]
        found[i, 3], found[i, 4] = law.stops(own, i, c, rate)[0], law.harness(own, i, c, rate)[0]
        found[i, 5] = law.motor(own, i, t, rate)[0]


_KERNELS = ElementKernels(_force, _tangent, _keep, _stored, _lost, _accept, part=_part, both=_both)


@dataclass(frozen=True)
class JointForceGroup(ElementGroup):
    """Laws on the coordinates of joints and on the lengths of springs.

    Attributes
    ----------
    bodies : (m, 2) int array
    kinds, lines : (m,) int and (m, 14) arrays, see `fsm.interactions.openings`
    laws : (m, `COLUMNS`) array, see `fsm.model.elements.joint_laws`
    first, rows : (`TABLES` m + 1,) int and (n, 3) arrays
        Rows (coordinate or rate, effort, slope) of all tables; those of table k of element i begin at `first[TABLES i + k]`.
    start : (m,) array
        Coordinates at the start.
    names : channels of the coordinates, for example "joint.hinge"
    programs : (m, 2) int array
        Numbers of the programs of free length and motor in `functions`, -1 without one.
    functions : functions of time
    felt : (n,) array
        Multipliers of all openings of ideal joints, of which friction depends.
    felt_of : (m, 2) int array
        First and last multiplier of the reaction of each row.
    varies : whether events change laws
    """

    bodies: np.ndarray
    kinds: np.ndarray
    lines: np.ndarray
    laws: np.ndarray
    first: np.ndarray
    rows: np.ndarray
    start: np.ndarray
    names: tuple[str, ...]
    programs: np.ndarray
    functions: tuple[Program, ...]
    felt: np.ndarray
    felt_of: np.ndarray
    varies: bool = False
    categories = ("panels",)
    has_events = True
    kernels = _KERNELS

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [
            self.kinds, self.lines, self.laws, self.first, self.rows, self.first_memory, self.programs, self.felt,
            self.felt_of, np.zeros(1), *table_of(self.functions),
        ]  # fmt: skip

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        tables = np.diff(self.first)[law.OF_DAMPER::law.TABLES]
        columns = [law.DAMPER, law.STOP_DAMPER, law.LATCH_DAMPER, law.REBOUND, law.FRICTION, law.FOLLOWS]
        return self.varies or bool(
            np.any(self.laws[:, columns]) or np.any(tables) or np.any(self.laws[:, law.MOTOR] > law.NO_MOTOR)
        )

    @property
    def feels_reactions(self) -> bool:
        """See `ElementGroup`; friction that follows a reaction."""
        return bool(np.any(self.laws[:, law.FOLLOWS]))

    @cached_property
    def looks_back(self) -> bool:
        """See `ElementGroup`; also what is lost in a step: sliders, and latches that open."""
        slides, opens = self.laws[:, [law.SLIDER, law.SPRING_SLIDER]], self.laws[:, law.OPENS_AT] < math.inf
        return self.rate_dependent or bool(np.any(slides) or np.any(opens))

    def break_times(self) -> set[float]:
        """See `Group`."""
        return {time for function in self.functions for time in function.breaks()}

    @property
    def memory_of(self) -> np.ndarray:
        """Memory (`FIELDS` m + 1 + n,) at the last accepted state, see `joint_laws`, then number and rows of events."""
        return self.arrays[law.KEPT - law.KINDS]

    @property
    def first_memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        memory = np.zeros(law.FIELDS * len(self.start) + 1 + law.EVENTS)
        memory[law.COORDINATE * len(self.start) :][: len(self.start)] = self.start
        memory[law.SPRING_SLID * len(self.start) :][: len(self.start)] = self.laws[:, law.SPRING_BEGINS]
        return memory

    def resolution(self, length: float) -> float:
        """See `ElementGroup`: latches open at an effort that their stiffness and the coordinate give."""
        rows = self.laws[:, law.OPENS_AT] < math.inf
        most = _OF_LATCH * self.laws[rows, law.OPENS_AT] / self.laws[rows, law.LATCH]
        return float(np.where(self.kinds[rows] == TURN, length * most, most).min(initial=math.inf))

    def hold(self, held: bool) -> None:
        """See `ElementGroup`."""
        self.arrays[law.HELD - law.KINDS][0] = held

    def make_idle(self, i: int) -> None:
        """Set all laws of a row to zero."""
        self.laws[i] = 0.0
        self.laws[i, [law.LOWER, law.UPPER, law.SLOWER, law.OPENS_AT, law.RATIO]] = -np.inf, np.inf, np.inf, np.inf, 1.0
        self.rows[self.first[law.TABLES * i] : self.first[law.TABLES * (i + 1)], 1:] = 0.0

    def row_of(self, name: str) -> int:
        """Row of a channel."""
        return self.names.index(name)

    def latched(self, name: str) -> bool:
        """Whether the latch of a channel is closed."""
        return bool(self.memory_of[law.LATCHED * len(self.start) + self.row_of(name)] > 0.0)

    def events(self) -> list[dict[str, Any]]:
        """Events so far in the order of time; of more than 256 the first."""
        begin = law.FIELDS * len(self.start)
        count = min(int(self.memory_of[begin]), law.MOST_EVENTS)
        found = []
        events = self.memory_of[begin + 1 :].reshape(-1, law.EVENT)[:count]
        for what, i, time, rate, impulse, largest, at, _ in events.tolist():
            name, unit = self.names[int(i)].removeprefix("joint."), "rad" if self.kinds[int(i)] == TURN else "m"
            found.append(
                {"time": time, "what": WORDS[int(what)], "joint": name, "coordinate": at, "rate_before": rate,
                 "impulse": impulse, "largest": largest, "unit": unit}
            )  # fmt: skip
        return sorted(found, key=lambda event: event["time"])

    def states(self, t: float, poses: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Coordinates, rates, efforts, and efforts of stop and latch, of harness and of motor, (m, 6)."""
        found = np.zeros((len(self.start), 6))
        joint_states(self._alone.own, poses, rates, t, found)
        return found


def joint_events(system: Any) -> tuple[dict[str, list[dict[str, Any]]], list[str]]:
    """Events of the joints of a system for its summary, empty without any, and a warning of events that are not listed."""
    groups = [group for group in getattr(system, "groups", ()) if isinstance(group, JointForceGroup)]
    found = [event for group in groups for event in group.events()]
    total = sum(int(group.memory_of[law.FIELDS * len(group.start)]) for group in groups)
    text = f"{total:,} events of stops and latches, of which the first {len(found)} are listed; more damping ends them"
    return {"joint_events": found} if found else {}, [text] if total > len(found) else []
