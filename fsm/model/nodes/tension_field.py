"""Stretch of an isotropic film: plain, or as a tension field that carries no compression.

Plain: U = C/2 (ex^2 + ey^2 + 2 nu ex ey + 2 (1 - nu) exy^2), C = Et/(1 - nu^2), of Green strains.

Tension field, by the mixed criterion of principal stress and strain (e1 >= e2 of the Green strain, s2 the smaller
principal stress of the plain law):

    taut       s2 > 0                   plain
    wrinkled   s2 <= 0, e1 > 0          U = Et/2 e1^2: uniaxial tension along the direction of e1
    slack      e1 <= 0                  U = 0

This is the relaxed energy. At s2 = 0, e2 = -nu e1, plain and uniaxial energies and stresses are equal, so the stress is
continuous. The stress is never compressive, so the film does not buckle.

A slack film would have no stiffness in its plane. A part eps of the film, the remainder, therefore follows the plain
law with an additional stress. With the relaxed stress N and a reference strain E0,

    stress = (1 - eps) N(E) + eps (C E + P),   P = N(E0) - C E0

`release` (P) is updated during the search for an equilibrium and constant afterwards. At the equilibrium the stress is N,
without compression. In taut parts P is zero and the law is plain. With P = 0 everywhere the remainder would carry
compression, which would buckle a thin film at its free edges. With eps = 1 the law is the plain law.

The stress has kinks where wrinkles appear and disappear. With x_+^2 rounded over -w < x < w, so that its second derivative
is linear there, and e2 + nu e1 rounded over (1 + nu) w, the energy

    U = Et/2 (e1)_+^2 + C/2 (e2 + nu e1)_+^2

equals that of the table for w = 0, and its second derivatives are continuous for w > 0, also at e1 = e2. The error of its
stress is at most C w/4, at a kink. P also removes this error at E0, so that the stress at rest is N without rounding. In a
motion w is `ROUNDED` times the mean of e1 at rest; otherwise w = 0.

The search for an equilibrium first uses the values eps of `SETTLING`, which make it fast, and then `REMAINDER`. A motion
about the equilibrium uses `MOVING`; the forces at rest are nearly the same. Small motions normal to a flat film are
independent of eps.

References
----------
Roddeman, Drukker, Oomens, Janssen, J. Appl. Mech. 54 (1987) 884-892. Pipkin, IMA J. Appl. Math. 36 (1986) 85-99.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.kernels.jit import kernel

TAUT, WRINKLED, SLACK = 0, 1, 2
SETTLING, REMAINDER, MOVING = (1e-2, 1e-3), 1e-4, 1e-2
"""Stiffness of a wrinkled or slack film relative to the plain law. Sheared strip, 32 x 32 cells: with 1e-2,
1e-3, 1e-4 and 1e-5, Newton's method takes 32, 66, 136 and 200 iterations to 1e-6. The error of the mean stress is at
most 1 %, 0.03 %, 0.003 % and 0. Corner-pulled films after an impact: with 1e-2 in place of 1e-4 the largest
displacement changes by 0.2 % and the frequency by less; the run takes down to one third of the time (2026-11-23)."""
ROUNDED = 0.05
"""Half-width of the rounded kinks, relative to the mean of the positive principal strains. Corner-pulled films after an
impact: with 0.03 and 0.1 the hardest cases take two thirds and less than half of the time. Natural frequencies depend
on the stress at rest, which rounding does not change (2026-11-23)."""


@kernel(inline=True)
def _principal(exx: float, eyy: float, exy: float) -> tuple[float, float, float, float]:
    """Principal strains e1 >= e2, and cosine and sine of twice the angle of e1."""
    middle, half = 0.5 * (exx + eyy), 0.5 * (exx - eyy)
    radius = math.sqrt(half * half + exy * exy)
    if radius == 0.0:
        return middle, middle, 1.0, 0.0
    return middle + radius, middle - radius, half / radius, exy / radius


@kernel(inline=True)
def film_state(exx: float, eyy: float, exy: float, poisson: float) -> int:
    """TAUT, WRINKLED or SLACK."""
    e1, e2, _, _ = _principal(exx, eyy, exy)
    if e2 + poisson * e1 > 0.0:
        return TAUT
    return WRINKLED if e1 > 0.0 else SLACK


@kernel(inline=True)
def _rounded(x: float, width: float) -> tuple[float, float, float]:
    """x^2/2 for x > 0 and 0 below, and both derivatives, the second one linear from -width to width."""
    if x >= width:
        return 0.5 * x * x + width * width / 6.0, x, 1.0
    if x <= -width:
        return 0.0, 0.0, 0.0
    over = x + width
    return over * over * over / (12.0 * width), over * over / (4.0 * width), over / (2.0 * width)


@kernel(inline=True)
def film_energy(
    exx: float, eyy: float, exy: float, plain: float, poisson: float, remainder: float, width: float
) -> float:
    """Energy per area without the energy of P, J/m^2; `plain` is C, `remainder` eps, `width` the strain w."""
    shear = 2.0 * (1.0 - poisson) * exy * exy
    whole = 0.5 * plain * (exx * exx + eyy * eyy + 2.0 * poisson * exx * eyy + shear)
    if remainder >= 1.0:
        return whole
    e1, e2, _, _ = _principal(exx, eyy, exy)
    first, _, _ = _rounded(e1, width)
    second, _, _ = _rounded(e2 + poisson * e1, (1.0 + poisson) * width)
    return remainder * whole + (1.0 - remainder) * plain * ((1.0 - poisson * poisson) * first + second)


@kernel(inline=True)
def film_stress(
    exx: float, eyy: float, exy: float, plain: float, poisson: float, remainder: float, width: float
) -> tuple[float, float, float]:
    """Resultants Nxx, Nyy, Nxy (second Piola-Kirchhoff) without eps P, N/m: dU/d(exx, eyy, 2 exy)."""
    nxx, nyy = plain * (exx + poisson * eyy), plain * (eyy + poisson * exx)
    nxy = plain * (1.0 - poisson) * exy
    if remainder >= 1.0:
        return nxx, nyy, nxy
    e1, e2, c, s = _principal(exx, eyy, exy)
    x = e2 + poisson * e1
    if e1 > width and x > (1.0 + poisson) * width:
        return nxx, nyy, nxy
    nxx, nyy, nxy = remainder * nxx, remainder * nyy, remainder * nxy
    if e1 > -width:
        whole = (1.0 - remainder) * plain
        _, first, _ = _rounded(e1, width)
        _, second, _ = _rounded(x, (1.0 + poisson) * width)
        n1, n2 = whole * ((1.0 - poisson * poisson) * first + poisson * second), whole * second
        middle, half = 0.5 * (n1 + n2), 0.5 * (n1 - n2)
        nxx, nyy, nxy = nxx + middle + half * c, nyy + middle - half * c, nxy + half * s
    return nxx, nyy, nxy


@kernel(inline=True)
def film_tangent(
    exx: float, eyy: float, exy: float, plain: float, poisson: float, remainder: float, width: float
) -> tuple[float, float, float, float, float, float]:
    """Derivatives of (Nxx, Nyy, Nxy) with respect to (exx, eyy, 2 exy), symmetric: 11, 12, 13, 22, 23, 33, N/m."""
    c11, c12, c33 = plain, plain * poisson, 0.5 * plain * (1.0 - poisson)
    c13, c22, c23 = 0.0, c11, 0.0
    if remainder >= 1.0:
        return c11, c12, c13, c22, c23, c33
    e1, e2, c, s = _principal(exx, eyy, exy)
    x = e2 + poisson * e1
    if e1 > width and x > (1.0 + poisson) * width:
        return c11, c12, c13, c22, c23, c33
    c11, c12, c22, c33 = remainder * c11, remainder * c12, remainder * c22, remainder * c33
    if e1 > -width:
        whole = (1.0 - remainder) * plain
        _, first, stiff = _rounded(e1, width)
        _, second, across = _rounded(x, (1.0 + poisson) * width)
        a11 = whole * ((1.0 - poisson * poisson) * stiff + poisson * poisson * across)
        a12, a22 = whole * poisson * across, whole * across
        # with the directions n and m: dN = ... + turn (n.dE m) (n m + m n), as n and m turn by (n.dE m)/(e1 - e2)
        turn = a11 - a12
        if e1 - e2 > 1e-9 * (abs(e1) + width):
            turn = whole * ((1.0 - poisson * poisson) * first - (1.0 - poisson) * second) / (e1 - e2)
        nx, ny, nz = 0.5 * (1.0 + c), 0.5 * (1.0 - c), 0.5 * s
        mx, my, mz = -s, s, c
        c11 += a11 * nx * nx + 2.0 * a12 * nx * ny + a22 * ny * ny + 0.5 * turn * mx * mx
        c12 += a11 * nx * ny + a12 * (nx * nx + ny * ny) + a22 * nx * ny + 0.5 * turn * mx * my
        c13 += a11 * nx * nz + a12 * (ny - nx) * nz - a22 * ny * nz + 0.5 * turn * mx * mz
        c22 += a11 * ny * ny + 2.0 * a12 * nx * ny + a22 * nx * nx + 0.5 * turn * my * my
        c23 += a11 * ny * nz + a12 * (nx - ny) * nz - a22 * nx * nz + 0.5 * turn * my * mz
        c33 += (a11 - 2.0 * a12 + a22) * nz * nz + 0.5 * turn * mz * mz
    return c11, c12, c13, c22, c23, c33


@kernel
def film_states(strain: np.ndarray, poisson: float) -> np.ndarray:
    """State of every point, (m, p); strain (m, p, 3) as exx, eyy, exy."""
    states = np.empty(strain.shape[:2], dtype=np.int64)
    for k in range(strain.shape[0]):
        for point in range(strain.shape[1]):
            e = strain[k, point]
            states[k, point] = film_state(e[0], e[1], e[2], poisson)
    return states


@kernel
def film_resultants(
    strain: np.ndarray, plain: float, poisson: float, remainder: float, width: float, release: np.ndarray
) -> np.ndarray:
    """Stress resultants (m, p, 3) as Nxx, Nyy, Nxy of strains (m, p, 3) as exx, eyy, exy, N/m; `release` is P (m, p, 3)."""
    out = np.empty(strain.shape)
    for k in range(strain.shape[0]):
        for point in range(strain.shape[1]):
            e = strain[k, point]
            nxx, nyy, nxy = film_stress(e[0], e[1], e[2], plain, poisson, remainder, width)
            out[k, point, 0] = nxx + remainder * release[k, point, 0]
            out[k, point, 1] = nyy + remainder * release[k, point, 1]
            out[k, point, 2] = nxy + remainder * release[k, point, 2]
    return out


@kernel
def film_releases(
    strain: np.ndarray, plain: float, poisson: float, remainder: float, width: float, release: np.ndarray
) -> None:
    """P (m, p, 3) of the module docstring for reference strains (m, p, 3), into `release`, N/m."""
    for k in range(strain.shape[0]):
        for point in range(strain.shape[1]):
            e = strain[k, point]
            nxx, nyy, nxy = film_stress(e[0], e[1], e[2], plain, poisson, 0.0, 0.0)
            rxx, ryy, rxy = film_stress(e[0], e[1], e[2], plain, poisson, 0.0, width)
            pxx, pyy, pxy = film_stress(e[0], e[1], e[2], plain, poisson, 1.0, width)
            rest = 1.0 - remainder
            release[k, point, 0] = (nxx - rest * rxx) / remainder - pxx
            release[k, point, 1] = (nyy - rest * ryy) / remainder - pyy
            release[k, point, 2] = (nxy - rest * rxy) / remainder - pxy



def mean_tension(strain: np.ndarray) -> float:
    """Mean of the positive principal strains at points (m, p, 3) as exx, eyy, exy."""
    radius = np.hypot(0.5 * (strain[..., 0] - strain[..., 1]), strain[..., 2])
    return float(np.maximum(0.5 * (strain[..., 0] + strain[..., 1]) + radius, 0.0).mean()) if strain.size else 0.0
