"""Section [[obstacle]] of a case: rigid obstacles for plates and panels, at rest or fixed to a body."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.schema.model import Key, Model, Name
from fsm.case.schema.units import Length, Number

_SIZES = {"plane": (), "box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}
_Extent = Annotated[Length, Field(gt=0)]


class Obstacle(Model):
    """Rigid obstacle of a simple shape."""

    name: Name = Key("name in contact pairs and results", within="different from all bodies and surfaces")
    shape: Literal["plane", "box", "cylinder", "sphere"] = Key('"plane": half space z < 0 in its own axes')
    size: tuple[_Extent, _Extent, _Extent] | None = Key(
        "size of a box along its own x, y, z; required for a box", default=None
    )
    radius: _Extent | None = Key("radius of a cylinder or a sphere; required for both", default=None)
    length: _Extent | None = Key("length of a cylinder along its own y; required for a cylinder", default=None)
    position: tuple[Length, Length, Length] = Key(
        "position of its centre (plane: of any point on it), in axes of `body`", default=(0.0, 0.0, 0.0)
    )
    orientation: tuple[Number, Number, Number, Number] = Key(
        "orientation of its axes, in axes of `body`", default=(1.0, 0.0, 0.0, 0.0), within="unit quaternion"
    )
    body: str | None = Key("body to which it is fixed; absent: the ground", default=None, within="a body")

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
