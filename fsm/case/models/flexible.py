"""Flexible parts of a [scene]: films, cables and beams of ANCF elements, and frames on them that other parts act on."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.models.sheet_parts import Box
from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Count, Density, Length, Number, Stress, Time

Position = tuple[Length, Length, Length]
Quaternion = tuple[Number, Number, Number, Number]
Edge = Literal["left", "right", "bottom", "top", "corners"]
Elements = Annotated[Count, Field(ge=1, le=200)]


class SceneFilm(Model):
    """Rectangular film of ANCF elements."""

    name: Name = Field(description="name of the film", json_schema_extra={"range": "different from all other names"})
    position: Position = Field(default=(0.0, 0.0, 0.0), description="center at the start")
    orientation: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0),
        description="axes at the start: x along the length, y across it, z normal",
        json_schema_extra={"range": "unit quaternion"},
    )
    length: Length = Field(gt=0, description="length without stress")
    width: Length = Field(gt=0, description="width without stress")
    thickness: Length = Field(gt=0, description="thickness of the film")
    young: Stress = Field(gt=0, description="Young's modulus")
    poisson: Number = Field(default=0.3, gt=-1, lt=0.5, description="Poisson's ratio")
    density: Density = Field(gt=0, description="density")
    mesh: tuple[Elements, Elements] = Field(default=(8, 8), description="number of elements along length and width")
    strain: tuple[Number, Number] = Field(default=(0.0, 0.0), description="strain along length and width at the start")
    viscosity: Time = Field(
        default=0.0, ge=0,
        description="Kelvin-Voigt time: the damping stress is the elastic stress of the strain `viscosity` times rate",
    )
    held: tuple[Edge, ...] = Field(
        default=(),
        description='edges whose nodes do not move; "left" is the edge of the smallest x, "bottom" the edge of the '
        "smallest y",
    )


class _Line(Model):
    """Common keys of cables and beams."""

    name: Name = Field(
        description="name of the cable or beam", json_schema_extra={"range": "different from all other names"}
    )
    start: Position = Field(description="one end at the start of the motion")
    end: Position = Field(
        description="the other end; the cable or beam is straight",
        json_schema_extra={"range": "not `start`; of a beam at the same y"},
    )
    young: Stress = Field(gt=0, description="Young's modulus")
    density: Density = Field(gt=0, description="density")
    elements: Elements = Field(default=8, description="number of elements")
    strain: Number = Field(default=0.0, gt=-1, description="strain at the start")
    viscosity: Time = Field(default=0.0, ge=0, description="Kelvin-Voigt damping of the stretch")
    held: tuple[Literal["start", "end"], ...] = Field(
        default=(),
        description="ends that do not move; the end of a beam is free to rotate, and a force element to the ground clamps "
        "it",
    )


class SceneCable(_Line):
    """Straight cable of ANCF elements with a round section; it bends and stretches, and has no torsion."""

    diameter: Length = Field(gt=0, description="diameter of the round section")

    @model_validator(mode="after")
    def _long(self) -> Self:
        if self.start == self.end:
            raise ValueError("start and end are the same point; give different points")
        return self


class SceneBeam(_Line):
    """Straight beam of ANCF elements with a rectangular section; it bends in the x-z plane and stretches.

    The beam has no shear strain (Euler and Bernoulli). A beam does not move along y and does not rotate about other
    axes; its supports carry the forces along y.
    """

    width: Length = Field(gt=0, description="size of the section along y")
    thickness: Length = Field(gt=0, description="size of the section in the plane of bending")

    @model_validator(mode="after")
    def _in_plane(self) -> Self:
        if self.start == self.end:
            raise ValueError("start and end are the same point; give different points")
        if abs(self.end[1] - self.start[1]) > 1e-9 * math.dist(self.start, self.end):
            raise ValueError(
                f"a beam lies in a plane y = const; start has y = {self.start[1]:g} m, end y = {self.end[1]:g} m; "
                "give both the same y"
            )
        return self


class SceneFrame(Model):
    """Frame on a film, a cable, a beam, a truss or the sheet; force elements and loads act on it by its name."""

    name: Name = Field(
        description="name, with which elements and loads refer to the frame",
        json_schema_extra={"range": "different from all other names"},
    )
    on: str = Field(
        description='"sheet": the `[sheet]` of the case',
        json_schema_extra={"range": 'a film, a cable, a beam, a truss or "sheet"'},
    )
    at: tuple[Length, ...] = Field(
        default=(),
        description="material point without stress: (x, y) from the center of a film, or (s) from the start of a cable or "
        "beam",
        json_schema_extra={"default": "needed for films, cables and beams", "range": "on the film or cable"},
    )
    edge: Literal["left", "right", "bottom", "top"] | None = Field(
        default=None,
        description="edge of a film in place of `at`. The frame has the mean position and the mean direction of the edge; "
        "its force and moment are spread evenly over the edge, which still bends",
        json_schema_extra={"default": "a point, `at`"},
    )
    point: Annotated[Count, Field(ge=0)] | None = Field(
        default=None,
        description="number of the point of a truss, from 0. Such a frame has no axes and carries no moment",
        json_schema_extra={"default": "needed for trusses"},
    )
    place: str | Box | None = Field(
        default=None,
        description='vertex of the sheet, for example "vertex 3", or a box around one vertex as two opposite corners',
        json_schema_extra={"default": "needed for sheets", "range": "one vertex"},
    )
    normal: tuple[Number, Number, Number] = Field(
        default=(0.0, 0.0, 1.0),
        description="for a cable: the y axis of the frame is the vector product of `normal` and the direction of the "
        "cable. The frame follows the bending of the cable",
        json_schema_extra={"range": "across the cable"},
    )


class SceneSeam(Model):
    """Seam between an edge of a film or of the sheet and bodies: springs along the edge.

    Films have three springs for each element, flexible facets two for each cell, other facets one for each vertex.
    """

    name: Name = Field(description="name of the seam", json_schema_extra={"range": "different from all other names"})
    film: str = Field(description='"sheet": the `[sheet]` of the case', json_schema_extra={"range": 'a film, or "sheet"'})
    edge: str = Field(
        description="an edge of the sheet, as in `[[drive]]`, or of the film",
        json_schema_extra={"range": 'films: "left", "right", "bottom", "top", "corners"'},
    )
    bodies: tuple[str, ...] = Field(
        description="each point of the seam is joined to the nearest of these bodies",
        json_schema_extra={"range": "one or more"},
    )
    stiffness: Stress = Field(
        gt=0,
        description="stiffness in all directions (N/m) per length of the edge (m); a corner represents the length of an "
        "element",
    )


def unstressed_length(cable: SceneCable | SceneBeam) -> float:
    """Length of a cable or a beam without stress, m."""
    return math.dist(cable.start, cable.end) / (1.0 + cable.strain)
