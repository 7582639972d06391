"""Round-off of stiff springs: which part of the forces of a run it is, and whether the run can be believed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.results.solution import Solution
from fsm.system import System

__all__ = ["RoundOff", "round_off_of", "rounded_places"]

_REFUSED, _WARNED = 5e-2, 1e-3
"""Round-off over acting forces: a run is refused above the first, warned of above the second."""
_STATES = 20
"""States that displacements are looked up in, at most."""
_NOTHING = 1e3
"""Energy stored, over what the rounding of positions alone stores in all springs, below which nothing resists a motion."""
_DIGITS = 1e-9
"""Part of the structure's size that places in a case are written to."""
_AT_REST = 1e-12
"""Energy turned over, over all that is stored, below which it is round-off of sums."""


@dataclass(frozen=True)
class RoundOff:
    """Forces that are round-off, and forces that act.

    Attributes
    ----------
    stiffness : N/m
        The largest.
    force : N
        That stiffness times the rounding of positions.
    acting : N
        Energy stored or dissipated, over the distance moved by; infinite where nothing happens.
    """

    stiffness: float
    force: float
    acting: float

    @property
    def part(self) -> float:
        """Part of the forces that is round-off."""
        return self.force / self.acting

    def refusal(self) -> str:
        """Why the run cannot be believed, or nothing."""
        if not self.part > _REFUSED:
            return ""
        return f"forces cannot be resolved: {self._cause()}; {_REMEDY}"

    def warning(self) -> str:
        """What a user should know of the run, or nothing."""
        if not self.part > _WARNED:
            return ""
        return f"forces are known to about {100 * self.part:.2g} % only: {self._cause()}; {_REMEDY}"

    def _cause(self) -> str:
        springs = f"the stiffest springs, {self.stiffness:.2g} N/m, times the rounding of positions"
        return f"{springs} are {self.force:.2g} N, and the forces of the run about {self.acting:.2g} N"


_REMEDY = "lower that stiffness (young, axial, translation), or the number of segments"


def round_off_of(system: System, solution: Solution) -> RoundOff:
    """Forces that are round-off in a run, by the stiffness at its first and last record.

    Positions are known to eps times the size L of the structure, so the force of a spring k is known to eps L k. Forces that
    act follow from energies, which round-off hardly changes: U/d with the largest energy U stored or dissipated, and
    the largest distance d that anything moved by. The force of a drive would be round-off itself.
    """
    nothing = RoundOff(0.0, 0.0, np.inf)
    if system.nu == 0 or len(solution) == 0:
        return nothing
    scales, eps = system.scales(), float(np.finfo(float).eps)
    ends = {0, len(solution) - 1}
    matrices = [system.linearise(float(solution.time[k]), solution.q[k], None).stiffness.data for k in sorted(ends)]
    stiffness = max(float(np.abs(data).max(initial=0.0)) for data in matrices)
    force = eps * scales.widest * stiffness
    stored = np.zeros(len(solution))
    for name, energies in solution.energy.items():
        if name not in ("dissipated", "work", "error"):
            stored = stored + energies
    turned_over = (np.abs(stored - stored[0]), solution.energy["dissipated"], solution.energy["kinetic"])
    energy = float(max(energies.max() for energies in turned_over))
    moved = _distance(system, solution)
    in_rounding = system.nu * force * eps * scales.widest
    if moved <= 0.0 or energy <= max(_NOTHING * in_rounding, _AT_REST * float(np.abs(stored).max())):
        return RoundOff(stiffness, force, np.inf)
    return RoundOff(stiffness, force, energy / moved)


def rounded_places(system: System, start: tuple[float, np.ndarray, np.ndarray]) -> float:
    """Energy (J) that springs store because a case gives places to so many digits: a linkage closes no better."""
    if system.nu == 0:
        return 0.0
    t, q, _ = start
    stiffness = float(np.abs(system.linearise(t, q, None).stiffness.data).max(initial=0.0))
    return 0.5 * stiffness * (_DIGITS * float(system.scales().span[0])) ** 2


def _distance(system: System, solution: Solution) -> float:
    """Largest distance that anything has moved by, m; a turn counts by the length of an element."""
    scales = system.scales()
    travel = float(np.abs(solution.travel).max(initial=0.0))
    chosen = np.unique(np.linspace(0, len(solution) - 1, _STATES).astype(int))
    lengths = scales.length / scales.increment
    moved = (np.abs(system.difference(solution.q[0], solution.q[k]) * lengths).max(initial=0.0) for k in chosen)
    return max(travel, float(max(moved)))
