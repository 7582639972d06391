"""Shapes of a result for the player: vertices over time, facets, parts, creases, obstacles and natural modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fsm.errors import CaseError
from fsm.results.film import Floats, Integers
from fsm.results.solution import BEAM, FILM, JOINT_AXIS, LINE, LINK, Solution
from fsm.views.plots.obstacles import obstacle_outlines, obstacles_of
from fsm.views.plots.parts import lattice_squares
from fsm.views.report.packing import pack_floats, pack_integers, pack_levels

if TYPE_CHECKING:
    from fsm.builders.sheet.sheet_joints import SheetJoint
    from fsm.case.models.facet_mesh import FacetMesh

MOST_FRAMES = 400
"""Largest number of shapes of a result in the page; the player interpolates between them."""
_SAME = 2e-6
"""Distance of corners that count as one vertex, relative to the size of the structure."""
_OPEN = 1e-3
"""Largest distance of the corners of facets at one vertex, relative to the size of the structure."""
_MOST_CREASES = 10_000
"""Number of creases above which a sheet has none in the page: their lines would slow down the picture."""
_MODES = 24
_KINDS = {FILM: "film", LINE: "cable", BEAM: "beam", LINK: "body", JOINT_AXIS: "axis of joint"}


@dataclass(frozen=True)
class Parts:
    """Parts of a structure that can be selected: panels, bodies, films, cables, bars.

    Attributes
    ----------
    names, kinds : lists of texts
    of_quad : (n_quads,) array, number of the part of every facet
    """

    names: list[str]
    kinds: list[str]
    of_quad: Integers

    def quads(self, name: str) -> Integers:
        """Facets of a part; none for an unknown name."""
        return np.flatnonzero(self.of_quad == self.names.index(name)) if name in self.names else np.zeros(0, dtype=np.int64)


def parts_of(solution: Solution) -> Parts:
    """Parts by their panels; facets without panel by the names in the result, or by their kind in older files."""
    layout, count = solution.layout, solution.shape.shape[1]
    panel = np.asarray(layout.panel) if len(layout.panel) == count else np.zeros(count, dtype=np.int64)
    film, array = layout.film is not None, solution.array is not None
    mesh = _flexible_mesh_of(solution) if "sheet" in layout.case_text else None
    facet = [] if mesh is None else mesh.facet.tolist()
    numbers: dict[tuple[str, str], int] = {}
    of_quad = np.zeros(count, dtype=np.int64)
    for quad, value in enumerate(panel.tolist()):
        kind = "panel" if value > 0 else _KINDS.get(value, "bar" if array else "plate")
        if film:
            kind = "patch" if value > 0 else "film"
        name = f"{kind} {value}" if value > 0 else "film" if film else f"{kind}s"
        if value <= 0 and len(layout.quad_names) == count:
            name = f"facet {facet[quad] + 1}" if facet else layout.quad_names[quad]
        of_quad[quad] = numbers.setdefault((kind, name), len(numbers))
    return Parts([name for _, name in numbers], [kind for kind, _ in numbers], of_quad)


@dataclass(frozen=True)
class Crease:
    """Crease line between two panels, or between two facets.

    Attributes
    ----------
    name : text as in the names of channels, for example "crease.3"
    corners : numbers of the two corners of the line, or of each piece of a line between flexible facets
    first, second : facets on both sides, in the middle of the line
    """

    name: str
    corners: tuple[int, ...]
    first: int
    second: int


def creases_of(solution: Solution) -> list[Crease]:
    """Creases between consecutive panels of a strip, or between facets of a sheet; empty for other structures."""
    if "sheet" in solution.layout.case:
        return _creases_of_sheet(solution)
    if "strip" not in solution.layout.case or solution.layout.film is not None:
        return []
    panel = np.asarray(solution.layout.panel)
    found = []
    for number in range(1, int(panel.max(initial=0))):
        before, after = np.flatnonzero(panel == number), np.flatnonzero(panel == number + 1)
        if len(before) and len(after):
            last, first = int(before[-1]), int(after[0])
            found.append(Crease(f"crease.{number}", (4 * last + 1, 4 * last + 2), last, first))
    return found


def _creases_of_sheet(solution: Solution) -> list[Crease]:
    """Creases along the edges of the pattern of a sheet, with the numbers of their channels."""
    from fsm.builders.patterns.of_sheet import pattern_of
    from fsm.builders.sheet.sheet_joints import sheet_joints
    from fsm.case.models.case import Case

    try:
        case = Case.model_validate(solution.layout.case)
        if case.sheet is None or case.sheet.is_shell:
            return []
        pattern = pattern_of(case.sheet)
        joints = [joint for joint in sheet_joints(case, pattern) if joint.kind == "crease"]
        mesh = _flexible_mesh_of(solution)
    except (CaseError, ValueError, TypeError, OSError):  # the case was written by another version
        return []
    if case.sheet.facets == "flexible":
        return [] if mesh is None or len(joints) > _MOST_CREASES else _creases_of_mesh(mesh, joints)
    vertices, facet = _corners_of_faces(pattern.faces, case.sheet.facets == "bars")
    if len(facet) != solution.shape.shape[1] or len(joints) > _MOST_CREASES:
        return []
    start = solution.shape[0].reshape(-1, 3)
    size = float(np.max(np.ptp(start, axis=0)))
    found = []
    flat = vertices.ravel()
    order = np.argsort(flat, kind="stable")
    corners = np.split(order, np.searchsorted(flat[order], np.arange(1, len(pattern.vertices))))
    for joint in joints:
        ends = [corners[vertex] for vertex in pattern.edges[joint.edge]]
        sides = sorted(set(facet[ends[0] // 4]) & set(facet[ends[1] // 4]))
        if len(sides) != 2 or any(np.ptp(start[end], axis=0).max() > _OPEN * size for end in ends):
            continue  # the corners of the facets do not coincide
        one, two = (int(end[np.flatnonzero(facet[end // 4] == sides[0])[0]]) for end in ends)
        first, second = (int(np.flatnonzero(facet == side)[0]) for side in sides)
        found.append(Crease(f"crease.{joint.name.removeprefix('crease ')}", (one, two), first, second))
    return found


def _flexible_mesh_of(solution: Solution) -> FacetMesh | None:
    """Mesh of the flexible facets of a pattern, if the drawn facets are its triangles; plates and booms have no facets."""
    from fsm.builders.patterns.of_sheet import mesh_of_result
    from fsm.case.models.sheet import SHELLS

    case = solution.layout.case
    is_shell = isinstance(case.get("sheet"), dict) and case["sheet"].get("kind") in SHELLS
    return None if is_shell else mesh_of_result(case, solution.shape.shape[1])


def _creases_of_mesh(mesh: FacetMesh, joints: Sequence[SheetJoint]) -> list[Crease]:
    """Creases between flexible facets: a piece of line for each pair of neighbouring nodes."""
    names = {joint.edge: f"crease.{joint.name.removeprefix('crease ')}" for joint in joints}
    at: dict[tuple[int, int], tuple[int, int, int]] = {}  # each sector of an edge: triangle, and its corners at the edge
    for number, triangle in enumerate(mesh.triangles.tolist()):
        for k in range(3):
            one, two = triangle[k], triangle[(k + 1) % 3]
            at[one, two] = number, k, (k + 1) % 3
            at[two, one] = number, (k + 1) % 3, k
    found = []
    for crease in mesh.creases:
        if crease.edge not in names:
            continue
        pieces = [
            tuple(at.get((int(a), int(b))) for a, b in zip(start, end, strict=True))
            for start, end in zip(crease.sectors[:-1], crease.sectors[1:], strict=True)
        ]
        if not pieces or any(None in piece for piece in pieces):
            continue
        corners = [4 * left[0] + corner for left, _ in pieces if left is not None for corner in left[1:]]
        first, second = pieces[len(pieces) // 2]
        if first is not None and second is not None:
            found.append(Crease(names[crease.edge], tuple(corners), first[0], second[0]))
    return found


def _corners_of_faces(faces: Sequence[Sequence[int]], bars: bool = False) -> tuple[Integers, Integers]:
    """Vertices (n_quads, 4) of the quadrilaterals that make up faces, as `shape` has them, and their faces (n_quads,).

    Triangles have their first vertex twice; with facets of bars, their last one.
    """
    vertices, facet = [], []
    for number, face in enumerate(faces):
        fans = [face] if len(face) <= 4 else [(face[0], *face[k : k + 3]) for k in range(1, len(face) - 1, 2)]
        vertices += [tuple(fan) if len(fan) == 4 else (*fan, fan[2 if bars else 0]) for fan in fans]
        facet += [number] * len(fans)
    return np.array(vertices, dtype=np.int64).reshape(-1, 4), np.array(facet, dtype=np.int64)


@dataclass(frozen=True)
class Shown:
    """Shapes that the page shows.

    Attributes
    ----------
    records : (n_frames,) array, numbers of the records
    data : dict for the page
    thinned : text about omitted records; empty if all records are shown
    size : bytes in the page
    """

    records: Integers
    data: dict[str, Any]
    thinned: str
    size: int


def shown_shapes(solution: Solution, budget: int) -> Shown:
    """Shapes of as many records as fit in a number of bytes, equally spaced; the first and the last are always shown."""
    total = len(solution)
    corners = solution.shape.reshape(total, -1, 3)
    size = float(np.max(np.ptp(corners.reshape(-1, 3), axis=0), initial=0.0)) or 1.0
    count = min(total, MOST_FRAMES)
    if total > 3:  # this size is an estimate from three records
        few = _spread(total, 3)
        _, first = _vertices(corners[few], size * _SAME)
        count = max(2, min(count, int(4 * budget / len(pack_levels(corners[few][:, first], per_column=True)["data"]))))
    most, grown = min(total, MOST_FRAMES), False
    while True:
        records = _spread(total, count)
        vertex, first = _vertices(corners[records], size * _SAME)
        packed = pack_levels(corners[records][:, first], per_column=True)
        fitting = int(count * 0.92 * budget / len(packed["data"]))
        if len(packed["data"]) > budget and count > 2:
            count = max(2, min(count - 1, fitting))
        elif not grown and count < most and fitting > 1.5 * count:  # the estimate was too high
            count, grown = min(most, fitting), True
        else:
            break
    thinned = (
        ""
        if len(records) == total
        else (f"The player shows {len(records)} of {total} records, equally spaced, and interpolates between them.")
    )
    data: dict[str, Any] = {
        "records": records.tolist(),
        "positions": packed,
        "quads": pack_integers(vertex.reshape(-1, 4)),
        "size": size,
        "obstacles": _obstacles(solution, records, size),
        "modes": _modes(solution, first),
    }
    return Shown(records, data, thinned, len(packed["data"]))


def _spread(total: int, count: int) -> Integers:
    return np.unique(np.round(np.linspace(0, total - 1, min(count, total))).astype(np.int64))


def _vertices(corners: Floats, tolerance: float) -> tuple[Integers, Integers]:
    """Vertex of every corner, and one corner of every vertex; corners are joined that coincide in all records."""
    keys = np.round((corners[0] - corners[0].min(axis=0)) / tolerance).astype(np.int64)
    code = (keys[:, 0] << 42) ^ (keys[:, 1] << 21) ^ keys[:, 2]
    _, first, vertex = np.unique(code, return_index=True, return_inverse=True)
    vertex = vertex.reshape(-1)
    apart = np.zeros(corners.shape[1], dtype=bool)
    for shape in corners:
        apart |= np.abs(shape - shape[first[vertex]]).max(axis=1) > 2.0 * tolerance
    alone = np.flatnonzero(apart)
    vertex[alone] = len(first) + np.arange(len(alone))
    return vertex, np.concatenate([first, alone])


def _obstacles(solution: Solution, records: Integers, size: float) -> list[dict[str, Any]]:
    """Outlines of obstacles: faces as quadrilaterals or polygons; positions in all records if they move."""
    everything = solution.shape[records].reshape(-1, 3)
    low, high = everything.min(axis=0), everything.max(axis=0)
    try:
        first = obstacle_outlines(solution, int(records[0]), (low + high) / 2, 0.75 * size)
        names = [str(one.get("name", "obstacle")) for one in obstacles_of(solution.layout.case)]
        found = []
        for k, outline in enumerate(first):
            over = records if outline.moves else records[:1]
            faces = [obstacle_outlines(solution, int(r), (low + high) / 2, 0.75 * size)[k].faces for r in over]
            found.append(
                {
                    "name": names[k] if k < len(names) else "obstacle",
                    "sides": [len(face) for face in outline.faces],
                    "plane": not outline.bounded,
                    "positions": pack_floats(np.array([np.concatenate(each) for each in faces])),
                }
            )
    except CaseError:
        return []
    return found


def _modes(solution: Solution, first: Integers) -> list[dict[str, Any]]:
    """Natural modes of a film and of steps, with the record about which the structure vibrates."""
    found = []
    film, steps = solution.layout.film, solution.modes
    if film is not None and film.mode_shape.shape[1:2] == solution.shape.shape[1:2]:
        found = [
            (f"mode {k + 1}", f, shape, 0) for k, (f, shape) in enumerate(zip(film.frequency, film.mode_shape, strict=True))
        ]
    if steps is not None:
        names = solution.layout.step_names
        for k, (step, frequency, shape) in enumerate(zip(steps.step, steps.frequency, steps.shape, strict=True)):
            if shape.shape == solution.shape.shape[1:]:
                at = np.flatnonzero(solution.step == step)
                of = names[int(step) - 1] if 0 < step <= len(names) else f"step {step}"
                squares = lattice_squares(solution, shape)
                shape = shape if squares is None else squares
                number = k - int(np.argmax(steps.step == step)) + 1
                found.append((f"mode {number} after {of}", frequency, shape, int(at[-1]) if len(at) else len(solution) - 1))
    return [
        {"name": name, "frequency": float(f), "record": record, "shape": pack_levels(shape.reshape(-1, 3)[first])}
        for name, f, shape, record in found[:_MODES]
    ]
