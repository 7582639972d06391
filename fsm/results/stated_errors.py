"""Names of the errors that a summary states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

_LABELS = {
    "positions_along": "positions along", "probes": "probe", "frequencies": "frequencies of", "loads": "displacement of",
    "limit_points": "limit points of",
}  # fmt: skip


def largest_errors(stated: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Names of the numbers of a statement, and the error of each; the largest error where there are several.

    >>> largest_errors({"by": "comparison", "peak_force": 0.02, "probes": {"tip": 0.01}, "positions_along": {"z": 0.3}})
    [('peak force', 0.02), ('probe tip', 0.01), ('positions along z', 0.3)]
    """
    found: list[tuple[str, float]] = []
    for name, errors in stated.items():
        if name in ("by", "positions_since") or errors is None:
            continue
        each = errors.items() if isinstance(errors, Mapping) else [("", errors)]
        for one, error in each:
            known = [e for e in (error if isinstance(error, Sequence) else [error]) if e is not None]
            if known:
                found.append((f"{_LABELS.get(name, name.replace('_', ' '))} {one}".strip(), float(max(known))))
    return found
