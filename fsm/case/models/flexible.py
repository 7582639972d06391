"""Flexible parts of a [scene]: films, cables and beams of ANCF elements, and frames on them that other parts act on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, PrivateAttr, model_validator

from fsm.case.models.sheet_parts import Box
from fsm.case.schema.model import Key, Model, Name
from fsm.case.schema.units import Count, Density, Length, Number, Stress, Time

if TYPE_CHECKING:
    from fsm.case.models.facet_mesh import MeshPoint

Position = tuple[Length, Length, Length]
Quaternion = tuple[Number, Number, Number, Number]
Edge = Literal["left", "right", "bottom", "top", "corners"]
Elements = Annotated[Count, Field(ge=1, le=200)]


class SceneFilm(Model):
    """Rectangular film of ANCF elements."""

    name: Name = Key("name of the film", within="different from all other names")
    position: Position = Key("center at the start", default=(0.0, 0.0, 0.0))
    orientation: Quaternion = Key(
        "axes at the start: x along the length, y across it, z normal", default=(1.0, 0.0, 0.0, 0.0),
        within="unit quaternion"
    )  # fmt: skip
    length: Length = Key("length without stress", gt=0)
    width: Length = Key("width without stress", gt=0)
    thickness: Length = Key("thickness of the film", gt=0)
    young: Stress = Key("Young's modulus", gt=0)
    poisson: Number = Key("Poisson's ratio", default=0.3, gt=-1, lt=0.5)
    density: Density = Key("density", gt=0)
    mesh: tuple[Elements, Elements] = Key("number of elements along length and width", default=(8, 8))
    strain: tuple[Number, Number] = Key("strain along length and width at the start", default=(0.0, 0.0))
    viscosity: Time = Key(
        "Kelvin-Voigt time: the damping stress is the elastic stress of the strain `viscosity` times rate", default=0.0, ge=0
    )
    held: tuple[Edge, ...] = Key(
        'edges whose nodes do not move; "left" is the edge of the smallest x, "bottom" the edge of the ' "smallest y",
        default=()
    )  # fmt: skip


class _Line(Model):
    """Common keys of cables and beams."""

    name: Name = Key("name of the cable or beam", within="different from all other names")
    start: Position = Key("one end at the start of the motion")
    end: Position = Key("the other end; the cable or beam is straight", within="not `start`; of a beam at the same y")
    young: Stress = Key("Young's modulus", gt=0)
    density: Density = Key("density", gt=0)
    elements: Elements = Key("number of elements", default=8)
    strain: Number = Key("strain at the start", default=0.0, gt=-1)
    viscosity: Time = Key("Kelvin-Voigt damping of the stretch", default=0.0, ge=0)
    held: tuple[Literal["start", "end"], ...] = Key(
        "ends that do not move; the end of a beam is free to rotate, and a force element to the ground clamps " "it",
        default=()
    )  # fmt: skip

    @model_validator(mode="after")
    def _long(self) -> Self:
        if self.start == self.end:
            raise ValueError("start and end are the same point; give different points")
        return self


class SceneCable(_Line):
    """Straight cable of ANCF elements with a round section; it bends and stretches, and has no torsion."""

    diameter: Length = Key("diameter of the round section", gt=0)


class SceneBeam(_Line):
    """Straight beam of ANCF elements with a rectangular section; it bends in the x-z plane and stretches.

    The beam has no shear strain (Euler and Bernoulli). A beam does not move along y and does not rotate about other
    axes; its supports carry the forces along y.
    """

    width: Length = Key("size of the section along y", gt=0)
    thickness: Length = Key("size of the section in the plane of bending", gt=0)

    @model_validator(mode="after")
    def _in_plane(self) -> Self:
        if abs(self.end[1] - self.start[1]) > 1e-9 * math.dist(self.start, self.end):
            raise ValueError(
                f"a beam lies in a plane y = const; start has y = {self.start[1]:g} m, end y = {self.end[1]:g} m; "
                "give both the same y"
            )
        return self


class SceneFrame(Model):
    """Frame on a film, a cable, a beam, a truss or the sheet; force elements and loads act on it by its name."""

    name: Name = Key("name, with which elements and loads refer to the frame", within="different from all other names")
    on: str = Key('"sheet": the `[sheet]` of the case', within='a film, a cable, a beam, a truss or "sheet"')
    at: tuple[Length, ...] = Key(
        "material point without stress: (x, y) from the center of a film, or (s) from the start of a cable or beam. On a "
        "sheet: (s) from the first of two vertices of a side, or the place (x, y, z) of a point of a facet at the start",
        default=(), shown="needed for films, cables, beams and facets", within="on the part"
    )  # fmt: skip
    edge: Literal["left", "right", "bottom", "top"] | None = Key(
        "edge of a film in place of `at`. The frame has the mean position and the mean direction of the edge; "
        "its force and moment are spread evenly over the edge, which still bends", default=None, shown="a point, `at`",
    )  # fmt: skip
    point: Annotated[Count, Field(ge=0)] | None = Key(
        "number of the point of a truss, from 0. Such a frame has no axes and carries no moment", default=None,
        shown="needed for trusses"
    )  # fmt: skip
    place: str | Box | None = Key(
        'place on the sheet: a vertex, "vertex 3", or a box around one vertex as two opposite corners; a side of a facet '
        'by its ends, "vertices 3, 4", or an edge, "edge left"; a facet, "facet 2". A side or an edge without `at` is a '
        "mean, as `edge` of a film", default=None, shown="needed for sheets", within="one place"
    )  # fmt: skip
    normal: tuple[Number, Number, Number] = Key(
        "for a cable: the y axis of the frame is the vector product of `normal` and the direction of the "
        "cable. The frame follows the bending of the cable", default=(0.0, 0.0, 1.0), within="across the cable",
    )  # fmt: skip
    _on_sheet: MeshPoint | None = PrivateAttr(default=None)

    @property
    def on_sheet(self) -> MeshPoint | None:
        """Point of a sheet by the vectors of its mesh, or by the points of its truss; only builders of sheets give it."""
        return self._on_sheet

    def at_point(self, point: MeshPoint) -> Self:
        """Same frame at a point of a sheet."""
        frame = self.model_copy()
        frame._on_sheet = point
        return frame


class SceneSeam(Model):
    """Seam between an edge of a film or of the sheet and bodies: ideal, or springs along the edge.

    An ideal seam has a joint at each node or vertex of the edge. Of springs, films have three for each element, flexible
    facets two for each cell, other facets one for each vertex.
    """

    name: Name = Key("name of the seam", within="different from all other names")
    film: str = Key('"sheet": the `[sheet]` of the case', within='a film, or "sheet"')
    edge: str = Key(
        "an edge of the sheet, as in `[[drive]]`, or of the film",
        within='films: "left", "right", "bottom", "top", "corners"'
    )  # fmt: skip
    bodies: tuple[str, ...] = Key(
        "each point of the seam is joined to the nearest of these bodies", within='one or more, or "ground" alone'
    )
    stiffness: Stress | None = Key(
        "stiffness in all directions (N/m) per length of the edge (m); a corner represents the length of an element. "
        "Absent: ideal, both sides do not part", default=None, gt=0
    )  # fmt: skip
    clamped: bool = Key(
        "an ideal seam also keeps the angle between the edge and the body; else the edge turns about itself", default=False
    )

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.clamped and self.stiffness is not None:
            raise ValueError(f"the clamped seam {self.name!r} is ideal; remove `stiffness`, or `clamped`")
        if "ground" in self.bodies and len(self.bodies) > 1:
            raise ValueError(f'the seam {self.name!r} names "ground" beside bodies; give two seams')
        return self


def unstressed_length(cable: SceneCable | SceneBeam) -> float:
    """Length of a cable or a beam without stress, m."""
    return math.dist(cable.start, cable.end) / (1.0 + cable.strain)
