"""Radau, BDF and LSODA of SciPy over the System protocol: y = (q, u), with the exact Jacobian.

The mass matrix M is constant. If it couples velocities, as in ANCF, M^-1 K is full. Radau and BDF then solve
with the sparse M, K and D. LSODA accepts no mass matrix, so it uses the full Jacobian.

These well-known methods are references for the faster methods of this package.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse
from scipy.integrate import BDF, LSODA, OdeSolver, Radau
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from fsm.errors import NotConverged
from fsm.kernels.vector import mean_ratio
from fsm.solve.interface.system import System
from fsm.solve.outcome.restart_points import State
from fsm.solve.time.radau_structured import SecondOrderJacobian, StructuredRadau, second_order_jacobian

_FIRST_STEP = 1e-6
"""LSODA's first step relative to the remaining time, and that of other methods from a state at rest without forces."""
_FIRST_PART = 1e-2
"""First step of Radau and BDF relative to the time in which the state changes by rtol^(1/3) of its scales. SciPy's own
choice compares speeds with accelerations."""
_AGAIN = 1e-2
"""LSODA's first step after a restart relative to the previous step: the method restarts with order one."""
_LARGEST = 2e8
"""Largest number of entries of LSODA's matrix, full or banded."""
_BAND_WORTHWHILE = 0.25
"""Largest ratio of the bandwidth to the size of the matrix for which LSODA uses a banded Jacobian."""


class FirstOrder:
    """The system as y' = f(t, y).

    Parameters
    ----------
    system : System

    Attributes
    ----------
    force_calls, jacobian_calls : int
    """

    differences = False
    """Whether Jacobians are finite differences."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.nq = system.nq
        self.force_calls = 0
        self.jacobian_calls = 0
        mass = sparse.csc_matrix(system.mass(system.initial()[0]))
        mass.eliminate_zeros()
        self.mass = mass
        self.coupled = bool(mass.nnz > np.count_nonzero(mass.diagonal()))

    @cached_property
    def weight(self) -> sparse.csc_matrix:
        """The weight of `weighted_jacobian`, diag(1, M) (nq + nu, nq + nu)."""
        return sparse.csc_matrix(sparse.block_diag([sparse.eye_array(self.nq), self.mass]))

    def initial(self) -> np.ndarray:
        """y at time zero."""
        return np.concatenate(self.system.initial())

    def split(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """q and u of a state."""
        return y[: self.nq], y[self.nq :]

    def at(self, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """q and u of a state for records."""
        return self.split(y)

    def rate(self, t: float, y: np.ndarray) -> np.ndarray:
        """y' = (T u, M^-1 h)."""
        self.force_calls += 1
        q, u = self.split(y)
        return np.concatenate([self.system.kinematic_map(q, u), self.system.acceleration(t, q, u)])

    def jacobian(self, t: float, y: np.ndarray) -> sparse.csc_matrix:
        """dy'/dy = [[dq'/dq, T], [-M^-1 K dx/dq, -M^-1 D]], without stored zeros.

        The lower half is full where M couples velocities; `weighted_jacobian` stays sparse.
        """
        matrix = self.weighted_jacobian(t, y)
        upper, lower = matrix[: self.nq], self._over_mass(matrix[self.nq :])
        jacobian = sparse.csc_matrix(sparse.vstack([upper, lower], format="csc"))
        jacobian.eliminate_zeros()
        return jacobian

    def weighted_jacobian(self, t: float, y: np.ndarray) -> sparse.csc_matrix:
        """diag(1, M) dy'/dy = [[dq'/dq, T], [-K dx/dq, -D]]."""
        self.jacobian_calls += 1
        q, u = self.split(y)
        stiffness, damping = self.system.tangent(t, q, u)
        by_q, by_u = self.system.kinematic_jacobian(q, u)
        by_increment = -(stiffness.tocsr() @ self.system.tangent_map(q))
        return sparse.csc_matrix(sparse.block_array([[by_q, by_u], [by_increment, -damping.tocsr()]], format="csc"))

    def _over_mass(self, matrix: sparse.csc_matrix) -> sparse.csc_matrix:
        """M^-1 times a matrix (nu, n)."""
        if not self.coupled:
            return sparse.csc_matrix(sparse.diags_array(1.0 / self.mass.diagonal()) @ matrix)
        return sparse.csc_matrix(self._mass_factors.solve(matrix.toarray()))

    @cached_property
    def _mass_factors(self) -> Any:
        return splu(self.mass, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})

    def structured_jacobian(self, t: float, y: np.ndarray) -> SecondOrderJacobian:
        """Jacobian in its parts K, D and M, for "Radau-blocks"."""
        self.jacobian_calls += 1
        return second_order_jacobian(self.system, t, y)

    def absolute_tolerance(self, rtol: float) -> np.ndarray:
        """Absolute tolerance of every component of y: rtol times the typical sizes of the system's `scales`."""
        scales = self.system.scales()
        return rtol * np.concatenate([scales.configuration, scales.velocity])


