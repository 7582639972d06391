"""Linear springs and dampers between poses in space: measure, law and scatter in one pass over the elements.

`fsm.interactions.pose_spatial` defines the deformations. The law is e = k (x - x0) + c x'. All vectors are resolved in
the joint axes of the outer body, in which the stiffnesses of the translations are diagonal. There, with increments
v = v_a - v_b, w_a, w_b,

    a from the inner body's centre to P+,    z from the outer body's centre to P+,
    Z' = v + w_a x a - w_b x z,              s_k' = g_k . (w_a - w_b),
    K = G^T (k G + c N) + B,                 D = G^T c G.

G holds the coefficients of Z' and s'. N is the change of Z' and s' with the pose at the present rates. B is the geometric
stiffness of the force f = (f_1, f_2, f_3) and of the moment g = sum_k m_k g_k:

    N of Z:    v: -[w_b],   a: -[w_a x a] + [w_b][a],   b: [v + w_a x a] - [w_b][z]
    N of s_k:  S_k (w_a - w_b) - g_k x (w_a + w_b)/2 on a, minus that on b
    B:         vb: -[f],   bv: [f],   aa = -ab: S + [g]/2 - a.f + f a^T,
               ba: -S + [g]/2 + a.f - a f^T,   bb: S - [g]/2 - z.f + z f^T,   S = sum_k m_k S_k

S_k is the second derivative of s_k along rotations about fixed axes. Increments do not commute, so B is not symmetric.
The rows and columns of v_b are the rows and columns of v_a with the opposite sign.

s1, psi and s3 have no slopes if the swing is 180 degrees. If there are no rotational springs and the three rotational
dampers are equal, these measures are not needed. The moment is g = c (w_a - w_b), and aa = -ab: -c [w_b], ba = -bb: c
[w_a] of K, c of D. With a past state it is g = c r/dt with the rotation vector r since then, and S = c/dt (1 - r/2
cot(r/2)) (r r^T/r^2 - 1).

The file is long because all its kernels share the same inlined functions.
"""

from __future__ import annotations

import numpy as np

from fsm.interactions.bushing_planar import LOCKED
from fsm.interactions.swing_twist import Slopes, curvature_matrix, swing_slopes, turn_curvature, turn_gradient, twist_slopes
from fsm.kernels import tensor
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import rotate_by
from fsm.kernels.scatter import add_quarters_spatial
from fsm.kernels.tensor import Matrix, Quaternion, Vector

_OFFSET, _REST, _STIFFNESS, _DAMPING, _HALF_WAY, _EVEN = 14, 15, 21, 27, 33, 34
COLUMNS_SPATIAL = _REST, _STIFFNESS
"""First columns of x0 and of k."""


def pose_constants_spatial(
    point_inner: np.ndarray,
    point_outer: np.ndarray,
    axes_inner: np.ndarray,
    axes_outer: np.ndarray,
    angle_offset: np.ndarray,
    half_way: np.ndarray,
    rest: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
) -> np.ndarray:
    """Constants of all elements for the kernels, (m, 35); arguments as in `measure_pose_spatial`.

    Columns: inner point (3), outer point in the joint axes (3), axes in the inner (4) and outer (4) body, initial angle,
    x0, k, c of (Z1, Z2, Z3, s1, psi, s3), 1 if the swing is measured half-way between the bodies, else 0, and
    1 if rotations have only equal dampers about all axes, else 0.
    """
    even = ~np.any(stiffness[:, 3:], axis=1) & (damping[:, 3] > 0.0) & np.all(damping[:, 3:] == damping[:, 3:4], axis=1)
    outer = rotate_by(axes_outer * np.array([1.0, -1.0, -1.0, -1.0]), point_outer)
    joint = (point_inner, outer, axes_inner, axes_outer, angle_offset)
    return np.column_stack([*joint, rest, stiffness, damping, half_way, even])


