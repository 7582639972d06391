"""Section [[obstacle]] of a case: rigid obstacles for plates and panels, at rest or fixed to a body."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.units import Length, Number

__all__ = ["Obstacle"]

_SIZES = {"plane": (), "box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}
_Extent = Annotated[Length, Field(gt=0)]


class Obstacle(Model):
    """Rigid obstacle of a simple shape.

    Attributes
    ----------
    name : str
    shape : "plane" (the half space z < 0 in its own axes), "box", "cylinder" (along its own y axis) or "sphere"
    size : m
        Size of a box along its own x, y, z.
    radius : m
        Radius of a cylinder or a sphere.
    length : m
        Length of a cylinder.
    position, orientation : m, unit quaternion (scalar first)
        Position of the centre (plane: of any point on it) and orientation, in the axes of `body`.
    body : name of the body to which the obstacle is fixed; absent: the ground
    """

    name: Name
    shape: Literal["plane", "box", "cylinder", "sphere"]
    size: tuple[_Extent, _Extent, _Extent] | None = None
    radius: _Extent | None = None
    length: _Extent | None = None
    position: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)
    orientation: tuple[Number, Number, Number, Number] = (1.0, 0.0, 0.0, 0.0)
    body: str | None = None

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
