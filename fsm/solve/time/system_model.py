"""Model of any system for time steps, by the methods of the system."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fsm.errors import NotConverged
from fsm.kernels.blocks import BlockMatrix, BlockPattern
from fsm.kernels.scatter import effective_stiffness
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.interface.records import Linearised, Observation, PreviousState
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import mean_loss_of_elements
from fsm.solve.stepping.model import CREASES, DRIVES, KINETIC, PANELS, STEADY


class SystemModel:
    """Model of a system for time steps (`fsm.solve.stepping.model`), with its tangent, factorisation and last rejection."""

    def __init__(self, system: System, q: np.ndarray) -> None:
        self.system = system
        self.linear = LinearSolver()
        self.reason = ""
        self.force, self.retract, self.touching = system.force, system.retract, system.touching
        self.longest_step, self.lock, self.advance = system.longest_step, system.lock, system.advance
        self.measure_step, self.halfway, self.consistent = system.measure_step, system.halfway, system.consistent
        self._mass = system.mass(q)
        self._pattern: BlockPattern | None = None
        self._inertia = np.zeros((0, 0, 0))
        self._linear: Linearised | None = None
        self._map: np.ndarray | None = None
        self._last: PreviousState = 0.0, q
        self._observed: tuple[float, np.ndarray, np.ndarray, Observation] | None = None
        self._kept: tuple[Any, ...] = ()

    def renewed_force(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """See `fsm.solve.stepping.model`."""
        self._linear = linear = self.system.linearise(t, q, u)
        if linear.stiffness.pattern is not self._pattern:
            self._pattern = linear.stiffness.pattern
            self._inertia = self.system.inertia(q, self._pattern)
        return linear.force

    def factorise(self, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
        """See `fsm.solve.stepping.model`."""
        linear, pattern = self._linear, self._pattern
        assert linear is not None and pattern is not None
        moving = by_rate * linear.damping.data + by_acceleration * self._inertia
        self._map = self.system.increment_map(x) if maps else None
        data = effective_stiffness(linear.stiffness.data, moving, 1.0, self._map, pattern.indices)
        return self._factorised(linear.stiffness.with_data(data))

    def factorise_mass(self) -> bool:
        """See `fsm.solve.stepping.model`."""
        assert self._pattern is not None
        return self._factorised(BlockMatrix(self._pattern, self._inertia))

    def _factorised(self, matrix: BlockMatrix) -> bool:
        try:
            self.linear.factorise(matrix)
        except NotConverged:
            return False
        return True

    def solve(self, right: np.ndarray) -> np.ndarray:
        """See `fsm.solve.stepping.model`; NaN if the matrix is singular."""
        try:
            return self.linear.solve(right)
        except NotConverged:
            return np.full(len(right), math.nan)

    def mapped(self, change: np.ndarray) -> np.ndarray:
        """See `fsm.solve.stepping.model`."""
        if self._map is None:
            return change
        return np.asarray(self._map @ change.reshape(len(self._map), -1, 1)).ravel()

    def mass_times(self, vector: np.ndarray) -> np.ndarray:
        """See `fsm.solve.stepping.model`."""
        return np.asarray(self._mass @ vector)

    def stiffness_times(self, vector: np.ndarray) -> np.ndarray:
        """See `fsm.solve.stepping.model`."""
        assert self._linear is not None
        return self._linear.stiffness.times(vector)

    def damping_times(self, vector: np.ndarray) -> np.ndarray:
        """See `fsm.solve.stepping.model`."""
        assert self._linear is not None
        return self._linear.damping.times(vector)

    def unable(self) -> bool:
        """See `fsm.solve.stepping.model`; always false, since SciPy solves the equations if the block solver fails."""
        return False

    def observe(self, t: float, q: np.ndarray, u: np.ndarray) -> Observation:
        """Quantities of an accepted state; they are stored, because the next step begins at this state."""
        known = self._observed
        if known is None or known[0] != t or not (np.array_equal(known[1], q) and np.array_equal(known[2], u)):
            known = self._observed = t, q.copy(), u.copy(), self.system.observe(t, q, u)
        return known[3]

    def energies(
        self, t: float, q: np.ndarray, u: np.ndarray, step: float, record: np.ndarray
    ) -> tuple[float, float, float, float, float]:
        """See `fsm.solve.stepping.model`."""
        observed, dissipated = self.observe(t, q, u), 0.0
        energy = observed.energy
        if step > 0.0:
            dissipated = mean_loss_of_elements(self.system, self._last, (t, q))
        self._last = t, q.copy()
        record[KINETIC], record[STEADY] = energy.kinetic, 0.0  # unknown
        record[PANELS], record[CREASES] = energy.potential.get("panels", 0.0), energy.potential.get("creases", 0.0)
        count = len(observed.drive.travel)
        record[DRIVES : DRIVES + count] = observed.drive.travel
        record[DRIVES + count : DRIVES + 2 * count] = observed.drive.force
        record[DRIVES + 2 * count : DRIVES + 2 * count + len(observed.pairs.force)] = observed.pairs.force
        return energy.kinetic, energy.stored_at_rest, dissipated, energy.input_power, energy.driven

    def part_of_step(self, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
        """See `fsm.solve.stepping.model`."""
        rejection = self.system.rejection(t, q, u, step)
        self.reason = "" if rejection is None else rejection.reason
        if rejection is not None:
            return rejection.part
        return 2.0 if self.system.part_before_event(t, q, u, step) == 1.0 else 1.0

    def accept(self, t: float, q: np.ndarray, u: np.ndarray) -> float:
        """See `fsm.solve.stepping.model`."""
        self.system.commit(t, q, u)
        return self.system.longest_step(t, q, u)

    def to_minimal(self, t: float, q: np.ndarray, u: np.ndarray, y: np.ndarray, v: np.ndarray) -> tuple[int, int]:
        """See `fsm.solve.stepping.model`; steps in Python project all coordinates."""
        return 0, 0

    def keep_tangent(self, by_stiffness: float, by_damping: float, first: bool) -> bool:
        """See `fsm.solve.stepping.model`."""
        linear = self._linear
        assert linear is not None
        stiffness, damping = by_stiffness * linear.stiffness.data, by_damping * linear.damping.data
        low_rank = None if linear.stiffness.low_rank is None else linear.stiffness.low_rank.scaled(by_stiffness)
        if first:
            self._kept = linear.stiffness.pattern, stiffness, damping, low_rank
            return True
        pattern, *kept, other = self._kept
        if linear.stiffness.pattern is not pattern:
            return False
        if low_rank is not None:
            low_rank = low_rank.plus(other)
        self._linear = Linearised(
            linear.force, BlockMatrix(pattern, kept[0] + stiffness, low_rank), BlockMatrix(pattern, kept[1] + damping)
        )
        return True

    def powers(
        self, t: float, q: np.ndarray, u: np.ndarray, of_pairs: np.ndarray, drive_force: np.ndarray
    ) -> tuple[float, float]:
        """See `fsm.solve.stepping.model`."""
        if len(drive_force):
            observed = self.system.observe(t, q, u)
            energy = observed.energy
            drive_force += observed.drive.force
        else:
            energy = self.system.energy(t, q, u)
        of_pairs += energy.pair_power
        return energy.input_power, energy.dissipated_power

    def stored(self, t: float, q: np.ndarray, u: np.ndarray) -> tuple[float, float]:
        """See `fsm.solve.stepping.model`."""
        energy = self.system.energy(t, q, u)
        return energy.kinetic, energy.stored_except_driven
