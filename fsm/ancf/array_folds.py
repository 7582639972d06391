"""Kernels of folds and creases in a compiled model (`ArrayModel`), called by their addresses; see `fsm.ancf.arrays`."""

from __future__ import annotations

import numpy as np

from fsm.ancf.arrays import DAMPING, FORCE, STIFFNESS, Q, U
from fsm.ancf.crease_line import CreaseLineGroup
from fsm.ancf.fold_kernels import (
    FoldArrays,
    FoldCurves,
    add_force,
    add_tangent,
    dissipation,
    fold_states,
    stored_energy,
)
from fsm.ancf.folds import FoldGroup
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.laws.crease import CreaseLaws

__all__ = ["FOLDS", "arrays_of_folds", "commit_folds", "fold_table"]

_SLOTS = 15
"""Row of a group's table after those of `FoldArrays`."""


def fold_table(folds: FoldArrays) -> list[np.ndarray]:
    """Arrays of folds in the order of the rows of a table."""
    law = folds.law
    return [*folds[:4], *law.curves, *law[1:]]


def arrays_of_folds(group: FoldGroup | CreaseLineGroup, slots: np.ndarray) -> list[np.ndarray]:
    """Arrays of a group in the order of the rows of its table; `slots` as in `ElementGroup.add_linearised`."""
    count, width = slots.shape[:2]
    return [*fold_table(group.arrays), np.ascontiguousarray(slots).reshape(count * width, width)]


@kernel
def _folds_of(t: np.ndarray) -> FoldArrays:
    curves = CreaseLaws(
        floats_1d(t, 4), floats_1d(t, 5), floats_1d(t, 6), integers_1d(t, 7), integers_1d(t, 8), floats_1d(t, 9),
        floats_2d(t, 10), floats_1d(t, 11),
    )  # fmt: skip
    law = FoldCurves(curves, floats_1d(t, 12), floats_1d(t, 13), floats_1d(t, 14))
    return FoldArrays(integers_2d(t, 0), floats_3d(t, 1), floats_1d(t, 2), floats_1d(t, 3), law)


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    add_force(_folds_of(own), floats_1d(table, Q), floats_1d(table, U), moving, floats_1d(table, FORCE))
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    folds, stiffness, damping = _folds_of(own), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    count, width = folds.vectors.shape
    add_tangent(
        folds, floats_1d(table, Q), floats_1d(table, U), moving, integers_2d(own, _SLOTS).reshape(count, width, width),
        stiffness.shape[1], floats_1d(table, FORCE), stiffness.reshape(-1), damping.reshape(-1),
    )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return stored_energy(_folds_of(own), floats_1d(table, Q))


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    if moving == 0.0:
        return 0.0
    return dissipation(_folds_of(own), floats_1d(table, Q), floats_1d(table, U))


FOLDS = (_force, _tangent, _stored, _lost)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""


@kernel
def commit_folds(table: np.ndarray, own: np.ndarray, t: float) -> float:
    """Store the fold angles of an accepted state."""
    folds = _folds_of(own)
    states = np.empty((folds.vectors.shape[0], 19))
    fold_states(folds, floats_1d(table, Q), states)
    for k in range(states.shape[0]):
        folds.near[k] = states[k, 0]
    return 0.0
