"""Section [sheet] of a case: a folded sheet in space, of facets that creases join."""

import math
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.models.sheet_parts import BarsOfSheet, SheetCrease, SheetPly, SheetProbe, SheetSupport
from fsm.case.schema.model import Key, Model
from fsm.case.schema.units import Angle, Count, Length, Number, StiffnessOfLine

MOST_FACETS = 20_000
"""Largest number of facets of a sheet."""

Cells = Annotated[Count, Field(ge=1, le=1000)]
Grading = Annotated[Number, Field(ge=0, le=1)]
Kind = Literal[
    "miura", "zigzag", "waterbomb", "kresling", "yoshimura", "cone", "flasher", "tube",
    "miura-tube", "slits", "plate", "tape-spring", "stem", "lenticular",
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
    "slits": ("periods", "rows", "spacing", "slit_length", "ligament"),
    "plate": ("length", "width"),
    **dict.fromkeys(BOOMS, ("length", "radius", "subtended_angle")),
}
"""Required keys of each kind."""
_ANNULUS = ("inner_radius", "outer_radius")
"""Required keys of a plate that is an annulus."""
_OPTIONAL = {
    "plate": ("radius",), "annulus": ("slit",), "kresling": ("taper",), "slits": ("slit_width", "shift", "margin"),
}  # fmt: skip
"""Optional keys of some kinds."""
_OF_FILE = ("vertices", "edges", "assignment", "angles", "faces")
"""Keys of a pattern that is written in the case."""


