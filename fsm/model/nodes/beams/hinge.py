"""Moments of hinges between bars: springs, dampers, dry friction, end stops, latches.

A hinge joins two bars at a shared position. The rotation (turn) follows from the angle between the slopes p and q of
the bars,

    turn = sign (angle from p to q - initial angle),

which is positive in deployment. The moment against the turn,

    M = k (turn - rest) + c turn' + M_f tanh(turn'/w_s) + K d^1.5 max(0, 1 + h d'),   d = max(0, turn - limit),

acts along the gradient of the angle, (p_y, -p_x)/p.p and (-q_y, q_x)/q.q. The stop of a latched hinge acts in both
directions, K |d|^1.5 (sgn d + h d') with d = turn - limit; the energy of the spring is K |d|^2.5/2.5 in both.

Latches of hinges: a hinge that has reached its stop is held there in both directions.

A hinge latches at the end of a step if it is at its stop or beyond it, and the stop pushes it back. In this state the latch
and the stop have equal moments and energies. Moment and energy do not jump, so latching does not change the energy. A
latched hinge does not open again.

The law of a hinge is a function of time. Up to and including the time of latching it is the law of the stop, and after that
time the law of the latch. Earlier states are thus evaluated with the law that was valid at their time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import AT_REST, DAMPERS, DAMPING, FORCE, IN_MOTION, NOW, NUMBERS, STIFFNESS, Q, U
from fsm.model.nodes.group import ElementGroup


class HingeArrays(NamedTuple):
    """Arrays of all hinges for the kernels; see `HingeGroup`."""

    vectors: np.ndarray
    initial: np.ndarray
    sign: np.ndarray
    law: np.ndarray
    times: np.ndarray
    latched: np.ndarray


_REST, _STIFFNESS, _DAMPING, _FRICTION, _SPEED, _LIMIT, _STOP, _RESTITUTION = range(8)
_SLOTS = len(HingeArrays._fields)
"""Row of a group's table after those of `HingeArrays`."""


@kernel(inline=True)
def _slopes(vectors: np.ndarray, q: np.ndarray) -> tuple[float, float, float, float]:
    """Both slopes of a hinge, or their rates."""
    a, b = vectors[0], vectors[1]
    return q[a], q[a + 1], q[b], q[b + 1]


@kernel(inline=True)
def _turn(px: float, py: float, qx: float, qy: float, initial: float, sign: float) -> float:
    """Rotation of a hinge since the start, between -90 and 270 degrees: also beyond full deployment."""
    cosine, sine = np.cos(initial), np.sin(initial)
    along, across = px * qx + py * qy, px * qy - py * qx
    ahead, aside = along * cosine + across * sine, sign * (across * cosine - along * sine)
    return np.arctan2(-ahead, aside) + 0.5 * np.pi


@kernel(inline=True)
def _gradient(px: float, py: float, qx: float, qy: float, sign: float, gradient: np.ndarray) -> None:
    """Derivatives of the turn with respect to (p, q), (4,)."""
    p2, q2 = sign / (px * px + py * py), sign / (qx * qx + qy * qy)
    gradient[0], gradient[1], gradient[2], gradient[3] = py * p2, -px * p2, -qy * q2, qx * q2


@kernel(inline=True)
def _moment(turn: float, rate: float, law: np.ndarray, latched: int) -> tuple[float, float, float]:
    """Moment against the turn, and its derivatives with respect to turn and rate."""
    moment = law[_STIFFNESS] * (turn - law[_REST]) + law[_DAMPING] * rate
    by_turn, by_rate = law[_STIFFNESS], law[_DAMPING]
    if law[_FRICTION] > 0.0:
        dry = np.tanh(rate / law[_SPEED])
        moment += law[_FRICTION] * dry
        by_rate += law[_FRICTION] * (1.0 - dry * dry) / law[_SPEED]
    depth = turn - law[_LIMIT]
    side = 1.0 if depth > 0.0 else -1.0
    damped = 1.0 + side * law[_RESTITUTION] * rate
    if latched == 1 or (depth > 0.0 and damped > 0.0):
        root = np.sqrt(side * depth)
        spring = law[_STOP] * side * depth * root
        moment += side * spring * damped
        by_turn += 1.5 * law[_STOP] * root * damped
        by_rate += spring * law[_RESTITUTION]
    return moment, by_turn, by_rate


@kernel(inline=True)
def _acting(turn: float, rate: float, law: np.ndarray, latched: int, moving: float) -> tuple[float, float, float]:
    """As `_moment`; in the case of `DAMPERS` without the moment of the same turn at rest."""
    moment, by_turn, by_rate = _moment(turn, rate, law, latched)
    if moving == DAMPERS:
        at_rest, slope, _ = _moment(turn, 0.0, law, latched)
        return moment - at_rest, by_turn - slope, by_rate
    return moment, by_turn, by_rate if moving >= AT_REST else 0.0


