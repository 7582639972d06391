"""All models of the pulled sheet: meshes, parts of the sheet, and changed parameters."""

from __future__ import annotations

from dataclasses import replace

from validation.kirigami.sheet import EXTENSION, SPACING, Sheet

__all__ = ["MODELS"]

_BASE = Sheet()
_SMALL = replace(_BASE, periods=1, rows=15, extension=EXTENSION / 2)
"""One period of the sheet and half of its length, for finer meshes and for comparisons."""


def _meshed(sheet: Sheet, cells: int, slit_width: float | None = None) -> Sheet:
    """Sheet with a number of cells between two rows; with a width of slits (m), cells are smaller at the ends of slits."""
    if slit_width is None:
        return replace(sheet, mesh_size=SPACING / cells)
    return replace(sheet, mesh_size=SPACING / cells, grading=1.0, slit_width=slit_width)


MODELS = {
    **{f"mesh-{cells}": _meshed(_BASE, cells) for cells in (2, 3, 4)},
    **{f"mesh-{cells}-graded": _meshed(_BASE, cells, 0.0) for cells in (3, 4)},
    **{f"mesh-{cells}-graded-width-0.1": _meshed(_BASE, cells, 0.1e-3) for cells in (3, 4)},
    "mesh-3-graded-width-0.2": _meshed(_BASE, 3, 0.2e-3),
    **{f"small-{cells}": _meshed(_SMALL, cells) for cells in (2, 3, 4, 6, 8)},
    **{f"small-{cells}-graded": _meshed(_SMALL, cells, 0.0) for cells in (4, 6, 8)},
    **{f"small-{cells}-graded-width-0.1": _meshed(_SMALL, cells, 0.1e-3) for cells in (4, 6, 8)},
    "small-6-graded-width-0.2": _meshed(_SMALL, 6, 0.2e-3),
    # what is not known
    "thickness-103": replace(_BASE, thickness=103e-6),
    "clear-1.9": replace(_BASE, clear=1.9e-3),
    "two-senses": replace(_BASE, half_length="mirror"),
    # symmetry, contact and weight
    "small-3-no-half-width": replace(_meshed(_SMALL, 3), half_width=False),
    "small-3-no-half-length": replace(_meshed(_SMALL, 3), half_length=None),
    "small-3-whole": replace(_meshed(_SMALL, 3), half_width=False, half_length=None),
    "small-3-lying": replace(_meshed(_SMALL, 3), half_length=None, gravity=9.81),
    "small-3-contact": replace(_meshed(_SMALL, 3), contact=True),
}
"""Models by name."""
