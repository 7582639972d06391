"""Vector operations of time steps, each in one loop over the degrees of freedom."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def copy_into(values: np.ndarray, out: np.ndarray) -> None:
    """Copy an array to another of the same shape. An assignment to a slice would compile code for messages about wrong
    shapes, which takes seconds.
    """
    source, target = values.reshape(-1), out.reshape(-1)
    for i in range(target.shape[0]):
        target[i] = source[i]


@kernel
def subtracted(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a - b, (n,)."""
    out = np.empty(a.shape[0])
    for i in range(a.shape[0]):
        out[i] = a[i] - b[i]
    return out


@kernel
def scaled(factor: float, vector: np.ndarray) -> np.ndarray:
    """c v, (n,)."""
    out = np.empty(vector.shape[0])
    for i in range(vector.shape[0]):
        out[i] = factor * vector[i]
    return out


@kernel
def inner(a: np.ndarray, b: np.ndarray) -> float:
    """Scalar product of two (n,) arrays."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@kernel
def predict(
    h: float, alpha_m: float, alpha_f: float, beta: float, gamma: float,
    old_a: np.ndarray, u: np.ndarray, rate: np.ndarray, slope: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Predict x, u, a and u' (n,) at the end of a step, with a constant slope of u'; `old_a` is a_n."""
    n = u.shape[0]
    x, later_u, a, later_rate = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        later_rate[i] = rate[i] + h * slope[i]
        a[i] = ((1.0 - alpha_f) * later_rate[i] + alpha_f * rate[i] - alpha_m * old_a[i]) / (1.0 - alpha_m)
        x[i] = h * u[i] + h * h * ((0.5 - beta) * old_a[i] + beta * a[i])
        later_u[i] = u[i] + h * ((1.0 - gamma) * old_a[i] + gamma * a[i])
    return x, later_u, a, later_rate


@kernel
def correct(
    dx: np.ndarray, by_u: float, by_a: float, by_rate: float, x: np.ndarray, u: np.ndarray, a: np.ndarray, rate: np.ndarray
) -> None:
    """Add an increment dx (n,) to x, and the increments that follow from it to u, a and u', in place."""
    for i in range(dx.shape[0]):
        x[i] += dx[i]
        u[i] += by_u * dx[i]
        a[i] += by_a * dx[i]
        rate[i] += by_rate * dx[i]


@kernel
def newton_weight(resolved: np.ndarray, rtol_by_u: float, velocity: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Inverse tolerances (n,) of Newton's method: of x, and of u by its change with x."""
    out = np.empty(u.shape[0])
    for i in range(u.shape[0]):
        out[i] = 1.0 / min(resolved[i], rtol_by_u * (velocity[i] + abs(u[i])))
    return out


@kernel
def slope_and_bend(
    rate: np.ndarray, old_rate: np.ndarray, old_slope: np.ndarray, h: float, before: float
) -> tuple[np.ndarray, np.ndarray]:
    """u'' and u''' (n,) from u' at both ends of a step and from the slope over the previous step, of size `before`."""
    slope, bend = np.empty(rate.shape[0]), np.empty(rate.shape[0])
    for i in range(rate.shape[0]):
        slope[i] = (rate[i] - old_rate[i]) / h
        bend[i] = 2.0 * (slope[i] - old_slope[i]) / (h + before)
    return slope, bend


@kernel
def start_a(rate: np.ndarray, shift: float, slope: np.ndarray, a: np.ndarray) -> None:
    """a = u' + shift u'', written to `a` (n,)."""
    for i in range(rate.shape[0]):
        a[i] = rate[i] + shift * slope[i]


@kernel
def moved(x: np.ndarray, part: float, dx: np.ndarray) -> np.ndarray:
    """x + part dx, (n,)."""
    out = np.empty(x.shape[0])
    for i in range(x.shape[0]):
        out[i] = x[i] + part * dx[i]
    return out


@kernel
def end_velocity(x: np.ndarray, h: float, u: np.ndarray) -> np.ndarray:
    """Velocity (n,) at the end of a step whose mean is x/h."""
    out = np.empty(x.shape[0])
    for i in range(x.shape[0]):
        out[i] = 2.0 * x[i] / h - u[i]
    return out


@kernel
def changed_rate(x: np.ndarray, h: float, u: np.ndarray) -> np.ndarray:
    """Mean acceleration (n,) of a step whose mean velocity is x/h."""
    out = np.empty(x.shape[0])
    for i in range(x.shape[0]):
        out[i] = (2.0 / h) * (x[i] / h - u[i])
    return out


@kernel
def mean_balance(one: np.ndarray, two: np.ndarray, inertial: np.ndarray) -> np.ndarray:
    """Mean of two forces minus the inertial force, (n,)."""
    out = np.empty(one.shape[0])
    for i in range(one.shape[0]):
        out[i] = 0.5 * (one[i] + two[i]) - inertial[i]
    return out


@kernel
def kept(data: np.ndarray, factor: float, first: bool, memory: np.ndarray) -> None:
    """Write factor * data to the memory if `first`, else write memory + factor * data to the data."""
    values, stored = data.reshape(-1), memory.reshape(-1)
    for i in range(values.shape[0]):
        if first:
            stored[i] = factor * values[i]
        else:
            values[i] = stored[i] + factor * values[i]
