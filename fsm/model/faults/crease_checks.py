"""Checks of tabulated crease curves: softening too steep for the adjacent half segments, and scatter in the data.

The checks need no compilation. `fsm check` and `fsm run` use the same checks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.case.models.materials import SplineCrease
from fsm.case.models.scene import ForceElement, Scene
from fsm.errors import Fault
from fsm.kernels.interpolation import interpolate

_SUBDIVISIONS = 32
"""Number of points in each interval of the data where the slope is checked; as in `add_flexibility`."""
_LEVEL = 0.01
"""Fraction of the mean slope below which a slope counts as zero."""
_SCATTER = 3
"""Number of changes between rising and falling that indicates scatter; a bistable crease has two."""
_SLIGHT = 0.05
"""A decrease against the trend counts as scatter below this fraction of the range of the data."""
_CALIBRATE = "smooth it by `fsm calibrate crease DATA.csv --out DIR`, write crease = {{ file = \"DIR/crease.h5\" }}{where}"
_PCHIP = 'write interpolation = "pchip"'


def crease_faults(scene: Scene, of_strip: bool) -> Iterator[Fault]:
    """Faults of creases whose moment decreases too steeply for the half segments in series with them, 1 + M' f <= 0."""
    for path, element, branches in _tabulated(scene, of_strip):
        steepest = min((branch.steepest for branch in branches), key=lambda found: found[1])
        opening, slope = steepest
        limit = 1.0 / element.crease_flexibility if element.crease_flexibility else np.inf
        if -slope < limit:
            continue
        if any(branch.overshoots for branch in branches):
            remedy = f"the spline overshoots between monotone data: {_PCHIP}"
        elif any(branch.scattered for branch in branches):
            remedy = f"the curve follows scatter of the data: {_CALIBRATE.format(where='')}"
        else:
            remedy = f"use segments {math.ceil(1.01 * -slope / limit)} times shorter, or half_cell = false"
        what = (
            f"at an opening of {np.degrees(opening):.4g} deg the tangent stiffness of the crease is {slope:.4g} N m/rad; in "
            f"series with its half segments it must be above {-limit:.4g}; {remedy}"
        )
        yield Fault(path, what)


def crease_warnings(scene: Scene, of_strip: bool) -> list[str]:
    """Warning for each curve whose extrema come from scatter, or that has an extremum between monotone data."""
    lines = []
    for path, _, branches in _tabulated(scene, of_strip):
        branch = max(branches, key=lambda each: each.changes)
        opening, slope = branch.steepest
        lowest = f"local stiffness down to {slope:.3g} N m/rad at {np.degrees(opening):.4g} deg, mean {branch.mean:.3g}"
        if branch.overshoots:
            lines.append(f"{path}: the spline overshoots between monotone data ({lowest}); {_PCHIP}")
        elif branch.scattered:
            remedy = _CALIBRATE.format(where=" if that is scatter")
            times = "once" if branch.changes == 1 else f"{branch.changes} times"
            lines.append(f"{path}: the moment changes {times} between rising and falling ({lowest}); {remedy}")
    return lines


@dataclass(frozen=True)
class _Branch:
    """Measured branch of a curve: angle (rad), moment (N m) and its interpolation."""

    angle: np.ndarray
    moment: np.ndarray
    interpolation: str

    @property
    def mean(self) -> float:
        """Slope of the straight line through the ends, N m/rad."""
        return float((self.moment[-1] - self.moment[0]) / (self.angle[-1] - self.angle[0]))

    @cached_property
    def slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """Openings (rad) and slopes there (N m/rad)."""
        parts = np.arange(_SUBDIVISIONS) / _SUBDIVISIONS
        inner = (self.angle[:-1, None] + np.diff(self.angle)[:, None] * parts).ravel()
        opening = np.append(inner, self.angle[-1])
        return opening, interpolate(self.angle, self.moment, self.interpolation)(opening, 1)

    @property
    def steepest(self) -> tuple[float, float]:
        """Opening at which the moment falls most steeply, and the slope there."""
        opening, slope = self.slopes
        worst = int(np.argmin(slope))
        return float(opening[worst]), float(slope[worst])

    @property
    def changes(self) -> int:
        """Number of changes of the curve between rising and falling."""
        return self._changes(self.slopes[1])

    @property
    def overshoots(self) -> bool:
        """Whether the curve has an extremum that the straight lines between the data do not have."""
        return self.changes > 0 and self._changes(np.diff(self.moment) / np.diff(self.angle)) == 0

    @property
    def scattered(self) -> bool:
        """Whether the curve has many extrema, or a small decrease against its trend."""
        steps = np.diff(self.moment)
        against = min(steps[steps > 0].sum(), -steps[steps < 0].sum())
        slight = self.changes > 0 and against < _SLIGHT * np.ptp(self.moment)
        return bool(self.changes >= _SCATTER or slight)

    def _changes(self, slope: np.ndarray) -> int:
        scale = float(np.ptp(self.moment) / np.ptp(self.angle))
        clear = np.sign(slope[np.abs(slope) > _LEVEL * scale])
        return int(np.count_nonzero(np.diff(clear)))


def _tabulated(scene: Scene, of_strip: bool) -> Iterator[tuple[str, ForceElement, list[_Branch]]]:
    """Path, element and branches of each curve; the element is the one with the most flexible half segments in
    series.
    """
    found: dict[int, tuple[str, ForceElement]] = {}
    for index, element in enumerate(scene.elements):
        crease = element.crease
        if not isinstance(crease, SplineCrease) or crease.angle is None or crease.moment is None:
            continue
        path = "crease" if of_strip else f"scene.elements.{index}.crease"
        path, worst = found.setdefault(id(crease), (path, element))
        if element.crease_flexibility > worst.crease_flexibility:
            found[id(crease)] = (path, element)
    for path, element in found.values():
        crease = element.crease
        assert isinstance(crease, SplineCrease) and crease.angle is not None and crease.moment is not None
        moments = [crease.moment, *([] if crease.unloading is None else [crease.unloading])]
        angle = np.array(crease.angle)
        yield path, element, [_Branch(angle, crease.scale * np.array(moment), crease.interpolation) for moment in moments]
