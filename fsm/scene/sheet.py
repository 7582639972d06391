"""Section [sheet] of a case: a folded sheet in space, of facets that creases join."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.units import Angle, Count, Length, StiffnessOfLine

__all__ = ["MOST_FACETS", "Box", "Sheet", "SheetSupport"]

MOST_FACETS = 20_000
"""Largest number of facets of a sheet."""

Box = tuple[tuple[Length, Length, Length], tuple[Length, Length, Length]]
Axis = Literal["x", "y", "z"]
Kind = Literal["miura", "zigzag", "waterbomb", "kresling", "yoshimura"]

_KEYS: dict[str, tuple[str, ...]] = {
    "miura": ("columns", "rows", "a", "b", "sector_angle", "fold_angle"),
    "zigzag": ("columns", "a", "b", "fold_angle"),
    "waterbomb": ("columns", "rows", "a"),
    "kresling": ("sides", "rows", "radius", "height", "twist"),
    "yoshimura": ("sides", "rows", "radius", "height"),
}
"""Required keys of each kind."""


class SheetSupport(Model):
    """Support of vertices or of a facet of a sheet.

    Attributes
    ----------
    at : str, or two opposite corners of a box in m
        Place: "edge left", "vertex 12", "vertices 3, 4, 5", "facet 7", or all vertices in a box at the start.
    fixed : axes along which the vertices cannot move
        A facet must have all three; it is then a fixed body.
    """

    at: Name | Box
    fixed: Annotated[tuple[Axis, ...], Field(min_length=1)] = ("x", "y", "z")


class Sheet(Model):
    """Folded sheet: a crease pattern by `kind`.

    Attributes
    ----------
    kind : str
        "miura", "zigzag", "waterbomb" (sheets), "kresling", "yoshimura" (tubes).
    columns, rows : numbers of panels or cells along x and y; storeys of a tube for `rows`
    a, b : sides of a panel, m
        Miura: a along y, b along x. Zigzag: a is the length of a panel along x, b its width. Waterbomb: a is the side of a
        cell.
    sector_angle : angle between the sides of a panel, rad
    fold_angle : angle of the panels with the mean plane at the start, rad
    sides : number of sides of a tube
    radius, height, twist : m, m, rad
        Circumradius of a tube, height of a storey, rotation of each ring relative to the ring below.
    facets : str
        "rigid"; "bend-lines": facets of four and more sides also bend along diagonals.
    mesh_size, mesh : m, -
        Size of the elements, and their numbers, of flexible facets.
    thickness : m
    bend_stiffness_per_length : N m/rad per m
        Stiffness of bend lines over their length; absent: fit of Liu and Paulino, 2017, to plates (a preset).
    support : supports
    """

    kind: Kind
    columns: Annotated[Count, Field(ge=1, le=1000)] | None = None
    rows: Annotated[Count, Field(ge=1, le=1000)] | None = None
    a: Annotated[Length, Field(gt=0)] | None = None
    b: Annotated[Length, Field(gt=0)] | None = None
    sector_angle: Annotated[Angle, Field(gt=0, lt=math.pi / 2)] | None = None
    fold_angle: Annotated[Angle, Field(ge=0, lt=math.pi / 2)] | None = None
    sides: Annotated[Count, Field(ge=3, le=1000)] | None = None
    radius: Annotated[Length, Field(gt=0)] | None = None
    height: Annotated[Length, Field(gt=0)] | None = None
    twist: Annotated[Angle, Field(gt=-math.pi, lt=math.pi)] | None = None
    facets: Literal["rigid", "bend-lines"] = "rigid"
    mesh_size: Annotated[Length, Field(gt=0)] | None = None
    mesh: tuple[Count, Count] | None = None
    thickness: Annotated[Length, Field(gt=0)]
    bend_stiffness_per_length: Annotated[StiffnessOfLine, Field(gt=0)] | None = None
    support: tuple[SheetSupport, ...] = ()

    @model_validator(mode="after")
    def _of_kind(self) -> Self:
        missing = [f"`{name}`" for name in _KEYS[self.kind] if getattr(self, name) is None]
        if missing:
            raise ValueError(f'kind = "{self.kind}" needs {", ".join(missing)}')
        for name in sorted({name for names in _KEYS.values() for name in names} - set(_KEYS[self.kind])):
            if getattr(self, name) is not None:
                raise ValueError(f'`{name}` is not used by kind = "{self.kind}"; remove it')
        return self

    @model_validator(mode="after")
    def _sized(self) -> Self:
        count = {"miura": 1, "waterbomb": 6, "kresling": 2, "yoshimura": 2}.get(self.kind, 1)
        count *= (self.columns or self.sides or 1) * (self.rows or 1)
        if count > MOST_FACETS:
            raise ValueError(f"the sheet has {count:,} facets; at most {MOST_FACETS:,} are allowed")
        return self

    @model_validator(mode="after")
    def _used(self) -> Self:
        for name in ("mesh_size", "mesh"):
            if getattr(self, name) is not None:
                raise ValueError(f'`{name}` is the mesh of flexible facets; facets = "{self.facets}" has none: remove it')
        if self.bend_stiffness_per_length is not None and self.facets != "bend-lines":
            raise ValueError('`bend_stiffness_per_length` is used by facets = "bend-lines" only; remove it')
        return self
