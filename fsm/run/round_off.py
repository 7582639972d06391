"""Round-off of stiff springs: its part of the forces of a run, and the refusal of unreliable runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.results.solution import Solution
from fsm.solve.equations.newton import at_rest
from fsm.solve.interface.system import System

_REFUSED, _WARNED = 5e-2, 1e-3
"""Ratios of round-off to acting forces: above the first value a run is refused, above the second it has a warning."""
_STATES = 20
"""Largest number of records searched for the largest displacement."""
_UNRESISTED = 1e3
"""Stored energy, relative to the energy that rounded positions store in all springs, below which no spring resists the
motion."""
_DIGITS = 1e-9
"""Precision of positions in a case file relative to the size of the structure, and of angles in rad."""
_EPS = float(np.finfo(float).eps)
_AT_REST = 1e-12
"""Ratio of the reference energy to the stored energy, below which the reference energy is round-off of sums."""


@dataclass(frozen=True)
class RoundOff:
    """Force due to round-off of one kind of unknown, positions or rotations, compared with the acting force.

    Attributes
    ----------
    stiffness : N/m, of rotations N m/rad
        Largest stiffness of the model against the unknowns of this kind.
    force : N, of rotations N m
        Largest stiffness times the round-off of the unknowns.
    acting : N, of rotations N m
        Acting force: energy stored or dissipated, divided by the distance moved; infinite if nothing moves.
    kind : "position" or "rotation"
    """

    stiffness: float
    force: float
    acting: float
    kind: str = "position"

    @property
    def part(self) -> float:
        """Part of the acting force that is round-off."""
        return self.force / self.acting

    def refusal(self) -> str:
        """Reason why the run is unreliable; empty if it is reliable."""
        if not self.part > _REFUSED:
            return ""
        return f"round-off exceeds {100 * _REFUSED:g} % of the {self._what}s: {self._cause()}; {_REMEDY}"

    def warning(self) -> str:
        """Warning for the user; empty if round-off is negligible."""
        if not self.part > _WARNED:
            return ""
        return f"round-off is about {100 * self.part:.2g} % of the {self._what}s: {self._cause()}; {_REMEDY}"

    @property
    def _what(self) -> str:
        return "force" if self.kind == "position" else "moment"

    def _cause(self) -> str:
        of_stiffness, of_force = ("N/m", "N") if self.kind == "position" else ("N m/rad", "N m")
        product = f"the largest stiffness, {self.stiffness:.2g} {of_stiffness}, times the round-off of {self.kind}s"
        return f"{product} is {self.force:.2g} {of_force}, and the acting {self._what} is about {self.acting:.2g} {of_force}"


_REMEDY = "reduce that stiffness (young, axial, translation) or the number of segments"


def round_off_of(system: System, solution: Solution) -> RoundOff:
    """Round-off of the forces of a run, from the stiffness at its first and last record; the worse kind of unknown.

    Positions have the round-off eps L with the size L of the structure, rotations the round-off eps. The force of a spring k
    has the round-off eps L k. The acting force is U/d, with the largest energy U stored or dissipated and the largest
    displacement d; the acting moment is U over the largest rotation. Round-off hardly changes energies; the force of a drive
    could itself be round-off.
    """
    if system.nu == 0 or len(solution) == 0:
        return RoundOff(0.0, 0.0, np.inf)
    scales = system.scales()
    ends = sorted({0, len(solution) - 1})
    with at_rest(system, still=False):  # penalties of locked directions have no round-off: openings below it are zero
        matrices = [system.linearise(float(solution.time[k]), solution.q[k], None).stiffness for k in ends]
    forces = _EPS * np.max([scales.span_forces(matrix) for matrix in matrices], axis=0)
    stored = np.zeros(len(solution))
    for name, energies in solution.energy.items():
        if name not in ("dissipated", "numerical", "work", "error"):
            stored = stored + energies
    kinds = (np.abs(stored - stored[0]), solution.energy["dissipated"], solution.energy["kinetic"])
    energy = float(max(energies.max() for energies in kinds))
    in_rounding = system.nu * _EPS * float((forces * scales.span).max())
    resisted = energy > max(_UNRESISTED * in_rounding, _AT_REST * float(np.abs(stored).max()))
    moved, found = _moved(system, solution), []
    for kind, chosen, way in (("position", scales.positions, moved[0]), ("rotation", ~scales.positions, moved[1])):
        force = float(forces[chosen].max(initial=0.0))
        acting = energy / way if resisted and way > 0.0 else np.inf
        stiffness = force / (_EPS * (scales.extent if kind == "position" else 1.0))
        found.append(RoundOff(stiffness, force, acting, kind))
    return max(found, key=lambda one: one.part)


def position_round_off_energy(system: System, start: tuple[float, np.ndarray, np.ndarray]) -> float:
    """Energy (J) stored in springs because positions and angles in a case file have a finite number of digits."""
    if system.nu == 0:
        return 0.0
    t, q, _ = start
    scales = system.scales()
    with at_rest(system, still=False):
        forces = scales.span_forces(system.linearise(t, q, None).stiffness)
    return 0.5 * _DIGITS**2 * float((forces * scales.span).max())


def _moved(system: System, solution: Solution) -> tuple[float, float]:
    """Largest displacement (m) and largest rotation (rad; slopes count as rotations) of a run, with its drives."""
    positions = system.scales().positions
    chosen = np.unique(np.linspace(0, len(solution) - 1, _STATES).astype(int))
    moved = np.max([np.abs(system.difference(solution.q[0], solution.q[k])) for k in chosen], axis=0)
    travel = np.abs(solution.travel).max(axis=0, initial=0.0)
    turns = np.array([system.drive_turns(k) for k in range(len(travel))], dtype=bool)
    return (
        float(max(moved[positions].max(initial=0.0), travel[~turns].max(initial=0.0))),
        float(max(moved[~positions].max(initial=0.0), travel[turns].max(initial=0.0))),
    )
