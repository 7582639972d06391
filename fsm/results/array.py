"""How the points of a scissor array move and what its bars bear, at the records of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["ArrayMotion", "PointMotion", "asynchronism", "largest_differences"]

Floats = NDArray[np.float64]


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
    """How far neighbours among a2, a3, ... are apart in height as bars deform, over time: name a2-a3 and (n,), m.

    The difference of their displacements along y, less that of the array with rigid bars where there is one (in a straight
    array that is zero).
    """
    found: dict[str, Floats] = {}
    heights = motion.points.displacement[..., 1]
    expected = np.zeros_like(heights) if motion.rigid is None else motion.rigid.displacement[..., 1]
    for first, second in zip(motion.upper[1:-1], motion.upper[2:], strict=False):
        i, j = motion.of(first), motion.of(second)
        found[f"{first}-{second}"] = (heights[:, i] - expected[:, i]) - (heights[:, j] - expected[:, j])
    return found
