"""Operations on 3-vectors and 3x3 matrices as tuples of floats (row by row), which compiled loops keep in registers."""

from __future__ import annotations

from fsm.kernels.jit import kernel

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]


@kernel(inline=True)
def crossed(u: Vector, v: Vector) -> Vector:
    """Vector product u x v."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@kernel(inline=True)
def times_vector(m: Matrix, v: Vector) -> Vector:
    """M v."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@kernel(inline=True)
def transposed_times_vector(m: Matrix, v: Vector) -> Vector:
    """M^T v."""
    return (
        m[0] * v[0] + m[3] * v[1] + m[6] * v[2],
        m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
        m[2] * v[0] + m[5] * v[1] + m[8] * v[2],
    )


@kernel(inline=True)
def times(m: Matrix, n: Matrix) -> Matrix:
    """M N."""
    return (
        m[0] * n[0] + m[1] * n[3] + m[2] * n[6],
        m[0] * n[1] + m[1] * n[4] + m[2] * n[7],
        m[0] * n[2] + m[1] * n[5] + m[2] * n[8],
        m[3] * n[0] + m[4] * n[3] + m[5] * n[6],
        m[3] * n[1] + m[4] * n[4] + m[5] * n[7],
        m[3] * n[2] + m[4] * n[5] + m[5] * n[8],
        m[6] * n[0] + m[7] * n[3] + m[8] * n[6],
        m[6] * n[1] + m[7] * n[4] + m[8] * n[7],
        m[6] * n[2] + m[7] * n[5] + m[8] * n[8],
    )


@kernel(inline=True)
def transposed_times(m: Matrix, n: Matrix) -> Matrix:
    """M^T N."""
    return (
        m[0] * n[0] + m[3] * n[3] + m[6] * n[6],
        m[0] * n[1] + m[3] * n[4] + m[6] * n[7],
        m[0] * n[2] + m[3] * n[5] + m[6] * n[8],
        m[1] * n[0] + m[4] * n[3] + m[7] * n[6],
        m[1] * n[1] + m[4] * n[4] + m[7] * n[7],
        m[1] * n[2] + m[4] * n[5] + m[7] * n[8],
        m[2] * n[0] + m[5] * n[3] + m[8] * n[6],
        m[2] * n[1] + m[5] * n[4] + m[8] * n[7],
        m[2] * n[2] + m[5] * n[5] + m[8] * n[8],
    )


@kernel(inline=True)
def crossed_matrix(u: Vector, m: Matrix) -> Matrix:
    """[u] M: the vector product of u with every column of M."""
    return (
        u[1] * m[6] - u[2] * m[3],
        u[1] * m[7] - u[2] * m[4],
        u[1] * m[8] - u[2] * m[5],
        u[2] * m[0] - u[0] * m[6],
        u[2] * m[1] - u[0] * m[7],
        u[2] * m[2] - u[0] * m[8],
        u[0] * m[3] - u[1] * m[0],
        u[0] * m[4] - u[1] * m[1],
        u[0] * m[5] - u[1] * m[2],
    )


@kernel(inline=True)
def scaled_rows(d: Vector, m: Matrix) -> Matrix:
    """diag(d) M."""
    return (
        d[0] * m[0], d[0] * m[1], d[0] * m[2],
        d[1] * m[3], d[1] * m[4], d[1] * m[5],
        d[2] * m[6], d[2] * m[7], d[2] * m[8],
    )  # fmt: skip


@kernel(inline=True)
def added(m: Matrix, factor: float, n: Matrix) -> Matrix:
    """M + factor N."""
    return (
        m[0] + factor * n[0], m[1] + factor * n[1], m[2] + factor * n[2],
        m[3] + factor * n[3], m[4] + factor * n[4], m[5] + factor * n[5],
        m[6] + factor * n[6], m[7] + factor * n[7], m[8] + factor * n[8],
    )  # fmt: skip


@kernel(inline=True)
def transposed(m: Matrix) -> Matrix:
    """M^T."""
    return m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]


@kernel(inline=True)
def with_product(m: Matrix, g: Vector, hx: float, hy: float, hz: float) -> Matrix:
    """M + g h^T."""
    return (
        m[0] + g[0] * hx, m[1] + g[0] * hy, m[2] + g[0] * hz,
        m[3] + g[1] * hx, m[4] + g[1] * hy, m[5] + g[1] * hz,
        m[6] + g[2] * hx, m[7] + g[2] * hy, m[8] + g[2] * hz,
    )  # fmt: skip


@kernel(inline=True)
def quaternion_product(p: Quaternion, r: Quaternion) -> Quaternion:
    """Quaternion product p r."""
    return (
        p[0] * r[0] - p[1] * r[1] - p[2] * r[2] - p[3] * r[3],
        p[0] * r[1] + p[1] * r[0] + p[2] * r[3] - p[3] * r[2],
        p[0] * r[2] - p[1] * r[3] + p[2] * r[0] + p[3] * r[1],
        p[0] * r[3] + p[1] * r[2] - p[2] * r[1] + p[3] * r[0],
    )


@kernel(inline=True)
def quaternion_matrix(p: Quaternion) -> Matrix:
    """Rotation matrix of a unit quaternion."""
    w, x, y, z = p
    return (
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
        2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y),
    )  # fmt: skip
