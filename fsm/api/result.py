"""Results in Python: summary, force curve, channels with their times, tables of xarray and pandas, and figures."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatchcase
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from fsm.errors import NotInResult
from fsm.io.optional import optional_module
from fsm.results.all_channels import all_channels
from fsm.results.channel import Channel, select_channels
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.run.summary_text import summary_lines

if TYPE_CHECKING:
    import pandas
    import xarray

    from fsm.api.picture import Picture

RESULT_FILE = "result.h5"
_STAGES = ("deploy", "vibrate")
_WILD = set("*?[")


class Curve(NamedTuple):
    """Force curve: ``travel, force = result.force()``.

    Attributes
    ----------
    travel : (n,) array, m; of a drive that turns, rad
    force : (n,) array, N; of a drive that turns, N m

    Examples
    --------
    >>> import fsm, numpy
    >>> curve = fsm.Curve(numpy.array([0.0, 0.01]), numpy.array([0.0, 2.0]))
    >>> float(curve.force.max())
    2.0
    """

    travel: np.ndarray
    force: np.ndarray

    def __repr__(self) -> str:
        return f"Curve({len(self.travel)} points, largest force {np.max(self.force, initial=-np.inf):.4g})"


class Results:
    """Numbers, curves and pictures of a run; `fsm.Result` has its case, too."""

    def __init__(
        self: Self, path: Path, kept: tempfile.TemporaryDirectory[str] | None = None, *, allow_extensions: bool = False
    ) -> None:
        self._kept, self._allow_extensions = kept, allow_extensions
        file = path / RESULT_FILE if path.is_dir() else path
        self.path, self._file = file.parent, file
        self.stages: dict[str, Self] = {}
        if path.is_dir() and not file.is_file():
            there = [name for name in _STAGES if (path / name / RESULT_FILE).is_file()]
            self.stages = {name: type(self)(path / name, allow_extensions=allow_extensions) for name in there}
            self.path = path
        if self.stages:
            self._solution: Solution | None = None
            return
        self._solution = read_solution(file)

    @property
    def solution(self) -> Solution:
        """All records as arrays in SI."""
        if self._solution is None:
            stages = " or ".join(f'stages["{name}"]' for name in self.stages)
            raise NotInResult(f"{self.path}: the run has two stages, each with its own solution; use {stages}")
        return self._solution

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Numbers of summary.json, SI."""
        if self._solution is not None:
            return self._solution.summary
        from fsm.results.summary_file import SUMMARY, read_summary

        return read_summary(self.path / SUMMARY)

    @property
    def time(self) -> np.ndarray:
        """Times of the records, (n,), s."""
        return self.solution.time

    @property
    def shape(self) -> np.ndarray:
        """Corner points of all plates at the records, (n, n_plates, 4, 3), m."""
        return self.solution.shape

    @cached_property
    def _channels(self) -> dict[str, Channel]:
        return all_channels(self.solution)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all channels: recorded ones, drives, energies and contacts."""
        return tuple(self._channels)

    def __getitem__(self, name: str) -> Any:
        """Channel by name, or dict of all channels that match a pattern such as ``"crease.*.moment"``.

        Returns
        -------
        Series, or dict of Series

        Raises
        ------
        NotInResult
            No channel has this name. The message has similar names.
        """
        if name in self._channels:
            return Series(self._channels[name], self.time)
        if _WILD & set(name):
            found = {key: Series(channel, self.time) for key, channel in self._channels.items() if fnmatchcase(key, name)}
            if found:
                return found
        _, faults = select_channels(self._channels, [name])
        raise NotInResult(f"{self.path}: {faults[0].message}; case.run(channels=...) records others")

    def __contains__(self, name: object) -> bool:
        return name in self._channels

    def __iter__(self) -> Iterator[str]:
        return iter(self._channels)

    def __len__(self) -> int:
        return len(self.solution)

    def force(self, drive: int | str = 1, *, dynamic: bool = False) -> Curve:
        """Force curve at the steps of the solver, as in force.csv.

        Parameters
        ----------
        drive : int or str
            Number of the drive, from 1, or its name.
        dynamic : bool
            Whether to give the points of snap-throughs and other motions instead of the quasi-static ones.

        Raises
        ------
        NotInResult
            The result does not have this drive.
        """
        names = self.solution.layout.drive_names
        index = names.index(drive) if drive in names else drive - 1 if isinstance(drive, int) else -1
        if not 0 <= index < len(names):
            known = ", ".join(f'{k} "{name}"' for k, name in enumerate(names, 1))
            text = f"the drives are {known}" if known else "the case has no drive; see result.channels for its quantities"
            raise NotInResult(f"{self.path}: no drive {drive!r}; {text}")
        curve = self.solution.force_curve
        if curve.has_quasi_static:
            curve = curve.select(curve.dynamic == dynamic)
        return Curve(curve.travel[:, index], curve.force[:, index])

    def to_xarray(self) -> xarray.Dataset:
        """All channels and the shape over time, with units and coordinates; needs ``pip install fsm[tables]``."""
        return to_xarray(self.solution)

    def to_pandas(self, *patterns: str) -> pandas.DataFrame:
        """Channels as columns, with the time (s) as index; needs ``pip install fsm[tables]``.

        Parameters
        ----------
        patterns : patterns of channels; absent: all
            Components of a vector are columns ``"joint.spring.force x"``. ``frame.attrs["units"]`` has the units.
        """
        names = None
        if patterns:
            names, faults = select_channels(self._channels, patterns, "to_pandas")
            if faults:
                raise NotInResult(f"{self.path}: {faults[0].message}")
        return to_pandas(self.solution, names)

    def plot(self, *what: str, out: str | Path | None = None) -> Picture:
        """Figure of the result, which a notebook shows.

        Parameters
        ----------
        what : str
            Name of a figure of the run ("force", "motion", "energy", "contact", ...), or names and patterns of channels.
            Absent: "force" with a drive, else the first figure of the run.
        out : str or Path, optional
            File to write, .png, .svg or .pdf.

        Raises
        ------
        NotInResult
            The result has no such figure or channel.
        """
        from fsm.api.picture import draw_picture

        return draw_picture(self.solution, self.channels, what, None if out is None else Path(out), self.path)

    def report(self, out: str | Path | None = None, channels: Sequence[str] = (), title: str = "") -> Path:
        """Write one interactive page that works offline, as ``fsm report``; return its path.

        Parameters
        ----------
        out : str or Path, optional
            HTML file; absent: report.html in the folder of the result.
        channels : patterns of channels that the page has in any case
        title : title of the page; absent: the title of the case

        Raises
        ------
        CaseError
            `out` is not the name of an HTML file.
        """
        from fsm.views.report.write import write_report

        parts = [str(stage.path) for stage in self.stages.values()] or [str(self._file)]
        return write_report(parts, self.path / "report.html" if out is None else out, channels, title)

    def export(self, to: str, out: str | Path | None = None) -> Path | list[Path]:
        """Write the result for another program, as ``fsm export``; return its path, or the paths for the stages.

        Parameters
        ----------
        to : "vtkhdf", "glb", "csv", "parquet", "mp4", "gif", "fold" or "inp"
        out : str or Path, optional
            File to write, by default beside the result. With stages, their names are added: strip-deploy.glb.

        Raises
        ------
        CaseError
            The format is unknown, the result has nothing to show, or a package is not installed.
        """
        from fsm.views.exporters import export, numbered

        if self.stages:
            targets = {name: None if out is None else numbered(Path(out), name, 2) for name in self.stages}
            files = [stage.export(to, targets[name]) for name, stage in self.stages.items()]
            return [file for file in files if isinstance(file, Path)]
        return export(self.solution, to, self.path / f"result.{to}" if out is None else Path(out), str(self.path))

    def __str__(self) -> str:
        *lines, folder = summary_lines(self.summary, self.path)
        return "\n".join([*lines, *([] if self.stages else [f"solution    {self._records()}"]), folder])

    def __repr__(self) -> str:
        return f"Result({str(self.path)!r}: {', '.join(self._numbers())})"

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><td style='text-align:left'>{escape(text)}</td></tr>" for text in self._numbers())
        return f"<table><tr><th style='text-align:left'>{escape(str(self.path))}</th></tr>{rows}</table>"

    def _records(self) -> str:
        solution = self.solution
        return f"{len(solution)} records to {solution.time[-1]:.4g} s" if len(solution) else "no record"

    def _numbers(self) -> Sequence[str]:
        """Main numbers of the summary, in words."""
        if self.stages:
            return [f"stage {name}: {', '.join(stage._numbers())}" for name, stage in self.stages.items()]
        summary, solution = self.summary, self.solution
        parts = [self._records()]
        if summary.get("peak_force"):
            effort, at = "N m" if solution.layout.turns() else "N", solution.layout.travel_text(summary["peak_travel"])
            parts.append(f"peak {summary['peak_force']:.4g} {effort} at {at}")
        if summary.get("frequency_hz"):
            parts.append(f"{summary['frequency_hz']:.4g} Hz")
        if not summary:
            parts.append("unfinished run")
        count = len(summary.get("warnings", ()))
        return [*parts, *([f"{count} warning{'s' if count > 1 else ''}"] if count else [])]


if TYPE_CHECKING:
    import pandas
    import xarray


def to_xarray(solution: Solution) -> xarray.Dataset:
    """All channels and the shape over time.

    Returns
    -------
    xarray.Dataset
        One variable for each channel, and ``shape`` (time, plate, corner, axis), m. Variables have the attributes `units`
        and `long_name`. Dimensions have their labels or coordinates.

    Raises
    ------
    CaseError
        The package xarray is not installed.
    """
    xr = optional_module("xarray", "to_xarray", "tables")
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {"time": ("time", solution.time, {"units": "s", "long_name": "time"})}
    for name, channel in all_channels(solution).items():
        for dim in channel.info.dims:
            coordinates[dim.name] = (dim.name, list(dim.labels), {"units": dim.unit, "long_name": dim.text})
        dims = ("time", *(dim.name for dim in channel.info.dims))
        variables[name] = (dims, channel.values, {"units": channel.info.unit, "long_name": channel.info.text})
    if solution.shape.size:
        text = {"units": "m", "long_name": "corner points of the plates"}
        variables["shape"] = (("time", "plate", "corner", "axis"), solution.shape, text)
        coordinates["axis"] = ("axis", ["x", "y", "z"], {"units": "1", "long_name": "inertial axis"})
        coordinates["panel"] = ("plate", solution.layout.panel, {"units": "1", "long_name": "panel of the plate"})
    title = solution.layout.case.get("title", "")
    return xr.Dataset(variables, coordinates, {"title": title, **_plain(solution.summary)})


def to_pandas(solution: Solution, names: Iterable[str] | None = None) -> pandas.DataFrame:
    """Channels as columns with the time (s) as index.

    Parameters
    ----------
    solution : Solution
    names : names of channels; None for all

    Returns
    -------
    pandas.DataFrame
        ``attrs["units"]`` has the unit of each column.

    Raises
    ------
    CaseError
        The package pandas is not installed.
    """
    pd = optional_module("pandas", "to_pandas", "tables")
    columns, units = {}, {}
    channels = all_channels(solution)
    for name in channels if names is None else names:
        for label, values in channels[name].columns.items():
            columns[label], units[label] = values, channels[name].info.unit
    frame = pd.DataFrame(columns, index=pd.Index(solution.time, name="time (s)"))
    frame.attrs["units"] = units
    return frame


def _plain(summary: dict[str, Any]) -> dict[str, Any]:
    """Numbers and texts of a summary, which an attribute can hold."""
    return {key: value for key, value in summary.items() if isinstance(value, int | float | str | np.number)}


class Series(NDArrayOperatorsMixin):
    """Quantity over time. A series behaves like the array of its values in arithmetic, in NumPy functions and in plots.

    Attributes
    ----------
    name : str
    unit : str
        SI unit.
    text : str
        Description.
    time : (n,) array, s
    values : (n, ...) array
        The first axis is time; the others are those of `dims`.
    dims : dict
        Labels or coordinates of the other axes, by name.

    Examples
    --------
    >>> import fsm
    >>> result = fsm.load("folding_cases/rotating_squares/case.toml").set("drive.0.travel", 0.14).run()
    >>> force = result["drive.1.force"]
    >>> force.unit, force.values.shape == force.time.shape, bool(force.max() > 0)
    ('N', True, True)
    """

    def __init__(self, channel: Channel, time: np.ndarray) -> None:
        self.name = channel.info.name
        self.unit = channel.info.unit
        self.text = channel.info.text
        self.dims = {dim.name: dim.labels for dim in channel.info.dims}
        self.time = time
        self.values = np.asarray(channel.values)
        self._columns = channel.columns

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Components by label, (n,) each."""
        return self._columns

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.values, dtype=dtype, copy=copy)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        plain = [each.values if isinstance(each, Series) else each for each in inputs]
        return getattr(ufunc, method)(*plain, **kwargs)

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, index: Any) -> Any:
        return self.values[index]

    def min(self, axis: int | None = None, out: Any = None) -> Any:
        """Smallest value; NaN values, which mean no contact, are ignored."""
        return np.nanmin(self.values, axis=axis, out=out)

    def max(self, axis: int | None = None, out: Any = None) -> Any:
        """Largest value; NaN values, which mean no contact, are ignored."""
        return np.nanmax(self.values, axis=axis, out=out)

    def __repr__(self) -> str:
        shape = " x ".join(map(str, self.values.shape))
        if not np.isfinite(self.values).any():
            return f"Series({self.name!r}: {shape} values, {self.unit})"
        return f"Series({self.name!r}: {shape} values from {self.min():.4g} to {self.max():.4g} {self.unit})"
