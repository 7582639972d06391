"""Round-off of stiff springs: its part of the forces of a run, and the refusal of unreliable runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.results.solution import Solution
from fsm.system import System

__all__ = ["RoundOff", "position_round_off_energy", "round_off_of"]

_REFUSED, _WARNED = 5e-2, 1e-3
"""Ratios of round-off to acting forces: above the first value a run is refused, above the second it has a warning."""
_STATES = 20
"""Largest number of records searched for the largest displacement."""
_UNRESISTED = 1e3
"""Stored energy, relative to the energy that rounded positions store in all springs, below which no spring resists the
motion."""
_DIGITS = 1e-9
"""Precision of positions in a case file, relative to the size of the structure."""
_AT_REST = 1e-12
"""Ratio of the reference energy to the stored energy, below which the reference energy is round-off of sums."""


@dataclass(frozen=True)
class RoundOff:
    """Force due to round-off, compared with the acting force.

    Attributes
    ----------
    stiffness : N/m
        Largest stiffness of the model.
    force : N
        Largest stiffness times the round-off of positions.
    acting : N
        Acting force: energy stored or dissipated, divided by the distance moved; infinite if no body moves.
    """

    stiffness: float
    force: float
    acting: float

    @property
    def part(self) -> float:
        """Part of the acting force that is round-off."""
        return self.force / self.acting

    def refusal(self) -> str:
        """Reason why the run is unreliable; empty if it is reliable."""
        if not self.part > _REFUSED:
            return ""
        return f"round-off exceeds {100 * _REFUSED:g} % of the forces: {self._cause()}; {_REMEDY}"

    def warning(self) -> str:
        """Warning for the user; empty if round-off is negligible."""
        if not self.part > _WARNED:
            return ""
        return f"round-off is about {100 * self.part:.2g} % of the forces: {self._cause()}; {_REMEDY}"

    def _cause(self) -> str:
        product = f"the largest stiffness, {self.stiffness:.2g} N/m, times the round-off of positions"
        return f"{product} is {self.force:.2g} N, and the acting force is about {self.acting:.2g} N"


_REMEDY = "reduce that stiffness (young, axial, translation) or the number of segments"


def round_off_of(system: System, solution: Solution) -> RoundOff:
    """Round-off of the forces of a run, from the stiffness at its first and last record.

    Positions have the round-off eps L with the size L of the structure. The force of a spring k has the round-off eps L k.
    The acting force is U/d, with the largest energy U stored or dissipated and the largest displacement d. Round-off hardly
    changes energies; the force of a drive could itself be round-off.
    """
    if system.nu == 0 or len(solution) == 0:
        return RoundOff(0.0, 0.0, np.inf)
    scales, eps = system.scales(), float(np.finfo(float).eps)
    ends = {0, len(solution) - 1}
    matrices = [system.linearise(float(solution.time[k]), solution.q[k], None).stiffness.data for k in sorted(ends)]
    stiffness = max(float(np.abs(data).max(initial=0.0)) for data in matrices)
    force = eps * scales.largest_span * stiffness
    stored = np.zeros(len(solution))
    for name, energies in solution.energy.items():
        if name not in ("dissipated", "work", "error"):
            stored = stored + energies
    kinds = (np.abs(stored - stored[0]), solution.energy["dissipated"], solution.energy["kinetic"])
    energy = float(max(energies.max() for energies in kinds))
    moved = _distance(system, solution)
    in_rounding = system.nu * force * eps * scales.largest_span
    if moved <= 0.0 or energy <= max(_UNRESISTED * in_rounding, _AT_REST * float(np.abs(stored).max())):
        return RoundOff(stiffness, force, np.inf)
    return RoundOff(stiffness, force, energy / moved)


def position_round_off_energy(system: System, start: tuple[float, np.ndarray, np.ndarray]) -> float:
    """Energy (J) stored in springs because positions in a case file have a finite number of digits."""
    if system.nu == 0:
        return 0.0
    t, q, _ = start
    stiffness = float(np.abs(system.linearise(t, q, None).stiffness.data).max(initial=0.0))
    return 0.5 * stiffness * (_DIGITS * float(system.scales().span[0])) ** 2


def _distance(system: System, solution: Solution) -> float:
    """Largest displacement of a run, m; rotations count with the length of an element."""
    scales = system.scales()
    travel = float(np.abs(solution.travel).max(initial=0.0))
    chosen = np.unique(np.linspace(0, len(solution) - 1, _STATES).astype(int))
    lengths = scales.length / scales.increment
    moved = (np.abs(system.difference(solution.q[0], solution.q[k]) * lengths).max(initial=0.0) for k in chosen)
    return max(travel, float(max(moved)))
