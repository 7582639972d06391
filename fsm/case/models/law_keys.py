"""Sections with a law, or a kind, by its name: required and unused keys of each law, and laws of extensions.

Section [[scene.point_elements]] of a case: elements of an extension whose energy depends on the positions of points.
"""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, ClassVar, Final, NamedTuple, NoReturn

from pydantic import ValidationError, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError, PydanticKnownError

from fsm.case.schema.model import Key, Model, Name
from fsm.case.schema.units import Length, did_you_mean, with_unit
from fsm.registry import POINT_KINDS, AddedLaw


class LawKeys(NamedTuple):
    """Required and optional keys of a law."""

    needed: tuple[str, ...]
    optional: tuple[str, ...] = ()


Laws = Mapping[str, LawKeys]

MISSING: Final = object()
"""Placeholder for a missing value that the law requires; the validation of the key then reports the fault at the path of the
key."""


class LawSection(Model):
    """Section whose key `chosen_by` names a law of the package or of an extension, which may have `parameters`."""

    chosen_by: ClassVar[str] = "law"
    laws: ClassVar[Laws] = {}
    """Keys of the laws of the package."""

    @classmethod
    def added(cls, name: object) -> Mapping[str, AddedLaw]:
        """Laws with parameters of their own that the section may name."""
        raise NotImplementedError

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> dict[str, Any]:
        """Section with `MISSING` for required keys that are missing, and with an empty section for missing parameters, so
        that the validation reports those; see `Model`.
        """
        law = written.get(cls.chosen_by, _default(cls))
        if not isinstance(law, str):
            return dict(written)
        needed = cls.laws[law].needed if law in cls.laws else ()
        empty: dict[str, Any] = {} if _added(cls, law) is None else {"parameters": {}}
        return {**dict.fromkeys(needed, MISSING), **empty, **written}

    @field_validator("law", "kind", "geometry", mode="before", check_fields=False)
    @classmethod
    def _known(cls, value: Any, info: ValidationInfo) -> Any:
        """Name of a law; an unknown name raises an error that lists all names."""
        if info.field_name != cls.chosen_by or (value is None and _default(cls) is None):
            return value
        names = [*cls.laws, *cls.added(value)]
        if not names:
            refuse(f"{with_unit(value, None)} needs an extension that adds it; name its file in `extensions`")
        if value not in names:
            listed = [f"'{name}'" for name in names]
            expected = " or ".join([", ".join(listed[:-1]), listed[-1]] if len(listed) > 1 else listed)
            raise PydanticKnownError("literal_error", {"expected": expected})
        return value

    @field_validator("parameters", mode="before", check_fields=False)
    @classmethod
    def _of_law(cls, value: Any, info: ValidationInfo) -> dict[str, Any] | None:
        """Parameters of a law of an extension, in SI; other laws have no parameters."""
        key, law = cls.chosen_by, info.data.get(cls.chosen_by)
        model = _added(cls, law)
        if model is None:
            if not value or key not in info.data:  # the value of the key is wrong, which has its own fault
                return None
            other = f"{key} = {with_unit(law, None)}"
            refuse(f"not used with {other}; only those of extensions have parameters; remove this key")
        try:
            return dict(model.model_validate(value or {}, context=info.context).model_dump(exclude_none=True))
        except ValidationError as error:
            refuse("; ".join(_text(detail, list(model.model_fields)) for detail in error.errors(include_url=False)))

    def used(self, data: dict[str, Any]) -> dict[str, Any]:
        """Keys that the law of the package uses, of all keys; with a law of an extension those that the case gives, as
        defaults of keys that it does not use may be invalid.
        """
        law = getattr(self, self.chosen_by)
        if law not in self.laws:
            return {key: value for key, value in data.items() if key in self.model_fields_set}
        of_laws = {key for keys in self.laws.values() for key in _keys(keys)}
        return {key: value for key, value in data.items() if key not in of_laws or key in _keys(self.laws[law])}


@cache
def _default(section: type[LawSection]) -> object:
    """Law of a section that names none."""
    return section.model_fields[section.chosen_by].default


def _added(section: type[LawSection], law: object) -> Any:
    """Model of the parameters of a law; None if it has none."""
    known = section.added(law).get(law) if isinstance(law, str) else None
    return None if known is None else known.parameters


def check_key(laws: Laws) -> Callable[[Any, ValidationInfo], Any]:
    """Validator that runs before the validation of a key; it refuses missing required keys and unused keys."""
    of_laws = {key for keys in laws.values() for key in _keys(keys)}

    def check(value: Any, info: ValidationInfo) -> Any:
        key, law = info.field_name, info.data.get("law", "")
        if value is MISSING:
            raise PydanticKnownError("missing")
        if key in of_laws and law in laws and value is not None and key not in _keys(laws[law]):
            others = [with_unit(name, None) for name, keys in laws.items() if key in _keys(keys)]
            refuse(f"not used with law = {with_unit(law, None)}, only with {_listed(others)}; remove this key")
        return value

    return check


def refuse(text: str) -> NoReturn:
    """End the validation of a key with a message."""
    raise PydanticCustomError("quantity", "{text}", {"text": text})


def _keys(keys: LawKeys) -> tuple[str, ...]:
    return keys.needed + keys.optional


def _listed(names: list[str]) -> str:
    return " or ".join(names) if len(names) < 3 else f"{', '.join(names[:-1])} or {names[-1]}"


def _text(detail: Any, keys: list[str]) -> str:
    place = ".".join(str(key) for key in detail["loc"])
    if detail["type"] == "extra_forbidden":
        return f"{place}: unknown key{did_you_mean(place, keys) or '; allowed here: ' + ', '.join(keys)}"
    if detail["type"] == "missing":
        return f"{place}: missing; this key is required"
    message = str(detail["ctx"]["error"]) if detail["type"] == "value_error" else detail["msg"]
    return f"{place}: {message[:1].lower()}{message[1:]}" if place else message


class BodyPoint(Model):
    """Point of a body, of a frame, or of the ground."""

    body: str = Key("body, frame or ground that carries the point", within='a body, a frame or "ground"')
    point: tuple[Length, Length, Length] = Key("point, body axes, from the centre of mass", default=(0.0, 0.0, 0.0))


class PointElement(LawSection):
    """Element of a kind that an extension adds, between points."""

    chosen_by: ClassVar[str] = "kind"

    name: Name = Key("name of the element")
    kind: str = Key("name of the kind", within="a kind of an extension")
    points: tuple[BodyPoint, ...] = Key("points, in the order of the kind", min_length=2, within="as many as the kind has")
    parameters: dict[str, Any] | None = Key("parameters of the kind", default=None)

    @classmethod
    def added(cls, name: object) -> Mapping[str, AddedLaw]:
        """See `LawSection`."""
        return POINT_KINDS

    @field_validator("points")
    @classmethod
    def _count(cls, value: tuple[BodyPoint, ...], info: ValidationInfo) -> tuple[BodyPoint, ...]:
        known = POINT_KINDS.get(info.data.get("kind", ""))
        if known is not None and len(value) != known.law.points:
            raise ValueError(f"{len(value)} points; an element of kind {info.data['kind']!r} has {known.law.points}")
        return value
