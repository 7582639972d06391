"""Scene of a folded sheet: facets are rigid bodies, and creases and bend lines are force elements (docs/sheets.md)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fsm.errors import CaseError, Fault
from fsm.scene.case import Case
from fsm.scene.loads import Drive
from fsm.scene.materials import DAMPING, UNREAD, LinearCrease, SplineCrease
from fsm.scene.patterns.facets import FacetFrames, facet_frames, quaternions
from fsm.scene.patterns.of_sheet import bend_stiffness_per_length, pattern_of
from fsm.scene.patterns.pattern import Pattern
from fsm.scene.patterns.places import Place, place_of
from fsm.scene.scene import GROUND, Body, ForceElement, Plate, Scene
from fsm.scene.sheet import Sheet
from fsm.scene.time_program import Ramp, TimeFunction

__all__ = ["RIGID", "build_sheet", "facet_name", "is_motion", "rigid_factor", "sheet_joints"]

RIGID = 3e8
"""Stiffness of the joints of rigid facets, relative to the stiffest crease k: k over its length squared in translation, k
in rotation across the crease. Its flexibility causes an error of the force in inverse proportion, and round-off one in
proportion; docs/sheets.md has both for a Miura sheet."""


_CLOSED = 1e-3
"""Distance of a fold angle from 180 degrees below which a crease is closed, rad."""
_DAMPING_OF_FOLDING = 1e-2
"""Ratio of the default Kelvin-Voigt time to the time in which a sheet folds itself; the fold angles lag by this part."""


RIGID_OF_FOLDING = 1e6
"""`RIGID` of a sheet that folds itself: softer joints have less round-off, which can hide the sign of a soft pivot."""


RIGID_OF_MOTION = 1e5
"""`RIGID` of a motion with inertia, whose steps depend on the frequencies of the joints."""


def rigid_factor(case: Case) -> float:
    """Stiffness of rigid joints relative to the stiffest crease."""
    if is_motion(case):
        return RIGID_OF_MOTION
    return RIGID if case.sheet is None or case.sheet.fold_to is None else RIGID_OF_FOLDING


def is_motion(case: Case) -> bool:
    """Whether a sheet moves with inertia: a dynamic method, or no drive and no folding."""
    folds = case.sheet is not None and case.sheet.fold_to is not None
    chosen = case.solve.method
    return chosen not in ("auto", "static", "arc-length") or (chosen == "auto" and not case.drive and not folds)


def facet_name(number: int) -> str:
    """Name of the body of a facet; facets are numbered from 0 here, and from 1 in names."""
    return f"facet {number + 1}"


class SheetJoint(NamedTuple):
    """Joint of two facets along an edge.

    Attributes
    ----------
    edge : number of the edge in the pattern
    kind : "crease", "bend line" or "rigid"
    stiffness : N m/rad, of the whole edge; for a measured curve its mean slope
    """

    edge: int
    kind: str
    stiffness: float


def build_sheet(case: Case) -> Scene:
    """Scene of the sheet of a case.

    Raises
    ------
    CaseError
        The pattern, a place or the crease law is faulty.
    """
    assert case.sheet is not None
    pattern = pattern_of(case.sheet)
    return _SheetBuilder(case, case.sheet, pattern).scene()


def sheet_joints(case: Case, pattern: Pattern) -> list[SheetJoint]:
    """Joints of the facets of a sheet, in the order of the edges.

    Raises
    ------
    CaseError
        The crease law has no stiffness per length.
    """
    assert case.sheet is not None
    lengths = pattern.lengths
    per_length = _crease_per_length(case)
    found = []
    for edge in pattern.creases.tolist():
        letter, length = pattern.assignment[edge], float(lengths[edge])
        if letter in "MVU":
            found.append(SheetJoint(edge, "crease", per_length * length))
        elif case.sheet.facets == "bend-lines":
            found.append(SheetJoint(edge, "bend line", bend_stiffness_per_length(case, length) * length))
        else:
            found.append(SheetJoint(edge, "rigid", 0.0))
    return found


def _crease_per_length(case: Case) -> float:
    """Stiffness of creases over their length, N m/rad per m; for a measured curve its mean slope."""
    crease = case.crease
    if isinstance(crease, LinearCrease):
        if crease.stiffness_per_length is None:
            text = f"{crease.stiffness:g} N m/rad is of a whole strip; give crease.stiffness_per_length (N m/rad per m)"
            raise CaseError(Fault("crease.stiffness", text))
        return crease.stiffness_per_length
    if not isinstance(crease, SplineCrease):
        raise CaseError(Fault("crease.file", UNREAD))
    if crease.width is None:
        text = "missing; a sheet needs the width of the tested crease, to scale the moment with the length of a crease"
        raise CaseError(Fault("crease.width", text))
    angle, moment = crease.angle, crease.moment
    assert angle is not None and moment is not None
    return crease.scale * abs(moment[-1] - moment[0]) / (angle[-1] - angle[0]) / crease.width


@dataclass(frozen=True)
class _SheetBuilder:
    case: Case
    sheet: Sheet
    pattern: Pattern

    def scene(self) -> Scene:
        """Complete scene."""
        case, frames = self.case, facet_frames(self.pattern)
        joints = sheet_joints(case, self.pattern)
        rigid = rigid_factor(self.case)
        reference = max((joint.stiffness for joint in joints), default=0.0)
        assert case.material is not None
        if not reference:  # creases without stiffness: joints are as stiff as the sheet
            reference = case.material.young * self.sheet.thickness * self.pattern.extent() ** 2 / rigid
        attach = _Attachment(self.pattern, frames, rigid * reference / float(np.median(self.pattern.lengths)) ** 2)
        held, elements = self._supports(attach)
        lines: list[Body] = []
        drives: list[Drive] = []
        for number, drive in enumerate(case.drive):
            drives.append(self._drive(attach, f"drive.{number}", drive, lines, elements))
        return Scene(
            bodies=(*self._bodies(frames, held), *lines),
            elements=(*self._joints(frames, joints, reference), *elements),
            loads=case.load,
            drives=tuple(drives),
            gravity=case.gravity,
        )

    def _bodies(self, frames: FacetFrames, held: set[int]) -> Iterator[Body]:
        assert self.case.material is not None
        areal = self.case.material.density * self.sheet.thickness
        template: Body | None = None
        turns = quaternions(frames.axes)
        for number, outline in enumerate(frames.outlines):
            mass = areal * float(frames.area[number])
            across = mass * self.sheet.thickness**2 / 12.0
            first, second = (areal * float(moment) + across for moment in frames.moments[number])
            sides = np.ptp(outline, axis=0)
            body: dict[str, Any] = {
                "name": facet_name(number), "mass": mass, "inertia": (first, second, first + second - 2.0 * across),
                "position": _triple(frames.centre[number]), "orientation": tuple(turns[number].tolist()),
                "held": number in held,
                "plate": Plate(
                    length=float(sides[0]), width=float(sides[1]), thickness=self.sheet.thickness,
                    outline=tuple((float(x), float(y)) for x, y in outline),
                ),
            }  # fmt: skip
            template = Body(**body) if template is None else template.model_copy(update=body)
            yield template

    def _joints(self, frames: FacetFrames, joints: list[SheetJoint], reference: float) -> Iterator[ForceElement]:
        """Force elements of creases, bend lines and rigid joints."""
        pattern, crease = self.pattern, self.case.crease
        lengths, start = pattern.lengths, pattern.fold_angles()
        closed = np.abs(start) > math.pi - _CLOSED  # the positions do not give the sign of a closed crease
        start = np.where(closed, np.copysign(start, np.nan_to_num(pattern.target)), start)
        middle = pattern.vertices[pattern.edges].mean(axis=1)
        along = np.diff(pattern.vertices[pattern.edges], axis=1)[:, 0] / lengths[:, None]
        edges = [joint.edge for joint in joints]
        faces = pattern.edge_faces[edges]
        points = [frames.local(faces[:, k], middle[edges]) for k in (0, 1)]
        axes = [_hinge_axes(frames, faces[:, k], along[edges]) for k in (0, 1)]
        driven, rigid, beta = self._folding(), rigid_factor(self.case), self._damping()
        in_joint = beta if is_motion(self.case) else 0.0  # dampers of rigid joints delay statics without a benefit
        template: ForceElement | None = None
        numbers = {"crease": 0, "bend line": 0, "rigid": 0}
        for row, joint in enumerate(joints):
            numbers[joint.kind] += 1
            length, angle = float(lengths[joint.edge]), float(start[joint.edge])
            stiff = rigid * reference
            translation = (stiff / length**2,) * 3
            measured = joint.kind == "crease" and isinstance(crease, SplineCrease)
            twist = stiff if joint.kind == "rigid" else 0.0 if measured else joint.stiffness
            element: dict[str, Any] = {
                "name": f"{joint.kind if joint.kind != 'rigid' else 'joint'} {numbers[joint.kind]}",
                "inner": facet_name(int(faces[row, 0])), "outer": facet_name(int(faces[row, 1])),
                "point_inner": _triple(points[0][row]), "point_outer": _triple(points[1][row]),
                "axes_inner": tuple(axes[0][row].tolist()), "axes_outer": tuple(axes[1][row].tolist()),
                "translation": translation, "rotation": (stiff, twist, stiff),
                "translation_damping": (in_joint * stiff / length**2,) * 3,
                "rotation_damping": (in_joint * stiff, beta * joint.stiffness, in_joint * stiff),
                "initial_angle": angle, "rest_angle": self._rest(joint, angle), "swing_axes": "outer",
                "rest_turn": self._turn(joint, angle) if driven is not None else 0.0, "rest_time": driven,
                "crease": _of_length(crease, length) if measured else None,
                "kind": "crease" if joint.kind == "crease" else "panel",
            }  # fmt: skip
            template = ForceElement(**element) if template is None else template.model_copy(update=element)
            yield template

    def _damping(self) -> float:
        """Kelvin-Voigt time of creases and bend lines, s: as given, else a part of the time of folding."""
        assert self.case.material is not None
        given = self.case.material.damping
        if given is not None:
            return given
        if is_motion(self.case):
            return DAMPING
        return _DAMPING_OF_FOLDING * (self.case.solve.end_time or 0.0) if self.sheet.fold_to is not None else 0.0

    def _rest(self, joint: SheetJoint, angle: float) -> float:
        """Angle of a joint without moment: as folded, unless the crease law gives it; bend lines are flat."""
        crease = self.case.crease
        if joint.kind != "crease":
            return 0.0 if joint.kind == "bend line" else angle
        if crease is None or crease.rest_angle is None:
            return angle
        side = {"M": -1.0, "V": 1.0}.get(self.pattern.assignment[joint.edge], math.copysign(1.0, angle))
        return side * crease.rest_angle

    def _folding(self) -> TimeFunction | None:
        """Function of time of the rest angles, from 0 to 1 at the end of the run; None if they do not move."""
        if self.sheet.fold_to is None:
            return None
        if not isinstance(self.case.crease, LinearCrease):
            text = "is used with a linear crease law only; give crease.stiffness_per_length"
            raise CaseError(Fault("sheet.fold_to", text))
        if self.case.solve.end_time is None:
            raise CaseError(Fault("solve.end_time", "missing; the rest angles move until this time with sheet.fold_to"))
        return Ramp(kind="ramp", start=0.0, end=self.case.solve.end_time, shape="linear")

    def _turn(self, joint: SheetJoint, angle: float) -> float:
        """Change of the rest angle of a crease until the end of the run."""
        if joint.kind != "crease" or self.pattern.assignment[joint.edge] == "U":
            return 0.0
        return (self.sheet.fold_to or 0.0) * float(self.pattern.target[joint.edge]) - self._rest(joint, angle)

    # supports and drives --------------------------------------------------------------------------------------------

    def _supports(self, attach: _Attachment) -> tuple[set[int], list[ForceElement]]:
        """Held facets, and springs between supported vertices and the ground."""
        held: set[int] = set()
        elements: list[ForceElement] = []
        for number, support in enumerate(self.sheet.support):
            path = f"sheet.support.{number}"
            place = _place(self.pattern, support.at, f"{path}.at")
            stiff = tuple(attach.stiffness if axis in support.fixed else 0.0 for axis in "xyz")
            if place.facet is None:
                elements += attach.elements(place, GROUND, np.zeros(3), stiff, f"support {number + 1}")
            elif all(stiff):
                held.add(place.facet)
            else:
                text = f'of {place.name} must be ["x", "y", "z"], because a facet is held as a whole; give vertices instead'
                raise CaseError(Fault(f"{path}.fixed", text))
        return held, elements

    def _drive(
        self, attach: _Attachment, path: str, drive: Drive, lines: list[Body], elements: list[ForceElement]
    ) -> Drive:
        """Drive of a massless body that springs join to the vertices of the place."""
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        if at is None:
            return drive
        place = _place(self.pattern, at, f"{path}.edge" if drive.edge is not None else f"{path}.at")
        name = place.name
        if place.facet is None:
            centre = self.pattern.vertices[list(place.vertices)].mean(axis=0)
            lines.append(Body(name=name, mass=0.0, inertia=(0.0, 0.0, 0.0), position=_triple(centre)))
            k = attach.stiffness
            along = None if drive.guide else np.array(drive.direction) / np.linalg.norm(drive.direction)
            elements += attach.elements(place, name, centre, (k, k, k) if along is None else (k, 0.0, 0.0), name, along)
        return drive.model_copy(update={"edge": None, "at": None, "body": name, "guide": True})


class _Attachment(NamedTuple):
    """Springs between vertices of facets and another body."""

    pattern: Pattern
    frames: FacetFrames
    stiffness: float

    def elements(
        self,
        place: Place,
        body: str,
        at: np.ndarray,
        stiffness: tuple[float, ...],
        name: str,
        along: np.ndarray | None = None,
    ) -> list[ForceElement]:
        """One spring for each vertex; its axes are those of the body, with the first along a direction if it is given."""
        found = []
        facets = {vertex: face for face, vertices in reversed(list(enumerate(self.pattern.faces))) for vertex in vertices}
        turn = np.eye(3) if along is None else _axes_along(along)
        for vertex in place.vertices:
            face, point = facets[vertex], self.pattern.vertices[vertex]
            inner = quaternions((self.frames.axes[face].T @ turn)[None])[0]
            found.append(
                ForceElement(
                    name=f"{name}, vertex {vertex + 1}",
                    inner=facet_name(face),
                    outer=body,
                    point_inner=_triple(self.frames.local(np.array([face]), point[None])[0]),
                    point_outer=_triple(point - at),
                    axes_inner=tuple(inner.tolist()),
                    axes_outer=tuple(quaternions(turn[None])[0].tolist()),
                    translation=(stiffness[0], stiffness[1], stiffness[2]),
                )
            )
        return found


def _place(pattern: Pattern, at: object, path: str) -> Place:
    try:
        return place_of(pattern, at)  # type: ignore[arg-type]
    except ValueError as error:
        raise CaseError(Fault(path, str(error))) from None


def _hinge_axes(frames: FacetFrames, faces: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Quaternions of the joint axes in the axes of facets: e2 along the crease, e3 normal to the facet."""
    normal = frames.axes[faces][:, :, 2]
    axes = np.stack([np.cross(along, normal), along, normal], axis=2)
    return quaternions(np.einsum("nji,njk->nik", frames.axes[faces], axes))


def _axes_along(direction: np.ndarray) -> np.ndarray:
    """Rotation matrix whose first axis is a unit vector."""
    other = np.eye(3)[int(np.argmin(np.abs(direction)))]
    second = np.cross(direction, other)
    second /= np.linalg.norm(second)
    return np.column_stack([direction, second, np.cross(direction, second)])


def _of_length(crease: object, length: float) -> SplineCrease:
    """Measured moment curve, scaled to the length of a crease."""
    assert isinstance(crease, SplineCrease) and crease.width is not None
    return crease.model_copy(update={"scale": crease.scale * length / crease.width, "rest_angle": None})


def _triple(vector: np.ndarray) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
