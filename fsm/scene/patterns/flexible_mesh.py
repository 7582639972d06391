"""Mesh of the flexible facets of a sheet."""

from __future__ import annotations

from functools import lru_cache

from fsm.scene.patterns.booms import boom_mesh
from fsm.scene.patterns.facet_mesh import FacetMesh
from fsm.scene.patterns.of_sheet import pattern_of
from fsm.scene.patterns.pattern_mesh import pattern_mesh
from fsm.scene.patterns.plates import plate_mesh
from fsm.scene.sheet import Sheet

__all__ = ["flexible_mesh"]


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
    if sheet.is_shell:
        return boom_mesh(sheet)
    assert sheet.mesh_size is not None
    return pattern_mesh(pattern_of(sheet), sheet.mesh_size)
