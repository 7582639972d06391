"""Base class of all sections of a case: frozen, without unknown keys, with finite numbers only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, model_validator

__all__ = ["Model", "Name"]


Name = Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""Name of an object, without control characters, for messages, files and figures."""


class Model(BaseModel):
    """Frozen pydantic model that refuses unknown keys and non-finite numbers.

    Defaults are not validated, because they are in SI, whatever the unit system of the file.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> Mapping[str, Any]:
        """Keys of the file, completed by keys that follow from them; sections override this method."""
        return written

    @model_validator(mode="before")
    @classmethod
    def _complete_first(cls, written: Any) -> Any:
        return cls.completed(written) if isinstance(written, Mapping) else written
