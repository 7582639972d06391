"""A conserving method for elastic structures: the force over a step is its mean along the step.

With x the increment of the configuration from t_n to t_{n+1} = t_n + h [1, 2]:

    M (u_{n+1} - u_n)/h = int_0^1 f(t_n + s h, retract(q_n, s x), x/h) ds,    x/h = (u_n + u_{n+1})/2

f.x is then the difference of the potential, whatever it is, and kinetic + potential energy + dissipated - work done stays
what it is, to the rule that the integral is taken by: two points of Gauss, exact for potentials up to the fourth degree,
as that of a film's stretch is. Rigid bodies turn about their mean angular velocity, along which gyroscopic moments do no
work. The method is of second order, has no damping of its own, and cannot gain energy: Newmark's
and generalized-alpha with little damping do, where a film stretches. Its dissipation is what dampers take at the mean rates.

Newton's unknown is x; its matrix 2/h^2 M + D/h + int s K(q_n + s x) ds, by the same rule: where films slacken and tauten, K
differs from point to point by orders of magnitude, and one in between converges to nothing. Corrections that overshoot are
cut where the work of what is left over along them vanishes, but not to less than a part: a single spot that tautens would
hold up all else. With fixed steps, corrections between two tangents learn from those before (Broyden's good update [3]).
Steps that cost much, because parts of a film slacken and tauten in them, are halved: both halves may cost less.

Without a fixed step the error is controlled. The local error of x is h^3/12 times the derivative of u', from differences of
the mean rates; 2/h^2 S^-1 M, with the matrix S of Newton's method, takes modes out that are too fast for the step. A step is
also repeated if the rule of the integral loses more energy than a part of that turned over, as where a contact closes.

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
from fsm.solve.renewal import State
from fsm.solve.secants import Secants
from fsm.solve.status import Outcome, StepFailed
from fsm.system import Linearised, Objection, System

__all__ = ["MeanForce"]

_POINTS = (0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0))
"""Of Gauss, over the step; of equal weight."""
_NEWTON, _LOOSEST = 1e-3, 1e-6
"""Error left by Newton's method, over the scales: this part of rtol, but no more than at this rtol.

What is left over works along every step: with 1e-4, a struck strip gained 5 % of its energy in 2640 steps (2026-11-23).
"""
_EXACT = 1e-5
"""The same with error control, whose longer steps turn over more."""
_ITERATIONS = 30
_SLOW, _SLOW_AND_EXACT = 0.7, 0.35
"""Contraction from which on the tangent is renewed: two tangents and their factors cost ten times what two forces do. Steps
of error control are solved more exactly, and would take more iterations."""
_SURE = 0.02
"""Contraction below which a measured one is not believed."""
_OVERSHOT = 0.5
"""Work left over along a correction, over that before it, from which on the correction is cut."""
_CUTS, _SHORTEST = 3, 0.3
"""Of a correction: how often at most, and to what part of it in one cut."""
_FINEST = 64
"""Parts, at most, of a step whose equations were not solved."""
_FACTORS = 5.0
"""Cost of a tangent and its factors, in iterations."""
_DEAR, _CHEAP, _BETWEEN = 25.0, 9.0, 15.0
"""Mean cost of a fixed step, in iterations, from which on steps are halved, below which they are doubled, and after that.

