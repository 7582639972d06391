"""Chambers of gas of a sheet, and closed surfaces of rigid panels around them.

Panels have separate corners, because the springs of the joints let panels separate slightly. A chamber is bounded by its
panels, by a strip between the two sides of each joint, and by a polygon between the corners at each vertex. This surface is
closed at any positions of the panels. The gradient of its volume is therefore the exact force of a unit pressure: the area
of each flat panel along its normal, at its centroid, and a force in proportion to the area of the strips on both sides of
each joint.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fsm.builders.patterns.chamber import SheetSurface, chamber_of
from fsm.builders.patterns.cuts import FacetFrames, facets_across_cuts
from fsm.builders.sheet.sheet_joints import sheet_joints
from fsm.case.models.case import Case
from fsm.case.models.chambers import Chamber, Lid, PanelSurface
from fsm.case.models.gas import OUTSIDE, SUPPLIES, Gas, Orifice
from fsm.case.models.scene import Scene
from fsm.case.models.time_program import Ramp, Table
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError, Fault

Faces = Sequence[Sequence[int]]


def panel_triangles(faces: Faces) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (m, 3) of vertices that divide polygons, and the number (m,) of the polygon of each."""
    found = [(number, face[0], *pair) for number, face in enumerate(faces) for pair in pairwise(face[1:])]
    table = np.array(found, dtype=np.int64)
    return table[:, 1:], table[:, 0]


def sealed(faces: Faces, chosen: Collection[int], lids: Sequence[Lid]) -> tuple[np.ndarray, tuple[Lid, ...]]:
    """Closed surface of a chamber, without its lids and planes.

    Parameters
    ----------
    faces : vertices of every panel, counter-clockwise around its normal
        The corners of all panels have numbers in this order.
    chosen : numbers of the panels around the chamber
    lids : lids over rings of vertices

    Returns
    -------
    (m, 3) array
        Triangles of corners.
    tuple of Lid
        Lids over rings of corners. A vertex of two panels with an open edge has two of them. All corners have the same part
        in a tip: a vertex in a plane of symmetry has a corner on each side of it.
    """
    first = np.cumsum([0, *map(len, faces)])
    corner, left, after = dict[tuple[int, int], int](), dict[tuple[int, int], int](), dict[tuple[int, int], int]()
    found = list[tuple[int, int, int]]()
    for panel in chosen:
        face = list(faces[panel])
        corner |= {(vertex, panel): int(first[panel]) + k for k, vertex in enumerate(face)}
        left |= dict.fromkeys(zip(face, [*face[1:], face[0]], strict=True), panel)
        found += _polygon([corner[vertex, panel] for vertex in face])
    for (u, v), panel in left.items():
        other = left.get((v, u))
        if other is None:
            continue
        after[v, panel] = other  # the polygon at the vertex v continues on the panel across the edge that ends there
        if u < v:
            found += _polygon([corner[v, panel], corner[u, panel], corner[u, other], corner[v, other]])
    begins = set(corner) - {(vertex, panel) for (vertex, _), panel in after.items()}
    found += _around_vertices(corner, after, begins)
    covers = list[Lid]()
    for lid in lids:
        vertices, ring = lid.nodes.tolist(), list[int]()
        for a, b in lid.edges.tolist():
            u, v = vertices[a], vertices[b]
            ring += [corner[u, left[v, u]], corner[v, left[v, u]]]  # the edge (v, u) is that of the panel
        ring = [here for k, here in enumerate(ring) if here != ring[k - 1]]
        covers.append(replace(lid, nodes=np.array(ring, dtype=np.int64), weights=np.full(len(ring), 1.0 / len(ring))))
    return np.array(found, dtype=np.int64), tuple(covers)