@kernel
def _turns(vectors: np.ndarray, initial: np.ndarray, sign: np.ndarray, q: np.ndarray) -> np.ndarray:
    turns = np.empty(vectors.shape[0])
    for k in range(vectors.shape[0]):
        px, py, qx, qy = _slopes(vectors[k], q)
        turns[k] = _turn(px, py, qx, qy, initial[k], sign[k])
    return turns


@kernel(inline=True)
def _state(
    hinges: HingeArrays, k: int, q: np.ndarray, u: np.ndarray, gradient: np.ndarray
) -> tuple[float, float]:
    """Turn of a hinge and its rate; the derivatives of the turn go to `gradient` (4,)."""
    px, py, qx, qy = _slopes(hinges.vectors[k], q)
    vx, vy, wx, wy = _slopes(hinges.vectors[k], u)
    _gradient(px, py, qx, qy, hinges.sign[k], gradient)
    rate = gradient[0] * vx + gradient[1] * vy + gradient[2] * wx + gradient[3] * wy
    return _turn(px, py, qx, qy, hinges.initial[k], hinges.sign[k]), rate


@kernel
def latch(hinges: HingeArrays, t: float, q: np.ndarray, u: np.ndarray) -> None:
    """Latch the hinges that are at their stops, or beyond them, and whose stop moment opposes the deployment."""
    gradient = np.empty(4)
    for k in range(hinges.times.shape[0]):
        turn, rate = _state(hinges, k, q, u, gradient)
        pushed = turn >= hinges.law[k, _LIMIT] and 1.0 + hinges.law[k, _RESTITUTION] * rate >= 0.0
        if pushed and hinges.times[k] == np.inf:
            hinges.times[k] = t


# on tables --------------------------------------------------------------------------------------------------------------


@kernel
def _hinges_of(table: np.ndarray, t: np.ndarray) -> HingeArrays:
    """Hinges with the law of the present time."""
    hinges = HingeArrays(
        integers_2d(t, 0), floats_1d(t, 1), floats_1d(t, 2), floats_2d(t, 3), floats_1d(t, 4), integers_1d(t, 5)
    )
    t = floats_1d(table, NUMBERS)[NOW]
    for k in range(hinges.times.shape[0]):
        hinges.latched[k] = 1 if hinges.times[k] < t else 0
    return hinges


@kernel
def _rates(table: np.ndarray, moving: float) -> np.ndarray:
    return floats_1d(table, U) if moving >= IN_MOTION else np.zeros(floats_1d(table, U).shape[0])


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    hinges, q, u, force = _hinges_of(table, own), floats_1d(table, Q), _rates(table, moving), floats_1d(table, FORCE)
    gradient = np.empty(4)
    for k in range(hinges.vectors.shape[0]):
        turn, rate = _state(hinges, k, q, u, gradient)
        moment, _, _ = _acting(turn, rate, hinges.law[k], hinges.latched[k], moving)
        for i in range(2):
            for a in range(2):
                force[hinges.vectors[k, i] + a] -= moment * gradient[2 * i + a]
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _force(table, own, moving)
    hinges, q, u = _hinges_of(table, own), floats_1d(table, Q), _rates(table, moving)
    stiffness, damping = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    slots, size = integers_2d(own, _SLOTS).reshape(hinges.vectors.shape[0], 2, 2), stiffness.shape[1]
    into_stiffness, into_damping = stiffness.reshape(-1), damping.reshape(-1)
    gradient, hessian, turned = np.empty(4), np.zeros((4, 4)), np.empty(4)
    for k in range(hinges.vectors.shape[0]):
        px, py, qx, qy = _slopes(hinges.vectors[k], q)
        vx, vy, wx, wy = _slopes(hinges.vectors[k], u)
        turn, rate = _state(hinges, k, q, u, gradient)
        p4, q4 = hinges.sign[k] / (px * px + py * py) ** 2, hinges.sign[k] / (qx * qx + qy * qy) ** 2
        hessian[0, 0], hessian[0, 1] = -2.0 * px * py * p4, (px * px - py * py) * p4
        hessian[1, 0], hessian[1, 1] = hessian[0, 1], -hessian[0, 0]
        hessian[2, 2], hessian[2, 3] = 2.0 * qx * qy * q4, (qy * qy - qx * qx) * q4
        hessian[3, 2], hessian[3, 3] = hessian[2, 3], -hessian[2, 2]
        moment, by_turn, by_rate = _acting(turn, rate, hinges.law[k], hinges.latched[k], moving)
        for j in range(4):
            turned[j] = hessian[j, 0] * vx + hessian[j, 1] * vy + hessian[j, 2] * wx + hessian[j, 3] * wy
        for i in range(2):
            for j in range(2):
                slot = slots[k, i, j]
                for a in range(2):
                    for b in range(2):
                        m, n = 2 * i + a, 2 * j + b
                        into_stiffness[slot + a * size + b] += (
                            gradient[m] * (by_turn * gradient[n] + by_rate * turned[n]) + moment * hessian[m, n]
                        )
                        into_damping[slot + a * size + b] += by_rate * gradient[m] * gradient[n]
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    """Energy of springs and stops."""
    hinges, q, total = _hinges_of(table, own), floats_1d(table, Q), 0.0
    for k in range(hinges.vectors.shape[0]):
        px, py, qx, qy = _slopes(hinges.vectors[k], q)
        law, turn = hinges.law[k], _turn(px, py, qx, qy, hinges.initial[k], hinges.sign[k])
        depth = turn - law[_LIMIT]
        total += 0.5 * law[_STIFFNESS] * (turn - law[_REST]) ** 2
        if hinges.latched[k] == 1 or depth > 0.0:
            total += law[_STOP] * abs(depth) ** 2.5 / 2.5
    return total


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    hinges, q, u = _hinges_of(table, own), floats_1d(table, Q), _rates(table, moving)
    gradient, power = np.empty(4), 0.0
    for k in range(hinges.vectors.shape[0]):
        turn, rate = _state(hinges, k, q, u, gradient)
        law, depth = hinges.law[k], turn - hinges.law[k, _LIMIT]
        moment = law[_DAMPING] * rate + law[_FRICTION] * np.tanh(rate / law[_SPEED])
        if hinges.latched[k] == 1 or depth > 0.0:
            # where a stop would pull, its moment is set to zero, because the excess is dissipated; a latch can pull
            damped = law[_RESTITUTION] * rate
            moment += law[_STOP] * abs(depth) ** 1.5 * (damped if hinges.latched[k] == 1 else max(damped, -1.0))
        power += moment * rate
    return power


