"""Number of records of a run, and its limit."""

from __future__ import annotations

import math

from fsm.case.models.solve import MOST_RECORDS
from fsm.errors import CaseError, Fault


def record_count(span: float, interval: float, path: str) -> int:
    """Number of whole intervals in a span, both in the same unit.

    Parameters
    ----------
    span, interval : float
    path : str
        Dotted path of the key of the interval, for messages.

    Raises
    ------
    CaseError
        The number exceeds one million.
    """
    if span > MOST_RECORDS * interval:
        text = f"gives more than {MOST_RECORDS:,} records, one every {interval:.3g} of {span:.3g}; increase the interval"
        raise CaseError(Fault(path, text))
    return math.floor(span / interval * (1.0 + 1e-12))
