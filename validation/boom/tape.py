"""Case of a tape spring in bending, and the theory of its folds.

The tape spring is one half of a symmetric one: its left edge lies in a plane of symmetry, where the fold forms. The right
edge is clamped in a rigid end, which turns and can translate, so that the bending moment is the same everywhere.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

import fsm

__all__ = ["DENSITY", "NU", "RADIUS", "STEEL", "YOUNG", "Tape", "arm_turns", "middle_line", "opening", "tape_spring"]

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
        return (1.0 + sense * NU) * self.decay(RADIUS) / (RADIUS * self.angle)

    def decay(self, radius: float) -> float:
        """Decay length of the layers at the free edges of a coil of this radius, m."""
        return float((4.0 * self.plate * radius**2 / (YOUNG * self.thickness)) ** 0.25)

    def coiled(self, radius: float) -> float:
        """Energy per length of a coil of this radius (m) on a hub, opposite sense, N.

        The cylinder has the curvatures 1/r along the tape and, relative to the section, 1/R across it. Layers at both free
        edges release the energy of the moment D (1/R + nu/r) across the tape, as in `edge_layer`. With r = R and without
        layers, the energy over a turn is (1 + nu) D a.
        """
        bent, flat = 1.0 / radius, 1.0 / RADIUS
        plate = 0.5 * self.plate * self.angle * RADIUS * (flat**2 + bent**2 + 2.0 * NU * flat * bent)
        return plate - self.plate * (flat + NU * bent) ** 2 * self.decay(radius)


STEEL = Tape(0.1e-3, math.radians(110.0))
"""Steel tape."""


def opening(
    length: float, turn: float, moment: float, times: np.ndarray, radius: float = RADIUS
) -> tuple[np.ndarray, np.ndarray]:
    """Turn (rad) of the arm of a tape spring that is let go, and its rate (rad/s), at the given times.

    The fold is an arc of the radius R whose start does not move, with the energy M q (Seffen and Pellegrino, 1999). It is
    half of a free fold, or a coil on a hub at rest. The arm is straight and rolls off the arc: the point at a distance s
    from the arc has the speed s dq/dt. With the mass m per length and the free length b = L - R q, the energy M q +
    m b^3 (dq/dt)^2/6 is constant.

    Parameters
    ----------
    length, turn, moment : L, m; q at the time 0, rad; M, N m
    times : (n,) array, s
        Increasing; the fold must still be there at the last time.
    radius : R, m
        Of the fold.
    """
    mass = DENSITY * STEEL.thickness * RADIUS * STEEL.angle

    def rates(_: float, state: np.ndarray) -> list[float]:
        free = length - radius * state[0]
        turning = 0.5 * mass * radius * free**2 * state[1] ** 2 - moment
        return [float(state[1]), turning / (mass * free**3 / 3.0)]

    found = solve_ivp(rates, (0.0, float(times[-1])), [turn, 0.0], t_eval=times, rtol=1e-9, atol=1e-12)
    return found.y[0], found.y[1]


def middle_line(shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places along the tape, m, and positions of the nodes in the middle of the section, from the start and a state."""
    first, last = (shape.reshape(-1, 3) for shape in shapes)
    on_top = np.abs(first[:, 1]) < 1e-9
    x, kept = np.unique(np.round(first[on_top, 0], 9), return_index=True)
    return x, last[on_top][kept]


def arm_turns(file: Path, step: int, outer: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) since the start of a step of a result, and the mean turn (rad) of the outer part of the middle line."""
    solution = fsm.open(file).solution
    number, time, turns = np.asarray(solution.step), np.asarray(solution.time), []
    for record in range(len(number)):
        x, line = middle_line(solution.shape[[0, record]])
        along = np.diff(line[x > (1.0 - outer) * x[-1]], axis=0)
        turns.append(np.unwrap(np.arctan2(along[:, 2], along[:, 0])).mean())
    kept = number >= step
    return time[kept] - time[~kept][-1], np.abs(np.unwrap(turns))[kept]


def tape_spring(
    turn: float, mesh: tuple[int, int], sense: float = 1.0, length: float = 80e-3, damping: float = 1e-3
) -> dict[str, Any]:
    """Case of half of a tape spring whose end turns by `turn` (rad), in opposite sense (1) or in equal sense (-1).

    `length` (m) is the length of the half, `mesh` gives the numbers of cells along and across, and `damping` is the
    Kelvin-Voigt time (s).
    """
    middle = [[-1e-6, -1e-6, -1e-6], [1e-6, 1e-6, 1e-6]]
    sheet = {
        "kind": "tape-spring", "length": length, "radius": RADIUS, "subtended_angle": STEEL.angle,
        "thickness": STEEL.thickness, "facets": "flexible", "mesh": list(mesh), "mesh_grading": [0, 1],
        "support": [{"at": "edge left", "mirror": "x"}, {"at": middle, "fixed": ["y", "z"]}],
    }  # fmt: skip
    return {
        "sheet": sheet,
        "material": {"young": YOUNG, "poisson": NU, "density": DENSITY, "damping": damping},
        "drive": [{"edge": "right", "axis": [0.0, -sense, 0.0], "turn": turn, "rate": 0.1, "guide": False}],
        "solve": {"method": "static", "rtol": 1e-4},
        "save": {"interval": 0.2},
    }
