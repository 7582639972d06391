"""Short texts of objects with arrays, for the console and for notebooks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

_LONGEST_TEXT = 60
"""Largest number of characters of the text of one field."""
_MOST_ITEMS = 4
"""Largest number of items of a list that is shown in full."""


class ShortRepr:
    """Base of a dataclass whose text has the shapes of arrays and the lengths of lists, and not their content.

    The dataclass needs ``@dataclass(repr=False)``.
    """

    def __repr__(self) -> str:
        shown = [f"{field.name}={_text(getattr(self, field.name))}" for field in fields(self) if field.repr]  # type: ignore[arg-type]
        return f"{type(self).__name__}({', '.join(shown)})"


def _text(value: Any) -> str:
    # the value is an array; this test is used because reading a case does not import numpy
    if hasattr(value, "ndim") and hasattr(value, "shape"):
        return f"<array {' x '.join(map(str, value.shape))}>" if value.ndim else repr(value.item())
    if isinstance(value, str):
        return repr(value) if len(value) <= _LONGEST_TEXT else f"<{len(value):,} characters>"
    if isinstance(value, ShortRepr):
        return f"<{type(value).__name__}>"
    if isinstance(value, Mapping | tuple | list) and len(value) > _MOST_ITEMS:
        return f"<{len(value):,} items>"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key!r}: {_text(item)}' for key, item in value.items())}}}"
    if type(value) in (tuple, list):
        return f"[{', '.join(_text(item) for item in value)}]"
    text = repr(value)
    return text if len(text) <= _LONGEST_TEXT else f"<{type(value).__name__}>"
