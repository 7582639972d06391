"""Natural modes that steps of a run have found, and their datasets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fsm.hdf5_checked import numbers_in
from fsm.results.datasets import add_scale, set_description

__all__ = ["StepModes", "read_step_modes", "write_step_modes"]


@dataclass(frozen=True)
class StepModes:
    """Natural modes about the state at the end of a step.

    Attributes
    ----------
    step : number of the step of each mode, from 1, (m,)
    frequency : (m,) array, Hz
        Negative for an unstable mode.
    shape : (m, n_quads, 4, 3) array
        Motion of the corner points of all plates, the largest 1.
    increment : (m, nu) array
        Increments of the free coordinates, in the order of /state/u; the largest 1.
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
    "shape": (("quad", "corner", "axis"), "1", "motion of corner points, the largest 1"),
    "increment": (("rate",), "1", "increments of the free coordinates, the largest 1"),
}


def write_step_modes(file: Any, modes: StepModes) -> None:
    """Write the modes of all steps."""
    add_scale(file, "step_modes/mode", np.arange(1, len(modes.frequency) + 1), "number of the natural mode")
    for name, (dims, units, text) in _DATA.items():
        values = getattr(modes, name)
        if 0 in values.shape:
            continue
        data = file.create_dataset(f"step_modes/{name}", data=values)
        set_description(data, units, text)
        for axis, dim in enumerate(("step_modes/mode", *dims)):
            data.dims[axis].attach_scale(file[dim])


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
