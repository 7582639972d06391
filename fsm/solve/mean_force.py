"""A conserving method for elastic structures in a vector space: the force over a step is its mean along the step.

With x the increment of the configuration from t_n to t_{n+1} = t_n + h [1, 2]:

    M (u_{n+1} - u_n)/h = int_0^1 f(t_n + h/2, q_n + s x, x/h) ds,    x/h = (u_n + u_{n+1})/2

f.x is then the difference of the potential, whatever it is, and kinetic + potential energy + dissipated - work done stays
what it is, to the rule that the integral is taken by: two points of Gauss, exact for potentials up to the fourth degree,
as that of a film's stretch is. The method is of second order, has no damping of its own, and cannot gain energy: Newmark's
and generalized-alpha with little damping do, where a film stretches. Its dissipation is what dampers take at the mean rates.

Newton's unknown is x; its matrix 2/h^2 M + D/h + int s K(q_n + s x) ds, by the same rule: where films slacken and tauten, K
differs from point to point by orders of magnitude, and one in between converges to nothing. Corrections that overshoot are
cut where the work of what is left over along them vanishes, but not to less than a part: a single spot that tautens would
hold up all else.

References
----------
[1] Simo, Tarnow, Z. angew. Math. Phys. 43 (1992) 757-792. [2] Quispel, McLaren, J. Phys. A 41 (2008) 045206.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.blocks import BlockMatrix, BlockPattern
from fsm.errors import NotConverged
from fsm.solve.linear import LinearSolver
from fsm.solve.renewal import State
from fsm.solve.status import Outcome, StepFailed
from fsm.system import System

__all__ = ["MeanForce"]

_POINTS = (0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0))
"""Of Gauss, over the step; of equal weight."""
_NEWTON, _LOOSEST = 1e-3, 1e-6
"""Error left by Newton's method, over the scales: this part of rtol, but no more than at this rtol.

