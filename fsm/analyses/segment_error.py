"""Error of a strip that its segments cause, from the curvature that they do not resolve.

A joint of two segments measures the mean curvature k of its length l. The energy of the curvature about this mean,
(dk)^2 l/12 with the change dk from joint to joint, is left out, so a panel is too soft by this part of its energy. The
force of the trial strip (contact and friction included) is off by 1.2 to 1.6 times this part with 80 to 10 segments per
panel, and by 2.6 times with 5. The stated error is twice the part.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.rotation import multiply
from fsm.results.solution import Solution
from fsm.segments.system import SegmentSystem

__all__ = ["segment_error", "unresolved_bending"]

_FACTOR = 2.0
"""Stated error of the force over the unresolved part of the energy."""
_FEWEST = 3
"""Smallest number of segments of a panel whose change of curvature is known."""


def segment_error(solution: Solution, system: SegmentSystem, travel: float) -> float | None:
    """Error of the force at a travel (m) of the first drive, over the force; None without bending panels."""
    record = int(np.argmin(np.abs(solution.travel[:, 0] - travel)))
    part = unresolved_bending(system, solution.q[record])
    return None if part is None else _FACTOR * part


def unresolved_bending(system: SegmentSystem, q: np.ndarray) -> float | None:
    """Part of the bending energy of all panels that segments do not resolve; None if no panel bends.

    Parameters
    ----------
    system : SegmentSystem
    q : (nq,) array
    """
    rows = {body: row for row, body in enumerate(system.bodies.free.tolist())}
    poses = system.body_poses(q)
    panels: dict[int, list[tuple[int, float]]] = {}
    for body, plate, panel in system.bodies.plates:
        if panel and body in rows:
            panels.setdefault(panel, []).append((rows[body], plate.length))
    left_out = whole = 0.0
    for segments in panels.values():
        if len(segments) < _FEWEST:
            continue
        turns = _turns(poses[[row for row, _ in segments]])
        lengths = np.array([length for _, length in segments])
        cells = 0.5 * (lengths[1:] + lengths[:-1])
        curvature = turns / cells[:, None]
        whole += float(np.sum(curvature**2 * cells[:, None]))
        between = 0.5 * (cells[1:] + cells[:-1])
        left_out += float(np.sum(np.diff(curvature, axis=0) ** 2 * between[:, None])) / 12.0
    return left_out / whole if whole > 0.0 else None


def _turns(poses: np.ndarray) -> np.ndarray:
    """Rotations from each segment to the next, (n - 1, 1 or 3), rad; small ones."""
    if poses.shape[1] == 3:
        return np.diff(poses[:, 2])[:, None]
    inverse = poses[:-1, 3:] * np.array([1.0, -1.0, -1.0, -1.0])
    relative = multiply(inverse, poses[1:, 3:])
    return np.asarray(2.0 * np.where(relative[:, :1] < 0.0, -1.0, 1.0) * relative[:, 1:])
