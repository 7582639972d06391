"""Independent program for the forces of the rotating squares: dense matrices, angles in the usual sense, plain Newton steps.

A ligament is a function of its length D, the angle g of its chord from the mean of both squares, and their relative rotation
p. `springs` and `beams` are the laws of a case. `beams(terms=2)` adds to the cubic deflection of a beam the next symmetric
shape x^2 (1 - x)^2, whose size minimises the energy; this shows the error of the cubic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

COLUMNS, ROWS = 4, 6
SPACING, GAP, ANGLE = 15.0, 2.25, np.deg2rad(20.0)
Law = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Start lengths (m,) and measures (m, 3) of ligaments -> slopes (m, 3) and second derivatives (m, 3, 3) of their energy."""


def springs(axial: float, shear: float, rotational: float) -> Law:
    """Three springs at a ligament of the length of the gap: N/mm, N/mm, N mm/rad."""
    stiffness = np.array([axial, shear * GAP**2, rotational])

    def law(length: np.ndarray, measures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        change = measures - np.column_stack([length, 0.0 * length, 0.0 * length])
        return stiffness * change, np.tile(np.diag(stiffness), (len(length), 1, 1))

    return law


def beams(young: float, thickness: float, width: float, clamp: float, terms: int = 1) -> Law:
    """Clamped beams of the length gap + 2 clamp: N/mm^2 and mm."""
    length = GAP + 2.0 * clamp
    axial, turning = young * width * thickness / length, young * width * thickness**3 / 12.0 / length

    def law(start: np.ndarray, measures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        stretch, g, p = measures[:, 0] - start, measures[:, 1], measures[:, 2]
        size = np.zeros(len(p))
        for _ in range(30 if terms == 2 else 0):
            slope = length * (2.0 * size / 105.0 - p / 30.0)
            force = axial * (stretch + length * (g**2 / 10.0 + p**2 / 24.0 - p * size / 30.0 + size**2 / 105.0))
            stiffness = 0.8 * turning + axial * slope**2 + force * length * 2.0 / 105.0
            size = size - (0.8 * turning * size + force * slope) / stiffness
        force = axial * (stretch + length * (g**2 / 10.0 + p**2 / 24.0 - p * size / 30.0 + size**2 / 105.0))
        by = np.column_stack([np.ones(len(p)), length * g / 5.0, length * (p / 12.0 - size / 30.0)])
        slopes = force[:, None] * by + np.column_stack([0.0 * p, 12.0 * turning * g, turning * p])
        second = axial * by[:, :, None] * by[:, None, :]
        second[:, 1, 1] += 12.0 * turning + force * length / 5.0
        second[:, 2, 2] += turning + force * length / 12.0
        if terms == 2:
            slope = length * (2.0 * size / 105.0 - p / 30.0)
            mixed = axial * slope[:, None] * by - np.column_stack([0.0 * p, 0.0 * p, force * length / 30.0])
            stiffness = 0.8 * turning + axial * slope**2 + force * length * 2.0 / 105.0
            second -= mixed[:, :, None] * mixed[:, None, :] / stiffness[:, None, None]
        return slopes, second

    return law


@dataclass
class Squares:
    """The sample, held at the bottom row and moved at the top row.

    Attributes
    ----------
    law : Law
    clamp : float, mm
        Depth inside the squares at which the ligaments begin.
    free_height : bool
        Whether the top row may move normal to its direction, as one and without rotation.
    """

    law: Law
    clamp: float = 0.0
    free_height: bool = False

    def __post_init__(self) -> None:
        number = np.arange(COLUMNS * ROWS).reshape(ROWS, COLUMNS)
        row, column = np.divmod(number.ravel(), COLUMNS)
        self.centre = SPACING * np.column_stack([column, row]).astype(float)
        turn = np.where((row + column) % 2 == 0, -ANGLE, ANGLE)
        self.one = np.concatenate([number[:, :-1].ravel(), number[:-1].ravel()])
        self.other = np.concatenate([number[:, 1:].ravel(), number[1:].ravel()])
        along = np.where(np.arange(len(self.one)) < ROWS * (COLUMNS - 1), 0.0, 0.5 * np.pi)
        radius = (SPACING - GAP) / (2.0 * np.cos(ANGLE))
        inward = self.clamp * _unit(along)
        self.arm_one = radius * _unit(along + turn[self.one]) - inward
        self.arm_other = inward - radius * _unit(along + turn[self.other])
        chord = self.centre[self.other] + self.arm_other - self.centre[self.one] - self.arm_one
        self.length, self.angle = np.hypot(*chord.T), np.arctan2(chord[:, 1], chord[:, 0])
        self.top = number[-1]
        self.state = np.zeros(3 * number.size)

    def forces(self, direction: tuple[float, float], travel: list[float]) -> np.ndarray:
        """Forces on the top row along a direction, N, at travels in mm, in steps of at most 0.26 mm."""
        way, normal = np.array(direction), np.array([-direction[1], direction[0]])
        map_ = np.zeros((len(self.state), 3 * COLUMNS * (ROWS - 2) + 1))
        inner = np.arange(3 * COLUMNS, 3 * COLUMNS * (ROWS - 1))
        map_[inner, np.arange(len(inner))] = 1.0
        for k in range(2):
            map_[3 * self.top + k, -1] = normal[k]
        if not self.free_height:
            map_ = map_[:, :-1]
        found, at = [], 0.0
        for wanted in travel:
            for step in np.linspace(at, wanted, max(1, int(np.ceil((wanted - at) / 0.26))) + 1)[1:]:
                moved = self.state.reshape(-1, 3)[self.top, :2]
                self.state.reshape(-1, 3)[self.top, :2] += (step - moved @ way)[:, None] * way
                self._settle(map_)
            at = wanted
            found.append(float((self._assembled()[0].reshape(-1, 3)[self.top, :2] @ way).sum()))
        return np.array(found)

    def _settle(self, map_: np.ndarray) -> None:
        for _ in range(60):
            force, stiffness = self._assembled()
            residual = map_.T @ force
            if np.abs(residual).max() < 1e-9:
                return
            change = np.linalg.solve(map_.T @ stiffness @ map_, -residual)
            self.state += map_ @ change * min(1.0, 0.5 / np.abs(change).max())
        raise RuntimeError("no equilibrium found")

    def _assembled(self) -> tuple[np.ndarray, np.ndarray]:
        """Slopes and second derivatives of the energy with respect to the displacements and rotations of all squares."""
        measures, first, second = self._measures()
        slope, curvature = self.law(self.length, measures)
        force, stiffness = np.zeros(len(self.state)), np.zeros((len(self.state),) * 2)
        places = np.column_stack([3 * self.one[:, None] + np.arange(3), 3 * self.other[:, None] + np.arange(3)])
        np.add.at(force, places, np.einsum("mk,mkj->mj", slope, first))
        blocks = np.einsum("mki,mkl,mlj->mij", first, curvature, first) + np.einsum("mk,mkij->mij", slope, second)
        np.add.at(stiffness, (places[:, :, None], places[:, None, :]), blocks)
        return force, stiffness

    def _measures(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Measures (m, 3), and their first (m, 3, 6) and second (m, 3, 6, 6) derivatives."""
        place = self.state.reshape(-1, 3)
        arm_one, arm_other = _turned(place[self.one, 2], self.arm_one), _turned(place[self.other, 2], self.arm_other)
        chord = (self.centre + place[:, :2])[self.other] + arm_other - (self.centre + place[:, :2])[self.one] - arm_one
        length = np.hypot(*chord.T)
        n = chord / length[:, None]
        w = np.column_stack([-n[:, 1], n[:, 0]])
        turn_one, turn_other = place[self.one, 2], place[self.other, 2]
        angle = np.arctan2(chord[:, 1], chord[:, 0]) - self.angle - 0.5 * (turn_one + turn_other)
        by = np.zeros((len(length), 2, 6))
        by[:, 0, 0] = by[:, 1, 1] = -1.0
        by[:, 0, 3] = by[:, 1, 4] = 1.0
        by[:, :, 2] = -np.column_stack([-arm_one[:, 1], arm_one[:, 0]])
        by[:, :, 5] = np.column_stack([-arm_other[:, 1], arm_other[:, 0]])
        along, across = np.einsum("mi,mij->mj", n, by), np.einsum("mi,mij->mj", w, by)
        first = np.zeros((len(length), 3, 6))
        first[:, 0], first[:, 1] = along, across / length[:, None]
        first[:, 1, [2, 5]] -= 0.5
        first[:, 2, 2], first[:, 2, 5] = -1.0, 1.0
        second = np.zeros((len(length), 3, 6, 6))
        second[:, 0] = across[:, :, None] * across[:, None, :] / length[:, None, None]
        mixed = across[:, :, None] * along[:, None, :]
        second[:, 1] = -(mixed + mixed.transpose(0, 2, 1)) / length[:, None, None] ** 2
        for k, arm, sign in ((2, arm_one, 1.0), (5, arm_other, -1.0)):
            second[:, 0, k, k] += sign * np.sum(n * arm, axis=1)
            second[:, 1, k, k] += sign * np.sum(w * arm, axis=1) / length
        return np.column_stack([length, angle, turn_other - turn_one]), first, second


def _unit(angle: np.ndarray) -> np.ndarray:
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _turned(angle: np.ndarray, vector: np.ndarray) -> np.ndarray:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.column_stack([cosine * vector[:, 0] - sine * vector[:, 1], sine * vector[:, 0] + cosine * vector[:, 1]])
