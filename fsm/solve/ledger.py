"""The energy ledger of a solve: stored energy + dissipated - work done = const."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fsm.stepping.march import balanced
from fsm.system import Energy

__all__ = ["JUDGED_FROM", "Ledger"]

_TRIFLE = 1e-12
"""Part of the energy stored at the start that is but round-off of it, also after many steps."""
JUDGED_FROM = 0.1
"""Part of the run before which an energy error stops nothing: so little is turned over that tolerances look large."""

_NUMBERS = "start", "dissipated", "work", "error", "worst", "gained", "turnover", "kinetic_worst", "trifle"
"""In the order of `fsm.stepping.march`."""


@dataclass
class Ledger:
    """Energy bookkeeping, J.

    `error` is the present imbalance, `worst` the largest so far, `gained` the largest gain, `turnover` the largest energy
    stored, dissipated or put in so far, which errors are measured against; up to `trifle` it is round-off, of the stored
    energy or of what forces do,
    and tells nothing (a structure that stays at rest, a mechanism that nothing resists). `pair_energy` (2, n_pairs) is what
    friction and damping of every contact pair have dissipated.
    """

    start: float = 0.0
    dissipated: float = 0.0
    work: float = 0.0
    error: float = 0.0
    worst: float = 0.0
    gained: float = 0.0
    turnover: float = 0.0
    kinetic_worst: float = 0.0
    trifle: float = 0.0
    pair_energy: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))

    @classmethod
    def opened(cls, energy: Energy) -> Ledger:
        """The ledger of a solve that begins in a state of that energy."""
        trifle = _TRIFLE * sum(map(abs, energy.potential.values()))
        return cls(start=energy.stored, trifle=trifle, pair_energy=np.zeros_like(energy.pair_power))

    def add(self, work: float, dissipated: float, of_pairs: np.ndarray) -> None:
        """Add the work, what was dissipated, and what of that contact pairs took."""
        self.work += work
        self.dissipated += dissipated
        self.pair_energy = self.pair_energy + of_pairs

    def balance(self, stored: float, kinetic: float) -> None:
        """Compare with the energy stored now."""
        self.error, self.worst, self.gained, self.turnover, self.kinetic_worst = balanced(
            stored, kinetic, self.start, self.dissipated, self.work, self.worst, self.gained, self.turnover,
            self.kinetic_worst,
        )  # fmt: skip

    def books(self) -> np.ndarray:
        """The numbers as an array, for `fsm.stepping.march`."""
        return np.array([getattr(self, name) for name in _NUMBERS])

    def take_over(self, books: np.ndarray) -> None:
        """Take the numbers of an array of `books`."""
        for name, number in zip(_NUMBERS, books.tolist(), strict=False):
            setattr(self, name, number)

    @property
    def relative_error(self) -> float:
        """Worst imbalance over the energy turned over; 0 when nothing happened."""
        return self.worst / self.turnover if self.turnover > self.trifle else 0.0

    @property
    def relative_gain(self) -> float:
        """Worst energy that nothing gave over the energy turned over; 0 when nothing happened."""
        return self.gained / self.turnover if self.turnover > self.trifle else 0.0
