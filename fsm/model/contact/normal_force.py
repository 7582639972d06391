"""Normal contact law with its parameters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

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
        return np.asarray(force)