@kernel(inline=True)
def _place(poses: np.ndarray, a: int, b: int, row: np.ndarray) -> tuple[Matrix, Matrix, Matrix, Vector, Vector, Quaternion]:
    """A_b times the joint axes; components of body a and of body b in joint axes; a, z, q; see the module docstring."""
    axes_outer = (row[10], row[11], row[12], row[13])
    turn_a = (poses[a, 3], poses[a, 4], poses[a, 5], poses[a, 6])
    joint = tensor.quaternion_product((poses[b, 3], poses[b, 4], poses[b, 5], poses[b, 6]), axes_outer)
    relative = tensor.quaternion_product((joint[0], -joint[1], -joint[2], -joint[3]), turn_a)
    from_world = tensor.quaternion_matrix(joint)
    from_a = tensor.quaternion_matrix(relative)
    from_b = tensor.quaternion_matrix((axes_outer[0], -axes_outer[1], -axes_outer[2], -axes_outer[3]))
    arm = tensor.times_vector(from_a, (row[0], row[1], row[2]))
    apart = (poses[a, 0] - poses[b, 0], poses[a, 1] - poses[b, 1], poses[a, 2] - poses[b, 2])
    d = tensor.transposed_times_vector(from_world, apart)
    q = tensor.quaternion_product(relative, (row[6], row[7], row[8], row[9]))
    return from_world, from_a, from_b, arm, (d[0] + arm[0], d[1] + arm[1], d[2] + arm[2]), q


@kernel(inline=True)
def _speeds(
    rates: np.ndarray, a: int, b: int, from_world: Matrix, from_a: Matrix, from_b: Matrix
) -> tuple[Vector, Vector, Vector]:
    """Components of v, w_a, w_b in joint axes."""
    v = (rates[a, 0] - rates[b, 0], rates[a, 1] - rates[b, 1], rates[a, 2] - rates[b, 2])
    return (
        tensor.transposed_times_vector(from_world, v),
        tensor.times_vector(from_a, (rates[a, 3], rates[a, 4], rates[a, 5])),
        tensor.times_vector(from_b, (rates[b, 3], rates[b, 4], rates[b, 5])),
    )


@kernel(inline=True)
def _translation_efforts(
    arm: Vector, z: Vector, v: Vector, wa: Vector, wb: Vector, row: np.ndarray, before: np.ndarray, per_second: float
) -> Vector:
    """Efforts k (x - x0) + c x' of (Z1, Z2, Z3); x' is the difference from `before` if `per_second` is not zero."""
    x0, x1, x2 = z[0] - row[3], z[1] - row[4], z[2] - row[5]
    if per_second != 0.0:
        r0, r1, r2 = (x0 - before[0]) * per_second, (x1 - before[1]) * per_second, (x2 - before[2]) * per_second
    else:
        from_a, from_b = tensor.crossed(wa, arm), tensor.crossed(wb, z)
        r0, r1, r2 = v[0] + from_a[0] - from_b[0], v[1] + from_a[1] - from_b[1], v[2] + from_a[2] - from_b[2]
    return (
        row[_STIFFNESS] * (x0 - row[_REST]) + row[_DAMPING] * r0,
        row[_STIFFNESS + 1] * (x1 - row[_REST + 1]) + row[_DAMPING + 1] * r1,
        row[_STIFFNESS + 2] * (x2 - row[_REST + 2]) + row[_DAMPING + 2] * r2,
    )


@kernel(inline=True)
def _moment(
    k: int, value: float, g: Vector, wa: Vector, wb: Vector, row: np.ndarray, before: np.ndarray, per_second: float
) -> float:
    """Effort of rotation k (3, 4, 5 for s1, psi, s3); the arguments are those of `_translation_efforts`."""
    if per_second != 0.0:
        rate = (value - before[k]) * per_second
    else:
        rate = g[0] * (wa[0] - wb[0]) + g[1] * (wa[1] - wb[1]) + g[2] * (wa[2] - wb[2])
    return row[_STIFFNESS + k] * (value - row[_REST + k]) + row[_DAMPING + k] * rate


