"""The generalized-alpha method, step by step; see `fsm.stepping.generalized_alpha` for the equations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property
from typing import cast

import numpy as np

from fsm.blocks import BlockMatrix, BlockPattern
from fsm.errors import NotConverged
from fsm.kernels.block_sum import effective_stiffness
from fsm.solve.dissipation import mean_dissipation
from fsm.solve.linear import LinearSolver
from fsm.solve.restart_points import State
from fsm.solve.status import Outcome, StepFailed
from fsm.stepping import generalized_alpha as stepping
from fsm.stepping.generalized_alpha import Motion, Rules, take_step
from fsm.stepping.march import march, march_arrays
from fsm.stepping.model import CREASES, DRIVES, KINETIC, PANELS, STEADY, ArrayModel
from fsm.system import ArraySystem, System
from fsm.system_records import Linearised, PreviousState

__all__ = ["RHO_INF", "Coefficients", "GeneralizedAlpha"]

RHO_INF = 0.6
"""Default spectral radius at infinite frequency."""

_NEWTON, _LOOSEST = 1e-2, 1e-3
"""Tolerance of Newton's method relative to the tolerance of a step, and the largest relative tolerance for it."""
_GROWTH = 2.0
_FLOOR_AT = 1e-6
"""Relative tolerance below which the system's shortest step decreases, with its cube root."""


@dataclass(frozen=True)
class Coefficients:
    """Constants of the method for a spectral radius at infinity (Chung and Hulbert 1993, eqs. 25 to 27), and local errors.

    Attributes
    ----------
    alpha_m, alpha_f, beta, gamma : -
    shift : -
        a_n belongs to t_n + shift h.
    error_x, error_u : -
        Local errors error_x h^3 u'' of x and error_u h^3 u''' of u.
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    shift: float
    error_x: float
    error_u: float

    @classmethod
    def of(cls, rho_inf: float) -> Coefficients:
        """Constants for a spectral radius at infinite frequency, from 0 (most damping) to 1 (no numerical damping)."""
        alpha_m, alpha_f = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0), rho_inf / (rho_inf + 1.0)
        return cls._with(alpha_m, alpha_f, 1.0 / (1.0 + rho_inf) ** 2, 0.5 * (3.0 - rho_inf) / (1.0 + rho_inf))

    @classmethod
    def newmark(cls) -> Coefficients:
        """Newmark's method of constant mean acceleration, beta = 1/4, gamma = 1/2, without numerical damping."""
        return cls._with(0.0, 0.0, 0.25, 0.5)

    @classmethod
    def _with(cls, alpha_m: float, alpha_f: float, beta: float, gamma: float) -> Coefficients:
        shift = alpha_m - alpha_f
        # a_n = u'(t_n + shift h) + lag h^2 u''' + ..., by Taylor's series in (1)
        lag = 0.5 * ((1.0 - alpha_f) - (1.0 - alpha_m) * (1.0 + shift) ** 2 - alpha_m * shift**2)
        error_u = 0.5 * ((1.0 - gamma) * shift**2 + gamma * (1.0 + shift) ** 2) + lag - 1.0 / 6.0
        return cls(alpha_m, alpha_f, beta, gamma, shift, 0.5 * shift + beta - 1.0 / 6.0, error_u)


@cache
def _has_arrays(kind: type) -> bool:
    """Whether systems of this class are `ArraySystem`; cached, since the check is slow."""
    return issubclass(kind, ArraySystem)