def make_solver(
    method: str, equations: FirstOrder, t: float, y: np.ndarray, end: float, rtol: float, max_step: float
) -> OdeSolver:
    """Create a SciPy solver.

    Parameters
    ----------
    method : "Radau", "Radau-blocks", "BDF" or "LSODA"
        "Radau-blocks" is Radau with block linear algebra.
    equations : FirstOrder
    t, y, end : start time and state, end time
    rtol : relative tolerance
    max_step : s
    """
    atol = equations.absolute_tolerance(rtol)
    if method == "LSODA":
        return _lsoda(equations, t, y, end, rtol, atol, max_step)
    first_step = _first_step(equations, t, y, end, rtol, max_step)
    options: dict[str, Any] = {"rtol": rtol, "atol": atol, "max_step": max_step, "first_step": first_step}
    if method == "Radau-blocks":
        jacobian = equations.structured_jacobian
        return StructuredRadau(equations.rate, t, y, end, system=equations.system, jac=jacobian, **options)
    kind: Callable[..., OdeSolver] = {"Radau": Radau, "BDF": BDF}[method]
    if equations.differences:
        return kind(equations.rate, t, y, end, **options)
    if not equations.coupled:
        return kind(equations.rate, t, y, end, jac=equations.jacobian, **options)
    # (gamma I - J) x = b as (gamma W - W J) x = W b with the weight W = diag(1, M): M^-1 K would be full
    weight = equations.weight
    solver = kind(equations.rate, t, y, end, jac=equations.weighted_jacobian, **options)
    solver.I, solver.solve_lu = weight, lambda factors, right: factors.solve(weight @ right)
    return solver


def _first_step(equations: FirstOrder, t: float, y: np.ndarray, end: float, rtol: float, max_step: float) -> float:
    """First step of Radau and BDF, s."""
    size, (_, u) = equations.system.scales().increment, equations.split(y)
    rate = equations.rate(math.nextafter(t, math.inf), y)[equations.nq :]
    pace = max(mean_ratio(u, size), math.sqrt(mean_ratio(rate, size)))
    first = _FIRST_PART * rtol ** (1.0 / 3.0) / pace if pace > 0.0 else _FIRST_STEP * (end - t)
    return float(min(first, end - t, max_step))


def solver_state(solver: OdeSolver) -> State:
    """Restart data of a solver, besides t and y.

    Radau: steps and errors of its step control. BDF: also its differences and order. LSODA does not expose its state
    and starts anew; only its last step size is stored.
    """
    if isinstance(solver, LSODA):
        return {"steps": np.array([abs(solver.t - solver.t_old)])}
    state = {"steps": np.array([solver.h_abs, *(np.nan if x is None else x for x in _control(solver))])}
    if isinstance(solver, BDF):
        differences = np.zeros_like(solver.D)
        used = solver.order + 3
        differences[:used] = solver.D[:used]
        state |= {"differences": differences, "order": np.array([solver.order, solver.n_equal_steps])}
    return state


def _control(solver: OdeSolver) -> tuple[float | None, float | None]:
    return solver.h_abs_old, solver.error_norm_old


