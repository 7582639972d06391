"""Results file: one HDF5 layout, written during the run and readable after the run is killed.

Layout (groups and datasets of parts that a structure does not have are absent)::

    /case                           text of the case file
    /provenance                     attributes: versions, hashes, command, machine, wall time
    /time, /step, /program_time (time)          time, number of the step of the run, time of loads and drives
    /step_name           names of the steps
    /step_modes/frequency, step, shape, increment   (mode, ...)   natural modes that steps have found
    /state/q, u          (time, coordinate), (time, rate)
    /energy/kinetic ...  (time)                 all of `fsm.results.solution.ENERGIES`
    /drive/travel, force (time, drive_name)
    /curve/travel, force (curve_time, drive_name), path, panels, creases (curve_time) at steps of the solver, decimated
    /contact/pair_force, pair_gap ...   (time, pair)   all of `fsm.results.solution.PAIRS`
    /shape               (time, quad, corner, axis)
    /channels/<name>     (time, ...)            channels that the case asks for, with the coordinates of their dimensions
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
At the end `finish` copies the file, adds the stats and gives the copy its final name.

A file of another layout version is refused.
"""

from __future__ import annotations

import hashlib
import json
import re
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

import h5py
import numpy as np

from fsm.atomic_write import atomic_write
from fsm.errors import CannotWrite, CaseError, FsmError
from fsm.hdf5_checked import (
    READ_ERRORS,
    attribute,
    check_contents,
    close_discarding,
    fixed_text,
    has_checksums,
    names_in,
    numbers_in,
    text_in,
    written_from_memory,
)
from fsm.results.array import ArrayMotion
from fsm.results.array_datasets import read_array, write_array
from fsm.results.attributes import read_attributes, write_attributes
from fsm.results.channel import Channel, ChannelInfo, Dim
from fsm.results.curve import ForceCurve
from fsm.results.datasets import (
    SAMPLE_TIME,
    add_scale,
    append_samples,
    read_curve,
    read_film,
    read_parts,
    read_samples,
    set_description,
    write_curve,
    write_film,
    write_parts,
)  # fmt: skip
from fsm.results.film import ProbeSamples
from fsm.results.interrupted_file import is_marked_open, without_open_marks
from fsm.results.solution import ENERGIES, PAIRS, Floats, Layout, Record, Solution, stack, stack_energies
from fsm.results.step_data import LoadPath, StepModes, read_load_path, read_step_modes, write_load_path, write_step_modes
from fsm.results.summary_check import check_summary

__all__ = ["ResultWriter", "part_path", "read_checkpoint", "read_solution", "write_checkpoint"]

FORMAT, VERSION = "fsm result", 7
CHECKPOINT_FORMAT = "fsm checkpoint"
BUFFER_BYTES = 4_000_000
_ROOT_DIMS = ("axis",)
"""Dimensions of channels that have their scale in the root group."""
CHUNK_BYTES = 65_536


class _Variable(NamedTuple):
    """Dataset over time: path, dimensions after time, unit and description."""

    path: str
    dims: tuple[str, ...]
    units: str
    text: str


VARIABLES: dict[str, _Variable] = {
    "q": _Variable("state/q", ("coordinate",), "m, rad", "configuration"),
    "u": _Variable("state/u", ("rate",), "m/s, rad/s", "velocity"),
    "travel": _Variable("drive/travel", ("drive_name",), "m", "travel of the drive"),
    "force": _Variable("drive/force", ("drive_name",), "N", "force of the drive, positive in its direction"),
    **{
        name: _Variable(f"contact/{name}", ("pair",), units, text) for name, (units, text) in PAIRS.items()
    },
    "shape": _Variable("shape", ("quad", "corner", "axis"), "m", "corner points of the plates"),
    "negative_pivots": _Variable("stats/negative_pivots", (), "1", "negative pivots of the tangent"),
    "step": _Variable("step", (), "1", "number of the step of the run, from 1"),
    "program_time": _Variable("program_time", (), "s", "argument of the functions of time of loads and drives"),
    **{
        name: _Variable(f"energy/{name}", (), "J", text) for name, text in ENERGIES.items()
    },
}


