"""Mesh of the flexible facets of a sheet."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from fsm.builders.patterns.of_sheet import folding_letters, pattern_of
from fsm.builders.patterns.pattern_mesh import pattern_mesh
from fsm.builders.patterns.places import place_of
from fsm.builders.patterns.plates import boom_mesh, plate_mesh
from fsm.case.models.facet_mesh import FacetMesh
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError


@lru_cache(maxsize=4)
def flexible_mesh(sheet: Sheet) -> FacetMesh:
    """Mesh of the flexible facets of a sheet; the last few are cached.

    Raises
    ------
    CaseError
        The pattern is faulty, or the mesh is too large.
    """
    if sheet.kind == "plate":
        return plate_mesh(sheet)
    if sheet.is_shell:
        return boom_mesh(sheet)
    assert sheet.mesh_size is not None
    pattern = pattern_of(sheet)
    mirrors = {}
    for support in sheet.support:
        with suppress(ValueError):  # places that do not exist are refused by name when supports are built
            if support.mirror is not None:
                mirrors[frozenset(place_of(pattern, support.at).vertices)] = "xyz".index(support.mirror)
    return pattern_mesh(pattern, sheet.mesh_size, sheet.mesh_grading[0], folding_letters(sheet), mirrors)


def mesh_as_pattern(sheet: Sheet) -> Pattern:
    """Pattern whose facets are the triangles of the mesh; edges inside a facet become bend lines.

    The vertices are the nodes in the order of `FacetMesh.nodes`. The pattern is flat if the sheet starts flat.
    """
    pattern, mesh = pattern_of(sheet), flexible_mesh(sheet)
    number = np.full(len(mesh.owner), -1)
    number[mesh.nodes] = np.arange(len(mesh.nodes))
    number = number[mesh.owner]
    vertices = mesh.positions[mesh.nodes]
    flat = None if pattern.flat is None or np.ptp(vertices[:, 2]) else vertices[:, :2]
    fine = Pattern.of_faces(vertices, [tuple(face) for face in number[mesh.triangles].tolist()], flat)
    letters = ["B" if face < 0 else "J" for face in fine.edge_faces.min(axis=1).tolist()]
    target = np.zeros(len(letters))
    edges = {frozenset(pair): k for k, pair in enumerate(fine.edges.tolist())}
    coarse = pattern.with_bend_lines(most=4)
    for crease in mesh.creases:
        nodes = number[crease.sectors[:, 0]].tolist()
        for pair in pairwise(nodes):
            letters[edges[frozenset(pair)]] = coarse.assignment[crease.edge]
            target[edges[frozenset(pair)]] = coarse.target[crease.edge]
    return fine.assigned(letters, target)


def mesh_of_result(case: Mapping[str, Any], triangles: int) -> FacetMesh | None:
    """Mesh of the flexible facets of a solved case, if the result has this number of triangles; None for other results."""
    from fsm.case.models.case import Case

    sheet = case.get("sheet")
    if not isinstance(sheet, Mapping) or sheet.get("facets") != "flexible":
        return None
    try:
        found = Case.model_validate(case).sheet
        mesh = flexible_mesh(found) if found is not None else None
    except (CaseError, ValueError, TypeError, OSError):  # the case was written by another version
        return None
    return mesh if mesh is not None and len(mesh.triangles) == triangles else None
