"""Input file for CalculiX and Abaqus: nodes, shell and truss elements, sections and materials of the first record."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fsm.builders.patterns.of_sheet import mesh_of_result
from fsm.errors import CaseError
from fsm.results.film import Integers
from fsm.results.solution import BEAM, FILM, JOINT_AXIS, LINE, LINK, Solution
from fsm.views.exporters.registry import exporter
from fsm.views.plots.mesh import Mesh, mesh_of

_TYPES = {4: "S4", 3: "S3", 2: "T3D2"}
_JOINED = 1e-3
"""Largest distance of the ends of two elements that share their nodes, relative to the length of the first element."""
_STILL = 1e-9
"""Largest displacement of nodes that do not move, relative to the size of the structure."""
_STEEL = {"young": 2.1e11, "poisson": 0.3}
"""Elastic constants of parts that are rigid in the case."""


@dataclass(frozen=True)
class _Section:
    """Section and material of a group of elements: thickness (m) or area (m^2), and constants in SI."""

    name: str
    size: float
    young: float
    poisson: float
    density: float
    rigid: bool = False


@exporter("inp", "CalculiX and Abaqus: mesh, sections and materials of the first record")
def write_inp(solution: Solution, path: Path) -> None:
    """Write the mesh of the first record in SI units (m, kg, s, N, Pa).

    Elements of a panel, a film or a bar share their nodes. At creases, equations for the three translations join
    the panels, like a hinge without moment. Loads, contact, crease moments and joints are not part of the file.

    Raises
    ------
    CaseError
        The case in the result is damaged.
    """
    mesh = mesh_of(solution)
    if np.all(np.isin(mesh.panel, (LINK, JOINT_AXIS))):
        raise CaseError("the result has no plates, films, cables or beams; give bodies a `plate`", "export")
    cells, hinges = _joined(mesh)
    used = np.unique(cells)
    number = np.zeros(mesh.points.shape[1], dtype=np.int64)
    number[used] = np.arange(1, len(used) + 1)
    try:
        sections = list(_sections(mesh))
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise CaseError(f"the case in this result is damaged: it has no sections ({error!r})", "export") from error
    lines = _heading(mesh, sections)
    lines += ["*NODE, NSET=ALL_NODES"]
    lines += [f"{number[k]}, " + ", ".join(f"{x:.12g}" for x in mesh.points[0, k]) for k in used]
    element = 0
    for section, chosen in sections:
        for corners, kind in _TYPES.items():
            rows = cells[chosen][mesh.corners[chosen] == corners, :corners]
            if len(rows):
                lines.append(f"*ELEMENT, TYPE={kind}, ELSET={section.name}")
                for row in rows:
                    element += 1
                    lines.append(", ".join(map(str, [element, *number[row].tolist()])))
    for section, chosen in sections:
        lines += _section_lines(section, bool((mesh.corners[chosen] == 2).all()))
    lines += ["*ELSET, ELSET=ALL_ELEMENTS", *(section.name for section, _ in sections)]
    for one, other in hinges:
        for direction in (1, 2, 3):
            lines += ["*EQUATION", "2", f"{number[one]}, {direction}, 1.0, {number[other]}, {direction}, -1.0"]
    size = float(np.max(np.ptp(mesh.points[0], axis=0)))
    moved = np.linalg.norm(mesh.points[:, used] - mesh.points[0, used], axis=-1).max(axis=0)
    dependent = [one for one, _ in hinges]  # a support of these nodes would contradict the equations
    still = number[used[(moved <= _STILL * size) & ~np.isin(used, dependent)]]
    if len(still) and len(mesh.time) > 1:
        lines += ["** nodes that do not move in the run", "*NSET, NSET=UNMOVED"]
        lines += [", ".join(map(str, still[k : k + 12].tolist())) for k in range(0, len(still), 12)]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def _heading(mesh: Mesh, sections: list[tuple[_Section, Integers]]) -> list[str]:
    title = _plain(str(mesh.solution.layout.case.get("title", "")))
    lines = [
        "*HEADING", title or "fsm",
        f"** mesh of the record at {mesh.time[0]:.6g} s, written by fsm; units: m, kg, s, N, Pa",
        "** loads, supports, initial stress, contact, moments of creases and joints are not in this file",
    ]  # fmt: skip
    film = mesh.solution.layout.film is not None
    if (mesh.solution.layout.case.get("sheet") or {}).get("ply"):
        lines.append("** the plies of the sheet are not in this file; its material is isotropic")
    crease = mesh.solution.layout.case.get("crease")
    if isinstance(crease, Mapping) and not film:
        for key, unit in (("stiffness", "N m/rad over the whole width"), ("stiffness_per_length", "N m/rad per m")):
            if isinstance(value := crease.get(key), int | float) and value:
                lines.append(f"** creases: stiffness {value:.6g} {unit}")
    if film and mesh.solution.layout.case.get("cable"):
        lines.append("** the cables of the film are not in this file")
    rigid = [section.name for section, _ in sections if section.rigid]
    return [*lines, *(f"** {name} is rigid in the case; its elastic constants are those of steel" for name in rigid)]


def _section_lines(section: _Section, truss: bool) -> list[str]:
    kind = "*SOLID SECTION" if truss else "*SHELL SECTION"
    return [
        f"*MATERIAL, NAME=M_{section.name}", "*ELASTIC", f"{section.young:.9g}, {section.poisson:.9g}",
        "*DENSITY", f"{section.density:.9g}",
        f"{kind}, ELSET={section.name}, MATERIAL=M_{section.name}", f"{section.size:.9g}",
    ]  # fmt: skip


def _joined(mesh: Mesh) -> tuple[Integers, list[tuple[int, int]]]:
    """Cells with shared nodes within each panel, bar, beam and cable, and pairs of nodes of panels that meet at a crease."""
    if (mesh.solution.layout.case.get("sheet") or {}).get("facets") == "flexible":
        return _joined_facets(mesh)
    target, start = np.arange(mesh.points.shape[1]), mesh.points[0]
    lines = (mesh.panel == BEAM) | (mesh.panel == LINE) | (mesh.solution.array is not None)
    if mesh.solution.layout.film is not None:
        return mesh.cells, []
    for k in np.flatnonzero(lines[:-1] & lines[1:]):
        if mesh.corners[k] != mesh.corners[k + 1] or mesh.label[k] != mesh.label[k + 1]:
            continue
        pairs = [(1, 0)] if mesh.corners[k] == 2 else [(1, 0), (2, 3)]
        ends = [(int(mesh.cells[k, a]), int(mesh.cells[k + 1, b])) for a, b in pairs]
        length = float(np.linalg.norm(start[mesh.cells[k, 1]] - start[mesh.cells[k, 0]]))
        if all(np.linalg.norm(start[a] - start[b]) <= _JOINED * length for a, b in ends):
            for a, b in ends:
                target[b] = target[a]
    hinges, panel_of = [], np.zeros(len(start), dtype=np.int64)
    owner = mesh.label + 1 if "sheet" in mesh.solution.layout.case else mesh.panel
    panel_of[mesh.cells] = owner[:, None]
    tolerance = 1e-2 * _JOINED * float(np.max(np.ptp(start, axis=0)))
    for group in _close_points(start, np.unique(mesh.cells[(owner > 0) & ~lines]), tolerance):
        first_of: dict[int, int] = {}
        for point in group:
            target[point] = first_of.setdefault(int(panel_of[point]), point)
        first, *others = first_of.values()
        hinges += [(other, first) for other in others]
    return target[mesh.cells], hinges


def _joined_facets(mesh: Mesh) -> tuple[Integers, list[tuple[int, int]]]:
    """Cells of flexible facets with shared nodes within each facet, and pairs of nodes at creases between facets.

    Raises
    ------
    CaseError
        The case does not give the triangles of the result.
    """
    facets = mesh_of_result(mesh.solution.layout.case, len(mesh.cells))
    if facets is None:
        raise CaseError("the case in this result has another mesh than the result; run the case again", "export")
    point = np.zeros(len(facets.owner), dtype=np.int64)  # of each sector: a node with the slopes of one facet
    point[facets.triangles] = mesh.cells[:, :3]
    cells = mesh.cells.copy()
    cells[:, :3] = point[facets.triangles]
    cells[:, 3] = cells[:, 2]
    others = np.flatnonzero(facets.owner != np.arange(len(facets.owner)))
    return cells, list(zip(point[others].tolist(), point[facets.owner[others]].tolist(), strict=True))


def _close_points(places: np.ndarray, chosen: Integers, tolerance: float) -> Iterator[list[int]]:
    """Groups of points that are closer to each other than a tolerance."""
    if not len(chosen):
        return
    pairs = cKDTree(places[chosen]).query_pairs(tolerance, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(chosen), len(chosen)))
    count, number = connected_components(graph, directed=False)
    order = np.argsort(number, kind="stable")
    for group in np.split(chosen[order], np.cumsum(np.bincount(number, minlength=count))[:-1]):
        yield group.tolist()


def _sections(mesh: Mesh) -> Iterator[tuple[_Section, Integers]]:
    """Sections with their cells, from the case of the result."""
    case, names = mesh.solution.layout.case, set[str]()

    def section(name: str, size: Any, source: Mapping[str, Any], rigid: bool = False) -> _Section:
        label = re.sub(r"[^A-Z0-9]+", "_", name.upper())[:40].strip("_") or "PART"
        label = label if label[0].isalpha() else f"P_{label}"
        number, unique = 2, label
        while unique in names:
            unique, number = f"{label}_{number}", number + 1
        names.add(unique)
        values = {**_STEEL, "density": 1e3, **source}
        young, poisson, density = (float(values[key]) for key in ("young", "poisson", "density"))
        return _Section(unique, float(size), young, poisson, density, rigid)

    material = case.get("material") or {}
    if mesh.solution.layout.film is not None:
        patches = list(_patches(case))
        for number in np.unique(mesh.panel):
            chosen = np.flatnonzero(mesh.panel == number)
            source = patches[number - 1] if 0 < number <= len(patches) else material
            thickness = source.get("thickness", mesh.solution.layout.thickness)
            yield section(mesh.labels[mesh.label[chosen[0]]], thickness, source), chosen
        return
    scene = case.get("scene") or {}
    if "scissor" in case:
        yield section("bars", case["bar"]["height"], material), np.arange(len(mesh.cells))
        return
    if "lattice" in case:
        yield section("squares", case["lattice"]["depth"], {**_STEEL, **case["lattice"]}, True), np.arange(len(mesh.cells))
        return
    of_strip = np.flatnonzero((mesh.panel > 0) | ("sheet" in case))
    if len(of_strip):
        thickness = (case.get("sheet") or case.get("strip", {})).get("thickness", mesh.solution.layout.thickness)
        yield section("sheet" if "sheet" in case else "strip", thickness, material), of_strip
    bodies = [body for body in scene.get("bodies", ()) if body.get("plate")]
    for k, body in zip(np.flatnonzero(mesh.panel == 0), bodies, strict=False):
        plate = body["plate"]
        density = float(body["mass"]) / (plate["length"] * plate["width"] * plate["thickness"])
        yield section(str(body["name"]), plate["thickness"], {**_STEEL, "density": density}, True), np.array([k])
    for kind, key in ((FILM, "films"), (LINE, "cables"), (BEAM, "beams")):
        yield from ((section(name, size, part), cells) for name, size, part, cells in _flexible(mesh, scene, kind, key))


def _flexible(mesh: Mesh, scene: Mapping[str, Any], kind: int, key: str) -> Iterator[tuple[str, float, Any, Integers]]:
    """Name, thickness or area, keys and cells of the films, cables or beams of a scene, in the order of the case."""
    cells, parts = np.flatnonzero(mesh.panel == kind), list(scene.get(key, ()))
    counts = [int(np.prod(part["mesh"])) if kind == FILM else int(part["elements"]) for part in parts]
    each = len(cells) // max(sum(counts), 1)
    begin = 0
    for part, count in zip(parts, counts, strict=True):
        size = part["thickness"] if kind != LINE else 0.25 * np.pi * part["diameter"] ** 2
        yield str(part["name"]), float(size), part, cells[begin : begin + count * each]
        begin += count * each


def _patches(case: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Keys of each patch of a film, in the order of their numbers."""
    for patch in case.get("patch", ()):
        count = patch.get("count", 1)
        copies = 4 * count if patch.get("place") == "diagonals" else int(np.prod(count))
        yield from [patch] * copies


def _plain(text: str) -> str:
    """Text of one line with ASCII characters only, which both programs accept."""
    return re.sub(r"[^\x20-\x7e]+", " ", text).strip().lstrip("*")[:80]
