"""Words that people write in place of the values of keys."""

from __future__ import annotations

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