@kernel(inline=True)
def _acts(row: np.ndarray, k: int) -> bool:
    """Whether measure k has a spring or a damper."""
    return bool(row[_STIFFNESS + k] != 0.0 or row[_DAMPING + k] != 0.0)


@kernel(inline=True)
def _turned(q: Quaternion, row: np.ndarray, before: np.ndarray) -> Vector:
    """Rotation vector from the past state to q, in joint axes."""
    s1, psi, s3 = before[3], before[4] - row[_OFFSET], before[5]
    size = np.sqrt(s1 * s1 + s3 * s3)
    part = np.sin(0.5 * size) / size if size > 0.0 else 0.5
    past = (np.cos(0.5 * size), part * s1, 0.0, part * s3)
    if row[_HALF_WAY] != 0.0:
        twist = (np.cos(0.25 * psi), 0.0, np.sin(0.25 * psi), 0.0)
        past = tensor.quaternion_product(tensor.quaternion_product(twist, past), twist)
    else:
        past = tensor.quaternion_product(past, (np.cos(0.5 * psi), 0.0, np.sin(0.5 * psi), 0.0))
    d = tensor.quaternion_product(q, (past[0], -past[1], -past[2], -past[3]))
    sign = 1.0 if d[0] >= 0.0 else -1.0
    sine = np.sqrt(d[1] * d[1] + d[2] * d[2] + d[3] * d[3])
    part = 2.0 * sign * np.arctan2(sine, sign * d[0]) / sine if sine > 0.0 else 2.0 * sign
    return part * d[1], part * d[2], part * d[3]


@kernel(inline=True)
def _turning(q: Quaternion, wa: Vector, wb: Vector, row: np.ndarray, before: np.ndarray, per_second: float) -> Vector:
    """Relative angular velocity w_a - w_b; with a past state, its mean since that state."""
    if per_second != 0.0:
        r = _turned(q, row, before)
        return per_second * r[0], per_second * r[1], per_second * r[2]
    return wa[0] - wb[0], wa[1] - wb[1], wa[2] - wb[2]


@kernel(inline=True)
def _even_curvature(w: Vector, wa: Vector, wb: Vector, c: float, per_second: float) -> Matrix:
    """Term of K of an even damper besides [g]/2: -c [w_a + w_b]/2, or S; `w` of `_turning`."""
    if per_second == 0.0:
        x, y, z = -0.5 * c * (wa[0] + wb[0]), -0.5 * c * (wa[1] + wb[1]), -0.5 * c * (wa[2] + wb[2])
        return 0.0, -z, y, z, 0.0, -x, -y, x, 0.0
    square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    half = 0.5 * np.sqrt(square) / per_second
    part = (
        c
        * per_second
        * ((1.0 - half / np.tan(half)) / square if half > 1e-2 else (1.0 + half**2 / 15.0) / (12.0 * per_second**2))
    )
    return tensor.with_product(
        (-part * square, 0.0, 0.0, 0.0, -part * square, 0.0, 0.0, 0.0, -part * square),
        w,
        part * w[0],
        part * w[1],
        part * w[2],
    )


@kernel(inline=True)
def _any(v: Vector) -> bool:
    """Whether a vector is not zero."""
    return v[0] != 0.0 or v[1] != 0.0 or v[2] != 0.0


