"""Bodies that overlap at the start: which, how deep, and how to move them apart."""

from __future__ import annotations

import numpy as np

from fsm.segments.system import SegmentSystem

__all__ = ["overlaps", "separate"]

_NOTHING = 1e-6
"""Depth over the typical length that is no overlap."""
_ROUNDS = 2000


def overlaps(system: SegmentSystem) -> list[tuple[str, float]]:
    """Names of the pairs that overlap at the start, and how deep at the worst place, m; the deepest first."""
    poses, _ = system.place(0.0, system.initial()[0], None)
    depth = np.zeros(len(system.pair_names))
    for group in system.contacts:
        touching = group.geometry.find(poses, 0.0)
        np.maximum.at(depth, group.geometry.pair[touching.slot], -touching.gap)
    deep = [k for k in np.argsort(-depth, kind="stable") if depth[k] > _NOTHING * system.scales().length]
    return [(system.pair_names[k], float(depth[k])) for k in deep]


def separate(system: SegmentSystem) -> np.ndarray:
    """Initial configuration with overlaps taken out by moving bodies apart, the lighter ones more.

    In every round each contact asks for the move that closes its overlap with the least kinetic energy, and a body takes
    the mean of what it is asked for. Springs are not asked: they are strained by the move.

    Returns
    -------
    (nq,) array
        With overlaps left if the rounds do not do, or nothing can move.
    """
    q, _ = system.initial()
    deepest = _NOTHING * system.scales().length
    for _ in range(_ROUNDS):
        poses, rates = system.place(0.0, q, None)
        move, asked = np.zeros(rates.shape), np.zeros(len(rates))
        worst = 0.0
        for group in system.contacts:
            touching = group.geometry.find(poses, 0.0)
            if not len(touching.slot):
                continue
            measured = group.geometry.measure(poses, rates, touching)
            mobility = group.mobility[measured.bodies]
            gradient = measured.gradient[:, 0].reshape(mobility.shape)
            flexible = (gradient**2 * mobility).sum(axis=(1, 2))
            push = np.where(flexible > 0.0, -touching.gap / np.maximum(flexible, 1e-300), 0.0)
            np.add.at(move, measured.bodies, push[:, None, None] * mobility * gradient)
            np.add.at(asked, measured.bodies, 1.0)
            worst = max(worst, float(-touching.gap.min()))
        if worst < 0.5 * deepest:
            return q
        move /= np.maximum(asked, 1.0)[:, None]
        q = system.retract(q, move[system.bodies.free].ravel())
    return q
