"""The scene: bodies, force elements, surfaces, loads and drives, as plain frozen models.

A builder (`fsm.scene.builders`) writes a scene from a few numbers; a scene can also be written by hand. Everything is
SI, quaternions are scalar first, and body axes are x along a segment, y across it (the crease direction), z normal.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fsm.scene.contact import Contact, Friction
from fsm.scene.loads import Drive, Load
from fsm.scene.materials import Crease
from fsm.scene.model import Model, Name
from fsm.scene.obstacle import Obstacle
from fsm.scene.units import (
    Acceleration,
    Angle,
    AngularDamping,
    AngularSpeed,
    AngularStiffness,
    Damping,
    Inertia,
    Length,
    Mass,
    Number,
    Speed,
    Stiffness,
)

__all__ = ["GROUND", "Body", "ContactPair", "ForceElement", "Group", "Plate", "Scene", "Surface"]

GROUND = "ground"
"""Name of the fixed body every scene has: at the origin, axes as the inertial ones."""

Quaternion = tuple[Number, Number, Number, Number]
Position = tuple[Length, Length, Length]


class Plate(Model):
    """Rectangular outline of a segment, centred in its body: what is drawn and what touches."""

    length: Annotated[Length, Field(gt=0)]
    width: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]


class Body(Model):
    """A rigid body.

    Attributes
    ----------
    name : str
    mass : kg
    inertia : kg m^2
        Principal moments about the centre of mass, along the body axes.
    position, orientation : m, unit quaternion (scalar first)
    velocity, angular_velocity : m/s in inertial axes, rad/s in body axes
    held : bool
        Fixed where it is: no degrees of freedom, its reaction is reported.
    plate : outline, or None for a body without one
    panel : int
        Number of the panel the body is cut from, from 1; 0 for none.
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
    """A 6-DOF spring force element between two bodies (seed 003, eqs. 1 to 14; docs/theory.md).

    It acts between P+ on the inner body and P- on the outer body. Translation Z = B_b^T A_b^T (p_a - p_b) in the joint
    axes of the outer body; relative rotation split into swing (s1, s3) and twist psi about the joint's e2.

    Attributes
    ----------
    inner, outer : names of bodies, or "ground"
    point_inner, point_outer : m, in body axes from the centre of mass
    axes_inner, axes_outer : quaternion of the joint axes in body axes
    translation, translation_damping : N/m, N s/m along e1, e2, e3
    rotation, rotation_damping : N m/rad, N m s/rad for s1, psi, s3
    rest_angle : rad
        Twist at which the linear spring or the crease law is free of moment. Absent: the `rest_angle` of the crease law
        on the side to which the scene is folded, or 0.
    initial_angle : rad
        Twist of the scene as given (flat 0, a strip folded at 80 degrees +-160 degrees). It must agree with the placed
        bodies; absent, it is taken from them.
    frame : str
        "outer": Z in the joint axes of the outer body. "chord" (in the plane): a ligament from P- to P+, which lie apart;
        its first translation is the change of its length from that of the scene as given, its third that length times
        the turn of the chord against the mean turn of both bodies. It looks the same from either body.
    swing_axes : str or None
        Axes in which the swing (s1, s3) is measured. "outer": those of the outer body; of a hinge or a universal joint.
        "half-way": those half-way between both bodies, turned by psi/2 about e2; of an elastic joint that is bent about
        several axes at once. None: "half-way" where all three rotations have a stiffness and the joint starts within 45
        degrees of unfolded, without a crease; else "outer". In a plane both are the same.
    crease : law of the twist, instead of rotation[1]
    crease_flexibility : rad/(N m)
        Half-cell flexibility in series with the crease law.
    kind : what the element stands for
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
    initial_angle: Angle | None = None
    frame: Literal["outer", "chord"] = "outer"
    swing_axes: Literal["outer", "half-way"] | None = None
    crease: Crease | None = None
    crease_flexibility: Annotated[Number, Field(ge=0)] = 0.0
    kind: Literal["joint", "crease", "panel", "drive"] = "joint"


class Surface(Model):
    """A face that can touch: a row of plates, each joined to the next, in order along their x axes."""

    name: Name
    bodies: tuple[str, ...]


class Group(Model):
    """Bodies with plates that contact pairs name together: a pile, say."""

    name: Name
    bodies: tuple[str, ...]


class ContactPair(Model):
    """Two things that may touch: surfaces, bodies with a plate, groups of these, or one of these and an obstacle.

    A surface touches a plate, a group or an obstacle as the rigid plates it is made of. Every plate of a group may touch all
    of the other side; in a pair of a group with itself, every other plate of the group. `shared` names the common crease of
    two surfaces, if they have one: "end-start" when the end of `first` is the start of `second`: there the layers are
    joined, and the thickness in the gap is tapered to nothing. "chain": panels of one strip without a common crease, whose
    ends meet as those of the panels between them do.
    """

    first: str
    second: str
    shared: Literal["none", "end-start", "chain"] = "none"


class Scene(Model):
    """Everything there is before compilation; see the module docstring for conventions."""

    bodies: tuple[Body, ...] = ()
    elements: tuple[ForceElement, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    groups: tuple[Group, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    pairs: tuple[ContactPair, ...] = ()
    contact: Contact | None = None
    friction: Friction | None = None
    loads: tuple[Load, ...] = ()
    drives: tuple[Drive, ...] = ()
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, 0.0, 0.0)
