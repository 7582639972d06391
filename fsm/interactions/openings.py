"""Openings between two bodies in space, of which ideal joints consist, with first and second derivatives.

    `ALONG`      x = a . (p_b - r_a) - c   a point p_b = r_b + A_b s of the second along an axis a = A_a a_0 of the first
    `ACROSS`     x = a . b - c             an axis of the first against an axis b = A_b b_0 of the second
    `DISTANCE`   x = (d . d/c - c)/2       d = p_b - p_a; near the length c this is |d| - c

    `TURN`       x = atan2(y, z) - c       z = a . b, y = (n x a) . b: the angle about n of b from a, from -pi to pi
    `LENGTH`     x = |d| - c               d = p_b - p_a; at d = 0 its derivatives count as zero
    `SCREW`      x = n . (p_b - r_a) - c - h angle, with the angle of `TURN` and any number of turns, so that |x| <= pi h

Constants of an opening, (14,): a_0 (of `DISTANCE` and `LENGTH` the point of the first body), then s or b_0, then c, then
(n x a)_0 of `TURN` and `SCREW`, then s and h of `SCREW`. Coordinates are
(dr, dtheta) of the first body, then of the second; dtheta in body axes. Row m, column n of the second derivatives is
d(gradient_m)/dx_n; they are not symmetric, because rotation increments do not commute.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels import tensor
from fsm.kernels.jit import kernel
from fsm.kernels.tensor import Matrix, Vector

ALONG, ACROSS, DISTANCE, TURN, LENGTH, SCREW = range(6)
"""Kinds of openings."""
CONSTANTS = 14
"""Numbers of an opening."""
_ROUND_OFF = 16.0 * float(np.finfo(float).eps)
"""Opening relative to the coordinates of which it is a difference, below which it is round-off and counts as zero. Round-off
of short steps would become large efforts."""


@kernel(inline=True)
def _dot(u: Vector, v: Vector) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@kernel(inline=True)
def _minus(v: Vector) -> Vector:
    return -v[0], -v[1], -v[2]


@kernel(inline=True)
def _put(v: Vector, gradient: np.ndarray, first: int) -> None:
    for k in range(3):
        gradient[first + k] = v[k]


@kernel
def _turn_twice(w: Vector, s: Vector, factor: float, hessian: np.ndarray, first: int) -> None:
    """Add factor (w s^T - (w . s) I), the second derivative of W . A s with w = A^T W, on the diagonal from `first`."""
    both = _dot(w, s)
    for i in range(3):
        for j in range(3):
            hessian[first + i, first + j] += factor * (w[i] * s[j] - (both if i == j else 0.0))


@kernel
def _turn_each(s: Vector, m: Matrix, v: Vector, factor: float, hessian: np.ndarray, row: int, column: int) -> None:
    """Add -factor [s] M [v] at (row, column), and its transpose at (column, row); [s] v = s x v."""
    for j in range(3):
        unit = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0)
        found = tensor.crossed(s, tensor.times_vector(m, tensor.crossed(v, unit)))
        for i in range(3):
            hessian[row + i, column + j] -= factor * found[i]
            hessian[column + j, row + i] -= factor * found[i]


@kernel
def _shift_and_turn(m: Matrix, v: Vector, factor: float, hessian: np.ndarray, row: int, column: int) -> None:
    """Add factor M [v] at (row, column) and its transpose at (column, row)."""
    for j in range(3):
        unit = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0)
        found = tensor.times_vector(m, tensor.crossed(v, unit))
        for i in range(3):
            hessian[row + i, column + j] += factor * found[i]
            hessian[column + j, row + i] += factor * found[i]


@kernel(inline=True)
def _resolved(x: float, size: float) -> float:
    return x if abs(x) > _ROUND_OFF * size else 0.0


@kernel(inline=True)
def _size(first: np.ndarray, second: np.ndarray, reach: Vector) -> float:
    """Sum of the coordinates of which an opening is a difference, m."""
    total = 0.0
    for k in range(3):
        total += abs(first[k]) + abs(second[k]) + abs(reach[k])
    return total


@kernel
def opening(
    kind: int, first: np.ndarray, second: np.ndarray, constants: np.ndarray, beyond: float, gradient: np.ndarray,
    hessian: np.ndarray,
) -> float:  # fmt: skip
    """Value of an opening beyond a value; writes its first (12,) and second (12, 12) derivatives.

    Parameters
    ----------
    kind : `ALONG`, `ACROSS`, `DISTANCE`, `TURN`, `LENGTH` or `SCREW`
    first, second : (7,) arrays
        Poses of the bodies.
    constants : (14,) array, see the module docstring
    beyond : value that is subtracted; angles are from -pi to pi afterwards
    gradient, hessian : (12,) and (12, 12) arrays, results
        No second derivatives are computed for an array (0, 12).
    """
    if kind == TURN:
        return _angle(first, second, constants, beyond, gradient, hessian)
    if kind == SCREW:
        return _screw(first, second, constants, beyond, gradient, hessian)
    return _difference(kind, first, second, constants, beyond, gradient, hessian)


@kernel
def bend(kind: int, first: np.ndarray, second: np.ndarray, constants: np.ndarray, rates: np.ndarray) -> float:
    """Second derivative in time of an opening at constant rates, m/s^2 or rad/s^2: rates . second derivatives . rates.

    `rates` (12,) are those of the coordinates of both bodies, m/s and rad/s in body axes; other arguments as of `opening`.
    """
    if kind in (ALONG, ACROSS):
        return _two_rates(kind, first, second, constants, rates)[2]
    if kind == TURN:
        return _bend_of_angle(first, second, constants, rates)
    if kind == SCREW:
        along = np.zeros(CONSTANTS)
        across = (constants[7], constants[8], constants[9])
        _put(tensor.crossed((constants[0], constants[1], constants[2]), across), along, 0)
        along[3:6], along[6] = constants[10:13], constants[6]
        moved = _two_rates(ALONG, first, second, along, rates)[2]
        return moved - constants[13] * _bend_of_angle(first, second, constants, rates)
    a, b = _turns_of(first, second)
    way, speed, bent = _moves(first, second, constants, rates, a, b)
    arm = tensor.times_vector(a, (constants[0], constants[1], constants[2]))
    spin = tensor.times_vector(a, (rates[3], rates[4], rates[5]))
    swung = tensor.crossed(spin, arm)
    way, speed, bent = _less(way, arm), _less(speed, swung), _less(bent, tensor.crossed(spin, swung))
    length = constants[6] if kind == DISTANCE else np.sqrt(_dot(way, way))
    if not length > 0.0:
        return 0.0
    found = (_dot(speed, speed) + _dot(way, bent)) / length
    return found - (_dot(way, speed) / length) ** 2 / length if kind == LENGTH else found


@kernel(inline=True)
def _less(u: Vector, v: Vector) -> Vector:
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


@kernel(inline=True)
def _turns_of(first: np.ndarray, second: np.ndarray) -> tuple[Matrix, Matrix]:
    """Rotations of both bodies."""
    return (
        tensor.quaternion_matrix((first[3], first[4], first[5], first[6])),
        tensor.quaternion_matrix((second[3], second[4], second[5], second[6])),
    )


@kernel
def _moves(
    first: np.ndarray, second: np.ndarray, constants: np.ndarray, rates: np.ndarray, a: Matrix, b: Matrix
) -> tuple[Vector, Vector, Vector]:
    """Vector from the place of the first body to the point of the second, with its two derivatives in time."""
    arm = tensor.times_vector(b, (constants[3], constants[4], constants[5]))
    spin = tensor.times_vector(b, (rates[9], rates[10], rates[11]))
    swung = tensor.crossed(spin, arm)
    return (
        (second[0] - first[0] + arm[0], second[1] - first[1] + arm[1], second[2] - first[2] + arm[2]),
        (rates[6] - rates[0] + swung[0], rates[7] - rates[1] + swung[1], rates[8] - rates[2] + swung[2]),
        tensor.crossed(spin, swung),
    )


@kernel
def _two_rates(
    kind: int, first: np.ndarray, second: np.ndarray, constants: np.ndarray, rates: np.ndarray
) -> tuple[float, float, float]:
    """`ALONG` or `ACROSS` without the constant c, and its two derivatives in time at constant rates."""
    a, b = _turns_of(first, second)
    axis = tensor.times_vector(a, (constants[0], constants[1], constants[2]))
    spin = tensor.times_vector(a, (rates[3], rates[4], rates[5]))
    turned = tensor.crossed(spin, axis)
    if kind == ALONG:
        way, speed, bent = _moves(first, second, constants, rates, a, b)
    else:
        way = tensor.times_vector(b, (constants[3], constants[4], constants[5]))
        other = tensor.times_vector(b, (rates[9], rates[10], rates[11]))
        speed = tensor.crossed(other, way)
        bent = tensor.crossed(other, speed)
    return (
        _dot(axis, way), _dot(turned, way) + _dot(axis, speed),
        _dot(tensor.crossed(spin, turned), way) + 2.0 * _dot(turned, speed) + _dot(axis, bent),
    )  # fmt: skip


@kernel
def _bend_of_angle(first: np.ndarray, second: np.ndarray, constants: np.ndarray, rates: np.ndarray) -> float:
    """`bend` of the kind `TURN`."""
    across = np.zeros(7)
    across[:3], across[3:6] = constants[7:10], constants[3:6]
    z, z_rate, z_bend = _two_rates(ACROSS, first, second, constants, rates)
    y, y_rate, y_bend = _two_rates(ACROSS, first, second, across, rates)
    size = y * y + z * z
    turning = 2.0 * (z * z_rate + y * y_rate) * (z * y_rate - y * z_rate)
    return (z * y_bend - y * z_bend) / size - turning / (size * size)


@kernel
def _angle(
    first: np.ndarray, second: np.ndarray, constants: np.ndarray, beyond: float, gradient: np.ndarray, hessian: np.ndarray
) -> float:
    """Opening of the kind `TURN`; see `opening`."""
    if hessian.shape[0] == 0:
        return _angle_and_gradient(first, second, constants, beyond, gradient)
    along, across = np.zeros(7), np.zeros(7)
    along[:6] = constants[:6]
    across[:3], across[3:6] = constants[7:10], constants[3:6]
    slope, bend = np.empty(12), np.empty(hessian.shape)
    z = _difference(ACROSS, first, second, along, 0.0, slope, bend)
    y = _difference(ACROSS, first, second, across, 0.0, gradient, hessian)
    size = y * y + z * z
    for m in range(hessian.shape[0]):
        for n in range(12):
            turned = (z * gradient[m] - y * slope[m]) * (z * slope[n] + y * gradient[n])
            hessian[m, n] = (z * hessian[m, n] - y * bend[m, n] + gradient[m] * slope[n] - slope[m] * gradient[n]) / size
            hessian[m, n] -= 2.0 * turned / (size * size)
    return _angle_and_gradient(first, second, constants, beyond, gradient)


@kernel
def _angle_and_gradient(
    first: np.ndarray, second: np.ndarray, constants: np.ndarray, beyond: float, gradient: np.ndarray
) -> float:
    """Value and first derivatives of an opening of the kind `TURN`."""
    own, across = (constants[0], constants[1], constants[2]), (constants[7], constants[8], constants[9])
    other = (constants[3], constants[4], constants[5])
    a, b = _turns_of(first, second)
    arm, axis, beside = tensor.times_vector(b, other), tensor.times_vector(a, own), tensor.times_vector(a, across)
    z, y = _dot(axis, arm), _dot(beside, arm)
    by_z, by_y = -y / (y * y + z * z), z / (y * y + z * z)
    seen, back = tensor.transposed_times_vector(a, arm), tensor.transposed_times_vector(b, axis)
    z_first, z_second = tensor.crossed(own, seen), tensor.crossed(other, back)
    y_first, y_second = tensor.crossed(across, seen), tensor.crossed(other, tensor.transposed_times_vector(b, beside))
    for k in range(3):
        gradient[k] = gradient[6 + k] = 0.0
        gradient[3 + k] = by_z * z_first[k] + by_y * y_first[k]
        gradient[9 + k] = by_z * z_second[k] + by_y * y_second[k]
    x = np.arctan2(y, z) - constants[6] - beyond
    x -= 2.0 * np.pi * np.round(x / (2.0 * np.pi))
    return _resolved(x, 1.0 + abs(constants[6] + beyond))


@kernel
def _screw(
    first: np.ndarray, second: np.ndarray, constants: np.ndarray, beyond: float, gradient: np.ndarray, hessian: np.ndarray
) -> float:
    """Opening of the kind `SCREW`; see `opening`."""
    turn, along, slope, bend = constants.copy(), np.zeros(CONSTANTS), np.empty(12), np.empty(hessian.shape)
    turn[6] = 0.0
    across = (constants[7], constants[8], constants[9])
    point = (constants[10], constants[11], constants[12])
    _put(tensor.crossed((constants[0], constants[1], constants[2]), across), along, 0)
    _put(point, along, 3)
    along[6] = constants[6]
    x, lead = _difference(ALONG, first, second, along, beyond, gradient, hessian), constants[13]
    x -= lead * _angle(first, second, turn, 0.0, slope, bend)
    for m in range(12):
        gradient[m] -= lead * slope[m]
    for m in range(hessian.shape[0]):
        for n in range(12):
            hessian[m, n] -= lead * bend[m, n]
    pitch = 2.0 * np.pi * lead
    return _resolved(x - pitch * np.round(x / pitch), _size(first, second, point) + abs(pitch) + abs(beyond))


@kernel
def _difference(
    kind: int, first: np.ndarray, second: np.ndarray, constants: np.ndarray, beyond: float, gradient: np.ndarray,
    hessian: np.ndarray,
) -> float:  # fmt: skip
    """Openings of the other kinds; see `opening`."""
    bends = hessian.shape[0] > 0
    if bends:
        hessian[:] = 0.0
    own = (constants[0], constants[1], constants[2])
    other = (constants[3], constants[4], constants[5])
    a = tensor.quaternion_matrix((first[3], first[4], first[5], first[6]))
    b = tensor.quaternion_matrix((second[3], second[4], second[5], second[6]))
    between = (second[0] - first[0], second[1] - first[1], second[2] - first[2])
    axis, arm = tensor.times_vector(a, own), tensor.times_vector(b, other)
    if kind == ACROSS:
        seen, back = tensor.transposed_times_vector(a, arm), tensor.transposed_times_vector(b, axis)
        for k in range(3):
            gradient[k] = gradient[6 + k] = 0.0
        _put(tensor.crossed(own, seen), gradient, 3)
        _put(tensor.crossed(other, back), gradient, 9)
        if bends:
            _turn_twice(seen, own, 1.0, hessian, 3)
            _turn_twice(back, other, 1.0, hessian, 9)
            _turn_each(own, tensor.transposed_times(a, b), other, 1.0, hessian, 3, 9)
        return _resolved(_dot(axis, arm) - constants[6] - beyond, 1.0 + abs(beyond))
    reach = (between[0] + arm[0], between[1] + arm[1], between[2] + arm[2])
    if kind == ALONG:
        seen, back = tensor.transposed_times_vector(a, reach), tensor.transposed_times_vector(b, axis)
        _put(_minus(axis), gradient, 0)
        _put(tensor.crossed(own, seen), gradient, 3)
        _put(axis, gradient, 6)
        _put(tensor.crossed(other, back), gradient, 9)
        if bends:
            _turn_twice(seen, own, 1.0, hessian, 3)
            _turn_twice(back, other, 1.0, hessian, 9)
            _turn_each(own, tensor.transposed_times(a, b), other, 1.0, hessian, 3, 9)
            _shift_and_turn(a, own, 1.0, hessian, 0, 3)
            _shift_and_turn(a, own, -1.0, hessian, 6, 3)
        return _resolved(_dot(axis, reach) - constants[6] - beyond, _size(first, second, reach) + abs(beyond))
    way = (reach[0] - axis[0], reach[1] - axis[1], reach[2] - axis[2])
    length = constants[6] if kind == DISTANCE else np.sqrt(_dot(way, way))
    each = 1.0 / length if length > 0.0 else 0.0
    seen, back = tensor.transposed_times_vector(a, way), tensor.transposed_times_vector(b, way)
    of_first, of_second = tensor.crossed(own, seen), tensor.crossed(other, back)
    for k in range(3):
        gradient[k], gradient[3 + k] = -way[k] * each, -of_first[k] * each
        gradient[6 + k], gradient[9 + k] = way[k] * each, of_second[k] * each
    if bends:
        _bend_distance(a, b, (own, other, seen, back), each, hessian)
    if kind == LENGTH:
        for m in range(hessian.shape[0]):
            for n in range(12):
                hessian[m, n] -= each * gradient[m] * gradient[n]
        return length - constants[6] - beyond
    return _resolved(0.5 * (_dot(way, way) / length - length) - beyond, _size(first, second, reach) + abs(beyond))


@kernel
def _bend_distance(
    a: Matrix, b: Matrix, arms: tuple[Vector, Vector, Vector, Vector], each: float, hessian: np.ndarray
) -> None:
    """Add the second derivatives of d . d/2 times a factor."""
    own, other, seen, back = arms
    for k in range(3):
        hessian[k, k] = hessian[6 + k, 6 + k] = each
        hessian[k, 6 + k] = hessian[6 + k, k] = -each
    _shift_and_turn(a, own, -each, hessian, 0, 3)
    _shift_and_turn(a, own, each, hessian, 6, 3)
    _shift_and_turn(b, other, each, hessian, 0, 9)
    _shift_and_turn(b, other, -each, hessian, 6, 9)
    _turn_each(own, tensor.transposed_times(a, b), other, -each, hessian, 3, 9)
    _turn_twice(seen, own, -each, hessian, 3)
    _turn_twice(back, other, each, hessian, 9)
    _squares(own, each, hessian, 3)
    _squares(other, each, hessian, 9)


@kernel
def _squares(s: Vector, factor: float, hessian: np.ndarray, first: int) -> None:
    """Add factor [s]^T [s] on the diagonal from `first`."""
    both = _dot(s, s)
    for i in range(3):
        for j in range(3):
            hessian[first + i, first + j] += factor * ((both if i == j else 0.0) - s[i] * s[j])
