"""Family of crease curves over press time and opening number, in one HDF5 file for use in cases.

Layout, all in SI::

    /            attributes: format, version, interpolation ("cubic" or "pchip"), width (m, NaN if not stated),
                 relaxation: theta_r0 (rad), A (rad), tau (s) and the longest time measured (s), NaN if not tested
    /curves/NNN  attributes: press_time (s) and opening (NaN if the test does not state them), repeats
        angle, loading, loading_error             (n,) rad, N m; standard errors
        unloading, unloading_error                (n,), only if the test has an unloading branch

`fsm calibrate crease` writes this file. Between measured curves, the moment at each angle is interpolated linearly in the
logarithm of the press time and in the opening number. There is no extrapolation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fsm.errors import CaseError, Fault
from fsm.io import hdf5_checked as checked

FORMAT = "fsm crease family"
VERSION = 1
_POINTS = 201
"""Number of angles of an interpolated curve."""
_MOST = 100_000
"""Largest number of angles of a measured curve."""
_OVERLAP = 0.5
"""Smallest common range of two curves that are interpolated, relative to the shorter of their ranges."""
_COLUMNS = ("loading", "loading_error", "unloading", "unloading_error")


@dataclass(frozen=True)
class FamilyCurve:
    """Curve of a family.

    Attributes
    ----------
    angle : (n,) array, rad, increasing
    loading, loading_error : (n,) arrays, N m
        Moment while the crease opens, and its standard error.
    unloading, unloading_error : (n,) arrays, N m, or None
        Moment while the crease closes again, and its standard error.
    press_time : s, or None if the test does not state it
    opening : -, or None
        Number of times that the crease was opened, including this test.
    repeats : int
    """

    angle: np.ndarray
    loading: np.ndarray
    loading_error: np.ndarray
    unloading: np.ndarray | None = None
    unloading_error: np.ndarray | None = None
    press_time: float | None = None
    opening: float | None = None
    repeats: int = 1

    @property
    def name(self) -> str:
        """Name of the curve in messages and figures."""
        parts = []
        if self.press_time is not None:
            parts.append(f"pressed {time_text(self.press_time)}")
        if self.opening is not None:
            parts.append(f"opening {self.opening:g}")
        return ", ".join(parts) or "curve"


@dataclass(frozen=True)
class Relaxation:
    """Rest angle (rad from flat) after release: theta_r(t) = start + slope log(1 + t/tau), for t up to `longest` (s)."""

    start: float
    slope: float
    tau: float
    longest: float

    def at(self, time: float) -> float:
        """Rest angle (rad) at a time (s) after release."""
        return self.start + self.slope * math.log1p(time / self.tau)


@dataclass(frozen=True)
class CreaseFamily:
    """Measured curves of creases.

    Attributes
    ----------
    curves : tuple of FamilyCurve
    interpolation : "cubic" or "pchip"
        Interpolation of the moment in the angle.
    width : m, of the tested creases; None if it is not stated
    relaxation : relaxation of the rest angle, or None
    """

    curves: tuple[FamilyCurve, ...]
    interpolation: str
    width: float | None = None
    relaxation: Relaxation | None = None


def time_text(seconds: float) -> str:
    """Time with a suitable unit: 30 s, 10 min, 1.5 h, 2 day."""
    for unit, size in (("day", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= size:
            return f"{seconds / size:.4g} {unit}"
    return f"{seconds:.4g} s"


def write_family(family: CreaseFamily, file: Path) -> None:
    """Write a family to a new file."""
    with checked.written_from_memory(file) as target:
        target.attrs.update(
            format=checked.fixed_text(FORMAT),
            version=VERSION,
            interpolation=checked.fixed_text(family.interpolation),
            width=_or_nan(family.width),
            relaxation=[math.nan] * 4 if family.relaxation is None else astuple(family.relaxation),
        )
        for number, curve in enumerate(family.curves):
            group = target.create_group(f"curves/{number:03d}")
            group.attrs.update(
                press_time=_or_nan(curve.press_time), opening=_or_nan(curve.opening), repeats=curve.repeats
            )
            group["angle"] = curve.angle
            group["angle"].attrs["unit"] = "rad"
            for name in _COLUMNS:
                values = getattr(curve, name)
                if values is not None:
                    group[name] = values
                    group[name].attrs["unit"] = "N m"


def read_family(file: Path, path: str = "crease.file") -> CreaseFamily:
    """Read a family.

    Parameters
    ----------
    file : Path
    path : str
        Dotted path of the key that names the file, for messages.

    Raises
    ------
    CaseError
        The file does not exist, or it is not a valid family.
    """
    import h5py

    if not file.is_file():
        raise CaseError(Fault(path, f"cannot read {file}: no such file; create the file by `fsm calibrate crease`"))
    try:
        if not checked.has_checksums(file):
            raise ValueError("not HDF5, or HDF5 of an old layout")
        with h5py.File(file, "r") as source:
            checked.check_contents(source)
            if checked.attribute(source, "format") != FORMAT or int(checked.attribute(source, "version")) != VERSION:
                raise ValueError("another format or version")
            groups = [source["curves"][name] for name in sorted(source["curves"].keys())]
            if not all(isinstance(group, h5py.Group) for group in groups):
                raise ValueError("a curve is not an HDF5 group")
            curves = tuple(_read_curve(group) for group in groups)
            law = [float(number) for number in checked.attribute(source, "relaxation")]
            family = CreaseFamily(
                curves,
                str(checked.attribute(source, "interpolation")),
                _or_none(checked.attribute(source, "width")),
                None if math.isnan(law[0]) else Relaxation(*law),
            )
    except checked.READ_ERRORS as error:
        text = " ".join(str(error).split())[:80]
        what = f"{file} is not a crease family of version {VERSION} ({text}); create the file by `fsm calibrate crease`"
        raise CaseError(Fault(path, what)) from None
    remedy = "create the file again by `fsm calibrate crease`"
    if not curves or not all(_is_valid(curve) for curve in curves):
        raise CaseError(Fault(path, f"{file} has no curve, or an invalid one; {remedy}"))
    if family.relaxation is not None and not _is_possible(family.relaxation):
        raise CaseError(Fault(path, f"{file} has a relaxation with impossible parameters; {remedy}"))
    return family


def family_curve(
    family: CreaseFamily, press_time: float | None, opening: float | None, path: str = "crease"
) -> FamilyCurve:
    """Curve for a press time (s) and an opening number, measured or interpolated between measured curves.

    Raises
    ------
    CaseError
        A required press time or opening number is missing or outside the measured range.
    """
    faults = [
        *_choice_faults([c.press_time for c in family.curves], press_time, f"{path}.press_time"),
        *_choice_faults([c.opening for c in family.curves], opening, f"{path}.opening"),
    ]
    if faults:
        raise CaseError(faults)
    corners = [
        (weight_time * weight_opening, at_time, at_opening)
        for weight_time, at_time in _between([c.press_time for c in family.curves], press_time, logarithmic=True)
        for weight_opening, at_opening in _between([c.opening for c in family.curves], opening, logarithmic=False)
    ]
    parts = [(weight, _measured(family, t, o, path)) for weight, t, o in corners]
    if len(parts) == 1:
        return parts[0][1]
    return _mixed(parts, press_time, opening, path)


def rest_angle(family: CreaseFamily, since_release: float, path: str = "crease") -> float:
    """Rest angle (rad from flat) at a time (s) after the release of the crease.

    Raises
    ------
    CaseError
        The file has no relaxation, or the time exceeds the longest measured time.
    """
    law, shown = family.relaxation, time_text(since_release)
    if law is None:
        what = f"is {shown}, but the file has no relaxation; calibrate it with the creases, or give rest_angle"
        raise CaseError(Fault(f"{path}.since_release", what))
    if since_release > law.longest * (1.0 + 1e-9):
        what = f"must be at most {time_text(law.longest)}, the longest measured time; it is {shown}: extend the test"
        raise CaseError(Fault(f"{path}.since_release", f"{what}, or give rest_angle"))
    return law.at(since_release)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _or_none(value: Any) -> float | None:
    return None if math.isnan(value) else float(value)


def _read_curve(group: Any) -> FamilyCurve:
    count = int(group["angle"].size)  # this check comes before the reading, because the declared size may exceed the memory
    if count > _MOST:
        raise ValueError(f"{group.name} has {count} angles; at most {_MOST} are allowed")
    columns = {name: checked.numbers_in(group, name, (count,)) for name in _COLUMNS if name in group}
    return FamilyCurve(
        angle=checked.numbers_in(group, "angle", (count,)),
        press_time=_or_none(checked.attribute(group, "press_time")),
        opening=_or_none(checked.attribute(group, "opening")),
        repeats=int(checked.attribute(group, "repeats")),
        loading=columns.pop("loading"),
        loading_error=columns.pop("loading_error"),
        **columns,
    )


def _is_valid(curve: FamilyCurve) -> bool:
    arrays = [curve.loading, curve.loading_error, *(a for a in (curve.unloading, curve.unloading_error) if a is not None)]
    angle = curve.angle
    same = all(array.shape == angle.shape and np.isfinite(array).all() for array in arrays)
    return angle.ndim == 1 and len(angle) >= 2 and bool(np.isfinite(angle).all() and np.all(np.diff(angle) > 0)) and same


def _is_possible(law: Relaxation) -> bool:
    return all(map(math.isfinite, astuple(law))) and law.tau > 0.0 and law.longest >= 0.0


def _choice_faults(measured: Sequence[float | None], wanted: float | None, path: str) -> list[Fault]:
    """Fault of a press time or an opening number that is missing or outside the measured range."""
    stated = sorted({value for value in measured if value is not None})
    is_time = path.endswith("press_time")
    text = [time_text(value) if is_time else f"{value:g}" for value in stated]
    if wanted is None:
        if len(stated) < 2:
            return []
        return [Fault(path, f"missing; the measured values are {', '.join(text)}, give one of them or a value between")]
    shown = time_text(wanted) if is_time else f"{wanted:g}"
    if not stated:
        return [Fault(path, f"is {shown}, but the tests in the file do not state it; remove this key")]
    if not stated[0] <= wanted <= stated[-1]:
        low, high = (text[0], text[-1])
        where = low if low == high else f"between {low} and {high}"
        return [Fault(path, f"must be {where}, as measured; it is {shown}: extend the test, or give a measured value")]
    return []


def _between(
    measured: Sequence[float | None], wanted: float | None, logarithmic: bool
) -> list[tuple[float, float | None]]:
    """Measured neighbours of a value, with their weights."""
    stated = sorted({value for value in measured if value is not None})
    if not stated:
        return [(1.0, None)]
    if wanted is None or wanted in stated:
        return [(1.0, stated[0] if wanted is None else wanted)]
    above = next(i for i, value in enumerate(stated) if value > wanted)
    low, high = stated[above - 1], stated[above]
    if logarithmic and low > 0.0:
        part = math.log(wanted / low) / math.log(high / low)
    else:
        part = (wanted - low) / (high - low)
    return [(1.0 - part, low), (part, high)]


def _measured(family: CreaseFamily, press_time: float | None, opening: float | None, path: str) -> FamilyCurve:
    for curve in family.curves:
        if curve.press_time == press_time and curve.opening == opening:
            return curve
    wanted = FamilyCurve(np.zeros(0), np.zeros(0), np.zeros(0), press_time=press_time, opening=opening).name
    there = "; ".join(curve.name for curve in family.curves)
    raise CaseError(Fault(path, f"requires the curve {wanted}, which was not measured; the measured curves are: {there}"))


def _mixed(
    parts: Sequence[tuple[float, FamilyCurve]], press_time: float | None, opening: float | None, path: str
) -> FamilyCurve:
    """Weighted mean of curves over their common range."""
    low = max(curve.angle[0] for _, curve in parts)
    high = min(curve.angle[-1] for _, curve in parts)
    shortest = min(float(np.ptp(curve.angle)) for _, curve in parts)
    if high - low < _OVERLAP * shortest:
        ranges = ", ".join(
            f"{math.degrees(curve.angle[0]):.4g} to {math.degrees(curve.angle[-1]):.4g} deg" for _, curve in parts
        )
        text = f"lies between curves whose ranges ({ranges}) overlap by less than half; choose a measured curve"
        raise CaseError(Fault(path, text))
    angle = np.linspace(low, high, _POINTS)
    columns = {}
    for name in _COLUMNS:
        values = [(weight, curve.angle, getattr(curve, name)) for weight, curve in parts]
        if any(value is None for _, _, value in values):
            continue
        at = np.array([weight * np.interp(angle, x, y) for weight, x, y in values])
        # the curves belong to different samples, so their errors are independent
        columns[name] = np.sqrt((at**2).sum(axis=0)) if name.endswith("error") else at.sum(axis=0)
    return FamilyCurve(
        angle=angle,
        press_time=press_time,
        opening=opening,
        repeats=min(curve.repeats for _, curve in parts),
        loading=columns.pop("loading"),
        loading_error=columns.pop("loading_error"),
        **columns,
    )
