"""Energy-conserving mean-force method: the force of a step is its mean along the step.

With x the increment of the configuration from t_n to t_{n+1} = t_n + h [1, 2]:

    M (u_{n+1} - u_n)/h = int_0^1 f(t_n + s h, retract(q_n, s x), x/h) ds,    x/h = (u_n + u_{n+1})/2

f.x is then the difference of the potential. So kinetic + potential + dissipated energy - work is constant, except for the
error of the quadrature. Two Gauss points are exact for potentials up to the fourth degree, for example the potential of a
stretched film. Rigid bodies rotate about their mean angular velocity, so gyroscopic moments do no work. The method is of
second order, has no numerical damping, and cannot gain energy; Newmark's method, and generalized-alpha with little damping,
gain energy where a film stretches. Dampers dissipate energy at the mean rates.

Newton's method solves for x with the matrix 2/h^2 M + D/h + int s K(q_n + s x) ds, by the same quadrature. Where films
become slack or taut, K differs between the points by orders of magnitude, and K at one point between them does not converge.
Corrections that overshoot are cut where the work of the residual along them vanishes. The cut is limited, because otherwise
one region that becomes taut would stop the motion of all others. With fixed steps, Broyden's good update [3] corrects a
reused tangent. Steps with many iterations are halved, since both halves together may need fewer. Steps are also halved where
the quadrature does not conserve the energy.

The mean rates of undamped modes that are too fast for a fixed step change their sign in every step. The mean rate of two
steps before predicts them, as well as slow modes. Linear extrapolation would multiply them by three and have the wrong sign,
so that it would make taut films slack. With error control these modes are damped, and the prediction is linear.

Without a fixed step the error is controlled. The local error of x is h^3/12 times the derivative of u', from differences of
the mean rates. The filter 2/h^2 S^-1 M, with the matrix S of Newton's method, removes modes that are too fast for the step.
A step is also repeated if the quadrature loses too much energy, for example where a contact closes.

The module has more than 450 lines, because fixed steps and error control share the residual, the matrix and the energies.

References
----------
[1] Simo, Tarnow, Z. angew. Math. Phys. 43 (1992) 757-792. [2] Quispel, McLaren, J. Phys. A 41 (2008) 045206.
[3] Kelley, Iterative Methods for Linear and Nonlinear Equations, SIAM 1995, chapter 7.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fsm.blocks import BlockMatrix, BlockPattern
from fsm.errors import NotConverged
from fsm.kernels.block_sum import effective_stiffness
from fsm.solve.linear import LinearSolver
from fsm.solve.restart_points import State
from fsm.solve.secants import Secants
from fsm.solve.status import Outcome, StepFailed
from fsm.system import System
from fsm.system_records import Linearised, StepRejection

__all__ = ["MeanForce"]

_POINTS = (0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0))
"""Gauss points over the step, of equal weight."""
_NEWTON, _LOOSEST = 1e-3, 1e-6
"""Tolerance of Newton's method relative to the scales and rtol, and the largest rtol for it. The residual does work in every
step: with 1e-4, a strip after an impact gained 5 % of its energy in 2640 steps (2026-11-23)."""
_EXACT = 1e-5
"""The same with error control, whose longer steps do more work."""
_WORK = 1e-7
"""Bound of the work of the residual in a fixed step, relative to the reference energy."""
_ITERATIONS = 30
_SLOW, _SLOW_AND_EXACT = 0.7, 0.35
"""Ratio of successive corrections above which the tangent is evaluated again, for fixed steps and for error control. Two
tangents and their factorisation cost ten times as much as two forces. Error control has a tighter tolerance."""
_SURE = 0.02
"""Lower bound of the ratio of successive corrections."""
_OVERSHOT = 0.5
"""Ratio of the work of the residual at the end of a correction to the work at its start, above which it is cut."""
_CUTS, _SHORTEST = 3, 0.3
"""Largest number of cuts of a correction, and smallest factor of a cut."""
_FINEST = 64
"""Largest number of parts of a step for which Newton's method did not converge."""
_FACTORS = 5.0
"""Cost of a tangent and its factorisation, in iterations."""
_DEAR, _CHEAP, _BETWEEN = 25.0, 9.0, 15.0
"""Mean cost of a fixed step, in iterations: bound for halving, bound for doubling, and initial value after a change.

Film with slack parts that become taut: 40 for a step, 10 for each half, 6 for each quarter (2026-11-23).
"""
_HALVES = 4
"""Largest number of parts of an expensive step."""
_MEMORY = 0.7
"""Weight of the previous mean in the running mean of the cost."""
_FIRST = 1e-4
"""Largest first step relative to the remaining time."""
_SAFETY, _GROWTH, _SHRINK, _STEADY = 0.9, 2.0, 0.2, 1.2
"""Constants of error control; with a growth below the last one, step size and factorisation are reused."""
_CUT = 0.25
"""Factor on a step size for which Newton's method did not converge."""
_LOST, _AT_ONCE, _LEAST = 3e-6, 0.01, 1e-9
"""Bounds of the quadrature error of the energy, relative to the reference energy: of all steps; of one step, as a
part of the remaining error of all steps; and the smallest bound of a step."""
_LOST_AT_ONCE = 1e-4
"""Bound of the quadrature error of the energy in a fixed step, relative to the reference energy. Steps above it are halved,
down to a 16th, where the quadrature passes kinks of slack parts (2026-11-23)."""
_ROUND_OFF = 1e-13
"""Round-off of the energy relative to the stored energy at the start."""
_SMALLEST = 16.0 * np.finfo(float).eps
"""Smallest step relative to the present time."""


