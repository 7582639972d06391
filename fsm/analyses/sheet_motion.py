"""Vertices and fold angles of a sheet at the records of a run, and the fraction of its fold angles that a sheet has
reached.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fsm.builders.patterns.cuts import facet_frames
from fsm.builders.patterns.foldability import foldability
from fsm.builders.patterns.of_sheet import flexible_mesh, pattern_of
from fsm.builders.sheet.sheet_joints import rest_angle, sheet_joints
from fsm.builders.sheet.sheet_loads import facet_name
from fsm.case.loading.load_case import read_case
from fsm.case.models.case import Case
from fsm.case.models.facet_mesh import FacetMesh
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError
from fsm.kernels.rotation import rotation_matrix
from fsm.results.film import Floats
from fsm.results.solution import Solution

_BEHIND = 0.5
"""Fraction of the rest angle, below which a warning says that a crease has not folded."""
_NAMED = 3
_RESISTING = 0.01
"""Part of the strain energy in bend lines or unassigned creases above which a warning names it."""


def vertices_of(solution: Solution) -> Floats:
    """Positions of the vertices of a sheet at all records, (n, n_vertices, 3), m. For flexible facets: positions of the
    nodes.

    Facets that meet in a vertex have the same corner there, except for the separation of the facets at their joints. The
    result is the mean of these corners.

    Raises
    ------
    CaseError
        The result is not that of a sheet, or its case is damaged.
    """
    case, pattern = sheet_of(solution)
    count = len(pattern.vertices)
    assert case.sheet is not None
    if case.sheet.facets == "flexible":
        return _nodes_of(solution, flexible_mesh(case.sheet))
    if case.sheet.facets == "bars":
        if solution.q.shape[1] < 3 * count:  # by a version that did not separate the sides of cuts
            raise CaseError("the result does not have the vertices of its case; run the case again with this version")
        return np.asarray(solution.q[:, -3 * count :].reshape(-1, count, 3))
    frames = facet_frames(pattern)
    rows = {name: k for k, name in enumerate(solution.layout.body_names)}
    total, shares = np.zeros((len(solution), count, 3)), np.zeros(count)
    for number, face in enumerate(pattern.faces):
        corners = list(face)
        shares[corners] += 1.0
        row = rows.get(facet_name(number))
        if row is None:  # held
            total[:, corners] += pattern.vertices[corners]
            continue
        local = frames.local(np.full(len(corners), number), pattern.vertices[corners])
        poses = solution.q[:, 7 * row : 7 * row + 7]
        total[:, corners] += np.array([pose[:3] + local @ rotation_matrix(pose[3:]).T for pose in poses])
    return np.asarray(total / shares[:, None])


def _nodes_of(solution: Solution, mesh: FacetMesh) -> Floats:
    """Positions of the nodes of flexible facets at all records, from the drawn triangles."""
    if len(mesh.triangles) != solution.shape.shape[1]:
        raise CaseError("the result does not have the triangles of its case; run the case again with this version")
    owners, first = np.unique(mesh.owner[mesh.triangles].ravel(), return_index=True)
    assert np.array_equal(owners, mesh.nodes)
    return np.asarray(solution.shape[:, first // 3, first % 3], dtype=float)


def sheet_of(solution: Solution) -> tuple[Case, Pattern]:
    """Case of a result, and the pattern of its sheet at the start.

    Raises
    ------
    CaseError
        The result is not that of a sheet, or its case is damaged.
    """
    case, faults = read_case(solution.layout.case, Path())
    if case is None:
        raise CaseError(faults)
    if case.sheet is None or case.sheet.is_shell:
        raise CaseError("the result has no crease pattern; this format shows results of a [sheet]")
    return case, pattern_of(case.sheet)


def folded_parts(solution: Solution, flexible: dict[str, float] | None = None) -> dict[str, Any]:
    """Fold angles of mountains and valleys at the end, over their rest angles by `fold_to`.

    Parameters
    ----------
    solution : Solution
    flexible : dict
        Mean fold angles at the end by the name of the crease, rad, of flexible facets.

    Returns
    -------
    dict
        `least` and `median` part; `creases`: names of creases below half, by their parts; `strain_energy` at the end by
        kinds of joints, J, relative to the moved rest angles. Empty without `fold_to`.
    """
    case, pattern = sheet_of(solution)
    assert case.sheet is not None
    if not case.sheet.fold_to:
        return {}
    every = [joint for joint in sheet_joints(case, pattern) if joint.kind != "rigid"]
    start = pattern.start_angles()
    if flexible is None:
        states = np.array([start, *(pattern.fold_angles(at) for at in vertices_of(solution))])
        last = np.unwrap(states, axis=0)[-1]
        turned = {joint.name: float(last[joint.edge]) for joint in every}
    else:
        turned, every = flexible, [joint for joint in every if joint.name in flexible]
    joints = [joint for joint in every if pattern.assignment[joint.edge] in "MV" and pattern.target[joint.edge]]
    if not joints:
        return {}
    energy = dict.fromkeys(("mountains_and_valleys", "unassigned", "bend_lines"), 0.0)
    if flexible is not None:
        energy["facets"] = float(solution.energy["panels"][-1])
    driven = {joint.edge for joint in joints}
    for joint in every:
        rest = rest_angle(case, pattern, joint, float(start[joint.edge]))
        if joint.edge in driven:
            rest = case.sheet.fold_to * float(pattern.target[joint.edge])
        plain = "bend_lines" if joint.kind == "bend line" else "unassigned"
        kind = "mountains_and_valleys" if joint.edge in driven else plain
        energy[kind] += 0.5 * joint.stiffness * (turned[joint.name] - rest) ** 2
    edges = [joint.edge for joint in joints]
    parts = np.array([turned[joint.name] for joint in joints]) / (case.sheet.fold_to * pattern.target[edges])
    order = np.argsort(parts)
    behind = {joints[k].name: round(float(parts[k]), 4) for k in order if parts[k] < _BEHIND}
    return {"least": float(parts.min()), "median": float(np.median(parts)), "creases": behind, "strain_energy": energy}


def fold_warning(solution: Solution, folded: dict[str, Any]) -> list[str]:
    """Warning with the reason if creases have not folded as far as their rest angles."""
    behind = folded.get("creases")
    if not behind:
        return []
    named = ", ".join(f"{name} {100.0 * part:.3g} %" for name, part in list(behind.items())[:_NAMED])
    more = f" and {len(behind) - _NAMED} more" if len(behind) > _NAMED else ""
    case, pattern = sheet_of(solution)
    assert case.sheet is not None
    facets = "facets" if case.sheet.facets == "flexible" else "rigid facets"
    reason = f"{facets} do not allow all these fold angles together"
    reason += _stuck_vertices(pattern, case.sheet.facets != "rigid")
    energy = folded["strain_energy"]
    total = sum(energy.values())
    of = {"bend_lines": "bend lines", "unassigned": "unassigned creases", "facets": "facets"}
    for kind, what in ((kind, what) for kind, what in of.items() if kind in energy):
        if total > 0.0 and energy[kind] > _RESISTING * total:
            reason += f"; {what} have {100.0 * energy[kind] / total:.2g} % of the strain energy"
    wrong = sum(part < 0.0 for part in behind.values())
    if wrong:
        reason += f"; {wrong} of the creases folded to the wrong side, on another branch of the path"
    return [
        f"{len(behind)} {'crease has' if len(behind) == 1 else 'creases have'} folded by less than half of the rest angle "
        f"({named}{more}): {reason}"
    ]


def _stuck_vertices(pattern: Pattern, bends: bool) -> str:
    """Text on the vertices at which facets cannot fold from flat; the facets may bend."""
    for bending, end in ((True, ""), (False, ", unless facets bend")) if bends else ((False, ""),):
        found = foldability(pattern, bending)
        stuck = sorted({*found.rigid, *found.blocked}) if found is not None else []
        if stuck:
            listed = ", ".join(str(vertex + 1) for vertex in stuck[:_NAMED]) + (" ..." if len(stuck) > _NAMED else "")
            at = f"vertex {listed}" if len(stuck) == 1 else f"{len(stuck)} vertices ({listed})"
            return f": the mountains and valleys at {at} cannot all fold from flat at the same time{end}"
    return ""
