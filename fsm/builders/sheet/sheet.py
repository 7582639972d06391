"""Scene of a folded sheet: facets are rigid bodies, and creases and bend lines are force elements (docs/sheets.md)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fsm.builders.patterns.cuts import FacetFrames, facet_frames, facets_across_cuts, quaternions
from fsm.builders.patterns.of_sheet import Place, pattern_of, place_of
from fsm.builders.sheet.flexible_sheet import build_flexible
from fsm.builders.sheet.sheet_gas import with_gas_of_panels
from fsm.builders.sheet.sheet_joints import (
    SheetJoint,
    crease_damping,
    crease_of_length,
    fold_turn,
    is_motion,
    rest_angle,
    sheet_joints,
    time_of_folding,
)
from fsm.builders.sheet.sheet_loads import check_supports, facet_name, facets_of_vertices, placed_loads, vertex_name
from fsm.case.models.case import Case
from fsm.case.models.flexible_facets import SHEET
from fsm.case.models.loads import Drive
from fsm.case.models.materials import SplineCrease
from fsm.case.models.scene import DIRECTIONS, GROUND, Body, ContactPair, ForceElement, Plate, PlateGroup, Scene
from fsm.case.models.sheet import Sheet
from fsm.case.models.time_program import Ramp
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError, Fault, fault_at

_HINGE = tuple(name for name in DIRECTIONS if name != "psi")
"""Locked directions of a crease."""
RIGID = 1e7
"""Stiffness of the joints of rigid facets, relative to the stiffest crease k: k over its length squared in translation, k
in rotation across the crease. In statics the joints are locked, and this is their penalty: round-off of the forces is
proportional to it. In motions the flexibility of the joints causes an error in inverse proportion to it; implicit steps do
not become shorter with it."""


RIGID_OF_FOLDING = 1e6
"""`RIGID` of a sheet that folds itself, and of a sheet without loops of facets. Softer joints cause less round-off, which
can hide the sign of a small pivot; the joints of a chain of facets do not act against each other, and a long chain is soft
as a whole."""


def rigid_factor(case: Case, pattern: Pattern) -> float:
    """Stiffness of rigid joints relative to the stiffest crease."""
    folds = case.sheet is not None and case.sheet.fold_to is not None
    return RIGID if has_loops(pattern) and not folds else RIGID_OF_FOLDING


def has_loops(pattern: Pattern) -> bool:
    """Whether facets form loops. The joints of a chain of facets are springs also in statics: a free chain that becomes
    straight stops suddenly, which only a spring resists gradually.
    """
    return int((pattern.edge_faces >= 0).all(axis=1).sum()) >= len(pattern.faces)


def build_sheet(case: Case) -> Scene:
    """Scene of the sheet of a case.

    Raises
    ------
    CaseError
        The pattern, a place or the crease law is faulty.
    """
    assert case.sheet is not None
    if case.sheet.facets == "flexible":
        return build_flexible(case)
    pattern = pattern_of(case.sheet)
    scene = _SheetBuilder(case, case.sheet, pattern).scene()
    check_supports(case, pattern)
    return scene


def vertex_springs(
    pattern: Pattern, vertices: Iterable[int], body: str, at: np.ndarray, stiffness: float, drive: Drive
) -> list[ForceElement]:
    """Springs between frames at vertices and a driven body at a point. The springs act in all directions, or along the drive
    only.
    """
    turn = np.eye(3) if drive.guide else _axes_along(np.array(drive.direction) / np.linalg.norm(drive.direction))
    axes = tuple(quaternions(turn[None])[0].tolist())
    return [
        ForceElement(
            name=f"{body}, {vertex_name(vertex)}", inner=vertex_name(vertex), outer=body, axes_inner=axes, axes_outer=axes,
            point_outer=_triple(pattern.vertices[vertex] - at),
            translation=(stiffness,) * 3 if drive.guide else (stiffness, 0.0, 0.0),
        )
        for vertex in vertices
    ]  # fmt: skip


@dataclass(frozen=True)
class _SheetBuilder:
    case: Case
    sheet: Sheet
    pattern: Pattern

    def scene(self) -> Scene:
        """Complete scene."""
        case, frames = self.case, facet_frames(self.pattern)
        joints = sheet_joints(case, self.pattern)
        rigid = rigid_factor(self.case, self.pattern)
        reference = max((joint.stiffness for joint in joints), default=0.0)
        assert case.material is not None
        if not reference:  # if creases have no stiffness, the bending stiffness of the sheet is the reference
            reference = case.material.young * self.sheet.thickness * self.pattern.extent() ** 2 / rigid
        attach = _Attachment(self.pattern, frames, rigid * reference / float(np.median(self.pattern.lengths)) ** 2)
        held, elements = self._supports(attach)
        lines: list[Body] = []
        drives: list[Drive] = []
        for number, drive in enumerate(case.drive):
            drives.append(self._drive(attach, f"drive.{number}", drive, lines, elements))
        scene = Scene(
            bodies=(*self._bodies(frames, held), *lines),
            elements=(*self._joints(frames, joints, reference), *elements),
            **self._contact(frames, joints),
            loads=placed_loads(case, case.load),
            drives=tuple(drives),
            gravity=case.gravity,
        )
        if not has_loops(self.pattern):
            elements_of_chain = tuple(element.model_copy(update={"locked": ()}) for element in scene.elements)
            scene = scene.model_copy(update={"elements": elements_of_chain})
        scene = scene.with_parts(across_cuts=facets_across_cuts(self.pattern))
        return with_gas_of_panels(case, scene, self.pattern, frames, self._held_vertices(held))

    def _held_vertices(self, facets: set[int]) -> dict[int, set[int]]:
        """Components (0, 1, 2) along which supports hold vertices."""
        found = {vertex: {0, 1, 2} for facet in facets for vertex in self.pattern.faces[facet]}
        for number, support in enumerate(self.sheet.support):
            place = sheet_place(self.pattern, support.at, f"sheet.support.{number}.at")
            for vertex in place.vertices if place.facet is None else ():
                found[vertex] = found.get(vertex, set()) | {"xyz".index(axis) for axis in support.fixed}
        return found

    def _contact(self, frames: FacetFrames, joints: list[SheetJoint]) -> dict[str, Any]:
        """Contact of facets with all other facets and obstacles. The stiffness belongs to a facet of mean size."""
        case = self.case
        if case.contact is None:
            return {}
        facets = len(frames.outlines) - sum(joint.kind == "bend line" for joint in joints)
        names = tuple(facet_name(number) for number in range(len(frames.outlines)))
        group = PlateGroup(name=SHEET, bodies=names, face=float(frames.area.sum()) / facets)
        pairs = [ContactPair(first=SHEET, second=name) for name in (SHEET, *(o.name for o in case.obstacle))]
        return {
            "groups": (group,), "pairs": tuple(pairs), "obstacles": case.obstacle, "contact": case.contact,
            "friction": case.friction,
        }  # fmt: skip

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
        lengths, start = pattern.lengths, pattern.start_angles()
        middle = pattern.vertices[pattern.edges].mean(axis=1)
        along = np.diff(pattern.vertices[pattern.edges], axis=1)[:, 0] / lengths[:, None]
        edges = [joint.edge for joint in joints]
        faces = pattern.edge_faces[edges]
        points = [frames.local(faces[:, k], middle[edges]) for k in (0, 1)]
        axes = [_hinge_axes(frames, faces[:, k], along[edges]) for k in (0, 1)]
        end, rigid, beta = time_of_folding(self.case), rigid_factor(self.case, self.pattern), crease_damping(self.case)
        driven = None if end is None else Ramp(kind="ramp", start=0.0, end=end, shape="linear")
        in_joint = beta if is_motion(self.case) else 0.0  # dampers of rigid joints delay statics without a benefit
        template: ForceElement | None = None
        for row, joint in enumerate(joints):
            length, angle = float(lengths[joint.edge]), float(start[joint.edge])
            stiff = rigid * reference
            translation = (stiff / length**2,) * 3
            measured = joint.kind == "crease" and isinstance(crease, SplineCrease)
            twist = stiff if joint.kind == "rigid" else 0.0 if measured else joint.stiffness
            element: dict[str, Any] = {
                "name": joint.name,
                "inner": facet_name(int(faces[row, 0])), "outer": facet_name(int(faces[row, 1])),
                "point_inner": _triple(points[0][row]), "point_outer": _triple(points[1][row]),
                "axes_inner": tuple(axes[0][row].tolist()), "axes_outer": tuple(axes[1][row].tolist()),
                "translation": translation, "rotation": (stiff, twist, stiff),
                "translation_damping": (in_joint * stiff / length**2,) * 3,
                "rotation_damping": (in_joint * stiff, beta * joint.stiffness, in_joint * stiff),
                "initial_angle": angle, "rest_angle": rest_angle(self.case, pattern, joint, angle), "swing_axes": "outer",
                "rest_turn": fold_turn(self.case, pattern, joint, angle), "rest_time": driven,
                "crease": crease_of_length(crease, length) if measured else None,
                "locked": DIRECTIONS if joint.kind == "rigid" else _HINGE,
                "kind": "crease" if joint.kind == "crease" else "panel",
            }  # fmt: skip
            template = ForceElement(**element) if template is None else template.model_copy(update=element)
            yield template

    # supports and drives --------------------------------------------------------------------------------------------

    def _supports(self, attach: _Attachment) -> tuple[set[int], list[ForceElement]]:
        """Held facets, and springs between supported vertices and the ground."""
        held: set[int] = set()
        elements: list[ForceElement] = []
        for number, support in enumerate(self.sheet.support):
            path = f"sheet.support.{number}"
            place = sheet_place(self.pattern, support.at, f"{path}.at")
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
        place = sheet_place(self.pattern, at, f"{path}.edge" if drive.edge is not None else f"{path}.at")
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
        """Each vertex has one spring. The axes of a spring are the axes of the body; if a direction is given, the first axis
        is along it.
        """
        facets = facets_of_vertices(self.pattern)
        turn = np.eye(3) if along is None else _axes_along(along)
        faces = np.array([facets[vertex] for vertex in place.vertices], dtype=np.int64)
        points = self.pattern.vertices[list(place.vertices)]
        inner = quaternions(self.frames.axes[faces].transpose(0, 2, 1) @ turn)
        on_facets, axes = self.frames.local(faces, points), tuple(quaternions(turn[None])[0].tolist())
        template = ForceElement(
            name=name, inner=body, outer=body, axes_outer=axes, translation=(stiffness[0], stiffness[1], stiffness[2]),
            locked=tuple(name for name, size in zip(DIRECTIONS, stiffness, strict=False) if size),
            kind="joint" if body == GROUND else "drive",
        )  # fmt: skip
        return [
            template.model_copy(
                update={
                    "name": f"{name}, vertex {vertex + 1}", "inner": facet_name(face), "axes_inner": tuple(turned),
                    "point_inner": _triple(own), "point_outer": _triple(point - at),
                }
            )
            for vertex, face, turned, own, point in zip(
                place.vertices, faces.tolist(), inner.tolist(), on_facets, points, strict=True
            )
        ]  # fmt: skip


def sheet_place(pattern: Pattern, at: object, path: str) -> Place:
    """Place of a sheet; if there is no such place, an error with the path of the key."""
    with fault_at(path):
        return place_of(pattern, at)  # type: ignore[arg-type]


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


def _triple(vector: np.ndarray) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
