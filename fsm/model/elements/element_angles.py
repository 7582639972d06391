"""Twist angles of force elements: in the given poses, at the start, and at zero moment."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from fsm.case.derived.frame_bodies import quaternion_product
from fsm.case.models.materials import LinearCrease
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.errors import Fault

_AGREED = 1e-3
"""Tolerance of `initial_angle` against the given poses of the bodies, rad."""
_FLAT = 1e-9
"""Twist below which a crease counts as flat at the start (round-off of quaternions), rad."""

_FOLDED = 0.25 * math.pi
"""Initial twist above which a joint counts as a fold, rad."""

_Quaternion = tuple[float, float, float, float]
_GROUNDED: _Quaternion = (1.0, 0.0, 0.0, 0.0)


def initial_twists(elements: Sequence[ForceElement], bodies: Sequence[Body]) -> list[float]:
    """Twist of each element at the start, rad: `initial_angle`, or the twist of the given poses, from -pi to pi."""
    turned = _orientations(bodies)
    return [_placed(e, turned) if e.initial_angle is None else e.initial_angle for e in elements]


def rest_twists(elements: Sequence[ForceElement], initial: Sequence[float]) -> list[float]:
    """Twist of each element at zero moment, rad: `rest_angle`, or the rest angle of the crease law on the initial side,
    or 0.
    """
    return [_rest(element, start) for element, start in zip(elements, initial, strict=True)]


def half_way_swings(elements: Sequence[ForceElement], initial: Sequence[float]) -> np.ndarray:
    """Whether the swing of each element is measured in the axes half-way between its bodies, (m,); see `ForceElement`."""
    return np.array([_is_half_way(element, start) for element, start in zip(elements, initial, strict=True)], dtype=bool)


def _is_half_way(element: ForceElement, start: float) -> bool:
    if element.swing_axes is not None:
        return element.swing_axes == "half-way"
    hinge = element.crease is not None or element.kind in ("crease", "drive") or abs(start) >= _FOLDED
    return not hinge and all(element.rotation)


def angle_faults(scene: Scene) -> Iterator[Fault]:
    """Faults of angles that contradict the given poses or each other, for elements whose bodies exist."""
    turned = _orientations(scene.bodies)
    for i, element in enumerate(scene.elements):
        if element.frame != "outer" or element.inner not in turned or element.outer not in turned:
            continue
        if element.initial_angle is None and element.crease is None:
            continue
        path, placed = f"scene.elements.{i}", _placed(element, turned)
        if element.initial_angle is not None:
            yield from _initial_faults(f"{path}.initial_angle", element.initial_angle, placed)
        if element.crease is None:
            continue
        # measured data may begin at an angle far from zero moment
        limit = math.pi if isinstance(element.crease, LinearCrease) else 2 * math.pi
        if element.rest_angle is not None and abs(element.rest_angle) > limit * (1 + 1e-9):
            what = f"{_degrees(element.rest_angle)} of a crease; it must be between {_degrees(-limit)} and {_degrees(limit)}"
            yield Fault(f"{path}.rest_angle", what)
        own = element.crease.rest_angle
        start = placed if element.initial_angle is None else element.initial_angle
        if element.rest_angle is None or own is None or abs(element.rest_angle - side_of(start) * own) <= _AGREED:
            continue
        signed, other = _degrees(side_of(start) * own), _degrees(element.rest_angle)
        what = f"is a twist of {signed} on the side of the fold, but the element has `rest_angle` {other}; give one of them"
        yield Fault(f"{path}.crease.rest_angle", what)


def _initial_faults(path: str, given: float, placed: float) -> Iterator[Fault]:
    if abs(math.remainder(given - placed, 2 * math.pi)) > _AGREED:
        what = f"{_degrees(given)}, but the bodies as placed make it {_degrees(placed)}; remove this key, or move the bodies"
        yield Fault(path, what)
    elif abs(given) > math.pi + _AGREED:
        what = f"{_degrees(given)} is more than half a turn; give {_degrees(placed)}, and wind a spring by `rest_angle`"
        yield Fault(path, what)


def _rest(element: ForceElement, start: float) -> float:
    if element.rest_angle is not None:
        return element.rest_angle
    own = None if element.crease is None else element.crease.rest_angle
    return 0.0 if own is None else side_of(start) * own


def side_of(start: float, rest: float = 0.0) -> float:
    """Side to which a crease is folded, 1 or -1; for a crease that starts flat, the sign of the rest angle."""
    return math.copysign(1.0, start if abs(start) > _FLAT else rest)


def _placed(element: ForceElement, turned: Mapping[str, _Quaternion]) -> float:
    """Twist of the given poses, psi = 2 atan2(q2, q0) of q = conj(q_b axes_b) q_a axes_a, from -pi to pi, rad."""
    w, x, y, z = quaternion_product(turned[element.outer], element.axes_outer)
    q = quaternion_product((w, -x, -y, -z), quaternion_product(turned[element.inner], element.axes_inner))
    return math.remainder(2.0 * math.atan2(q[2], q[0]), 2 * math.pi)


def _orientations(bodies: Sequence[Body]) -> dict[str, _Quaternion]:
    return {GROUND: _GROUNDED, **{body.name: body.orientation for body in bodies}}


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.5g} deg"
