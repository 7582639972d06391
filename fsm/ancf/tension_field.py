"""Stretch of an isotropic film: plain, or as a tension field that carries no compression.

Plain: U = C/2 (ex^2 + ey^2 + 2 nu ex ey + 2 (1 - nu) exy^2), C = Et/(1 - nu^2), of Green strains.

Tension field, by the mixed criterion of principal stress and strain (e1 >= e2 of the Green strain, s2 the smaller
principal stress of the plain law):

    taut       s2 > 0                   plain
    wrinkled   s2 <= 0, e1 > 0          U = Et/2 e1^2: uniaxial tension along the direction of e1
    slack      e1 <= 0                  U = 0

It is the relaxed energy: at s2 = 0, e2 = -nu e1, plain and uniaxial energies and stresses agree, so the stress is
continuous and the tangent its derivative. Its stress is never compressive, so nothing buckles.

Nothing would hold a slack film in its plane either. So a part eps of the film, the remainder, follows the plain law from a
stress of its own: with the relaxed stress N and a reference strain E0,

    stress = (1 - eps) N(E) + eps (C E + P),   P = N(E0) - C E0

`release` (P) is renewed on the way to an equilibrium and stands at its strain from then on. At the equilibrium the stress is
N, without compression. Where the film is taut P is zero and the law the plain one. With P = 0 everywhere the remainder
would carry compression, which buckles a thin film at its free edges. eps = 1 is the plain law.

On the way to an equilibrium eps is of `SETTLING`, which comes near it quickly, and then `REMAINDER`. What moves about the
equilibrium has `MOVING`: the forces at rest are nearly the same. Small motions normal to a flat film do not depend on
eps.

References
----------
Roddeman, Drukker, Oomens, Janssen, J. Appl. Mech. 54 (1987) 884-892. Pipkin, IMA J. Appl. Math. 36 (1986) 85-99.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.kernels.jit import kernel

__all__ = [
    "MOVING", "REMAINDER", "SETTLING", "SLACK", "TAUT", "WRINKLED", "film_energy", "film_releases", "film_resultants",
    "film_state", "film_states", "film_stress", "film_tangent",
]  # fmt: skip

TAUT, WRINKLED, SLACK = 0, 1, 2
SETTLING, REMAINDER, MOVING = (1e-2, 1e-3), 1e-4, 1e-2
"""Part of the plain law's stiffness that a wrinkled or slack film keeps.