@kernel(inline=True)
def _scatter(
    from_world: Matrix, from_a: Matrix, from_b: Matrix, arm: Vector, z: Vector, f: Vector, g: Vector,
    a: int, b: int, force: np.ndarray,
) -> None:  # fmt: skip
    """Forces -e dm/dx of one element from the force f and the moment g in joint axes."""
    push = tensor.times_vector(from_world, f)
    turn_a, turn_b = tensor.crossed(arm, f), tensor.crossed(z, f)
    moment_a = tensor.transposed_times_vector(from_a, (turn_a[0] + g[0], turn_a[1] + g[1], turn_a[2] + g[2]))
    moment_b = tensor.transposed_times_vector(from_b, (turn_b[0] + g[0], turn_b[1] + g[1], turn_b[2] + g[2]))
    for j in range(3):
        force[a, j] -= push[j]
        force[b, j] += push[j]
        force[a, 3 + j] -= moment_a[j]
        force[b, 3 + j] += moment_b[j]


@kernel
def force_pose_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    force: np.ndarray,
) -> None:
    """Add the forces of all elements.

    Parameters
    ----------
    poses, rates : (n_bodies, 7) and (n_bodies, 6) arrays
        Poses with quaternions of unit length, and rates of all bodies.
    bodies : (m, 2) int array
        Inner and outer body.
    constants : (m, 35) array of `pose_constants_spatial`
    before : (m, 6) array
        Deformations at a past state; not read if `per_second` is zero.
    per_second : float, 1/s
        Inverse of the time since the past state. If zero, the rates are those of the bodies.
    force : (n_bodies, 6) array, changed in place
    """
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        row, past = constants[i], before[i]
        from_world, from_a, from_b, arm, z, q = _place(poses, a, b, row)
        v, wa, wb = _speeds(rates, a, b, from_world, from_a, from_b)
        f = _translation_efforts(arm, z, v, wa, wb, row, past, per_second)
        gx = gy = gz = 0.0
        even = row[_EVEN] != 0.0
        if even:
            c, w = row[_DAMPING + 3], _turning(q, wa, wb, row, past, per_second)
            gx, gy, gz = c * w[0], c * w[1], c * w[2]
        if _acts(row, 4) and not even:
            psi, slopes = twist_slopes(q)
            g = turn_gradient(slopes, q)
            m = _moment(4, psi + row[_OFFSET], g, wa, wb, row, past, per_second)
            gx, gy, gz = m * g[0], m * g[1], m * g[2]
        if (_acts(row, 3) or _acts(row, 5)) and not even:
            s1, s3, slopes_1, slopes_3 = swing_slopes(q, row[_HALF_WAY] != 0.0)
            g1, g3 = turn_gradient(slopes_1, q), turn_gradient(slopes_3, q)
            m1 = _moment(3, s1, g1, wa, wb, row, past, per_second)
            m3 = _moment(5, s3, g3, wa, wb, row, past, per_second)
            gx += m1 * g1[0] + m3 * g3[0]
            gy += m1 * g1[1] + m3 * g3[1]
            gz += m1 * g1[2] + m3 * g3[2]
        _scatter(from_world, from_a, from_b, arm, z, f, (gx, gy, gz), a, b, force)


