"""Kernels of rotational springs about lines: folds, and creases of films.

The vectors a and b across a line and c along it are sums of nodal vectors. The moment acts along the gradient of the
rotation psi of `fsm.model.nodes.facets.fold_angle`. `fsm.model.nodes.facets.folds` defines the law.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.pieces import program_at
from fsm.kernels.programs import Pieces
from fsm.laws.crease import CreaseLaws, elastic_effort, openings_of
from fsm.laws.crease_sliders import Sliders, slider_energy, slider_moments
from fsm.model.nodes.facets.fold_angle import fold_angle, fold_gradient, fold_hessian

TOUCHING = 0.05
"""Part of the range from `linear_to` to 180 degrees in which facets nearly touch, its end."""
TOUCH_RISE = 100.0
"""Factor of the energy of facets that nearly touch. Larger values make impacts smoother, and move states at rest more."""


class FoldCurves(NamedTuple):
    """Laws of m folds without memory.

    Attributes
    ----------
    curves : CreaseLaws
    share : (m,) array
        Factor s of each curve.
    rise : (m,) array, N m/rad
        Stiffness k_r; empty if p is pi.
    linear_to : (1,) array, rad
        Angle p; pi: never reached.
    """

    curves: CreaseLaws
    share: np.ndarray
    rise: np.ndarray
    linear_to: np.ndarray


class FoldPath(NamedTuple):
    """Parts of the laws of m folds that depend on time or on the path.

    Attributes
    ----------
    turning : (m,) array, N m, or empty
        Stiffness times the change of the rest angle at the factor 1.
    time : factor of `turning`
    chosen : (n,) int array
        Folds of the sliders.
    sliders : Sliders of unit shares
    """

    turning: np.ndarray
    time: Pieces
    chosen: np.ndarray
    sliders: Sliders


class FoldArrays(NamedTuple):
    """Arrays of m folds.

    Attributes
    ----------
    vectors : (m, v) int array
        First coordinates of the nodal vectors.
    weights : (m, 3, v) array
        Factors of these nodal vectors in the vectors a, b and c of a fold.
    near : (m,) array, rad
        Angles are taken within half a turn of this value.
    damping : (m,) array, N m s/rad
        s_d.
    law : FoldCurves
    path : FoldPath
    """

    vectors: np.ndarray
    weights: np.ndarray
    near: np.ndarray
    damping: np.ndarray
    law: FoldCurves
    path: FoldPath


@kernel
def fold_effort(law: FoldCurves, i: int, angle: float) -> tuple[float, float, float]:
    """Energy, moment and slope of a fold at its angle; NaN where facets have met."""
    share, limit = law.share[i], law.linear_to[0]
    energy, moment, slope = elastic_effort(law.curves, i, angle)
    energy, moment, slope = share * energy, share * moment, share * slope
    over = abs(angle) - limit
    if limit >= math.pi or over <= 0.0:
        return energy, moment, slope
    k, c, left = law.rise[i], 0.5 * math.pi / (math.pi - limit), math.pi - abs(angle)
    y = c * left if left > 0.0 else math.nan
    sine, side = math.sin(y), math.copysign(1.0, angle)
    energy += k * (-math.log(sine) / (c * c) - 0.5 * over * over)
    moment += side * k * (1.0 / (math.tan(y) * c) - over)
    slope += k * (1.0 / (sine * sine) - 1.0)
    w = TOUCHING * (math.pi - limit) / left
    if w > 1.0:
        z, rise = w - 1.0, TOUCH_RISE * k / (c * c)
        energy += rise * z**3
        moment += side * 3.0 * rise * z * z * w / left
        slope += 6.0 * rise * z * w * (w + z) / (left * left)
    return energy, moment, slope


@kernel
def fold_efforts(law: FoldCurves, angle: np.ndarray) -> np.ndarray:
    """Energy (J), moment (N m) and slope (N m/rad) of every fold at its angle, (3, m)."""
    out = np.empty((3, angle.shape[0]))
    for i in range(angle.shape[0]):
        out[0, i], out[1, i], out[2, i] = fold_effort(law, i, angle[i])
    return out


@kernel
def fold_moments(
    law: FoldCurves, path: FoldPath, damping: np.ndarray, t: float, angle: np.ndarray, rate: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Moments (m,) against the fold angle, N m, and their slopes, N m/rad."""
    efforts = fold_efforts(law, angle)
    moment, slope = efforts[1], efforts[2]
    if path.chosen.shape[0] > 0:
        slip, steepness = slider_moments(path.sliders, openings_of(law.curves, path.chosen, angle))
        for i in range(slip.shape[0]):
            k = path.chosen[i]
            moment[k] -= law.curves.side[k] * law.share[k] * slip[i]
            slope[k] += law.share[k] * steepness[i]
    if path.turning.shape[0] > 0:
        factor = program_at(path.time, 0, t)[0]
        for k in range(moment.shape[0]):
            moment[k] -= factor * path.turning[k]
    for k in range(moment.shape[0]):
        moment[k] += damping[k] * rate[k]
    return moment, slope


@kernel
def slider_energies(
    law: FoldCurves, path: FoldPath, t: float, angle: np.ndarray, rate: np.ndarray, per_second: float, other: np.ndarray
) -> tuple[float, float]:
    """Energy (J) and dissipated power (W) of all sliders; arguments as in `slider_energy`, with fold angles."""
    if path.chosen.shape[0] == 0:
        return 0.0, 0.0
    change = np.empty(path.chosen.shape[0])
    for i in range(change.shape[0]):
        change[i] = -law.curves.side[path.chosen[i]] * rate[path.chosen[i]]
    kept, lost = slider_energy(
        path.sliders, t, openings_of(law.curves, path.chosen, angle), change, per_second,
        openings_of(law.curves, path.chosen, other),
    )  # fmt: skip
    stored = power = 0.0
    for i in range(change.shape[0]):
        share = law.share[path.chosen[i]]
        stored += share * kept[i]
        power += share * lost[i]
    return stored, power


