"""Case of a tape spring in bending, and the theory of its folds.

The tape spring is one half of a symmetric one: its left edge lies in a plane of symmetry, where the fold forms. Its right
edge is clamped in a rigid end, which turns and can translate, so that the bending moment is the same everywhere.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

__all__ = ["DENSITY", "NU", "RADIUS", "STEEL", "YOUNG", "Tape", "tape_spring"]

RADIUS, YOUNG, NU, DENSITY = 15e-3, 210e9, 0.3, 7850.0
"""Radius of the section (m), Young's modulus (Pa), Poisson's ratio and density (kg/m^3) of steel tapes."""


class Tape(NamedTuple):
    """Section of a tape spring: thickness, m, and subtended angle, rad."""

    thickness: float
    angle: float

    @property
    def plate(self) -> float:
        """Bending stiffness D = E t^3/(12 (1 - nu^2)), N m."""
        return YOUNG * self.thickness**3 / (12.0 * (1.0 - NU**2))

    def steady(self, sense: float) -> float:
        """Moment of a long fold, (1 +- nu) D a, N m: opposite sense (1) or equal sense (-1).

        The fold is a cylinder about an axis across the tape with the radius of the section. An additional turn makes the
        fold longer (Wuest, 1954; Seffen and Pellegrino, 1999).
        """
        return (1.0 + sense * NU) * self.plate * self.angle

    def edge_layer(self, sense: float) -> float:
        """Part of the steady moment that layers at both free edges take away, to first order.

        The flattened cylinder has the moment D (1 +- nu)/R across the tape, which is zero at a free edge. The layer is a
        beam on an elastic foundation E t/R^2 with the decay length l = (4 D R^2/(E t))^(1/4). Both edges release the energy
        D (1 +- nu)^2 l/R^2 per length. Without these layers the fold has the moment D (1 +- nu) a/R, so the relative loss is
        (1 +- nu) l/(R a).
        """
        decay = (4.0 * self.plate * RADIUS**2 / (YOUNG * self.thickness)) ** 0.25
        return (1.0 + sense * NU) * decay / (RADIUS * self.angle)


STEEL = Tape(0.1e-3, math.radians(110.0))
"""Steel tape."""


def tape_spring(
    turn: float, mesh: tuple[int, int], sense: float = 1.0, length: float = 80e-3
) -> dict[str, Any]:
    """Case of half of a tape spring whose end turns by `turn` (rad), in opposite sense (1) or in equal sense (-1).

    `length` (m) is the length of the half, and `mesh` gives the numbers of cells along and across.
    """
    middle = [[-1e-6, -1e-6, -1e-6], [1e-6, 1e-6, 1e-6]]
    sheet = {
        "kind": "tape-spring", "length": length, "radius": RADIUS, "subtended_angle": STEEL.angle,
        "thickness": STEEL.thickness, "facets": "flexible", "mesh": list(mesh), "mesh_grading": [0, 1],
        "support": [{"at": "edge left", "mirror": "x"}, {"at": middle, "fixed": ["y", "z"]}],
    }  # fmt: skip
    return {
        "sheet": sheet,
        "material": {"young": YOUNG, "poisson": NU, "density": DENSITY, "damping": 1e-3},
        "drive": [{"edge": "right", "axis": [0.0, -sense, 0.0], "turn": turn, "rate": 0.1, "guide": False}],
        "solve": {"method": "static", "rtol": 1e-4},
        "save": {"interval": 0.2},
    }