@kernel(inline=True)
def _add_turn(
    k: int, value: float, slopes: Slopes, q: Quaternion, wa: Vector, wb: Vector,
    row: np.ndarray, before: np.ndarray, per_second: float, efforts: np.ndarray,
    sums: tuple[Vector, Vector, Slopes, Matrix, Matrix],
) -> tuple[Vector, Vector, Slopes, Matrix, Matrix]:  # fmt: skip
    """Sums over the measures: m g; the same and m times the slopes for given efforts; g (k g + c N)^T and c g g^T."""
    moment, bent, curvature, material, damped = sums
    g = turn_gradient(slopes, q)
    m = _moment(k, value, g, wa, wb, row, before, per_second)
    moment = (moment[0] + m * g[0], moment[1] + m * g[1], moment[2] + m * g[2])
    if efforts.shape[0] > 0:
        m = efforts[k]
    stiffness, damping = row[_STIFFNESS + k], row[_DAMPING + k]
    hx, hy, hz = stiffness * g[0], stiffness * g[1], stiffness * g[2]
    if damping != 0.0:
        damped = tensor.with_product(damped, g, damping * g[0], damping * g[1], damping * g[2])
        if per_second == 0.0:
            n = turn_curvature(slopes, q, (wa[0] - wb[0], wa[1] - wb[1], wa[2] - wb[2]))
            turned = tensor.crossed(g, (wa[0] + wb[0], wa[1] + wb[1], wa[2] + wb[2]))
            hx += damping * (n[0] - 0.5 * turned[0])
            hy += damping * (n[1] - 0.5 * turned[1])
            hz += damping * (n[2] - 0.5 * turned[2])
    t, s = curvature, slopes
    return (
        moment,
        (bent[0] + m * g[0], bent[1] + m * g[1], bent[2] + m * g[2]),
        (
            t[0] + m * s[0], t[1] + m * s[1], t[2] + m * s[2], t[3] + m * s[3], t[4] + m * s[4], t[5] + m * s[5],
            t[6] + m * s[6], t[7] + m * s[7], t[8] + m * s[8], t[9] + m * s[9], t[10] + m * s[10],
        ),
        tensor.with_product(material, g, hx, hy, hz),
        damped,
    )  # fmt: skip


@kernel(inline=True)
def _geometric(turn: Matrix, factor: float, g: Vector, u: Vector, w: Vector) -> Matrix:
    """M + factor [g] - u.w + u w^T."""
    m, s = turn, u[0] * w[0] + u[1] * w[1] + u[2] * w[2]
    x, y, z = factor * g[0], factor * g[1], factor * g[2]
    return tensor.with_product(
        (m[0] - s, m[1] - z, m[2] + y, m[3] + z, m[4] - s, m[5] - x, m[6] - y, m[7] + x, m[8] - s), u, *w
    )


