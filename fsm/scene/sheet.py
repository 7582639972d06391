"""Section [sheet] of a case: a folded sheet in space, of facets that creases join."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.units import Angle, Count, Length, Number, StiffnessOfLine

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
_OF_FILE = ("vertices", "edges", "assignment", "angles", "faces")
"""Keys of a pattern that is written in the case."""


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
    """Folded sheet: a crease pattern by `kind`, from a file, or written in the case.

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
    pattern : path of a FOLD or SVG file, relative to the case file
    scale : m
        Length of one unit of the file. Absent: `frame_unit` of a FOLD file.
    vertices, edges, assignment, angles, faces : pattern of the file, as in the FOLD format
        Positions in m, numbers of vertices from 0, letters, fold angles in rad, numbers of vertices from 0.
    fold : -
        Part of each fold angle at the start of a flat pattern, with rigid facets; creases are at rest there.
    fold_to : -
        Part of each fold angle to which the rest angles of the creases move until `solve.end_time`.
    facets : str
        "rigid"; "bend-lines": facets of four and more sides also bend along diagonals.
    mesh_size, mesh : m, -
        Size of the elements, and their numbers, of flexible facets.
    thickness : m
    bend_stiffness_per_length : N m/rad per m
        Stiffness of bend lines over their length; absent: fit of Liu and Paulino, 2017, to plates (a preset).
    support : supports
    """

    kind: Kind | None = None
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
    pattern: Path | None = None
    scale: Annotated[Length, Field(gt=0)] | None = None
    vertices: tuple[tuple[Length, Length, Length], ...] | None = None
    edges: tuple[tuple[Count, Count], ...] | None = None
    assignment: tuple[Literal["B", "M", "V", "F", "U", "C", "J"], ...] | None = None
    angles: tuple[Angle, ...] | None = None
    faces: tuple[tuple[Count, ...], ...] | None = None
    fold: Annotated[Number, Field(ge=0, lt=1)] = 0.0
    fold_to: Annotated[Number, Field(ge=0, le=1)] | None = None
    facets: Literal["rigid", "bend-lines"] = "rigid"
    mesh_size: Annotated[Length, Field(gt=0)] | None = None
    mesh: tuple[Count, Count] | None = None
    thickness: Annotated[Length, Field(gt=0)]
    bend_stiffness_per_length: Annotated[StiffnessOfLine, Field(gt=0)] | None = None
    support: tuple[SheetSupport, ...] = ()

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        given = [name for name in ("kind", "pattern", "vertices") if getattr(self, name) is not None]
        if len(given) != 1:
            both = f"{' and '.join(given)} are given" if given else "none is given"
            raise ValueError(f"give either `kind`, or `pattern` (a FOLD or SVG file), or `vertices` with `edges`; {both}")
        needed = _KEYS[self.kind] if self.kind is not None else ("edges", "assignment", "angles", "faces")
        if self.pattern is None:
            missing = [f"`{name}`" for name in needed if getattr(self, name) is None]
            if missing:
                raise ValueError(f"{self._source} needs {', '.join(missing)}")
        own = {name for names in _KEYS.values() for name in names} | set(_OF_FILE)
        allowed = {*needed, "vertices"} if self.pattern is None else set()
        for name in sorted(own - allowed):
            if getattr(self, name) is not None:
                raise ValueError(f"`{name}` is not used by {self._source}; remove `{name}`")
        if self.kind is not None and self.scale is not None:
            raise ValueError(f"`scale` is not used by {self._source}; remove `scale`")
        return self

    @property
    def _source(self) -> str:
        return f'kind = "{self.kind}"' if self.kind is not None else "a pattern file" if self.pattern else "`vertices`"

    @model_validator(mode="after")
    def _sized(self) -> Self:
        count = {"miura": 1, "waterbomb": 6, "kresling": 2, "yoshimura": 2}.get(self.kind or "", 0)
        count *= (self.columns or self.sides or 1) * (self.rows or 1)
        if count > MOST_FACETS:
            raise ValueError(f"the sheet has {count:,} facets; at most {MOST_FACETS:,} are allowed")
        return self

    @model_validator(mode="after")
    def _used(self) -> Self:
        for name in ("mesh_size", "mesh"):
            if getattr(self, name) is not None:
                raise ValueError(f'`{name}` is for flexible facets only, not for facets = "{self.facets}"; remove `{name}`')
        if self.bend_stiffness_per_length is not None and self.facets != "bend-lines":
            raise ValueError('`bend_stiffness_per_length` is used by facets = "bend-lines" only; remove this key')
        return self