class SystemModel:
    """Model of a system for time steps (`fsm.stepping.model`), with its tangent, factorisation and last rejection."""

    def __init__(self, system: System, q: np.ndarray) -> None:
        self.system = system
        self.linear = LinearSolver()
        self.reason = ""
        self.force, self.retract, self.contacts_opened = system.force, system.retract, system.contacts_opened
        self.longest_step = system.longest_step
        self._mass = system.mass(q)
        self._pattern: BlockPattern | None = None
        self._inertia = np.zeros((0, 0, 0))
        self._linear: Linearised | None = None
        self._map: np.ndarray | None = None
        self._last: PreviousState = 0.0, q
        self.pair_energy = np.zeros((2, 1))

    def renewed_force(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """See `fsm.stepping.model`."""
        self._linear = linear = self.system.linearise(t, q, u)
        if linear.stiffness.pattern is not self._pattern:
            self._pattern = linear.stiffness.pattern
            self._inertia = self.system.inertia(q, self._pattern)
        return linear.force

    def factorise(self, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
        """See `fsm.stepping.model`."""
        linear, pattern = self._linear, self._pattern
        assert linear is not None and pattern is not None
        moving = by_rate * linear.damping.data + by_acceleration * self._inertia
        self._map = self.system.increment_map(x) if maps else None
        return self._factorised(effective_stiffness(linear.stiffness.data, moving, 1.0, self._map, pattern.indices))

    def factorise_mass(self) -> bool:
        """See `fsm.stepping.model`."""
        return self._factorised(self._inertia)

    def _factorised(self, data: np.ndarray) -> bool:
        assert self._pattern is not None
        try:
            self.linear.factorise(BlockMatrix(self._pattern, data))
        except NotConverged:
            return False
        return True

    def solve(self, right: np.ndarray) -> np.ndarray:
        """See `fsm.stepping.model`; NaN if the matrix is singular."""
        try:
            return self.linear.solve(right)
        except NotConverged:
            return np.full(len(right), math.nan)

    def mapped(self, change: np.ndarray) -> np.ndarray:
        """See `fsm.stepping.model`."""
        if self._map is None:
            return change
        return np.asarray(self._map @ change.reshape(len(self._map), -1, 1)).ravel()

    def mass_times(self, vector: np.ndarray) -> np.ndarray:
        """See `fsm.stepping.model`."""
        return np.asarray(self._mass @ vector)

    def stiffness_times(self, vector: np.ndarray) -> np.ndarray:
        """See `fsm.stepping.model`."""
        assert self._linear is not None
        return self._linear.stiffness.times(vector)

    def damping_times(self, vector: np.ndarray) -> np.ndarray:
        """See `fsm.stepping.model`."""
        assert self._linear is not None
        return self._linear.damping.times(vector)

    def unable(self) -> bool:
        """See `fsm.stepping.model`; false, since SciPy solves the equations if the block solver fails."""
        return False

    def energies(
        self, t: float, q: np.ndarray, u: np.ndarray, step: float, record: np.ndarray
    ) -> tuple[float, float, float, float, float]:
        """See `fsm.stepping.model`."""
        observed, dissipated = self.system.observe(t, q, u), 0.0
        energy = observed.energy
        if step > 0.0:
            dissipated, of_pairs = mean_dissipation(self.system, self._last, (t, q), energy.pair_power.shape[1])
            self.pair_energy = self.pair_energy + step * of_pairs
        self._last = t, q.copy()
        record[KINETIC], record[STEADY] = energy.kinetic, 0.0  # unknown
        record[PANELS], record[CREASES] = energy.potential.get("panels", 0.0), energy.potential.get("creases", 0.0)
        count = len(observed.drive.travel)
        record[DRIVES : DRIVES + count] = observed.drive.travel
        record[DRIVES + count : DRIVES + 2 * count] = observed.drive.force
        record[DRIVES + 2 * count : DRIVES + 2 * count + len(observed.pairs.force)] = observed.pairs.force
        return energy.kinetic, energy.stored_at_rest, dissipated, energy.input_power, energy.driven

    def part_of_step(self, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
        """See `fsm.stepping.model`."""
        rejection = self.system.rejection(t, q, u, step)
        self.reason = "" if rejection is None else rejection.reason
        return 1.0 if rejection is None else rejection.part

    def accept(self, t: float, q: np.ndarray, u: np.ndarray) -> float:
        """See `fsm.stepping.model`."""
        self.system.commit(t, q, u)
        return self.system.longest_step(t, q, u)


class GeneralizedAlpha:
    """The generalized-alpha method, step by step.

    Parameters
    ----------
    system : System
    t, q, u : time and state to start from
    rtol : -
        Bound of the local error of a step, root mean square over all components, relative to the system's scales; of
        velocities relative to scales and size.
    rho_inf : -
        Spectral radius at infinite frequency; None: Newmark's method.
    fixed_step : s
        Fixed step size, reduced to divide the time to the next end time, and down to a 64th if Newton's method does not
        converge. None: error control.
    max_step : s

    Attributes
    ----------
    t, q, u : present state
    rate, a : (nu,) arrays
        u' and the algorithmic acceleration.
    step_size : s
        Size of the next step, unless a given end time comes first.
    steps, rejected, failed : int
        Steps taken; steps repeated because of the error, and because Newton's method did not converge.
    iterations, force_evaluations, linearisations, factorisations : int
    pair_energy : (2, n_pairs) array, J
        Energy that friction and damping of contact pairs dissipated in the last `march`.
    """

    def __init__(
        self,
        system: System,
        t: float,
        q: np.ndarray,
        u: np.ndarray,
        rtol: float,
        rho_inf: float | None = RHO_INF,
        fixed_step: float | None = None,
        max_step: float = math.inf,
    ) -> None:
        self.system, self.fixed_step = system, fixed_step
        self.coefficients = c = Coefficients.newmark() if rho_inf is None else Coefficients.of(rho_inf)
        # h u of modes too stiff for the step decreases by rho_inf in a step: with faster growth of h their u would increase
        fastest = 1.0 / max(1.0 if rho_inf is None else rho_inf, 1.0 / _GROWTH)
        growth = max(stepping.GROWTH_OF_STEADY_STEPS, min(_GROWTH, fastest))
        newton = _NEWTON * min(1.0, _LOOSEST / rtol)
        scales = system.scales()
        tolerance = rtol * scales.increment
        self.rules = Rules(
            c.alpha_m, c.alpha_f, c.beta, c.gamma, c.shift, c.error_x, c.error_u, rtol, newton, growth, fixed_step or 0.0,
            min(1.0, rtol / _FLOOR_AT) ** (1.0 / 3.0) * system.shortest_step(), tolerance,
            # the tolerance of Newton's method is tighter where forces need it; that of steps is not
            np.minimum(tolerance, scales.resolution / newton), scales.velocity, scales.increment, scales.span,
            np.array(sorted(system.break_times()), dtype=float),
        )  # fmt: skip
        still, sizes, counts = np.zeros(len(u)), np.zeros(9), np.zeros(11, dtype=np.int64)
        q, u = np.array(q, dtype=float), np.array(u, dtype=float)
        self.motion = Motion(q, u, still, still.copy(), still.copy(), sizes, counts)
        sizes[stepping.TIME], sizes[stepping.MAX_STEP], sizes[stepping.LONGEST] = t, max_step, math.inf
        sizes[stepping.CONTRACTION] = sizes[stepping.LAST_ERROR] = 1.0
        counts[stepping.DIVISION] = 1
        self.model = SystemModel(system, q)
        self.pair_energy = np.zeros((2, 0))

    def step(self, until: float) -> None:
        """Take one step that ends at `until` or before.

        Raises
        ------
        StepFailed
            Newton's method does not converge, or the error is too large, even with the smallest step.
        """
        # callers may store the arrays of the previous state
        motion = self.motion = self.motion._replace(q=self.motion.q.copy(), u=self.motion.u.copy())
        with np.errstate(all="ignore"):  # iterates may overflow before the step is rejected
            outcome = take_step(self.model, motion, self.rules, until)
        if outcome != stepping.STEPPED:
            raise self._failure(outcome)

    def march(self, balance: np.ndarray, until: float, most: int, every: bool = False) -> np.ndarray:
        """Take at most `most` steps up to `until` in one kernel; see `fsm.stepping.march`.

        Returns records (m, k) of all steps if `every`, else of the last one.

        Raises
        ------
        StepFailed
            As `step`.
        """
        if self._arrays is None:
            raise ValueError("this system has no arrays")
        motion = self.motion = self.motion._replace(q=self.motion.q.copy(), u=self.motion.u.copy())
        records, begun, system = self.records(most if every else 1), self.steps, self.system
        system.to_arrays(self.fixed_step is None)
        outcome = self._march(balance, until, most, records)
        while outcome == stepping.UNABLE and system.lacks_arrays():
            self._arrays = cast(ArraySystem, system).arrays(self.model.linear.ready)
            motion.counts[stepping.TANGENT], left = 0, most - (self.steps - begun)
            own = records[self.steps - begun :] if every else records
            outcome = self._march(balance, until, left, own)
        self.pair_energy = system.from_arrays()
        if outcome in (stepping.UNABLE, stepping.OBJECTED):
            # one step in Python, where SciPy solves the linear equations, and the reason of a rejection is known
            self._arrays.arrays.flags[-1] = motion.counts[stepping.TANGENT] = 0
            own, self.model.pair_energy = records[self.steps - begun :] if every else records, self.pair_energy
            outcome = march(self.model, motion, self.rules, balance, until, 1, own)
            self.pair_energy = self.model.pair_energy
            motion.counts[stepping.TANGENT] = 0
        if outcome != stepping.STEPPED:
            raise self._failure(outcome)
        return records[: self.steps - begun]

    def records(self, count: int) -> np.ndarray:
        """Zero records of so many steps."""
        return np.zeros((count, self.recorded + len(self.q) + len(self.u)))

    def _march(self, balance: np.ndarray, until: float, most: int, records: np.ndarray) -> int:
        assert self._arrays is not None
        arguments = self._arrays, self.motion, self.rules, balance, float(until), int(most), records
        outcome: int = self._arrays.calls.force.entry(march_arrays, *arguments)(*arguments)
        return outcome

    @cached_property
    def recorded(self) -> int:
        """Numbers of a record before the state."""
        observed = self.system.observe(self.t, self.q, self.u)
        return DRIVES + 2 * len(observed.drive.travel) + len(observed.pairs.force)

    @cached_property
    def _arrays(self) -> ArrayModel | None:
        """Arrays of the system; made at the first use, because their kernels may have to be compiled."""
        if not _has_arrays(type(self.system)):
            return None
        model: ArrayModel | None = cast(ArraySystem, self.system).arrays(self.model.linear.ready)
        return model

    @property
    def marches(self) -> bool:
        """Whether the system has arrays."""
        return self._arrays is not None

    # state ----------------------------------------------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Present time, s."""
        return float(self.motion.sizes[stepping.TIME])

    @property
    def q(self) -> np.ndarray:
        """Present configuration, (nq,)."""
        return self.motion.q

    @property
    def u(self) -> np.ndarray:
        """Present velocity, (nu,)."""
        return self.motion.u

    @property
    def rate(self) -> np.ndarray:
        """u', (nu,)."""
        return self.motion.rate

    @property
    def a(self) -> np.ndarray:
        """Algorithmic acceleration, (nu,)."""
        return self.motion.a

    @property
    def step_size(self) -> float:
        """Size of the next step, s, unless a given end time comes first."""
        return float(self.motion.sizes[stepping.STEP_SIZE])

    @step_size.setter
    def step_size(self, size: float) -> None:
        self.motion.sizes[stepping.STEP_SIZE] = size

    @property
    def max_step(self) -> float:
        """Largest step, s."""
        return float(self.motion.sizes[stepping.MAX_STEP])

    @max_step.setter
    def max_step(self, size: float) -> None:
        self.motion.sizes[stepping.MAX_STEP] = size

    @property
    def factorisations(self) -> int:
        """Factorisations of matrices."""
        return int(self.motion.counts[stepping.FACTORISATIONS])

    @property
    def steps(self) -> int:
        """Steps done."""
        return int(self.motion.counts[stepping.STEPS])

    @property
    def rejected(self) -> int:
        """Steps repeated because of their error."""
        return int(self.motion.counts[stepping.REJECTED])

    @property
    def failed(self) -> int:
        """Steps repeated because their equations were not solved."""
        return int(self.motion.counts[stepping.FAILED])

    @property
    def iterations(self) -> int:
        """Iterations of Newton's method."""
        return int(self.motion.counts[stepping.ITERATIONS])

    @property
    def force_evaluations(self) -> int:
        """Evaluations of the force without tangents."""
        return int(self.motion.counts[stepping.FORCES])

    @property
    def linearisations(self) -> int:
        """Evaluations of the force with tangents."""
        return int(self.motion.counts[stepping.LINEARISATIONS])

    # restart ------------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """State of the method for a restart, besides time, q and u."""
        motion = self.motion
        return {
            "rate": motion.rate.copy(),
            "a": motion.a.copy(),
            "slope": motion.slope.copy(),
            "sizes": motion.sizes.copy(),
            "counts": motion.counts.copy(),
        }

    def resume(self, state: State) -> None:
        """Continue from a restart point (see `state`), with a tangent at the present state."""
        motion, t = self.motion, self.t
        motion.rate[:], motion.a[:], motion.slope[:] = state["rate"], state["a"], state["slope"]
        motion.sizes[:], motion.counts[:] = state["sizes"], state["counts"]
        motion.sizes[stepping.TIME], motion.sizes[stepping.CONTRACTION] = t, 1.0
        motion.counts[stepping.SLOW] = motion.counts[stepping.TANGENT] = 0

    def _failure(self, outcome: int) -> StepFailed:
        reason = self.model.reason if outcome == stepping.OBJECTED else ""
        ending = Outcome.NO_SOLUTION if outcome == stepping.NO_SOLUTION else Outcome.STEP_TOO_SMALL
        worst = self.system.worst_body(self.rate / self.rules.velocity)
        return StepFailed(Outcome.TOO_SOFT if reason else ending, self.t, worst, reason)