@kernel
def linearise_pose_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    efforts: np.ndarray,
    slots: np.ndarray,
    force: np.ndarray,
    stiffness_data: np.ndarray,
    damping_data: np.ndarray,
) -> None:
    """Add the forces of all elements, and K = -dh/dx and D = -dh/du to the block data.

    N is zero for bodies at rest and with a past state. Only the blocks of the rotations of the same body are then not
    symmetric.

    Parameters
    ----------
    poses ... per_second, force : as in `force_pose_spatial`
    efforts : (m, 6) array, or (0, 6)
        Efforts for the geometric stiffness, instead of those at the poses; see `advance_efforts_spatial`.
    slots : (m, 4) int array of `pair_slots`
    stiffness_data, damping_data : (n_blocks, 6, 6) arrays, changed in place
    """
    stiffness_flat, damping_flat = stiffness_data.reshape(-1), damping_data.reshape(-1)
    nothing = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(bodies.shape[0]):
        a, b = bodies[i, 0], bodies[i, 1]
        row, past = constants[i], before[i]
        from_world, from_a, from_b, arm, z, q = _place(poses, a, b, row)
        v, wa, wb = _speeds(rates, a, b, from_world, from_a, from_b)
        f = _translation_efforts(arm, z, v, wa, wb, row, past, per_second)
        given = efforts[i] if efforts.shape[0] > 0 else efforts.reshape(-1)
        g = bent = (0.0, 0.0, 0.0)
        curvature = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        turn, turn_damped = nothing, nothing
        even = row[_EVEN] != 0.0
        if even:
            even_c, w = row[_DAMPING + 3], _turning(q, wa, wb, row, past, per_second)
            g = bent = (even_c * w[0], even_c * w[1], even_c * w[2])
            if given.shape[0] > 0:
                bent = (given[3], given[4], given[5])
            turn = _even_curvature(w, wa, wb, even_c, per_second)
            turn_damped = (even_c, 0.0, 0.0, 0.0, even_c, 0.0, 0.0, 0.0, even_c)
        if _acts(row, 4) and not even:
            psi, slopes = twist_slopes(q)
            g, bent, curvature, turn, turn_damped = _add_turn(
                4, psi + row[_OFFSET], slopes, q, wa, wb, row, past, per_second, given,
                (g, bent, curvature, turn, turn_damped),
            )  # fmt: skip
        if (_acts(row, 3) or _acts(row, 5)) and not even:
            s1, s3, slopes_1, slopes_3 = swing_slopes(q, row[_HALF_WAY] != 0.0)
            g, bent, curvature, turn, turn_damped = _add_turn(
                3, s1, slopes_1, q, wa, wb, row, past, per_second, given, (g, bent, curvature, turn, turn_damped)
            )
            g, bent, curvature, turn, turn_damped = _add_turn(
                5, s3, slopes_3, q, wa, wb, row, past, per_second, given, (g, bent, curvature, turn, turn_damped)
            )
        _scatter(from_world, from_a, from_b, arm, z, f, g, a, b, force)
        if given.shape[0] > 0:
            f = (given[0], given[1], given[2])

        # gradients of Z in the coordinates of the bodies; that by v is from_world^T
        by_v = tensor.transposed(from_world)
        by_a = tensor.crossed_matrix((-arm[0], -arm[1], -arm[2]), from_a)
        by_b = tensor.crossed_matrix(z, from_b)
        c = (row[_DAMPING], row[_DAMPING + 1], row[_DAMPING + 2])
        damped = (
            c[0] != 0.0 or c[1] != 0.0 or c[2] != 0.0
            or row[_DAMPING + 3] != 0.0 or row[_DAMPING + 4] != 0.0 or row[_DAMPING + 5] != 0.0
        )  # fmt: skip
        moving = damped and per_second == 0.0 and (_any(v) or _any(wa) or _any(wb))

        # k G + c N
        k = (row[_STIFFNESS], row[_STIFFNESS + 1], row[_STIFFNESS + 2])
        hv, ha, hb = tensor.scaled_rows(k, by_v), tensor.scaled_rows(k, by_a), tensor.scaled_rows(k, by_b)
        if moving:
            swept = tensor.crossed(wa, arm)
            wb_back = (-wb[0], -wb[1], -wb[2])
            nv = tensor.crossed_matrix(wb_back, by_v)
            na = tensor.added(tensor.crossed_matrix(wb_back, by_a), -1.0, tensor.crossed_matrix(swept, from_a))
            speed = (v[0] + swept[0], v[1] + swept[1], v[2] + swept[2])
            nb = tensor.added(tensor.crossed_matrix(wb_back, by_b), 1.0, tensor.crossed_matrix(speed, from_b))
            hv = tensor.added(hv, 1.0, tensor.scaled_rows(c, nv))
            ha = tensor.added(ha, 1.0, tensor.scaled_rows(c, na))
            hb = tensor.added(hb, 1.0, tensor.scaled_rows(c, nb))
        # G^T times that, and B
        if not even:
            turn = tensor.added(turn, 1.0, curvature_matrix(curvature, q))
        own_a, own_b = _geometric(turn, 0.5, bent, f, arm), _geometric(turn, -0.5, bent, z, f)
        vv, va = tensor.times(from_world, hv), tensor.times(from_world, ha)
        vb = tensor.times(from_world, tensor.added(hb, -1.0, tensor.crossed_matrix(f, from_b)))
        aa = tensor.transposed_times(from_a, tensor.added(tensor.times(own_a, from_a), 1.0, tensor.crossed_matrix(arm, ha)))
        ab = tensor.transposed_times(from_a, tensor.added(tensor.crossed_matrix(arm, hb), -1.0, tensor.times(own_a, from_b)))
        bb = tensor.transposed_times(from_b, tensor.added(tensor.times(own_b, from_b), -1.0, tensor.crossed_matrix(z, hb)))
        if moving:
            av = tensor.transposed_times(from_a, tensor.crossed_matrix(arm, hv))
            bv = tensor.transposed_times(
                from_b, tensor.added(tensor.crossed_matrix(f, by_v), -1.0, tensor.crossed_matrix(z, hv))
            )
            other = _geometric(turn, -0.5, bent, arm, f)
            ba = tensor.transposed_times(
                from_b, tensor.added(tensor.crossed_matrix((-z[0], -z[1], -z[2]), ha), -1.0, tensor.times(other, from_a))
            )
        else:
            av, bv, ba = tensor.transposed(va), tensor.transposed(vb), tensor.transposed(ab)
        add_quarters_spatial(stiffness_flat, slots[i], vv, va, vb, av, bv, aa, ab, ba, bb)

        if damped:
            ha, hb = tensor.scaled_rows(c, by_a), tensor.scaled_rows(c, by_b)
            vv = tensor.times(from_world, tensor.scaled_rows(c, by_v))
            va, vb = tensor.times(from_world, ha), tensor.times(from_world, hb)
            aa = tensor.transposed_times(
                from_a, tensor.added(tensor.times(turn_damped, from_a), 1.0, tensor.crossed_matrix(arm, ha))
            )
            turned = tensor.times(turn_damped, from_b)
            ab = tensor.transposed_times(from_a, tensor.added(tensor.crossed_matrix(arm, hb), -1.0, turned))
            bb = tensor.transposed_times(from_b, tensor.added(turned, -1.0, tensor.crossed_matrix(z, hb)))
            add_quarters_spatial(
                damping_flat, slots[i], vv, va, vb, tensor.transposed(va), tensor.transposed(vb), aa, ab,
                tensor.transposed(ab), bb
            )


