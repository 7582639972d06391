"""All models of the pulled sheet: meshes, parts of the sheet, and changed parameters."""

from __future__ import annotations

from dataclasses import replace

from validation.kirigami.sheet import EXTENSION, SPACING, Sheet

__all__ = ["MODELS"]

_BASE = Sheet()
_MESHES = {"mesh-2": 2, "mesh-3": 3, "mesh-4": 4, "mesh-6": 6}
"""Cells between two rows of slits in each mesh; all meshes also exist with smaller cells at the ends of slits."""
_SMALL = replace(_BASE, periods=1, rows=15, extension=EXTENSION / 2)
"""One period of the sheet and half of its length, for finer meshes."""

MODELS = {
    **{name: replace(_BASE, mesh_size=SPACING / cells) for name, cells in _MESHES.items()},
    **{f"{name}-graded": replace(_BASE, mesh_size=SPACING / cells, grading=1.0) for name, cells in _MESHES.items()},
    **{
        f"{name}-graded-width-{w:g}": replace(_BASE, mesh_size=SPACING / cells, grading=1.0, slit_width=1e-3 * w)
        for name, cells in _MESHES.items()
        for w in (0.1, 0.2)
    },
    **{f"small-{cells}": replace(_SMALL, mesh_size=SPACING / cells) for cells in (2, 3, 4, 6, 8, 12)},
    **{f"small-{cells}-graded": replace(_SMALL, mesh_size=SPACING / cells, grading=1.0) for cells in (3, 4, 6, 8, 12)},
    **{
        f"small-{cells}-graded-width-{w:g}": replace(_SMALL, mesh_size=SPACING / cells, grading=1.0, slit_width=1e-3 * w)
        for cells in (4, 6, 8)
        for w in (0.1, 0.2)
    },
    # what is not known
    "thickness-97": replace(_BASE, thickness=97e-6),
    "thickness-103": replace(_BASE, thickness=103e-6),
    "slit-width-0.2": replace(_BASE, slit_width=0.2e-3),
    "clear-1.9": replace(_BASE, clear=1.9e-3),
    "two-senses": replace(_BASE, half_length="mirror"),
    # what symmetry and the size of the sheet do
    "small-3-no-half-width": replace(_SMALL, mesh_size=SPACING / 3, half_width=False),
    "small-3-no-half-length": replace(_SMALL, mesh_size=SPACING / 3, half_length=None),
    "small-3-whole": replace(_SMALL, mesh_size=SPACING / 3, half_width=False, half_length=None),
    "small-3-lying": replace(_SMALL, mesh_size=SPACING / 3, half_length=None, gravity=9.81),
    "small-3-contact": replace(_SMALL, mesh_size=SPACING / 3, contact=True),
    "no-half-width": replace(_BASE, half_width=False),
    **{
        f"periods-{periods}-rows-{rows}": replace(_BASE, periods=periods, rows=rows, extension=EXTENSION * (rows + 1) / 32)
        for periods, rows in ((1, 31), (3, 31), (5, 15), (5, 7))
    },
}
"""Models by name."""
