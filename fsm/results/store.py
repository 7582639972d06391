"""Results file: its HDF5 layout, and its reader. `fsm.results.writer` writes it during the run.

Layout (groups and datasets of parts that a structure does not have are absent)::

    /case                           text of the case file
    /provenance                     attributes: versions, hashes, command, machine, wall time
    /time, /step, /program_time (time)          time, number of the step of the run, time of loads and drives
    /step_name           names of the steps
    /step_modes/frequency, step, shape, increment   (mode, ...)   natural modes that steps have found
    /state/q, u          (time, coordinate), (time, rate)
    /state/memory        (time, memory_number)  internal variables of elements: multipliers, hysteresis, latches
    /energy/kinetic ...  (time)                 all of `fsm.results.solution.ENERGIES`
    /drive/travel, force (time, drive_name)
    /curve/travel, force (curve_time, drive_name), path, panels, creases (curve_time) at steps of the solver, decimated
    /contact/pair_force, pair_gap ...   (time, pair)   all of `fsm.results.solution.PAIRS`
    /shape               (time, quad, corner, axis)
    /channels/<name>     (time, ...)            channels selected in the case, with the coordinates of their dimensions
    /probes/displacement (probe_time, probe, axis)  of a film, denser than /time; rest (probe, axis)
    /modes/frequency, shape   (mode), (mode, quad, corner, axis)   natural modes about the tensioned state
    /points/displacement, velocity, acceleration (time, point, plane_axis), rigid_...; /bars/stress (time, bar)   of an array
    /film/stress, direction, state   (quad, principal), (quad, axis), (quad)   of the tensioned state
    /stats               attributes, and negative_pivots (time)
    /summary             attributes
    /body, /pair, /drive_name, /panel           names, and the panel of every quad
    /part, /quad_part    names of bodies, films, cables, beams and bars, and the part of every quad

Every dataset has `units`, `long_name` and dimension scales. The file therefore opens with
``xarray.open_datatree(path, engine="h5netcdf")`` or ``open_dataset(..., group="drive")``.
Attributes hold lists and dicts as JSON under ``<name>_json``.

During a run the data go to ``result.part.h5`` in HDF5's single-writer mode. The file on disk is then consistent at any time,
even after a kill. `/time` is written last, so a reader counts only complete records.
A run that takes less time than the period of checkpoints writes no such file. At the end the complete result is written
from memory under its final name.

The reader refuses a file of another layout version.
"""
from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from fsm.errors import CaseError
from fsm.io.hdf5_checked import READ_ERRORS, attribute, check_contents, has_checksums, names_in, numbers_in, text_in
from fsm.results.array_datasets import read_array
from fsm.results.attributes import read_attributes
from fsm.results.channel import Channel, ChannelInfo, Dim
from fsm.results.datasets import read_curve, read_film, read_parts, read_samples
from fsm.results.interrupted_file import is_marked_open, without_open_marks
from fsm.results.solution import ENERGIES, MAY_BE_INFINITE, PAIRS, Layout, Solution
from fsm.results.step_data import read_load_path, read_step_modes
from fsm.results.summary_file import check_summary

FORMAT, VERSION = "fsm result", 7
ROOT_DIMS = ("axis",)
"""Dimensions of channels that have their scale in the root group."""


class Variable(NamedTuple):
    """Dataset over time: path, dimensions after time, unit and description."""

    path: str
    dims: tuple[str, ...]
    units: str
    text: str


VARIABLES: dict[str, Variable] = {
    "q": Variable("state/q", ("coordinate",), "m, rad", "configuration"),
    "u": Variable("state/u", ("rate",), "m/s, rad/s", "velocity"),
    "memory": Variable("state/memory", ("memory_number",), "SI", "internal variables of elements, as multipliers"),
    "travel": Variable("drive/travel", ("drive_name",), "m", "travel of the drive"),
    "force": Variable("drive/force", ("drive_name",), "N", "force of the drive, positive in its direction"),
    **{
        name: Variable(f"contact/{name}", ("pair",), units, text) for name, (units, text) in PAIRS.items()
    },
    "shape": Variable("shape", ("quad", "corner", "axis"), "m", "corner points of the plates"),
    "negative_pivots": Variable("stats/negative_pivots", (), "1", "negative pivots of the tangent"),
    "step": Variable("step", (), "1", "number of the step of the run, from 1"),
    "program_time": Variable("program_time", (), "s", "argument of the functions of time of loads and drives"),
    **{
        name: Variable(f"energy/{name}", (), "J", text) for name, text in ENERGIES.items()
    },
}


def part_path(path: str | Path) -> Path:
    """Path of the results of an unfinished run: ``result.h5`` -> ``result.part.h5``."""
    path = Path(path)
    return path.with_name(f"{path.stem}.part.h5")


def dim_path(name: str) -> str:
    """Path of the scale of a dimension of channels."""
    return name if name in ROOT_DIMS else f"channels/{name}"


