"""Points and bars of a scissor array, by the kinematics of rigid units.

A unit has its hinge at the origin and is symmetric about y. The semi-lengths are p (hinge to upper ends) and q (hinge to
lower ends). Each bar has a kink kappa at the hinge. The bar's angle with x is phi + kappa/2 below the hinge, and phi -
kappa/2 above it. The right ends of the unit are

    p (cos(phi - kappa/2), sin(phi - kappa/2)) above,   q (cos(phi + kappa/2), -sin(phi + kappa/2)) below,

and its left ends are their mirror images. The right line of a unit joins its right ends, and is the left line of the next
unit. With p = q and kappa = 0 the lines are parallel (linear array). With p = q and kappa = 2 pi/n the lines meet at
the angle 2 pi/n for every phi (angulated element of a ring). Otherwise the angle of the lines depends on phi (arched
array).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fsm.case.models.scissor import Scissor
from fsm.errors import Fault

Point = tuple[float, float]


@dataclass(frozen=True)
class Bar:
    """Bar with the names of its points: left end, hinge, right end."""

    name: str
    points: tuple[str, str, str]


@dataclass(frozen=True)
class Array:
    """Points (m) by name, and bars from left to right; `centre` is the centre of a ring or an arch, None for a straight
    array.
    """

    points: dict[str, Point]
    bars: tuple[Bar, ...]
    units: int
    closed: bool
    centre: Point | None


def build_array(scissor: Scissor) -> tuple[Array, list[Fault]]:
    """Array in its initial state, and the faults of an array that cannot exist."""
    array = array_at(scissor, scissor.initial_angle)
    faults = []
    least, given = math.pi / scissor.units, scissor.initial_angle
    if scissor.shape == "ring" and not least < given < 0.5 * math.pi - least:
        why = "fully deployed" if given <= least else "across the centre"
        faults.append(
            Fault(
                "scissor.initial_angle",
                f"{math.degrees(given):g} deg: the bars of a ring of {scissor.units} units would be {why}; give an angle "
                f"between {math.degrees(least):.4g} and {90.0 - math.degrees(least):.4g} deg",
            )
        )
    turn = 2.0 * _half_line(scissor, scissor.initial_angle)
    if scissor.shape == "arched" and abs(turn) * scissor.units >= 2.0 * math.pi:
        most = int(2.0 * math.pi / abs(turn))
        faults.append(
            Fault(
                "scissor.units",
                f"{scissor.units} units with {math.degrees(turn):.4g} deg each exceed 360 deg and would overlap; at most "
                f"{most} units fit at this initial_angle",
            )
        )
    return array, faults


def array_at(scissor: Scissor, angle: float) -> Array:
    """Array of rigid bars at an angle of the bars (rad), with b1 at the origin and a1 above it."""
    closed = scissor.shape == "ring"
    number = scissor.units
    (right_a, right_b), half = _right_ends(scissor, angle), _half_line(scissor, angle)
    height = math.dist(right_a, right_b)
    # positions of the hinge and of the right line of a unit; its left line is on the y axis, and its point b is at the
    # origin
    hinge = _turned((right_b[0], -right_b[1]), -half)
    rest = _turned(right_b, -half)
    away = (hinge[0] + rest[0], hinge[1] + rest[1])
    points: dict[str, Point] = {}
    at, turn = (0.0, 0.0), 0.0
    bars = []
    for k in range(1, number + 1):
        following = 1 if closed and k == number else k + 1
        up = _turned((0.0, height), turn)
        points[f"b{k}"], points[f"a{k}"] = at, (at[0] + up[0], at[1] + up[1])
        step = _turned(hinge, turn)
        points[f"h{k}"] = (at[0] + step[0], at[1] + step[1])
        bars.append(Bar(f"bar {k}.1", (f"b{k}", f"h{k}", f"a{following}")))
        bars.append(Bar(f"bar {k}.2", (f"a{k}", f"h{k}", f"b{following}")))
        step = _turned(away, turn)
        at, turn = (at[0] + step[0], at[1] + step[1]), turn - 2.0 * half
    if not closed:
        up = _turned((0.0, height), turn)
        points[f"b{number + 1}"], points[f"a{number + 1}"] = at, (at[0] + up[0], at[1] + up[1])
    return Array(points, tuple(bars), number, closed, _centre(right_b, hinge, half))


def _semi_lengths(scissor: Scissor) -> tuple[float, float]:
    return (1.0 - scissor.hinge) * scissor.bar_length, scissor.hinge * scissor.bar_length


def _right_ends(scissor: Scissor, angle: float) -> tuple[Point, Point]:
    """Upper and lower right end of a unit, relative to the hinge of the unit."""
    p, q = _semi_lengths(scissor)
    kink = 2.0 * math.pi / scissor.units if scissor.shape == "ring" else 0.0
    above, below = angle - 0.5 * kink, angle + 0.5 * kink
    return (p * math.cos(above), p * math.sin(above)), (q * math.cos(below), -q * math.sin(below))


def _half_line(scissor: Scissor, angle: float) -> float:
    """Angle between the right line of a unit and its axis of symmetry, rad; positive if the lines meet below."""
    above, below = _right_ends(scissor, angle)
    return math.atan2(above[0] - below[0], above[1] - below[1])


def _turned(point: Point, angle: float) -> Point:
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * point[0] - sine * point[1], sine * point[0] + cosine * point[1]


def _centre(below: Point, hinge: Point, half: float) -> Point | None:
    """Intersection of the lines of all units, which lies on the first line, x = 0; None for parallel lines."""
    if abs(math.sin(half)) < 1e-12:
        return None
    # the centre lies on the axis of symmetry of the first unit, which passes through its hinge and makes the angle
    # `half` with x = 0
    return 0.0, hinge[1] - hinge[0] / math.tan(half)