class Sheet(Model):
    """Folded sheet: a crease pattern by `kind`, from a file, or written in the case."""

    kind: Kind | None = Field(
        default=None,
        description="crease pattern, a plate without creases, or a [boom](booms.md); give this, `pattern` or `vertices`. "
        '"miura", "zigzag", "waterbomb": sheets; "kresling", "yoshimura": tubes; "tube": Z-folded tube; "miura-tube": '
        'tube of two Miura sheets; "cone": pleated; "flasher": wraps around a hub; "slits": flat sheet with rows of '
        '[slits](sheets.md#sheets-with-slits); "tape-spring", "stem", "lenticular": '
        "booms",
    )
    columns: Annotated[Count, Field(ge=1, le=1000)] | None = Key(
        "number of panels or cells along x", default=None, shown='needed by "miura", "zigzag", "waterbomb", "miura-tube"'
    )
    rows: Annotated[Count, Field(ge=1, le=1000)] | None = Key(
        "number of panels or cells along y, of storeys of a tube, or of rows of slits", default=None,
        shown='needed by "miura", "waterbomb", "kresling", "yoshimura", "tube", "slits"'
    )  # fmt: skip
    a: Annotated[Length, Field(gt=0)] | None = Key(
        '"miura": side of a panel along y; "miura-tube": side of the rings; "zigzag": length of a panel along '
        'x; "waterbomb": side of a square cell', default=None,
        shown='needed by "miura", "zigzag", "waterbomb", "miura-tube"',
    )  # fmt: skip
    b: Annotated[Length, Field(gt=0)] | None = Key(
        '"miura", "miura-tube": side of a panel along x; "zigzag": width of the sheet', default=None,
        shown='needed by "miura", "zigzag", "miura-tube"'
    )  # fmt: skip
    sector_angle: Annotated[Angle, Field(gt=0, lt=math.pi / 2)] | None = Key(
        "angle between the sides of a panel", default=None, shown='needed by "miura", "miura-tube"'
    )
    fold_angle: Annotated[Angle, Field(ge=0, lt=math.pi / 2)] | None = Key(
        "angle of the panels with the mean plane at the start", default=None,
        shown='needed by "miura", "zigzag", "miura-tube"'
    )  # fmt: skip
    sides: Annotated[Count, Field(ge=3, le=1000)] | None = Key(
        "number of sides of a tube or flasher, or of pleats of a cone", default=None,
        shown='needed by "kresling", "yoshimura", "cone", "flasher"'
    )  # fmt: skip
    radius: Annotated[Length, Field(gt=0)] | None = Key(
        'circumradius of a tube; booms: radius of the section, at least 10 times the thickness; "plate": the '
        "plate is bent along x to a cylinder of this radius at the start, without stress", default=None,
        shown='needed by "kresling", "yoshimura", "tube" and booms',
    )  # fmt: skip
    height: Annotated[Length, Field(gt=0)] | None = Key(
        "height of a storey, panel or wall", default=None, shown='needed by "kresling", "yoshimura", "flasher", "tube"'
    )
    twist: Annotated[Angle, Field(gt=-math.pi, lt=math.pi)] | None = Key(
        "rotation of each ring relative to the ring below", default=None, shown='needed by "kresling"'
    )
    taper: Annotated[Number, Field(gt=0, le=1)] | None = Key(
        '"kresling": circumradius of each ring over that of the ring below; the heights of the storeys have '
        "the same ratio", default=None, shown="1",
    )  # fmt: skip
    subtended_angle: Annotated[Angle, Field(gt=0)] | None = Key(
        'angle that the arc of the section subtends; "lenticular": each of both arcs', default=None, shown="needed by booms",
        within='"tape-spring", "lenticular": to pi; "stem": above pi, to 4 pi'
    )  # fmt: skip
    length: Annotated[Length, Field(gt=0)] | None = Key(
        "side along x", default=None, shown='needed by a rectangular "plate" and booms'
    )
    width: Annotated[Length, Field(gt=0)] | None = Key("side along y", default=None, shown='needed by a rectangular "plate"')
    inner_radius: Annotated[Length, Field(gt=0)] | None = Key(
        'a "plate" with `outer_radius` only is a disc', default=None, shown='needed by "cone" and an annular "plate"'
    )
    outer_radius: Annotated[Length, Field(gt=0)] | None = Key(
        "circumradius of a flasher", default=None, shown='needed by "cone", "flasher" and a circular "plate"',
        within="> `inner_radius`"
    )  # fmt: skip
    slit: bool | None = Key('annular "plate": whether it is cut along the positive x axis', default=None, shown="false")
    periods: Annotated[Number, Field(gt=0, le=1000)] | None = Key(
        '"slits": width of the sheet over `slit_length` + `ligament`; 0.5 is enough for a part between two '
        "planes of symmetry", default=None, shown='needed by "slits"',
    )  # fmt: skip
    spacing: Annotated[Length, Field(gt=0)] | None = Key(
        '"slits": distance of the middles of neighbouring rows', default=None, shown='needed by "slits"'
    )
    slit_length: Annotated[Length, Field(gt=0)] | None = Key(
        '"slits": length of a slit, along x', default=None, shown='needed by "slits"'
    )
    ligament: Annotated[Length, Field(gt=0)] | None = Key(
        '"slits": length of the sheet between two slits of a row', default=None, shown='needed by "slits"'
    )
    slit_width: Annotated[Length, Field(ge=0)] | None = Key(
        '"slits": size of a slit along y; 0: a cut, without width', default=None, shown="0", within="< `spacing`"
    )
    shift: Annotated[Number, Field(ge=0, lt=1)] | None = Key(
        '"slits": shift of rows 1, 3, ... along x, over `slit_length` + `ligament`; rows 2, 4, ... begin with '
        "half of a ligament", default=None, shown="0.5",
    )  # fmt: skip
    margin: tuple[Annotated[Length, Field(ge=0)], Annotated[Length, Field(ge=0)]] | None = Key(
        '"slits": distances of the middles of the first and of the last row from the edges "bottom" and "top"; '
        "0: the row lies on the edge, for a part of a sheet that ends in a row", default=None, shown="`spacing` twice",
    )  # fmt: skip
    pattern: Path | None = Field(
        default=None,
        description="FOLD (1.0 to 1.2), SVG, ORIPA (.opx, .cp) or Oriedita (.ori, .cp) file, relative to the case file; "
        "see [patterns from files](sheets.md#patterns-from-files)",
    )
    scale: Annotated[Length, Field(gt=0)] | None = Key(
        "length of one unit of the file; needed for all files except FOLD", default=None, shown="`frame_unit` of a FOLD file"
    )
    frame: Annotated[Count, Field(ge=0)] | None = Key(
        "number of the frame of a FOLD file; absent: the first folded frame, else the first", default=None
    )
    part: Annotated[Count, Field(ge=1)] | None = Key(
        "number of the separate part of the file that is the sheet, from the largest; absent: the pattern must "
        "be one part", default=None,
    )  # fmt: skip
    merge: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description="distance below which points of the file are one vertex, and height below which a facet is planar; see "
        "[tolerance](sheets.md#tolerance-of-a-pattern-file)",
        json_schema_extra={"default": "from the file"},
    )
    notes: tuple[str, ...] = Key(
        "what was ignored or changed in the file; only `fsm` writes these texts, into the complete case", default=()
    )
    vertices: tuple[tuple[Length, Length, Length], ...] | None = Key(
        "positions at the start, instead of a file", default=None
    )
    edges: tuple[tuple[Count, Count], ...] | None = Key("two numbers of vertices of each edge, from 0", default=None)
    assignment: tuple[Literal["B", "M", "V", "F", "U", "C", "J"], ...] | None = Key(
        "boundary, mountain, valley, flat, unassigned, cut, bend line: a letter for each edge", default=None
    )
    angles: tuple[Angle, ...] | None = Key("fold angle of each edge in the folded state", default=None)
    faces: tuple[tuple[Count, ...], ...] | None = Key(
        "numbers of the vertices of each face, counter-clockwise, from 0", default=None
    )
    fold: Number = Key(
        "fraction of each fold angle at the start of a flat pattern, with rigid facets (with `facets = "
        '"bend-lines"` rigid between bend lines); the creases have no moment in this state', default=0.0, ge=0, lt=1,
    )  # fmt: skip
    align: Literal["mean plane"] | None = Key(
        "at the start, the plane of least squares through the vertices is turned to z = 0 by the smallest "
        "rotation, and the same side stays above; absent: as in the file, and with `fold` the first facet stays in place",
        default=None,
    )  # fmt: skip
    fold_to: Annotated[Number, Field(ge=0, le=1)] | None = Key(
        "fraction of each fold angle to which the rest angles of the creases move until `solve.end_time`; "
        "linear creases only", default=None,
    )  # fmt: skip
    facets: Literal["rigid", "bend-lines", "bars", "flexible"] = Field(
        default="rigid",
        description='"bend-lines": facets with more than three sides also bend along diagonals; "bars": [bars and '
        'hinges](sheets.md#bars-and-hinges) in place of facets; "flexible": thin plates, see [flexible '
        "facets](sheets.md#flexible-facets)",
    )
    bars: BarsOfSheet | None = Key('bars of `facets = "bars"`, `[sheet.bars]`', default=None, shown="presets")
    mesh_size: Annotated[Length, Field(gt=0)] | None = Key(
        '"flexible": largest size of a cell along the edges; a cell has two triangles. Required, except for '
        "plates and booms with `mesh`", default=None,
    )  # fmt: skip
    mesh: tuple[Cells, Cells] | None = Key(
        '"plate", booms: numbers of cells along x and y (booms: along the section), or along the radius and '
        "around; instead of `mesh_size`", default=None,
    )  # fmt: skip
    mesh_shift: Number = Key(
        '"plate", booms: random displacement of inner nodes, relative to the size of a cell, to show the '
        "effect of the mesh", default=0.0, ge=0, le=0.4,
    )  # fmt: skip
    mesh_grading: tuple[Grading, Grading] = Field(
        default=(0.0, 0.0),
        description='"flexible": grading of the cells of a plate or boom along x and y, or along the radius and around, '
        "towards both edges; of another sheet twice the same number, for the cells of each facet towards its edges. 0: "
        "uniform; 1: the cells follow a sine and are smallest at the edges, see [flexible "
        "facets](sheets.md#flexible-facets)",
    )
    thickness: Length = Key("thickness of the sheet", gt=0)
    film: Literal["plain", "tension-field"] = Key(
        '"tension-field": flexible facets carry no compression; they wrinkle, without resolving each wrinkle',
        default="plain"
    )  # fmt: skip
    film_rounding: Number = Key(
        '"tension-field": half-width, as a strain, of the rounded kinks of the law. Strains of this size are '
        "not accurate; smaller values need more iterations", default=1e-3, gt=0, le=0.1,
    )  # fmt: skip
    bend_stiffness_per_length: Annotated[StiffnessOfLine, Field(gt=0)] | None = Key(
        '"bend-lines", "bars": stiffness of bend lines over their length; absent: the fit of Liu and Paulino '
        "(2017) to plates", default=None, shown="a preset",
    )  # fmt: skip
    crease: tuple[SheetCrease, ...] = Key("stiffness and rest angle of some creases, `[[sheet.crease]]`", default=())
    support: tuple[SheetSupport, ...] = Key("supports, `[[sheet.support]]`", default=())
    probe: tuple[SheetProbe, ...] = Key(
        '"flexible": points whose displacements are in the summary, `[[sheet.probe]]`', default=()
    )
    ply: tuple[SheetPly, ...] = Key('"flexible": plies of a symmetric laminate, `[[sheet.ply]]`', default=())

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
        own = {name for names in _KEYS.values() for name in names} | {*_OF_FILE, *_ANNULUS}
        own |= {name for names in _OPTIONAL.values() for name in names}
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
    def has_no_creases(self) -> bool:
        """Whether the sheet has no edges that fold, so that it needs no crease law."""
        return self.is_shell or self.kind == "slits"

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