@kernel(inline=True)
def _measure_all(
    poses: np.ndarray, rates: np.ndarray, a: int, b: int, row: np.ndarray, before: np.ndarray, per_second: float,
    value: np.ndarray, change: np.ndarray,
) -> None:  # fmt: skip
    """All measures of one element into `value` (6,), and G times the bodies' rates into `change` (6,).

    For equal dampers, s1, psi and s3 are the past values plus the rotation vector since then, and the rates are w_a -
    w_b.
    """
    from_world, from_a, from_b, arm, z, q = _place(poses, a, b, row)
    v, wa, wb = _speeds(rates, a, b, from_world, from_a, from_b)
    turn_a, turn_b = tensor.crossed(wa, arm), tensor.crossed(wb, z)
    w = (wa[0] - wb[0], wa[1] - wb[1], wa[2] - wb[2])
    for k in range(3):
        value[k], change[k] = z[k] - row[3 + k], v[k] + turn_a[k] - turn_b[k]
    for k in range(3, 6):
        value[k] = change[k] = 0.0
    if row[_EVEN] != 0.0:
        r = _turned(q, row, before) if per_second != 0.0 else (0.0, 0.0, 0.0)
        for k in range(3):
            value[3 + k], change[3 + k] = before[3 + k] + r[k], w[k]
        return
    if _acts(row, 4):
        psi, slopes = twist_slopes(q)
        g = turn_gradient(slopes, q)
        value[4], change[4] = psi + row[_OFFSET], g[0] * w[0] + g[1] * w[1] + g[2] * w[2]
    if _acts(row, 3) or _acts(row, 5):
        value[3], value[5], slopes_1, slopes_3 = swing_slopes(q, row[_HALF_WAY] != 0.0)
        g1, g3 = turn_gradient(slopes_1, q), turn_gradient(slopes_3, q)
        change[3] = g1[0] * w[0] + g1[1] * w[1] + g1[2] * w[2]
        change[5] = g3[0] * w[0] + g3[1] * w[1] + g3[2] * w[2]


