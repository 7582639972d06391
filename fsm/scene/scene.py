"""Section [scene] of a case: bodies, force elements, surfaces, loads and drives.

A builder (`fsm.scene.builders`) makes a scene from a strip or a lattice; a case can also give a scene directly. All values
are in SI, and quaternions have the scalar part first. Body axes of a segment: x along it, y across it (the crease
direction), z normal to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator

from fsm.registry import ELEMENT_LAWS
from fsm.scene.added_laws import check_element_law, check_parameters, with_parameters
from fsm.scene.contact import Contact, Friction
from fsm.scene.flexible import SceneBeam, SceneCable, SceneFilm, SceneFrame, SceneSeam
from fsm.scene.loads import Drive, Load
from fsm.scene.materials import Crease
from fsm.scene.model import Model, Name
from fsm.scene.obstacle import Obstacle
from fsm.scene.point_element import PointElement
from fsm.scene.time_program import TimeFunction
from fsm.scene.truss import SceneTruss
from fsm.scene.units import (
    Acceleration,
    Angle,
    AngularDamping,
    AngularSpeed,
    AngularStiffness,
    Area,
    Damping,
    Inertia,
    Length,
    Mass,
    Number,
    Speed,
    Stiffness,
)

if TYPE_CHECKING:
    from fsm.scene.gas import Orifice
    from fsm.scene.patterns.chamber import Chamber
    from fsm.scene.patterns.flexible_facets import FlexibleFacets
    from fsm.scene.patterns.fold_data import FoldData
    from fsm.scene.patterns.panel_surface import PanelSurface
    from fsm.scene.patterns.touching import TouchingSheet

__all__ = ["GROUND", "Body", "ContactPair", "ForceElement", "PlateGroup", "Plate", "Scene", "Surface"]

GROUND = "ground"
"""Name of the fixed body of every scene, at the origin with inertial axes."""

Quaternion = tuple[Number, Number, Number, Number]
Position = tuple[Length, Length, Length]


class Plate(Model):
    """Plate centred in its body, for drawings and contact: a rectangle, or a polygon with an outline.

    Attributes
    ----------
    length, width, thickness : m
    outline : corners (x, y) of a polygon in body axes, m, which `length` and `width` enclose; absent: a rectangle
    """

    length: Annotated[Length, Field(gt=0)]
    width: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]
    outline: Annotated[tuple[tuple[Length, Length], ...], Field(min_length=3)] | None = None


class Body(Model):
    """Rigid body.

    Attributes
    ----------
    name : str
    mass : kg
    inertia : kg m^2
        Principal moments about the centre of mass, along the body axes.
    position, orientation : m, unit quaternion (scalar first)
    velocity, angular_velocity : m/s in inertial axes, rad/s in body axes
    held : bool
        Whether the body is fixed, without degrees of freedom.
    plate : plate of the body, or None
    panel : int
        Number of the panel of the body, from 1; 0 for none.
    """

    name: Name
    mass: Annotated[Mass, Field(ge=0)]
    inertia: tuple[Inertia, Inertia, Inertia]
    position: Position = (0.0, 0.0, 0.0)
    orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    velocity: tuple[Speed, Speed, Speed] = (0.0, 0.0, 0.0)
    angular_velocity: tuple[AngularSpeed, AngularSpeed, AngularSpeed] = (0.0, 0.0, 0.0)
    held: bool = False
    plate: Plate | None = None
    panel: int = 0


class ForceElement(Model):
    """Force element with six springs and dampers between two bodies (Li and Huang, 2025, eqs. 1 to 14; docs/theory.md).

    The element acts between P+ on the inner body and P- on the outer body. The translation is Z = B_b^T A_b^T (p_a - p_b),
    in joint axes of the outer body. The relative rotation consists of a swing (s1, s3) and a twist psi about the joint
    axis e2.

    Attributes
    ----------
    inner, outer : names of bodies, or "ground"
    point_inner, point_outer : m, in body axes from the centre of mass
    axes_inner, axes_outer : quaternion of the joint axes in body axes
    translation, translation_damping : N/m, N s/m along e1, e2, e3
    rotation, rotation_damping : N m/rad, N m s/rad for s1, psi, s3
    rest_angle : rad
        Twist at which the moment of the linear spring or of the crease is zero. Absent: the `rest_angle` of the crease law
        with the sign of the initial fold, or 0.
    rest_turn : rad
        Change of the rest angle of a linear spring, times `rest_time`, in space.
    rest_time : function of time of this change
    initial_angle : rad
        Twist at the start (0 flat; +-160 degrees for a strip folded at 80 degrees). The angle must agree with the positions
        of the bodies; absent: it follows from them.
    frame : str
        "outer": Z in the joint axes of the outer body. "chord" (planar only): a ligament from P- to P+. The ligament's first
        translation is the change of its length from the initial length. The third translation is the initial length times
        the rotation of the chord relative to the mean rotation of both bodies. The third translation is symmetric in both
        bodies.
    swing_axes : str or None
        Axes of the swing (s1, s3). "outer": axes of the outer body, for a hinge or a universal joint. "half-way": axes
        half-way between both bodies, rotated by psi/2 about e2, for an elastic joint with bending about several axes.
        None: "half-way" if all three rotations have a stiffness, there is no crease, and the initial twist is below 45
        degrees; else "outer". In planar motion both are equal.
    crease : law of the twist, instead of rotation[1]
    crease_flexibility : rad/(N m)
        Flexibility of the half-cell correction, in series with the crease law or with rotation[1]. The energy counts as
        energy of the panels.
    kind : role of the element in the model
    steps : names of the steps in which the element acts; absent: in all
    latch : bool
        Whether the force of the element is zero at the beginning of its first step.
    law : law of an extension that acts besides the springs
    parameters : parameters of this law
    """

    name: Name
    inner: str
    outer: str
    point_inner: Position = (0.0, 0.0, 0.0)
    point_outer: Position = (0.0, 0.0, 0.0)
    axes_inner: Quaternion = (1.0, 0.0, 0.0, 0.0)
    axes_outer: Quaternion = (1.0, 0.0, 0.0, 0.0)
    translation: tuple[Stiffness, Stiffness, Stiffness] = (0.0, 0.0, 0.0)
    rotation: tuple[AngularStiffness, AngularStiffness, AngularStiffness] = (0.0, 0.0, 0.0)
    translation_damping: tuple[Damping, Damping, Damping] = (0.0, 0.0, 0.0)
    rotation_damping: tuple[AngularDamping, AngularDamping, AngularDamping] = (0.0, 0.0, 0.0)
    rest_angle: Angle | None = None
    rest_turn: Angle = 0.0
    rest_time: TimeFunction | None = None
    initial_angle: Angle | None = None
    frame: Literal["outer", "chord"] = "outer"
    swing_axes: Literal["outer", "half-way"] | None = None
    crease: Crease | None = None
    crease_flexibility: Annotated[Number, Field(ge=0)] = 0.0
    kind: Literal["joint", "crease", "panel", "drive"] = "joint"
    steps: tuple[str, ...] | None = None
    latch: bool = False
    law: str | None = None
    parameters: dict[str, Any] | None = None

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> dict[str, Any]:
        """Element with an empty section for the parameters of its law, so that missing parameters are found; see
        `Model`.
        """
        return with_parameters(written, written.get("law"), ELEMENT_LAWS)

    @property
    def twist_stiffness(self) -> float:
        """Stiffness of the linear spring about e2, with the half segments in series, N m/rad."""
        return self.rotation[1] / (1.0 + self.rotation[1] * self.crease_flexibility)

    @field_validator("law", mode="before")
    @classmethod
    def _known(cls, value: Any) -> Any:
        return check_element_law(value, ELEMENT_LAWS)

    @field_validator("parameters", mode="before")
    @classmethod
    def _of_law(cls, value: Any, info: ValidationInfo) -> Any:
        return check_parameters(value, info.data.get("law"), ELEMENT_LAWS, info)


class Surface(Model):
    """Surface for contact: a row of plates, each joined to the next, in order along their x axes."""

    name: Name
    bodies: tuple[str, ...]


class PlateGroup(Model):
    """Group of bodies with plates for contact pairs, for example a pile or the facets of a sheet.

    Attributes
    ----------
    face : m^2
        Area with the whole contact stiffness, so that the stiffness of an area is the same for plates of all sizes. Absent:
        each plate has the whole stiffness.
    """

    name: Name
    bodies: tuple[str, ...]
    face: Annotated[Area, Field(gt=0)] | None = None


class ContactPair(Model):
    """Pair of objects with contact: surfaces, bodies with a plate or groups of these, and an obstacle on at most one side.

    Contact of a surface with a plate, a group or an obstacle uses the rigid plates of the surface. Every plate of a group
    has contact with the other side. In a pair of a group with itself, every plate has contact with every other plate.

    Attributes
    ----------
    first, second : names of both sides
    shared : str
        Connection of two surfaces. "end-start": the end of `first` is the start of `second`, so the layers are joined there
        and the thickness in the gap decreases to zero. "chain": panels of one strip without a common crease. "none".
    """

    first: str
    second: str
    shared: Literal["none", "end-start", "chain"] = "none"


class Scene(Model):
    """Complete model before compilation; see the module docstring for conventions."""

    bodies: tuple[Body, ...] = ()
    films: tuple[SceneFilm, ...] = ()
    cables: tuple[SceneCable, ...] = ()
    beams: tuple[SceneBeam, ...] = ()
    trusses: tuple[SceneTruss, ...] = ()
    frames: tuple[SceneFrame, ...] = ()
    seams: tuple[SceneSeam, ...] = ()
    elements: tuple[ForceElement, ...] = ()
    point_elements: tuple[PointElement, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    groups: tuple[PlateGroup, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    pairs: tuple[ContactPair, ...] = ()
    contact: Contact | None = None
    friction: Friction | None = None
    loads: tuple[Load, ...] = ()
    drives: tuple[Drive, ...] = ()
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, 0.0, 0.0)
    _facets: FlexibleFacets | None = PrivateAttr(default=None)
    _folds: FoldData | None = PrivateAttr(default=None)
    _touching: TouchingSheet | None = PrivateAttr(default=None)
    _across_cuts: tuple[tuple[int, int], ...] = PrivateAttr(default=())
    _chambers: tuple[Chamber, ...] = PrivateAttr(default=())
    _orifices: tuple[Orifice, ...] = PrivateAttr(default=())
    _panels_of_gas: PanelSurface | None = PrivateAttr(default=None)

    @property
    def lines(self) -> dict[str, SceneCable | SceneBeam]:
        """Cables and beams by name."""
        return {cable.name: cable for cable in self.cables} | {beam.name: beam for beam in self.beams}

    @property
    def flexible(self) -> bool:
        """Whether there are parts with nodes: films, cables, beams, trusses or flexible facets."""
        return bool(self.films or self.cables or self.beams or self.trusses) or self._facets is not None

    @property
    def facets(self) -> FlexibleFacets | None:
        """Flexible facets of a sheet; only the builder of a sheet gives them."""
        return self._facets

    def with_facets(self, facets: FlexibleFacets) -> Scene:
        """Copy of the scene with flexible facets."""
        scene = self.model_copy()
        scene._facets = facets
        return scene

    @property
    def folds(self) -> FoldData | None:
        """Folds of the truss of a sheet of bars, instead of its linear springs; only the builder of a sheet gives them."""
        return self._folds

    def with_folds(self, folds: FoldData) -> Scene:
        """Copy of the scene with the folds of its truss."""
        scene = self.model_copy()
        scene._folds = folds
        return scene

    @property
    def touching(self) -> TouchingSheet | None:
        """Surface of a sheet with contact; only the builder of a sheet gives it."""
        return self._touching

    def with_touching(self, surface: TouchingSheet | None) -> Scene:
        """Copy of the scene with the surface of a sheet for contact."""
        scene = self.model_copy()
        scene._touching = surface
        return scene

    @property
    def across_cuts(self) -> tuple[tuple[int, int], ...]:
        """Pairs of facets of a sheet across a cut, which have no contact where they touch at the start; numbers from 0."""
        return self._across_cuts

    def with_across_cuts(self, pairs: tuple[tuple[int, int], ...]) -> Scene:
        """Copy of the scene with the pairs of facets across the cuts of its sheet."""
        scene = self.model_copy()
        scene._across_cuts = pairs
        return scene

    @property
    def chambers(self) -> tuple[Chamber, ...]:
        """Chambers of gas; only the builder of a sheet gives them."""
        return self._chambers

    @property
    def orifices(self) -> tuple[Orifice, ...]:
        """Orifices of the chambers."""
        return self._orifices

    @property
    def panels_of_gas(self) -> PanelSurface | None:
        """Closed surfaces of rigid panels around the chambers; None if the sheet has nodes."""
        return self._panels_of_gas

    def with_chambers(
        self, chambers: tuple[Chamber, ...], orifices: tuple[Orifice, ...], panels: PanelSurface | None = None
    ) -> Scene:
        """Copy of the scene with chambers of gas."""
        scene = self.model_copy()
        scene._chambers, scene._orifices, scene._panels_of_gas = chambers, orifices, panels
        return scene