@kernel(inline=True)
def _gather(folds: FoldArrays, k: int, q: np.ndarray, v: np.ndarray) -> None:
    """Vectors a, b, c (3, 3) of one fold, or their rates."""
    for p in range(3):
        for a in range(3):
            total = 0.0
            for i in range(folds.vectors.shape[1]):
                total += folds.weights[k, p, i] * q[folds.vectors[k, i] + a]
            v[p, a] = total


@kernel
def fold_angles(folds: FoldArrays, q: np.ndarray) -> np.ndarray:
    """Fold angle of every fold, (m,), rad."""
    v, out = np.empty((3, 3)), np.empty(folds.vectors.shape[0])
    for k in range(out.shape[0]):
        _gather(folds, k, q, v)
        out[k] = fold_angle(v, folds.near[k])
    return out


@kernel
def fold_states(folds: FoldArrays, q: np.ndarray, states: np.ndarray) -> None:
    """Compute states (m, 19) of all folds: angle, gradient (9) with respect to a, b, c, second result of `fold_gradient`."""
    v = np.empty((3, 3))
    for k in range(folds.vectors.shape[0]):
        _gather(folds, k, q, v)
        states[k, 0] = fold_angle(v, folds.near[k])
        fold_gradient(v, states[k, 1:10], states[k, 10:19])


@kernel(inline=True)
def _rate(gradient: np.ndarray, rates: np.ndarray) -> float:
    """Rate of an angle from its gradient (9,) and the rates (3, 3) of a, b, c."""
    total = 0.0
    for p in range(3):
        for a in range(3):
            total += gradient[3 * p + a] * rates[p, a]
    return total


@kernel
def fold_rates(folds: FoldArrays, states: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Rates of all angles, (m,), rad/s."""
    v, out = np.empty((3, 3)), np.empty(states.shape[0])
    for k in range(states.shape[0]):
        _gather(folds, k, u, v)
        out[k] = _rate(states[k, 1:10], v)
    return out


@kernel
def add_moments(folds: FoldArrays, states: np.ndarray, moment: np.ndarray, force: np.ndarray) -> None:
    """Add the forces of moments (m,) against the angles."""
    for k in range(folds.vectors.shape[0]):
        for i in range(folds.vectors.shape[1]):
            for a in range(3):
                total = 0.0
                for p in range(3):
                    total += folds.weights[k, p, i] * states[k, 1 + 3 * p + a]
                force[folds.vectors[k, i] + a] -= moment[k] * total


@kernel(inline=True)
def _add_block(weights: np.ndarray, slots: np.ndarray, size: int, block: np.ndarray, flat: np.ndarray) -> None:
    """Add a matrix (9, 9) by a, b, c to the flat block data, as a matrix by the nodal vectors."""
    width = slots.shape[0]
    for i in range(width):
        for p in range(3):
            if weights[p, i] == 0.0:
                continue
            for j in range(width):
                for o in range(3):
                    factor = weights[p, i] * weights[o, j]
                    if factor == 0.0:
                        continue
                    for a in range(3):
                        for b in range(3):
                            flat[slots[i, j] + a * size + b] += factor * block[3 * p + a, 3 * o + b]


@kernel
def add_tangents(
    folds: FoldArrays, q: np.ndarray, u: np.ndarray, states: np.ndarray, moment: np.ndarray, slope: np.ndarray,
    turning: np.ndarray, damping: np.ndarray, slots: np.ndarray, size: int, into_stiffness: np.ndarray,
    into_damping: np.ndarray,
) -> None:  # fmt: skip
    """Add -dh/dq and -dh/du to the flat block data.

    Parameters
    ----------
    folds : FoldArrays
    q, u : (n,) arrays
        Coordinates, and rates where `turning` is not zero.
    states : see `fold_states`
    moment, slope : (m,) arrays
        Moments against the angles, and their slopes.
    turning, damping : (m,) arrays, N m s/rad
        Dampers whose rates depend on q by u, and all dampers.
    slots : (m, v, v) int array, see `ElementGroup.add_linearised`
    size : size of the blocks
    into_stiffness, into_damping : flat block data
    """
    v, rates, hessian, block = np.empty((3, 3)), np.zeros((3, 3)), np.empty((9, 9)), np.empty((9, 9))
    for k in range(folds.vectors.shape[0]):
        gradient = states[k, 1:10]
        _gather(folds, k, q, v)
        fold_hessian(v, gradient, states[k, 10:19], hessian)
        if turning[k] != 0.0:
            _gather(folds, k, u, rates)
        for j in range(9):
            turned = slope[k] * gradient[j]
            if turning[k] != 0.0:
                turned += turning[k] * _rate(hessian[j], rates)
            for i in range(9):
                block[i, j] = gradient[i] * turned + moment[k] * hessian[i, j]
        _add_block(folds.weights[k], slots[k], size, block, into_stiffness)
        if damping[k] != 0.0:
            for i in range(9):
                for j in range(9):
                    block[i, j] = damping[k] * gradient[i] * gradient[j]
            _add_block(folds.weights[k], slots[k], size, block, into_damping)
