"""Flexible parts of a [scene]: films, cables and beams of ANCF elements, and frames on them that other parts act on."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.sheet import Box
from fsm.scene.units import Count, Density, Length, Number, Stress, Time

__all__ = ["Edge", "SceneBeam", "SceneCable", "SceneFilm", "SceneFrame", "SceneSeam", "unstressed_length"]

Position = tuple[Length, Length, Length]
Quaternion = tuple[Number, Number, Number, Number]
Edge = Literal["left", "right", "bottom", "top", "corners"]
Elements = Annotated[Count, Field(ge=1, le=200)]


class SceneFilm(Model):
    """Rectangular film of ANCF elements.

    Attributes
    ----------
    position, orientation : m, unit quaternion (scalar first)
        Centre of the film at the start; its axes are x along the length, y across it and z normal to it.
    length, width, thickness : m
        Without stress.
    young, poisson, density : Pa, -, kg/m^3
    mesh : number of elements along length and width
    strain : -
        Strain along length and width at the start, when the film is already stretched.
    viscosity : s
        Kelvin-Voigt time: the strain rate adds a stress that equals the elastic stress of the strain `viscosity` times
        rate.
    held : edges whose nodes do not move
        "left" (smallest x), "right", "bottom" (smallest y), "top", "corners".
    """

    name: Name
    position: Position = (0.0, 0.0, 0.0)
    orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    length: Annotated[Length, Field(gt=0)]
    width: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]
    young: Annotated[Stress, Field(gt=0)]
    poisson: Annotated[Number, Field(gt=-1, lt=0.5)] = 0.3
    density: Annotated[Density, Field(gt=0)]
    mesh: tuple[Elements, Elements] = (8, 8)
    strain: tuple[Number, Number] = (0.0, 0.0)
    viscosity: Annotated[Time, Field(ge=0)] = 0.0
    held: tuple[Edge, ...] = ()


class _Line(Model):
    """Common keys of cables and beams; `SceneCable` and `SceneBeam` describe them."""

    name: Name
    start: Position
    end: Position
    young: Annotated[Stress, Field(gt=0)]
    density: Annotated[Density, Field(gt=0)]
    elements: Elements = 8
    strain: Annotated[Number, Field(gt=-1)] = 0.0
    viscosity: Annotated[Time, Field(ge=0)] = 0.0
    held: tuple[Literal["start", "end"], ...] = ()


class SceneCable(_Line):
    """Straight cable of ANCF elements with a round section; it bends and stretches, and has no torsion.

    Attributes
    ----------
    start, end : m
        Ends at the start of the motion.
    diameter : m
    young, density : Pa, kg/m^3
    elements : int
    strain : -
        Strain at the start; the unstressed length is shorter by it.
    viscosity : s
        Kelvin-Voigt damping of the stretch.
    held : ends that do not move
    """

    diameter: Annotated[Length, Field(gt=0)]

    @model_validator(mode="after")
    def _long(self) -> Self:
        if self.start == self.end:
            raise ValueError("start and end are the same point; give different points")
        return self


class SceneBeam(_Line):
    """Straight beam of ANCF elements with a rectangular section; it bends in the x-z plane and stretches.

    The beam has no shear strain (Euler and Bernoulli). A beam does not move along y and does not rotate about other
    axes; its supports carry the forces along y.

    Attributes
    ----------
    start, end : m
        Ends at the start of the motion, with the same y.
    width, thickness : m
        Sides of the section: width along y, thickness in the plane of bending.
    young, density : Pa, kg/m^3
    elements : int
    strain : -
        Strain at the start; the unstressed length is shorter by it.
    viscosity : s
        Kelvin-Voigt damping of the stretch.
    held : ends whose position is fixed; the beam can rotate there
    """

    width: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]

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
    """Frame on a film, a cable, a beam, a truss or the sheet. Force elements and loads act on it by its name, as on a body.

    Attributes
    ----------
    on : name of a film, a cable, a beam or a truss, or "sheet" for the [sheet] of the case
    at : m
        Material point without stress: (x, y) from the centre of a film, or the distance from the start of a cable or
        beam.
    point : number of a point of a truss, from 0, instead of `at`
        The frame has no axes: it carries forces and no moments.
    place : one vertex of the sheet, for example "vertex 3", or a box around it, m
    normal : (3,) vector
        Cables only: the y axis of the frame is normal to the cable and to this vector at the start. A frame on a cable
        follows the bending of the cable about any axis, but the cable does not resist a moment about its own axis. On a beam
        the y axis of the frame remains parallel to y.
    """

    name: Name
    on: str
    at: tuple[Length, ...] = ()
    point: Annotated[Count, Field(ge=0)] | None = None
    place: str | Box | None = None
    normal: tuple[Number, Number, Number] = (0.0, 0.0, 1.0)


class SceneSeam(Model):
    """Seam between an edge of a film or of the sheet and bodies: springs along the edge.

    Films have three springs for each element, flexible facets two for each cell, other facets one for each vertex.

    Attributes
    ----------
    film : name of a film, or "sheet" for the [sheet] of the case
    edge : edge of the film or sheet
    bodies : names of bodies
        Each point is joined to the body whose centre is nearest to it at the start.
    stiffness : Pa
        Stiffness in all directions (N/m) per length of the edge. A corner of the film represents the length of one element.
    """

    name: Name
    film: str
    edge: str
    bodies: tuple[str, ...]
    stiffness: Annotated[Stress, Field(gt=0)]


def unstressed_length(cable: SceneCable | SceneBeam) -> float:
    """Length of a cable or a beam without stress, m."""
    return math.dist(cable.start, cable.end) / (1.0 + cable.strain)
