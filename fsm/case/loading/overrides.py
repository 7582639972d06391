"""Overrides: values of a case by dotted path, from the command line or from a row of a table."""

from __future__ import annotations

import copy
import itertools
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from fsm.case.models.case import root
from fsm.case.schema.faults import unknown_key
from fsm.case.schema.schema import Place
from fsm.errors import Fault


@dataclass(frozen=True)
class Given:
    """Value that is given from Python and needs no parsing; None removes the key."""

    value: Any


REMOVE = "none"
"""Value that removes a key or a section from the case: ``--set friction=none``."""


def split_override(text: str) -> tuple[str, str] | Fault:
    """Path and value of an override ``"a.b=value"``, or the fault of the override."""
    path, sign, value = text.partition("=")
    if not sign or not path.strip() or not value.strip():
        return Fault(f"--set {text}", "write the override as path=value, for example strip.thickness=0.0003")
    return path.strip(), value.strip()


def parse_value(text: str) -> Any:
    """TOML value (``3``, ``true``, ``[0, 0, 1]``, ``"80 deg"``), or the text itself if it is not TOML (``80 deg``)."""
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return parsed["value"] if set(parsed) == {"value"} else text


def apply_overrides(
    data: Mapping[str, Any], pairs: Iterable[tuple[str, str | Given]], label: str = "--set "
) -> tuple[dict[str, Any], list[Fault]]:
    """Set values in a copy of a case.

    Parameters
    ----------
    data : mapping
        Case as read from its file.
    pairs : iterable of (path, value)
        A text from the command line or a table is parsed by `parse_value`; a value in a `Given` is set as it is.
    label : str
        Text in front of the path of a fault.

    Returns
    -------
    dict
        Case with all valid overrides; sections without an override are those of `data`.
    list of Fault
        Faults of overrides with an impossible path.
    """
    result: dict[str, Any] = dict(data)
    faults: list[Fault] = []
    for path, text in pairs:
        keys = keys_of(path)
        section = str(keys[0])
        if section in result and result[section] is data.get(section):
            result[section] = copy.deepcopy(result[section])
        problem = check_path(path) or _put(result, keys, text)
        if problem:
            faults.append(Fault(f"{label}{path}", problem))
    return result, faults


@lru_cache(maxsize=1000)
def check_path(path: str) -> str:
    """Message about an impossible path; empty if a case can have a value there."""
    place, walked = root({}), ""
    for key in keys_of(path):
        following = place.step(key)
        if following is None:
            return _no_such_place(
                place.keys(), place.is_list_of_sections() or bool(place.step(0)), key, walked
            )
        place, walked = following, f"{walked}.{key}" if walked else str(key)
    return ""


def place_at(data: Mapping[str, Any], path: str) -> Place | None:
    """Place of a dotted path in a case; other keys, such as an exponent, may determine its unit. None if there is none."""
    place: Place | None = root(data)
    for key in keys_of(path):
        place = place.step(key) if place is not None else None
    return place


def keys_of(path: str) -> list[str | int]:
    """Keys and item numbers of a dotted path."""
    return [int(key) if key.isascii() and key.isdigit() else key for key in path.split(".")]


def _no_such_place(known: list[str], is_list: bool, key: str | int, walked: str) -> str:
    if known:
        message = unknown_key(str(key), known)
        return message if "`" not in message or not walked else message.replace("`", f"`{walked}.", 1)
    if is_list and isinstance(key, str):
        return f"`{walked}` is a list; give the number of the item, from 0, before `{key}`"
    if is_list:
        return f"`{walked}` has no item {key}; items are counted from 0"
    return f"`{walked}` is a value and has no keys; remove the rest of the path"


def _put(data: dict[str, Any], keys: list[str | int], given: str | Given) -> str:
    """Set or remove one value in place; return a message if this is impossible, else an empty text."""
    here: Any = data
    for key, following in itertools.pairwise(keys):
        empty: Any = [] if isinstance(following, int) else {}
        problem = _reach(here, key, empty)
        if problem:
            return problem
        here = here[key]
        if not isinstance(here, list if isinstance(following, int) else dict):
            return f"the case has `{key} = {here!r}`, which is a value and has no keys"
    last = keys[-1]
    if given.value is None if isinstance(given, Given) else given.strip() == REMOVE:
        if isinstance(here, dict):
            here.pop(last, None)
        elif isinstance(last, int) and last < len(here):
            del here[last]
        return ""
    problem = _reach(here, last, None)
    if not problem:
        here[last] = given.value if isinstance(given, Given) else parse_value(given)
    return problem


def _reach(here: Any, key: str | int, empty: Any) -> str:
    """Create `here[key]` if it does not exist; a list can grow by one item."""
    if isinstance(here, dict):
        here.setdefault(key, empty)
    elif isinstance(key, int) and key == len(here):
        here.append(empty)
    elif isinstance(key, int) and key > len(here):
        return f"the case has only {len(here)} items there; the next one is number {len(here)}"
    return ""
