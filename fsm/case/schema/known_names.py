"""Hints at the end of messages about unknown names."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

_NAMED = 8
"""Largest number of names in a message."""


def nearest_name(name: str, known: Sequence[str]) -> str:
    """Suggestion of the nearest known name; if no name is near, a list of the known names."""
    close = difflib.get_close_matches(name, known, n=1)
    if close:
        return f"; did you mean {close[0]!r}?"
    shown = ", ".join(repr(one) for one in known[:_NAMED])
    more = f" and {len(known) - _NAMED} more" if len(known) > _NAMED else ""
    return f"; there are {shown}{more}" if known else "; there are none"
