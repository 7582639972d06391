"""Section [scene] of a case: bodies, force elements, surfaces, loads and drives.

A builder (`fsm.builders`) makes a scene from a strip or a lattice; a case can also give a scene directly. All values
are in SI, and quaternions have the scalar part first. Body axes of a segment: x along it, y across it (the crease
direction), z normal to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

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
from fsm.case.schema.model import Key, Model, Name
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
    from fsm.case.models.flexible_facets import FlexibleFacets, FoldData
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

    length: Length = Key("size along x", gt=0)
    width: Length = Key("size along y", gt=0)
    thickness: Length = Key("size along z", gt=0)
    outline: Annotated[tuple[tuple[Length, Length], ...], Field(min_length=3)] | None = Key(
        "corners (x, y) of a polygon for drawings and contact, counter-clockwise; the builder of a sheet gives " "them",
        default=None, shown="a rectangle"
    )  # fmt: skip


class Body(Model):
    """Rigid body."""

    name: Name = Key("name of the body", within='not "ground"')
    mass: Mass = Key("mass", ge=0, within="> 0 unless held or driven")
    inertia: tuple[Inertia, Inertia, Inertia] = Key(
        "principal moments about the centre of mass, along the body axes", within="none above the sum of the others"
    )
    position: Position = Key("position of the centre of mass", default=(0.0, 0.0, 0.0))
    orientation: Quaternion = Key(
        "orientation of the body axes, scalar part first", default=(1.0, 0.0, 0.0, 0.0), within="unit quaternion"
    )
    velocity: tuple[Speed, Speed, Speed] = Key("initial velocity, inertial axes", default=(0.0, 0.0, 0.0))
    angular_velocity: tuple[AngularSpeed, AngularSpeed, AngularSpeed] = Key(
        "initial angular velocity, body axes", default=(0.0, 0.0, 0.0)
    )
    held: bool = Key("fixed body without degrees of freedom", default=False)
    plate: Plate | None = Key("plate for drawings and contact", default=None)
    panel: int = Key(
        "number of the panel to which the body belongs (0: no panel). The keys `hold` and `release` of a step "
        "accept `panel 1` for all bodies of panel 1. Bodies of one panel have the same colour in figures", default=0,
    )  # fmt: skip


class ForceElement(LawSection):
    """Force element with six springs and dampers between two bodies (Li and Huang, 2025, eqs. 1 to 14; docs/theory.md).

    The element acts between P+ on the inner body and P- on the outer body. The translation is Z = B_b^T A_b^T (p_a - p_b),
    in joint axes of the outer body. The relative rotation consists of a swing (s1, s3) and a twist psi about the joint
    axis e2.
    """

    name: Name = Key("name of the element")
    inner: str = Key("inner body", within='a body or "ground"')
    outer: str = Key("outer body, whose joint axes define the directions", within='a body or "ground"')
    point_inner: Position = Key("point of the inner body, body axes, from the centre of mass", default=(0.0, 0.0, 0.0))
    point_outer: Position = Key("point of the outer body, body axes, from the centre of mass", default=(0.0, 0.0, 0.0))
    axes_inner: Quaternion = Key(
        "joint axes of the inner body, in body axes", default=(1.0, 0.0, 0.0, 0.0), within="quaternion"
    )
    axes_outer: Quaternion = Key(
        "joint axes of the outer body, in body axes", default=(1.0, 0.0, 0.0, 0.0), within="quaternion"
    )
    translation: tuple[Stiffness, Stiffness, Stiffness] = Key("stiffness along e1, e2, e3", default=(0.0, 0.0, 0.0))
    rotation: tuple[AngularStiffness, AngularStiffness, AngularStiffness] = Key(
        "stiffness for s1, psi, s3", default=(0.0, 0.0, 0.0)
    )
    translation_damping: tuple[Damping, Damping, Damping] = Key("damping along e1, e2, e3", default=(0.0, 0.0, 0.0))
    rotation_damping: tuple[AngularDamping, AngularDamping, AngularDamping] = Key(
        "damping for s1, psi, s3; three equal values with no `rotation`: c times the relative angular "
        "velocity, at any rotation", default=(0.0, 0.0, 0.0),
    )  # fmt: skip
    rest_angle: Angle | None = Key(
        "twist at which the moment is zero. Without this key and `crease.rest_angle` it is 0 (flat), and not "
        '"as folded" as in a strip. `crease.rest_angle` has the sign of the initial fold', default=None,
        shown="`crease.rest_angle`, or 0", within="with `crease` -pi to pi",
    )  # fmt: skip
    rest_turn: Angle = Key("linear spring in space: change of the rest angle, times `rest_time`", default=0.0)
    rest_time: TimeFunction | None = Key("[function of time](#functions-of-time) of this change", default=None)
    initial_angle: Angle | None = Key(
        "initial twist; it gives the sign for a closed crease (pi or -pi)", default=None, shown="of the bodies as placed",
        within="agrees with them"
    )  # fmt: skip
    frame: Literal["outer", "chord"] = Key(
        'definition of the deformation. "outer": relative position in the axes of the outer body. "chord": '
        "ligament between two points at a distance, symmetric in both bodies, in the plane only", default="outer",
    )  # fmt: skip
    bends: bool = Key(
        'with `frame = "chord"`: the ligament is a beam, whose chord shortens when it bends '
        '(docs/calibration.md, "Hinged lattices")', default=False,
    )  # fmt: skip
    swing_axes: Literal["outer", "half-way"] | None = Key(
        'axes of the swing (s1, s3). "outer": axes of the outer body, for hinges and universal joints. '
        '"half-way": axes turned by psi/2 about e2, for elastic joints. Default: "half-way" if all three of `rotation` are '
        'given, the initial angle is below 45 degrees and there is no crease; else "outer"', default=None,
        shown='"half-way" for elastic joints, else "outer"',
    )  # fmt: skip
    crease: Crease | None = Key("as `[crease]`, in place of rotation[1], which must be 0", default=None)
    crease_flexibility: Flexibility = Key(
        'flexibility of half segments in series with `crease`, or with rotation[1] if `kind` is "crease". Its '
        "energy counts as energy of the panels", default=0.0, ge=0,
    )  # fmt: skip
    kind: Literal["joint", "crease", "panel", "drive"] = Key(
        "role in the model, which determines the category of its energy", default="joint"
    )
    locked: tuple[Direction, ...] = Key(
        "directions that a load does not deform in statics: a multiplier takes up the effort, and the stiffness "
        "only sets its convergence. In motions, and with `latch`, the spring deforms", default=(),
        within="names of directions with a stiffness",
    )  # fmt: skip
    steps: tuple[str, ...] | None = Key("steps in which it acts; absent: in all", default=None, within="names of steps")
    latch: bool = Key(
        "with `steps`: the force of the element is zero in the position at the beginning of its first step", default=False
    )
    law: str | None = Key("law of an extension, besides the springs", default=None)
    parameters: dict[str, Any] | None = Key("parameters of this law", default=None)

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

    name: Name = Key("name of the surface")
    bodies: tuple[str, ...] = Key(
        "bodies with plates in a row, each joined to the next, in order along their x axes", within="one or more"
    )


class PlateGroup(Model):
    """Group of bodies with plates for contact pairs, for example a pile or the facets of a sheet."""

    name: Name = Key("name of the group", within="different from all other names")
    bodies: tuple[str, ...] = Key("separate bodies with plates", within="one or more")
    face: Annotated[Area, Field(gt=0)] | None = Key(
        "area with the whole contact stiffness, so that an area has the same stiffness on plates of all sizes", default=None,
        shown="each plate"
    )  # fmt: skip


class ContactPair(LawSection):
    """Pair of objects with contact: surfaces, bodies with a plate or groups of these, and an obstacle on at most one side;
    or two bodies with a geometry of an extension.

    Contact of a surface with a plate, a group or an obstacle uses the rigid plates of the surface. Every plate of a group
    has contact with the other side. In a pair of a group with itself, every plate has contact with every other plate.
    """

    chosen_by: ClassVar[str] = "geometry"

    first: str = Key("first side: a surface, a body with a plate, a group, a film, a cable, a beam, or an obstacle")
    second: str = Key(
        "second side, as `first`; it can be the same group. Two obstacles: one is a sphere, exactly one is a plane, or both "
        "are boxes"
    )
    shared: Literal["none", "end-start", "chain"] = Key(
        '"end-start": the end of the first is the start of the second (a common crease); "chain": panels of '
        "one strip without a common crease", default="none",
    )  # fmt: skip
    geometry: str | None = Key(
        '"ellipsoid-on-plane", "cylinder-on-cylinder", or a geometry of an extension; both sides are bodies, '
        "or one is the ground", default=None, shown="by the sides",
    )  # fmt: skip
    parameters: dict[str, Any] | None = Key("parameters of this geometry", default=None)

    @classmethod
    def added(cls, name: object) -> Mapping[str, AddedLaw]:
        """See `LawSection`."""
        return geometries(name)


@dataclass(frozen=True)
class BuiltParts:
    """Parts of a scene that only builders give.

    Attributes
    ----------
    facets : flexible facets of a sheet
    folds : folds of the truss of a sheet of bars, instead of its linear springs
    touching : surface of a sheet with contact
    across_cuts : pairs of facets of a sheet across a cut, which have no contact where they touch at the start; from 0
    actions : actions of all events (`fsm.case.derived.event_words.Action`)
    chambers, orifices : chambers of gas, and their orifices
    panels_of_gas : closed surfaces of rigid panels around the chambers; None if the sheet has nodes
    """

    facets: FlexibleFacets | None = None
    folds: FoldData | None = None
    touching: TouchingSheet | None = None
    across_cuts: tuple[tuple[int, int], ...] = ()
    actions: tuple[tuple[Any, ...], ...] = ()
    chambers: tuple[Chamber, ...] = ()
    orifices: tuple[Orifice, ...] = ()
    panels_of_gas: PanelSurface | None = None


class Scene(Model):
    """Complete model before compilation; see the module docstring for conventions."""

    bodies: tuple[Body, ...] = Key("rigid bodies", default=())
    films: tuple[SceneFilm, ...] = Key("rectangular films of ANCF elements", default=())
    cables: tuple[SceneCable, ...] = Key("cables of ANCF elements", default=())
    beams: tuple[SceneBeam, ...] = Key("beams of ANCF elements that bend in the x-z plane", default=())
    trusses: tuple[SceneTruss, ...] = Key("points, bars and rotational springs, `[[scene.trusses]]`", default=())
    frames: tuple[SceneFrame, ...] = Key("frames on films, cables, beams, trusses and sheets", default=())
    seams: tuple[SceneSeam, ...] = Key("seams between an edge of a film or of the sheet and bodies", default=())
    elements: tuple[ForceElement, ...] = Key("force elements", default=())
    point_elements: tuple[PointElement, ...] = Key("elements of kinds of extensions, between points", default=())
    joints: tuple[SceneJoint, ...] = Key("ideal joints between bodies", default=())
    springs: tuple[SceneSpring, ...] = Key("springs and dampers between two points of bodies", default=())
    cords: tuple[SceneCord, ...] = Key("cords from point to point, over pulleys", default=())
    couplings: tuple[SceneCoupling, ...] = Key("elements on the coordinates of joints", default=())
    surfaces: tuple[Surface, ...] = Key("surfaces for contact", default=())
    groups: tuple[PlateGroup, ...] = Key("groups of plates for contact", default=())
    obstacles: tuple[Obstacle, ...] = Key("rigid obstacles, as `[[obstacle]]`", default=())
    pairs: tuple[ContactPair, ...] = Key("contact pairs", default=())
    contact: Contact | None = Key("normal contact, as `[contact]`", default=None)
    friction: Friction | None = Key("friction, as `[friction]`", default=None)
    loads: tuple[Load, ...] = Key("forces and couples, as `[[load]]`", default=())
    drives: tuple[Drive, ...] = Key("prescribed motions, as `[[drive]]`, with `body` or `bodies`", default=())
    gravity: tuple[Acceleration, Acceleration, Acceleration] = Key("acceleration, inertial axes", default=(0.0, 0.0, 0.0))
    _built: BuiltParts = PrivateAttr(default=BuiltParts())

    @property
    def lines(self) -> dict[str, SceneCable | SceneBeam]:
        """Cables and beams by name."""
        return {cable.name: cable for cable in self.cables} | {beam.name: beam for beam in self.beams}

    @property
    def flexible(self) -> bool:
        """Whether there are parts with nodes: films, cables, beams, trusses or flexible facets."""
        return bool(self.films or self.cables or self.beams or self.trusses) or self._built.facets is not None

    @property
    def built(self) -> BuiltParts:
        """Parts that only builders give."""
        return self._built

    def with_parts(self, **parts: Any) -> Scene:
        """Copy of the scene with other `BuiltParts`."""
        scene = self.model_copy()
        scene._built = replace(self._built, **parts)
        return scene