def _around_vertices(
    corner: Mapping[tuple[int, int], int], after: Mapping[tuple[int, int], int], begins: Collection[tuple[int, int]]
) -> list[tuple[int, int, int]]:
    """Triangles between the corners at all vertices; open sequences of panels begin at `begins`."""
    left, found = dict(corner), list[tuple[int, int, int]]()
    for key in [*sorted(begins), *sorted(corner)]:
        vertex, panel = key
        ring = list[int]()
        while (vertex, panel) in left:
            ring.append(left.pop((vertex, panel)))
            panel = after.get((vertex, panel), -1)
        found += _polygon(ring)
    return found


def _polygon(corners: Sequence[int]) -> list[tuple[int, int, int]]:
    return [(corners[0], a, b) for a, b in pairwise(corners[1:])]


def with_gas_of_panels(
    case: Case, scene: Scene, pattern: Pattern, frames: FacetFrames, held: Mapping[int, set[int]]
) -> Scene:
    """Scene of rigid panels with the gas of their chambers.

    Parameters
    ----------
    case, scene, pattern
    frames : positions and axes of the panels
    held : components (0, 1, 2) along which vertices do not move

    Raises
    ------
    CaseError
        As in `with_gas`.
    """
    if not case.gas:
        return scene
    faces, own = pattern.faces, np.arange(len(pattern.vertices))
    triangles, panel = panel_triangles(faces)
    across = facets_across_cuts(pattern)
    scene = with_gas(case, scene, SheetSurface(pattern.vertices, triangles, panel, held, pattern.groups, own, across))
    owner = np.repeat(np.arange(len(faces)), [len(face) for face in faces])
    corners = pattern.vertices[np.concatenate([np.array(face) for face in faces])]
    first = np.cumsum([0, *map(len, faces)])
    folds = {}
    for joint in sheet_joints(case, pattern):
        if joint.kind == "crease":
            left, right = pattern.edge_faces[joint.edge].tolist()
            u, v = (faces[left].index(vertex) for vertex in pattern.edges[joint.edge].tolist())
            third, fourth = (_beside(pattern, panel, joint.edge) for panel in (left, right))
            folds[joint.name] = first[left] + third, first[left] + u, first[left] + v, first[right] + fourth
    closed = [sealed(faces, chamber.facets, chamber.caps) for chamber in scene.built.chambers]
    surface = PanelSurface(
        tuple(scene.bodies[number].name for number in owner), frames.local(owner, corners), corners,
        tuple(one for one, _ in closed), tuple(lids for _, lids in closed), folds,
    )  # fmt: skip
    return scene.with_parts(panels_of_gas=surface)


def _beside(pattern: Pattern, panel: int, edge: int) -> int:
    """Position in a panel of the corner farthest from the line of an edge."""
    at = pattern.vertices[list(pattern.faces[panel])]
    start, end = pattern.vertices[pattern.edges[edge]]
    return int(np.argmax(np.linalg.norm(np.cross(at - start, end - start), axis=1)))


def with_gas(case: Case, scene: Scene, surface: SheetSurface) -> Scene:
    """Scene of a sheet with the gas of its chambers.

    Raises
    ------
    CaseError
        A chamber is open or empty, or an orifice names an unknown gas or joins different gases.
    """
    if not case.gas:
        return scene
    _check_path(case)
    chambers = [chamber_of(_in_time(case, gas), surface, f"gas.{number}") for number, gas in enumerate(case.gas)]
    _check_names(case.gas)
    for number, gas in enumerate(case.gas):
        _check_filled(gas, case.orifice, f"gas.{number}.pressure")
    for number, orifice in enumerate(case.orifice):
        _check_orifice(orifice, chambers, f"orifice.{number}.between")
        data = scene.built.folds if scene.built.facets is None else scene.built.facets.folds
        if data is None:
            names = tuple(element.name for element in scene.elements if element.kind == "crease")
        else:
            names = tuple(data.names[k] for k in np.unique(data.joint[data.joint >= 0]))
        names = tuple(name for name in names if name.startswith("crease"))
        if orifice.crease is not None and orifice.crease not in names:
            known = f'the sheet has "{names[0]}" to "{names[-1]}"' if names else "the sheet has no creases"
            raise CaseError(Fault(f"orifice.{number}.crease", f'there is no "{orifice.crease}"; {known}'))
    return scene.with_parts(chambers=tuple(chambers), orifices=case.orifice)


