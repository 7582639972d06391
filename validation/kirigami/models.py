"""All models of the pulled sheet: meshes, parts of the sheet, and changed parameters."""

from __future__ import annotations

from dataclasses import replace

from validation.kirigami.sheet import Sheet

__all__ = ["BASE", "MESHES", "MODELS"]

BASE = Sheet()
MESHES = ("mesh-2", "mesh-3", "mesh-4")
"""Three meshes with 2, 3 and 4 cells between two rows of slits."""

MODELS = {
    "mesh-2": BASE,
    "mesh-3": replace(BASE, mesh_size=1.2667e-3),
    "mesh-4": replace(BASE, mesh_size=0.95e-3),
    # what is not known
    "thickness-97": replace(BASE, thickness=97e-6),
    "thickness-103": replace(BASE, thickness=103e-6),
    "slit-width-0.2": replace(BASE, slit_width=0.2e-3),
    "clear-1.9": replace(BASE, clear=1.9e-3),
    "two-senses": replace(BASE, half_length="mirror"),
    "gravity": replace(BASE, gravity=9.81),
    # what symmetry and the size of the sheet do
    "no-half-width": replace(BASE, half_width=False),
    "no-half-length": replace(BASE, half_length=None),
    "whole": replace(BASE, half_width=False, half_length=None),
    "contact": replace(BASE, contact=True),
    **{
        f"periods-{periods}-rows-{rows}": replace(BASE, periods=periods, rows=rows, extension=73e-3 * (rows + 1) / 32)
        for periods, rows in ((1, 31), (3, 31), (5, 15), (5, 7))
    },
}
"""Models by name."""
