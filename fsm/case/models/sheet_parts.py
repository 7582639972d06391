"""Parts of section [sheet] of a case: supports, plies, probes, creases and bars."""

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from fsm.case.models.truss import AxialLaw
from fsm.case.schema.model import Key, Model, Name
from fsm.case.schema.units import Angle, Area, Density, Length, Number, StiffnessOfLine, Stress

Box = tuple[tuple[Length, Length, Length], tuple[Length, Length, Length]]
Axis = Literal["x", "y", "z"]


class SheetSupport(Model):
    """Support of vertices or of a facet of a sheet."""

    at: Name | Box = Key(
        'place: "edge left", "vertex 12", "vertices 3, 4, 5", "facet 7", or a box as two opposite corners '
        "`[[x, y, z], [x, y, z]]`, which selects the vertices in it at the start. Numbers count from 1; each side of a cut "
        "has its own vertices ([sheets](sheets.md))",
    )  # fmt: skip
    fixed: tuple[Axis, ...] = Key(
        "directions in which the vertices cannot move; a facet needs all three and is then fixed", default=("x", "y", "z"),
        min_length=1
    )  # fmt: skip
    clamped: bool = Key("flexible facets: no rotation out of the surface at this place", default=False)
    mirror: Axis | None = Key(
        "flexible facets: the edge lies in a plane of symmetry normal to this axis; instead of `fixed`. A box "
        'selects the outline between its nodes, and "vertices 1, 2" the lines of the outline between these vertices',
        default=None,
    )  # fmt: skip

    @model_validator(mode="after")
    def _either(self) -> Self:
        if self.mirror is not None and (self.clamped or "fixed" in self.model_fields_set):
            raise ValueError("`mirror` already defines all held directions; remove `fixed` and `clamped`")
        return self

    @model_serializer(mode="wrap")
    def _without_fixed(self, serialise: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Values without `fixed` where `mirror` replaces it, so that a written case can be read again."""
        values: dict[str, Any] = serialise(self)
        if self.mirror is not None:
            values.pop("fixed", None)
        return values


class SheetPly(Model):
    """Ply of a laminate, from the lowest to the highest along the normal of flexible facets.

    Examples
    --------
    >>> stiffness = {"young": "140 GPa", "young_across": "10 GPa", "shear": "5 GPa", "poisson": 0.3}
    >>> ply = SheetPly(thickness="0.1 mm", angle="45 deg", **stiffness)
    >>> round(ply.angle, 4)
    0.7854
    """

    thickness: Length = Key("thickness of the ply", gt=0)
    angle: Angle = Key("direction of the fibres, from x towards y of a plate, or of the flat pattern", default=0.0)
    young: Stress = Key("Young's modulus along the fibres", gt=0)
    young_across: Stress = Key("Young's modulus across the fibres", gt=0)
    shear: Stress = Key("shear modulus in the plane", gt=0)
    poisson: Number = Key(
        "contraction across the fibres under a stress along them", within="below sqrt(young/young_across) in magnitude"
    )
    density: Annotated[Density, Field(gt=0)] | None = Key("density of the ply", default=None, shown="`material.density`")

    @model_validator(mode="after")
    def _stable(self) -> Self:
        most = math.sqrt(self.young / self.young_across)
        if abs(self.poisson) >= most:
            text = f"poisson = {self.poisson:g} must be below sqrt(young/young_across) = {most:.4g} in magnitude"
            raise ValueError(f"{text}; otherwise the ply has no positive stiffness")
        return self


class SheetProbe(Model):
    """Point of flexible facets whose displacement is in the summary: a vertex of the pattern, for example "vertex 3"."""

    name: Name = Key("name in the summary")
    at: Name | Box = Key('one vertex, for example "vertex 3", or a box around one node')


class SheetCrease(Model):
    """Stiffness or rest angle of some creases of a sheet, in place of the common one."""

    of: Name = Key(
        '"mountain", "valley", "unassigned", "flat", "bend line", or names: "crease 3", "creases 3, 4", "bend '
        'line 2". Flat edges that are named here become creases. Bend lines only with facets = "bend-lines" or "bars": '
        "flexible facets bend everywhere",
    )  # fmt: skip
    stiffness_per_length: Annotated[StiffnessOfLine, Field(ge=0)] | None = Key(
        "stiffness over the length; linear creases only", default=None, shown="that of `[crease]`"
    )
    rest_angle: Annotated[Angle, Field(ge=0, le=math.pi)] | None = Key(
        "fold angle at which the moment is zero, on the side of the assignment", default=None, shown="that of `[crease]`"
    )

    @model_validator(mode="after")
    def _some(self) -> Self:
        if self.stiffness_per_length is None and self.rest_angle is None:
            raise ValueError("give `stiffness_per_length` or `rest_angle`; both are missing")
        return self


class BarsOfSheet(Model):
    """Bars of a sheet with facets = "bars"; see `fsm.case.models.truss.SceneTruss` for the laws."""

    young: Annotated[Stress, Field(gt=0)] | None = Key("Young's modulus of the bars", default=None, shown="`material.young`")
    area: Annotated[Area, Field(gt=0)] | None = Key(
        "cross-section of every bar. Absent: bars and plate have the same energy in a uniform expansion", default=None,
        shown="a preset"
    )  # fmt: skip
    law: AxialLaw = Key("axial law, as in [`[[scene.trusses]]`](#scenetrusses)", default="linear")
    exponents: tuple[Number, Number] = Key('exponents a and b of "ogden"', default=(5.0, 1.0), within="different")
    linear_to: Angle = Key(
        "fold angle beyond which the moments of creases and bend lines rise like a tangent function, and "
        "faster in the last twentieth of the range, to infinity at 180 degrees", default=math.pi, gt=0, le=math.pi,
    )  # fmt: skip

    @model_validator(mode="after")
    def _of_law(self) -> Self:
        if self.exponents[0] == self.exponents[1]:
            raise ValueError(f"both `exponents` are {self.exponents[0]:g}; they must differ")
        return self
