"""Dicts stored as HDF5 attributes; lists and dicts inside them become JSON under ``<name>_json``."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from fsm.io.hdf5_checked import attribute, fixed_text, write_attribute

SUFFIX = "_json"


def write_attributes(group: Any, values: dict[str, Any]) -> None:
    """Add `values` to the attributes of an HDF5 group.

    Raises
    ------
    TypeError
        A value cannot be written as JSON.
    """
    for name, value in values.items():
        if isinstance(value, str):
            write_attribute(group.id, name, fixed_text(value))
        elif isinstance(value, bool | int | float | np.generic):
            write_attribute(group.id, name, value)
        else:
            write_attribute(group.id, name + SUFFIX, fixed_text(json.dumps(value, default=_plain)))


def stored_attributes(values: dict[str, Any]) -> dict[str, Any]:
    """The values that `read_attributes` reads after `write_attributes` has written them, in the same order."""
    plain = json.loads(json.dumps(values, default=_plain))
    json_names = {name for name, value in values.items() if not isinstance(value, str | bool | int | float | np.generic)}
    return {name: plain[name] for name in sorted(plain, key=lambda name: name + SUFFIX * (name in json_names))}


def read_attributes(group: Any) -> dict[str, Any]:
    """Read all attributes of an HDF5 group as plain Python values, in the order of their names."""
    values: dict[str, Any] = {}
    for name in group.attrs:
        value = attribute(group, name)
        if name.endswith(SUFFIX):
            values[name.removesuffix(SUFFIX)] = json.loads(value)
        else:
            values[name] = value
    return values


def _plain(value: Any) -> Any:
    """NumPy value as a plain Python value, for JSON."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} cannot be stored in a results file")