Sheared strip, 32 x 32 cells: 1e-2, 1e-3, 1e-4, 1e-5 take 32, 66, 136, 200 iterations to 1e-6, and the mean stress is off by
up to 1 %, 0.03 %, 0.003 % and 0. Corner-pulled films that are struck: 1e-2 in place of 1e-4 changes the largest
displacement by 0.2 % and their frequency by less, and saves up to two thirds of the time (2026-11-23).
"""


@kernel(inline=True)
def _principal(exx: float, eyy: float, exy: float) -> tuple[float, float, float, float]:
    """Principal strains e1 >= e2, and the direction (cos, sin) of e1."""
    middle, half = 0.5 * (exx + eyy), 0.5 * (exx - eyy)
    radius = math.sqrt(half * half + exy * exy)
    angle = 0.5 * math.atan2(exy, half)
    return middle + radius, middle - radius, math.cos(angle), math.sin(angle)


@kernel(inline=True)
def film_state(exx: float, eyy: float, exy: float, poisson: float) -> int:
    """TAUT, WRINKLED or SLACK."""
    e1, e2, _, _ = _principal(exx, eyy, exy)
    if e2 + poisson * e1 > 0.0:
        return TAUT
    return WRINKLED if e1 > 0.0 else SLACK


@kernel(inline=True)
def film_energy(exx: float, eyy: float, exy: float, plain: float, poisson: float, remainder: float) -> float:
    """Energy per area without that of P, J/m^2; `plain` is C, `remainder` eps."""
    shear = 2.0 * (1.0 - poisson) * exy * exy
    whole = 0.5 * plain * (exx * exx + eyy * eyy + 2.0 * poisson * exx * eyy + shear)
    if remainder >= 1.0:
        return whole
    state = film_state(exx, eyy, exy, poisson)
    energy = whole if state == TAUT else remainder * whole
    if state == WRINKLED:
        e1, _, _, _ = _principal(exx, eyy, exy)
        energy += (1.0 - remainder) * 0.5 * plain * (1.0 - poisson * poisson) * e1 * e1
    return energy


@kernel(inline=True)
def film_stress(
    exx: float, eyy: float, exy: float, plain: float, poisson: float, remainder: float
) -> tuple[float, float, float]:
    """Resultants Nxx, Nyy, Nxy (second Piola-Kirchhoff) without eps P, N/m: derivatives of the energy by exx, eyy, 2 exy."""
    nxx, nyy = plain * (exx + poisson * eyy), plain * (eyy + poisson * exx)
    nxy = plain * (1.0 - poisson) * exy
    if remainder >= 1.0:
        return nxx, nyy, nxy
    state = film_state(exx, eyy, exy, poisson)
    part = 1.0 if state == TAUT else remainder
    nxx, nyy, nxy = part * nxx, part * nyy, part * nxy
    if state == WRINKLED:
        e1, _, c, s = _principal(exx, eyy, exy)
        tension = (1.0 - remainder) * plain * (1.0 - poisson * poisson) * e1
        nxx, nyy, nxy = nxx + tension * c * c, nyy + tension * s * s, nxy + tension * c * s
    return nxx, nyy, nxy


@kernel(inline=True)
def film_tangent(
    exx: float, eyy: float, exy: float, plain: float, poisson: float, remainder: float
) -> tuple[float, float, float, float, float, float]:
    """Derivatives of (Nxx, Nyy, Nxy) by (exx, eyy, 2 exy), symmetric: 11, 12, 13, 22, 23, 33, N/m."""
    part = 1.0
    state = TAUT
    if remainder < 1.0:
        state = film_state(exx, eyy, exy, poisson)
        part = 1.0 if state == TAUT else remainder
    c11, c12, c33 = part * plain, part * plain * poisson, part * 0.5 * plain * (1.0 - poisson)
    c13, c22, c23 = 0.0, c11, 0.0
    if state == WRINKLED:
        e1, e2, c, s = _principal(exx, eyy, exy)
        young = (1.0 - remainder) * plain * (1.0 - poisson * poisson)
        # dN = young (de1 n n + e1 d(n n)); with the other direction m: d(n n) = (n.dE m)/(e1 - e2) (n m + m n)
        turn = young * e1 / (e1 - e2)
        nx, ny, nz = c * c, s * s, c * s
        mx, my, mz = -2.0 * c * s, 2.0 * c * s, c * c - s * s
        c11 += young * nx * nx + 0.5 * turn * mx * mx
        c12 += young * nx * ny + 0.5 * turn * mx * my
        c13 += young * nx * nz + 0.5 * turn * mx * mz
        c22 += young * ny * ny + 0.5 * turn * my * my
        c23 += young * ny * nz + 0.5 * turn * my * mz
        c33 += young * nz * nz + 0.5 * turn * mz * mz
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
    strain: np.ndarray, plain: float, poisson: float, remainder: float, release: np.ndarray
) -> np.ndarray:
    """Stress resultants (m, p, 3) as Nxx, Nyy, Nxy of strains (m, p, 3) as exx, eyy, exy, N/m; `release` is P (m, p, 3)."""
    out = np.empty(strain.shape)
    for k in range(strain.shape[0]):
        for point in range(strain.shape[1]):
            e = strain[k, point]
            nxx, nyy, nxy = film_stress(e[0], e[1], e[2], plain, poisson, remainder)
            out[k, point, 0] = nxx + remainder * release[k, point, 0]
            out[k, point, 1] = nyy + remainder * release[k, point, 1]
            out[k, point, 2] = nxy + remainder * release[k, point, 2]
    return out


@kernel
def film_releases(strain: np.ndarray, plain: float, poisson: float, release: np.ndarray) -> None:
    """P (m, p, 3) of the module docstring for reference strains (m, p, 3), into `release`, N/m."""
    for k in range(strain.shape[0]):
        for point in range(strain.shape[1]):
            e = strain[k, point]
            nxx, nyy, nxy = film_stress(e[0], e[1], e[2], plain, poisson, 0.0)
            pxx, pyy, pxy = film_stress(e[0], e[1], e[2], plain, poisson, 1.0)
            release[k, point, 0] = nxx - pxx
            release[k, point, 1] = nyy - pyy
            release[k, point, 2] = nxy - pxy