A film with slack parts that tauten: 40 a step, 10 each of its halves, 6 each of its quarters (2026-11-23).
"""
_HALVES = 4
"""Parts, at most, of a step that costs much."""
_MEMORY = 0.7
"""Part of the mean cost that the next step leaves as it is."""
_FIRST = 1e-4
"""First step over the time to go, at most."""
_SAFETY, _GROWTH, _SHRINK, _STEADY = 0.9, 2.0, 0.2, 1.2
"""Of the control of errors; a step that could grow by less than the last is kept, and the factors with it."""
_CUT = 0.25
"""Factor on a step whose equations were not solved."""
_LOST, _AT_ONCE, _LEAST = 3e-6, 0.01, 1e-9
"""Energy that all steps may lose or gain by the rule of the integral, over that turned over so far; the part of what is left
of it that a step may take; and what any step may."""
_TRIFLE = 1e-13
"""Part of the energy stored at the start that is but round-off of it."""
_SMALLEST = 16.0 * np.finfo(float).eps
"""Smallest step over the time reached."""


class MeanForce:
    """The method as an object that goes step by step.

    Parameters
    ----------
    system : System
    t, q, u : time and state to start from
    rtol : -
    step : s
        Fixed, or the next smaller that divides the way to the next time that is to be hit, or a half or a quarter of it
        where steps cost much. None: the error is controlled.
    max_step : s
        Largest step of error control.

    Attributes
    ----------
    t, q, u : present state
    work, dissipated : J
        Of the last step.
    of_pairs : (2, n_pairs) array, J
        Dissipated by every contact pair in the last step.
    drive_force : (n_drives,) array, N
        Mean over the last step.
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
        # mean rates of the last two steps, and their sizes: those at the ends hold what is left of stiff vibrations
        self._mean, self._mean_before = u.copy(), u.copy()
        self._last = self._last_before = 0.0
        # of error control: the size to try, the acceleration half-way between the last two steps, errors, energies
        self._next = 0.0
        self._rate = np.zeros_like(u)
        self._known = 0
        self._error_before = 1.0
        self._stored = self._start = self._turnover = self._off = self._trifle = 0.0

    @property
    def factorisations(self) -> int:
        """Factorisations of matrices."""
        return self.linear.factorisations

    def step(self, until: float) -> None:
        """One step, that ends at `until` or before.

        Raises
        ------
        StepFailed
            The equations of even the smallest step have no solution that Newton's method finds, or its error is too large.
        """
        target = min([until, *(b for b in self._breaks if b > self.t)])
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
            x = self._solve(h)
            if x is not None:
                break
            self.failed += 1
            self._factored = 0.0
            self._division, self._cost = 2 * self._division, _BETWEEN
            if self._division > _FINEST:
                raise self._failure(Outcome.NO_SOLUTION)
        self._divide(self._spent() - spent)
        self._accept(h, x, target if count <= 1 else self.t + h, None)

    def _spent(self) -> float:
        return self.iterations + _FACTORS * self.linearisations

    def _divide(self, cost: float) -> None:
        """Halve or double the steps to come by what the last ones cost."""
        self._cost = _MEMORY * self._cost + (1.0 - _MEMORY) * cost
        if self._cost > _DEAR and self._division < _HALVES:
            self._division, self._cost = 2 * self._division, _BETWEEN
        elif self._cost < _CHEAP and self._division > 1:
            self._division, self._cost = self._division // 2, _BETWEEN

    # renewal --------------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """What another object goes on with from the present time, q and u."""
        counts = (
            self.steps, self.rejected, self.failed, self.iterations, self.force_evaluations, self.linearisations,
            self.linear.factorisations, self._division, self._known,
        )  # fmt: skip
        sizes = (
            self._last, self._last_before, self._next, self._error_before, self._stored, self._start, self._turnover,
            self._off, self._trifle, self._cost,
        )  # fmt: skip
        return {
            "mean": self._mean,
            "mean_before": self._mean_before,
            "rate": self._rate,
            "sizes": np.array(sizes),
            "counts": np.array(counts),
        }

    def go_on(self, state: State) -> None:
        """Go on with what `state` gave."""
        self._mean, self._mean_before = state["mean"], state["mean_before"]
        self._rate = state["rate"]
        (
            self._last, self._last_before, self._next, self._error_before, self._stored, self._start, self._turnover,
            self._off, self._trifle, self._cost,
        ) = state["sizes"].tolist()  # fmt: skip
        counts = [int(count) for count in state["counts"]]
        self.steps, self.rejected, self.failed, self.iterations = counts[:4]
        self.force_evaluations, self.linearisations, self.linear.factorisations, self._division, self._known = counts[4:]

    # error control --------------------------------------------------------------------------------------------------

    def _controlled_step(self, target: float, until: float) -> None:
        """One step of which the error is controlled."""
        shortest = self.system.shortest_step()
        if not self._next:
            energy = self.system.energy(self.t, self.q, self.u)
            self._start = self._stored = energy.stored_freely
            self._turnover = energy.kinetic
            self._trifle = _TRIFLE * sum(map(abs, energy.potential.values()))
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
            x, objection = self._solve(h), None
            if x is None:
                self.failed += 1
                self._factored = 0.0
                self._next = _CUT * h
            else:
                objection = self._objection(h, x, end)
                if objection is None:
                    energies = self._step_energies(h, x, end)
                    of_time = self._error(h, x) if h > shortest else 0.0
                    error = max(of_time, self._lost(energies) if h > shortest / _FINEST else 0.0)
                    if error <= 1.0:
                        break
                    self._next = h * max(_SHRINK, _SAFETY * error ** (-1.0 / 3.0))
                    if error == of_time:
                        self._next = max(self._next, min(h, shortest))
                else:
                    self._next = h * objection.part
                self.rejected += 1
            grow = False
            if self._next < _SMALLEST * max(abs(self.t), until - self.t):
                reason = objection.reason if objection is not None else ""
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

    def _objection(self, h: float, x: np.ndarray, end: float) -> Objection | None:
        return self.system.objection(end, self.system.retract(self.q, x), 2.0 * x / h - self.u, h)

    def _error(self, h: float, x: np.ndarray) -> float:
        """Local error of the increment over what is allowed; 0 until it is known.

        That of the rate does not count: without damping the fastest vibrations of stiff joints would set the steps.
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
        """Energy that the rule of the integral has lost or gained, over what is allowed."""
        moved = max(energies.kinetic, abs(energies.stored - self._start), self._turnover)
        most = max(_AT_ONCE * (_LOST * moved - abs(self._off)), _LEAST * moved, self._trifle)
        return abs(self._off_by(energies)) / most if most > 0.0 else 0.0

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
        return StepFailed(outcome, self.t, self.system.blame(self.u / self._size), reason)

    # Newton's method ------------------------------------------------------------------------------------------------

    def _solve(self, h: float) -> np.ndarray | None:
        """Increment of a step, None if Newton's method does not find it."""
        with np.errstate(all="ignore"):  # iterates may go anywhere before they are given up
            try:
                return self._newton(h)
            except NotConverged:  # a singular matrix
                return None

    def _newton(self, h: float) -> np.ndarray | None:
        change = (h + self._last) / (self._last + self._last_before) if self._last_before else 0.0
        x = h * (self._mean + change * (self._mean - self._mean_before))
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
            converged = left <= self._tolerance or size <= 1e-3 * self._tolerance
            parted = converged and not renew and self.system.parted()  # the factors hold contacts that have opened
            if converged and not parted:
                return x + dx
            start = x
            x, residual = self._moved(h, x, dx, residual)
            if secants is not None:
                secants.tell(x - start, dx)
            renew = parted or (before > 0.0 and contraction > self._slow)
            before = size
        return None

    def _moved(self, h: float, x: np.ndarray, dx: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The increment with a correction that does not overshoot, and what is left over there."""
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
        """Times and configurations of the points of a step."""
        return [(self.t + s * h, self.system.retract(self.q, s * x)) for s in _POINTS]

    def _residual(self, h: float, x: np.ndarray) -> np.ndarray:
        """What the forces and inertia leave over, N."""
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
        # increments at the points are s times those of x, but for the turn of the axes in between
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
        """Energies of a step: of its end, and what was done over it."""
        rate = x / h
        forces = np.zeros(0)
        if self._driven:
            observed = [self.system.observe(*point, rate) for point in self._along(h, x)]
            seen, forces = [one.energy for one in observed], np.mean([one.drive.force for one in observed], axis=0)
        else:
            seen = [self.system.energy(*point, rate) for point in self._along(h, x)]
        after = self.system.energy(end, self.system.retract(self.q, x), 2.0 * rate - self.u)
        part = h / len(_POINTS)
        pairs = part * np.sum([energy.pair_power for energy in seen], axis=0)
        return _StepEnergies(
            part * sum(energy.input_power for energy in seen), part * sum(energy.dissipated_power for energy in seen), pairs,
            after.stored_freely, after.kinetic, forces,
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
    """Energies of a step, J: work, dissipated, dissipated by pairs; stored at its end but for driven bodies, kinetic.

    `drive_force` (N) is the mean over the step. Rates at the ends hold what is left of stiff vibrations, and dampers would
    make forces of them.
    """

    work: float
    dissipated: float
    pairs: np.ndarray
    stored: float
    kinetic: float
    drive_force: np.ndarray


def _rms(vector: np.ndarray) -> float:
    return math.sqrt(float(vector @ vector) / len(vector)) if len(vector) else 0.0
