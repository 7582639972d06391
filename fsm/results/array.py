"""Motion of the points of a scissor array and stress of its bars, at the records of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fsm.text.short_repr import ShortRepr

Floats = NDArray[np.float64]

_PARALLEL = 1e-6
"""Largest difference of two unit vectors that count as parallel."""


@dataclass(frozen=True, repr=False)
class PointMotion(ShortRepr):
    """Motion of all points in the plane of the array: (n, n_points, 2) arrays over time.

    Attributes
    ----------
    displacement : m, relative to the initial position
    velocity, acceleration : m/s, m/s^2
    """

    displacement: Floats
    velocity: Floats
    acceleration: Floats


@dataclass(frozen=True, repr=False)
class ArrayMotion(ShortRepr):
    """Motion of a scissor array.

    Attributes
    ----------
    point_names : a1, a2, ..., b1, ..., h1, ...
    start : (n_points, 2) array, m
    points : PointMotion
    rigid : PointMotion or None
        Motion of the same array with rigid bars, if it was computed.
    bar_names : tuple of str
    stress : (n, n_bars) array, Pa
        Largest normal stress in each bar; (n, 0) if all bars are rigid.
    stress_error : float or None
        Relative error of the largest stress; None if unknown.
    """

    point_names: tuple[str, ...]
    start: Floats
    points: PointMotion
    rigid: PointMotion | None
    bar_names: tuple[str, ...]
    stress: Floats
    stress_error: float | None = None

    def point_index(self, name: str) -> int:
        """Index of a point along the second axis of the arrays."""
        return self.point_names.index(name)

    @property
    def upper(self) -> tuple[str, ...]:
        """Names of the upper points a1, a2, ..."""
        return tuple(name for name in self.point_names if name.startswith("a"))


def largest_differences(motion: ArrayMotion) -> dict[str, float]:
    """Largest |flexible - rigid| over all points and times: displacement along x and y (m), velocity, acceleration (SI).

    The dict is empty if the array with rigid bars was not computed.
    """
    if motion.rigid is None:
        return {}
    difference = np.abs(motion.points.displacement - motion.rigid.displacement)
    return {
        "displacement_x": float(difference[..., 0].max()),
        "displacement_y": float(difference[..., 1].max()),
        "velocity": float(np.linalg.norm(motion.points.velocity - motion.rigid.velocity, axis=-1).max()),
        "acceleration": float(np.linalg.norm(motion.points.acceleration - motion.rigid.acceleration, axis=-1).max()),
    }


def asynchronism(motion: ArrayMotion) -> dict[str, Floats]:
    """Difference in deployment of neighbouring upper points over time, by name "a2-a3", (n,) arrays, m.

    The deployment of a point is its displacement across the array, minus the displacement with rigid bars if known.
    In a straight array this displacement is measured along the common direction from b to a.
    In an arched array or a ring it is the change of the distance from b to a. Units that deploy together have the same
    value.
    """
    found: dict[str, Floats] = {}
    flexible = _transverse_displacement(motion, motion.points)
    rigid = np.zeros_like(flexible) if motion.rigid is None else _transverse_displacement(motion, motion.rigid)
    deployment = dict(zip(motion.upper, (flexible - rigid).T, strict=True))
    for first, second in zip(motion.upper[1:-1], motion.upper[2:], strict=False):
        found[f"{first}-{second}"] = deployment[first] - deployment[second]
    return found


def _transverse_displacement(motion: ArrayMotion, points: PointMotion) -> Floats:
    """Displacement of the upper points across the array, (n, n_upper), m."""
    upper = [motion.point_index(name) for name in motion.upper]
    lower = [motion.point_index("b" + name[1:]) for name in motion.upper]
    start = motion.start[upper] - motion.start[lower]
    length = np.linalg.norm(start, axis=1)
    direction = start / length[:, None]
    if np.all(np.abs(direction - direction[0]) < _PARALLEL):
        return np.asarray(points.displacement[:, upper] @ direction[0])
    now = start + points.displacement[:, upper] - points.displacement[:, lower]
    return np.asarray(np.linalg.norm(now, axis=2) - length)
