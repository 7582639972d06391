"""Scene of a sheet with flexible facets: mesh, supports of nodes, loads and drives at frames of the mesh.

Contact of the nodes of a sheet with the sheet itself and with every obstacle.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fsm.builders.patterns.chamber import SheetSurface
from fsm.builders.patterns.cuts import facets_across_cuts, quaternions
from fsm.builders.patterns.mesh_places import MeshPlace, mesh_place, mirrored_place
from fsm.builders.patterns.of_sheet import flexible_mesh, pattern_of
from fsm.builders.patterns.plates import seam_angle
from fsm.builders.sheet.beside_sheet import frame_on_sheet
from fsm.builders.sheet.sheet_gas import with_gas
from fsm.builders.sheet.sheet_joints import Folds, facet_damping, sheet_joints
from fsm.builders.sheet.sheet_loads import load_parts, place_points, pressed_facets
from fsm.case.derived.frame_bodies import quaternion_matrix
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import FacetMesh, MeshPoint
from fsm.case.models.flexible import SceneFrame
from fsm.case.models.flexible_facets import SHEET, FlexibleFacets, FoldData
from fsm.case.models.laminate import Laminate, laminate_of
from fsm.case.models.loads import Drive, Load
from fsm.case.models.scene import Body, ContactPair, ForceElement, Scene
from fsm.case.models.sheet import Sheet
from fsm.case.models.sheet_parts import Box, SheetSupport
from fsm.case.models.time_program import Ramp
from fsm.case.models.touching import TouchingSheet
from fsm.case.plan.step_items import releases, steps_from
from fsm.errors import CaseError, Fault, fault_at


def contact_of_nodes(case: Case) -> dict[str, Any]:
    """Contact keys of the scene of a sheet of flexible facets or bars.

    Raises
    ------
    CaseError
        The friction depends on directions in a facet.
    """
    if case.contact is None:
        return {}
    if case.friction is not None and case.friction.across != 1.0:
        text = f"{case.friction.across:g} is not available with the nodes of a sheet, which have no axes; give 1"
        raise CaseError(Fault("friction.across", text))
    pairs = [ContactPair(first=SHEET, second=name) for name in (SHEET, *(obstacle.name for obstacle in case.obstacle))]
    return {"pairs": tuple(pairs), "contact": case.contact, "friction": case.friction, "obstacles": case.obstacle}


_DRIVEN = 1e3
"""Total stiffness of the springs between a driven place and its nodes, relative to E t."""
_JOINED = 100.0
"""Stiffness per length of joints that do not fold, relative to the bending stiffness of a cell beside them."""
_SYMMETRIC = 1e-9
"""Coupling of stretch and bending, relative to the stiffness in stretch times the thickness, below which the coupling
is round-off."""
_AXIS = 1.0 - 1e-9
"""Cosine of the angle between two directions above which they count as one direction."""


def build_flexible(case: Case) -> Scene:
    """Scene of a sheet with flexible facets.

    Raises
    ------
    CaseError
        The pattern or a place is faulty.
    """
    assert case.sheet is not None and case.material is not None
    material = case.material
    thickness, mesh = case.sheet.thickness, flexible_mesh(case.sheet)
    facets = FlexibleFacets(
        mesh, material.young, material.poisson, material.density, thickness,
        facet_damping(case), _folds(case, mesh), laminate=_laminate(case),
        rounding=case.sheet.film_rounding if case.sheet.film == "tension-field" else None,
    )  # fmt: skip
    return _FlexibleBuilder(case, case.sheet, facets).scene()


def _laminate(case: Case) -> Laminate | None:
    """Stiffness of the plies of a sheet; None without plies."""
    assert case.sheet is not None and case.material is not None
    plies = case.sheet.ply
    if not plies:
        return None
    if not case.sheet.is_shell and pattern_of(case.sheet).flat is None:
        text = "the angles of plies need a flat pattern, and this sheet has none; remove `ply`, or give the flat pattern"
        raise CaseError(Fault("sheet.ply", text))
    found = laminate_of(plies, case.material.density)
    largest = float(np.abs(found.coupling).max())
    if largest > _SYMMETRIC * float(np.abs(found.stretch).max()) * case.sheet.thickness:
        text = (
            f"the plies are not symmetric about the middle surface: bending is coupled with stretch by {largest:.4g} N, and "
            "only laminates without this coupling are available; give plies of a symmetric laminate"
        )
        raise CaseError(Fault("sheet.ply", text))
    return found


@dataclass
class _FlexibleBuilder:
    case: Case
    sheet: Sheet
    facets: FlexibleFacets
    frames: list[SceneFrame] = field(default_factory=list)
    bodies: list[Body] = field(default_factory=list)
    elements: list[ForceElement] = field(default_factory=list)

    def scene(self) -> Scene:
        """Complete scene."""
        for number, support in enumerate(self.sheet.support):
            path = f"sheet.support.{number}"
            self._hold(support, self._place(support.at, f"{path}.at"), path)
        for number, probe in enumerate(self.sheet.probe):
            place = self._place(probe.at, f"sheet.probe.{number}.at")
            if len(place.sectors) != 1:
                text = f"{place.name} has {len(place.sectors)} nodes; give one vertex"
                raise CaseError(Fault(f"sheet.probe.{number}.at", text))
            self.facets.probes[probe.name] = self.facets.mesh.at_node(int(place.sectors[0]))
        loads = [part for number, load in enumerate(self.case.load) for part in self._load(load, f"load.{number}")]
        drives = [self._released_drive(drive, f"drive.{number}") for number, drive in enumerate(self.case.drive)]
        touching = self._touching()
        scene = Scene(
            bodies=tuple(self.bodies), frames=tuple(self.frames), elements=tuple(self.elements), loads=tuple(loads),
            drives=tuple(drives), gravity=self.case.gravity, **contact_of_nodes(self.case),
        )  # fmt: skip
        mesh = self.facets.mesh
        held = {vector // 3: axes for vector, axes in self.facets.held.items() if vector % 3 == 0}
        facet = mesh.facet
        groups = {name: tuple(mesh.owner[mesh.ends(edges)].ravel().tolist()) for name, edges in mesh.edges.items()}
        across = () if self.sheet.is_shell else facets_across_cuts(pattern_of(self.sheet))
        surface = SheetSurface(
            mesh.positions, mesh.owner[mesh.triangles], facet, held, groups, mesh.owner[mesh.vertices], across
        )
        scene = scene.with_parts(facets=self.facets, touching=touching, across_cuts=across)
        return with_gas(self.case, scene, surface)

    def _touching(self) -> TouchingSheet | None:
        """Surface for contact, with frames at all nodes."""
        if self.case.contact is None:
            return None
        mesh, facets = self.facets.mesh, self.facets
        place = np.empty(len(mesh.owner), dtype=np.int64)
        place[mesh.nodes] = np.arange(len(mesh.nodes))
        before = len(self.frames)
        for row, node in enumerate(mesh.nodes.tolist()):
            self._frame(f"node {row + 1}", mesh.at_node(node))
        return TouchingSheet(
            tuple(self.frames[before:]), mesh.positions[mesh.nodes], mesh.node_areas,
            place[mesh.owner[mesh.triangles]], mesh.facet, mesh.plane,
            float(mesh.facet_areas.mean()), facets.thickness, facets.areal_density,
        )  # fmt: skip

    def _place(self, at: str | Box, path: str) -> MeshPlace:
        with fault_at(path):
            return mesh_place(self.facets.mesh, at)

    # supports -------------------------------------------------------------------------------------------------------

    def _hold(self, support: SheetSupport, place: MeshPlace, path: str) -> None:
        """Hold the nodes of a place. On an edge the slopes along the edge are held too, so that the edge does not move
        between the nodes.
        """
        mesh, fixed = self.facets.mesh, {"xyz".index(axis) for axis in support.fixed}
        if support.mirror is not None:
            place = mirrored_place(mesh, place, support.mirror, path)
            fixed = {"xyz".index(support.mirror)}
        along = mesh.along_edges(place.edges)
        whole = place.name.startswith("facet")
        if whole and len(fixed) < 3:
            text = f'of {place.name} must be ["x", "y", "z"], because a facet is held as a whole; give vertices instead'
            raise CaseError(Fault(f"{path}.fixed", text))
        for sector in place.sectors.tolist():
            self._fix(3 * int(mesh.owner[sector]), fixed)
            slopes = along.get(sector, set())
            for slope in slopes:
                self._fix(3 * sector + 1 + slope, fixed)
            if support.mirror is not None:
                for slope in {0, 1} - slopes:
                    self._fix(3 * sector + 1 + slope, {0, 1, 2} - fixed)
            if whole:
                self._fix(3 * sector + 1, fixed)
                self._fix(3 * sector + 2, fixed)
            if support.clamped:
                normal = np.cross(*mesh.slopes[sector])
                axes = np.flatnonzero(np.abs(normal) > _AXIS * np.linalg.norm(normal))
                for slope in (0, 1):
                    self._fix(3 * sector + 1 + slope, set(axes.tolist()) or {0, 1, 2})

    def _fix(self, vector: int, components: set[int]) -> None:
        self.facets.held.setdefault(vector, set()).update(components)

    # frames ---------------------------------------------------------------------------------------------------------

    def _frame(self, name: str, point: MeshPoint) -> str:
        """Add a frame at a point of the mesh; returns its name."""
        frame, body = frame_on_sheet(self.facets.mesh.vectors, name, point)
        self.frames.append(frame)
        self.bodies.append(body)
        return name

    def _load(self, load: Load, path: str) -> Iterator[Load]:
        """Loads on the frames of a place; their sum is one load of the case."""
        if load.at is None or load.pressure is not None:
            if load.pressure is not None:
                pressed_facets(self.facets.mesh, load, path)
            yield self._in_time(load)
            return
        known = {frame.name for frame in self.frames}
        for part, point in load_parts(self.facets.mesh, load, path):
            assert part.body is not None
            if part.body not in known:
                known.add(self._frame(part.body, point))
            yield self._in_time(part)

    def _in_time(self, load: Load) -> Load:
        """Load with a ramp over the run, if the run is static and the load has no function of time."""
        method, end = self.case.solve.method, self.case.solve.end_time
        if load.time is not None or self.case.step or end is None or method not in ("static", "arc-length"):
            return load
        shape = "unbounded" if method == "arc-length" else "linear"
        return load.model_copy(update={"time": Ramp(kind="ramp", start=0.0, end=end, shape=shape)})

    def _released_drive(self, drive: Drive, path: str) -> Drive:
        """Drive whose springs act until a step releases it."""
        before = len(self.elements)
        placed = self._drive(drive, path)
        numbers = [releases(self.case, name) for name in (drive.called, placed.called)]
        ends = [number for number in numbers if number is not None]
        if ends:
            acting = {"steps": steps_from(self.case, min(ends))[0]}
            self.elements[before:] = [spring.model_copy(update=acting) for spring in self.elements[before:]]
        return placed

    def _drive(self, drive: Drive, path: str) -> Drive:
        """Drive of a massless body that springs join to the nodes of the place."""
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        if at is None:
            return drive
        place = self._place(at, f"{path}.edge" if drive.edge is not None else f"{path}.at")
        if drive.turn is not None:
            return self._turn(drive, place)
        mesh, facets = self.facets.mesh, self.facets
        x, y, z = mesh.positions[place.sectors].mean(axis=0).tolist()
        stiffness = _DRIVEN * facets.young * facets.thickness
        along = np.array(drive.direction) / np.linalg.norm(drive.direction)
        turn = (1.0, 0.0, 0.0, 0.0) if drive.guide else _turned(along)
        parts = [(self._frame(name, point), share) for name, point, share in place_points(mesh, place, place.name, False)]
        where = {body.name: body.position for body in self.bodies}
        self.bodies.append(Body(name=place.name, mass=0.0, inertia=(0.0, 0.0, 0.0), position=(x, y, z)))
        for name, share in parts:
            k = stiffness * share
            px, py, pz = where[name]
            self.elements.append(
                ForceElement(
                    name=name, inner=name, outer=place.name, point_outer=(px - x, py - y, pz - z), axes_inner=turn,
                    axes_outer=turn, translation=(k, k, k) if drive.guide else (k, 0.0, 0.0),
                )
            )  # fmt: skip
        return drive.model_copy(update={"edge": None, "at": None, "body": place.name, "guide": True})

    def _turn(self, drive: Drive, place: MeshPlace) -> Drive:
        """Turn of a place that is clamped in a rigid end: springs join the points of the place to a massless body that
        turns.

        Without a guide the end can translate. The points of the place are then joined in translation to the middle point
        only.
        """
        mesh, facets = self.facets.mesh, self.facets
        at, stiffness = mesh.positions[place.sectors], _DRIVEN * facets.young * facets.thickness
        size, extent = (float(np.ptp(of, axis=0).max()) or facets.thickness for of in (at, mesh.positions))
        # plate whose whole size is one cell
        local = stiffness * facets.thickness**2 * size / (12.0 * float(mesh.lengths.min()))
        whole = stiffness * size**3 / (12.0 * extent)  # the sheet is a beam, and the driven end is its section
        parts = [(self._frame(name, point), share) for name, point, share in place_points(mesh, place, place.name, True)]
        known = {body.name: body for body in self.bodies}
        x, y, z = at.mean(axis=0).tolist()
        known[place.name] = Body(name=place.name, mass=0.0, inertia=(0.0, 0.0, 0.0), position=(x, y, z))
        self.bodies.append(known[place.name])
        middle = parts[len(parts) // 2][0]
        for name, share in parts:
            move, turn = stiffness * share, local * share + (whole if name == middle and not drive.guide else 0.0)
            if drive.guide:
                self._join(name, known[name], known[place.name], move, turn)
                continue
            self._join(f"{name} turns", known[name], known[place.name], 0.0, turn)
            if name != middle:
                self._join(name, known[name], known[middle], move, 0.0)
        return drive.model_copy(update={"edge": None, "at": None, "body": place.name, "guide": True})

    def _join(self, name: str, inner: Body, outer: Body, move: float, turn: float) -> None:
        """Add springs (N/m, N m/rad) between the centre of a body and a point of another body; they carry no force at the
        start.
        """
        from_inner, from_outer = (quaternion_matrix(body.orientation).T for body in (inner, outer))
        apart = from_outer @ (np.array(inner.position) - np.array(outer.position))
        axes = (tuple(quaternions(turned[None])[0].tolist()) for turned in (from_inner, from_outer))
        self.elements.append(
            ForceElement(
                name=name, inner=inner.name, outer=outer.name, point_outer=tuple(apart.tolist()),
                axes_inner=next(axes), axes_outer=next(axes), translation=(move,) * 3, rotation=(turn,) * 3,
            )
        )  # fmt: skip


def _turned(along: np.ndarray) -> tuple[float, float, float, float]:
    """Quaternion that turns the x axis to a unit vector."""
    if along[0] < -0.999999:
        return 0.0, 0.0, 1.0, 0.0
    w, x, y, z = 1.0 + along[0], 0.0, -along[2], along[1]
    size = float(np.sqrt(w * w + y * y + z * z))
    return float(w / size), x, float(y / size), float(z / size)


def _folds(case: Case, mesh: FacetMesh) -> FoldData | None:
    """Folds at all nodes of creases; other joints with separate slopes are nearly rigid.

    The stiffness of these joints follows from the depth of the cells across them, because such a joint stands beside the
    bending of these cells.
    """
    assert case.sheet is not None and case.material is not None
    plate = case.material.young * case.sheet.thickness**3 / (12.0 * (1.0 - case.material.poisson**2))
    if case.sheet.is_shell:  # only a lenticular boom has such joints; its seams are rigid
        if not mesh.creases:
            return None
        angles = np.concatenate([np.full(len(seam.lengths), seam_angle(case.sheet)) for seam in mesh.creases])
        stiffness = np.concatenate([_JOINED * plate / mesh.depth(seam) * seam.lengths for seam in mesh.creases])
        return FoldData.linear(stiffness, angles, angles)
    coarse = pattern_of(case.sheet)
    joints = {joint.edge: joint for joint in sheet_joints(case, coarse)}
    start = coarse.with_bend_lines(most=4).start_angles()
    folds = Folds(case, coarse)
    for crease in mesh.creases:
        joint, angle = joints.get(crease.edge), float(start[crease.edge])
        if joint is not None and joint.kind == "crease":
            folds.add(joint, angle, crease.lengths)
        else:
            folds.add_linear(_JOINED * plate / mesh.depth(crease) * crease.lengths, angle)
    return folds.data() if mesh.creases else None
