"""Datasets of a results file with unit and description: scales, film, probe samples and force curve."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from h5py import h5d, h5ds, h5p, h5s, h5t

from fsm.io.hdf5_checked import kinds_of, names_in, numbers_in, space_of, write_attribute
from fsm.results.attributes import write_attributes
from fsm.results.curve import ForceCurve
from fsm.results.film import STATES, Film, ProbeSamples

SAMPLE_TIME, _CURVE_TIME = "probes/probe_time", "curve/curve_time"
"""Times of probes and curve; xarray would confuse a scale `time` in a group with the times of the records."""


def add_data(
    file: Any,
    path: str,
    values: Any,
    units: str,
    text: str,
    dims: Sequence[str] = (),
    chunk: int = 0,
    fill: float | None = None,
    written: bool = True,
) -> None:
    """Add a dataset with unit and long name.

    Calls of the lower level of h5py take a third of the time: a file has a hundred datasets with three hundred attributes.

    Parameters
    ----------
    file : h5py.File or group
    path : path of the dataset; groups that are missing are created
    values : array, or texts
    units, text : unit and long name
    dims : paths of the scales of its axes
    chunk : int
        Rows of a chunk of a dataset that can grow, with checksums; 0 for a dataset of fixed size.
    fill : float, optional
        Value of rows that are not written yet; such a dataset has no checksums.
    written : bool
        Whether the values are written; if not, `write_data` writes them.
    """
    values = np.asarray(values)
    stored, given = kinds_of(values)
    layout = h5p.create(h5p.DATASET_CREATE)
    layout.set_obj_track_times(False)  # the same numbers give the same file
    space = space_of(values.shape)
    if chunk:
        space = h5s.create_simple(values.shape, (h5s.UNLIMITED, *values.shape[1:]))
        layout.set_chunk((chunk, *values.shape[1:]))
        if fill is None:
            layout.set_fletcher32()
        else:
            layout.set_fill_value(np.array(fill))
    data = h5d.create(file.id, path.encode(), stored, space, layout, _links())
    if values.size and written:
        data.write(h5s.ALL, h5s.ALL, np.ascontiguousarray(values), mtype=given)
    write_attribute(data, "units", units)
    write_attribute(data, "long_name", text)
    for axis, dim in enumerate(dims):
        h5ds.attach_scale(data, h5d.open(file.id, dim.encode()), axis)


def write_data(file: Any, path: str, values: np.ndarray) -> None:
    """Write all numbers of a dataset that was added without them."""
    _, given = kinds_of(values)
    h5d.open(file.id, path.encode()).write(h5s.ALL, h5s.ALL, np.ascontiguousarray(values), mtype=given)


@cache
def _links() -> Any:
    """Way to create datasets with the groups of their paths."""
    links = h5p.create(h5p.LINK_CREATE)
    links.set_create_intermediate_group(True)
    links.set_char_encoding(h5t.CSET_UTF8)
    return links


def add_scale(
    file: Any, name: str, values: Any, text: str, unit: str = "1", chunk: int = 0, fill: float | None = None,
    written: bool = True,
) -> None:  # fmt: skip
    """Add a dimension scale with names (a list) or numbers (an array) as its values; see `add_data`.

    Names are stored twice: as texts of variable length for other programs, and as an attribute that `fsm` checks and reads.
    """
    if isinstance(values, list):
        add_data(file, name, np.array(values, dtype=object), unit, text)
        write_attributes(file[name], {"names": values})
    else:
        numbers = values if values.dtype == float else values.astype(np.int64)
        add_data(file, name, numbers, unit, text, (), chunk, fill, written)
    h5ds.set_scale(h5d.open(file.id, name.encode()), name.rpartition("/")[2].encode())


def write_parts(file: Any, quad_names: Sequence[str]) -> None:
    """Write the names of all parts that are drawn, and the part of every quad."""
    numbers = {name: k for k, name in enumerate(dict.fromkeys(quad_names))}
    add_scale(file, "part", list(numbers), "body, film, cable, beam or bar")
    of_quad = np.array([numbers[name] for name in quad_names], dtype=np.int64)
    add_data(file, "quad_part", of_quad, "1", "part of a plate: index in /part", ("quad",))


def read_parts(file: Any) -> tuple[str, ...]:
    """Read the name of the part of every quad; empty for older files."""
    if "quad_part" not in file:
        return ()
    names, numbers = names_in(file, "part"), numbers_in(file, "quad_part", file["quad"].shape).astype(np.int64)
    if len(numbers) and not 0 <= numbers.min() <= numbers.max() < len(names):
        raise ValueError("/quad_part refers to parts that are not in /part")
    return tuple(names[k] for k in numbers.tolist())


def write_film(file: Any, film: Film) -> None:
    """Write probes, modes and stresses of a film, and create the empty datasets of the samples."""
    add_scale(file, "probe", list(film.probe_names), "probe")
    add_scale(file, "mode", np.arange(1, len(film.frequency) + 1), "number of the natural mode")
    add_scale(file, "principal", np.arange(2), "principal stress, the larger one first")
    states = ", ".join(f"{number} {name}" for number, name in enumerate(STATES))
    for path, values, dims, units, text in (
        ("probes/rest", film.probe_rest, ("probe", "axis"), "m", "where the probe rests"),
        ("modes/frequency", film.frequency, ("mode",), "Hz", "natural frequency, negative for an unstable mode"),
        ("modes/shape", film.mode_shape, ("mode", "quad", "corner", "axis"), "1", "motion of corners; the largest is 1"),
        ("film/stress", film.stress, ("quad", "principal"), "Pa", "principal stress of the tensioned state"),
        ("film/direction", film.direction, ("quad", "axis"), "1", "direction of the larger principal stress"),
        ("film/state", film.state, ("quad",), "1", f"of the tensioned film: {states}"),
    ):
        add_data(file, path, values, units, text, dims)
    add_scale(file, SAMPLE_TIME, np.zeros(0), "time of the sample", "s", 256, np.nan)
    add_data(
        file, "probes/displacement", np.zeros((0, *film.probe_rest.shape)), "m",
        "displacement of the probe from rest: along the film, across it, normal to it", (SAMPLE_TIME, "probe", "axis"), 256,
    )  # fmt: skip


def read_film(file: Any) -> Film | None:
    """Read the film from a results file; None for another structure."""
    if "film" not in file:
        return None
    probes, (modes,), (quads,) = names_in(file, "probe"), file["mode"].shape, file["quad"].shape
    return Film(
        probe_names=probes,
        probe_rest=numbers_in(file, "probes/rest", (len(probes), 3)),
        frequency=numbers_in(file, "modes/frequency", (modes,)),
        mode_shape=numbers_in(file, "modes/shape", (modes, quads, 4, 3)),
        stress=numbers_in(file, "film/stress", (quads, 2)),
        direction=numbers_in(file, "film/direction", (quads, 3)),
        state=numbers_in(file, "film/state", (quads,)),
    )


def append_samples(file: Any, samples: ProbeSamples) -> None:
    """Append samples; times are written last, because a reader counts samples by their times."""
    times, moved = file[SAMPLE_TIME], file["probes/displacement"]
    start, stop = len(times), len(times) + len(samples.time)
    moved.resize(stop, axis=0)
    moved[start:stop] = samples.displacement
    file.flush()
    times.resize(stop, axis=0)
    times[start:stop] = samples.time
    file.flush()


def read_samples(file: Any) -> ProbeSamples:
    """Read the samples from a results file, finished or not."""
    if "film" not in file:
        return ProbeSamples()
    times = numbers_in(file, SAMPLE_TIME, (None,), finite=False)
    bad = ~np.isfinite(times)
    count = int(np.argmax(bad)) if bad.any() else len(times)
    shape = (None, *file["probes/rest"].shape)
    return ProbeSamples(times[:count], numbers_in(file, "probes/displacement", shape, first=count))


_CURVE = {
    "travel": (("curve_time", "drive_name"), "m", "travel of the drive"),
    "force": (("curve_time", "drive_name"), "N", "force of the drive, positive in its direction"),
    "path": (("curve_time",), "1", "even: twice the number of a quasi-static path; odd: motion between two such paths"),
    "panels": (("curve_time",), "J", "elastic energy of the plain panels"),
    "creases": (("curve_time",), "J", "elastic energy of the creases"),
}


def units_of_drives(names: Sequence[str], units: str) -> str:
    """Units of the travels (`units` "m") or forces ("N") of drives by their names; some drives turn bodies."""
    turning = {name.endswith("(turn)") for name in names}
    of = {False: units, True: {"m": "rad", "N": "N m"}[units]}
    return ", ".join(of[turns] for turns in sorted(turning)) or units


def add_curve(file: Any, curve: ForceCurve, drive_names: Sequence[str]) -> None:
    """Add the datasets of the force curve, which has more points than the records; `write_curve` writes its numbers."""
    add_scale(file, _CURVE_TIME, curve.time, "time of the point of the curve", "s", written=False)
    for name, (dims, units, text) in _CURVE.items():
        units = units_of_drives(drive_names, units) if "drive_name" in dims else units
        paths = [_CURVE_TIME if dim == "curve_time" else dim for dim in dims]
        add_data(file, f"curve/{name}", getattr(curve, name), units, text, paths, written=False)


def write_curve(file: Any, curve: ForceCurve) -> None:
    """Write the numbers of the force curve."""
    write_data(file, _CURVE_TIME, curve.time)
    for name in _CURVE:
        write_data(file, f"curve/{name}", getattr(curve, name))


def read_curve(file: Any) -> ForceCurve | None:
    """Read the force curve from a results file; None if the file has no curve."""
    if "curve" not in file:
        return None
    time = numbers_in(file, _CURVE_TIME, (None,))
    sizes = {"curve_time": len(time), "drive_name": file["drive_name"].shape[0]}
    found = {name: numbers_in(file, f"curve/{name}", tuple(sizes[d] for d in dims)) for name, (dims, *_) in _CURVE.items()}
    found["path"] = found["path"].astype(np.int64)
    return ForceCurve(time=time, pair_force=np.zeros((len(time), 0)), **found)
