"""Section [scene] of a case: bodies, force elements, surfaces, loads and drives.

A builder (`fsm.builders`) makes a scene from a strip or a lattice; a case can also give a scene directly. All values
are in SI, and quaternions have the scalar part first. Body axes of a segment: x along it, y across it (the crease
direction), z normal to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypedDict, Unpack

from pydantic import Field, PrivateAttr

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.coupling import SceneCoupling
from fsm.case.models.flexible import SceneBeam, SceneCable, SceneFilm, SceneFrame, SceneSeam
from fsm.case.models.joint import SceneJoint
from fsm.case.models.law_keys import LawSection, PointElement
from fsm.case.models.loads import Drive, Load
from fsm.case.models.materials import Crease
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.spring import SceneCord, SceneSpring
from fsm.case.models.time_program import TimeFunction
from fsm.case.models.truss import SceneTruss
from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import (
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
    Unit,
)
from fsm.registry import ELEMENT_LAWS, AddedLaw, geometries

if TYPE_CHECKING:
    from fsm.case.models.chambers import Chamber, PanelSurface
    from fsm.case.models.flexible_facets import FlexibleFacets
    from fsm.case.models.fold_data import FoldData
    from fsm.case.models.gas import Orifice
    from fsm.case.models.touching import TouchingSheet

GROUND = "ground"
Direction = Literal["e1", "e2", "e3", "s1", "psi", "s3"]
DIRECTIONS: tuple[Direction, ...] = ("e1", "e2", "e3", "s1", "psi", "s3")
"""Directions of a force element, in the order of its stiffnesses."""
"""Name of the fixed body of every scene, at the origin with inertial axes."""

Quaternion = tuple[Number, Number, Number, Number]
Position = tuple[Length, Length, Length]
Flexibility = Annotated[float, Unit("rad/N/m")]


class Plate(Model):
    """Plate centred in its body, for drawings and contact: a rectangle, or a polygon with an outline."""

    length: Length = Field(gt=0, description="size along x")
    width: Length = Field(gt=0, description="size along y")
    thickness: Length = Field(gt=0, description="size along z")
    outline: Annotated[tuple[tuple[Length, Length], ...], Field(min_length=3)] | None = Field(
        default=None,
        description="corners (x, y) of a polygon for drawings and contact, counter-clockwise; the builder of a sheet gives "
        "them",
        json_schema_extra={"default": "a rectangle"},
    )


class Body(Model):
    """Rigid body."""

    name: Name = Field(description="name of the body", json_schema_extra={"range": 'not "ground"'})
    mass: Mass = Field(ge=0, description="mass", json_schema_extra={"range": "> 0 unless held or driven"})
    inertia: tuple[Inertia, Inertia, Inertia] = Field(
        description="principal moments about the centre of mass, along the body axes",
        json_schema_extra={"range": "none above the sum of the others"},
    )
    position: Position = Field(default=(0.0, 0.0, 0.0), description="position of the centre of mass")
    orientation: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0),
        description="orientation of the body axes, scalar part first",
        json_schema_extra={"range": "unit quaternion"},
    )
    velocity: tuple[Speed, Speed, Speed] = Field(default=(0.0, 0.0, 0.0), description="initial velocity, inertial axes")
    angular_velocity: tuple[AngularSpeed, AngularSpeed, AngularSpeed] = Field(
        default=(0.0, 0.0, 0.0), description="initial angular velocity, body axes"
    )
    held: bool = Field(default=False, description="fixed body without degrees of freedom")
    plate: Plate | None = Field(default=None, description="plate for drawings and contact")
    panel: int = Field(
        default=0,
        description="number of the panel to which the body belongs (0: no panel). The keys `hold` and `release` of a step "
        "accept `panel 1` for all bodies of panel 1. Bodies of one panel have the same colour in figures",
    )


class ForceElement(LawSection):
    """Force element with six springs and dampers between two bodies (Li and Huang, 2025, eqs. 1 to 14; docs/theory.md).

    The element acts between P+ on the inner body and P- on the outer body. The translation is Z = B_b^T A_b^T (p_a - p_b),
    in joint axes of the outer body. The relative rotation consists of a swing (s1, s3) and a twist psi about the joint
    axis e2.
    """

    name: Name = Field(description="name of the element")
    inner: str = Field(description="inner body", json_schema_extra={"range": 'a body or "ground"'})
    outer: str = Field(
        description="outer body, whose joint axes define the directions", json_schema_extra={"range": 'a body or "ground"'}
    )
    point_inner: Position = Field(
        default=(0.0, 0.0, 0.0), description="point of the inner body, body axes, from the centre of mass"
    )
    point_outer: Position = Field(
        default=(0.0, 0.0, 0.0), description="point of the outer body, body axes, from the centre of mass"
    )
    axes_inner: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0),
        description="joint axes of the inner body, in body axes",
        json_schema_extra={"range": "quaternion"},
    )
    axes_outer: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0),
        description="joint axes of the outer body, in body axes",
        json_schema_extra={"range": "quaternion"},
    )
    translation: tuple[Stiffness, Stiffness, Stiffness] = Field(
        default=(0.0, 0.0, 0.0), description="stiffness along e1, e2, e3"
    )
    rotation: tuple[AngularStiffness, AngularStiffness, AngularStiffness] = Field(
        default=(0.0, 0.0, 0.0), description="stiffness for s1, psi, s3"
    )
    translation_damping: tuple[Damping, Damping, Damping] = Field(
        default=(0.0, 0.0, 0.0), description="damping along e1, e2, e3"
    )
    rotation_damping: tuple[AngularDamping, AngularDamping, AngularDamping] = Field(
        default=(0.0, 0.0, 0.0),
        description="damping for s1, psi, s3; three equal values with no `rotation`: c times the relative angular "
        "velocity, at any rotation",
    )
    rest_angle: Angle | None = Field(
        default=None,
        description="twist at which the moment is zero. Without this key and `crease.rest_angle` it is 0 (flat), and not "
        '"as folded" as in a strip. `crease.rest_angle` has the sign of the initial fold',
        json_schema_extra={"default": "`crease.rest_angle`, or 0", "range": "with `crease` -pi to pi"},
    )
    rest_turn: Angle = Field(default=0.0, description="linear spring in space: change of the rest angle, times `rest_time`")
    rest_time: TimeFunction | None = Field(default=None, description="[function of time](#functions-of-time) of this change")
    initial_angle: Angle | None = Field(
        default=None,
        description="initial twist; it gives the sign for a closed crease (pi or -pi)",
        json_schema_extra={"default": "of the bodies as placed", "range": "agrees with them"},
    )
    frame: Literal["outer", "chord"] = Field(
        default="outer",
        description='definition of the deformation. "outer": relative position in the axes of the outer body. "chord": '
        "ligament between two points at a distance, symmetric in both bodies, in the plane only",
    )
    bends: bool = Field(
        default=False,
        description='with `frame = "chord"`: the ligament is a beam, whose chord shortens when it bends '
        '(docs/calibration.md, "Hinged lattices")',
    )
    swing_axes: Literal["outer", "half-way"] | None = Field(
        default=None,
        description='axes of the swing (s1, s3). "outer": axes of the outer body, for hinges and universal joints. '
        '"half-way": axes turned by psi/2 about e2, for elastic joints. Default: "half-way" if all three of `rotation` are '
        'given, the initial angle is below 45 degrees and there is no crease; else "outer"',
        json_schema_extra={"default": '"half-way" for elastic joints, else "outer"'},
    )
    crease: Crease | None = Field(default=None, description="as `[crease]`, in place of rotation[1], which must be 0")
    crease_flexibility: Flexibility = Field(
        default=0.0, ge=0,
        description='flexibility of half segments in series with `crease`, or with rotation[1] if `kind` is "crease". Its '
        "energy counts as energy of the panels",
    )
    kind: Literal["joint", "crease", "panel", "drive"] = Field(
        default="joint", description="role in the model, which determines the category of its energy"
    )
    locked: tuple[Direction, ...] = Field(
        default=(),
        description="directions that a load does not deform in statics: a multiplier takes up the effort, and the stiffness "
        "only sets its convergence. In motions, and with `latch`, the spring deforms",
        json_schema_extra={"range": "names of directions with a stiffness"},
    )
    steps: tuple[str, ...] | None = Field(
        default=None, description="steps in which it acts; absent: in all", json_schema_extra={"range": "names of steps"}
    )
    latch: bool = Field(
        default=False,
        description="with `steps`: the force of the element is zero in the position at the beginning of its first step",
    )
    law: str | None = Field(default=None, description="law of an extension, besides the springs")
    parameters: dict[str, Any] | None = Field(default=None, description="parameters of this law")

    @classmethod
    def added(cls, name: object) -> Mapping[str, AddedLaw]:
        """See `LawSection`."""
        return ELEMENT_LAWS

    @property
    def twist_stiffness(self) -> float:
        """Stiffness of the linear spring about e2, with the half segments in series, N m/rad."""
        return self.rotation[1] / (1.0 + self.rotation[1] * self.crease_flexibility)


class Surface(Model):
    """Surface for contact: a row of plates, each joined to the next, in order along their x axes."""

    name: Name = Field(description="name of the surface")
    bodies: tuple[str, ...] = Field(
        description="bodies with plates in a row, each joined to the next, in order along their x axes",
        json_schema_extra={"range": "one or more"},
    )


class PlateGroup(Model):
    """Group of bodies with plates for contact pairs, for example a pile or the facets of a sheet."""

    name: Name = Field(description="name of the group", json_schema_extra={"range": "different from all other names"})
    bodies: tuple[str, ...] = Field(description="separate bodies with plates", json_schema_extra={"range": "one or more"})
    face: Annotated[Area, Field(gt=0)] | None = Field(
        default=None,
        description="area with the whole contact stiffness, so that an area has the same stiffness on plates of all sizes",
        json_schema_extra={"default": "each plate"},
    )


class ContactPair(LawSection):
    """Pair of objects with contact: surfaces, bodies with a plate or groups of these, and an obstacle on at most one side;
    or two bodies with a geometry of an extension.

    Contact of a surface with a plate, a group or an obstacle uses the rigid plates of the surface. Every plate of a group
    has contact with the other side. In a pair of a group with itself, every plate has contact with every other plate.
    """

    chosen_by: ClassVar[str] = "geometry"

    first: str = Field(
        description="first side: a surface, a body with a plate, a group, a film, a cable, a beam, or an obstacle"
    )
    second: str = Field(
        description="second side, as `first`; it can be the same group. Two obstacles: one is a sphere, or exactly one is "
        "a plane",
    )
    shared: Literal["none", "end-start", "chain"] = Field(
        default="none",
        description='"end-start": the end of the first is the start of the second (a common crease); "chain": panels of '
        "one strip without a common crease",
    )
    geometry: str | None = Field(
        default=None,
        description='"ellipsoid-on-plane", "cylinder-on-cylinder", or a geometry of an extension; both sides are bodies, '
        "or one is the ground",
        json_schema_extra={"default": "by the sides"},
    )
    parameters: dict[str, Any] | None = Field(default=None, description="parameters of this geometry")

    @classmethod
    def added(cls, name: object) -> Mapping[str, AddedLaw]:
        """See `LawSection`."""
        return geometries(name)


class BuiltParts(TypedDict, total=False):
    """Parts of a scene that only builders give; see the properties of `Scene`."""

    facets: FlexibleFacets
    folds: FoldData
    touching: TouchingSheet | None
    across_cuts: tuple[tuple[int, int], ...]
    actions: tuple[tuple[Any, ...], ...]
    chambers: tuple[Chamber, ...]
    orifices: tuple[Orifice, ...]
    panels_of_gas: PanelSurface | None


class Scene(Model):
    """Complete model before compilation; see the module docstring for conventions."""

    bodies: tuple[Body, ...] = Field(default=(), description="rigid bodies")
    films: tuple[SceneFilm, ...] = Field(default=(), description="rectangular films of ANCF elements")
    cables: tuple[SceneCable, ...] = Field(default=(), description="cables of ANCF elements")
    beams: tuple[SceneBeam, ...] = Field(default=(), description="beams of ANCF elements that bend in the x-z plane")
    trusses: tuple[SceneTruss, ...] = Field(
        default=(), description="points, bars and rotational springs, `[[scene.trusses]]`"
    )
    frames: tuple[SceneFrame, ...] = Field(default=(), description="frames on films, cables, beams and trusses")
    seams: tuple[SceneSeam, ...] = Field(default=(), description="springs between an edge of a film and bodies")
    elements: tuple[ForceElement, ...] = Field(default=(), description="force elements")
    point_elements: tuple[PointElement, ...] = Field(
        default=(), description="elements of kinds of extensions, between points"
    )
    joints: tuple[SceneJoint, ...] = Field(default=(), description="ideal joints between bodies")
    springs: tuple[SceneSpring, ...] = Field(default=(), description="springs and dampers between two points of bodies")
    cords: tuple[SceneCord, ...] = Field(default=(), description="cords from point to point, over pulleys")
    couplings: tuple[SceneCoupling, ...] = Field(default=(), description="elements on the coordinates of joints")
    surfaces: tuple[Surface, ...] = Field(default=(), description="surfaces for contact")
    groups: tuple[PlateGroup, ...] = Field(default=(), description="groups of plates for contact")
    obstacles: tuple[Obstacle, ...] = Field(default=(), description="rigid obstacles, as `[[obstacle]]`")
    pairs: tuple[ContactPair, ...] = Field(default=(), description="contact pairs")
    contact: Contact | None = Field(default=None, description="normal contact, as `[contact]`")
    friction: Friction | None = Field(default=None, description="friction, as `[friction]`")
    loads: tuple[Load, ...] = Field(default=(), description="forces and couples, as `[[load]]`")
    drives: tuple[Drive, ...] = Field(default=(), description="prescribed motions, as `[[drive]]`, with `body` or `bodies`")
    gravity: tuple[Acceleration, Acceleration, Acceleration] = Field(
        default=(0.0, 0.0, 0.0), description="acceleration, inertial axes"
    )
    _facets: FlexibleFacets | None = PrivateAttr(default=None)
    _folds: FoldData | None = PrivateAttr(default=None)
    _touching: TouchingSheet | None = PrivateAttr(default=None)
    _across_cuts: tuple[tuple[int, int], ...] = PrivateAttr(default=())
    _chambers: tuple[Chamber, ...] = PrivateAttr(default=())
    _orifices: tuple[Orifice, ...] = PrivateAttr(default=())
    _panels_of_gas: PanelSurface | None = PrivateAttr(default=None)
    _actions: tuple[tuple[Any, ...], ...] = PrivateAttr(default=())

    @property
    def lines(self) -> dict[str, SceneCable | SceneBeam]:
        """Cables and beams by name."""
        return {cable.name: cable for cable in self.cables} | {beam.name: beam for beam in self.beams}

    @property
    def flexible(self) -> bool:
        """Whether there are parts with nodes: films, cables, beams, trusses or flexible facets."""
        return bool(self.films or self.cables or self.beams or self.trusses) or self._facets is not None

    def with_parts(self, **parts: Unpack[BuiltParts]) -> Scene:
        """Copy of the scene with parts that only builders give."""
        scene = self.model_copy()
        for name, part in parts.items():
            setattr(scene, f"_{name}", part)
        return scene

    @property
    def facets(self) -> FlexibleFacets | None:
        """Flexible facets of a sheet; only the builder of a sheet gives them."""
        return self._facets

    @property
    def folds(self) -> FoldData | None:
        """Folds of the truss of a sheet of bars, instead of its linear springs; only the builder of a sheet gives them."""
        return self._folds

    @property
    def touching(self) -> TouchingSheet | None:
        """Surface of a sheet with contact; only the builder of a sheet gives it."""
        return self._touching

    @property
    def across_cuts(self) -> tuple[tuple[int, int], ...]:
        """Pairs of facets of a sheet across a cut, which have no contact where they touch at the start; numbers from 0."""
        return self._across_cuts

    @property
    def actions(self) -> tuple[tuple[Any, ...], ...]:
        """Actions of all events (`fsm.case.derived.event_words.Action`)."""
        return self._actions

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
