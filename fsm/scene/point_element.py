"""Section [[scene.point_elements]] of a case: elements of an extension whose energy depends on the positions of points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator

from fsm.registry import POINT_KINDS
from fsm.scene.added_laws import check_kind, check_parameters, with_parameters
from fsm.scene.model import Model, Name
from fsm.scene.units import Length

__all__ = ["BodyPoint", "PointElement"]


class BodyPoint(Model):
    """Point of a body, of a frame, or of the ground.

    Attributes
    ----------
    body : name of the body or frame, or "ground"
    point : m, in body axes from the centre of mass
    """

    body: str
    point: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)


class PointElement(Model):
    """Element of a kind that an extension adds, between points.

    Attributes
    ----------
    name : str
    kind : name of the kind
    points : points in the order of the kind
    parameters : parameters of the kind
    """

    name: Name
    kind: str
    points: Annotated[tuple[BodyPoint, ...], Field(min_length=2)]
    parameters: dict[str, Any] | None = None

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
