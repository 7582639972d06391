"""Bodies that overlap at the start: which, how deep, and how to move them apart."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from fsm.segments.system import SegmentSystem

__all__ = ["overlaps", "separate", "shallowest"]

_NOTHING = 1e-6
"""Depth over the typical length that is no overlap."""
_ROUNDS = 50


def shallowest(system: SegmentSystem) -> float:
    """Depth from which on bodies count as overlapping, m."""
    return _NOTHING * system.scales().length


def overlaps(system: SegmentSystem) -> list[tuple[str, float]]:
    """Names of the pairs that overlap at the start, and how deep at the worst place, m; the deepest first."""
    poses, _ = system.place(0.0, system.initial()[0], None)
    depth = np.zeros(len(system.pair_names))
    for group in system.contacts:
        touching = group.geometry.find(poses, 0.0)
        np.maximum.at(depth, group.geometry.pair[touching.slot], -touching.gap)
    deep = [k for k in np.argsort(-depth, kind="stable") if depth[k] > shallowest(system)]
    return [(system.pair_names[k], float(depth[k])) for k in deep]


def separate(system: SegmentSystem) -> np.ndarray:
    """Initial configuration with overlaps taken out by moving bodies apart, the lighter ones more.

    Every round makes the move of the least kinetic energy that closes all overlaps as they look from here, and opens no
    others; since gaps are curved a few rounds are needed. Springs are not asked: they are strained by the move.

    Returns
    -------
    (nq,) array
        With overlaps left if the rounds do not do, or there is no such move.
    """
    q, _ = system.initial()
    deepest = shallowest(system)
    for _ in range(_ROUNDS):
        poses, rates = system.place(0.0, q, None)
        worst = max(float(-group.geometry.find(poses, 0.0).gap.min(initial=0.0)) for group in system.contacts)
        if worst < 0.5 * deepest:
            return q
        slopes, gaps = _constraints(system, poses, rates, 2.0 * worst)
        root = np.sqrt(system.contacts[0].impacts.mobility)
        step = _shortest(slopes * root.ravel(), 0.25 * deepest - gaps)
        if step is None:
            return q
        q = system.retract(q, (step.reshape(root.shape) * root)[system.bodies.free].ravel())
    return q


def _constraints(
    system: SegmentSystem, poses: np.ndarray, rates: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Gradients (m, bodies * size) and gaps (m,), m, of all contacts that are nearer than `reach`."""
    slopes, gaps = [np.zeros((0, rates.size))], [np.zeros(0)]
    for group in system.contacts:
        near = group.geometry.find(poses, min(reach, group.geometry.margin))
        if not len(near.slot):
            continue
        measured = group.geometry.measure(poses, rates, near)
        rows = np.zeros((len(near.slot), *rates.shape))
        gradient = measured.gradient[:, 0].reshape(*measured.bodies.shape, rates.shape[1])
        # the two bodies of a piece of surface may be one
        np.add.at(rows, (np.arange(len(rows))[:, None], measured.bodies), gradient)
        slopes.append(rows.reshape(len(rows), -1))
        gaps.append(near.gap)
    return np.concatenate(slopes), np.concatenate(gaps)


def _shortest(slopes: np.ndarray, least: np.ndarray) -> np.ndarray | None:
    """The shortest y with slopes y >= least; None if there is none (Lawson and Hanson 1974, chapter 23)."""
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
