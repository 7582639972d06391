"""Error of the drive force of a strip that its segments cause, from the energy that they do not resolve.

The deformation of a joint is the difference of the mean angles of its two segments. The curvature k is an average over two
segments, so the energy EI (dk)^2 l/12 of each change dk from joint to joint is neglected. Segments are straight: an arc is
shorter along its chord by k^2 l^3/24, and the normal force N does the work N k^2 l^3/24. At a crease the curvature is
extrapolated geometrically, because it decays beside the crease of a taut panel.

The neglected energy e changes the force at a given travel s by de/ds to the first order (Hellmann-Feynman). The derivative
is along the equilibrium path, whose direction is K^-1 dh/ds. On pulled strips without friction, 10 to 40 segments per panel
give an error of the force of 0.6 to 1.4 times de/ds. The stated error is twice de/ds. Where K is not positive definite, or
with friction, the relative error is twice the ratio of e to the bending energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.builders.strip import bending_stiffness
from fsm.case.models.case import Strip
from fsm.case.models.materials import Material
from fsm.errors import NotConverged
from fsm.kernels.rotation import multiply
from fsm.model.system.system import SegmentSystem
from fsm.results.solution import Solution
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import negative_pivots

_FACTOR = 2.0
"""Ratio of the stated error of the force to its first-order estimate."""
_FEWEST = 3
"""Smallest number of segments of a panel for which the change of curvature is computed."""
_STEEPEST = 4.0
"""Largest ratio of changes of curvature from one segment to the next that is used to extrapolate the curvature at a
crease."""
_REACH = 1e-4
"""Length of the central differences along the path, relative to the span."""
_AT_END = 1e-9
"""Time before the end at which the speed of a drive is evaluated, relative to the end time. At the end the drive is at
rest."""


@dataclass(frozen=True)
class Unresolved:
    """Energy that the segments do not resolve, and the bending energy of all panels, J."""

    left_out: float
    bending: float

    @property
    def part(self) -> float | None:
        """Neglected part of the bending energy; None if no panel bends."""
        return abs(self.left_out) / self.bending if self.bending > 0.0 else None


class SegmentError:
    """Errors of the force of a strip that its segments cause.

    Parameters
    ----------
    system : SegmentSystem
    strip : Strip
    material : Material
    """

    def __init__(self, system: SegmentSystem, strip: Strip, material: Material) -> None:
        self.system = system
        self.bending = bending_stiffness(strip, material)
        self.stretching = material.young * strip.width * strip.thickness
        self.rows = {body: row for row, body in enumerate(system.bodies.free.tolist())}
        panels: dict[int, list[tuple[int, float]]] = {}
        for body, plate, panel in system.bodies.plates:
            if panel and body in self.rows:
                panels.setdefault(panel, []).append((self.rows[body], plate.length))
        alike: dict[int, list[list[tuple[int, float]]]] = {}
        for segments in panels.values():
            if len(segments) > _FEWEST:
                alike.setdefault(len(segments), []).append(segments)
        # rows and lengths (p, n) of all panels with equally many segments
        self.panels = [
            (np.array([[r for r, _ in s] for s in one]), np.array([[length for _, length in s] for s in one]))
            for one in alike.values()
        ]

    def at(self, solution: Solution, travel: float, force: float) -> float | None:
        """Error of the force at a travel of the first drive, N; None without bending panels.

        Parameters
        ----------
        solution : Solution
        travel, force : m, N
        """
        travels = solution.travel[:, 0]
        record = int(np.argmin(np.abs(travels - travel)))
        if not record and len(travels) > 1:  # a strip that is initially straight gives no error estimate
            record = 1
        q = solution.q[record]
        part = self.unresolved(q).part
        if part is None:
            return None
        friction = np.any(solution.pair_friction[record])
        change = None if friction else self._change(float(solution.time[record]), q)
        return _FACTOR * (part * abs(force) if change is None else abs(change))

    def unresolved(self, q: np.ndarray) -> Unresolved:
        """Energy that the segments do not resolve at a configuration.

        Parameters
        ----------
        q : (nq,) array
        """
        poses = self.system.body_poses(q)
        left_out = whole = 0.0
        for rows, lengths in self.panels:
            turns, opening = _turns(poses[rows]), _openings(poses[rows], lengths)
            cells = 0.5 * (lengths[:, 1:] + lengths[:, :-1])
            curvature, normal = turns / cells, self.stretching * opening / cells
            between = 0.5 * (cells[:, 1:] + cells[:, :-1])
            left_out += self.bending * float(np.sum(np.diff(curvature) ** 2 * between)) / 12.0
            left_out += float(np.sum(normal * curvature**2 * cells**3)) / 24.0
            whole += 0.5 * self.bending * float(np.sum(curvature**2 * cells))
            ends = (curvature, normal[:, 0], cells[:, 0]), (curvature[:, ::-1], normal[:, -1], cells[:, -1])
            for k, tension, cell in ends:
                change = _continued(k)
                square = (k[:, 0] + change) ** 2
                left_out += float(np.sum(self.bending * change**2 * cell / 12.0 + tension * square * cell**3 / 48.0))
                whole += 0.25 * self.bending * float(np.sum(square * cell))
        return Unresolved(left_out, whole)

    def _change(self, time: float, q: np.ndarray) -> float | None:
        """Change of the neglected energy per travel, N; None where the stiffness is not positive definite."""
        system, solver = self.system, LinearSolver()
        if negative_pivots(system, time, q, solver):
            return None
        program = system.motions[0].program
        earlier = min(time, program.end_time) * (1.0 - _AT_END)
        speed = program.at(earlier)[1]
        try:
            velocity = solver.solve(system.force_rate(earlier, q))
        except NotConverged:
            return None
        size = float(np.abs(velocity / system.scales().span).max(initial=0.0))
        if not size > 0.0 or not speed:
            return None
        step = _REACH / size
        after, before = (self.unresolved(system.retract(q, way * step * velocity)) for way in (1.0, -1.0))
        return (after.left_out - before.left_out) / (2.0 * step * speed)


def _continued(curvature: np.ndarray) -> np.ndarray:
    """Changes of curvature from the first joint of each panel to its crease, (p,), 1/m, from curvatures (p, n)."""
    first, second = curvature[:, 0] - curvature[:, 1], curvature[:, 1] - curvature[:, 2]
    decays = (first * second > 0.0) & (first * curvature[:, 0] > 0.0)
    ratio = np.divide(first, second, out=np.ones_like(first), where=decays)
    return np.asarray(first * np.clip(ratio, 1.0, _STEEPEST))


def _turns(poses: np.ndarray) -> np.ndarray:
    """Rotations about the crease direction from each segment of panels (p, n) to the next, (p, n - 1), rad; the rotations
    must be small.
    """
    if poses.shape[2] == 3:
        return np.diff(poses[:, :, 2])
    inverse = poses[:, :-1, 3:] * np.array([1.0, -1.0, -1.0, -1.0])
    relative = multiply(inverse, poses[:, 1:, 3:])
    return np.asarray(2.0 * np.where(relative[:, :, 0] < 0.0, -1.0, 1.0) * relative[:, :, 2])


def _openings(poses: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Separations of neighbouring segments of panels (p, n) at their joints along the panel, (p, n - 1), m."""
    if poses.shape[2] == 3:
        place, angle = poses[:, :, :2], poses[:, :, 2]
        along = np.stack([np.cos(angle), -np.sin(angle)], axis=2)
    else:
        place, (w, x, y, z) = poses[:, :, :3], np.moveaxis(poses[:, :, 3:], 2, 0)
        along = np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)], axis=2)
    half = 0.5 * lengths[:, :, None] * along
    apart = (place[:, 1:] - half[:, 1:]) - (place[:, :-1] + half[:, :-1])
    return np.asarray(np.sum(apart * 0.5 * (along[:, 1:] + along[:, :-1]), axis=2))
