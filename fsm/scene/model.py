"""The base of every description: frozen, strict about unknown keys, finite numbers only."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

__all__ = ["Model"]


class Model(BaseModel):
    """Frozen pydantic model; unknown keys and non-finite numbers are refused.

    Defaults are not validated: they are SI already, whatever the unit system of the file.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