What is left over works along every step: with 1e-4, a struck strip gained 5 % of its energy in 2640 steps (2026-11-23).
"""
_ITERATIONS = 30
_SLOW = 0.7
"""Contraction from which on the tangent is renewed: two tangents and their factors cost ten times what two forces do."""
_SURE = 0.02
"""Contraction below which a measured one is not believed."""
_OVERSHOT = 0.5
"""Work left over along a correction, over that before it, from which on the correction is cut."""
_CUTS, _SHORTEST = 3, 0.3
"""Of a correction: how often at most, and to what part of it in one cut."""
_FINEST = 64
"""Parts, at most, of a step whose equations were not solved."""


class MeanForce:
    """The method as an object that goes step by step, its steps fixed but where their equations are not solved.

    Parameters
    ----------
    system : System
        Without moving supports; its increments are differences of q.
    t, q, u : time and state to start from
    rtol : -
    step : s
        Or the next smaller that divides the way to the next time that is to be hit.

    Attributes
    ----------
    t, q, u : present state
    work, dissipated : J
        Of the last step.
    steps, rejected, failed, iterations, force_evaluations, linearisations : int
    linear : LinearSolver
    """

    def __init__(self, system: System, t: float, q: np.ndarray, u: np.ndarray, rtol: float, step: float) -> None:
        self.system, self.t, self.q, self.u = system, t, q.copy(), u.copy()
        self.linear = LinearSolver()
        self.steps = self.rejected = self.failed = 0
        self.iterations = self.force_evaluations = self.linearisations = 0
        self.work = self.dissipated = 0.0
        self._step = step
        self._tolerance = _NEWTON * min(rtol, _LOOSEST)
        self._size = system.scales().increment
        self._mass = system.mass(q)
        self._breaks = sorted(system.break_times())
        self._pattern: BlockPattern | None = None
        self._inertia = np.zeros((0, 0, 0))
        self._factored = 0.0
        self._division = 1
        # mean rates of the last two steps, and their sizes: those at the ends hold what is left of stiff vibrations
        self._mean, self._mean_before = u.copy(), u.copy()
        self._last = self._last_before = 0.0

    def step(self, until: float) -> None:
        """One step, that ends at `until` or before.

        Raises
        ------
        StepFailed
            The equations of even the smallest step have no solution that Newton's method finds.
        """
        target = min([until, *(b for b in self._breaks if b > self.t)])
        while True:
            left = target - self.t
            count = math.ceil(left * self._division / self._step * (1.0 - 1e-9))
            h = left / max(count, 1)
            h = self._last if abs(h - self._last) <= 1e-9 * h else h
            x = self._solve(h)
            if x is not None:
                break
            self.failed += 1
            self._factored = 0.0
            self._division *= 2
            if self._division > _FINEST:
                raise StepFailed(Outcome.NO_SOLUTION, self.t, self.system.blame(self.u / self._size))
        self._division = max(1, self._division // 2)
        self._accept(h, x, target if count <= 1 else self.t + h)

    def state(self) -> State:
        """What another object goes on with from the present time, q and u."""
        counts = (
            self.steps, self.failed, self.iterations, self.force_evaluations, self.linearisations,
            self.linear.factorisations, self._division,
        )  # fmt: skip
        return {
            "mean": self._mean,
            "mean_before": self._mean_before,
            "sizes": np.array([self._last, self._last_before]),
            "counts": np.array(counts),
        }

    def go_on(self, state: State) -> None:
        """Go on with what `state` gave."""
        self._mean, self._mean_before = state["mean"], state["mean_before"]
        self._last, self._last_before = state["sizes"].tolist()
        counts = [int(count) for count in state["counts"]]
        self.steps, self.failed, self.iterations, self.force_evaluations, self.linearisations = counts[:5]
        self.linear.factorisations, self._division = counts[5:]

    # inside -----------------------------------------------------------------------------------------------------------

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
        for _ in range(_ITERATIONS):
            if renew:
                self._factorise(h, x)
            self.iterations += 1
            dx = self.linear.solve(residual)
            size = math.sqrt(float(np.mean((dx / self._size) ** 2)))
            if not math.isfinite(size):
                return None
            contraction = size / before if before else 0.5
            left = size * max(contraction, _SURE) / max(1.0 - contraction, 1e-3)
            if left <= self._tolerance or size <= 1e-3 * self._tolerance:
                return x + dx
            x, residual = self._moved(h, x, dx, residual)
            renew = before > 0.0 and contraction > _SLOW
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

    def _residual(self, h: float, x: np.ndarray) -> np.ndarray:
        """What the forces and inertia leave over, N."""
        self.force_evaluations += len(_POINTS)
        middle, rate = self.t + 0.5 * h, x / h
        force = sum(self.system.force(middle, self.q + s * x, rate) for s in _POINTS) / len(_POINTS)
        return np.asarray(force - self._mass @ ((2.0 / h) * (rate - self.u)))

    def _factorise(self, h: float, x: np.ndarray) -> None:
        self.linearisations += 1
        tangents = [self.system.linearise(self.t + 0.5 * h, self.q + part * x, x / h) for part in _POINTS]
        pattern = tangents[0].stiffness.pattern
        if pattern is not self._pattern:
            self._pattern, self._inertia = pattern, self.system.inertia(self.q, pattern)
        data = (2.0 / h**2) * self._inertia
        for part, linear in zip(_POINTS, tangents, strict=True):
            data += (part * linear.stiffness.data + linear.damping.data / h) / len(_POINTS)
        self.linear.factorise(BlockMatrix(pattern, data))
        self._factored = h

    def _accept(self, h: float, x: np.ndarray, end: float) -> None:
        rate = x / h
        energy = self.system.energy(self.t + 0.5 * h, self.q + 0.5 * x, rate)
        self.work, self.dissipated = h * energy.input_power, h * energy.dissipated_power
        self._mean_before, self._mean = self._mean, rate
        self._last_before, self._last = self._last, h
        self.t, self.q, self.u = end, self.q + x, 2.0 * rate - self.u
        self.steps += 1
        self.system.commit(self.t, self.q, self.u)
