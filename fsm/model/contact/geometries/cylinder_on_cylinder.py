"""Contact of the sides of two cylinders at any angle, from crossed to parallel, as a sum over slices.

A slice at the coordinate s of the first axis has the penetration g(s) = R1 + R2 - D(s), with the distance D(s) of its centre
from the second axis between its ends. The pair has the depth

    d = (1/l int g^(e+1) ds)^(1/(e+1)),    g > 0,    l the length of the shorter cylinder,

with the exponent e of the contact law. Its force K d^e grad d is then the sum of the forces K/l g^e ds of all slices, and
K d^(e+1)/(e+1) the sum of their energies: an elastic foundation of independent slices (Johnson, Contact Mechanics, Cambridge
1985, section 4.3). Parallel cylinders have K d^e times the length of their line over the shorter length. Crossed ones at the
angle theta have, with e = 1,

    F = 4/3 K/l sqrt(2 (R1 + R2)) delta^(3/2)/sin theta

for the penetration delta. Force, energy and tangent are continuous from one to the other and over the ends.

Known errors: slices do not deform each other. With K = pi/4 E* l (Popov, Contact Mechanics and Friction, 2010, section 5.3),
F of crossed cylinders of equal radii is 1.57, 1.76, 2.16, 2.53 and 2.92 times that of Hertz (Johnson, section 4.2) at 90,
45, 20, 10 and 5 degrees, and 1.73 to 3.08 times that if R1 = 5 R2. For one angle, K can be chosen such that F is exact. The
ends of the second cylinder are round, with its radius, and those of the first are cut; end faces do not touch. Slip is the
mean over all slices: friction does not resist spin about the normal.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from fsm.case.schema.model import Model
from fsm.case.schema.units import Length, Number
from fsm.errors import CaseError, Fault
from fsm.interactions.contact.contact_frame import add_contact_tangent, add_pull_tangent
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.tables import Floats1, Floats2, Floats3, Integers2, follows
from fsm.kernels.vector import dot
from fsm.model.bodies.contact_arrays import ContactArrays, forces_of, index_of
from fsm.model.contact.contact_table import ContactTable
from fsm.model.contact.pair_contacts import PairContacts
from fsm.model.contact.touching import Touching
from fsm.registry import GEOMETRIES, AddedLaw

_Size = Annotated[Length, Field(gt=0)]
_POINTS = 16
"""Points of the quadrature over each part of the line."""
_PARALLEL = 1e-14
"""Square of the sine of the angle of the axes below which slices have one distance."""
_DEEPEST = 0.5
"""Distance of the axes, relative to the sum of the radii, below which the cylinders have passed through each other."""


class CylinderOnCylinder(Model):
    """Parameters of a pair of cylinders."""

    radii: tuple[_Size, _Size] = Field(description="radii of the first and the second cylinder")
    lengths: tuple[_Size, _Size] = Field(description="their lengths")
    first_axis: tuple[Number, Number, Number] = Field(
        default=(0.0, 1.0, 0.0), description="axis of the first cylinder, axes of its body"
    )
    second_axis: tuple[Number, Number, Number] = Field(
        default=(0.0, 1.0, 0.0), description="axis of the second cylinder, axes of its body"
    )
    first_at: tuple[Length, Length, Length] = Field(
        default=(0.0, 0.0, 0.0), description="middle of the first cylinder, axes of its body"
    )
    second_at: tuple[Length, Length, Length] = Field(
        default=(0.0, 0.0, 0.0), description="middle of the second cylinder, axes of its body"
    )


class CylinderArrays(NamedTuple):
    """Bodies of all pairs, middles and unit axes of both cylinders in body axes (m), radii and half lengths (m), e + 1, and
    the quadrature: angles and weights in rows.
    """

    ends: Integers2
    middles: Floats3
    axes: Floats3
    sizes: Floats2
    halves: Floats2
    power: Floats1
    rule: Floats2


_own = follows(CylinderArrays, ContactArrays)


class _Pair(NamedTuple):
    """Pair in inertial axes: rotations (2, 3, 3), middle of the first axis from that of the second, and unit axes (2, 3)."""

    turn: np.ndarray
    apart: np.ndarray
    along: np.ndarray


@kernel
def _pair(g: ContactArrays, poses: np.ndarray, slot: int) -> _Pair:
    own = _own(g)
    pair = _Pair(np.empty((2, 3, 3)), np.empty(3), np.empty((2, 3)))
    for side in range(2):
        body, sign = own.ends[slot, side], 1.0 - 2.0 * side
        fill_rotation(poses[body, 3:7], pair.turn[side])
        for k in range(3):
            place, way = poses[body, k], 0.0
            for m in range(3):
                place += pair.turn[side, k, m] * own.middles[slot, side, m]
                way += pair.turn[side, k, m] * own.axes[slot, side, m]
            pair.along[side, k] = way
            pair.apart[k] = place if side == 0 else pair.apart[k] + sign * place
    return pair


@kernel
def _slices(g: ContactArrays, pair: _Pair, slot: int, at: np.ndarray, weight: np.ndarray) -> int:
    """Write coordinates of slices that touch and their weights (m); return their number.

    With s = middle + half sin(angle), powers of the penetration are smooth functions of the angle.
    """
    own = _own(g)
    half, other, reach = own.halves[slot, 0], own.halves[slot, 1], own.sizes[slot].sum()
    r, a, b = pair.apart, pair.along[0], pair.along[1]
    start, slope = r @ b, a @ b  # coordinate on the second axis: start + slope s
    cuts = np.array([-half, half, half, half])
    if abs(slope) > 0.0:
        one, two = (-other - start) / slope, (other - start) / slope
        cuts[1], cuts[2] = min(max(min(one, two), -half), half), min(max(max(one, two), -half), half)
    count = 0
    for k in range(3):
        low, high = cuts[k], cuts[k + 1]
        if not high > low:
            continue
        middle = start + slope * 0.5 * (low + high)
        if abs(middle) <= other:
            square, cross, rest = max(1.0 - slope * slope, 0.0), r @ a - start * slope, r @ r - start * start
        else:
            end = r - (other if middle > 0.0 else -other) * b
            square, cross, rest = 1.0, end @ a, end @ end
        rest -= reach * reach
        if square > _PARALLEL:
            inside = cross * cross - square * rest
            if inside <= 0.0:
                continue
            root = np.sqrt(inside)
            low, high = max(low, (-cross - root) / square), min(high, (-cross + root) / square)
        elif rest >= 0.0:
            continue
        if not high > low:
            continue
        for i in range(own.rule.shape[1]):
            at[count] = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(own.rule[0, i])
            weight[count] = 0.5 * (high - low) * np.cos(own.rule[0, i]) * own.rule[1, i]
            count += 1
    return count


@kernel
def _normal(g: ContactArrays, pair: _Pair, slot: int, s: float, normal: np.ndarray) -> tuple[float, float, bool]:
    """Write the normal of a slice towards the first cylinder; return the distance of the axes, the coordinate on the second
    axis, and whether this is not at an end.
    """
    other, y = _own(g).halves[slot, 1], pair.apart + s * pair.along[0]
    t = y @ pair.along[1]
    free = abs(t) < other
    t = min(max(t, -other), other)
    for k in range(3):
        normal[k] = y[k] - t * pair.along[1, k]
    size = np.sqrt(normal @ normal)
    if size > 0.0:
        normal /= size
    return float(size), float(t), free


@kernel
def _nearest(g: ContactArrays, pair: _Pair, slot: int) -> tuple[float, float]:
    """Smallest distance of both axes between their ends, m, and its coordinate on the first axis."""
    own, normal = _own(g), np.empty(3)
    half, other = own.halves[slot, 0], own.halves[slot, 1]
    r, a, b = pair.apart, pair.along[0], pair.along[1]
    slope, least, best = a @ b, np.inf, 0.0
    square = 1.0 - slope * slope
    s = 0.0 if square < _PARALLEL else (slope * (r @ b) - r @ a) / square
    for tried in (s, -half, half, other * slope - r @ a, -other * slope - r @ a):
        inside = min(max(tried, -half), half)
        size = _normal(g, pair, slot, inside, normal)[0]
        if size < least:
            least, best = size, inside
    return least, best


@kernel
def _depth(g: ContactArrays, pair: _Pair, slot: int, at: np.ndarray, weight: np.ndarray) -> float:
    """d^(e+1): integral of g^(e+1) over the shorter length."""
    own, normal, total = _own(g), np.empty(3), 0.0
    reach = own.sizes[slot].sum()
    for i in range(_slices(g, pair, slot, at, weight)):
        past = reach - _normal(g, pair, slot, at[i], normal)[0]
        if past > 0.0:
            total += weight[i] * past ** own.power[slot]
    return total / (2.0 * min(own.halves[slot, 0], own.halves[slot, 1]))


@kernel
def _find(g: ContactArrays, poses: np.ndarray, below: float) -> int:
    own, count = _own(g), 0
    at, weight = np.empty(3 * own.rule.shape[1]), np.empty(3 * own.rule.shape[1])
    for slot in range(own.ends.shape[0]):
        pair = _pair(g, poses, slot)
        gap = _nearest(g, pair, slot)[0] - own.sizes[slot].sum()
        if gap < 0.0:
            gap = -(_depth(g, pair, slot, at, weight) ** (1.0 / own.power[slot]))
        if gap < below:
            g.slot[count], g.gap[count] = slot, gap
            count += 1
    return count


class _Slice(NamedTuple):
    """Gradient (12,) of the gap of a slice and its derivatives (12, 12), slip (12, 3) and its derivatives (12, 12, 3)."""

    way: np.ndarray
    bend: np.ndarray
    slip: np.ndarray
    turned: np.ndarray


@kernel
def _arms(g: ContactArrays, slot: int, s: float, t: float, out: np.ndarray) -> None:
    """Points of both axes at a slice, body axes."""
    own = _own(g)
    for k in range(3):
        out[0, k] = own.middles[slot, 0, k] + s * own.axes[slot, 0, k]
        out[1, k] = own.middles[slot, 1, k] + t * own.axes[slot, 1, k]


@kernel
def _slice(g: ContactArrays, pair: _Pair, slot: int, s: float, bent: bool, out: _Slice) -> float:
    """Write the derivatives of a slice, second ones if `bent`; return the distance of the axes."""
    own, normal, arms = _own(g), np.empty(3), np.empty((2, 3))
    size, t, free = _normal(g, pair, slot, s, normal)
    _arms(g, slot, s, t, arms)
    inside, touching, columns = np.empty((2, 3)), np.empty((2, 3)), np.empty((12, 3))
    moved = np.empty((12, 3))  # of the point on the first axis from that on the second, at given s and t
    part, across = np.eye(3), np.eye(3) - np.outer(normal, normal)
    for side in range(2):
        sign, turn = 1.0 - 2.0 * side, pair.turn[side]
        inside[side] = normal @ turn
        touching[side] = arms[side] - sign * own.sizes[slot, side] * inside[side]
        spin = sign * np.cross(arms[side], inside[side])
        for m in range(3):
            out.way[6 * side + m], out.way[6 * side + 3 + m] = sign * normal[m], spin[m]
            moved[6 * side + m], columns[6 * side + m] = sign * part[m], sign * part[m]
            moved[6 * side + 3 + m] = sign * (turn @ np.cross(part[m], arms[side]))
            columns[6 * side + 3 + m] = sign * (turn @ np.cross(part[m], touching[side]))
    for m in range(12):
        out.slip[m] = across @ columns[m]
    if not bent:
        return size
    for n in range(12):
        side, turns = n // 6, n % 6 >= 3
        axis = part[n % 3]
        passed = 0.0
        if free:
            passed = moved[n] @ pair.along[1]
            if turns and side == 1:
                passed += size * (normal @ (pair.turn[1] @ np.cross(axis, own.axes[slot, 1])))
        change = across @ (moved[n] - passed * pair.along[1]) / size
        for other in range(2):
            sign, turn = 1.0 - 2.0 * other, pair.turn[other]
            rotates = turns and other == side
            of_inside = change @ turn
            if rotates:
                of_inside += np.cross(inside[other], axis)
            of_arm = own.axes[slot, 1] * passed if other == 1 else np.zeros(3)
            of_touching = of_arm - sign * own.sizes[slot, other] * of_inside
            spin = sign * (np.cross(of_arm, inside[other]) + np.cross(arms[other], of_inside))
            for m in range(3):
                out.bend[6 * other + m, n], out.bend[6 * other + 3 + m, n] = sign * change[m], spin[m]
                of_column = np.cross(part[m], of_touching)
                if rotates:
                    of_column += np.cross(axis, np.cross(part[m], touching[other]))
                of_columns = sign * (turn @ of_column)
                for row in (6 * other + m, 6 * other + 3 + m):
                    column = columns[row]
                    new = across @ of_columns if row % 6 >= 3 else np.zeros(3)
                    out.turned[row, n] = new - change * (normal @ column) - normal * (change @ column)
    return size


@kernel
def _sums(g: ContactArrays, pair: _Pair, slot: int, bent: bool, out: _Slice) -> None:
    """Write gradient and mean slip of a pair, with their derivatives if `bent`."""
    own = _own(g)
    at, weight = np.empty(3 * own.rule.shape[1]), np.empty(3 * own.rule.shape[1])
    one = _Slice(np.empty(12), np.empty((12, 12)), np.empty((12, 3)), np.empty((12, 12, 3)))
    power, reach = own.power[slot], own.sizes[slot].sum()
    length = 2.0 * min(own.halves[slot, 0], own.halves[slot, 1])
    mean = pushed = 0.0
    thinned = np.zeros(12)  # derivative of `pushed`
    out.way[:], out.bend[:], out.slip[:], out.turned[:] = 0.0, 0.0, 0.0, 0.0
    for i in range(_slices(g, pair, slot, at, weight)):
        past = reach - _slice(g, pair, slot, at[i], bent, one)
        if not past > 0.0:
            continue
        share = weight[i] / length
        mean += share * past**power
        push = share * past ** (power - 1.0)
        pushed += push
        out.way[:] += push * one.way
        out.slip[:] += push * one.slip
        if bent:
            steep = (power - 1.0) * share * past ** (power - 2.0)
            thinned -= steep * one.way
            out.bend[:] += push * one.bend - steep * np.outer(one.way, one.way)
            for n in range(12):
                out.turned[:, n] += push * one.turned[:, n] - steep * one.way[n] * one.slip
    if mean == 0.0:  # not in contact, but within the margin
        _slice(g, pair, slot, _nearest(g, pair, slot)[1], bent, out)
        return
    factor = mean ** (1.0 / power - 1.0)
    out.slip[:] /= pushed
    if bent:
        out.bend[:] = factor * out.bend + (power - 1.0) * factor / mean * np.outer(out.way, out.way)
        for n in range(12):
            out.turned[:, n] = out.turned[:, n] / pushed - thinned[n] / pushed * out.slip
    out.way[:] *= factor


@kernel
def _measure(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    own = _own(g)
    found = _Slice(np.empty(12), np.empty((12, 12)), np.empty((12, 3)), np.empty((12, 12, 3)))
    for i in range(count):
        slot = g.slot[i]
        _sums(g, _pair(g, poses, slot), slot, False, found)
        for end in range(2):
            g.bodies[i, end] = own.ends[slot, end]
        for m in range(12):
            g.gradient[i, 0, m] = found.way[m]
            for c in range(3):
                g.gradient[i, 1 + c, m] = found.slip[m, c]
        g.pull[i] = np.sqrt(dot(found.way, found.way))
        for a in range(4):
            g.rate[i, a] = 0.0
            for m in range(12):
                g.rate[i, a] += g.gradient[i, a, m] * rates[own.ends[slot, m // 6], m % 6]


@kernel
def _tangent(
    g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    found = _Slice(np.empty(12), np.empty((12, 12)), np.empty((12, 3)), np.empty((12, 12, 3)))
    block_k, block_d, change = np.empty((12, 12)), np.empty((12, 12)), np.empty(12)
    for i in range(count):
        slot = g.slot[i]
        _sums(g, _pair(g, poses, slot), slot, True, found)
        add_contact_tangent(
            i, rates, g.bodies[:count], g.gradient[:count], found.bend, found.turned, forces_of(g, 0, count), index_of(g),
            stiffness, damping, block_k, block_d,
        )  # fmt: skip
        if forces_of(g, 0, count).friction:
            for n in range(12):
                change[n] = dot(found.way, found.bend[:, n]) / dot(found.way, found.way)
            add_pull_tangent(
                i, g.bodies[:count], g.gradient[:count], change, forces_of(g, 0, count), index_of(g), stiffness, block_k
            )


@kernel
def _passed(g: ContactArrays, poses: np.ndarray) -> int:
    own = _own(g)
    for slot in range(own.ends.shape[0]):
        if _nearest(g, _pair(g, poses, slot), slot)[0] < _DEEPEST * own.sizes[slot].sum():
            return slot
    return -1


def _build(touching: Touching) -> tuple[ContactTable, ...]:
    """Table of all pairs of cylinders."""
    contact, faults = touching.scene.contact, list[Fault]()
    assert contact is not None
    if contact.restitution is not None:
        text = "the depth is a mean over slices, whose speed is zero at first touch, and `restitution` refers to this speed"
        faults.append(Fault("contact.restitution", f'{text}; give law = "hertz" or "linear" with `damping`'))
    axes = np.empty((len(touching.pairs), 2, 3))
    for (number, _), given, row in zip(touching.pairs, touching.parameters, axes, strict=True):
        for side, key in enumerate(("first_axis", "second_axis")):
            size = float(np.linalg.norm(given[key]))
            if size == 0.0:
                text = "an axis has a direction; give [0, 1, 0], for example"
                faults.append(Fault(f"scene.pairs.{number}.parameters.{key}", text))
            row[side] = np.array(given[key]) / (size or 1.0)
    if faults:
        raise CaseError(faults)
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    radii = np.array([given["radii"] for given in touching.parameters])
    own = CylinderArrays(
        touching.ends,
        np.array([[given["first_at"], given["second_at"]] for given in touching.parameters]),
        axes,
        radii,
        0.5 * np.array([given["lengths"] for given in touching.parameters]),
        np.full(len(radii), 1.0 + (1.0 if contact.law == "linear" else contact.exponent)),
        0.5 * np.pi * np.array([nodes, weights]),
    )
    return (PairContacts(touching, own, float(radii.min()), _find, _measure, _tangent, _passed, means=True),)


GEOMETRIES["cylinder-on-cylinder"] = AddedLaw(
    _build,
    CylinderOnCylinder,
    "sides of two cylinders as independent slices, whose end faces do not touch; with K = pi/4 E* l of parallel ones, "
    "crossed ones are 1.6 (90 degrees) to 3 times (5 degrees) as stiff as by Hertz",
)
