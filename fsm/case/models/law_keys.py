"""Sections whose keys depend on their law: required, optional and unused keys of each law."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

from pydantic import ValidationInfo
from pydantic_core import PydanticCustomError, PydanticKnownError

from fsm.case.schema.units import with_unit


class LawKeys(NamedTuple):
    """Required and optional keys of a law."""

    needed: tuple[str, ...]
    optional: tuple[str, ...] = ()


Laws = Mapping[str, LawKeys]

MISSING: Final = object()
"""Placeholder for a missing value that the law requires; the validation of the key then reports the fault at the path of the
key."""


def mark_missing(written: Mapping[str, Any], laws: Laws, law: object) -> dict[str, Any]:
    """Section with `MISSING` for every required key that is missing."""
    needed = laws[law].needed if isinstance(law, str) and law in laws else ()
    return {**dict.fromkeys(needed, MISSING), **written}


def check_key(laws: Laws) -> Callable[[Any, ValidationInfo], Any]:
    """Validator that runs before the validation of a key; it refuses missing required keys and unused keys."""
    of_laws = {key for keys in laws.values() for key in _keys(keys)}

    def check(value: Any, info: ValidationInfo) -> Any:
        key, law = info.field_name, info.data.get("law", "")
        if value is MISSING:
            raise PydanticKnownError("missing")
        if key in of_laws and law in laws and value is not None and key not in _keys(laws[law]):
            others = [with_unit(name, None) for name, keys in laws.items() if key in _keys(keys)]
            text = f"not used with law = {with_unit(law, None)}, only with {_listed(others)}; remove this key"
            raise PydanticCustomError("quantity", "{text}", {"text": text})
        return value

    return check


def without_unused(data: Mapping[str, Any], laws: Laws) -> dict[str, Any]:
    """Section without the keys that its law does not use."""
    of_laws = {key for keys in laws.values() for key in _keys(keys)}
    used = _keys(laws[data["law"]])
    return {key: value for key, value in data.items() if key not in of_laws or key in used}


def _keys(keys: LawKeys) -> tuple[str, ...]:
    return keys.needed + keys.optional


def _listed(names: list[str]) -> str:
    return " or ".join(names) if len(names) < 3 else f"{', '.join(names[:-1])} or {names[-1]}"
