"""Stiffness of laminates from their plies, by classical lamination theory (Jones, Mechanics of Composite Materials, 1999).

Resultants follow from the strains exx, eyy, 2 exy of the middle surface and the curvatures kxx, kyy, 2 kxy:

    N = A e + B k,    M = B e + D k,    A, B, D = sum_k Q_k (z_k - z_(k-1), (z_k^2 - z_(k-1)^2)/2, (z_k^3 - z_(k-1)^3)/3)

with the stiffness Q_k of each ply in the axes of the sheet.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fsm.case.models.sheet_parts import SheetPly


class Laminate(NamedTuple):
    """Stiffness of a laminate: A (N/m), B (N), D (N m), each (3, 3), and its mass per area, kg/m^2."""

    stretch: np.ndarray
    coupling: np.ndarray
    bending: np.ndarray
    areal_density: float


def laminate_of(plies: Sequence[SheetPly], density: float) -> Laminate:
    """Stiffness of plies from the lowest to the highest along the normal.

    Parameters
    ----------
    plies : sequence of SheetPly
    density : kg/m^3
        Density of plies without the key `density`.
    """
    sides = np.concatenate([[0.0], np.cumsum([ply.thickness for ply in plies])])
    z = sides - 0.5 * sides[-1]
    stiffness = np.array([_turned(ply) for ply in plies])
    stretch, coupling, bending = (np.einsum("k,kij->ij", np.diff(z**n) / n, stiffness) for n in (1, 2, 3))
    areal = sum(ply.thickness * (density if ply.density is None else ply.density) for ply in plies)
    return Laminate(stretch, coupling, bending, areal)


def _turned(ply: SheetPly) -> np.ndarray:
    """Plane-stress stiffness (3, 3) of a ply in the axes of the sheet, Pa."""
    minor = ply.poisson * ply.young_across / ply.young
    scale = 1.0 / (1.0 - ply.poisson * minor)
    own = np.array([
        [scale * ply.young, scale * minor * ply.young, 0.0],
        [scale * minor * ply.young, scale * ply.young_across, 0.0],
        [0.0, 0.0, ply.shear],
    ])  # fmt: skip
    c, s = np.cos(ply.angle), np.sin(ply.angle)
    to_ply = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]])
    return np.asarray(to_ply.T @ own @ to_ply)
