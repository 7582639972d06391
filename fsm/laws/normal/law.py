"""Protocol of a law of the normal force."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

Force = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
Energy = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class ContactDescription(Protocol):
    """Parameters of a contact in a case; each law reads only its own parameters.

    Attributes
    ----------
    stiffness : K of a whole face, N/m^exponent
    exponent : e, -
    damping, ramp : C of a whole face, N s/m, and the penetration (m) at which it reaches its full value
    restitution : coefficient of restitution c, -; None for a law without it
    speed_floor : smallest speed in the denominator of the damping term, m/s
    """

    @property
    def stiffness(self) -> float: ...  # noqa: D102
    @property
    def exponent(self) -> float: ...  # noqa: D102
    @property
    def damping(self) -> float: ...  # noqa: D102
    @property
    def ramp(self) -> float: ...  # noqa: D102
    @property
    def restitution(self) -> float | None: ...  # noqa: D102
    @property
    def speed_floor(self) -> float: ...  # noqa: D102


class NormalLaw(NamedTuple):
    """Law N(d, d') of the normal force of contact points.

    Attributes
    ----------
    force : kernel
        ``force(depth, closing, onset, share, params) -> force, slopes``. The force is (m,), N. The slopes (m, 2) are
        dN/d depth, N/m, and dN/d closing, N s/m. Without closing speed the force is the elastic one.

        `depth` (m,), m, is the penetration. `closing` (m,), m/s, is the closing speed, positive in approach.
        `onset` (m,), m/s, is the closing speed at the onset of the contact, and 0 if it began within this step.
        `share` (m,) is the part of the face that a point represents.
    energy : kernel
        ``energy(depth, share, params)``: energy of the elastic force, (m,), J.
    params : function
        Array of the law's parameters from a description.
    restitution : bool
        Whether the law has a coefficient of restitution; only such a law uses `onset`.
    rate_dependent : function
        Whether the force depends on `closing` for a given array of parameters.
    """

    force: Force
    energy: Energy
    params: Callable[[ContactDescription], np.ndarray]
    restitution: bool
    rate_dependent: Callable[[np.ndarray], bool]
