"""Cords from point to point over small pulleys. The group, its table, and its kernels.

The length L of a cord is the sum of the lengths l_j of its parts between points, which bodies carry. Its mean tension is

    T = k (L - f) + d (L' - f')

with the free length f(t), or zero if it is slack or would push. Parts have the tensions T_j = T g_j, with the mean over the
length T. Over pulley j, with the angle theta between both parts, the tension changes by Euler's formula,

    T_j = T_j+1 exp(mu theta tanh(v_j/v)),   v_j = sum_i<=j l_i' - w_j L' - (1 - w_j) f',   w_j = sum_i<=j l_i/L

with the speed v_j of the cord towards its first end, where a spool is, and the slip speed v. The pulleys dissipate
(T_j - T_j+1) v_j >= 0 each, which is sum T_j l_j' - T L' + (T - T_1) f', and the spool puts in -T_1 f'.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fsm.interactions.openings import LENGTH, opening
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at, program_at
from fsm.kernels.programs import Program, table_of
from fsm.kernels.scatter import add_block
from fsm.laws.one_sided import NEAR, ends_at, mean_loss, one_sided, part_of_line
from fsm.model.bodies.arrays import DAMPING, DOF, FORCE, POSES, RATES, STIFFNESS, STORED, pattern_of
from fsm.model.elements.element_group import LAST, OWN, ElementGroup, ElementKernels, bodies_of

_LINES, _ACROSS, _PULLEYS, _LAWS, _KEPT, _PIECES = range(OWN, OWN + 6)
_STIFFNESS, _DAMPING, _SLIP = range(3)
_STRAIGHT = 1e-6
"""Least sine of the angle over a pulley in the derivatives of this angle, which a straight cord does not have."""

_INSIDE = 1e-6
"""Distance from the ends of a step, relative to it, at which the speed of a spool is that inside the step."""


class Way(NamedTuple):
    """Parts of a cord: lengths (n,), distances (n - 1,) of the points beside each pulley, rates of the lengths, and their
    gradients (n, 6 p) and second derivatives (n, 6 p, 6 p) by p bodies.
    """

    lengths: np.ndarray
    across: np.ndarray
    rates: np.ndarray
    slopes: np.ndarray
    bends: np.ndarray


@kernel
def _way(poses: np.ndarray, rates: np.ndarray, own: np.ndarray, i: int, per_second: float, bent: bool) -> Way:
    """Parts of a cord, at the present rates, or at the mean rates since the last state."""
    bodies, lines, last = bodies_of(own), floats_2d(own, _LINES), floats_2d(own, LAST)
    parts = bodies.shape[1] - 1
    size = 6 * bodies.shape[1]
    way = Way(
        np.empty(parts), np.empty(parts - 1), np.zeros(parts), np.zeros((parts, size)),
        np.zeros((parts if bent else 0, size, size)),
    )  # fmt: skip
    gradient, hessian = np.empty(12), np.empty((12 if bent else 0, 12))
    for j in range(parts - 1):
        line, ends = floats_2d(own, _ACROSS)[(parts - 1) * i + j], (bodies[i, j], bodies[i, j + 2])
        way.across[j] = opening(LENGTH, poses[ends[0]], poses[ends[1]], line, 0.0, gradient, hessian[:0])
    for j in range(parts):
        ends = bodies[i, j], bodies[i, j + 1]
        way.lengths[j] = opening(LENGTH, poses[ends[0]], poses[ends[1]], lines[parts * i + j], 0.0, gradient, hessian)
        way.slopes[j, 6 * j : 6 * j + 12] = gradient
        if bent:
            way.bends[j, 6 * j : 6 * j + 12, 6 * j : 6 * j + 12] = hessian
        if per_second > 0.0:
            way.rates[j] = (way.lengths[j] - last[i, j]) * per_second
            continue
        for k in range(12):
            way.rates[j] += gradient[k] * rates[ends[k // 6], k % 6]
    return way


@kernel
def _angle(poses: np.ndarray, own: np.ndarray, i: int, j: int, way: Way, slope: np.ndarray) -> float:
    """Angle between the parts before and after pulley j, from three lengths, and its gradient (6 p,)."""
    bodies, across, gradient = bodies_of(own), floats_2d(own, _ACROSS), np.empty(12)
    parts = bodies.shape[1] - 1
    a, b, c = way.lengths[j], way.lengths[j + 1], way.across[j]
    slope[:] = 0.0
    if a == 0.0 or b == 0.0:
        return 0.0
    line, ends = across[(parts - 1) * i + j], (bodies[i, j], bodies[i, j + 2])
    opening(LENGTH, poses[ends[0]], poses[ends[1]], line, 0.0, gradient, np.empty((0, 12)))
    cosine = min(max((a * a + b * b - c * c) / (2.0 * a * b), -1.0), 1.0)
    area = a * b * max(math.sqrt(1.0 - cosine * cosine), _STRAIGHT)
    for m in range(slope.shape[0]):
        slope[m] = ((a - b * cosine) * way.slopes[j, m] + (b - a * cosine) * way.slopes[j + 1, m]) / area
    for k in range(6):
        slope[6 * j + k] -= c * gradient[k] / area
        slope[6 * j + 12 + k] -= c * gradient[6 + k] / area
    return math.pi - math.acos(cosine)


class Tensions(NamedTuple):
    """Tensions (n,) of the parts and their derivatives (n, 6 p) by increments and rates; energy (J), dissipated power (W),
    and input power of the spool (W).
    """

    tension: np.ndarray
    by_pose: np.ndarray
    by_rate: np.ndarray
    energy: float
    lost: float
    put_in: float


@kernel
def _tensions(
    poses: np.ndarray, own: np.ndarray, i: int, t: float, way: Way, turned: np.ndarray, bent: bool
) -> Tensions:
    """Tensions of a cord; `turned` (n, 6 p) are the derivatives of the rates of lengths by increments."""
    law, pulleys = floats_2d(own, _LAWS)[i], floats_2d(own, _PULLEYS)[i]
    free, pace, _ = program_at(pieces_at(own, _PIECES), i, t)
    parts, size = way.lengths.shape[0], way.slopes.shape[1]
    length, rate = way.lengths.sum(), way.rates.sum()
    taut, damping = length - free, law[_DAMPING]
    if ends_at(floats_2d(own, _KEPT)[0, i], taut, NEAR * max(1.0, free)):
        damping = 0.0
    mean, by_length, by_speed, energy, lost = one_sided(taut, rate - pace, law[_STIFFNESS], damping)
    part, by_pose, by_rate = np.ones(parts), np.zeros((parts, size)), np.zeros((parts, size))  # of exp(-sum mu theta tanh)
    whole, spun, angle = np.zeros(size), np.zeros(size), np.zeros(size)
    if bent:
        for j in range(parts):
            whole += way.slopes[j]
            spun += turned[j]
    done, speed, slope, changed = 0.0, 0.0, np.zeros(size), np.zeros(size)
    rough = parts > 1 and pulleys.max() > 0.0 and mean > 0.0
    for j in range(parts - 1 if rough else 0):
        done += way.lengths[j] / length
        speed += way.rates[j]
        slip = speed - done * rate - (1.0 - done) * pace
        theta, tanh = _angle(poses, own, i, j, way, angle), math.tanh(slip / law[_SLIP])
        part[j + 1] = part[j] * math.exp(-pulleys[j] * theta * tanh)
        if not bent:
            continue
        slope += way.slopes[j]
        changed += turned[j]
        steep = pulleys[j] * theta * (1.0 - tanh * tanh) / law[_SLIP]
        share = (slope - done * whole) / length
        by_rate[j + 1] = by_rate[j] - steep * (slope - done * whole)
        by_pose[j + 1] = by_pose[j] - pulleys[j] * tanh * angle - steep * (changed - done * spun - (rate - pace) * share)
    total = float(part @ way.lengths)
    tension = mean * length / total * part if rough else mean * part
    if rough and bent:  # logarithmic derivatives of part, then of tension
        pose_sum, rate_sum = np.zeros(size), np.zeros(size)
        for j in range(parts):
            pose_sum += part[j] * (way.slopes[j] + way.lengths[j] * by_pose[j])
            rate_sum += part[j] * way.lengths[j] * by_rate[j]
        for j in range(parts):
            by_pose[j] = tension[j] * (by_pose[j] + whole / length - pose_sum / total)
            by_rate[j] = tension[j] * (by_rate[j] - rate_sum / total)
    if bent and mean > 0.0:
        for j in range(parts):
            by_pose[j] += tension[j] / mean * (by_length * whole + by_speed * spun)
            by_rate[j] += tension[j] / mean * by_speed * whole
    lost += float(tension @ way.rates) - mean * rate + (mean - tension[0]) * pace
    return Tensions(tension, by_pose, by_rate, energy, lost, -tension[0] * pace)


@kernel
def _pull(force: np.ndarray, own: np.ndarray, i: int, slopes: np.ndarray, tension: np.ndarray) -> None:
    bodies = bodies_of(own)
    for j in range(tension.shape[0]):
        for k in range(12):
            force[bodies[i, j + k // 6], k % 6] -= tension[j] * slopes[j, 6 * j + k]


@kernel
def _force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    poses, rates, none = floats_2d(table, POSES), floats_2d(table, RATES), np.zeros((0, 0))
    for i in range(bodies_of(own).shape[0]):
        way = _way(poses, rates, own, i, per_second, False)
        _pull(floats_2d(table, FORCE), own, i, way.slopes, _tensions(poses, own, i, t, way, none, False).tension)
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    bodies, rates, poses = bodies_of(own), floats_2d(table, RATES), floats_2d(table, POSES)
    stiffness, damping = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    dof, p = integers_1d(table, DOF), pattern_of(table)
    size = 6 * bodies.shape[1]
    turned, block = np.empty((bodies.shape[1] - 1, size)), np.empty((size, size))
    for i in range(bodies.shape[0]):
        way = _way(poses, rates, own, i, per_second, True)
        turned[:] = 0.0
        for j in range(turned.shape[0]):
            for n in range(size):
                for m in range(size):
                    if per_second == 0.0:
                        turned[j, n] += way.bends[j, m, n] * rates[bodies[i, m // 6], m % 6]
        found = _tensions(poses, own, i, t, way, turned, True)
        _pull(floats_2d(table, FORCE), own, i, way.slopes, found.tension)
        block[:] = 0.0
        for j in range(turned.shape[0]):
            block += found.tension[j] * way.bends[j]
        for matrix, slope in ((stiffness, found.by_pose), (damping, found.by_rate)):
            for j in range(turned.shape[0]):
                for m in range(size):
                    for n in range(size):
                        block[m, n] += way.slopes[j, m] * slope[j, n]
            add_block(block, dof, bodies[i], p.rows, p.columns, matrix)
            block[:] = 0.0
    return 0.0


@kernel
def _keep(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    last = floats_2d(own, LAST)
    for i in range(last.shape[0]):
        way = _way(floats_2d(table, POSES), floats_2d(table, RATES), own, i, 0.0, False)
        last[i, : way.lengths.shape[0]], last[i, way.lengths.shape[0] :] = way.lengths, way.across
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Add the energy, which counts as energy of panels and joints."""
    poses, none = floats_2d(table, POSES), np.zeros((0, 0))
    for i in range(bodies_of(own).shape[0]):
        way = _way(poses, floats_2d(table, RATES), own, i, 0.0, False)
        floats_1d(table, STORED)[0] += _tensions(poses, own, i, t, way, none, False).energy
    return 0.0