@kernel
def advance_efforts_spatial(
    poses: np.ndarray,
    change: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
) -> np.ndarray:
    """Efforts (m, 6) of all elements after a change of the poses, to first order: e + (k + c/dt) G dx.

    Parameters
    ----------
    poses, bodies, constants, before, per_second : as in `force_pose_spatial`
    change : (n_bodies, 6) array
        Increments of the poses; zeros give the efforts at the poses.
    """
    efforts, x, dx = np.empty((bodies.shape[0], 6)), np.empty(6), np.empty(6)
    for i in range(bodies.shape[0]):
        row, past = constants[i], before[i]
        _measure_all(poses, change, bodies[i, 0], bodies[i, 1], row, past, per_second, x, dx)
        for k in range(6):
            later = x[k] + dx[k]
            damped = row[_DAMPING + k] * per_second * (later - past[k])
            efforts[i, k] = row[_STIFFNESS + k] * (later - row[_REST + k]) + damped
    return efforts


@kernel
def stored_pose_spatial(
    poses: np.ndarray,
    rates: np.ndarray,
    bodies: np.ndarray,
    constants: np.ndarray,
    before: np.ndarray,
    per_second: float,
    category: np.ndarray,
    categories: int,
) -> tuple[np.ndarray, float]:
    """Potential energy of all elements of each category (m,), J, and the power of all dampers, W.

    Parameters
    ----------
    poses ... per_second : as in `force_pose_spatial`
    category, categories : (m,) int array, and number of categories
    """
    energy, power = np.zeros(categories), 0.0
    x, rate = np.empty(6), np.empty(6)
    for i in range(bodies.shape[0]):
        row, past = constants[i], before[i]
        _measure_all(poses, rates, bodies[i, 0], bodies[i, 1], row, past, per_second, x, rate)
        for k in range(6):
            energy[category[i]] += 0.5 * row[_STIFFNESS + k] * (x[k] - row[_REST + k]) ** 2
            speed = (x[k] - past[k]) * per_second if per_second != 0.0 else rate[k]
            power += row[_DAMPING + k] * speed**2
    return energy, power


@kernel
def widest_pose_spatial(
    poses: np.ndarray, bodies: np.ndarray, constants: np.ndarray, structural: np.ndarray
) -> tuple[int, float]:
    """Structural element with the largest distance of its ends, and this distance, m; the first element if all are zero.

    Axes without a stiffness are ignored. Other arguments as in `force_pose_spatial`.
    """
    worst, widest = 0, 0.0
    for i in range(bodies.shape[0]):
        if not structural[i]:
            continue
        row = constants[i]
        _, _, _, _, z, _ = _place(poses, bodies[i, 0], bodies[i, 1], row)
        square, shifted = 0.0, 0.0 if structural[i] == LOCKED else 1.0
        for k in range(3):
            if row[_STIFFNESS + k] > 0.0:
                square += (z[k] - row[3 + k] - shifted * row[_REST + k]) ** 2
        if square > widest:
            worst, widest = i, square
    return worst, np.sqrt(widest)


@kernel
def deformations_pose_spatial(poses: np.ndarray, rates: np.ndarray, bodies: np.ndarray, constants: np.ndarray) -> np.ndarray:
    """Deformations (m, 6) of all elements, as those of `measure_pose_spatial`; arguments as in `force_pose_spatial`.

    Axes without an effort may have the value zero.
    """
    value, change = np.empty((bodies.shape[0], 6)), np.empty(6)
    for i in range(bodies.shape[0]):
        row = constants[i]
        _measure_all(poses, rates, bodies[i, 0], bodies[i, 1], row, value[i], 0.0, value[i], change)
        if row[_EVEN] != 0.0:
            _, _, _, _, _, q = _place(poses, bodies[i, 0], bodies[i, 1], row)
            value[i, 3], value[i, 5], _, _ = swing_slopes(q, row[_HALF_WAY] != 0.0)
            value[i, 4] = twist_slopes(q)[0] + row[_OFFSET]
    return value