def channel_variables(channels: Iterable[ChannelInfo]) -> dict[str, Variable]:
    """Datasets of channels by name; a slash in a name would be a group."""
    return {
        info.name: Variable(
            f"channels/{info.name.replace('/', '|')}", tuple(dim_path(dim.name) for dim in info.dims), info.unit, info.text
        )
        for info in channels
    }


def read_solution(path: str | Path, records: bool = True) -> Solution:
    """Read a results file, also of a run that was killed or is still running.

    Without its `records` the result has only its curves, its summary and what is constant; this takes a third of the time.

    Raises
    ------
    CaseError
        The file is missing, damaged, of another version, or not a results file.
    """
    path = Path(path)
    with open_hdf5(path, FORMAT) as file:
        if (version := int(attribute(file, "version"))) != VERSION:
            what = f"was written by another version of fsm (layout {version}; this one reads {VERSION})"
            raise CaseError(f"{what}; run the case again", str(path))
        times = numbers_in(file, "time", (None,), finite=False)
        bad = ~np.isfinite(times)
        n = 0 if not records else int(np.argmax(bad)) if bad.any() else len(times)
        values = {name: _read_rows(file, name, n) for name in VARIABLES}
        channels = _read_channels(file, n)
        return Solution(
            time=times[:n],
            energy={name: values.pop(name) for name in ENERGIES},
            samples=read_samples(file),
            layout=replace(_read_layout(file), channels=tuple(channel.info for channel in channels.values())),
            channels=channels,
            stats=read_attributes(file["stats"]),
            summary=check_summary(read_attributes(file["summary"])),
            array=read_array(file, n),
            curve=read_curve(file),
            modes=read_step_modes(file),
            load_path=read_load_path(file),
            step=np.nan_to_num(values.pop("step")).astype(np.int64),
            **values,
        )


def _read_rows(file: Any, name: str, n: int) -> Any:
    path, dims, _, _ = VARIABLES[name]
    if path not in file:
        if any(dim not in file for dim in dims):  # by a version without this variable
            return np.zeros((n, 0))
        if name == "numerical":
            return np.zeros(n)
        tail = tuple(len(file[dim]) for dim in dims)
        if 0 not in tail:
            raise KeyError(f"/{path} is missing")
        return np.full((n, *tail), np.nan)
    sizes = tuple(file[dim].shape[0] for dim in dims)
    return numbers_in(file, path, (None, *sizes), name not in MAY_BE_INFINITE, n) if n else np.zeros((0, *sizes))


def _read_channels(file: Any, n: int) -> dict[str, Channel]:
    """First n values of all channels."""
    found = {}
    for name, unit, text, dims in json.loads(attribute(file["channels"], "infos_json")) if "channels" in file else ():
        info = ChannelInfo(str(name), str(unit), tuple(_read_dim(file, *map(str, dim)) for dim in dims), str(text))
        path, _, _, _ = channel_variables([info])[info.name]
        shape = (None, *(len(dim.labels) for dim in info.dims))
        found[info.name] = Channel(info, numbers_in(file, path, shape, False, n))
    return found


def _read_dim(file: Any, name: str, unit: str, text: str) -> Dim:
    path = dim_path(name)
    labels: Any = names_in(file, path) if "names_json" in file[path].attrs else numbers_in(file, path, (None,)).tolist()
    return Dim(name, tuple(labels), unit, text)


def _read_layout(file: Any) -> Layout:
    names = {key: names_in(file, key) for key in ("body", "pair", "drive_name")}
    return Layout(
        case_text=text_in(file, "case"),
        provenance=read_attributes(file["provenance"]),
        dimension=str(attribute(file, "dimension")),  # type: ignore[arg-type]
        body_names=names["body"],
        pair_names=names["pair"],
        drive_names=names["drive_name"],
        panel=numbers_in(file, "panel", file["quad"].shape),
        thickness=float(attribute(file, "thickness")),
        film=read_film(file),
        step_names=names_in(file, "step_name") if "step_name" in file else (),
        quad_names=read_parts(file),
    )


@contextmanager
def open_hdf5(path: Path, kind: str) -> Iterator[Any]:
    """Open an HDF5 file of a kind (`FORMAT`, or the format of a checkpoint); faults become a `CaseError`."""
    if path.exists() and not path.is_file():
        inside = path / "result.h5"
        what = f"is a folder; give {inside}" if inside.is_file() else "is a folder, a pipe or a device, not a file"
        raise CaseError(what, str(path))
    if not path.is_file():
        part = part_path(path)
        hint = f"; the run did not finish, see {part.name}" if part != path and part.is_file() else ""
        raise CaseError(f"there is no such file{hint}", str(path))
    try:
        if not has_checksums(path):
            raise CaseError(f"is not an {kind} file (not HDF5), or its beginning is damaged", str(path))
        with h5py.File(without_open_marks(path) if is_marked_open(path) else path, "r", locking="best-effort") as file:
            check_contents(file)
            if "format" not in file.attrs or attribute(file, "format") != kind:
                raise CaseError(f"is an HDF5 file, but not an {kind} file", str(path))
            yield file
    except READ_ERRORS as error:
        raise CaseError(f"is damaged or cannot be read ({' '.join(str(error).split())[:200]})", str(path)) from error
