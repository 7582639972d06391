"""Broyden's good updates of the inverse of a tangent that is reused in several iterations of Newton's method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.solve.stepping.vectors import copy_into, inner

_CURVED = 0.1
"""Smallest ratio of the predicted change to a correction for which an update is made."""
_PAIRS, _LAST = 0, 1


class Secants(NamedTuple):
    """Updates since the last tangent.

    Attributes
    ----------
    weight : (n,) array
        Weight of the square of each increment.
    weighted, more : (most, n) arrays
        Vectors a and b of the updates dx + (a.dx) b.
    way, whole : (n,) arrays
        Applied part of the last correction, and the whole correction.
    counts : (2,) int array
        Number of updates, and 1 if there is a last correction.
    """

    weight: np.ndarray
    weighted: np.ndarray
    more: np.ndarray
    way: np.ndarray
    whole: np.ndarray
    counts: np.ndarray


@shared
def no_secants(weight: np.ndarray, most: int) -> Secants:
    """Space for at most `most` updates."""
    n = weight.shape[0]
    return Secants(
        weight, np.empty((most, n)), np.empty((most, n)), np.empty(n), np.empty(n), np.zeros(2, dtype=np.int64)
    )


@shared
def clear(secants: Secants) -> None:
    """Remove all updates, after a new tangent."""
    secants.counts[_PAIRS] = secants.counts[_LAST] = 0


@kernel
def _updated(dx: np.ndarray, weighted: np.ndarray, more: np.ndarray, count: int) -> np.ndarray:
    out = dx.copy()
    for k in range(count):
        factor = inner(weighted[k], out)
        for i in range(out.shape[0]):
            out[i] += factor * more[k, i]
    return out


@kernel
def _learn(
    dx: np.ndarray, weight: np.ndarray, way: np.ndarray, whole: np.ndarray, weighted: np.ndarray, more: np.ndarray
) -> bool:
    """Write an update; false if the correction `dx` shows no curvature since the last correction."""
    along = length = 0.0
    for i in range(dx.shape[0]):
        weighted[i] = weight[i] * way[i]
        along += weighted[i] * (whole[i] - dx[i])
        length += weighted[i] * way[i]
    if not along > _CURVED * length:
        return False
    for i in range(dx.shape[0]):
        more[i] = (way[i] - (whole[i] - dx[i])) / along
    return True


@shared
def improved(secants: Secants, dx: np.ndarray) -> np.ndarray:
    """Correction dx by the tangent, improved by the updates of all iterations since that tangent."""
    counts, weighted, more = secants.counts, secants.weighted, secants.more
    dx, k = _updated(dx, weighted, more, counts[_PAIRS]), counts[_PAIRS]
    if counts[_LAST] == 0 or k == weighted.shape[0]:
        return dx
    if _learn(dx, secants.weight, secants.way, secants.whole, weighted[k], more[k]):
        counts[_PAIRS] = k + 1
        dx = _updated(dx, weighted[k : k + 1], more[k : k + 1], 1)
    return dx


@shared
def add(secants: Secants, way: np.ndarray, whole: np.ndarray) -> None:
    """Store the applied part `way` of a correction and the whole correction."""
    copy_into(way, secants.way)
    copy_into(whole, secants.whole)
    secants.counts[_LAST] = 1
