"""Allowed content at each path of a case file: keys, units and variants, taken from the models."""

from __future__ import annotations

import types
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

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
