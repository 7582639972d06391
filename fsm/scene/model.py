"""The base of every description: frozen, strict about unknown keys, finite numbers only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator

__all__ = ["Model"]


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
