"""Energy balance of a solve: stored energy + dissipated energy + numerical dissipation - work = const.

Also energy dissipated in a step of a time integrator, and work of loads between two equilibria, from two states.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fsm.solve.interface.records import Energy, PreviousState
from fsm.solve.interface.system import System
from fsm.solve.stepping.march import add_up

_ROUND_OFF = 1e-12
"""Round-off of the energy after many steps, relative to the stored energy at the start."""
JUDGED_FROM = 0.1
"""Part of the run in which no energy error stops the run: relative errors are large while the reference energy is
small."""
_EPSILON = float(np.finfo(float).eps)
_LEAST = 1e-60
"""Least floor, J: products of round-off in a system that does not move."""

_NUMBERS = (
    "start", "dissipated", "work", "numerical", "error", "worst", "drift", "gained", "turnover", "kinetic_worst",
    "round_off_floor",
)  # fmt: skip
"""Names of the numbers in the order of `fsm.solve.stepping.march`."""


@dataclass
class EnergyBalance:
    """Energy balance of a solve, J.

    `numerical` is the energy that the steps of generalized-alpha have dissipated so far by their finite size
    (`fsm.solve.stepping.generalized_alpha`); it is zero for other methods. `error` is the present residual with this energy,
    `worst` its largest magnitude so far. `drift` and `gained` are the largest magnitude and value of the residual without
    it: all energy that the steps have lost or gained.
    `turnover` is the reference energy: the largest energy stored, dissipated or put in so far. Relative errors refer to it.
    A reference energy below `round_off_floor` is round-off, for example of a structure at rest or of a mechanism without
    resistance. There is then no relative error. `pair_energy` (2, n_pairs) is the energy that friction and damping of every
    contact pair have dissipated.
    """

    start: float = 0.0
    dissipated: float = 0.0
    work: float = 0.0
    numerical: float = 0.0
    error: float = 0.0
    worst: float = 0.0
    drift: float = 0.0
    gained: float = 0.0
    turnover: float = 0.0
    kinetic_worst: float = 0.0
    round_off_floor: float = 0.0
    pair_energy: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))

    @classmethod
    def opened(cls, energy: Energy, work: float = 0.0) -> EnergyBalance:
        """Open the balance of a solve at the energy of its initial state; `work` is `Scales.work`, J.

        Round-off of the positions of bodies that joints hold changes their height, and thus their energy.
        """
        round_off_floor = max(_ROUND_OFF * sum(map(abs, energy.potential.values())), _EPSILON * work, _LEAST)
        return cls(start=energy.stored, round_off_floor=round_off_floor, pair_energy=np.zeros_like(energy.pair_power))

    def add(self, work: float, dissipated: float, of_pairs: np.ndarray) -> None:
        """Add work, dissipated energy, and the dissipated energy of every contact pair."""
        self.work += work
        self.dissipated += dissipated
        self.pair_energy = self.pair_energy + of_pairs

    def balance(self, stored: float, kinetic: float) -> None:
        """Update the residual with the present stored energy and its kinetic part."""
        numbers = self.numbers()
        add_up(numbers, stored, kinetic)
        self.set_numbers(numbers)

    def numbers(self) -> np.ndarray:
        """The numbers as an array, for `fsm.solve.stepping.march`."""
        return np.array([getattr(self, name) for name in _NUMBERS])

    def set_numbers(self, numbers: np.ndarray) -> None:
        """Set the numbers from an array that `numbers` made."""
        for name, number in zip(_NUMBERS, numbers.tolist(), strict=False):
            setattr(self, name, number)

    @property
    def stored(self) -> float:
        """Stored energy at the last update, J."""
        return self.start + self.work - self.dissipated - self.numerical + self.error

    def residual(self, stored: float) -> float:
        """Residual for a stored energy, J."""
        return stored - self.start + self.dissipated + self.numerical - self.work

    @property
    def text(self) -> str:
        """Worst error for messages."""
        lost = f"Numerical dissipation {self.numerical:.3g} J. " if self.numerical else ""
        return f"{lost}Energy error {self.drift:.3g} J; reference energy {self.turnover:.3g} J"

    @property
    def relative_error(self) -> float:
        """Largest residual relative to the reference energy; 0 if the reference energy is round-off."""
        return self._relative(self.worst)

    @property
    def relative_drift(self) -> float:
        """Largest energy that the steps have lost or gained, with numerical dissipation, relative to the reference energy; 0
        if the reference energy is round-off.
        """
        return self._relative(self.drift)

    @property
    def relative_numerical(self) -> float:
        """Numerical dissipation relative to the reference energy; 0 if the reference energy is round-off."""
        return self._relative(self.numerical)

    @property
    def relative_gain(self) -> float:
        """Largest gain relative to the reference energy; 0 if the reference energy is round-off."""
        return self._relative(self.gained)

    def _relative(self, energy: float) -> float:
        return energy / self.turnover if self.turnover > self.round_off_floor else 0.0


def mean_loss_of_elements(system: System, begin: PreviousState, end: PreviousState) -> float:
    """Mean dissipated power (W) of a step between two states (time, configuration), without contacts.

    The power follows from mean rates and the forces at both ends. Rates at the ends of a step contain stiff vibrations;
    the square of these rates would overestimate the loss. For nodes with slopes the forces are those in the middle of the
    step, where the chord of a rotation causes no strain rate. At the ends, a rotation of slopes by an angle d causes an
    apparent strain of d^2/2, which a stiff material dissipates.
    """
    if not system.rate_dependent and not len(system.memory()):
        return 0.0
    way = system.difference(begin[1], end[1])
    mean = way / (end[0] - begin[0])
    if system.of_vectors:
        return system.loss_of_elements(0.5 * (begin[0] + end[0]), system.retract(begin[1], 0.5 * way), mean, begin)
    return 0.5 * (system.loss_of_elements(*begin, mean, end) + system.loss_of_elements(*end, mean, begin))


def load_work(system: System, one: tuple[float, np.ndarray], two: tuple[float, np.ndarray]) -> float:
    """Work of loads between two states (time of the loads in s, q) by the trapezoidal rule, J.

    The power of loads is linear in velocities. Free bodies and nodes move by the difference of the states, and driven
    bodies with the speed of their drives.
    """
    change = system.difference(one[1], two[1])
    total = 0.0
    for t, q in (one, two):
        of_drives = _power(system, t, q, np.zeros_like(change))
        total += 0.5 * (_power(system, t, q, change) - of_drives + of_drives * (two[0] - one[0]))
    return total


def _power(system: System, t: float, q: np.ndarray, u: np.ndarray) -> float:
    energy = system.energy(t, q, u)
    return energy.input_power if energy.load_power is None else energy.load_power
