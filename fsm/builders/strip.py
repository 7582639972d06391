"""Scene of a strip: a zig-zag of panels that consist of rigid segments (Li and Huang, 2025, figures 5 to 7 and 18).

Panel i goes from crease i-1 to crease i. At the fold angle odd panels rise and even panels fall. Springs with six degrees
of freedom join the segments, and creases join the panels. A held panel is one rigid plate. A driven crease line or end line
is a massless body, and half a joint connects it to each of its panels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from fsm.case.models.case import Case, Strip
from fsm.case.models.loads import Drive
from fsm.case.models.materials import DAMPING, UNREAD, Crease, FamilyCrease, LinearCrease, Material
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, Scene, Surface
from fsm.case.plan.method_selection import automatic_method
from fsm.case.plan.step_items import releases, steps_from
from fsm.errors import CaseError, Fault

_DAMPING_OF_DRIVE = 5e-5
"""Ratio of the default Kelvin-Voigt time to the duration of the drive."""


def build_strip(case: Case) -> Scene:
    """Scene of the strip of a case.

    Parameters
    ----------
    case : Case
        Case with `strip`, `material` and `crease`.

    Raises
    ------
    CaseError
        The bending stiffness or the inertia is not a positive finite number.
    """
    assert case.strip is not None and case.material is not None and case.crease is not None
    given = case.material.damping
    scene = _StripBuilder(case, case.strip, case.material, case.crease, DAMPING if given is None else given).scene()
    damping = strip_damping(case, scene)
    if given is None and damping != DAMPING:
        scene = _StripBuilder(case, case.strip, case.material, case.crease, damping).scene()
    return scene


def strip_damping(case: Case, scene: Scene) -> float:
    """Kelvin-Voigt time beta of a strip, s: the value of the case, else `DAMPING`, which is reduced for a slow drive.

    Dampers delay the force by beta, which causes an error where the force rises steeply, for example at first contact. With
    a slow drive beta is therefore a small part of the duration. Free and fast motions need dampers to come to rest.
    """
    assert case.material is not None
    if case.material.damping is not None:
        return case.material.damping
    method = case.solve.method if case.solve.method != "auto" else automatic_method(scene)[0]
    if method != "static" or not scene.drives:
        return DAMPING
    return min(DAMPING, _DAMPING_OF_DRIVE * min(drive.size / drive.fastest for drive in scene.drives))


def segment_lengths(strip: Strip) -> np.ndarray:
    """Lengths of the segments of a flexible panel, (segments_per_panel,), m.

    The lengths are proportional to 1 + (g - 1) |2 x - 1| along the panel. For g > 1 the middle segments are g times shorter
    than the end segments.
    """
    count = strip.segments_per_panel
    middle = (np.arange(count) + 0.5) / count
    density = 1.0 + (strip.grading - 1.0) * np.abs(2.0 * middle - 1.0)
    return strip.length / strip.panels * density / density.sum()


def bending_stiffness(strip: Strip, material: Material) -> float:
    """Bending stiffness of the sheet, N m^2."""
    return material.bending(strip.width, strip.thickness)


@dataclass(frozen=True)
class _Segment:
    """Segment during the construction of a strip: name of its body, length, number of its panel (from 0), and whether it is
    held.
    """

    name: str
    length: float
    panel: int
    held: bool


class _StripBuilder:
    def __init__(self, case: Case, strip: Strip, material: Material, crease: Crease, damping: float) -> None:
        self.case, self.strip, self.material, self.crease, self.damping = case, strip, material, crease, damping
        if isinstance(crease, FamilyCrease):
            raise CaseError(Fault("crease.file", UNREAD))
        self.held = case.held_panels
        self.area = strip.width * strip.thickness
        self.bending = bending_stiffness(strip, material)
        if not 0.0 < self.bending < math.inf:
            text = f"bending stiffness E w t^3/12 is {self.bending:g} N m^2; check young, width and thickness"
            raise CaseError(Fault("strip.thickness", text))
        largest = max(strip.length, strip.width)
        inertia = material.density * self.area * strip.length * largest * largest / 6
        if not 0.0 < inertia < math.inf:
            text = f"the strip has a moment of inertia of {inertia:g} kg m^2; check length, width, thickness and density"
            raise CaseError(Fault("strip.length", text))
        self.sideways = material.young * strip.thickness * strip.width**3 / 12
        self.shear = material.young / (2 * (1 + material.poisson))
        self.panel_length = strip.length / strip.panels

    def scene(self) -> Scene:
        """Complete scene."""
        panels = [self._segments(panel) for panel in range(self.strip.panels)]
        bodies = [body for panel, segments in enumerate(panels) for body in self._bodies(panel, segments)]
        elements = [joint for segments in panels for joint in self._joints(segments)]
        lines: dict[int, Drive] = {}
        by_line = ((drive.line(self.strip.panels), drive) for drive in self.case.drive)
        driven = {line: drive for line, drive in by_line if line is not None}
        for number in range(self.strip.panels + 1):
            sides = [(panels[number - 1][-1], 1)] if number else []
            sides += [(panels[number][0], -1)] if number < self.strip.panels else []
            if all(segment.held for segment, _ in sides):
                continue
            drive = driven.get(number)
            if len(sides) == 2:
                elements.append(self._crease(number, sides[0][0], sides[1][0], drive))
            if drive is not None:
                bodies.append(self._line(number))
                elements += self._released(number, sides, drive)
                lines[number] = drive.model_copy(update={"crease": None, "end": None, "body": self._line_name(number)})
        return Scene(
            bodies=tuple(bodies),
            elements=tuple(elements),
            surfaces=tuple(
                Surface(name=f"panel {p + 1}", bodies=tuple(s.name for s in segments))
                for p, segments in enumerate(panels)
            ),
            obstacles=self.case.obstacle,
            pairs=self._pairs() + self._obstacle_pairs(),
            contact=self.case.contact,
            friction=self.case.friction,
            loads=self.case.load,
            # the drives keep the order of the case, because the force curve and its peak belong to the first drive
            drives=tuple(self._with_bodies(drive, panels, lines) for drive in self.case.drive),
            gravity=self.case.gravity,
        )

    def _with_bodies(self, drive: Drive, panels: list[list[_Segment]], lines: dict[int, Drive]) -> Drive:
        """Drive of the body of a line, of the segments of a panel, or as it is given."""
        if drive.panel is not None:
            names = tuple(segment.name for segment in panels[drive.panel - 1])
            return drive.model_copy(update={"panel": None, "bodies": names})
        line = drive.line(self.strip.panels)
        return drive if line is None else lines[line]

    def _pairs(self) -> tuple[ContactPair, ...]:
        """Contact pairs of the case; by default each panel with all others (Li and Huang: with the next panel only)."""
        if self.case.contact is None:
            return ()
        every = combinations(range(1, self.strip.panels + 1), 2)
        chosen = every if self.case.contact.pairs is None else self.case.contact.pairs
        return tuple(
            ContactPair(first=f"panel {i}", second=f"panel {j}", shared="end-start" if j == i + 1 else "chain")
            for i, j in (sorted(pair) for pair in chosen)
            if not {i, j} <= self.held
        )

    def _obstacle_pairs(self) -> tuple[ContactPair, ...]:
        """Contact pairs of every moving panel with every obstacle."""
        if self.case.contact is None:
            return ()
        moving = [panel + 1 for panel in range(self.strip.panels) if panel + 1 not in self.held]
        return tuple(
            ContactPair(first=f"panel {panel}", second=obstacle.name) for obstacle in self.case.obstacle for panel in moving
        )

    def _segments(self, panel: int) -> list[_Segment]:
        if panel + 1 in self.held:
            return [_Segment(f"panel {panel + 1}", self.panel_length, panel, True)]
        return [
            _Segment(f"panel {panel + 1} segment {k + 1}", float(length), panel, False)
            for k, length in enumerate(segment_lengths(self.strip))
        ]

    def _bodies(self, panel: int, segments: list[_Segment]) -> list[Body]:
        turn = self.strip.turn(panel)
        x, z = self.strip.crease_point(panel)
        axis = math.cos(turn), -math.sin(turn)
        bodies, at = [], 0.0
        templates: dict[float, Body] = {}  # one body is validated for each length and copied for the other segments
        for segment in segments:
            centre = at + segment.length / 2
            at += segment.length
            place = (x + axis[0] * centre, 0.0, z + axis[1] * centre)
            if segment.length not in templates:
                templates[segment.length] = self._body(panel, segment, place)
            bodies.append(templates[segment.length].model_copy(update={"name": segment.name, "position": place}))
        return bodies

    def _body(self, panel: int, segment: _Segment, place: tuple[float, float, float]) -> Body:
        turn = self.strip.turn(panel)
        mass = self.material.density * self.area * segment.length
        squares = np.array([segment.length, self.strip.width, self.strip.thickness]) ** 2
        inertia = mass / 12 * (squares.sum() - squares)
        return Body(
            name=segment.name,
            mass=mass,
            inertia=(float(inertia[0]), float(inertia[1]), float(inertia[2])),
            position=place,
            orientation=(math.cos(turn / 2), 0.0, math.sin(turn / 2), 0.0),
            held=segment.held,
            plate=Plate(length=segment.length, width=self.strip.width, thickness=self.strip.thickness),
            panel=panel + 1,
        )

    def _springs(self, distance: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Translational and rotational stiffness of a piece of the strip of the length `distance` (docs/theory.md)."""
        shear = 5 / 6 * self.shear * self.area / distance
        torsion = self.shear * self.strip.width * self.strip.thickness**3 / (3 * distance)
        return (
            (self.material.young * self.area / distance, shear, shear),
            (torsion, self.bending / distance, self.sideways / distance),
        )

    def _damped(self, stiffness: tuple[float, float, float]) -> tuple[float, float, float]:
        beta = self.damping
        return beta * stiffness[0], beta * stiffness[1], beta * stiffness[2]

    def _joints(self, segments: list[_Segment]) -> Iterator[ForceElement]:
        """Springs between the segments of a panel; joints of equal lengths are validated once and copied."""
        templates: dict[tuple[float, float], ForceElement] = {}
        for inner, outer in pairwise(segments):
            lengths = inner.length, outer.length
            if lengths not in templates:
                templates[lengths] = self._joint(inner, outer)
            ends = {"name": _joint_name(inner, outer), "inner": inner.name, "outer": outer.name}
            yield templates[lengths].model_copy(update=ends)

    def _joint(self, inner: _Segment, outer: _Segment) -> ForceElement:
        translation, rotation = self._springs((inner.length + outer.length) / 2)
        return ForceElement(
            name=_joint_name(inner, outer),
            inner=inner.name,
            outer=outer.name,
            point_inner=(inner.length / 2, 0.0, 0.0),
            point_outer=(-outer.length / 2, 0.0, 0.0),
            translation=translation,
            rotation=rotation,
            translation_damping=self._damped(translation),
            rotation_damping=self._damped(rotation),
            kind="panel",
        )

    def _crease(self, number: int, inner: _Segment, outer: _Segment, drive: Drive | None) -> ForceElement:
        """Force element of a crease; with a guided drive the moment only, because half joints have the other springs."""
        distance = (self._flexible(inner) + self._flexible(outer)) / 2
        translation, rotation = self._springs(distance)
        if drive is not None and drive.guide:
            translation, rotation = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        folded = self.strip.turn(inner.panel) - self.strip.turn(outer.panel)
        side = math.copysign(1.0, folded)
        rest = abs(folded) if self.crease.rest_angle is None else self.crease.rest_angle
        flexibility = distance / self.bending if self.strip.half_cell else 0.0
        stiffness = self.crease.mean_stiffness  # of a measured curve the mean slope, which is used for the damping only
        effective = stiffness / (1 + stiffness * flexibility)
        linear = isinstance(self.crease, LinearCrease)
        return ForceElement(
            name=f"crease {number}",
            inner=inner.name,
            outer=outer.name,
            point_inner=(inner.length / 2, 0.0, 0.0),
            point_outer=(-outer.length / 2, 0.0, 0.0),
            translation=translation,
            rotation=(rotation[0], stiffness if linear else 0.0, rotation[2]),
            translation_damping=self._damped(translation),
            rotation_damping=self._damped((rotation[0], effective, rotation[2])),
            rest_angle=side * rest,
            initial_angle=folded,
            crease=None if linear else self.crease,
            crease_flexibility=flexibility if not linear or stiffness else 0.0,
            kind="crease",
        )

    def _released(self, number: int, sides: list[tuple[_Segment, int]], drive: Drive) -> list[ForceElement]:
        """Half joints at a driven line. If a step releases the drive, half joints act until then, and the springs of a free
        crease act afterwards; an end of the strip is then free.
        """
        half_joints = self._half_joints(number, sides, drive)
        at = releases(self.case, drive.called)
        if at is None:
            return half_joints
        before, since = steps_from(self.case, at)
        half_joints = [joint.model_copy(update={"steps": before}) for joint in half_joints]
        if not drive.guide or len(sides) < 2:
            return half_joints
        joints = self._crease(number, sides[0][0], sides[1][0], None)
        twist = {"rotation": (joints.rotation[0], 0.0, joints.rotation[2]), "crease": None, "crease_flexibility": 0.0}
        damping = (joints.rotation_damping[0], 0.0, joints.rotation_damping[2])
        more = {"name": f"crease {number}, released", "rotation_damping": damping, "steps": since, "kind": "drive"}
        return [*half_joints, joints.model_copy(update=twist | more)]

    def _flexible(self, segment: _Segment) -> float:
        """Flexible length of a segment, m; zero for a held panel, which is rigid."""
        return 0.0 if segment.held else segment.length

    def _line(self, number: int) -> Body:
        x, z = self.strip.crease_point(number)
        return Body(name=self._line_name(number), mass=0.0, inertia=(0.0, 0.0, 0.0), position=(x, 0.0, z))

    def _line_name(self, number: int) -> str:
        return {0: "first end", self.strip.panels: "last end"}.get(number, f"crease {number}")

    def _half_joints(self, number: int, sides: list[tuple[_Segment, int]], drive: Drive) -> list[ForceElement]:
        """Half joints from a driven line to the segment on each side, which has its end (1) or its start (-1) there.

        With a guide, a segment can only rotate about the line. Without a guide, the half joint acts along the direction of
        the drive only.
        """
        elements = []
        for segment, end in sides:
            if segment.held:
                continue
            translation, rotation = self._springs(segment.length / 2)
            line, body = self._line_name(number), segment.name
            point = (end * segment.length / 2, 0.0, 0.0)
            if drive.guide:
                turn = self.strip.turn(segment.panel)
                rotation = (rotation[0], 0.0, rotation[2])
                elements.append(
                    ForceElement(
                        name=f"{line} - {body}",
                        inner=line,
                        outer=body,
                        point_outer=point,
                        axes_inner=(math.cos(turn / 2), 0.0, math.sin(turn / 2), 0.0),
                        translation=translation,
                        rotation=rotation,
                        translation_damping=self._damped(translation),
                        rotation_damping=self._damped(rotation),
                        kind="drive",
                    )
                )
            else:
                along = (translation[0], 0.0, 0.0)
                elements.append(
                    ForceElement(
                        name=f"{line} - {body}",
                        inner=body,
                        outer=line,
                        point_inner=point,
                        axes_outer=_turned_to(drive.direction),
                        translation=along,
                        translation_damping=self._damped(along),
                        kind="drive",
                    )
                )
        return elements


def _joint_name(inner: _Segment, outer: _Segment) -> str:
    return f"joint {inner.name} - {outer.name}"


def _turned_to(direction: tuple[float, float, float]) -> tuple[float, float, float, float]:
    """Quaternion whose x axis points along a direction."""
    unit = np.array(direction) / np.linalg.norm(direction)
    if unit[0] < -1 + 1e-12:
        return (0.0, 0.0, 1.0, 0.0)
    quaternion = np.array([1 + unit[0], 0.0, -unit[2], unit[1]])
    quaternion /= np.linalg.norm(quaternion)
    return (float(quaternion[0]), float(quaternion[1]), float(quaternion[2]), float(quaternion[3]))
