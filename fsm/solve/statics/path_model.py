"""A system as the model of a quasi-static path in Python; see `fsm.solve.stepping.path`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from fsm.errors import NotConverged
from fsm.solve.equations.equilibrium_step import Ending, Equilibrium, EquilibriumStep
from fsm.solve.equations.newton import negative_pivots_sticking, tangent_prediction
from fsm.solve.interface.records import Observation, PreviousState
from fsm.solve.interface.system import System
from fsm.solve.stepping import path_state as stepping
from fsm.solve.stepping.path import RESTS
from fsm.solve.stepping.path_state import Path, PathRules
from fsm.solve.stepping.vectors import copy_into

if TYPE_CHECKING:
    from fsm.solve.statics.path_recorder import PathRecorder

SHORT = 0.1
"""Ratio of a step without history for a prediction to the first step."""


def write_record(observed: Observation, record: np.ndarray) -> None:
    """Write the record of a state."""
    energy, drive, stored = observed.energy, observed.drive, observed.energy.potential
    first = stepping.DRIVES + 2 * len(drive.travel)
    loads = energy.input_power if energy.load_power is None else energy.load_power
    record[:] = 0.0
    numbers = {
        stepping.LOST: energy.dissipated_power, stepping.LOADS: loads, stepping.KEPT_LOSS: energy.sliding_power,
        stepping.CONTACT: stored.get("contact", 0.0), stepping.GRAVITY: stored.get("gravity", 0.0),
        stepping.PANELS: stored.get("panels", 0.0), stepping.CREASES: stored.get("creases", 0.0),
        stepping.KINETIC: energy.kinetic, stepping.INPUT: energy.input_power, stepping.DRIVEN: energy.driven,
        stepping.STORED: energy.stored_at_rest, stepping.LARGEST: observed.reaction,
    }  # fmt: skip
    for index, value in numbers.items():
        record[index] = value
    record[stepping.DRIVES : first] = np.concatenate([drive.travel, drive.force])
    sums = record[first:].reshape(7, -1)
    sums[stepping.PAIR_FORCE] = observed.pairs.force
    if energy.pair_power.shape[1] == sums.shape[1]:
        sums[stepping.PAIR_SLIDING], sums[stepping.PAIR_DAMPING] = energy.pair_power


class SystemPath:
    """Functions of `fsm.solve.stepping.path` for any system.

    Parameters
    ----------
    system, newton, recorder : System, EquilibriumStep and PathRecorder of the path

    Attributes
    ----------
    observed : Observation
        Of the last state that a step found.
    failed : (nu,) array
        Residual of the last step without an equilibrium; zeros if there is none.
    rejection : str
        Reason why the system rejected the last step.
    joint : str
        Joint with the largest opening in the last state that a step found.
    """

    def __init__(self, system: System, newton: EquilibriumStep, recorder: PathRecorder) -> None:
        self.system, self.newton, self.recorder = system, newton, recorder
        self.observed: Observation
        self.failed, self.rejection = np.zeros(system.nu), ""
        self.joint = "none"
        self._found: Equilibrium | None = None
        self.progress, self.difference, self.retract = system.progress, system.difference, system.retract
        self.contact_force = system.contact_force

    @property
    def _before(self) -> PreviousState:
        return self.recorder.time, self.recorder.q

    @contextmanager
    def _multipliers_of(self, t: float) -> Iterator[None]:
        """Use the multipliers of locked directions of the last accepted state, if its time is t, or of the state found."""
        before = t == self.recorder.time
        if before:
            self.system.swap_multipliers()
        try:
            yield
        finally:
            if before:
                self.system.swap_multipliers()

    def balance_at_rest(self, t: float, q: np.ndarray, force: np.ndarray, drives: np.ndarray) -> None:
        """See `fsm.solve.stepping.path`."""
        with self._multipliers_of(t):
            force[:], drives[:] = self.system.balance(t, q, None)

    def power_before(self, t: float, q: np.ndarray, end: float, found: np.ndarray) -> float:
        """See `fsm.solve.stepping.path`."""
        u = self.system.difference(q, found) / (end - t)
        with self._multipliers_of(t):
            energy = self.system.energy(t, q, u, (end, found))
        return energy.input_power if energy.load_power is None else energy.load_power

    def tangent_guess(self, path: Path, t: float) -> int:
        """See `fsm.solve.stepping.path`."""
        (before, q), newton = self._before, self.newton
        self.system.lock(0.0)
        try:
            path.increment[:] = tangent_prediction(self.system, before, t, q, newton.solver)
        except NotConverged:
            return stepping.SINGULAR
        path.next_efforts[:] = newton.efforts(t, q, self._before, path.increment)
        return stepping.ACCEPTED

    def equilibrium(self, path: Path, rules: PathRules, t: float, guess: np.ndarray) -> int:
        """See `fsm.solve.stepping.path`."""
        newton, numbers, counts = self.newton, path.numbers, path.counts
        newton.largest_reaction = float(numbers[stepping.REACTION])
        found = self._found = newton.solve(t, guess, self._before, path.next_efforts.copy())
        counts[stepping.LAST_ITERATIONS], numbers[stepping.FORCE_ROUND_OFF] = found.iterations, newton.round_off
        if found.ending is Ending.CONVERGED:
            copy_into(found.q, path.found)
            if found.efforts is not None:
                path.found_efforts[:] = found.efforts
            return stepping.ACCEPTED
        self.failed = found.residual
        if found.ending is Ending.UNSTABLE:
            return stepping.UNSTABLE
        return stepping.SINGULAR if found.ending is Ending.SINGULAR else stepping.NEWTON

    def look(self, path: Path, rules: PathRules, t: float, record: np.ndarray) -> int:
        """See `fsm.solve.stepping.path`."""
        found, duration = self._found, t - self.recorder.time
        assert found is not None
        rejection = self.system.rejection(t, found.q, None, duration)
        if rejection is not None:
            self.rejection = rejection.reason
            return stepping.CROSSED
        self.observed = observed = self.system.observe(t, found.q, found.u, self._before)
        write_record(observed, record)
        part = self.system.part_before_event(t, found.q, found.u, duration)
        record[stepping.PART] = part if part <= 1.0 else 0.0
        record[stepping.OPENING], self.joint = self.system.max_joint_opening(t, found.q)
        if observed.energy.load_power is None:
            travel = observed.drive.travel - self.recorder.last.drive.travel
            record[stepping.LOADS] -= float(observed.drive.force @ travel) / duration
        return stepping.ACCEPTED

    def stability(self, path: Path, rules: PathRules, t: float) -> int:
        """See `fsm.solve.stepping.path`."""
        assert self._found is not None
        return self.judged_at_rest(path, rules, t, self._found.q)

    def judged_at_rest(self, path: Path, rules: PathRules, t: float, q: np.ndarray) -> int:
        """Stability at rest of an equilibrium with dampers: ACCEPTED, SLOWED or UNSTABLE; writes the number of negative
        pivots to its record.

        Coulomb friction would hold contacts that stick. Regularised friction lets them creep, which is slow on the path.
        """
        system, solver = self.system, self.newton.solver
        if not system.rate_dependent:
            return stepping.ACCEPTED
        negative, held = negative_pivots_sticking(system, t, q, solver, rules.sticking)
        path.next_record[stepping.NEGATIVE_AT_REST] = negative
        if not negative or held:
            return stepping.ACCEPTED
        return stepping.UNSTABLE if self.rests(t, q) else stepping.SLOWED

    def rests(self, t: float, q: np.ndarray) -> bool:
        """Whether a state is an equilibrium without damper forces; these forces may hold an unstable state for a long
        time.

        If the state is no equilibrium, dampers slow a snap, and the stiffness may be indefinite. This is recorded as an
        event ("damped snap"); its forces do not belong to a quasi-static path.
        """
        left_over = np.abs(self.system.force(t, q, None) / self.newton.scales.force_scale)
        return bool(left_over.max() < RESTS * self.recorder.largest_reaction)

    def accept(self, path: Path, t: float) -> None:
        """See `fsm.solve.stepping.path`."""
        assert self._found is not None
        self.system.commit(t, self._found.q, self._found.u, self._before)

    @property
    def state(self) -> np.ndarray:
        """Configuration that the last step found."""
        assert self._found is not None
        return self._found.q
