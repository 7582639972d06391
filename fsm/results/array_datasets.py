"""Datasets of a scissor array in a results file."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.io.hdf5_checked import names_in, numbers_in
from fsm.results.array import ArrayMotion, PointMotion
from fsm.results.datasets import add_data, add_scale

_MOTIONS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}


def write_array(file: Any, motion: ArrayMotion) -> None:
    """Write points and bars of an array; the file already holds the times."""
    add_scale(file, "point", list(motion.point_names), "point of the array")
    add_scale(file, "bar", list(motion.bar_names), "bar")
    add_scale(file, "plane_axis", ["x", "y"], "axis of the array's plane; y is z in the shape")
    add_data(file, "points/start", motion.start, "m", "where the point starts", ("point", "plane_axis"))
    for prefix, points in (("", motion.points), ("rigid_", motion.rigid)):
        if points is not None:
            for name, units in _MOTIONS.items():
                what = f"{name} of the point{', bars being rigid' if prefix else ''}"
                add_data(file, f"points/{prefix}{name}", getattr(points, name), units, what, ("time", "point", "plane_axis"))
    if motion.stress.shape[1]:
        add_data(file, "bars/stress", motion.stress, "Pa", "largest normal stress in the bar", ("time", "bar"))
        if motion.stress_error is not None:
            add_data(file, "bars/stress_error", [motion.stress_error], "1", "relative error of the largest stress", ())


def read_array(file: Any, count: int) -> ArrayMotion | None:
    """Read the array from a results file with `count` records; None for another structure or an unfinished run."""
    if "points" not in file:
        return None
    points, bars = names_in(file, "point"), names_in(file, "bar")
    return ArrayMotion(
        point_names=points,
        start=numbers_in(file, "points/start", (len(points), 2)),
        points=_motion(file, "", count, len(points)),
        rigid=_motion(file, "rigid_", count, len(points)) if "points/rigid_displacement" in file else None,
        bar_names=bars,
        stress=numbers_in(file, "bars/stress", (count, len(bars))) if "bars" in file else np.zeros((count, 0)),
        stress_error=float(numbers_in(file, "bars/stress_error", (1,))[0]) if "bars/stress_error" in file else None,
    )


def _motion(file: Any, prefix: str, count: int, points: int) -> PointMotion:
    shape = (count, points, 2)
    return PointMotion(**{name: numbers_in(file, f"points/{prefix}{name}", shape) for name in _MOTIONS})