@kernel
def _lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Dissipated power; adds the input power of the spools at the present rates."""
    poses, rates, none, total = floats_2d(table, POSES), floats_2d(table, RATES), np.zeros((0, 0)), 0.0
    for i in range(bodies_of(own).shape[0]):
        way = _way(poses, rates, own, i, per_second, False)
        middle = t
        if per_second > 0.0:  # the middle of the step
            middle -= 0.5 / per_second
            last, parts = floats_2d(own, LAST)[i], way.lengths.shape[0]
            way.lengths[:] = 0.5 * (way.lengths + last[:parts])
            way.across[:] = 0.5 * (way.across + last[parts:])
            total += _mean_loss(own, i, t, per_second, way)
        total += _tensions(poses, own, i, middle, way, none, False).lost
        way = _way(poses, rates, own, i, 0.0, False)
        floats_1d(table, STORED)[2] += _tensions(poses, own, i, t, way, none, False).put_in
    return total


@kernel
def _mean_loss(own: np.ndarray, i: int, t: float, per_second: float, way: Way) -> float:
    """Power that a cord loses over a step while its mean tension acts or not, beyond that in the middle of the step, W."""
    law, half, pieces = floats_2d(own, _LAWS)[i], 0.5 / per_second, pieces_at(own, _PIECES)
    middle, change = way.lengths.sum(), half * way.rates.sum()
    before = middle - change - program_at(pieces, i, t - 2.0 * half)[0]
    after = middle + change - program_at(pieces, i, t)[0]
    free, pace, _ = program_at(pieces, i, t - half)
    inside = one_sided(middle - free, way.rates.sum() - pace, law[_STIFFNESS], law[_DAMPING])[4]
    return mean_loss(before, after, (after - before) * per_second, law[_STIFFNESS], law[_DAMPING], 0.0) - inside


@kernel
def _elongation(table: np.ndarray, own: np.ndarray, i: int, t: float) -> tuple[float, float, float]:
    """Elongation of a cord, m, negative if it is slack, the rate of its length, m/s, and its free length, m."""
    free = program_at(pieces_at(own, _PIECES), i, t)[0]
    way = _way(floats_2d(table, POSES), floats_2d(table, RATES), own, i, 0.0, False)
    return float(way.lengths.sum() - free), float(way.rates.sum()), free


@kernel
def _part(table: np.ndarray, own: np.ndarray, t: float, step: float) -> float:
    """Shorten a step in which a damped cord becomes taut or slack, so that it ends there."""
    part, kept = 2.0, floats_2d(own, _KEPT)
    for i in range(bodies_of(own).shape[0]):
        law = floats_2d(own, _LAWS)[i]
        if law[_DAMPING] > 0.0:
            taut, rate, free = _elongation(table, own, i, t)
            near, late = NEAR * max(1.0, free), law[_DAMPING] / law[_STIFFNESS]
            part = min(part, part_of_line(kept[0, i], taut, 0.0, near))
            if kept[0, i] > 0.0:  # the speed of a spool may jump at both ends of the step
                first = program_at(pieces_at(own, _PIECES), i, t - (1.0 - _INSIDE) * step)[1]
                last = program_at(pieces_at(own, _PIECES), i, t - _INSIDE * step)[1]
                pulled = kept[0, i] + late * (kept[1, i] - first)
                part = min(part, part_of_line(-pulled, -taut - late * (rate - last), 0.0, near))
    return part if part <= 1.0 else 0.0


@kernel
def _accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    for i in range(bodies_of(own).shape[0]):
        floats_2d(own, _KEPT)[0, i], floats_2d(own, _KEPT)[1, i], _ = _elongation(table, own, i, t)
    return 0.0


@kernel
def cord_states(own: np.ndarray, poses: np.ndarray, rates: np.ndarray, t: float, found: np.ndarray) -> None:
    """Write length, its rate, and tension at the first and the second end of each cord, (m, 4)."""
    for i in range(found.shape[0]):
        way = _way(poses, rates, own, i, 0.0, False)
        tension = _tensions(poses, own, i, t, way, np.zeros((0, 0)), False).tension
        found[i, 0], found[i, 1], found[i, 2], found[i, 3] = way.lengths.sum(), way.rates.sum(), tension[0], tension[-1]


_KERNELS = ElementKernels(_force, _tangent, _keep, _stored, _lost, _accept, part=_part)


@dataclass(frozen=True)
class CordGroup(ElementGroup):
    """Cords with the same number of points.

    Attributes
    ----------
    bodies : (m, n) int array
        Bodies of the points along each cord.
    lines : (m (n - 1), 14) array
        Constants of the kind `LENGTH` of each part (`fsm.interactions.openings`).
    across : (m (n - 2), 14) array
        The same of the line from the point before each pulley to the point after it.
    pulleys : (m, n - 2) array
        Coefficients of friction.
    laws : (m, 3) array
        Stiffness, damping and slip speed, N/m, N s/m and m/s.
    free : (m,) functions of time
        Free lengths, m.
    names : names of the cords
    """

    bodies: np.ndarray
    lines: np.ndarray
    across: np.ndarray
    pulleys: np.ndarray
    laws: np.ndarray
    free: tuple[Program, ...]
    names: tuple[str, ...]
    categories = ("panels",)
    has_events = True
    kernels = _KERNELS

    @property
    def last_shape(self) -> tuple[int, ...]:
        """See `ElementGroup`."""
        return len(self.bodies), 2 * self.bodies.shape[1] - 3

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [self.lines, self.across, self.pulleys, self.laws, self.first_memory.reshape(2, -1), *table_of(self.free)]

    @property
    def memory_of(self) -> np.ndarray:
        """Elongations (m,) and rates of lengths (m,) at the last accepted state, m and m/s; infinite before it."""
        return self.arrays[_KEPT - OWN].reshape(-1)

    @property
    def first_memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        return np.full(2 * len(self.names), np.inf)

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return bool(np.any(self.laws[:, _DAMPING]) or np.any(self.pulleys))

    def break_times(self) -> set[float]:
        """See `Group`."""
        return {time for function in self.free for time in function.breaks()}

    def states(self, t: float, poses: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Lengths, their rates, and tensions at both ends, (m, 4)."""
        found = np.zeros((len(self.names), 4))
        cord_states(self._alone.own, poses, rates, t, found)
        return found
