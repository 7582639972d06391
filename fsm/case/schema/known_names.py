"""Hints at the end of messages about unknown names, and about words that mean a known one."""

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


_LOOP = 'a closed cable over pulleys of radii r1 and r2 is kind = "gear" with parameters = { ratio = -r2/r1 }, crossed r2/r1'
_SYNONYMS = {
    "revolute": ("hinge", "pin", "pivot", "rotational", "rotation", "turning"),
    "prismatic": ("slider", "sliding", "slide", "translational", "translation", "rail"),
    "spherical": ("ball", "ball joint", "ball-and-socket", "socket"),
    "universal": ("cardan", "hooke", "cross"),
    "fixed": ("weld", "welded", "rigid", "clamp"),
    "distance": ("rod", "link"),
    "screw": ("helical",),
    "gear": ("gears", "wheels"),
}
_LOOPS = "cable", "cables", "belt", "chain", "pulley", "synchronisation", "synchronization"


def meant(value: object, expected: str) -> str:
    """Remark ``; write "revolute"`` on a word that is not among the expected ones; empty if none of them means the same.

    Parameters
    ----------
    value : the value that a case gives
    expected : text with all accepted values, each between quotation marks
    """
    if not isinstance(value, str):
        return ""
    word = value.lower()
    if word in _LOOPS and "'gear'" in expected:
        return f"; {_LOOP}"
    found = (known for known, words in _SYNONYMS.items() if word == known or word in words)
    return next((f'; write "{known}"' for known in found if f"'{known}'" in expected), "")
