"""Datasets of a results file that are of scissor arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.results.array import ArrayMotion, PointMotion
from fsm.results.datasets import add_scale, described

__all__ = ["read_array", "write_array"]

_MOTIONS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}


def write_array(file: Any, motion: ArrayMotion) -> None:
    """Points and bars of an array, along the times that are there."""
    add_scale(file, "point", list(motion.point_names), "point of the array")
    add_scale(file, "bar", list(motion.bar_names), "bar")
    add_scale(file, "plane_axis", ["x", "y"], "axis of the array's plane; y is z in the shape")
    _write(file, "points/start", motion.start, "m", "where the point starts", ("point", "plane_axis"))
    for prefix, points in (("", motion.points), ("rigid_", motion.rigid)):
        if points is not None:
            for name, units in _MOTIONS.items():
                what = f"{name} of the point{', bars being rigid' if prefix else ''}"
                _write(file, f"points/{prefix}{name}", getattr(points, name), units, what, ("time", "point", "plane_axis"))
    if motion.stress.shape[1]:
        _write(file, "bars/stress", motion.stress, "Pa", "largest normal stress in the bar", ("time", "bar"))


def read_array(file: Any) -> ArrayMotion | None:
    """The array of a results file; None if it is of something else, or did not finish."""
    if "points" not in file:
        return None
    group = file["points"]
    rigid = "rigid_displacement" in group
    bars = tuple(file["bar"].asstr()[()].tolist())
    count = len(group["displacement"])
    return ArrayMotion(
        point_names=tuple(file["point"].asstr()[()].tolist()),
        start=group["start"][()],
        points=PointMotion(**{name: group[name][()] for name in _MOTIONS}),
        rigid=PointMotion(**{name: group[f"rigid_{name}"][()] for name in _MOTIONS}) if rigid else None,
        bar_names=bars,
        stress=file["bars/stress"][()] if "bars" in file else np.zeros((count, 0)),
    )


def _write(file: Any, path: str, values: Any, units: str, text: str, dims: tuple[str, ...]) -> None:
    data = file.create_dataset(path, data=values)
    described(data, units, text)
    for axis, dim in enumerate(dims):
        data.dims[axis].attach_scale(file[dim])
