"""Kernels of folds and creases in a compiled model (`ArrayModel`), called by their addresses; see
`fsm.model.nodes.arrays`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at
from fsm.kernels.programs import Pieces
from fsm.laws.crease import CreaseLaws, crease_laws_of, openings_of
from fsm.laws.crease_sliders import Sliders, accept_sliders, sliders_of
from fsm.model.nodes.arrays import DAMPING, FORCE, MEAN_OVER, NOW, NUMBERS, STIFFNESS, Q, U
from fsm.model.nodes.facets.fold_kernels import (
    FoldArrays,
    FoldCurves,
    FoldPath,
    add_force,
    add_tangent,
    dissipation,
    fold_states,
    path_powers,
    stored_energy,
)

_CURVES = 4
_LAW = _CURVES + len(CreaseLaws._fields)
_TURNING = _LAW + len(FoldCurves._fields) - 1
_CHOSEN = _TURNING + 1 + len(Pieces._fields)
_SLOTS = _CHOSEN + 1 + len(Sliders._fields)
"""Rows of a group's table; the last is after those of `FoldArrays`."""


def fold_table(folds: FoldArrays) -> list[np.ndarray]:
    """Arrays of folds in the order of the rows of a table."""
    law, path = folds.law, folds.path
    return [*folds[:4], *law.curves, *law[1:], path.turning, *path.time, path.chosen, *path.sliders]


@kernel
def _folds_of(t: np.ndarray) -> FoldArrays:
    law = FoldCurves(
        crease_laws_of(t, _CURVES), floats_1d(t, _LAW), floats_1d(t, _LAW + 1), floats_1d(t, _LAW + 2)
    )
    path = FoldPath(
        floats_1d(t, _TURNING), pieces_at(t, _TURNING + 1), integers_1d(t, _CHOSEN), sliders_of(t, _CHOSEN + 1)
    )
    return FoldArrays(integers_2d(t, 0), floats_3d(t, 1), floats_1d(t, 2), floats_1d(t, 3), law, path)


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    numbers = floats_1d(table, NUMBERS)
    add_force(
        _folds_of(own), floats_1d(table, Q), floats_1d(table, U), moving, numbers[MEAN_OVER], numbers[NOW],
        floats_1d(table, FORCE),
    )  # fmt: skip
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    folds, stiffness, damping = _folds_of(own), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    (count, width), numbers = folds.vectors.shape, floats_1d(table, NUMBERS)
    add_tangent(
        folds, floats_1d(table, Q), floats_1d(table, U), moving, numbers[MEAN_OVER], numbers[NOW],
        integers_2d(own, _SLOTS).reshape(count, width, width), stiffness.shape[1], floats_1d(table, FORCE),
        stiffness.reshape(-1), damping.reshape(-1),
    )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return stored_energy(_folds_of(own), floats_1d(table, Q))


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    if moving == 0.0:
        return 0.0
    return dissipation(_folds_of(own), floats_1d(table, Q), floats_1d(table, U), floats_1d(table, NUMBERS)[MEAN_OVER])


@kernel
def _put_in(table: np.ndarray, own: np.ndarray, step: float) -> float:
    n = floats_1d(table, NUMBERS)
    return path_powers(_folds_of(own), floats_1d(table, Q), floats_1d(table, U), n[NOW], step, n[MEAN_OVER])[0]


@kernel
def _slid(table: np.ndarray, own: np.ndarray, step: float) -> float:
    n = floats_1d(table, NUMBERS)
    return path_powers(_folds_of(own), floats_1d(table, Q), floats_1d(table, U), n[NOW], step, n[MEAN_OVER])[1]


FOLDS = (_force, _tangent, _stored, _lost, _put_in, _slid)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""


@kernel
def commit_folds(table: np.ndarray, own: np.ndarray, t: float) -> float:
    """Store the fold angles and the sliders of an accepted state."""
    folds = _folds_of(own)
    states = np.empty((folds.vectors.shape[0], 19))
    fold_states(folds, floats_1d(table, Q), states)
    for k in range(states.shape[0]):
        folds.near[k] = states[k, 0]
    if folds.path.chosen.shape[0] > 0:
        accept_sliders(folds.path.sliders, t, openings_of(folds.law.curves, folds.path.chosen, states[:, 0]))
    return 0.0
