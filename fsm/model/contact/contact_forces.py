"""Laws of contact and friction with their parameters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.laws.friction import FrictionLaw
from fsm.laws.normal import NormalLaw


class NormalForce(NamedTuple):
    """Normal law with its parameters; `exponent` and `speed_floor` (m/s) as in `fsm.case.models.contact.Contact`."""

    law: NormalLaw
    params: np.ndarray
    exponent: float
    speed_floor: float

    def elastic(self, depth: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Forces of contacts at rest, N."""
        force, _ = self.law.force(depth, np.zeros_like(depth), np.ones_like(depth), share, self.params)
        return np.ascontiguousarray(force, dtype=float)


class FrictionForce(NamedTuple):
    """A friction law with its parameters.

    Attributes
    ----------
    law : FrictionLaw
    params : parameters of the law
    presliding : largest deflection of the bristles, m; infinite without bristles
    across : coefficient across the length of a plate over the coefficient along it, see
        `fsm.interactions.contact.anisotropic_friction`
    """

    law: FrictionLaw
    params: np.ndarray
    presliding: float
    across: float = 1.0
