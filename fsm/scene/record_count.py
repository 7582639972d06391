"""How many records a run makes, and how many are too many."""

from __future__ import annotations

import math

from fsm.errors import CaseError, Fault

__all__ = ["MOST_RECORDS", "record_count"]

MOST_RECORDS = 1_000_000


def record_count(span: float, interval: float, path: str) -> int:
    """Whole intervals in a span, both in the same unit.

    Parameters
    ----------
    path : str
        Dotted path of the key that says the interval.

    Raises
    ------
    CaseError
        More than a million.
    """
    if span > MOST_RECORDS * interval:
        text = f"asks for more than {MOST_RECORDS:,} records, one every {interval:.3g} of {span:.3g}; make it larger"
        raise CaseError(Fault(path, text))
    return math.floor(span / interval * (1.0 + 1e-12))
