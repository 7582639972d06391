"""The base of every description: frozen, strict about unknown keys, finite numbers only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, model_validator

__all__ = ["Model", "Name"]

__all__ = ["Model"]


Name = Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""Name of a thing: stands in messages of one line, in files and in figures."""


class Model(BaseModel):
    """Frozen pydantic model; unknown keys and non-finite numbers are refused.

    Defaults are not validated: they are SI already, whatever the unit system of the file.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> Mapping[str, Any]:
        """The keys that are written and those that follow from them; a section may have its own way."""
        return written

    @model_validator(mode="before")
    @classmethod
    def _complete_first(cls, written: Any) -> Any:
        return cls.completed(written) if isinstance(written, Mapping) else written
