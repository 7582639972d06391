"""Section [sheet] of a case: a folded sheet in space, of facets that creases join."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.truss import AxialLaw
from fsm.scene.units import Angle, Area, Count, Density, Length, Number, StiffnessOfLine, Stress

__all__ = [
    "MOST_FACETS", "SHELLS", "BarsOfSheet", "Box", "Sheet", "SheetCrease", "SheetPly", "SheetProbe", "SheetSupport",
]  # fmt: skip

MOST_FACETS = 20_000
"""Largest number of facets of a sheet."""

Box = tuple[tuple[Length, Length, Length], tuple[Length, Length, Length]]
Axis = Literal["x", "y", "z"]
Cells = Annotated[Count, Field(ge=1, le=1000)]
Grading = Annotated[Number, Field(ge=0, le=1)]
Kind = Literal[
    "miura", "zigzag", "waterbomb", "kresling", "yoshimura", "cone", "flasher", "tube",
    "miura-tube", "plate", "tape-spring", "stem", "lenticular",
]  # fmt: skip
SHELLS = ("plate", "tape-spring", "stem", "lenticular")
"""Kinds without a crease pattern: plates and booms."""
BOOMS: dict[str, tuple[float, float]] = {
    "tape-spring": (0.0, math.pi), "stem": (math.pi, 4.0 * math.pi), "lenticular": (0.0, math.pi),
}  # fmt: skip
"""Range of `subtended_angle` of each kind of boom, rad: above the first, at most the second."""

_KEYS: dict[str, tuple[str, ...]] = {
    "miura": ("columns", "rows", "a", "b", "sector_angle", "fold_angle"),
    "zigzag": ("columns", "a", "b", "fold_angle"),
    "waterbomb": ("columns", "rows", "a"),
    "kresling": ("sides", "rows", "radius", "height", "twist"),
    "yoshimura": ("sides", "rows", "radius", "height"),
    "cone": ("sides", "inner_radius", "outer_radius"),
    "flasher": ("sides", "outer_radius", "height"),
    "tube": ("rows", "radius", "height"),
    "miura-tube": ("columns", "a", "b", "sector_angle", "fold_angle"),
    "plate": ("length", "width"),
    **dict.fromkeys(BOOMS, ("length", "radius", "subtended_angle")),
}
"""Required keys of each kind."""
_ANNULUS = ("inner_radius", "outer_radius")
"""Required keys of a plate that is an annulus."""
_OPTIONAL = {"plate": ("radius",), "annulus": ("slit",), "kresling": ("taper",)}
"""Optional keys of some kinds."""
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

    clamped : bool
        Whether the slopes of flexible facets cannot turn out of their surface either.
    mirror : axis
        Edge, or another part of the outline, of flexible facets in a plane of symmetry normal to this axis, instead of
        `fixed`: it stays in the plane, and the sheet crosses the plane at a right angle.
    """

    at: Name | Box
    fixed: Annotated[tuple[Axis, ...], Field(min_length=1)] = ("x", "y", "z")
    clamped: bool = False
    mirror: Axis | None = None

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

    Attributes
    ----------
    thickness : m
    angle : rad
        Direction of the fibres, from x towards y of the plate or of the flat pattern.
    young, young_across : Pa
        Young's moduli along and across the fibres.
    shear : Pa
        Shear modulus in the plane.
    poisson : -
        Contraction across the fibres under a stress along them.
    density : kg/m^3
        Absent: `material.density`.

    Examples
    --------
    >>> stiffness = {"young": "140 GPa", "young_across": "10 GPa", "shear": "5 GPa", "poisson": 0.3}
    >>> ply = SheetPly(thickness="0.1 mm", angle="45 deg", **stiffness)
    >>> round(ply.angle, 4)
    0.7854
    """

    thickness: Annotated[Length, Field(gt=0)]
    angle: Angle = 0.0
    young: Annotated[Stress, Field(gt=0)]
    young_across: Annotated[Stress, Field(gt=0)]
    shear: Annotated[Stress, Field(gt=0)]
    poisson: Number
    density: Annotated[Density, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _stable(self) -> Self:
        most = math.sqrt(self.young / self.young_across)
        if abs(self.poisson) >= most:
            text = f"poisson = {self.poisson:g} must be below sqrt(young/young_across) = {most:.4g} in magnitude"
            raise ValueError(f"{text}; otherwise the ply has no positive stiffness")
        return self


class SheetProbe(Model):
    """Point of flexible facets whose displacement is in the summary: a vertex of the pattern, for example "vertex 3"."""

    name: Name
    at: Name | Box


class SheetCrease(Model):
    """Stiffness or rest angle of some creases of a sheet, in place of the common one.

    Attributes
    ----------
    of : str
        "mountain", "valley", "unassigned", "flat", "bend line", or names: "crease 3", "creases 3, 4", "bend line 2".
        Flat edges that are named here become creases.
    stiffness_per_length : N m/rad per m
    rest_angle : rad
        Fold angle at which the moment is zero, on the side of the assignment.
    """

    of: Name
    stiffness_per_length: Annotated[StiffnessOfLine, Field(ge=0)] | None = None
    rest_angle: Annotated[Angle, Field(ge=0, le=math.pi)] | None = None

    @model_validator(mode="after")
    def _some(self) -> Self:
        if self.stiffness_per_length is None and self.rest_angle is None:
            raise ValueError("give `stiffness_per_length` or `rest_angle`; both are missing")
        return self


class BarsOfSheet(Model):
    """Bars of a sheet with facets = "bars"; see `fsm.scene.truss.SceneTruss` for the laws.

    Attributes
    ----------
    young : Pa
        Absent: `material.young`.
    area : m^2
        Cross-section of every bar; absent: a preset (`fsm.scene.builders.sheet_bars.bar_areas`).
    law : "linear", "green" or "ogden"
    exponents : exponents of "ogden"
    linear_to : rad
        Fold angle beyond which the moments of creases and bend lines rise, to infinity at 180 degrees.
    """

    young: Annotated[Stress, Field(gt=0)] | None = None
    area: Annotated[Area, Field(gt=0)] | None = None
    law: AxialLaw = "linear"
    exponents: tuple[Number, Number] = (5.0, 1.0)
    linear_to: Annotated[Angle, Field(gt=0, le=math.pi)] = math.pi

    @model_validator(mode="after")
    def _of_law(self) -> Self:
        if self.exponents[0] == self.exponents[1]:
            raise ValueError(f"both `exponents` are {self.exponents[0]:g}; they must differ")
        return self


class Sheet(Model):
    """Folded sheet: a crease pattern by `kind`, from a file, or written in the case.

    Attributes
    ----------
    kind : str
        "miura", "zigzag", "waterbomb" (sheets), "kresling", "yoshimura" (tubes), "cone" (pleated), "flasher" (wraps
        around a hub), "tube" (Z-folded), "miura-tube" (two Miura sheets),
        "plate" (a single flexible facet), and the booms "tape-spring", "stem" and "lenticular".
    columns, rows : numbers of panels or cells along x and y; storeys of a tube for `rows`
    a, b : sides of a panel, m
        Miura: a along y, b along x. Zigzag: a is the length of a panel along x, b its width. Waterbomb: a is the side of a
        cell.
    sector_angle : angle between the sides of a panel, rad
    fold_angle : angle of the panels with the mean plane at the start, rad
    sides : number of sides of a tube
    radius, height, twist : m, m, rad
        Circumradius of a tube, height of a storey, rotation of each ring relative to the ring below. Plate: `radius` bends
        it to a cylinder without stress. Booms: radius of the section.
    taper : -
        "kresling": circumradius of each ring over that of the ring below; heights too. Absent: 1.
    subtended_angle : rad
        Angle that the arc of the section of a boom subtends; "lenticular": each of both arcs.
    length, width : sides of a rectangular plate along x and y, m; booms have `length` only
    inner_radius, outer_radius : radii of an annular plate, m; a disc has `outer_radius` only
    slit : whether the annulus is cut along the positive x axis
    pattern : path of a FOLD or SVG file, relative to the case file
    scale : m
        Length of one unit of the file. Absent: `frame_unit` of a FOLD file.
    frame : number of the frame of a FOLD file, from 0; absent: the first folded one, else the first
    part : number of the separate part of the file that is the sheet, from 1, the largest
    merge : m
        Distance below which points of the file are one vertex, and height below which a facet is planar. Absent: from the
        digits of the file.
    notes : what was ignored or changed in the file; the complete case contains these texts
    vertices, edges, assignment, angles, faces : pattern of the file, as in the FOLD format
        Positions in m, numbers of vertices from 0, letters, fold angles in rad, numbers of vertices from 0.
    fold : -
        Part of each fold angle at the start of a flat pattern, with rigid facets; creases are at rest there.
    align : str
        "mean plane": the plane of least squares through the vertices at the start is turned to z = 0.
    fold_to : -
        Part of each fold angle to which the rest angles of the creases move until `solve.end_time`.
    facets : str
        "rigid"; "bend-lines": facets of four and more sides also bend along diagonals; "bars": a bar along each edge and
        bend line, and a rotational spring about it; "flexible": thin plates.
    bars : bars of facets = "bars"
    mesh_size, mesh : m, -
        Largest size of the cells of flexible facets, or the numbers of cells of a plate along length and width, or along
        radius and circumference. A cell has two triangles.
    mesh_shift : -
        Random displacement of the inner nodes of a plate, relative to the size of a cell, to show the effect of the
        mesh.
    mesh_grading : -
        Grading of the cells of a plate towards both ends of its length and of its width, or of radius and circumference;
        of other sheets twice the same number, for the cells of each facet towards its edges. 0: uniform, 1: strongest.
    probe : points whose displacements are in the summary
    ply : plies of a laminate, from the lowest to the highest along the normal
    thickness : m
    film : str
        "tension-field": flexible facets carry no compression and wrinkle instead, without resolving each wrinkle; "plain".
    film_rounding : -
        Half-width, as a strain, of the rounded kinks of a tension field. Strains of this size are not accurate.
    bend_stiffness_per_length : N m/rad per m
        Stiffness of bend lines over their length; absent: fit of Liu and Paulino, 2017, to plates (a preset).
    crease : stiffness and rest angles of some creases; later items replace earlier ones
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
    taper: Annotated[Number, Field(gt=0, le=1)] | None = None
    subtended_angle: Annotated[Angle, Field(gt=0)] | None = None
    length: Annotated[Length, Field(gt=0)] | None = None
    width: Annotated[Length, Field(gt=0)] | None = None
    inner_radius: Annotated[Length, Field(gt=0)] | None = None
    outer_radius: Annotated[Length, Field(gt=0)] | None = None
    slit: bool | None = None
    pattern: Path | None = None
    scale: Annotated[Length, Field(gt=0)] | None = None
    frame: Annotated[Count, Field(ge=0)] | None = None
    part: Annotated[Count, Field(ge=1)] | None = None
    merge: Annotated[Length, Field(gt=0)] | None = None
    notes: tuple[str, ...] = ()
    vertices: tuple[tuple[Length, Length, Length], ...] | None = None
    edges: tuple[tuple[Count, Count], ...] | None = None
    assignment: tuple[Literal["B", "M", "V", "F", "U", "C", "J"], ...] | None = None
    angles: tuple[Angle, ...] | None = None
    faces: tuple[tuple[Count, ...], ...] | None = None
    fold: Annotated[Number, Field(ge=0, lt=1)] = 0.0
    align: Literal["mean plane"] | None = None
    fold_to: Annotated[Number, Field(ge=0, le=1)] | None = None
    facets: Literal["rigid", "bend-lines", "bars", "flexible"] = "rigid"
    bars: BarsOfSheet | None = None
    mesh_size: Annotated[Length, Field(gt=0)] | None = None
    mesh: tuple[Cells, Cells] | None = None
    mesh_shift: Annotated[Number, Field(ge=0, le=0.4)] = 0.0
    mesh_grading: tuple[Grading, Grading] = (0.0, 0.0)
    thickness: Annotated[Length, Field(gt=0)]
    film: Literal["plain", "tension-field"] = "plain"
    film_rounding: Annotated[Number, Field(gt=0, le=0.1)] = 1e-3
    bend_stiffness_per_length: Annotated[StiffnessOfLine, Field(gt=0)] | None = None
    crease: tuple[SheetCrease, ...] = ()
    support: tuple[SheetSupport, ...] = ()
    probe: tuple[SheetProbe, ...] = ()
    ply: tuple[SheetPly, ...] = ()

    @model_validator(mode="after")
    def _laminate(self) -> Self:
        if not self.ply:
            return self
        if self.facets != "flexible":
            raise ValueError(f'`ply` is for flexible facets only, not for facets = "{self.facets}"; remove `ply`')
        whole = sum(ply.thickness for ply in self.ply)
        if abs(whole - self.thickness) > 1e-6 * whole:
            text = f"the plies are {whole:g} m thick together, but thickness = {self.thickness:g} m; make them equal"
            raise ValueError(text)
        return self

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        given = [name for name in ("kind", "pattern", "vertices") if getattr(self, name) is not None]
        if len(given) != 1:
            both = f"{' and '.join(given)} are given" if given else "none is given"
            raise ValueError(f"give either `kind`, or `pattern` (a file), or `vertices` with `edges`; {both}")
        needed = self._needed
        if self.pattern is None:
            missing = [f"`{name}`" for name in needed if getattr(self, name) is None]
            if missing:
                raise ValueError(f"{self._source} needs {', '.join(missing)}")
        own = {name for names in _KEYS.values() for name in names} | {*_OF_FILE, *_ANNULUS, "slit", "taper"}
        allowed = {*needed, *self._optional, "vertices"} if self.pattern is None else set()
        for name in sorted(own - allowed):
            if getattr(self, name) is not None:
                raise ValueError(f"`{name}` is not used by {self._source}; remove `{name}`")
        for name in ("scale", "frame", "part", "merge"):
            if self.pattern is None and getattr(self, name) is not None:
                raise ValueError(f"`{name}` is not used by {self._source}; remove `{name}`")
        return self

    @property
    def is_shell(self) -> bool:
        """Whether the sheet is a plate or a boom, without a crease pattern."""
        return self.kind in SHELLS

    @property
    def is_boom(self) -> bool:
        """Whether the sheet is a boom."""
        return self.kind in BOOMS

    @property
    def is_annulus(self) -> bool:
        """Whether the sheet is an annular plate."""
        return self.kind == "plate" and (self.inner_radius is not None or self.outer_radius is not None)

    @property
    def is_disc(self) -> bool:
        """Whether the sheet is a plate without a hole and with a circular edge."""
        return self.is_annulus and self.inner_radius is None

    @property
    def _needed(self) -> tuple[str, ...]:
        if self.kind is None:
            return "edges", "assignment", "angles", "faces"
        if self.is_disc:
            return ("outer_radius",)
        return _ANNULUS if self.is_annulus else _KEYS[self.kind]

    @property
    def _optional(self) -> tuple[str, ...]:
        if self.is_disc:
            return ()
        return _OPTIONAL.get("annulus" if self.is_annulus else self.kind or "", ())

    @property
    def _source(self) -> str:
        return f'kind = "{self.kind}"' if self.kind is not None else "a pattern file" if self.pattern else "`vertices`"

    @model_validator(mode="after")
    def _sized(self) -> Self:
        # number of facets of each panel or side
        count = {"miura": 1, "zigzag": 1, "waterbomb": 6, "miura-tube": 4}.get(self.kind or "", 2)
        count = 0 if self.is_shell or self.kind is None else count
        count *= (self.columns or self.sides or 1) * (self.rows or 1)
        inner, outer = self.inner_radius or 0.0, self.outer_radius or 0.0
        if self.kind == "cone" and inner >= outer:
            raise ValueError(f"inner_radius = {inner:g} m must be less than outer_radius = {outer:g} m")
        if count > MOST_FACETS:
            raise ValueError(f"the sheet has {count:,} facets; at most {MOST_FACETS:,} are allowed")
        return self

    @model_validator(mode="after")
    def _plate(self) -> Self:
        if self.is_shell and self.align is not None:
            raise ValueError(f'`align` is for crease patterns only, not for kind = "{self.kind}"; remove `align`')
        if not self.is_shell:
            if self.mesh is not None or self.mesh_shift:
                raise ValueError("`mesh` and `mesh_shift` are for plates and booms; give `mesh_size` for other sheets")
            if self.mesh_grading[0] != self.mesh_grading[1]:
                text = f"mesh_grading = {list(self.mesh_grading)} must have two equal numbers, as facets are graded"
                raise ValueError(f"{text} towards all their edges; only plates and booms have two directions")
            return self
        if self.facets != "flexible":
            raise ValueError(f'kind = "{self.kind}" has no creases; give facets = "flexible"')
        if (self.mesh is None) == (self.mesh_size is None):
            raise ValueError("give either `mesh` (numbers of cells) or `mesh_size` (size of a cell)")
        if self.is_disc and (self.mesh is not None or self.mesh_shift):
            text = "a disc (`outer_radius` without `inner_radius`) has `mesh_size` only; remove `mesh` and `mesh_shift`"
            raise ValueError(text)
        if self.is_annulus and self.inner_radius is not None and self.outer_radius is not None:
            if self.inner_radius >= self.outer_radius:
                raise ValueError(
                    f"inner_radius = {self.inner_radius:g} m must be less than outer_radius = {self.outer_radius:g} m"
                )
            if self.mesh is not None and self.mesh[1] < 4:
                raise ValueError(f"mesh = {list(self.mesh)} has too few cells; give at least 4 cells around an annulus")
        return self

    @model_validator(mode="after")
    def _boom(self) -> Self:
        if not self.is_boom or self.kind is None:
            return self
        (low, high), angle = BOOMS[self.kind], self.subtended_angle
        assert angle is not None and self.radius is not None
        if not low < angle <= high:
            given, *bounds = (f"{math.degrees(x):g} deg" for x in (angle, low, high))
            text = f'subtended_angle = {given} of kind = "{self.kind}" must be above {bounds[0]} and at most {bounds[1]}'
            raise ValueError(text)
        if self.thickness > 0.1 * self.radius:
            most = f"a tenth of radius = {self.radius:g} m, because booms are thin shells"
            raise ValueError(f"thickness = {self.thickness:g} m must be at most {most}")
        return self

    @model_validator(mode="after")
    def _used(self) -> Self:
        if self.bars is not None and self.facets != "bars":
            raise ValueError(f'`bars` is used by facets = "bars" only, not by "{self.facets}"; remove this section')
        if self.film != "plain" and (self.facets != "flexible" or self.ply):
            kind = "plies" if self.ply else f'facets = "{self.facets}"'
            raise ValueError(f'film = "tension-field" is for flexible facets of one material, not for {kind}; remove `film`')
        if self.facets == "flexible":
            return self._flexible_only()
        if self.probe:
            raise ValueError(f'`probe` is for flexible facets only, not for facets = "{self.facets}"; remove `probe`')
        if any(support.clamped or support.mirror for support in self.support):
            raise ValueError(f'`clamped` and `mirror` are for flexible facets only, not for facets = "{self.facets}"')
        grading = self.mesh_grading if any(self.mesh_grading) else None
        own = {"mesh_size": self.mesh_size, "mesh": self.mesh, "mesh_grading": grading}
        for name, value in own.items():
            if value is not None:
                raise ValueError(f'`{name}` is for flexible facets only, not for facets = "{self.facets}"; remove `{name}`')
        if self.bend_stiffness_per_length is not None and self.facets == "rigid":
            raise ValueError('`bend_stiffness_per_length` is used by facets = "bend-lines" and "bars" only; remove this key')
        return self

    def _flexible_only(self) -> Self:
        if not self.is_shell and self.mesh_size is None:
            raise ValueError('facets = "flexible" needs `mesh_size`, the size of the cells')
        if self.bend_stiffness_per_length is not None:
            raise ValueError('`bend_stiffness_per_length` is used by facets = "bend-lines" and "bars" only; remove this key')
        return self