@kernel
def latch_hinges(table: np.ndarray, own: np.ndarray, t: float) -> float:
    """Latch hinges at an accepted state."""
    latch(_hinges_of(table, own), t, floats_1d(table, Q), floats_1d(table, U))
    return 0.0


@dataclass(frozen=True, eq=False)
class HingeGroup(ElementGroup):
    """A batch of hinges; see the module docstring.

    Attributes
    ----------
    vectors : (m, 2) int array
        First coordinates of the slopes p and q.
    initial, sign : (m,) arrays, rad and +-1 Initial angle, and sign of the deployment.
    law : (m, 8) array
        rest (rad), k (N m/rad), c (N m s/rad), M_f (N m), w_s (rad/s), limit (rad), K (N m/rad^1.5), h (s/rad).
    """

    vectors: np.ndarray
    initial: np.ndarray
    sign: np.ndarray
    law: np.ndarray
    name: str = "hinges"

    @cached_property
    def times(self) -> np.ndarray:
        """Time after which the stop of each hinge acts in both directions, (m,), s; inf if the hinge has not latched."""
        return np.full(len(self.vectors), np.inf)

    @cached_property
    def arrays(self) -> HingeArrays:
        """Arrays of the kernels; `latched` is 1 for hinges whose stops act in both directions, since their latching."""
        latched = np.zeros(len(self.vectors), dtype=np.int64)
        return HingeArrays(
            np.ascontiguousarray(self.vectors), np.ascontiguousarray(self.initial), np.ascontiguousarray(self.sign),
            np.ascontiguousarray(self.law), self.times, latched,
        )  # fmt: skip
    kernels = _force, _tangent, _stored, _lost

    @property
    def rate_dependent(self) -> bool:
        """Whether the moments depend on velocities."""
        return bool(np.any(self.law[:, [_DAMPING, _FRICTION, _RESTITUTION]] > 0.0))

    @property
    def stopped(self) -> np.ndarray:
        """Hinges with an end stop, (m,) bool."""
        return np.isfinite(self.law[:, _LIMIT])

    def turns(self, q: np.ndarray) -> np.ndarray:
        """Turn of every hinge, (m,), rad."""
        return np.asarray(_turns(self.vectors, self.initial, self.sign, q))


class Latches:
    """Latches of all hinges with an end stop.

    Parameters
    ----------
    hinges : HingeGroup
        Hinges; their `times` are updated.
    names : names of the hinges

    Attributes
    ----------
    times : (m,) array, s
        Time at which each hinge latched; inf if it has not.
    """

    def __init__(self, hinges: HingeGroup, names: tuple[str, ...]) -> None:
        self.hinges, self.names, self.times = hinges, names, hinges.times

    def commit(self, t: float, q: np.ndarray, u: np.ndarray) -> None:
        """Latch the hinges that are at their stops after an accepted step."""
        latch(self.hinges.arrays, t, q, u)

    def restore(self, times: np.ndarray) -> None:
        """Restore the times of latching; an empty array means that no hinge has latched."""
        self.times[:] = times if len(times) else math.inf

    def events(self) -> list[tuple[str, float]]:
        """Name and time (s) of every latched hinge, in order of time."""
        latched = np.flatnonzero(np.isfinite(self.times))
        return [(self.names[k], float(self.times[k])) for k in latched[np.argsort(self.times[latched], kind="stable")]]

    def open(self) -> list[str]:
        """Names of the hinges that have a stop and have not latched."""
        waiting = self.hinges.stopped & np.isinf(self.times)
        return [self.names[k] for k in np.flatnonzero(waiting)]