class MeanForce:
    """The mean-force method, step by step.

    Parameters
    ----------
    system : System
    t, q, u : time and state to start from
    rtol : -
    step : s
        Fixed step size, reduced to divide the time to the next end time, and to parts where steps need many iterations or do
        not conserve the energy. None: error control.
    max_step : s
        Largest step of error control.

    Attributes
    ----------
    t, q, u : present state
    work, dissipated : J
        Work and dissipated energy of the last step.
    of_pairs : (2, n_pairs) array, J
        Energy dissipated by every contact pair in the last step.
    drive_force : (n_drives,) array, N
        Mean force over the last step.
    steps, rejected, failed, iterations, force_evaluations, linearisations : int
    linear : LinearSolver
    """

    def __init__(
        self,
        system: System,
        t: float,
        q: np.ndarray,
        u: np.ndarray,
        rtol: float,
        step: float | None = None,
        max_step: float = math.inf,
    ) -> None:
        self.system, self.t, self.q, self.u = system, t, q.copy(), u.copy()
        self.linear = LinearSolver()
        self.steps = self.rejected = self.failed = 0
        self.iterations = self.force_evaluations = self.linearisations = 0
        self.work = self.dissipated = 0.0
        self.of_pairs, self.drive_force = np.zeros((2, 0)), np.zeros(0)
        self._driven = len(system.observe(t, q, u).drive.force) > 0
        self._step, self._max_step, self._rtol = step, max_step, rtol
        self._tolerance = (_NEWTON if step is not None else _EXACT) * min(rtol, _LOOSEST)
        self._size = system.scales().increment
        self._slow = _SLOW if step is not None else _SLOW_AND_EXACT
        self._mass = system.mass(q)
        self._breaks = sorted(system.break_times())
        self._pattern: BlockPattern | None = None
        self._inertia = np.zeros((0, 0, 0))
        self._factored = 0.0
        self._map: np.ndarray | None = None
        self._division, self._cost = 1, _BETWEEN
        # mean rates of the last two steps, and their sizes: rates at the ends contain stiff vibrations
        self._mean, self._mean_before = u.copy(), u.copy()
        self._last = self._last_before = 0.0
        # for error control: step size, acceleration half-way between the last two steps, errors, energies
        self._next = 0.0
        self._rate = np.zeros_like(u)
        self._known = 0
        self._error_before = 1.0
        self._stored = self._start = self._turnover = self._off = self._round_off = 0.0

    @property
    def factorisations(self) -> int:
        """Factorisations of matrices."""
        return self.linear.factorisations

    def step(self, until: float) -> None:
        """Take one step that ends at `until` or before.

        Raises
        ------
        StepFailed
            Newton's method does not converge, or the error is too large, even with the smallest step.
        """
        target = min([until, *(b for b in self._breaks if b > self.t)])
        if not self._last:
            energy = self.system.energy(self.t, self.q, self.u)
            self._start = self._stored = energy.stored_except_driven
            self._turnover = energy.kinetic
            self._round_off = _ROUND_OFF * sum(map(abs, energy.potential.values()))
        if self._step is None:
            self._controlled_step(target, until)
        else:
            self._fixed_step(target, self._step)

    def _fixed_step(self, target: float, step: float) -> None:
        spent = self._spent()
        while True:
            left = target - self.t
            count = math.ceil(left * self._division / step * (1.0 - 1e-9))
            h = left / max(count, 1)
            h = self._last if abs(h - self._last) <= 1e-9 * h else h
            end = target if count <= 1 else self.t + h
            x = self._solve(h)
            if x is not None:
                energies = self._step_energies(h, x, end)
                if self._division >= _FINEST // 4 or self._conserved(energies):
                    break
            self.failed += 1
            self._factored = 0.0
            self._division, self._cost = 2 * self._division, _BETWEEN
            if self._division > _FINEST:
                raise self._failure(Outcome.NO_SOLUTION)
        self._divide(self._spent() - spent)
        self._accept(h, x, end, energies)

    def _spent(self) -> float:
        return self.iterations + _FACTORS * self.linearisations

    def _divide(self, cost: float) -> None:
        """Halve or double the next steps by the cost of the last ones."""
        self._cost = _MEMORY * self._cost + (1.0 - _MEMORY) * cost
        if self._cost > _DEAR and self._division < _HALVES:
            self._division, self._cost = 2 * self._division, _BETWEEN
        elif self._cost < _CHEAP and self._division > 1:
            self._division, self._cost = self._division // 2, _BETWEEN

    # restart --------------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """State of the method for a restart, besides time, q and u."""
        counts = (
            self.steps, self.rejected, self.failed, self.iterations, self.force_evaluations, self.linearisations,
            self.linear.factorisations, self._division, self._known,
        )  # fmt: skip
        sizes = (
            self._last, self._last_before, self._next, self._error_before, self._stored, self._start, self._turnover,
            self._off, self._round_off, self._cost,
        )  # fmt: skip
        return {
            "mean": self._mean,
            "mean_before": self._mean_before,
            "rate": self._rate,
            "sizes": np.array(sizes),
            "counts": np.array(counts),
        }

    def resume(self, state: State) -> None:
        """Continue from a restart point (see `state`)."""
        self._mean, self._mean_before = state["mean"], state["mean_before"]
        self._rate = state["rate"]
        (
            self._last, self._last_before, self._next, self._error_before, self._stored, self._start, self._turnover,
            self._off, self._round_off, self._cost,
        ) = state["sizes"].tolist()  # fmt: skip
        counts = [int(count) for count in state["counts"]]
        self.steps, self.rejected, self.failed, self.iterations = counts[:4]
        self.force_evaluations, self.linearisations, self.linear.factorisations, self._division, self._known = counts[4:]

    # error control --------------------------------------------------------------------------------------------------

    def _controlled_step(self, target: float, until: float) -> None:
        """Take one step with error control."""
        shortest = self.system.shortest_step()
        if not self._next:
            self._next = self._first_size(until - self.t)
        longest = self.system.longest_step(self.t, self.q, self.u)
        grow = True
        while True:
            left, h = target - self.t, min(self._next, self._max_step, longest)
            count = math.ceil(left / h * (1.0 - 1e-9))
            h = left / count if count <= 2 else h
            h = self._last if abs(h - self._last) <= 1e-9 * h else h
            end = target if count <= 1 else self.t + h
            if not end > self.t:
                raise self._failure(Outcome.STEP_TOO_SMALL)
            x, rejection = self._solve(h), None
            if x is None:
                self.failed += 1
                self._factored = 0.0
                self._next = _CUT * h
            else:
                rejection = self._rejection(h, x, end)
                if rejection is None:
                    energies = self._step_energies(h, x, end)
                    of_time = self._error(h, x) if h > shortest else 0.0
                    error = max(of_time, self._lost(energies) if h > shortest / _FINEST else 0.0)
                    if error <= 1.0:
                        break
                    self._next = h * max(_SHRINK, _SAFETY * error ** (-1.0 / 3.0))
                    if error == of_time:
                        self._next = max(self._next, min(h, shortest))
                else:
                    self._next = h * rejection.part
                self.rejected += 1
            grow = False
            if self._next < _SMALLEST * max(abs(self.t), until - self.t):
                reason = rejection.reason if rejection is not None else ""
                outcome = Outcome.TOO_SOFT if reason else Outcome.STEP_TOO_SMALL
                raise self._failure(Outcome.NO_SOLUTION if x is None else outcome, reason)
        self._adapt(h, max(error, 1e-8), grow, shortest)
        self._accept(h, x, end, energies)

    def _first_size(self, left: float) -> float:
        pace = _rms(self.u / self._size)
        rate = self._first_rate()
        pace = max(pace, math.sqrt(_rms(rate / self._size)))
        return min(_FIRST * left, self._rtol ** (1.0 / 3.0) / pace if pace > 0.0 else math.inf, self._max_step)

    def _first_rate(self) -> np.ndarray:
        """u' right after the present time, (nu,)."""
        return self.system.acceleration(math.nextafter(self.t, math.inf), self.q, self.u)

    def _rejection(self, h: float, x: np.ndarray, end: float) -> StepRejection | None:
        return self.system.rejection(end, self.system.retract(self.q, x), 2.0 * x / h - self.u, h)

    def _error(self, h: float, x: np.ndarray) -> float:
        """Ratio of the local error of the increment to the tolerance; 0 until it is known.

        The error of the rate is not controlled; without damping, the fastest vibrations of stiff joints would determine the
        steps.
        """
        mean = x / h
        if self._known < 2:
            return 0.0 if self._known == 0 else _rms(h * (mean - self._mean) / (self._rtol ** (2.0 / 3.0) * self._size))
        filtered = (h / 6.0) * (self._mass @ self._jerk(h, mean))  # h^3/12 times 2/h^2
        return _rms(self.linear.solve(filtered) / (self._rtol * self._size))

    def _jerk(self, h: float, mean: np.ndarray) -> np.ndarray:
        rate = (mean - self._mean) / (0.5 * (h + self._last))
        return np.asarray((rate - self._rate) / (0.5 * (0.5 * h + self._last + 0.5 * self._last_before)))

    def _lost(self, energies: _StepEnergies) -> float:
        """Ratio of the energy error of the quadrature to its bound."""
        moved = max(energies.kinetic, abs(energies.stored - self._start), self._turnover)
        most = max(_AT_ONCE * (_LOST * moved - abs(self._off)), _LEAST * moved, self._round_off)
        return abs(self._off_by(energies)) / most if most > 0.0 else 0.0

    def _conserved(self, energies: _StepEnergies) -> bool:
        """Whether the quadrature of a fixed step conserves the energy."""
        moved = max(energies.kinetic, abs(energies.stored - self._start), self._turnover)
        return abs(self._off_by(energies)) <= max(_LOST_AT_ONCE * moved, self._round_off)

    def _off_by(self, energies: _StepEnergies) -> float:
        return energies.stored - self._stored + energies.dissipated - energies.work

    def _adapt(self, h: float, error: float, grow: bool, shortest: float) -> None:
        """Soderlind's PI controller (PI.4.2)."""
        factor = _SAFETY * error ** (-0.2) * self._error_before ** (1.0 / 15.0)
        self._error_before = error
        most = _GROWTH if grow else 1.0
        wanted = max(h * min(max(factor, _SHRINK), most), min(h * most, shortest))
        if grow and h < self._next and error * (self._next / h) ** 3 <= 1.0:
            wanted = max(wanted, self._next)
        if not self._next <= wanted <= _STEADY * self._next or not grow:
            self._next = min(wanted, self._max_step)

    def _failure(self, outcome: Outcome, reason: str = "") -> StepFailed:
        return StepFailed(outcome, self.t, self.system.worst_body(self.u / self._size), reason)

    # Newton's method ------------------------------------------------------------------------------------------------

    def _solve(self, h: float) -> np.ndarray | None:
        """Increment of a step; None if Newton's method does not converge."""
        with np.errstate(all="ignore"):  # iterates may overflow before the step is rejected
            try:
                return self._newton(h)
            except NotConverged:  # a singular matrix
                return None

    def _newton(self, h: float) -> np.ndarray | None:
        x = h * self._predicted_rate(h)
        renew, before = h != self._factored, 0.0
        residual = self._residual(h, x)
        secants = Secants(1.0 / self._size**2) if self._step is not None else None
        for _ in range(_ITERATIONS):
            if renew:
                self._factorise(h, x)
                if secants is not None:
                    secants.clear()
            self.iterations += 1
            dx = self.linear.solve(residual)
            if self._map is not None:
                dx = np.asarray(self._map @ dx.reshape(len(self._map), -1, 1)).ravel()
            if secants is not None:
                dx = secants.improved(dx)
            size = math.sqrt(float(np.mean((dx / self._size) ** 2)))
            if not math.isfinite(size):
                return None
            contraction = size / before if before else 0.5
            left = size * max(contraction, _SURE) / max(1.0 - contraction, 1e-3)
            least = size <= 1e-3 * self._tolerance
            converged = left <= self._tolerance or least
            # contacts of the factorisation that have opened make it too stiff
            opened = converged and not renew and self.system.contacts_opened()
            exact = secants is None or least
            if converged and not opened and (exact or self._residual_work(h, x, residual) <= 1.0):
                return x + dx
            start = x
            x, residual = self._moved(h, x, dx, residual)
            if converged and not opened and self._residual_work(h, x, residual) <= 1.0:
                return x
            if secants is not None:
                secants.add(x - start, dx)
            renew = opened or (before > 0.0 and contraction > self._slow)
            before = size
        return None

    def _predicted_rate(self, h: float) -> np.ndarray:
        """Mean rate of the next step, as a start for Newton's method; see the module docstring."""
        if self._step is not None:
            return self._mean_before
        change = (h + self._last) / (self._last + self._last_before) if self._last_before else 0.0
        return self._mean + change * (self._mean - self._mean_before)

    def _residual_work(self, h: float, x: np.ndarray, residual: np.ndarray) -> float:
        """Work of a residual in a step over its bound."""
        rate = x / h
        moved = max(self._turnover, 0.5 * float(rate @ (self._mass @ rate)))
        return abs(float(residual @ x)) / max(_WORK * moved, self._round_off, 1e-300)

    def _moved(self, h: float, x: np.ndarray, dx: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Increment after a correction that does not overshoot, and its residual."""
        part, start = 1.0, float(dx @ residual)
        after = self._residual(h, x + dx)
        for _ in range(_CUTS):
            end = float(dx @ after)
            if end >= -_OVERSHOT * abs(start):
                break
            part = max(part * start / (start - end), _SHORTEST)
            after = self._residual(h, x + part * dx)
        return x + part * dx, after

    def _along(self, h: float, x: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """Times and configurations at the quadrature points of a step."""
        return [(self.t + s * h, self.system.retract(self.q, s * x)) for s in _POINTS]

    def _residual(self, h: float, x: np.ndarray) -> np.ndarray:
        """Residual of forces and inertia, N."""
        self.force_evaluations += len(_POINTS)
        rate = x / h
        force = sum(self.system.force(*point, rate) for point in self._along(h, x)) / len(_POINTS)
        return np.asarray(force - self._mass @ ((2.0 / h) * (rate - self.u)))

    def _factorise(self, h: float, x: np.ndarray) -> None:
        tangents = self._tangents(h, x)
        pattern = tangents[0].stiffness.pattern
        if pattern is not self._pattern:
            self._pattern, self._inertia = pattern, self.system.inertia(self.q, pattern)
        stiffness = sum(s * linear.stiffness.data for s, linear in zip(_POINTS, tangents, strict=True)) / len(_POINTS)
        damping = sum(linear.damping.data for linear in tangents) / (h * len(_POINTS))
        # increments at the points are s times the increments of x, except for the rotation of the axes
        self._map = self.system.increment_map(0.5 * x)
        moving = damping + (2.0 / h**2) * self._inertia
        self.linear.factorise(
            BlockMatrix(pattern, effective_stiffness(np.asarray(stiffness), moving, 1.0, self._map, pattern.indices))
        )
        self._factored = h

    def _tangents(self, h: float, x: np.ndarray) -> list[Linearised]:
        """Tangents at the points of a step, on one pattern: contacts found at one of them may add to it."""
        while True:
            self.linearisations += 1
            tangents = [self.system.linearise(*point, x / h) for point in self._along(h, x)]
            if all(linear.stiffness.pattern is tangents[0].stiffness.pattern for linear in tangents):
                return tangents

    def _step_energies(self, h: float, x: np.ndarray, end: float) -> _StepEnergies:
        """Energies of a step: at its end, and work and dissipation over it."""
        rate = x / h
        forces = np.zeros(0)
        if self._driven:
            observed = [self.system.observe(*point, rate) for point in self._along(h, x)]
            energies, forces = [one.energy for one in observed], np.mean([one.drive.force for one in observed], axis=0)
        else:
            energies = [self.system.energy(*point, rate) for point in self._along(h, x)]
        after = self.system.energy(end, self.system.retract(self.q, x), 2.0 * rate - self.u)
        part = h / len(_POINTS)
        pairs = part * np.sum([energy.pair_power for energy in energies], axis=0)
        return _StepEnergies(
            part * sum(energy.input_power for energy in energies),
            part * sum(energy.dissipated_power for energy in energies), pairs,
            after.stored_except_driven, after.kinetic, forces,
        )  # fmt: skip

    def _accept(self, h: float, x: np.ndarray, end: float, energies: _StepEnergies | None) -> None:
        rate = x / h
        if energies is None:
            energies = self._step_energies(h, x, end)
        self.drive_force = energies.drive_force
        self.work, self.dissipated, self.of_pairs = energies.work, energies.dissipated, energies.pairs
        self._turnover = max(self._turnover, energies.kinetic, abs(energies.stored - self._start))
        self._off += self._off_by(energies)
        self._stored = energies.stored
        if self._known:
            self._rate = (rate - self._mean) / (0.5 * (h + self._last))
        self._known = min(self._known + 1, 2)
        self._mean_before, self._mean = self._mean, rate
        self._last_before, self._last = self._last, h
        self.t, self.q, self.u = end, self.system.retract(self.q, x), 2.0 * rate - self.u
        self.steps += 1
        self.system.commit(self.t, self.q, self.u)


class _StepEnergies(NamedTuple):
    """Energies of a step, J: work, dissipated, dissipated by pairs; at its end stored (without driven bodies) and kinetic.

    `drive_force` (N) is the mean over the step. Rates at the ends contain stiff vibrations, which would cause damper forces.
    """

    work: float
    dissipated: float
    pairs: np.ndarray
    stored: float
    kinetic: float
    drive_force: np.ndarray


def _rms(vector: np.ndarray) -> float:
    return math.sqrt(float(vector @ vector) / len(vector)) if len(vector) else 0.0
