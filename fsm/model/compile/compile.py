"""Compile a scene to a system: names become indices, models become arrays, and only groups with elements are created.

All faults of the scene are found first and raised together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np

from fsm.case.derived.joint_frames import MechanismLine, mechanism_lines
from fsm.case.derived.planar import out_of_plane
from fsm.case.models.loads import Drive
from fsm.case.models.scene import DIRECTIONS, GROUND, Body, ForceElement, Plate, Scene
from fsm.errors import CaseError, Fault
from fsm.kernels.rotation import multiply, rotation_matrix
from fsm.laws.crease import CreaseLaws, join_curves
from fsm.model.bodies.configuration import Bodies, BodyLine
from fsm.model.bodies.drive import Axis, PrescribedMotion, program_of, time_function, unit
from fsm.model.bodies.group import Group, GroupSteps
from fsm.model.bodies.loads import GravityGroup, LoadGroup, applied
from fsm.model.compile.compile_contacts import Compiled, compile_contacts
from fsm.model.compile.compile_couplings import coupling_groups
from fsm.model.compile.compile_joint_forces import cord_groups, joint_forces
from fsm.model.compile.compile_joints import joint_group
from fsm.model.elements.actuators import ActuatorGroup
from fsm.model.elements.couplings import TWIST, CouplingGroup, Joints
from fsm.model.elements.crease_curves import curve_of, hysteresis_of, sliders_of_laws
from fsm.model.elements.creases import CreaseGroup
from fsm.model.elements.element_angles import half_way_swings, initial_twists, rest_twists, side_of
from fsm.model.elements.element_group import ElementGroup
from fsm.model.elements.elements import BushingGroup
from fsm.model.elements.events import EventGroup
from fsm.model.elements.hysteresis import HysteresisGroup
from fsm.model.elements.law_elements import LawGroup, PointGroup
from fsm.model.elements.ligaments import LigamentGroup
from fsm.model.elements.locked_couplings import LockedCouplings
from fsm.model.elements.locked_inertia import set_inertia
from fsm.model.faults.check_scene import check_scene
from fsm.model.plan.in_python import InPython, parts_in_python
from fsm.model.system.system import SegmentSystem
from fsm.registry import ELEMENT_LAWS, POINT_KINDS


def compile_scene(scene: Scene, spatial: bool = False) -> SegmentSystem:
    """Compile a scene.

    Parameters
    ----------
    scene : Scene
    spatial : bool
        Six degrees of freedom per body even if the scene lies in one plane.

    Returns
    -------
    SegmentSystem

    Raises
    ------
    CaseError
        All faults of the scene.
    """
    faults = check_scene(scene)
    if faults:
        raise CaseError(faults)
    spatial = spatial or bool(out_of_plane(scene))
    if spatial and any(element.frame == "chord" for element in scene.elements):
        text = 'ligaments (frame = "chord", hinges of a lattice) exist only in a plane model'
        text += "; keep all bodies, drives and loads in the plane"
        raise CaseError(Fault("solve.spatial", text))
    return SceneCompiler(scene, spatial).system()


class SceneCompiler:
    """Arrays of the bodies, force elements, contacts and loads of a scene without faults."""

    def __init__(
        self,
        scene: Scene,
        spatial: bool,
        mobility: Mapping[str, np.ndarray] | None = None,
        like: Compiled | None = None,
    ) -> None:
        """`mobility` are the inverses of the inertia (6,) of frames, by name. The system shares groups of equal parts with
        that of `like`.
        """
        self.scene, self.mobility, self.like = scene, mobility or {}, like
        self.spatial = spatial
        self.all_bodies = (Body(name=GROUND, mass=0.0, inertia=(0.0, 0.0, 0.0), held=True), *scene.bodies)
        self.index = {body.name: i for i, body in enumerate(self.all_bodies)}
        of_elements = () if like is None or spatial != like.system.spatial else like.system.of_elements
        shares = like is not None and scene.bodies == like.scene.bodies and scene.elements == like.scene.elements
        self._of_elements, self._steps = of_elements if shares else (), list[tuple[Group, GroupSteps]]()
        self.pose = like.system.bodies.pose if like is not None and self._of_elements else self._poses()

    def system(self) -> SegmentSystem:
        """Create the system from all groups of interactions."""
        return self.switched(SegmentSystem(*self.parts()))

    def switched(self, system: SegmentSystem) -> SegmentSystem:
        """System of the compiled parts; each group acts in its own steps."""
        system.steps_of, system.of_elements = list(self._steps), self._of_elements
        system.in_python = parts_in_python(self.scene)
        if self._steps:
            system.in_python = InPython(("joints that act in some steps are apart in the system of all steps",))
        return system

    def parts(self) -> tuple[Bodies, tuple[PrescribedMotion, ...], tuple[Group, ...], tuple[str, ...]]:
        """Arguments of a system with these bodies."""
        motions = tuple(self._motion(drive) for drive in self.scene.drives)
        self._of_elements = self._of_elements or tuple(self._all_springs())
        groups = list(self._of_elements)
        if self.scene.point_elements:
            groups.append(self._point_elements())
        couplings = coupling_groups(self.scene, self.index, self.pose, self._twists)
        groups += couplings
        bodies = self._bodies(motions)
        groups += self._joints(bodies, couplings)
        contacts = compile_contacts(self.scene, self.all_bodies, self.pose, self.spatial, self.like)
        groups += contacts
        on_bodies = [load for load in self.scene.loads if load.pressure is None]
        if on_bodies:
            groups.append(LoadGroup(tuple(applied(load, self.index[load.target], self.spatial) for load in on_bodies)))
        if any(self.scene.gravity):
            mass = np.array([body.mass for body in self.all_bodies])
            groups.append(GravityGroup(mass, np.array(self._vector(self.scene.gravity))))
        pair_names = tuple(f"{pair.first} - {pair.second}" for pair in self.scene.pairs) if contacts else ()
        return bodies, motions, tuple(groups), pair_names

    # bodies ---------------------------------------------------------------------------------------------------------

    def _poses(self) -> np.ndarray:
        """Poses of all bodies, (n_bodies, 3 or 7)."""
        places = np.array([body.position for body in self.all_bodies], dtype=float)
        turns = np.array([body.orientation for body in self.all_bodies], dtype=float)
        if self.spatial:
            return np.concatenate([places, turns / np.sqrt(np.einsum("ij,ij->i", turns, turns))[:, None]], axis=1)
        angles = [2 * math.atan2(y, w) for w, y in turns[:, [0, 2]].tolist()]
        return np.array([(x, z, angle) for (x, _, z), angle in zip(places.tolist(), angles, strict=True)])

    def _vector(self, vector: tuple[float, float, float]) -> tuple[float, ...]:
        return vector if self.spatial else (vector[0], vector[2])

    def _bodies(self, motions: tuple[PrescribedMotion, ...]) -> Bodies:
        driven = {body for motion in motions for body in motion.bodies.tolist()}
        free = np.array(
            [i for i, body in enumerate(self.all_bodies) if not body.held and i not in driven], dtype=np.int64
        )
        rates, inertia = [], []
        for body in self.all_bodies:
            if self.spatial:
                rates.append([*body.velocity, *body.angular_velocity])
                inertia.append([body.mass] * 3 + list(body.inertia))
            else:
                rates.append([body.velocity[0], body.velocity[2], body.angular_velocity[1]])
                inertia.append([body.mass, body.mass, body.inertia[1]])
        return Bodies(
            names=tuple(body.name for body in self.all_bodies),
            pose=self.pose,
            rate=np.array(rates),
            inertia=np.array(inertia),
            free=free,
            plates=tuple(
                (i, plate, body.panel)
                for i, body in enumerate(self.all_bodies)
                for plate in (drawn_plates(body.plate) if body.plate else ())
            ),
            solids=tuple(
                (self.index[obstacle.body], obstacle.extent)
                for obstacle in self.scene.obstacles
                if obstacle.body is not None and obstacle.extent > 0.0
            ),
            lines=tuple(self._line(line) for line in mechanism_lines(self.scene)) if self.spatial else (),
        )

    def _line(self, line: MechanismLine) -> BodyLine:
        """Line in the axes of its body."""
        number = self.index[line.body]
        place, turned = self.pose[number, :3], rotation_matrix(self.pose[number, 3:])
        return BodyLine(number, line.name, (line.start - place) @ turned, (line.end - place) @ turned, line.kind)

    def _motion(self, drive: Drive) -> PrescribedMotion:
        assert drive.moved  # `check_scene` has checked this
        bodies = np.array([self.index[name] for name in drive.moved])
        direction = np.array(self._vector(drive.direction), dtype=float)
        if drive.turn is None:
            return PrescribedMotion(bodies, direction / np.linalg.norm(direction), program_of(drive))
        point = self.all_bodies[bodies[0]].position if drive.point is None else drive.point
        return PrescribedMotion(bodies, 0.0 * direction, program_of(drive), Axis(unit(drive.axis), np.array(point)))

    # force elements -------------------------------------------------------------------------------------------------

    def _all_springs(self) -> list[Group]:
        """Groups of all force elements; those of some steps are in `_steps` too."""
        groups: list[Group] = []
        for steps, latch in sorted({(e.steps, e.latch) for e in self.scene.elements}, key=_order):
            found = self._springs([e for e in self.scene.elements if (e.steps, e.latch) == (steps, latch)])
            groups += found
            groups += [each.locks for each in found if isinstance(each, BushingGroup) and each.locks is not None]
            if steps is not None:
                self._steps += [(group, GroupSteps(steps, latch)) for group in found]
        return groups

    def _springs(self, elements: list[ForceElement]) -> list[Group]:
        """Groups of force elements that act in the same steps."""
        groups: list[Group] = []
        bushings = self._bushings(elements)
        if bushings is not None:
            groups.append(bushings)
        added = self._with_laws(elements)
        if added is not None:
            groups.append(added)
        ligaments = self._ligaments(elements)
        if ligaments is not None:
            groups.append(ligaments)
        groups += self._actuators(elements)
        creases = self._creases(elements)
        if creases is not None:
            groups.append(creases)
            hysteresis = self._hysteresis(creases, elements)
            if hysteresis is not None:
                groups.append(hysteresis)
        return groups

    def _initial(self, elements: list[ForceElement]) -> list[float]:
        """Twists at the start, (m,), rad."""
        return [self._initial_of[id(element)] for element in elements]

    @cached_property
    def _initial_of(self) -> dict[int, float]:
        elements = self.scene.elements
        return dict(zip(map(id, elements), initial_twists(elements, self.scene.bodies), strict=True))

    def _bushings(self, elements: list[ForceElement]) -> BushingGroup | None:
        elements = [e for e in elements if e.frame == "outer" and _has_bushing(e)]
        if not elements:
            return None
        rest = np.zeros((len(elements), 6))
        initial = self._initial(elements)
        rest[:, 4] = rest_twists(elements, initial)
        stiffness = np.array([[*e.translation, e.rotation[0], e.twist_stiffness, e.rotation[2]] for e in elements])
        damping = np.array([[*e.translation_damping, *e.rotation_damping] for e in elements])
        # a tabulated crease has its own moment and damping about e2
        tabulated = [e.crease is not None for e in elements]
        stiffness[tabulated, 4] = 0.0
        damping[tabulated, 4] = 0.0
        keep = slice(None) if self.spatial else [0, 2, 4]
        shares = [e.crease_flexibility * e.twist_stiffness if e.kind == "crease" else 1.0 for e in elements]
        in_panels, category = np.unique(shares, return_inverse=True)
        return BushingGroup(
            self._ends(elements),
            self._pose_geometry(elements),
            np.ascontiguousarray(rest[:, keep]),
            np.ascontiguousarray(stiffness[:, keep]),
            np.ascontiguousarray(damping[:, keep]),
            category,
            in_panels,
            tuple(e.name for e in elements),
            np.array([e.kind != "joint" for e in elements]),
            np.ascontiguousarray(np.array([[name in e.locked for name in DIRECTIONS] for e in elements])[:, keep]),
        )

    def _actuators(self, elements: list[ForceElement]) -> list[ActuatorGroup]:
        """Moments of springs whose rest angle moves; one group for each function of time."""
        moving = [e for e in elements if e.rest_turn and e.rest_time is not None]
        found = []
        for element in moving:
            if not self.spatial or element.crease is not None:
                text = f"`rest_turn` of {element.name!r} moves the rest angle of linear springs in space only"
                raise CaseError(Fault("scene.elements", text))
        for time in dict.fromkeys(e.rest_time for e in moving):
            assert time is not None
            chosen = [e for e in moving if e.rest_time == time]
            moment = np.array([e.rotation[1] * e.rest_turn for e in chosen])
            names = tuple(e.name for e in chosen)
            found.append(ActuatorGroup(self._ends(chosen), self._joint_axes(chosen), moment, time_function(time), names))
        return found

    def _with_laws(self, elements: list[ForceElement]) -> LawGroup | None:
        """Laws of extensions."""
        elements = [e for e in elements if e.law is not None]
        if not elements:
            return None
        return LawGroup(
            self._ends(elements),
            self._pose_geometry(elements),
            np.zeros((len(elements), 6 if self.spatial else 3)),
            tuple((ELEMENT_LAWS[e.law].law, e.parameters) for e in elements if e.law is not None),
            tuple(e.name for e in elements),
        )

    def _point_elements(self) -> PointGroup:
        """Elements of kinds of extensions."""
        given = []
        for element in self.scene.point_elements:
            bodies, points = [self.index[p.body] for p in element.points], [p.point for p in element.points]
            given.append((element.name, POINT_KINDS[element.kind].law, element.parameters, bodies, points))
        return PointGroup.of(given)

    def _joints(self, bodies: Bodies, couplings: list[CouplingGroup]) -> list[Group]:
        """Ideal joints, laws on their coordinates, springs, cords and events; sets the inertia of locked openings."""
        joints, springs, actions = self.scene.joints, self.scene.springs, self.scene.built.actions
        ends, of_springs = (
            np.array([[self.index[one.first], self.index[one.second]] for one in each], dtype=np.int64).reshape(-1, 2)
            for each in (joints, springs)
        )
        locked, inverse = None, np.zeros(bodies.inertia.shape)
        inverse[bodies.free] = 1.0 / bodies.inertia[bodies.free]
        for name, own in self.mobility.items():
            inverse[self.index[name]] = own
        if joints:
            locked = joint_group(joints, ends, self.pose, {a.name for of in actions for a in of if a.verb == "lock"})
            set_inertia(locked, [group for group in couplings if isinstance(group, LockedCouplings)], self.pose, inverse)
        changed = {a.name for of in actions for a in of if a.verb == "change"}
        forces = joint_forces(joints, ends, springs, of_springs, self.pose, locked, changed)
        cords = cord_groups(self.scene.cords, self.index, self.pose)
        found: list[ElementGroup] = [*(group for group in (locked, forces) if group is not None), *cords]
        if actions:
            found.append(EventGroup(np.zeros((0, 2), dtype=np.int64), inverse, actions, (*couplings, *found)))
        return list(found)

    def _twists(self, elements: list[ForceElement]) -> Joints:
        """Twists of force elements from the start, for couplings."""
        *axes, offset = self._joint_axes(elements)
        inner, outer = axes if self.spatial else (np.zeros((0, 4)), np.zeros((0, 4)))
        start = offset - np.array(self._initial(elements))
        return Joints(self._ends(elements), np.full(len(elements), TWIST), inner, outer, start)

    def _pose_geometry(self, elements: list[ForceElement]) -> tuple[np.ndarray, ...]:
        """Arguments that the kernels of the relative pose take after the bodies."""
        initial = self._initial(elements)
        return (
            np.array([self._vector(e.point_inner) for e in elements], dtype=float),
            np.array([self._vector(e.point_outer) for e in elements], dtype=float),
            *self._joint_axes(elements),
            *([half_way_swings(elements, initial)] if self.spatial else []),
        )

    def _ligaments(self, elements: list[ForceElement]) -> LigamentGroup | None:
        elements = [e for e in elements if e.frame == "chord"]
        if not elements:
            return None
        keep = [0, 2, 4]
        return LigamentGroup.at_rest(
            self.pose,
            self._ends(elements),
            np.array([self._vector(e.point_inner) for e in elements], dtype=float),
            np.array([self._vector(e.point_outer) for e in elements], dtype=float),
            np.array([[*e.translation, *e.rotation] for e in elements])[:, keep],
            np.array([[*e.translation_damping, *e.rotation_damping] for e in elements])[:, keep],
            np.array([e.bends for e in elements]),
            tuple(e.name for e in elements),
        )

    def _creases(self, elements: list[ForceElement]) -> CreaseGroup | None:
        elements = [e for e in elements if e.crease is not None]
        if not elements:
            return None
        keys = [(e.crease, e.crease_flexibility) for e in elements if e.crease is not None]
        numbers = {key: number for number, key in enumerate(dict.fromkeys(keys))}
        axes = self._joint_axes(elements)
        geometry = axes if self.spatial else axes[1:]
        initial = self._initial(elements)
        rest = rest_twists(elements, initial)
        side = np.array([side_of(start, free) for start, free in zip(initial, rest, strict=True)])
        return CreaseGroup(
            self._ends(elements),
            geometry,
            side * np.array(rest),
            side,
            np.array([e.rotation_damping[1] for e in elements]),
            np.array([numbers[key] for key in keys], dtype=np.int64),
            join_curves([curve_of(*key) for key in numbers]),
            np.array([e.crease_flexibility for e in elements]),
            tuple(e.name for e in elements),
        )

    def _hysteresis(self, creases: CreaseGroup, elements: list[ForceElement]) -> HysteresisGroup | None:
        """Friction sliders of the creases whose loading and unloading curves are different."""
        elements = [e for e in elements if e.crease is not None]
        keys = dict.fromkeys((e.crease, e.crease_flexibility) for e in elements if e.crease is not None)
        start = np.array(self._initial(elements))
        sliders, chosen = sliders_of_laws([hysteresis_of(*key) for key in keys], creases.law, start)
        if sliders is None:
            return None
        rest, side, _, curve, *table = creases.law
        return HysteresisGroup(
            creases.bodies[chosen],
            tuple(array[chosen] for array in creases.geometry),
            CreaseLaws(rest[chosen], side[chosen], np.zeros(len(chosen)), curve[chosen], *table),
            creases.flexibility[chosen],
            sliders,
            tuple(elements[i].name for i in chosen.tolist()),
        )

    def _ends(self, elements: list[ForceElement]) -> np.ndarray:
        return np.array([[self.index[e.inner], self.index[e.outer]] for e in elements], dtype=np.int64)

    def _joint_axes(self, elements: list[ForceElement]) -> tuple[np.ndarray, ...]:
        """In the plane, the constants are the angle of the outer axes and psi_0. In space, they are the matrices of the
        axes, psi_0 and the sign of the quaternions.
        """
        initial = self._initial(elements)
        if not self.spatial:
            angles = np.array([[2 * math.atan2(q[2], q[0]) for q in (e.axes_inner, e.axes_outer)] for e in elements])
            ends = self._ends(elements)
            raw = self.pose[ends[:, 0], 2] + angles[:, 0] - self.pose[ends[:, 1], 2] - angles[:, 1]
            wanted = np.array(initial)
            turns = 2 * np.pi * np.round((wanted - raw) / (2 * np.pi))
            return angles[:, 1], angles[:, 0] - angles[:, 1] + turns
        # with half-way axes, the twist is measured from zero and not from the initial angle
        anchors = np.where(half_way_swings(elements, initial), 0.0, initial)
        turns = np.zeros((len(elements), 4))
        turns[:, [0, 2]] = [(math.cos(0.5 * anchor), -math.sin(0.5 * anchor)) for anchor in anchors.tolist()]
        inner, outer = (np.array([getattr(e, name) for e in elements], dtype=float) for name in ("axes_inner", "axes_outer"))
        anchored, (first, second) = multiply(inner, turns), self.pose[self._ends(elements).T, 3:]
        relative = multiply(multiply(second, outer) * [1.0, -1.0, -1.0, -1.0], multiply(first, anchored))
        left = 0.5 * (np.array(initial) - anchors)
        same_turn = np.cos(left) * relative[:, 0] + np.sin(left) * relative[:, 2] >= 0.0
        return np.where(same_turn[:, None], anchored, -anchored), outer, anchors


def drawn_plates(plate: Plate) -> list[Plate]:
    """Convex plates of at most four corners that together form a plate."""
    outline = plate.outline
    if outline is None or len(outline) <= 4:
        return [plate]
    fans = [(outline[0], *outline[k : k + 3]) for k in range(1, len(outline) - 1, 2)]
    return [plate.model_copy(update={"outline": fan}) for fan in fans]


def _order(key: tuple[tuple[str, ...] | None, bool]) -> tuple[bool, tuple[str, ...], bool]:
    """Sort key for groups of elements: groups that act in all steps come first."""
    steps, latch = key
    return steps is not None, steps or (), latch


def _has_bushing(element: ForceElement) -> bool:
    """Whether any linear spring or damper acts; the twist of a tabulated crease does not count."""
    turning = [0, 2] if element.crease is not None else [0, 1, 2]
    return (
        any(element.translation)
        or any(element.translation_damping)
        or any(element.rotation[k] or element.rotation_damping[k] for k in turning)
    )
