"""Natural modes and arc-length load paths of the steps of a run, and their datasets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fsm.io.csv_file import write_csv
from fsm.io.hdf5_checked import names_in, numbers_in
from fsm.results.datasets import add_data, add_scale
from fsm.text.load_names import load_units
from fsm.text.short_repr import ShortRepr


@dataclass(frozen=True, repr=False)
class StepModes(ShortRepr):
    """Natural modes about the state at the end of a step.

    Attributes
    ----------
    step : number of the step of each mode, from 1, (m,)
    frequency : (m,) array, Hz
        Negative for an unstable mode.
    shape : (m, n_quads, 4, 3) array
        Displacement of the corner points of all plates; the largest is 1.
    increment : (m, nu) array
        Increments of the free coordinates, in the order of /state/u; the largest is 1.
    """

    step: np.ndarray
    frequency: np.ndarray
    shape: np.ndarray
    increment: np.ndarray

    @classmethod
    def joined(cls, found: Sequence[StepModes]) -> StepModes | None:
        """Modes of several steps; None for none."""
        if not found:
            return None
        parts = zip(*((one.step, one.frequency, one.shape, one.increment) for one in found), strict=True)
        return cls(*(np.concatenate(part) for part in parts))


_DATA = {
    "step": ((), "1", "number of the step that found the mode, from 1"),
    "frequency": ((), "Hz", "natural frequency, negative for an unstable mode"),
    "shape": (("quad", "corner", "axis"), "1", "displacement of corner points; the largest is 1"),
    "increment": (("rate",), "1", "increments of the free coordinates; the largest is 1"),
}


def write_step_modes(file: Any, modes: StepModes) -> None:
    """Write the modes of all steps."""
    add_scale(file, "step_modes/mode", np.arange(1, len(modes.frequency) + 1), "number of the natural mode")
    for name, (dims, units, text) in _DATA.items():
        values = getattr(modes, name)
        if 0 in values.shape:
            continue
        add_data(file, f"step_modes/{name}", values, units, text, ("step_modes/mode", *dims))


def read_step_modes(file: Any) -> StepModes | None:
    """Read the modes of all steps; None if there are none."""
    if "step_modes" not in file:
        return None
    (count,) = file["step_modes/mode"].shape
    found = {}
    for name, (dims, _, _) in _DATA.items():
        shape = (count, *(len(file[dim]) for dim in dims))
        path = f"step_modes/{name}"
        found[name] = np.zeros(shape) if 0 in shape else numbers_in(file, path, shape)
    found["step"] = found["step"].astype(np.int64)
    return StepModes(**found)


@dataclass(frozen=True, repr=False)
class LoadPath(ShortRepr):
    """Loads at all points of the arc-length paths of a run.

    Attributes
    ----------
    step : number of the step of each point, from 1, (n,)
    time : (n,) array, s
        Time at which loads and drives are evaluated.
    negative_modes : (n,) array
        Number of directions in which the energy decreases; 0 for a stable equilibrium.
    names : names of the loads
    size : (n, n_loads) array, N or N m; Pa for a pressure
        NaN in a step without this load.
    way : (n, n_loads) array, m or rad; m^3 for a pressure
        Displacement of the point of the load along its force, or rotation about its moment, since the start of the step;
        volume that a pressure has swept.
    """

    step: np.ndarray
    time: np.ndarray
    negative_modes: np.ndarray
    names: tuple[str, ...]
    size: np.ndarray
    way: np.ndarray

    @property
    def stable(self) -> np.ndarray:
        """1 for a stable equilibrium, 0 for an unstable equilibrium, (n,)."""
        return (self.negative_modes == 0).astype(float)

    @classmethod
    def of(cls, paths: Sequence[dict[str, Any]]) -> LoadPath | None:
        """Loads of all steps; paths of other methods are empty. None if there are no paths."""
        found = [(number, path) for number, path in enumerate(paths, 1) if path]
        if not found:
            return None
        names = tuple(dict.fromkeys(name for _, path in found for name in path["loads"]))
        rows = []
        for _, path in found:
            row = np.full((len(path["time"]), len(names), 2), np.nan)
            for k, name in enumerate(names):
                if name in path["loads"]:
                    row[:, k] = path["loads"][name]
            rows.append(row)
        values = np.concatenate(rows)
        step = np.concatenate([np.full(len(path["time"]), number) for number, path in found])
        time = np.concatenate([path["time"] for _, path in found])
        negative = np.concatenate([path["negative_modes"] for _, path in found]).astype(float)
        return cls(step, time, negative, names, values[:, :, 0], values[:, :, 1])


_LOADS = {
    "step": ((), "1", "number of the step, from 1"),
    "time": ((), "s", "argument of the functions of time of loads and drives"),
    "stable": ((), "1", "1 for a stable equilibrium"),
    "negative_modes": ((), "1", "number of directions in which the energy decreases"),
    "size": (("load_path/load",), "N, N m, Pa", "force, moment of a load without force, or pressure"),
    "way": (("load_path/load",), "m, rad, m^3", "displacement along the force, rotation about the moment, or swept volume"),
}


def write_load_path(file: Any, path: LoadPath) -> None:
    """Write the loads of paths by arc length."""
    add_scale(file, "load_path/point", np.arange(1, len(path.time) + 1), "number of the point")
    add_scale(file, "load_path/load", list(path.names), "load")
    for name, (dims, units, text) in _LOADS.items():
        values = np.asarray(getattr(path, name), dtype=float)
        if 0 in values.shape:
            continue
        add_data(file, f"load_path/{name}", values, units, text, ("load_path/point", *dims))


def read_load_path(file: Any) -> LoadPath | None:
    """Read the loads of paths by arc length; None if there are none."""
    if "load_path" not in file:
        return None
    (count,), names = file["load_path/point"].shape, names_in(file, "load_path/load")
    sizes = {"load_path/load": len(names)}
    found: dict[str, Any] = {}
    for name, (dims, _, _) in _LOADS.items():
        shape = (count, *(sizes[dim] for dim in dims))
        if f"load_path/{name}" not in file:
            continue  # an older result has no number of negative modes
        found[name] = np.zeros(shape) if 0 in shape else numbers_in(file, f"load_path/{name}", shape, False)
    stable = found.pop("stable")
    found.setdefault("negative_modes", 1.0 - stable)
    return LoadPath(names=names, **{**found, "step": found["step"].astype(np.int64)})


def write_load_path_csv(path: LoadPath, target: Path) -> None:
    """Write the load-displacement curve with 12 significant digits."""
    columns = {"step": path.step, "program time (s)": path.time, "stable": path.stable}
    columns["negative modes"] = path.negative_modes
    for k, name in enumerate(path.names):
        units = load_units(name)
        columns[f"{name} ({units.size})"] = path.size[:, k]
        columns[f"{units.way} of {name} ({units.displacement})"] = path.way[:, k]
    write_csv(target, columns, np.column_stack(list(columns.values())))
