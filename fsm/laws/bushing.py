"""Linear spring and damper: the bushing law."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel

__all__ = ["bushing", "bushing_energy"]


@kernel
def bushing(
    value: np.ndarray, rate: np.ndarray, rest: np.ndarray, stiffness: np.ndarray, damping: np.ndarray
) -> np.ndarray:
    """Effort k (x - x0) + c x' of every component.

    Parameters
    ----------
    value, rate, rest, stiffness, damping : (m, k) arrays
        Deformation x, its rate x', its force-free value x0, stiffness k and damping c.

    Returns
    -------
    (m, k) array
        N for translations, N m for rotations.
    """
    return stiffness * (value - rest) + damping * rate


@kernel
def bushing_energy(
    value: np.ndarray, rate: np.ndarray, rest: np.ndarray, stiffness: np.ndarray, damping: np.ndarray
) -> tuple[np.ndarray, float]:
    """Potential energy of each element, sum of 1/2 k (x - x0)^2, (m,), J, and dissipated power of all, sum of c x'^2, W."""
    energy = np.zeros(value.shape[0])
    power = 0.0
    for i in range(value.shape[0]):
        for j in range(value.shape[1]):
            energy[i] += 0.5 * stiffness[i, j] * (value[i, j] - rest[i, j]) ** 2
            power += damping[i, j] * rate[i, j] ** 2
    return energy, power
