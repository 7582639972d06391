"""Allowed content at each path of a case file: keys, units and variants, taken from the models.

Facts of a key of a case: unit, default, range and meaning, as the fields of the models state them.

The meaning of a key is the `description` of its field. If the default or the range is a rule that the type does not give,
`json_schema_extra` of the field has it in words, with the names "default" and "range". Texts may contain Markdown.
"""

from __future__ import annotations

import json
import math
import re
import types
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from fsm.case.schema.units import Unit


@dataclass(frozen=True)
class Place:
    """Place in a case, with its type and its value in the file.

    Attributes
    ----------
    kind : type annotation
    value : value in the file, None if there is none
    beside : mapping
        Fields of the surrounding section, with defaults.
    """

    kind: Any
    value: Any
    beside: Mapping[str, Any]

    def variants(self) -> list[Any]:
        """Allowed types, without annotations and unions."""
        return _leaves(self.kind)

    def discriminator(self) -> str:
        """Key that selects the variant of a section; empty for a section without variants."""
        field = next((m for m in metadata_of(self.kind) if isinstance(m, FieldInfo) and m.discriminator), None)
        return str(field.discriminator) if field else ""

    def all_models(self) -> list[type[BaseModel]]:
        """Models of all allowed sections."""
        return [leaf for leaf in self.variants() if isinstance(leaf, type) and issubclass(leaf, BaseModel)]

    def models(self) -> list[type[BaseModel]]:
        """Model of the variant that the value selects; all models if it selects none."""
        models, key = self.all_models(), self.discriminator()
        if key and isinstance(self.value, Mapping):
            named = [model for model in models if self.value.get(key) in tags(model, key)]
            return named or models
        return models

    def keys(self) -> list[str]:
        """Allowed keys of a section; empty for other types, and for sections with arbitrary keys."""
        return list(dict.fromkeys(key for model in self.models() for key in model.model_fields))

    def unit(self) -> str:
        """SI unit of a number; empty if it has none."""
        unit = next((m for m in metadata_of(self.kind) if isinstance(m, Unit)), None)
        return unit.text(self.beside) if unit else ""

    def is_list_of_sections(self) -> bool:
        """Whether TOML needs ``[[name]]`` here."""
        item = self.step(0)
        return item is not None and bool(item.all_models())

    def step(self, key: str | int) -> Place | None:
        """Place at a key of this section or list, or None if this key is not allowed."""
        value = _look_up(self.value, key)
        for model in self.models():
            if key in model.model_fields:
                return Place(_annotation(model.model_fields[str(key)]), value, _fields(model, self.value))
        for leaf in self.variants():
            kind = _item(leaf, key)
            if kind is not None:
                return Place(kind, value, {})
        return None


def locate(
    data: Mapping[str, Any], location: Sequence[str | int], whole: Any
) -> tuple[Place | None, list[str | int]]:
    """Convert the location of a pydantic error to a place in a case.

    Parameters
    ----------
    data : mapping
        Case as read from its file.
    location : sequence
        Keys and indices, with the tag of the variant after each section with variants.
    whole : model of the data, for example `fsm.case.models.case.Case`

    Returns
    -------
    Place or None
        None if the location is not allowed in a case.
    list
        Path as in the file: without tags, and without the index of a single value in place of a list.
    """
    place: Place | None = Place(whole, data, {})
    path: list[str | int] = []
    chosen = False
    for key in location:
        if place is not None and place.discriminator() and not chosen:
            chosen = True
            continue
        if not (isinstance(key, int) and place is not None and isinstance(place.value, str | float | int)):
            path.append(key)
        place = place.step(key) if place else None
        chosen = False
    return place, path


def tags(model: type[BaseModel], key: str) -> tuple[Any, ...]:
    """Values of `key` that select this variant."""
    annotation = model.model_fields[key].annotation
    return get_args(annotation) if get_origin(annotation) is Literal else ()


def _annotation(field: FieldInfo) -> Any:
    """Type of a field with its annotations."""
    kind = field.rebuild_annotation()
    return Annotated[kind, field] if field.discriminator else kind


def _leaves(kind: Any) -> list[Any]:
    if get_origin(kind) is Annotated:
        return _leaves(get_args(kind)[0])
    if get_origin(kind) in (Union, types.UnionType):
        return [leaf for part in get_args(kind) for leaf in _leaves(part)]
    return [kind]


def metadata_of(kind: Any) -> list[Any]:
    """Metadata of all annotations of a type, and of the parts of a union; bounds in a `Field` are listed too."""
    found = _annotations(kind)
    return [*found, *(bound for item in found if isinstance(item, FieldInfo) for bound in item.metadata)]


