"""Compact texts of arrays for a page: quantised, compressed, and written in base64; and JSON that is safe in HTML."""

from __future__ import annotations

import base64
import gzip
import json
from typing import Any

import numpy as np

from fsm.io.json_values import finite_values

LEVELS = 65_534
"""Number of steps between the smallest and the largest value of `pack_levels`; the level after the last one means NaN."""


def compressed(data: bytes) -> str:
    """Bytes in gzip format as base64."""
    return base64.b64encode(gzip.compress(data, 6, mtime=0)).decode("ascii")


def _shuffled(values: np.ndarray) -> str:
    """Compressed bytes of an array: first bytes of all numbers, then all second bytes, ..."""
    rows = np.ascontiguousarray(values).view(np.uint8).reshape(-1, values.dtype.itemsize)
    return compressed(np.ascontiguousarray(rows.T).tobytes())


def pack_floats(values: Any) -> dict[str, Any]:
    """Numbers with single precision; NaN and infinity are allowed."""
    array = np.ascontiguousarray(values, dtype="<f4")
    return {"type": "f4", "shape": list(array.shape), "data": _shuffled(array)}


def pack_doubles(values: Any) -> dict[str, Any]:
    """Numbers with double precision, for example times whose small differences matter."""
    array = np.ascontiguousarray(values, dtype="<f8")
    return {"type": "f8", "shape": list(array.shape), "data": _shuffled(array)}


def pack_integers(values: Any) -> dict[str, Any]:
    """Integers from 0 to 2^32 - 1."""
    array = np.ascontiguousarray(values, dtype="<u4")
    return {"type": "u4", "shape": list(array.shape), "data": _shuffled(array)}


def pack_levels(values: Any, per_column: bool = False) -> dict[str, Any]:
    """Numbers as 65,535 levels between the smallest and the largest; differences along the first axis are stored.

    Parameters
    ----------
    values : (n, ...) array
        NaN is kept.
    per_column : bool
        Levels for each index of the last axis, for example for coordinates.

    Returns
    -------
    dict
        With ``low`` and ``high``, a list with `per_column`.
    """
    array = np.asarray(values, dtype=float)
    finite = np.where(np.isfinite(array), array, np.nan)
    axes = tuple(range(array.ndim - 1)) if per_column else None
    known = np.isfinite(finite)
    low = np.min(np.where(known, finite, np.inf), axis=axes, initial=np.inf)
    high = np.max(np.where(known, finite, -np.inf), axis=axes, initial=-np.inf)
    low, high = np.where(low > high, 0.0, low), np.where(low > high, 0.0, high)
    span = np.where(high > low, high - low, 1.0)
    levels = np.where(known, np.round((np.where(known, finite, 0.0) - low) / span * LEVELS), LEVELS + 1).astype("<u2")
    change = levels.copy()
    change[1:] -= levels[:-1]  # modulo 2^16
    packed = {"type": "u2", "shape": list(array.shape), "data": _shuffled(change)}
    return packed | {"low": np.asarray(low).tolist(), "high": np.asarray(high).tolist()}


def safe_json(data: Any) -> str:
    """JSON for a script element: no character can end the element, and numbers that are not finite are null."""
    text = json.dumps(finite_values(data), ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
