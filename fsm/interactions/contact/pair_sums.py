"""Sums of forces, areas and powers over the contacts of every pair of faces."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

FORCE, AREA, FRICTION, CARRIED, SLIDING, DAMPING = range(6)
"""Number of rows of the sums."""


@kernel
def sums_of_pairs(
    pair: np.ndarray,
    slot: np.ndarray,
    area: np.ndarray,
    part: np.ndarray,
    normal: np.ndarray,
    pull: np.ndarray,
    elastic: np.ndarray,
    rate: np.ndarray,
    effort: np.ndarray,
    n_pairs: int,
) -> np.ndarray:
    """Sums over the contacts of every pair, (6, n_pairs).

    Parameters
    ----------
    pair, area : (n_slots,) arrays
        Pair number and represented area (m^2) of every slot.
    slot, part, normal, pull, elastic : (count,) arrays
        Slot, weight of its area, normal force of the law (N), force on the bodies over it, and normal force of the law at
        rest (N) of every contact.
    rate : (count, 1 + c) array, m/s
        Rate of the gap, slip velocity.
    effort : (count, c) array, N
        Friction.

    Returns
    -------
    (6, n_pairs) array
        Normal force (N); area (m^2); magnitudes of friction (N); slip speed times normal force (W); power dissipated by
        friction, and power of the damping of the normal force (W).
    """
    sums = np.zeros((6, n_pairs))
    for i in range(slot.shape[0]):
        of, square, slip, power = pair[slot[i]], 0.0, 0.0, 0.0
        for k in range(effort.shape[1]):
            square += effort[i, k] ** 2
            slip += rate[i, 1 + k] ** 2
            power += effort[i, k] * rate[i, 1 + k]
        sums[FORCE, of] += normal[i] * pull[i]
        sums[AREA, of] += area[slot[i]] * part[i]
        sums[FRICTION, of] += np.sqrt(square)
        sums[CARRIED, of] += normal[i] * pull[i] * np.sqrt(slip)
        sums[SLIDING, of] += power
        sums[DAMPING, of] += (elastic[i] - normal[i]) * rate[i, 0]
    return sums


@kernel
def smallest_gaps(pair: np.ndarray, slot: np.ndarray, value: np.ndarray, gap: np.ndarray) -> None:
    """Reduce the gaps (n_pairs,) of pairs to the smallest value (count,) of their slots."""
    for i in range(slot.shape[0]):
        of = pair[slot[i]]
        gap[of] = min(gap[of], value[i])
