"""Access to numbers of a case by their dotted paths, in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from fsm.case.models.case import Case, root
from fsm.case.schema.schema import Place
from fsm.errors import CaseError, Fault


def value_at(case: Case, path: str) -> float:
    """Number at a dotted path of a case, in SI units.

    Raises
    ------
    CaseError
        The path has no value, or its value is not a continuous number.
    """
    value: Any = case
    for key in _keys(path):
        value = _child(value, key)
        if value is None:
            raise CaseError(Fault(path, "the case has no number there; add the number, or correct the path"))
    if isinstance(value, bool) or not isinstance(value, float | int):
        raise CaseError(Fault(path, f"is {value!r}, not a number; only numbers can be varied"))
    if isinstance(value, int) and unit_of(case, path) == "":
        raise CaseError(Fault(path, f"is {value}, a whole number; only continuous numbers can be varied"))
    return float(value)


def with_values(case: Case, values: Mapping[str, float]) -> Case:
    """Copy of a case with other numbers (SI) at some paths.

    The paths must be valid for `value_at`. The bounds of the keys are not checked.
    """
    changed: Any = case
    for path, value in values.items():
        changed = _replace_at(changed, _keys(path), float(value))
    assert isinstance(changed, Case)
    return changed


def unit_of(case: Case, path: str) -> str:
    """SI unit of the value at a path of a case (empty without unit); other keys, such as an exponent, may determine it."""
    place: Place | None = root(case.model_dump())
    for key in _keys(path):
        place = place.step(key) if place is not None else None
    return place.unit() if place is not None else ""


def _keys(path: str) -> list[str | int]:
    return [int(key) if key.isascii() and key.isdigit() else key for key in path.split(".")]


def _child(parent: Any, key: str | int) -> Any:
    if isinstance(parent, BaseModel) and isinstance(key, str):
        return getattr(parent, key, None) if key in type(parent).model_fields else None
    if isinstance(parent, tuple | list) and isinstance(key, int):
        return parent[key] if key < len(parent) else None
    return None


def _replace_at(parent: Any, keys: Sequence[str | int], value: float) -> Any:
    if not keys:
        return value
    key, *rest = keys
    child = _replace_at(_child(parent, key), rest, value)
    if isinstance(parent, BaseModel):
        return parent.model_copy(update={str(key): child})
    assert isinstance(parent, tuple) and isinstance(key, int)
    return (*parent[:key], child, *parent[key + 1 :])
