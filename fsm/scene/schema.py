"""What may stand at a path of a case file: keys, units, variants.

Read off the models, so that it cannot disagree with them.
"""

from __future__ import annotations

import types
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from fsm.scene.case import Case
from fsm.scene.model import Model
from fsm.scene.units import Unit

__all__ = ["Place", "locate", "tags", "top"]


@dataclass(frozen=True)
class Place:
    """A place in a case: the type that belongs there and what the file says there.

    Attributes
    ----------
    kind : type annotation
    value : what the file says, None if nothing
    beside : mapping
        The fields of the section the value stands in, defaults included.
    """

    kind: Any
    value: Any
    beside: Mapping[str, Any]

    def variants(self) -> list[Any]:
        """The types that may stand here, annotations and unions taken apart."""
        return _leaves(self.kind)

    def discriminator(self) -> str:
        """Key that says which variant a section is; empty for a section of one kind."""
        field = next((m for m in _metadata(self.kind) if isinstance(m, FieldInfo) and m.discriminator), None)
        return str(field.discriminator) if field else ""

    def all_models(self) -> list[type[BaseModel]]:
        """The sections that may stand here."""
        return [leaf for leaf in self.variants() if isinstance(leaf, type) and issubclass(leaf, BaseModel)]

    def models(self) -> list[type[BaseModel]]:
        """Of the sections that may stand here, the one that the value names; all if it names none."""
        models, key = self.all_models(), self.discriminator()
        if key and isinstance(self.value, Mapping):
            named = [model for model in models if self.value.get(key) in tags(model, key)]
            return named or models
        return models

    def keys(self) -> list[str]:
        """Keys that may stand in the section here; none for what is no section, or takes any key."""
        return list(dict.fromkeys(key for model in self.models() for key in model.model_fields))

    def unit(self) -> str:
        """SI unit of a number here; empty for none."""
        unit = next((m for m in _metadata(self.kind) if isinstance(m, Unit)), None)
        return unit.text(self.beside) if unit else ""

    def is_list_of_sections(self) -> bool:
        """True where TOML wants ``[[name]]``."""
        item = self.step(0)
        return item is not None and bool(item.all_models())

    def step(self, key: str | int) -> Place | None:
        """The place one key further down, or None if nothing may stand there."""
        value = _look_up(self.value, key)
        for model in self.models():
            if key in model.model_fields:
                return Place(_annotation(model.model_fields[str(key)]), value, _fields(model, self.value))
        for leaf in self.variants():
            kind = _item(leaf, key)
            if kind is not None:
                return Place(kind, value, {})
        return None


def top(data: Mapping[str, Any]) -> Place:
    """The place of a whole case."""
    return Place(Case, data, {})


def locate(data: Mapping[str, Any], location: Sequence[str | int]) -> tuple[Place | None, list[str | int]]:
    """Follow a location of a pydantic error.

    Parameters
    ----------
    data : mapping
        The case as read from its file.
    location : sequence
        Keys and indices, with the tag of a variant after each section that has variants.

    Returns
    -------
    Place or None
        None if nothing may stand there.
    list
        The path as the user wrote it, without tags, and without the number of a single value where a list may stand.
    """
    place: Place | None = top(data)
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
    """Values of `key` that choose this variant."""
    annotation = model.model_fields[key].annotation
    return get_args(annotation) if get_origin(annotation) is Literal else ()


def _annotation(field: FieldInfo) -> Any:
    """Type of a field with all that is said about it."""
    kind = field.rebuild_annotation()
    return Annotated[kind, field] if field.discriminator else kind


def _leaves(kind: Any) -> list[Any]:
    if get_origin(kind) is Annotated:
        return _leaves(get_args(kind)[0])
    if get_origin(kind) in (Union, types.UnionType):
        return [leaf for part in get_args(kind) for leaf in _leaves(part)]
    return [kind]


def _metadata(kind: Any) -> list[Any]:
    """All that annotations say about a type, also about the parts of a union."""
    if get_origin(kind) is Annotated:
        inner, *said = get_args(kind)
        return [*said, *_metadata(inner)]
    if get_origin(kind) in (Union, types.UnionType):
        return [said for part in get_args(kind) for said in _metadata(part)]
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
    """What the file says in a section, with the defaults of what it leaves out."""
    defaults = {
        name: field.get_default() for name, field in model.model_fields.items() if not field.is_required()
    }
    if not isinstance(value, Mapping):
        return defaults
    return {**defaults, **(model.completed(value) if issubclass(model, Model) else value)}
