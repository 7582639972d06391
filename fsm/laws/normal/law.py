"""What every law of the normal force is made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

__all__ = ["ContactDescription", "NormalLaw"]

Force = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
Energy = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class ContactDescription(Protocol):
    """What a case says of a contact; of a law's parameters only those are read that the law has.

    Attributes
    ----------
    stiffness : K of a whole face, N/m^exponent
    exponent : e, -
    damping, ramp : C of a whole face, N s/m, and the depth (m) at which it is fully on
    restitution : c, -; None for a law without it
    speed_floor : m/s
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
    """A law N(d, d') of the normal force of contact points.

    Attributes
    ----------
    force : kernel
        ``force(depth, closing, onset, share, params) -> force (m,) N, slopes (m, 2)``: dN/d depth, N/m, and
        dN/d closing, N s/m. `depth` (m,), m; `closing` (m,), m/s, positive when approaching; `onset` (m,), m/s: the
        closing speed with which the contact began, 0 for one that began within this step; `share` (m,): the part of
        its face that a point stands for. The force at `closing` 0 is the elastic one.
    energy : kernel
        ``energy(depth, share, params) -> (m,) J``, of the elastic force.
    params : function
        Array of the law's parameters, from a description.
    restitution : bool
        Whether the law is made from a coefficient of restitution; only such a law looks at `onset`.
    rate_dependent : function
        Whether the force depends on `closing`, given the array of parameters.
    """

    force: Force
    energy: Energy
    params: Callable[[ContactDescription], np.ndarray]
    restitution: bool
    rate_dependent: Callable[[np.ndarray], bool]
