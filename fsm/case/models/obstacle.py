"""Section [[obstacle]] of a case: rigid obstacles for plates and panels, at rest or fixed to a body."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Length, Number

_SIZES = {"plane": (), "box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}
_Extent = Annotated[Length, Field(gt=0)]


class Obstacle(Model):
    """Rigid obstacle of a simple shape."""

    name: Name = Field(
        description="name in contact pairs and results",
        json_schema_extra={"range": "different from all bodies and surfaces"},
    )
    shape: Literal["plane", "box", "cylinder", "sphere"] = Field(description='"plane": half space z < 0 in its own axes')
    size: tuple[_Extent, _Extent, _Extent] | None = Field(
        default=None, description="size of a box along its own x, y, z; required for a box"
    )
    radius: _Extent | None = Field(default=None, description="radius of a cylinder or a sphere; required for both")
    length: _Extent | None = Field(default=None, description="length of a cylinder along its own y; required for a cylinder")
    position: tuple[Length, Length, Length] = Field(
        default=(0.0, 0.0, 0.0), description="position of its centre (plane: of any point on it), in axes of `body`"
    )
    orientation: tuple[Number, Number, Number, Number] = Field(
        default=(1.0, 0.0, 0.0, 0.0),
        description="orientation of its axes, in axes of `body`",
        json_schema_extra={"range": "unit quaternion"},
    )
    body: str | None = Field(
        default=None, description="body to which it is fixed; absent: the ground", json_schema_extra={"range": "a body"}
    )

    @property
    def extent(self) -> float:
        """Largest dimension, m; zero for a plane."""
        return max([*(self.size or ()), 2.0 * (self.radius or 0.0), self.length or 0.0])

    @model_validator(mode="after")
    def _sized(self) -> Self:
        needed = _SIZES[self.shape]
        for key in ("size", "radius", "length"):
            given = getattr(self, key) is not None
            if given and key not in needed:
                raise ValueError(f"a {self.shape} has no `{key}`; remove `{key}`")
            if not given and key in needed:
                raise ValueError(f"a {self.shape} requires `{key}`")
        return self