def resume(solver: OdeSolver, state: State) -> None:
    """Set the restart data of `solver_state` in a new solver, so that its first step equals the next step of the old one."""
    steps = state["steps"].tolist()
    if isinstance(solver, LSODA):
        integrator = solver._lsoda_solver._integrator
        integrator.first_step = integrator.rwork[4] = min(_AGAIN * steps[0], solver.t_bound - solver.t)
        return
    solver.h_abs = steps[0]
    solver.h_abs_old, solver.error_norm_old = (None if np.isnan(x) else x for x in steps[1:])
    if isinstance(solver, BDF):
        solver.D = state["differences"].copy()
        solver.order, solver.n_equal_steps = (int(x) for x in state["order"])


def _lsoda(
    equations: FirstOrder, t: float, y: np.ndarray, end: float, rtol: float, atol: np.ndarray, max_step: float
) -> OdeSolver:
    """LSODA with a banded Jacobian where possible: states are reordered by reverse Cuthill-McKee."""
    # from a state at rest, the default first step of LSODA is far too long for stiff springs, and LSODA fails after ten
    # reductions
    options: dict[str, Any] = {"rtol": rtol, "max_step": max_step, "first_step": min(_FIRST_STEP * (end - t), max_step)}
    if equations.differences:
        return LSODA(equations.rate, t, y, end, atol=atol, **options)
    pattern = _structure(equations, t, y)
    order = np.asarray(reverse_cuthill_mckee(pattern + pattern.T, symmetric_mode=True))
    position = np.empty(len(order), dtype=np.int64)
    position[order] = np.arange(len(order))
    row, column = pattern.nonzero()
    reach = position[row] - position[column]
    lower, upper = int(max(reach.max(initial=0), 0)), int(max((-reach).max(initial=0), 0))
    banded = lower + upper + 1 <= _BAND_WORTHWHILE * len(y) and equations.system.fixed_pattern
    entries = len(y) * (2 * lower + upper + 1 if banded else len(y))
    if entries > _LARGEST:
        raise NotConverged(
            f"at t = {t:.6g} s: LSODA would need a matrix of {8e-9 * entries:.3g} GB for these {len(y)} states; take "
            'method = "generalized-alpha" or "Radau-blocks"'
        )
    if not banded:
        return LSODA(
            equations.rate, t, y, end, atol=atol, jac=lambda t, y: equations.jacobian(t, y).toarray(), **options
        )
    return _ReorderedLSODA(equations, order, position, (lower, upper), t, y, end, atol=atol, **options)


def _structure(equations: FirstOrder, t: float, y: np.ndarray) -> sparse.csr_matrix:
    """Pattern of the Jacobian, from states slightly away from the start (a straight strip has zeros there)."""
    rng = np.random.default_rng(0)
    scale = equations.absolute_tolerance(1e-3)
    pattern = sparse.csr_matrix((len(y), len(y)))
    for _ in range(2):
        pattern = pattern + abs(equations.jacobian(t, y + scale * rng.standard_normal(len(y)))).tocsr()
    return sparse.csr_matrix(pattern)


class _ReorderedLSODA(LSODA):
    """LSODA on reordered states with a packed band Jacobian; `y` and the dense output are in the caller's order."""

    def __init__(
        self,
        equations: FirstOrder,
        order: np.ndarray,
        position: np.ndarray,
        band: tuple[int, int],
        t: float,
        y: np.ndarray,
        end: float,
        *,
        atol: np.ndarray,
        **options: Any,
    ) -> None:
        self._order, self._position = order, position
        lower, upper = band

        def rate(t: float, z: np.ndarray) -> np.ndarray:
            return equations.rate(t, z[position])[order]

        def jacobian(t: float, z: np.ndarray) -> np.ndarray:
            entries = equations.jacobian(t, z[position]).tocoo()
            row, column = position[entries.row], position[entries.col]
            # SciPy requires additional rows for pivots
            packed = np.zeros((2 * lower + upper + 1, len(z)))
            packed[row - column + upper, column] = entries.data
            return packed[: lower + upper + 1]

        super().__init__(
            rate, t, y[order], end, atol=atol[order], jac=jacobian, lband=lower, uband=upper, **options
        )

    def state(self) -> np.ndarray:
        """y in the caller's order."""
        return np.asarray(self.y)[self._position]

    def interpolant(self) -> Callable[[float], np.ndarray]:
        """Dense output over the last step, in the caller's order."""
        inner = self.dense_output()
        return lambda t: np.asarray(inner(t))[self._position]
