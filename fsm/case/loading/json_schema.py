"""JSON Schema of case files for editors: keys, types, bounds, defaults, and descriptions with units.

The schema follows from the models that check cases. The schema is less strict: it does not compare keys with each other.
Bounds of plain numbers apply only at zero, because a plain number may be in either unit system.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel, BeforeValidator

from fsm.case.models.case import Case, root
from fsm.case.schema.schema import Place, facts_of, metadata_of, plain
from fsm.case.schema.units import Unit

_QUANTITY = r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*[^\d\s]?.*$"
"""Pattern of a number with a unit."""
_COMPLETED = {"Contact": {"stiffness"}, "LinearCrease": {"stiffness"}, "FamilyCrease": {"file"}, "SplineCrease": {"law"}}
"""Required keys that the reader of a case derives from other keys."""
_LIMITS = {Gt: ("gt", "exclusiveMinimum"), Ge: ("ge", "minimum"), Lt: ("lt", "exclusiveMaximum"), Le: ("le", "maximum")}


def case_schema(added: Mapping[str, type[BaseModel]] | None = None) -> dict[str, Any]:
    """JSON Schema (draft 7) of a case file.

    Parameters
    ----------
    added : models of the sections of builders that extensions add, by the names of the sections
    """
    definitions: dict[str, Any] = {}
    schema = _section(root({}), Case, definitions)
    for name, model in (added or {}).items():
        definitions[f"extension {name}"] = _section(root({}), model, definitions)
        schema["properties"][name] = {"$ref": f"#/definitions/extension {name}"}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "fsm case",
        "description": "Case file of fsm; plain numbers are in SI, or in mm, t, s, N with units = \"mm-N-s\"",
        **schema,
        "definitions": definitions,
    }


def _section(place: Place, model: type[BaseModel], definitions: dict[str, Any]) -> dict[str, Any]:
    """Schema of the section of a model."""
    here = Place(model, None, place.beside)
    properties, required = {}, []
    for key, field in model.model_fields.items():
        inner = here.step(key)
        assert inner is not None
        properties[key] = _described(_value(inner, inner.kind, definitions), here, key)
        if field.is_required() and key not in _COMPLETED.get(model.__name__, ()):
            required.append(key)
    schema: dict[str, Any] = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**schema, "required": required} if required else schema


def _described(schema: dict[str, Any], section: Place, key: str) -> dict[str, Any]:
    """Schema with the meaning, unit, range and default of the key."""
    facts = facts_of(section, key)
    parts = [facts.meaning] if facts.meaning else []
    others = (("unit", facts.unit), ("range", facts.range), ("default", facts.default))
    parts += [f"{word}: {text}" for word, text in others if text]
    text = plain("; ".join(parts))
    described = {"allOf": [schema]} if "$ref" in schema else dict(schema)
    return {**described, "description": text} if text else described


def _value(place: Place, kind: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    """Schema of a value."""
    metadata = metadata_of(kind)
    choices: list[Any] = []
    for leaf in Place(kind, None, place.beside).variants():
        if leaf is not type(None):
            schema = _leaf(place, leaf, metadata, definitions)
            choices += schema["anyOf"] if set(schema) == {"anyOf"} else [schema]
    choices = [choice for k, choice in enumerate(choices) if choice not in choices[:k]]
    return choices[0] if len(choices) == 1 else {"anyOf": choices}


def _leaf(place: Place, leaf: Any, metadata: list[Any], definitions: dict[str, Any]) -> dict[str, Any]:
    origin, arguments = get_origin(leaf), get_args(leaf)
    if isinstance(leaf, type) and issubclass(leaf, BaseModel):
        name = leaf.__name__
        if name not in definitions:
            definitions[name] = {}  # the model may contain itself
            definitions[name] = _section(place, leaf, definitions)
        return {"$ref": f"#/definitions/{name}"}
    if origin is Literal:
        return {"enum": list(arguments)}
    if origin is tuple:
        return _list(place, arguments, metadata, definitions)
    if origin is dict or leaf is dict:
        inner = place.step("name")
        items = {} if inner is None else _value(inner, inner.kind, definitions)
        return {"type": "object", "additionalProperties": items}
    if leaf is bool:
        return {"type": "boolean"}
    if leaf is int:
        return {"type": "integer", **_bounds(metadata, False)}
    if leaf is float:
        unit = next((each for each in metadata if isinstance(each, Unit)), None)
        number = {"type": "number", **_bounds(metadata, unit is not None and bool(unit.symbol))}
        return number if unit is None else {"anyOf": [number, {"type": "string", "pattern": _QUANTITY}]}
    if leaf is str or leaf is Path:
        lengths = {(MinLen, "minLength"), (MaxLen, "maxLength")}
        found = {word: size for kind, word in lengths for size in _sizes(metadata, kind)}
        return {"type": "string", **found}
    return {}


def _list(
    place: Place, items: tuple[Any, ...], metadata: list[Any], definitions: dict[str, Any]
) -> dict[str, Any]:
    """Schema of a list; some lists may be given as a single value."""
    if len(items) == 2 and items[1] is Ellipsis:
        inner = _value(Place(items[0], None, {}), items[0], definitions)
        schema: dict[str, Any] = {"type": "array", "items": inner}
        counts = ((MinLen, "minItems"), (MaxLen, "maxItems"))
        schema |= {word: size for kind, word in counts for size in _sizes(metadata, kind)}
        single = any(isinstance(each, BeforeValidator) for each in metadata)
        return {"anyOf": [inner, schema]} if single else schema
    each = [_value(Place(item, None, {}), item, definitions) for item in items]
    return {"type": "array", "items": each, "minItems": len(each), "maxItems": len(each)}


def _bounds(metadata: list[Any], has_unit: bool) -> dict[str, Any]:
    """Bounds of a number; for a number with a unit, only those at zero."""
    found = {}
    for item in metadata:
        for kind, (name, word) in _LIMITS.items():
            if isinstance(item, kind) and (not has_unit or getattr(item, name) == 0):
                found[word] = getattr(item, name)
    return found


def _sizes(metadata: list[Any], kind: Any) -> list[int]:
    name = "min_length" if kind is MinLen else "max_length"
    return [getattr(item, name) for item in metadata if isinstance(item, kind)]
