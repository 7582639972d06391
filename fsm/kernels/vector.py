"""Products of 3-vectors, and comparisons of long vectors, without allocation."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def rotate(rotation: np.ndarray, vector: np.ndarray, out: np.ndarray) -> None:
    """Write the product of a matrix (3, 3) and a vector into `out` (3,)."""
    for i in range(3):
        out[i] = rotation[i, 0] * vector[0] + rotation[i, 1] * vector[1] + rotation[i, 2] * vector[2]


@kernel
def dot(a: np.ndarray, b: np.ndarray) -> float:
    """Scalar product of two 3-vectors."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@kernel
def cross(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """Write the vector product of two 3-vectors into `out` (3,)."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@kernel
def largest_ratio(vector: np.ndarray, scale: np.ndarray) -> float:
    """Largest ratio |v|/s of two (n,) arrays; 0 for empty arrays, NaN if a ratio is NaN."""
    largest = 0.0
    for i in range(vector.shape[0]):
        ratio = abs(vector[i]) / scale[i]
        if not ratio <= largest:
            largest = ratio
            if np.isnan(ratio):
                break
    return largest


@kernel
def equal_vectors(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two vectors are equal; NaN equals nothing."""
    equal = a.shape[0] == b.shape[0]
    i = 0
    while equal and i < a.shape[0]:
        equal = a[i] == b[i]
        i += 1
    return equal


@kernel
def largest_distance(a: np.ndarray, b: np.ndarray, scale: np.ndarray) -> float:
    """Largest |a - b|/s of (n,) arrays; 0 for empty arrays, NaN if a ratio is NaN."""
    largest = 0.0
    for i in range(a.shape[0]):
        ratio = abs(a[i] - b[i]) / scale[i]
        if not ratio <= largest:
            largest = ratio
            if np.isnan(ratio):
                break
    return largest


@kernel
def mean_ratio(vector: np.ndarray, scale: np.ndarray) -> float:
    """Root mean square of the ratios v/s of two (n,) arrays; 0 for empty arrays."""
    total = 0.0
    for i in range(vector.shape[0]):
        total += (vector[i] / scale[i]) ** 2
    return np.sqrt(total / max(vector.shape[0], 1))


@kernel
def weighted_mean_square(vector: np.ndarray, weight: np.ndarray) -> float:
    """Root mean square of the products of two (n,) arrays; 0 for empty arrays."""
    total = 0.0
    for i in range(vector.shape[0]):
        total += (vector[i] * weight[i]) ** 2
    return np.sqrt(total / max(vector.shape[0], 1))


@kernel
def error_norm(
    error_x: np.ndarray,
    error_u: np.ndarray,
    tolerance: np.ndarray,
    rtol: float,
    velocity: np.ndarray,
    u: np.ndarray,
    later_u: np.ndarray,
) -> float:
    """Error of a step over the tolerance, root mean square over all components.

    Parameters
    ----------
    error_x, error_u : (n,) arrays
        Local errors of increments and of velocities.
    tolerance : (n,) array
        Tolerance of the increments. The tolerance of the velocities is rtol (velocity + max(|u|, |later_u|)).
    rtol, velocity, u, later_u : relative tolerance, and (n,) arrays: scale, and velocities at both ends
    """
    total = 0.0
    for i in range(error_x.shape[0]):
        allowed = rtol * (velocity[i] + max(abs(u[i]), abs(later_u[i])))
        total += (error_x[i] / tolerance[i]) ** 2 + (error_u[i] / allowed) ** 2
    return np.sqrt(0.5 * total / max(error_x.shape[0], 1))