def part_path(path: str | Path) -> Path:
    """Path of the results of an unfinished run: ``result.h5`` -> ``result.part.h5``."""
    path = Path(path)
    return path.with_name(f"{path.stem}.part.h5")


class ResultWriter:
    """Writer of a results file, record by record; a context manager.

    Parameters
    ----------
    path : path of the finished file; until `finish` the data are in `part_path(path)`
    layout : Layout
    resume_at : int, optional
        Continue the existing part file after its first `resume_at` records.
    flush_every : s
        Longest time that a record stays in memory only.
    samples_at : int
        Number of samples of the part file to keep when a run is resumed.

    Raises
    ------
    CaseError
        On resume the part file is missing, damaged, of another scene, or has too few records.
    CannotWrite
        The disk is full, or the user may not write to the folder.
    """

    def __init__(
        self,
        path: str | Path,
        layout: Layout,
        resume_at: int | None = None,
        flush_every: float = 5.0,
        samples_at: int = 0,
    ) -> None:
        self.path = Path(path)
        self.part = part_path(path)
        self.layout = layout
        self._variables = VARIABLES | _channel_variables(layout.channels)
        self._records: list[Record] = []
        self._samples: list[tuple[float, Floats]] = []
        self._record_bytes = 1
        self._file: Any = None
        self._open_datasets: list[Any] = []  # kept open for `close_discarding`
        self._written = 0
        self._failure: Exception | None = None
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._flush_every = flush_every
        self._flushed_at = time.monotonic()
        with self._write_errors():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if resume_at is not None:
                self._resume(resume_at, samples_at)
            else:
                self.part.unlink(missing_ok=True)
        self._thread = threading.Thread(target=self._flush_periodically, name="fsm results", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except FsmError:
            if error is None:
                raise

    @property
    def n_records(self) -> int:
        """Number of records so far, including those of a resumed run."""
        return self._written + len(self._records)

    def append(self, record: Record) -> None:
        """Add one record; the next flush writes it to disk, and the caller must not change it until then."""
        with self._lock, self._write_errors():
            if self._failure is not None:
                raise self._failure
            self._records.append(record)
            self._record_bytes = record.shape.nbytes + record.q.nbytes + record.u.nbytes + 512
            due = time.monotonic() - self._flushed_at >= self._flush_every
            if self._file is None or due or len(self._records) * self._record_bytes > BUFFER_BYTES:
                self._flush()

    def sample(self, at: float, displacement: Floats) -> None:
        """Add one sample of the probes, (n_probes, 3), m; it is written with the records."""
        with self._lock:
            self._samples.append((at, displacement))

    def flush(self) -> None:
        """Write all records to disk now."""
        with self._lock, self._write_errors():
            self._flush()

    def close(self) -> None:
        """Write all records and close the part file, which stays until `finish`."""
        self._stop.set()
        self._thread.join()
        with self._lock, self._write_errors():
            self._flush()
            if self._file is not None:
                self._file.close()
            self._file, self._open_datasets = None, []

    def finish(
        self,
        stats: dict[str, Any],
        summary: dict[str, Any],
        array: ArrayMotion | None = None,
        curve: ForceCurve | None = None,
        modes: StepModes | None = None,
        paths: LoadPath | None = None,
    ) -> None:
        """Close the file, add stats, summary and data that exist only at the end, and give the file its final name.

        Raises
        ------
        ValueError
            There is no record.
        """
        if self.n_records == 0:
            raise ValueError("a results file needs at least one record")
        self.close()
        with self._write_errors():
            # works on a copy, so that the part file stays complete if this fails
            with atomic_write(self.path) as new, written_from_memory(new, self.part) as file:
                write_attributes(file["stats"], stats)
                write_attributes(file["summary"], summary)
                if array is not None:
                    write_array(file, array)
                if curve is not None:
                    write_curve(file, curve)
                if modes is not None:
                    write_step_modes(file, modes)
                if paths is not None:
                    write_load_path(file, paths)
            self.part.unlink()

    def _resume(self, n_records: int, n_samples: int) -> None:
        if not self.part.exists():
            raise CaseError("there is no unfinished run to resume", source=str(self.part))
        old = read_solution(self.part)
        if len(old) < n_records:
            text = f"holds {len(old)} records, fewer than the {n_records} to resume after"
            raise CaseError(text, str(self.part))
        for name in ("pair_names", "drive_names", "body_names", "dimension", "channels"):
            if getattr(old.layout, name) != getattr(self.layout, name):
                raise CaseError(f"belongs to another scene: its {name} differ", str(self.part))
        if n_records == 0:
            self.part.unlink()
        else:
            rows = {name: getattr(old, name)[:n_records] for name in VARIABLES if name not in ENERGIES}
            rows |= {name: old.energy[name][:n_records] for name in ENERGIES}
            rows |= {info.name: old.channels[info.name].values[:n_records] for info in self.layout.channels}
            self._open(rows, old.time[:n_records], old.samples.first(n_samples))

    def _flush(self) -> None:
        if self._samples and self._file is not None:
            append_samples(self._file, _stack_samples(self._samples))
            self._samples = []
        if not self._records:
            return
        rows = stack(self._records)
        rows |= stack_energies(self._records)
        rows["negative_pivots"] = np.array([r.negative_pivots for r in self._records])
        rows["step"] = np.array([r.step for r in self._records])
        for info in self.layout.channels:
            rows[info.name] = np.array([r.channels[info.name] for r in self._records], dtype=float)
        times = rows.pop("time")
        if self._file is None:
            self._open(rows, times)
        else:
            _append_rows(self._file, self._variables, rows, times, self._written)
            self._written += len(times)
        self._records = []
        self._flushed_at = time.monotonic()

    def _open(self, rows: dict[str, Any], times: Floats, samples: ProbeSamples | None = None) -> None:
        """Create the part file with its first rows in one step, then open it in single-writer mode."""
        with atomic_write(self.part) as new, written_from_memory(new) as file:
            _write_layout(file, self.layout)
            _create_variables(file, self._variables, rows)
            _append_rows(file, self._variables, rows, times, 0)
            if samples is not None and self.layout.film is not None:
                append_samples(file, samples)
        self._file = h5py.File(self.part, "r+", libver="latest", locking="best-effort")
        self._file.swmr_mode = True
        grown = [variable.path for variable in self._variables.values()] + ["time", SAMPLE_TIME, "probes/displacement"]
        self._open_datasets = [self._file[name] for name in grown if name in self._file]
        self._written = len(times)

    def _flush_periodically(self) -> None:
        while not self._stop.wait(self._flush_every / 2):
            with self._lock:
                try:
                    with self._write_errors():
                        if time.monotonic() - self._flushed_at >= self._flush_every / 2:
                            self._flush()
                except Exception as error:  # the next `append` raises it in the caller's thread
                    self._failure = error
                    return

    @contextmanager
    def _write_errors(self) -> Iterator[None]:
        """Turn an error of HDF5 or the system into `CannotWrite`, and abandon the file."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            if self._file is not None:
                close_discarding(self._file)
                self._file, self._open_datasets = None, []
            self._records, self._samples = [], []
            text = f"the results cannot be written ({_system_message(error)}); check free space and write permission"
            self._failure = found = CannotWrite(f"{self.part}: {text}")
            raise found from error


def _system_message(error: Exception) -> str:
    """Message of the operating system, without the place in the HDF5 library."""
    found = re.search(r"error message = '([^']*)'", str(error))
    return found[1] if found else " ".join(str(error).split())[:200]


def _write_layout(file: Any, layout: Layout) -> None:
    """Write the data that are constant in time, names and scales first."""
    texts = {"format": FORMAT, "dimension": layout.dimension, "thickness_units": "m"}
    write_attributes(file, {**texts, "version": VERSION, "thickness": layout.thickness})
    case = file.create_dataset("case", data=fixed_text(layout.case_text))
    set_description(case, "1", "the case file")
    for group in ("provenance", "summary", "stats"):
        file.create_group(group)
    write_attributes(file["provenance"], dict(layout.provenance))
    add_scale(file, "body", list(layout.body_names), "body")
    add_scale(file, "pair", list(layout.pair_names), "contact pair")
    add_scale(file, "drive_name", list(layout.drive_names), "drive")
    if layout.step_names:
        add_scale(file, "step_name", list(layout.step_names), "step of the run")
    add_scale(file, "corner", np.arange(4), "corner of a plate: (start, -y), (end, -y), (end, +y), (start, +y)")
    add_scale(file, "axis", ["x", "y", "z"], "inertial axis")
    add_scale(file, "quad", np.arange(len(layout.panel)), "plate, in order")
    panel = file.create_dataset("panel", data=np.asarray(layout.panel, dtype=np.int64))
    set_description(panel, "1", "panel of a plate, from 1; 0 for none; of a scene -1 for films, -2 for cables, -3 for beams")
    panel.dims[0].attach_scale(file["quad"])
    if layout.quad_names:
        write_parts(file, layout.quad_names)
    if layout.film is not None:
        write_film(file, layout.film)
    for dim in {dim.name: dim for info in layout.channels for dim in info.dims}.values():
        if dim.name not in _ROOT_DIMS:
            add_scale(file, _dim_path(dim.name), _scale_values(dim), dim.text, dim.unit)
    if layout.channels:
        infos = [[c.name, c.unit, c.text, [[d.name, d.unit, d.text] for d in c.dims]] for c in layout.channels]
        write_attributes(file.require_group("channels"), {"infos": infos})


def _scale_values(dim: Dim) -> Any:
    """Values of a dimension scale: names as a list, coordinates as an array."""
    return list(dim.labels) if any(isinstance(label, str) for label in dim.labels) else np.array(dim.labels, dtype=float)


def _dim_path(name: str) -> str:
    return name if name in _ROOT_DIMS else f"channels/{name}"


def _channel_variables(channels: Iterable[ChannelInfo]) -> dict[str, _Variable]:
    """Datasets of channels by name; a slash in a name would be a group."""
    return {
        info.name: _Variable(
            f"channels/{info.name.replace('/', '|')}", tuple(_dim_path(dim.name) for dim in info.dims), info.unit, info.text
        )
        for info in channels
    }


def _create_variables(file: Any, variables: dict[str, _Variable], rows: dict[str, Any]) -> None:
    """Create empty datasets that grow along time, with their scales attached."""
    times = file.create_dataset("time", (0,), np.float64, maxshape=(None,), chunks=(256,), fillvalue=np.nan)
    set_description(times, "s", "time")
    times.make_scale("time")
    add_scale(file, "coordinate", np.arange(rows["q"].shape[1]), "number of the coordinate")
    add_scale(file, "rate", np.arange(rows["u"].shape[1]), "number of the velocity")
    for name, variable in variables.items():
        tail = rows[name].shape[1:]
        sizes = tuple(len(file[dim]) for dim in variable.dims)
        if tail != sizes:
            raise ValueError(f"{name} has the shape {tail} per record; the layout requires {sizes}")
        if 0 in tail:
            continue
        row_bytes = 8 * int(np.prod(tail, dtype=int))
        chunk = (max(1, min(256, CHUNK_BYTES // row_bytes)), *tail)
        kind = np.int64 if name in ("negative_pivots", "step") else np.float64
        data = file.create_dataset(variable.path, (0, *tail), kind, maxshape=(None, *tail), chunks=chunk, fletcher32=True)
        set_description(data, variable.units, variable.text)
        for axis, dim in enumerate(("time", *variable.dims)):
            data.dims[axis].attach_scale(file[dim])


def _append_rows(
    file: Any, variables: dict[str, _Variable], rows: dict[str, Any], times: Floats, start: int
) -> None:
    """Append rows after the first `start`; times are written last, because a reader counts records by their times."""
    stop = start + len(times)
    for name, values in rows.items():
        path = variables[name].path
        if path in file:
            file[path].resize(stop, axis=0)
            file[path][start:stop] = values
    file.flush()
    file["time"].resize(stop, axis=0)
    file["time"][start:stop] = times
    file.flush()


def read_solution(path: str | Path) -> Solution:
    """Read a results file, also of a run that was killed or is still running.

    Raises
    ------
    CaseError
        The file is missing, damaged, of another version, or not a results file.
    """
    path = Path(path)
    with _open_hdf5(path, FORMAT) as file:
        if (version := int(attribute(file, "version"))) != VERSION:
            what = f"was written by another version of fsm (layout {version}; this one reads {VERSION})"
            raise CaseError(f"{what}; run the case again", str(path))
        times = numbers_in(file, "time", (None,), finite=False)
        bad = ~np.isfinite(times)
        n = int(np.argmax(bad)) if bad.any() else len(times)
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
        tail = tuple(len(file[dim]) for dim in dims)
        if 0 not in tail:
            raise KeyError(f"/{path} is missing")
        return np.full((n, *tail), np.nan)
    sizes = tuple(file[dim].shape[0] for dim in dims)
    return numbers_in(file, path, (None, *sizes), name not in PAIRS, n)


def _read_channels(file: Any, n: int) -> dict[str, Channel]:
    """First n values of all channels."""
    found = {}
    for name, unit, text, dims in json.loads(attribute(file["channels"], "infos_json")) if "channels" in file else ():
        info = ChannelInfo(str(name), str(unit), tuple(_read_dim(file, *map(str, dim)) for dim in dims), str(text))
        path, _, _, _ = _channel_variables([info])[info.name]
        shape = (None, *(len(dim.labels) for dim in info.dims))
        found[info.name] = Channel(info, numbers_in(file, path, shape, False, n))
    return found


def _read_dim(file: Any, name: str, unit: str, text: str) -> Dim:
    path = _dim_path(name)
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
def _open_hdf5(path: Path, kind: str) -> Iterator[Any]:
    """Open an HDF5 file of a kind (`FORMAT` or `CHECKPOINT_FORMAT`); faults become a `CaseError`."""
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


def _stack_samples(samples: list[tuple[float, Floats]]) -> ProbeSamples:
    return ProbeSamples(np.array([at for at, _ in samples]), np.array([values for _, values in samples]))


def write_checkpoint(path: str | Path, arrays: dict[str, np.ndarray], attributes: dict[str, Any]) -> None:
    """Write arrays and attributes; at any time `path` is the complete old or the complete new checkpoint."""
    path = Path(path)
    with atomic_write(path) as part, written_from_memory(part) as file:
        file.attrs["format"] = fixed_text(CHECKPOINT_FORMAT)
        group = file.create_group("arrays")
        for name, values in arrays.items():
            group.create_dataset(name, data=values)
        write_attributes(file.create_group("attributes"), attributes)
        file.attrs["checksum"] = fixed_text(_checksum(file))


def read_checkpoint(path: str | Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Read arrays and attributes of a checkpoint.

    Raises
    ------
    CaseError
        The file is missing, damaged, or not a checkpoint.
    """
    with _open_hdf5(Path(path), CHECKPOINT_FORMAT) as file:
        arrays = {name: numbers_in(file, f"arrays/{name}", data.shape, False) for name, data in file["arrays"].items()}
        if attribute(file, "checksum") != _checksum(file):
            raise CaseError("is damaged: its checksum differs; run again without --resume", str(path))
        return arrays, read_attributes(file["attributes"])


def _checksum(file: Any) -> str:
    """SHA-256 of all attributes and arrays of a checkpoint."""
    digest = hashlib.sha256(json.dumps(read_attributes(file["attributes"]), sort_keys=True).encode())
    for name in sorted(file["arrays"]):
        values = file[f"arrays/{name}"][()]
        digest.update(f"\n{name} {values.shape} {values.dtype.str}\n".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
