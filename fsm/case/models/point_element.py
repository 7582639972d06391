"""Section [[scene.point_elements]] of a case: elements of an extension whose energy depends on the positions of points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field, ValidationInfo, field_validator

from fsm.case.models.law_keys import LawSection
from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Length
from fsm.registry import POINT_KINDS, AddedLaw


class BodyPoint(Model):
    """Point of a body, of a frame, or of the ground."""

    body: str = Field(
        description="body, frame or ground that carries the point",
        json_schema_extra={"range": 'a body, a frame or "ground"'},
    )
    point: tuple[Length, Length, Length] = Field(
        default=(0.0, 0.0, 0.0), description="point, body axes, from the centre of mass"
    )


class PointElement(LawSection):
    """Element of a kind that an extension adds, between points."""

    chosen_by: ClassVar[str] = "kind"

    name: Name = Field(description="name of the element")
    kind: str = Field(description="name of the kind", json_schema_extra={"range": "a kind of an extension"})
    points: tuple[BodyPoint, ...] = Field(
        min_length=2, description="points, in the order of the kind", json_schema_extra={"range": "as many as the kind has"}
    )
    parameters: dict[str, Any] | None = Field(default=None, description="parameters of the kind")

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
