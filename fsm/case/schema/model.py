"""Base class of all sections of a case: frozen, without unknown keys, with finite numbers only."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from fsm.case.schema.faults import faults_of
from fsm.case.schema.schema import Place, facts_of, plain
from fsm.errors import CaseError

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)


def Key(meaning: str, *, default: Any = ..., shown: str = "", within: str = "", **bounds: Any) -> Any:
    """Key of a section: pydantic's `Field` with its meaning, in one phrase that may have Markdown.

    `shown` and `within` state its default and its range in words, where the type does not. `bounds` are those of `Field`.
    """
    if shown or within:
        bounds["json_schema_extra"] = {name: text for name, text in (("default", shown), ("range", within)) if text}
    return Field(default, description=meaning, **bounds)


Name = Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""Name of an object, without control characters, for messages, files and figures."""


_MOST_SHOWN = 4
"""Largest number of items of a list that the text of a model shows."""


class _Items(int):
    def __repr__(self) -> str:
        return f"<{int(self)} items>"


class _Number(float):
    def __repr__(self) -> str:
        return format(self, ".12g") if self % 1 else super().__repr__()


def _rounded(value: Any) -> Any:
    """Numbers rounded so that errors such as 0.30000000000000004 are not shown."""
    if isinstance(value, tuple):
        return tuple(map(_rounded, value))
    return _Number(value) if isinstance(value, float) else value


def _is_long(value: Any) -> bool:
    """Whether a value is a list with many items or with sections."""
    if not isinstance(value, tuple | dict):
        return False
    return len(value) > _MOST_SHOWN or any(isinstance(item, BaseModel) for item in value)


class _Readable(ModelMetaclass):
    """Metaclass of the sections; it reports faults of a section made in Python in the same way as faults of a case file, and
    adds the keys to the docstring of a section.
    """

    @property
    def __doc__(cls) -> str:  # type: ignore[override]
        """Docstring of a section, with its keys, their units and meanings."""
        text = inspect.cleandoc(cls.__dict__.get("__doc__") or "")
        section = Place(cls, None, {})
        facts = {key: facts_of(section, key) for key in cls.__dict__.get("__pydantic_fields__", ())}
        rows = [f"{key} : {each.kind}\n    {plain(each.meaning)}" for key, each in facts.items() if each.meaning]
        return "\n".join([text, "", "Attributes", "----------", *rows]) if rows else text

    def __call__(cls, *args: Any, **keys: Any) -> Any:
        try:
            return super().__call__(*args, **keys)
        except ValidationError as error:
            raise CaseError(faults_of(error, keys, (), "SI", cls), cls.__name__) from None


class Model(BaseModel, metaclass=_Readable):
    """Frozen pydantic model that refuses unknown keys and non-finite numbers.

    Defaults are not validated, because they are in SI, whatever the unit system of the file.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> Mapping[str, Any]:
        """Keys of the file, completed by keys that follow from them; sections override this method."""
        return written

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Keys whose value differs from the default; for a long list only the number of items is shown."""
        for name, spec in type(self).model_fields.items():
            value = getattr(self, name)
            if spec.is_required() or value != spec.get_default(call_default_factory=True):
                yield name, _Items(len(value)) if _is_long(value) else _rounded(value)

    @model_validator(mode="before")
    @classmethod
    def _complete_first(cls, written: Any) -> Any:
        return cls.completed(written) if isinstance(written, Mapping) else written