def _annotations(kind: Any) -> list[Any]:
    if get_origin(kind) is Annotated:
        inner, *metadata = get_args(kind)
        return [*metadata, *_annotations(inner)]
    if get_origin(kind) in (Union, types.UnionType):
        return [item for part in get_args(kind) for item in _annotations(part)]
    return []


def _item(leaf: Any, key: str | int) -> Any:
    """Type of an item of a list or a mapping; None if there is no such item."""
    arguments = get_args(leaf)
    if get_origin(leaf) is dict and isinstance(key, str):
        return arguments[1]
    if get_origin(leaf) is tuple and isinstance(key, int) and key >= 0:
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            return arguments[0]
        return arguments[key] if key < len(arguments) else None
    return None


def _look_up(value: Any, key: str | int) -> Any:
    if isinstance(value, Mapping) and isinstance(key, str):
        return value.get(key)
    if isinstance(value, list | tuple) and isinstance(key, int) and 0 <= key < len(value):
        return value[key]
    return None


def _fields(model: type[BaseModel], value: Any) -> dict[str, Any]:
    """Values of a section in the file, with defaults for absent keys."""
    defaults = {
        name: field.get_default() for name, field in model.model_fields.items() if not field.is_required()
    }
    if not isinstance(value, Mapping):
        return defaults
    completed = getattr(model, "completed", dict)
    return {**defaults, **completed(value)}


class KeyFacts(NamedTuple):
    """Facts of a key, as texts; an empty text states that there is nothing to say.

    Attributes
    ----------
    unit : SI unit of a number, or of the numbers of a list
    kind : unit, or the type of a value without unit
    default : default, or the rule for it; "needed" for a required key
    range : allowed values
    used : variants of the section, or laws, that have the key, as `law = "linear"`; empty if all have it
    meaning : meaning; if variants give the key different meanings, the meaning in each variant
    full_meaning : meaning, after the variants or laws that have the key
    """

    unit: str
    kind: str
    default: str
    range: str
    used: str
    meaning: str
    full_meaning: str


def facts_of(section: Place, key: str) -> KeyFacts:
    """Facts of a key of a section, whose variants may all have the key or not."""
    place = section.step(key)
    assert place is not None
    models = section.all_models()
    fields = {model: model.model_fields[key] for model in models if key in model.model_fields}
    tag = section.discriminator()
    laws = {name: keys for model in fields for name, keys in getattr(model, "laws", {}).items()}
    using = [name for name, keys in laws.items() if key in (*keys.needed, *keys.optional)]
    having = [name for model in fields for name in tags(model, tag)] if tag else using
    selector = tag if len(fields) < len(models) else "law" if 0 < len(using) < len(laws) else ""
    needing = [name for name, keys in laws.items() if key in keys.needed]
    optional = any(key in keys.optional for keys in laws.values())
    default = _joined({model: _extra(field, "default") for model, field in fields.items()}, "")
    if not default:
        default = "needed" if tag == key else _default(fields, tag if selector else "", needing, optional)
    limits = _listed(having) if tag == key else _listed(laws) if key == "law" else ""
    if not limits:
        ranges = {model: _extra(field, "range") or _range_in(section, model, key) for model, field in fields.items()}
        limits = _joined(ranges, tag)
    meanings = {model: field.description or "" for model, field in fields.items()}
    meaning = _joined(meanings, tag)
    full = f"{_listed(having)}: {meaning}" if selector and len(set(meanings.values())) == 1 else meaning
    used = f"{selector} = {_listed(having)}" if selector else ""
    return KeyFacts(_unit(place), _kind(place), default, limits, used, meaning, full)


def section_of(place: Place | None) -> Place | None:
    """Section at a place; for a list or a mapping, the section of its items."""
    for each in (place, place and place.step(0), place and place.step("name")):
        if each is not None and each.all_models():
            return each
    return None


