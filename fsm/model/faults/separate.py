"""Overlaps of bodies at the start: names, depths, and displacements that remove them."""

from __future__ import annotations

import numpy as np

from fsm.model.system.system import SegmentSystem

_NOTHING = 1e-6
"""Tolerance of overlaps, relative to the typical length."""
_ROUNDS = 50


def shallowest(system: SegmentSystem) -> float:
    """Depth above which bodies count as overlapping, m."""
    return _NOTHING * system.scales().length


def overlaps(system: SegmentSystem) -> list[tuple[str, float]]:
    """Names of the pairs that overlap at the start, and their largest depths, m; deepest first."""
    poses, _ = system.place(0.0, system.initial()[0], None)
    depth = np.zeros(len(system.pair_names))
    for group in system.contacts:
        touching = group.geometry.find(poses, 0.0)
        np.maximum.at(depth, group.geometry.pair[touching.slot], -touching.gap)
    deep = [k for k in np.argsort(-depth, kind="stable") if depth[k] > shallowest(system)]
    return [(system.pair_names[k], float(depth[k])) for k in deep]


def separate(system: SegmentSystem) -> np.ndarray:
    """Initial configuration after overlaps are removed by displacements; lighter bodies move farther.

    Each iteration computes the displacement of least kinetic energy that closes all linearised overlaps and opens no new
    one. Gaps are nonlinear, so a few iterations are needed. Forces of springs are not considered; the displacement deforms
    the springs.

    Returns
    -------
    (nq,) array
        Some overlaps remain if the iterations do not converge or no such displacement exists.
    """
    q, _ = system.initial()
    deepest = shallowest(system)
    for _ in range(_ROUNDS):
        poses, rates = system.place(0.0, q, None)
        worst = max(float(-group.geometry.find(poses, 0.0).gap.min(initial=0.0)) for group in system.contacts)
        if worst < 0.5 * deepest:
            return q
        slopes, gaps = _constraints(system, poses, rates, 2.0 * worst)
        root = np.sqrt(system.contacts[0].mobility)
        step = _shortest(slopes * root.ravel(), 0.25 * deepest - gaps)
        if step is None:
            return q
        q = system.retract(q, (step.reshape(root.shape) * root)[system.bodies.free].ravel())
    return q


def _constraints(
    system: SegmentSystem, poses: np.ndarray, rates: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Gradients (m, bodies * size) and gaps (m,), m, of all contacts with gaps below `reach`."""
    slopes, gaps = [np.zeros((0, rates.size))], [np.zeros(0)]
    for group in system.contacts:
        below = min(reach, group.geometry.margin)
        near = group.geometry.find(poses, below)
        if not len(near.slot):
            continue
        measured = group.geometry.measure(poses, rates, below)
        rows = np.zeros((len(near.slot), *rates.shape))
        gradient = measured.gradient[:, 0].reshape(*measured.bodies.shape, rates.shape[1])
        # a surface piece may contain the same body twice
        np.add.at(rows, (np.arange(len(rows))[:, None], measured.bodies), gradient)
        slopes.append(rows.reshape(len(rows), -1))
        gaps.append(near.gap)
    return np.concatenate(slopes), np.concatenate(gaps)


def _shortest(slopes: np.ndarray, least: np.ndarray) -> np.ndarray | None:
    """Shortest vector y with slopes y >= least; None if no solution exists (Lawson and Hanson 1974, chapter 23)."""
    from scipy.optimize import nnls  # SciPy's solver is imported here, because few cases need it and the import takes long

    norms = np.linalg.norm(slopes, axis=1)
    moves = norms > 1e-12 * norms.max(initial=0.0)
    if np.any(least[~moves] > 0.0) or not moves.any():
        return None
    slopes, least = slopes[moves] / norms[moves, None], least[moves] / norms[moves]
    scale = float(np.abs(least).max())
    dual = np.vstack([slopes.T, least / scale])
    target = np.zeros(len(dual))
    target[-1] = 1.0
    weights, residual = nnls(dual, target, maxiter=30 * dual.shape[1])
    if residual < 1e-8:
        return None
    left = dual @ weights - target
    return np.asarray(-scale * left[:-1] / left[-1])
