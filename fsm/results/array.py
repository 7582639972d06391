"""How the points of a scissor array move and what its bars bear, at the records of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["ArrayMotion", "PointMotion", "asynchronism", "largest_differences"]

Floats = NDArray[np.float64]

_PARALLEL = 1e-6
"""Difference of two unit vectors below which they are one."""


@dataclass(frozen=True)
class PointMotion:
    """Points in the plane of the array, (n, n_points, 2) arrays over time.

    Attributes
    ----------
    displacement : m, from where the point starts
    velocity, acceleration : m/s, m/s^2
    """

    displacement: Floats
    velocity: Floats
    acceleration: Floats


@dataclass(frozen=True)
class ArrayMotion:
    """A scissor array over time.

    Attributes
    ----------
    point_names : a1, a2, ..., b1, ..., h1, ...
    start : (n_points, 2) array, m
    points : PointMotion
    rigid : PointMotion
        Of the same array with rigid bars; None where there is none.
    bar_names : tuple of str
    stress : (n, n_bars) array, Pa
        Largest normal stress in each bar; without bars that deform, (n, 0).
    """

    point_names: tuple[str, ...]
    start: Floats
    points: PointMotion
    rigid: PointMotion | None
    bar_names: tuple[str, ...]
    stress: Floats

    def of(self, name: str) -> int:
        """Number of a point."""
        return self.point_names.index(name)

    @property
    def upper(self) -> tuple[str, ...]:
        """Names of the points a1, a2, ..."""
        return tuple(name for name in self.point_names if name.startswith("a"))


def largest_differences(motion: ArrayMotion) -> dict[str, float]:
    """Largest |flexible - rigid| of all points over time: displacement along x and y (m), velocity, acceleration (SI)."""
    if motion.rigid is None:
        return {}
    moved = np.abs(motion.points.displacement - motion.rigid.displacement)
    return {
        "displacement_x": float(moved[..., 0].max()),
        "displacement_y": float(moved[..., 1].max()),
        "velocity": float(np.linalg.norm(motion.points.velocity - motion.rigid.velocity, axis=-1).max()),
        "acceleration": float(np.linalg.norm(motion.points.acceleration - motion.rigid.acceleration, axis=-1).max()),
    }


def asynchronism(motion: ArrayMotion) -> dict[str, Floats]:
    """How far neighbours among a2, a3, ... are apart in their deployment as bars deform, over time: name a2-a3 and (n,), m.

    The difference of what they have moved across the array, less that of the array with rigid bars where there is one. In a
    straight array that is their displacement along the common direction from b to a. In an arched array or a ring every unit
    has its own: the change of the distance from b to a, which is the same for all units that deploy together.
    """
    found: dict[str, Floats] = {}
    moved = _across(motion, motion.points)
    expected = np.zeros_like(moved) if motion.rigid is None else _across(motion, motion.rigid)
    apart = dict(zip(motion.upper, (moved - expected).T, strict=True))
    for first, second in zip(motion.upper[1:-1], motion.upper[2:], strict=False):
        found[f"{first}-{second}"] = apart[first] - apart[second]
    return found


def _across(motion: ArrayMotion, points: PointMotion) -> Floats:
    """What a1, a2, ... have moved across the array, (n, n_upper), m."""
    upper = [motion.of(name) for name in motion.upper]
    lower = [motion.of("b" + name[1:]) for name in motion.upper]
    start = motion.start[upper] - motion.start[lower]
    length = np.linalg.norm(start, axis=1)
    direction = start / length[:, None]
    if np.all(np.abs(direction - direction[0]) < _PARALLEL):
        return np.asarray(points.displacement[:, upper] @ direction[0])
    now = start + points.displacement[:, upper] - points.displacement[:, lower]
    return np.asarray(np.linalg.norm(now, axis=2) - length)
