"""Translation of errors of pydantic to messages with path, value, unit and remedy."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from fsm.case.schema.known_names import meant
from fsm.case.schema.schema import Place, locate, tags
from fsm.case.schema.units import SYSTEMS, did_you_mean, parse_unit, unit_in, with_unit
from fsm.errors import Fault

MOST_UNKNOWN = 20
"""Largest number of unknown keys with a message each."""
_MOST_FAULTS = 40
"""Largest number of messages about one section."""

Details = Mapping[str, Any]


def dotted(path: Sequence[str | int]) -> str:
    """Path in the notation of `--set`, for example ``drive.0.speed``."""
    return ".".join(str(key) for key in path)


def faults_of(
    error: ValidationError, data: Mapping[str, Any], prefix: Sequence[str | int], system: str, whole: Any
) -> list[Fault]:
    """Translate the errors of one section.

    Parameters
    ----------
    error : ValidationError
    data : mapping
        Complete case as read from its file.
    prefix : path of the section
    system : unit system of plain numbers
    whole : model of the data
    """
    faults, renamed = [], set()
    details = error.errors(include_url=False)
    for detail in details[:_MOST_FAULTS]:
        place, path = locate(data, [*prefix, *detail["loc"]], whole)
        if detail["type"] == "extra_forbidden":
            fault, meant = _extra(data, [*prefix, *detail["loc"][:-1]], path, whole)
            faults.append((detail["type"], fault))
            renamed.add((*path[:-1], meant))
        else:
            value = None if detail["type"] == "missing" else detail["input"]
            fault = replace(_translate(detail, place, path, system), value=value, unit=place.unit() if place else "")
            faults.append((detail["type"], fault))
    if len(details) > _MOST_FAULTS:
        faults.append(("", Fault(dotted(prefix), f"and {len(details) - _MOST_FAULTS:,} more mistakes")))
    # a misspelt key gives one message, not a message about an unknown key and another about a missing key
    hidden = {dotted(path) for path in renamed}
    return [fault for kind, fault in faults if not (kind == "missing" and fault.path in hidden)]


def unknown_key(key: str, known: Sequence[str]) -> str:
    """Message about an unknown key."""
    near = did_you_mean(key, known)
    return f"unknown key{near}" if near else f"unknown key; allowed here: {', '.join(known)}"


def _extra(data: Mapping[str, Any], section: Sequence[str | int], path: list[str | int], whole: Any) -> tuple[Fault, str]:
    """Fault of an unknown key, and the key that the user probably meant."""
    place, _ = locate(data, section, whole)
    key, known = str(path[-1]), place.keys() if place else []
    if place and any(key in model.model_fields for model in place.all_models()):
        tag = place.discriminator()
        law = place.value.get(tag) if isinstance(place.value, Mapping) else None
        other = f"the other keys here, which mean another {tag}" if law is None else f"{tag} = {with_unit(law, None)}"
        return Fault(dotted(path), f"not used with {other}; remove this key"), ""
    message = unknown_key(key, known)
    meant = re.search(r"did you mean `(\w+)`", message)
    return Fault(dotted(path), message), meant[1] if meant else ""


def _translate(detail: Any, place: Place | None, path: list[str | int], system: str) -> Fault:
    kind, context, value = detail["type"], detail.get("ctx", {}), detail["input"]
    unit = place.unit() if place else ""
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        return _variant(place, path, kind)
    if kind == "missing":
        return _missing(path, unit, system)
    if kind in _BOUNDS:
        if place is not None and place.value is not None:  # bounds may be compared with the value in SI
            value = place.value
        return Fault(dotted(path), _out_of_bounds(kind, context, value, unit, system))
    if kind == "value_error":
        return Fault(dotted(path), str(context["error"]))
    if kind == "quantity":
        return Fault(dotted(path), detail["msg"])
    requirement = _REQUIREMENTS.get(kind)
    text = requirement(context, place) if requirement else f"is not accepted ({detail['msg'].lower()})"
    remark = meant(value, str(context["expected"])) if kind == "literal_error" else ""
    return Fault(dotted(path), f"{text}; it is {with_unit(value, unit, system)}{remark}")


_BOUNDS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}


def _out_of_bounds(kind: str, context: Details, value: Any, unit: str, system: str) -> str:
    key, words = _BOUNDS[kind]
    scale = math.prod(b**p for b, p in zip(SYSTEMS[system], parse_unit(unit)[1], strict=True))
    limit = context[key] / scale if unit else context[key]
    shown = f"{limit:.6g} {unit_in(unit, system)}" if unit and limit else f"{limit:.6g}"
    if unit == "rad" and limit and isinstance(value, str) and "deg" in value:
        shown = f"{math.degrees(context[key]):.6g} deg"
    message = f"must be {words} {shown}; it is {with_unit(value, unit, system)}"
    if unit == "rad" and not isinstance(value, str) and abs(value) > abs(context[key]):
        message += f'; write degrees as text, "{value:g} deg"'
    return message


def _missing(path: list[str | int], unit: str, system: str) -> Fault:
    if isinstance(path[-1], int):
        return Fault(dotted(path[:-1]), f"has only {path[-1]} values; value number {path[-1] + 1} is missing")
    what = f"missing; give a value in {unit_in(unit, system)}" if unit else "missing; this key is required"
    return Fault(dotted(path), what)


def _variant(place: Place | None, path: list[str | int], kind: str) -> Fault:
    """Fault of a section whose kind is missing or unknown."""
    if place is None:
        return Fault(dotted(path), "has an unknown kind")
    key = place.discriminator()
    known = [str(tag) for model in place.all_models() for tag in tags(model, key)]
    choice = f"must be {_either(known)}"
    if kind == "union_tag_not_found":
        return Fault(dotted([*path, key]), f"missing; it {choice}")
    given = str(place.value.get(key))
    return Fault(dotted([*path, key]), f"{choice}; it is {with_unit(given, None)}{did_you_mean(given, known)}")


def _literal(context: Details, place: Place | None) -> str:
    return "must be " + re.sub(r"'([^']*)'", r'"\1"', str(context["expected"]))


def _section(context: Details, place: Place | None) -> str:
    keys = place.keys() if place else []
    return "must be a section" + (f" with the keys {', '.join(keys)}" if keys else "")


def _list(context: Details, place: Place | None) -> str:
    if place is not None and place.is_list_of_sections():
        return "must be a list of sections; write its name in two brackets, [[...]]"
    return "must be a list, [a, b, ...]"


_Requirement = Callable[[Details, Place | None], str]

_REQUIREMENTS: dict[str, _Requirement] = {
    "literal_error": _literal,
    "model_type": _section,
    "model_attributes_type": _section,
    "dict_type": _section,
    "tuple_type": _list,
    "too_long": lambda context, place: (
        f"must have {'at most ' if context['actual_length'] is None else ''}{context['max_length']} values"
        + ("" if context["actual_length"] is None else f", not {context['actual_length']}")
    ),
    "string_too_short": lambda context, place: "must not be empty",
    "string_pattern_mismatch": lambda context, place: "must be text without line breaks and control characters",
    "string_too_long": lambda context, place: f"must have at most {context['max_length']} characters",
    "finite_number": lambda context, place: "must be a finite number",
    "string_type": lambda context, place: "must be text in quotes",
    "path_type": lambda context, place: "must be a file name in quotes",
    **dict.fromkeys(("bool_type", "bool_parsing"), lambda context, place: "must be true or false"),
    **dict.fromkeys(("float_type", "float_parsing"), lambda context, place: "must be a number"),
    **dict.fromkeys(
        ("int_type", "int_parsing", "int_from_float", "int_parsing_size"),
        lambda context, place: "must be a whole number",
    ),
}


def _either(names: Sequence[str]) -> str:
    return " or ".join(with_unit(name, None) for name in names)
