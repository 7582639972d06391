"""Writer of a results file, record by record; `fsm.results.store` describes the layout."""

from __future__ import annotations

import io
import math
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from fsm.errors import CannotWrite, CaseError
from fsm.io.atomic_write import atomic_write
from fsm.io.hdf5_checked import close_discarding, fixed_text, written_from_memory
from fsm.results import datasets, store
from fsm.results.array_datasets import write_array
from fsm.results.attributes import write_attributes
from fsm.results.channel import Dim
from fsm.results.curve import ForceCurve
from fsm.results.records import Records
from fsm.results.solution import INTEGERS, Layout, Solution
from fsm.results.step_data import write_load_path, write_step_modes
from fsm.results.store import Variable

BUFFER_BYTES = 4_000_000
CHUNK_BYTES, _ROWS = 65_536, 256
"""Largest size of a chunk, and largest number of its rows."""
_MOST_FILES, _MOST_BYTES = 8, 1_000_000
"""Number of files without numbers that are kept, and the size of the largest."""
_FILES: dict[tuple[Any, ...], bytes] = {}


class ResultWriter(Records):
    """Writer of a results file, record by record; a context manager.

    All records stay in memory, and `solution` gives them. The part file is for the case that the run stops: it contains the
    records of the last `flush`.

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
        super().__init__(layout)
        self.path = Path(path)
        self.part = store.part_path(path)
        self._new_bytes = 0
        self._file: Any = None
        self._open_datasets: list[Any] = []  # this file is kept open for `close_discarding`
        self._written, self._samples_written = 0, 0
        self._failure: Exception | None = None
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

    def extend(self, rows: dict[str, Any]) -> None:
        """Add the rows of several records (`fsm.results.solution.stack`), which the caller must not change after this."""
        with self._lock:
            if self._failure is not None:
                raise self._failure
            self._new.append(rows)
            self._new_bytes += sum(rows[name].nbytes for name in ("shape", "q", "u", "memory")) + 512 * len(rows["time"])
            due = time.monotonic() - self._flushed_at >= self._flush_every
            if due or self._new_bytes > BUFFER_BYTES:
                with self._write_errors():
                    self._flush()

    def flush(self) -> None:
        """Write all records to disk now."""
        with self._lock, self._write_errors():
            self._flush()

    def close(self) -> None:
        """Write all records and close the part file, which stays until `finish`."""
        self._end_thread()
        with self._lock, self._write_errors():
            self._flush()
            self._close_file()

    def finish(self, solution: Solution) -> None:
        """Write the complete result under the final name, and delete the part file.

        Parameters
        ----------
        solution : Solution
            All records with statistics, summary and data that exist only at the end.
        """
        self._end_thread()
        with self._lock, self._write_errors():
            write_solution(self.path, solution)
            self._new, self._samples = [], []
            self._written, self._samples_written = len(solution), len(solution.samples.time)
            self._close_file()
            self.part.unlink(missing_ok=True)

    def _end_thread(self) -> None:
        self._stop.set()
        self._thread.join()

    def _close_file(self) -> None:
        if self._file is not None:
            self._file.close()
        self._file, self._open_datasets = None, []

    def _resume(self, n_records: int, n_samples: int) -> None:
        if not self.part.exists():
            raise CaseError("there is no unfinished run to resume", source=str(self.part))
        old = store.read_solution(self.part)
        if len(old) < n_records:
            text = f"contains {len(old)} records, but the checkpoint was saved after {n_records} records"
            raise CaseError(text, str(self.part))
        for name in ("pair_names", "drive_names", "body_names", "dimension", "channels"):
            if getattr(old.layout, name) != getattr(self.layout, name):
                raise CaseError(f"belongs to another scene: its {name} differ", str(self.part))
        if n_records == 0:
            self.part.unlink()
            return
        self._rows = [{name: values[:n_records] for name, values in old.rows.items()}]
        if n_samples:
            self._sample_rows = [old.samples.first(n_samples)]

    def _flush(self) -> None:
        """Append the rows that the part file does not contain. The first call creates the part file."""
        self._stack()
        self._flushed_at, self._new_bytes = time.monotonic(), 0
        begun = 0
        for rows in self._rows:
            count = len(rows["time"])
            if begun + count > self._written:
                self._append({name: values[self._written - begun :] for name, values in rows.items()})
                self._written = begun + count
            begun += count
        begun = 0
        for samples in self._sample_rows:
            begun += len(samples.time)
            if begun > self._samples_written and self._file is not None:
                datasets.append_samples(self._file, samples.last(begun - self._samples_written))
                self._samples_written = begun

    def _append(self, rows: dict[str, Any]) -> None:
        """Append rows to the part file; without a file, create it in one step and open it in single-writer mode."""
        if self._file is not None:
            _append_rows(self._file, store.VARIABLES | store.channel_variables(self.layout.channels), rows, self._written)
            return
        begin = _without_numbers(self.layout, rows, None, True)
        with atomic_write(self.part) as new, written_from_memory(new, begin) as file:
            _write_records(file, self.layout, rows)
        self._file = h5py.File(self.part, "r+", libver="latest", locking="best-effort")
        self._file.swmr_mode = True
        grown = [variable.path for variable in (store.VARIABLES | store.channel_variables(self.layout.channels)).values()]
        grown += ["time", datasets.SAMPLE_TIME, "probes/displacement"]
        self._open_datasets = [self._file[name] for name in grown if name in self._file]

    def _flush_periodically(self) -> None:
        while not self._stop.wait(self._flush_every / 2):
            with self._lock:
                try:
                    with self._write_errors():
                        if time.monotonic() - self._flushed_at >= self._flush_every / 2:
                            self._flush()
                except Exception as error:  # the next call of `append` raises this error in the thread of the caller
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
            self._new, self._samples, self._rows, self._sample_rows = [], [], [], []
            text = f"the results cannot be written ({_system_message(error)}); check free space and write permission"
            self._failure = found = CannotWrite(f"{self.part}: {text}")
            raise found from error


def write_solution(path: str | Path, solution: Solution) -> None:
    """Write a complete result; `path` is the complete old or the complete new file at any time."""
    rows = solution.rows
    begin = _without_numbers(solution.layout, rows, solution.curve, False)
    with atomic_write(path, to_disk=True) as new, written_from_memory(new, begin) as file:
        _write_records(file, solution.layout, rows)
        if len(solution.samples.time):
            datasets.append_samples(file, solution.samples)
        write_attributes(file["stats"], solution.stats)
        write_attributes(file["summary"], solution.summary)
        if solution.array is not None:
            write_array(file, solution.array)
        if solution.curve is not None:
            datasets.write_curve(file, solution.curve)
        if solution.modes is not None:
            write_step_modes(file, solution.modes)
        if solution.load_path is not None:
            write_load_path(file, solution.load_path)


def _system_message(error: Exception) -> str:
    """Message of the operating system, without the place in the HDF5 library."""
    found = re.search(r"error message = '([^']*)'", str(error))
    return found[1] if found else " ".join(str(error).split())[:200]


def _write_records(file: Any, layout: Layout, rows: dict[str, Any]) -> None:
    """Write the case and the first rows into a file of `_without_numbers`."""
    datasets.add_data(file, "case", fixed_text(layout.case_text), "1", "the case file")
    write_attributes(file["provenance"], dict(layout.provenance))
    datasets.write_data(file, "time", rows["time"])
    for name, variable in (store.VARIABLES | store.channel_variables(layout.channels)).items():
        values = _numbers(name, rows)
        if values.size:
            datasets.write_data(file, variable.path, values)


def _numbers(name: str, rows: dict[str, Any]) -> np.ndarray:
    return np.asarray(rows[name], dtype=np.int64 if name in INTEGERS else np.float64)


def _without_numbers(layout: Layout, rows: dict[str, Any], curve: ForceCurve | None, grows: bool) -> bytes:
    """File with all that does not depend on the case and its numbers; see `_create_datasets`. To create its datasets takes
    several times longer than to write them, so the last files are kept: the cases of a table differ in numbers only.
    """
    names = layout.body_names, layout.pair_names, layout.drive_names, layout.step_names, layout.quad_names
    shapes = tuple(np.shape(rows[name]) for name in (*store.VARIABLES, *(info.name for info in layout.channels)))
    points = -1 if curve is None else len(curve)
    key = layout.dimension, layout.thickness, names, layout.panel.tobytes(), layout.channels, shapes, points, grows
    found = _FILES.pop(key, b"") if layout.film is None else b""
    if not found:
        memory = io.BytesIO()
        with h5py.File(memory, "w", libver="latest") as file:
            _create_datasets(file, layout, rows, grows)
            if curve is not None:
                datasets.add_curve(file, curve, layout.drive_names)
        found = memory.getvalue()
    if layout.film is None and len(found) < _MOST_BYTES:
        _FILES[key] = found
        if len(_FILES) > _MOST_FILES:
            del _FILES[next(iter(_FILES))]
    return found


def _create_datasets(file: Any, layout: Layout, rows: dict[str, Any], grows: bool) -> None:
    """Write the layout, and add the datasets of the rows, into an empty file, to which further rows come if it `grows`."""
    most = _ROWS if grows else max(1, min(_ROWS, len(rows["time"])))
    variables = store.VARIABLES | store.channel_variables(layout.channels)
    _write_layout(file, layout)
    datasets.add_scale(file, "time", rows["time"], "time", "s", most, np.nan, written=False)
    datasets.add_scale(file, "coordinate", np.arange(rows["q"].shape[1]), "number of the coordinate")
    datasets.add_scale(file, "rate", np.arange(rows["u"].shape[1]), "number of the velocity")
    datasets.add_scale(file, "memory_number", np.arange(rows["memory"].shape[1]), "number of the internal variable")
    dims = {dim for variable in variables.values() for dim in variable.dims}
    size_of = {dim: len(file[dim]) for dim in dims}
    for name, variable in variables.items():
        values = _numbers(name, rows)
        sizes = tuple(size_of[dim] for dim in variable.dims)
        if values.shape[1:] != sizes:
            raise ValueError(f"{name} has the shape {values.shape[1:]} per record; the layout requires {sizes}")
        if 0 in sizes:
            continue
        chunk = max(1, min(most, CHUNK_BYTES // (8 * math.prod(sizes))))
        by_drive = "drive_name" in variable.dims
        units = datasets.units_of_drives(layout.drive_names, variable.units) if by_drive else variable.units
        datasets.add_data(file, variable.path, values, units, variable.text, ("time", *variable.dims), chunk, written=False)


def _write_layout(file: Any, layout: Layout) -> None:
    """Write the data that are constant in time, names and scales first."""
    texts = {"format": store.FORMAT, "dimension": layout.dimension, "thickness_units": "m"}
    write_attributes(file, {**texts, "version": store.VERSION, "thickness": layout.thickness})
    for group in ("provenance", "summary", "stats"):
        file.create_group(group)
    datasets.add_scale(file, "body", list(layout.body_names), "body")
    datasets.add_scale(file, "pair", list(layout.pair_names), "contact pair")
    datasets.add_scale(file, "drive_name", list(layout.drive_names), "drive")
    if layout.step_names:
        datasets.add_scale(file, "step_name", list(layout.step_names), "step of the run")
    datasets.add_scale(file, "corner", np.arange(4), "corner of a plate: (start, -y), (end, -y), (end, +y), (start, +y)")
    datasets.add_scale(file, "axis", ["x", "y", "z"], "inertial axis")
    datasets.add_scale(file, "quad", np.arange(len(layout.panel)), "plate, in order")
    text = "panel of a plate, from 1; 0 for none; of a scene -1 for films, -2 for cables, -3 for beams"
    datasets.add_data(file, "panel", np.asarray(layout.panel, dtype=np.int64), "1", text, ("quad",))
    if layout.quad_names:
        datasets.write_parts(file, layout.quad_names)
    if layout.film is not None:
        datasets.write_film(file, layout.film)
    for dim in {dim.name: dim for info in layout.channels for dim in info.dims}.values():
        if dim.name not in store.ROOT_DIMS:
            datasets.add_scale(file, store.dim_path(dim.name), _scale_values(dim), dim.text, dim.unit)
    if layout.channels:
        infos = [[c.name, c.unit, c.text, [[d.name, d.unit, d.text] for d in c.dims]] for c in layout.channels]
        write_attributes(file.require_group("channels"), {"infos": infos})


def _scale_values(dim: Dim) -> Any:
    """Values of a dimension scale: names as a list, coordinates as an array."""
    return list(dim.labels) if any(isinstance(label, str) for label in dim.labels) else np.array(dim.labels, dtype=float)


def _append_rows(file: Any, variables: dict[str, Variable], rows: dict[str, Any], start: int) -> None:
    """Append rows after the first `start`; times are written last, because a reader counts records by their times."""
    stop = start + len(rows["time"])
    for name, variable in variables.items():
        if variable.path in file:
            file[variable.path].resize(stop, axis=0)
            file[variable.path][start:stop] = rows[name]
    file.flush()
    file["time"].resize(stop, axis=0)
    file["time"][start:stop] = rows["time"]
    file.flush()
