"""Kernels of folds and creases in a compiled model (`ArrayModel`), called by their addresses; see
`fsm.model.nodes.arrays`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at, program_at
from fsm.kernels.programs import Pieces
from fsm.laws.crease import CreaseLaws, crease_laws_of, openings_of
from fsm.laws.crease_sliders import Sliders, accept_sliders, sliders_of
from fsm.model.nodes.arrays import DAMPERS, DAMPING, FORCE, IN_MOTION, LAST, MEAN_OVER, NOW, NUMBERS, STIFFNESS, Q, U
from fsm.model.nodes.facets import fold_kernels
from fsm.model.nodes.facets.fold_kernels import FoldArrays, FoldCurves, FoldPath
from fsm.solve.stepping.vectors import copy_into, scaled

_CURVES = 4
_LAW = _CURVES + len(CreaseLaws._fields)
_TURNING = _LAW + len(FoldCurves._fields) - 1
_CHOSEN = _TURNING + 1 + len(Pieces._fields)
MOMENTS = _CHOSEN + 1 + len(Sliders._fields)
_SLOTS = MOMENTS + 1
"""Rows of a group's table; after those of `FoldArrays` come the moments (m,) of the last evaluated forces."""


def fold_table(folds: FoldArrays) -> list[np.ndarray]:
    """Arrays of folds in the order of the rows of a table."""
    law, path, moments = folds.law, folds.path, np.zeros(len(folds.vectors))
    return [*folds[:4], *law.curves, *law[1:], path.turning, *path.time, path.chosen, *path.sliders, moments]


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
def _states(table: np.ndarray, folds: FoldArrays) -> np.ndarray:
    """States (m, 19) of all folds, see `fold_states`."""
    states = np.empty((folds.vectors.shape[0], 19))
    fold_kernels.fold_states(folds, floats_1d(table, Q), states)
    return states


@kernel
def _rates(table: np.ndarray, folds: FoldArrays, states: np.ndarray, moving: float) -> np.ndarray:
    """Rates of all angles, rad/s: zero at rest, means over a quasi-static step, else those at the velocities."""
    if moving < IN_MOTION:
        return np.zeros(states.shape[0])
    mean_over = floats_1d(table, NUMBERS)[MEAN_OVER]
    if mean_over == 0.0:
        return fold_kernels.fold_rates(folds, states, floats_1d(table, U))
    out = fold_kernels.fold_angles(folds, floats_1d(table, LAST))
    for k in range(out.shape[0]):
        out[k] = (states[k, 0] - out[k]) / mean_over
    return out


@kernel
def _moments(table: np.ndarray, own: np.ndarray, states: np.ndarray, moving: float) -> tuple[np.ndarray, np.ndarray]:
    """Add the forces of all folds; returns their moments and slopes."""
    folds = _folds_of(own)
    rates = _rates(table, folds, states, moving)
    if moving == DAMPERS:
        moment = folds.damping * rates
        fold_kernels.add_moments(folds, states, moment, floats_1d(table, FORCE))
        return moment, scaled(0.0, moment)
    moment, slope = fold_kernels.fold_moments(
        folds.law, folds.path, folds.damping, floats_1d(table, NUMBERS)[NOW], states[:, 0].copy(), rates
    )
    fold_kernels.add_moments(folds, states, moment, floats_1d(table, FORCE))
    copy_into(moment, floats_1d(own, MOMENTS))
    return moment, slope


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _moments(table, own, _states(table, _folds_of(own)), moving)
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    folds, stiffness, damping = _folds_of(own), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    states, (count, width), size = _states(table, folds), folds.vectors.shape, stiffness.shape[1]
    moment, slope = _moments(table, own, states, moving)
    dampers = scaled(1.0 if moving >= IN_MOTION else 0.0, folds.damping)
    turning = dampers if floats_1d(table, NUMBERS)[MEAN_OVER] == 0.0 else scaled(0.0, dampers)
    fold_kernels.add_tangents(
        folds, floats_1d(table, Q), floats_1d(table, U), states, moment, slope, turning, dampers,
        integers_2d(own, _SLOTS).reshape(count, width, width), size, stiffness.reshape(-1), damping.reshape(-1),
    )  # fmt: skip
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    folds = _folds_of(own)
    angle, total = fold_kernels.fold_angles(folds, floats_1d(table, Q)), 0.0
    for k in range(angle.shape[0]):
        total += fold_kernels.fold_effort(folds.law, k, angle[k])[0]
    return total + fold_kernels.slider_energies(folds.law, folds.path, 0.0, angle, angle, 0.0, angle)[0]


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    if moving == 0.0:
        return 0.0
    folds, power = _folds_of(own), 0.0
    rates = _rates(table, folds, _states(table, folds), 1.0)
    for k in range(rates.shape[0]):
        power += folds.damping[k] * rates[k] * rates[k]
    return power


@kernel
def _put_in(table: np.ndarray, own: np.ndarray, step: float) -> float:
    """Input power of moving rest angles, W."""
    folds, power = _folds_of(own), 0.0
    if folds.path.turning.shape[0] > 0:
        rates = _rates(table, folds, _states(table, folds), 1.0)
        factor = program_at(folds.path.time, 0, floats_1d(table, NUMBERS)[NOW])[0]
        for k in range(rates.shape[0]):
            power += factor * folds.path.turning[k] * rates[k]
    return power


@kernel
def _slid(table: np.ndarray, own: np.ndarray, step: float) -> float:
    """Dissipated power of sliders, W."""
    folds, numbers = _folds_of(own), floats_1d(table, NUMBERS)
    if folds.path.chosen.shape[0] == 0:
        return 0.0
    states, mean_over = _states(table, folds), numbers[MEAN_OVER]
    angle, rates = states[:, 0].copy(), _rates(table, folds, states, 1.0)
    other, per_second = angle, 1.0 / step if step > 0.0 else 0.0
    if mean_over != 0.0:
        other, per_second = fold_kernels.fold_angles(folds, floats_1d(table, LAST)), 1.0 / mean_over
    return fold_kernels.slider_energies(folds.law, folds.path, numbers[NOW], angle, rates, per_second, other)[1]


FOLDS = (_force, _tangent, _stored, _lost, _put_in, _slid)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""


@kernel
def commit_folds(table: np.ndarray, own: np.ndarray, t: float) -> float:
    """Store the fold angles and the sliders of an accepted state."""
    folds = _folds_of(own)
    angle = fold_kernels.fold_angles(folds, floats_1d(table, Q))
    copy_into(angle, folds.near)
    if folds.path.chosen.shape[0] > 0:
        accept_sliders(folds.path.sliders, t, openings_of(folds.law.curves, folds.path.chosen, angle))
    return 0.0