def plain(text: str) -> str:
    """Text without Markdown: no backticks, and links without their targets."""
    return re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", text).replace("`", "")


def _extra(field: FieldInfo, name: str) -> str:
    extra = field.json_schema_extra
    return str(extra.get(name, "")) if isinstance(extra, dict) else ""


def _joined(texts: Mapping[type[BaseModel], str], tag: str) -> str:
    """Text of a key; different texts are listed with the variants that have them."""
    found: dict[str, list[str]] = {}
    for model, text in texts.items():
        if text:
            found.setdefault(text, []).append(_listed(tags(model, tag)) if tag else "")
    if len(found) == 1 or not tag:
        return "; ".join(found)
    return "; ".join(f"{', '.join(names)}: {text}" for text, names in found.items())


def _listed(values: Iterable[Any]) -> str:
    return ", ".join(json.dumps(value) for value in values)


def _default(fields: dict[type[BaseModel], FieldInfo], tag: str, needing: list[str], optional: bool) -> str:
    """Default of a key without a rule in words."""
    required = [model for model, field in fields.items() if field.is_required()]
    if len(required) == len(fields):
        return f"needed by {_listed(name for model in required for name in tags(model, tag))}" if tag else "needed"
    given = next(field for field in fields.values() if not field.is_required())
    value = _value(given.get_default(call_default_factory=True))
    if required:
        return f"needed by {_listed(name for model in required for name in tags(model, tag))}; else {value}"
    if needing:
        return f"{value}; needed by {_listed(needing)}" if optional else f"needed by {_listed(needing)}"
    return value


def _value(value: Any) -> str:
    """Value as in a case file."""
    if value is None:
        return "absent"
    if isinstance(value, BaseModel):
        return "all defaults"
    if isinstance(value, tuple | dict) and not value:
        return "none"
    if isinstance(value, tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, float):
        return _number(value)
    return json.dumps(value, ensure_ascii=False) if value != "" else "empty"


def _number(value: float) -> str:
    """Number in short; fractions and multiples of pi are written with pi."""
    turns = 12.0 * value / math.pi
    if value and abs(turns - round(turns)) < 1e-12 * abs(turns):
        whole, part = divmod(abs(value) / math.pi, 1.0)
        sign = "-" if value < 0 else ""
        if not part:
            return f"{sign}{'' if whole == 1 else f'{whole:g} '}pi"
        return f"{sign}pi/{math.pi / abs(value):g}"
    text = f"{value:.6g}"
    mantissa, _, power = text.partition("e")
    return f"{mantissa}e{int(power)}" if power else text


def _leaves_of(place: Place) -> list[Any]:
    return [leaf for leaf in place.variants() if leaf is not type(None)]


def _unit(place: Place) -> str:
    inner = place.step(0)
    return place.unit() or (inner.unit() or (inner.step(0) or inner).unit() if inner is not None else "")


def _kind(place: Place) -> str:
    """Unit, or the type of a value without unit."""
    if place.is_list_of_sections():
        return "list of sections"
    if section_of(place) is not None:
        return "section"
    words = []
    for leaf in _leaves_of(place):
        inner = get_args(leaf)[0] if get_origin(leaf) is tuple else leaf
        if _is_text(leaf):
            words.append("path" if leaf is Path else "text")
        elif get_origin(leaf) is tuple and any(map(_is_text, Place(inner, None, {}).variants())):
            words.append("list of text")
        else:
            words.append(_unit(place) or ("section" if leaf is dict or get_origin(leaf) is dict else "-"))
    return ", or ".join(dict.fromkeys(words))


def _is_text(leaf: Any) -> bool:
    if get_origin(leaf) is Literal:
        return all(isinstance(value, str) for value in get_args(leaf))
    return leaf is str or leaf is Path


def _range_in(section: Place, model: type[BaseModel], key: str) -> str:
    """Range of a key in one variant of a section."""
    place = Place(model, None, section.beside).step(key)
    return "" if place is None else _range(place)


def _range(place: Place) -> str:
    """Choices or bounds of a value, or of the items of a list."""
    choices = [value for leaf in _leaves_of(place) if get_origin(leaf) is Literal for value in get_args(leaf)]
    if choices:
        return _listed(choices)
    limits = _bounds(place)
    item = place.step(0)
    if limits or item is None or item.all_models():
        return limits
    inner = _range(item)
    if inner and any(get_origin(leaf) is Literal for leaf in _leaves_of(item)):
        return f"a list of {inner}"
    fewest = next((each.min_length for each in metadata_of(place.kind) if isinstance(each, MinLen)), 0)
    if not inner and fewest and not any(map(_is_text, _leaves_of(place))):
        return "one or more" if fewest == 1 else f"at least {fewest}"
    several = place.step(1) is not None and place.step(1000) is None  # a fixed number of items
    return f"{inner} each" if inner and several and not inner.endswith("each") else inner


def _bounds(place: Place) -> str:
    """Bounds of a number in words."""
    low = high = None
    excluded = []
    for item in metadata_of(place.kind):
        if isinstance(item, Gt | Ge):
            low = float(item.gt if isinstance(item, Gt) else item.ge)  # type: ignore[arg-type]
            excluded += [low] if isinstance(item, Gt) else []
        elif isinstance(item, Lt | Le):
            high = float(item.lt if isinstance(item, Lt) else item.le)  # type: ignore[arg-type]
            excluded += [high] if isinstance(item, Lt) else []
    if low is not None and high is not None:
        out = {0: "", 1: f", {_number(excluded[0])} excluded" if excluded else "", 2: ", both excluded"}[len(excluded)]
        return f"{_number(low)} to {_number(high)}{out}"
    if low is not None:
        return f"{'>' if excluded else '>='} {_number(low)}"
    return "" if high is None else f"{'<' if excluded else '<='} {_number(high)}"
