"""Shear-deformable beam with Green's strain over its section: continuum element of Peng et al. 2019, eqs. 5 to 10.

    E11 = (r_x.r_x - 1)/2,   E22 = (r_y.r_y - 1)/2,   E12 = r_x.r_y/2,
    U = 1/2 int E E11^2 + E E22^2 + 4 k mu E12^2 dV.

Peng et al. print 2 mu; this misprint halves the shear energy. Poisson's ratio is zero in the normal stresses, as in the
paper's example, while mu = E/2(1 + nu). The section of this element stretches uniformly. With the full law, a bent bar could
not expand on one side and contract on the other. A bar would then be too stiff by 1/(1 - nu^2). k = 5/6.

The law is the St Venant-Kirchhoff law: the stress is linear in Green's strain. This strain differs from the strain of
`beam_section` by squares of strains. There are 3 x 2 Gauss points.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def _strains(z: np.ndarray, strain: np.ndarray, gradient: np.ndarray) -> None:
    """Compute (E11, E22, 2 E12) and their gradients (3, 4) with respect to z = (r_x, r_y)."""
    ax, ay, dx, dy = z[0], z[1], z[2], z[3]
    strain[0], strain[1], strain[2] = 0.5 * (ax * ax + ay * ay - 1.0), 0.5 * (dx * dx + dy * dy - 1.0), ax * dx + ay * dy
    gradient[0, 0], gradient[0, 1] = ax, ay
    gradient[1, 2], gradient[1, 3] = dx, dy
    gradient[2, 0], gradient[2, 1], gradient[2, 2], gradient[2, 3] = dx, dy, ax, ay


@kernel
def _hessians(z: np.ndarray, hessian: np.ndarray) -> None:
    """Compute second derivatives (3, 4, 4) of the strains with respect to z, which are constant."""
    for c in range(2):
        hessian[0, c, c] = 1.0
        hessian[1, 2 + c, 2 + c] = 1.0
        hessian[2, c, 2 + c] = 1.0
        hessian[2, 2 + c, c] = 1.0


@kernel
def green_strains(z: np.ndarray, strains: np.ndarray, gradients: np.ndarray) -> None:
    """Compute (E11, E22, 2 E12) (m, g, 3) and gradients (m, g, 3, 4) from z (m, g, 4); constant zeros are not set."""
    for i in range(z.shape[0]):
        for g in range(z.shape[1]):
            _strains(z[i, g], strains[i, g], gradients[i, g])


@kernel
def green_hessians(z: np.ndarray, hessians: np.ndarray) -> None:
    """Compute second derivatives (m, g, 3, 4, 4) of the strains; constant zeros are not set."""
    for i in range(z.shape[0]):
        for g in range(z.shape[1]):
            _hessians(z[i, g], hessians[i, g])