def _in_time(case: Case, gas: Gas) -> Gas:
    """Gas whose supply has a ramp over the run, if the run is static and the supply has no function of time.

    A pressure grows from the pressure outside, at which the sheet carries no load. A flow is constant, so its mass grows
    in proportion to time.
    """
    method, end = case.solve.method, case.solve.end_time
    if gas.time is not None or end is None or method not in ("static", "arc-length"):
        return gas
    if gas.supply_mass is None and gas.supply_pressure is None:
        return gas
    shape = "unbounded" if method == "arc-length" else "linear"
    first = gas.outside_pressure / gas.supply_pressure if gas.supply_pressure else 0.0  # factor at the start
    if first >= 1.0:  # the pressure falls to the supply
        table = {"kind": "table", "time": [0.0, end], "value": [first, 1.0], "interpolation": "linear"}
        return gas.model_copy(update={"time": Table.model_validate(table)})
    start = -first * end / (1.0 - first)
    return gas.model_copy(update={"time": Ramp(kind="ramp", start=start, end=end, shape=shape)})


def _check_path(case: Case) -> None:
    """A path by arc length has no history, because its program time may decrease."""
    if case.solve.method != "arc-length" and not any(
        step.solve is not None and step.solve.method == "arc-length" for step in case.step
    ):
        return
    for number, gas in enumerate(case.gas):
        if gas.law == "adiabatic" and (gas.supply_flow is not None or gas.supply_mass is not None):
            text = 'of a supplied gas depends on the history, and a path by arc length has none; give "isothermal"'
            raise CaseError(Fault(f"gas.{number}.law", f'"adiabatic" {text}'))
    if case.orifice:
        text = 'flow takes time, and a path by arc length has none; remove [[orifice]], or give method = "static"'
        raise CaseError(Fault("orifice", text))


def _check_names(gases: tuple[Gas, ...]) -> None:
    names = [gas.name for gas in gases]
    for number, name in enumerate(names):
        if name in names[:number] or name == OUTSIDE:
            text = f"{name!r} is the name of another gas" if name != OUTSIDE else f"{OUTSIDE!r} are the surroundings"
            raise CaseError(Fault(f"gas.{number}.name", f"{text}; give another name"))


def _check_filled(gas: Gas, orifices: tuple[Orifice, ...], path: str) -> None:
    """Check that a chamber has gas, or gets some from a supply or through an orifice."""
    supplied = any(getattr(gas, name) is not None for name in SUPPLIES)
    joined = any(gas.name in orifice.between for orifice in orifices)
    if not (gas.at_start or gas.outside_pressure or supplied or joined):
        text = "the chamber is empty and has no supply; give `pressure`, a supply such as `supply_mass`, or an [[orifice]]"
        raise CaseError(Fault(path, text))


def _check_orifice(orifice: Orifice, chambers: list[Chamber], path: str) -> None:
    gases = {chamber.gas.name: chamber.gas for chamber in chambers}
    for name in orifice.between:
        if name not in gases and name != OUTSIDE:
            known = ", ".join([*map(repr, gases), repr(OUTSIDE)])
            raise CaseError(Fault(path, f"there is no gas {name!r}; give two of {known}"))
    joined = [gases[name] for name in orifice.between if name in gases]
    for key in ("gas_constant", "heat_ratio", "law"):
        values = [getattr(gas, key) for gas in joined]
        if values[0] != values[-1]:
            text = f"joins gases with {key} = {values[0]} and {values[-1]}, which would mix; give both the same"
            raise CaseError(Fault(path, text))
