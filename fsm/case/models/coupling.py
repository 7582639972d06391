"""Section [[scene.couplings]] of a case: elements on the twists of several force elements."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, ValidationInfo, field_validator

from fsm.case.models.added_laws import check_law, check_parameters, with_parameters
from fsm.case.models.gear import Gear
from fsm.case.schema.model import Model, Name
from fsm.registry import COUPLINGS, AddedLaw

OWN_COUPLINGS = {"gear": AddedLaw(2, Gear, "gear")}
"""Kinds of the package, with their number of joints as law; `fsm.model.compile.compile` has their kernels."""


def _kinds() -> dict[str, AddedLaw]:
    return OWN_COUPLINGS | COUPLINGS


class SceneCoupling(Model):
    """Element on the twists of force elements, measured from the start."""

    name: Name = Field(description="name of the element")
    kind: str = Field(description="name of the kind", json_schema_extra={"range": '"gear", or a kind of an extension'})
    joints: tuple[str, ...] = Field(
        min_length=1, description="force elements whose twists are coupled, in the order of the kind",
        json_schema_extra={"range": "as many as the kind has"},
    )  # fmt: skip
    parameters: dict[str, Any] | None = Field(default=None, description="parameters of the kind")

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> dict[str, Any]:
        """Element with an empty section for the parameters of its kind, so that missing ones are found; see `Model`."""
        return with_parameters(written, written.get("kind"), _kinds())

    @field_validator("kind", mode="before")
    @classmethod
    def _known(cls, value: Any) -> Any:
        return check_law(value, OWN_COUPLINGS, COUPLINGS)

    @field_validator("joints")
    @classmethod
    def _count(cls, value: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        known = _kinds().get(info.data.get("kind", ""))
        wanted = len(value) if known is None else known.law if isinstance(known.law, int) else known.law.joints
        if len(value) != wanted:
            raise ValueError(f"{len(value)} joints; a coupling of kind {info.data['kind']!r} has {wanted}")
        return value

    @field_validator("parameters", mode="before")
    @classmethod
    def _of_kind(cls, value: Any, info: ValidationInfo) -> Any:
        return check_parameters(value, info.data.get("kind"), _kinds(), info, "kind")
