"""Mesh of the flexible facets of a sheet."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from fsm.errors import CaseError
from fsm.scene.patterns.facet_mesh import FacetMesh
from fsm.scene.patterns.of_sheet import pattern_of
from fsm.scene.patterns.pattern_mesh import pattern_mesh
from fsm.scene.patterns.plates import plate_mesh
from fsm.scene.sheet import Sheet

__all__ = ["flexible_mesh", "mesh_of_result"]


@lru_cache(maxsize=4)
def flexible_mesh(sheet: Sheet) -> FacetMesh:
    """Mesh of the flexible facets of a sheet; the last few are cached.

    Raises
    ------
    CaseError
        The pattern is faulty, or the mesh too large.
    """
    if sheet.kind == "plate":
        return plate_mesh(sheet)
    assert sheet.mesh_size is not None
    return pattern_mesh(pattern_of(sheet), sheet.mesh_size)


def mesh_of_result(case: Mapping[str, Any], triangles: int) -> FacetMesh | None:
    """Mesh of the flexible facets of a solved case, if the result has this number of triangles; None for other results."""
    from fsm.scene.case import Case

    sheet = case.get("sheet")
    if not isinstance(sheet, Mapping) or sheet.get("facets") != "flexible":
        return None
    try:
        found = Case.model_validate(case).sheet
        mesh = flexible_mesh(found) if found is not None else None
    except (CaseError, ValueError, TypeError, OSError):  # a case of another version
        return None
    return mesh if mesh is not None and len(mesh.triangles) == triangles else None
