"""Section [[scene.point_elements]] of a case: elements of an extension whose energy depends on the positions of points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, ValidationInfo, field_validator

from fsm.case.models.added_laws import check_kind, check_parameters, with_parameters
from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Length
from fsm.registry import POINT_KINDS


class BodyPoint(Model):
    """Point of a body, of a frame, or of the ground."""

    body: str = Field(
        description="body, frame or ground that carries the point",
        json_schema_extra={"range": 'a body, a frame or "ground"'},
    )
    point: tuple[Length, Length, Length] = Field(
        default=(0.0, 0.0, 0.0), description="point, body axes, from the centre of mass"
    )


class PointElement(Model):
    """Element of a kind that an extension adds, between points."""

    name: Name = Field(description="name of the element")
    kind: str = Field(description="name of the kind", json_schema_extra={"range": "a kind of an extension"})
    points: tuple[BodyPoint, ...] = Field(
        min_length=2, description="points, in the order of the kind", json_schema_extra={"range": "as many as the kind has"}
    )
    parameters: dict[str, Any] | None = Field(default=None, description="parameters of the kind")

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> dict[str, Any]:
        """Element with an empty section for the parameters of its kind, so that missing ones are found; see `Model`."""
        return with_parameters(written, written.get("kind"), POINT_KINDS)

    @field_validator("kind", mode="before")
    @classmethod
    def _known(cls, value: Any) -> Any:
        return check_kind(value, POINT_KINDS)

    @field_validator("points")
    @classmethod
    def _count(cls, value: tuple[BodyPoint, ...], info: ValidationInfo) -> tuple[BodyPoint, ...]:
        known = POINT_KINDS.get(info.data.get("kind", ""))
        if known is not None and len(value) != known.law.points:
            raise ValueError(f"{len(value)} points; an element of kind {info.data['kind']!r} has {known.law.points}")
        return value

    @field_validator("parameters", mode="before")
    @classmethod
    def _of_kind(cls, value: Any, info: ValidationInfo) -> Any:
        return check_parameters(value, info.data.get("kind"), POINT_KINDS, info, "kind")
