"""Numbers of a case by their dotted paths, in SI: what calibration varies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from fsm.errors import CaseError, Fault
from fsm.scene.case import Case
from fsm.scene.schema import Place, top

__all__ = ["unit_of", "value_at", "with_values"]


def value_at(case: Case, path: str) -> float:
    """The number at a dotted path of a case, SI.

    Raises
    ------
    CaseError
        Nothing stands there, or no number that can be varied continuously.
    """
    here: Any = case
    for key in _keys(path):
        here = _below(here, key)
        if here is None:
            raise CaseError(Fault(path, "the case has no number there; write one in it, or check the path"))
    if isinstance(here, bool) or not isinstance(here, float | int):
        raise CaseError(Fault(path, f"is {here!r}, not a number; only numbers can be varied"))
    if isinstance(here, int) and unit_of(case, path) == "":
        raise CaseError(Fault(path, f"is {here}, a whole number; only continuous numbers can be varied"))
    return float(here)


def with_values(case: Case, values: Mapping[str, float]) -> Case:
    """The case with other numbers (SI) at some paths.

    The paths must be those of numbers (`value_at`); bounds of the case's keys are not looked at.
    """
    changed: Any = case
    for path, value in values.items():
        changed = _put(changed, _keys(path), float(value))
    assert isinstance(changed, Case)
    return changed


def unit_of(case: Case, path: str) -> str:
    """SI unit of what stands at a path of a case; empty for none. It may depend on what stands beside, as an exponent."""
    place: Place | None = top(case.model_dump())
    for key in _keys(path):
        place = place.step(key) if place is not None else None
    return place.unit() if place is not None else ""


def _keys(path: str) -> list[str | int]:
    return [int(key) if key.isascii() and key.isdigit() else key for key in path.split(".")]


def _below(here: Any, key: str | int) -> Any:
    if isinstance(here, BaseModel) and isinstance(key, str):
        return getattr(here, key, None) if key in type(here).model_fields else None
    if isinstance(here, tuple | list) and isinstance(key, int):
        return here[key] if key < len(here) else None
    return None


def _put(here: Any, keys: Sequence[str | int], value: float) -> Any:
    if not keys:
        return value
    key, *rest = keys
    inner = _put(_below(here, key), rest, value)
    if isinstance(here, BaseModel):
        return here.model_copy(update={str(key): inner})
    assert isinstance(here, tuple) and isinstance(key, int)
    return (*here[:key], inner, *here[key + 1 :])
