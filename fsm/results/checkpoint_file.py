"""File of a checkpoint: arrays and attributes with a checksum."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from fsm.errors import CaseError
from fsm.io.atomic_write import atomic_write
from fsm.io.hdf5_checked import attribute, fixed_text, numbers_in, written_from_memory
from fsm.results.attributes import read_attributes, write_attributes
from fsm.results.store import open_hdf5

CHECKPOINT_FORMAT = "fsm checkpoint"


def write_checkpoint(path: str | Path, arrays: dict[str, np.ndarray], attributes: dict[str, Any]) -> None:
    """Write arrays and attributes; at any time `path` is the complete old or the complete new checkpoint."""
    path = Path(path)
    with atomic_write(path, to_disk=True) as part, written_from_memory(part) as file:
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
    with open_hdf5(Path(path), CHECKPOINT_FORMAT) as file:
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
