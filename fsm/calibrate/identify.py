"""Parameters of a case from several measured force-displacement curves, by least squares.

The residuals of a test at the travels s_i are (F(s_i; p) + b + d (1 - exp(-s_i/s_d)) - F_i)/sigma_i with its scatter
sigma_i. Here b is a zero error of the load cell, and d is a drag: a force that hysteresis adds after the loading has begun.
If the study gives standard deviations sigma_b or sigma_d, b or d is estimated too, with a residual b/sigma_b or d/sigma_d.
The scatter of neighbouring points may have the correlation exp(-|s_i - s_j|/l). Residuals are then multiplied by the inverse
Cholesky factor of the correlation matrix. A prior for r = p_j or r = p_j/p_k adds the residual (log r - log m)/s.

Derivatives come from `fsm.calibrate.sensitivity`. The unknown of a positive parameter is its logarithm. The search begins at
several points within the bounds, and the best minimum is the result. The covariance contains the scatter of whole repeats
and the model discrepancy (`fsm.calibrate.uncertainty`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares
from scipy.stats import norm

from fsm.calibrate.response import Response, force_response
from fsm.calibrate.study import value_at, with_values
from fsm.calibrate.uncertainty import Estimate, LinearisedTest, ParameterSpread, fit_gain, identifiability, parameter_spread
from fsm.case.models.case import Case
from fsm.errors import CaseError, Fault, FsmError

_UNSOLVED = 1e3
"""Weighted residual of parameters for which the case cannot be solved."""
_FALSE_ALARM = 0.01
"""Probability that scatter alone causes the warning of a misfit."""
_SAME_MINIMUM = 1e-3
"""Relative difference of the sums of squares above which two starts count as different minima."""


@dataclass(frozen=True)
class Parameter:
    """Parameter to identify: dotted path, bounds and start value, in SI units."""

    path: str
    lower: float
    upper: float
    start: float


@dataclass(frozen=True)
class Prior:
    """Prior of a parameter, or of the ratio of two: its median, and the standard deviation of its logarithm."""

    above: str
    below: str | None
    median: float
    deviation: float


@dataclass(frozen=True)
class ForceTest:
    """One force-displacement test.

    Attributes
    ----------
    name : str
    case : Case
        Case of this test, with its own loading.
    travel, force : (n,) arrays, m and N
    deviation : (n,) array, N
        Standard deviation of the force; ones if unknown.
    known : bool
        Whether the standard deviations are known.
    correlation_length : m
        Correlation length of the scatter along the travel; 0: independent points.
    zero : N
        Standard deviation of the zero error of the load cell; 0: no zero error.
    drag : N
        Standard deviation of the drag, a force that builds up at the beginning of the loading; 0: no drag.
    drag_over : m
        Travel over which the drag builds up, s_d.
    repeats : (r, n) array, N
        Forces of whole repeats, whose mean is `force`; r = 0 without repeats.
    """

    name: str
    case: Case
    travel: np.ndarray
    force: np.ndarray
    deviation: np.ndarray
    known: bool = True
    correlation_length: float = 0.0
    zero: float = 0.0
    drag: float = 0.0
    drag_over: float = 1.0
    repeats: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def added_forces(self) -> list[tuple[str, np.ndarray, float]]:
        """Zero error and drag of the test: name, shape along the travel (n,), and standard deviation (N) of each."""
        found = []
        if self.zero > 0.0:
            found.append((f"zero of {self.name}", np.ones(len(self.travel)), self.zero))
        if self.drag > 0.0:
            found.append((f"drag of {self.name}", 1.0 - np.exp(-self.travel / self.drag_over), self.drag))
        return found

    def whitened(self, values: np.ndarray) -> np.ndarray:
        """Whitened values: (n,) or (n, p), N, in units of independent standard deviations."""
        scaled = values / (self.deviation if values.ndim == 1 else self.deviation[:, None])
        if self.correlation_length == 0.0:
            return np.asarray(scaled)
        return np.asarray(solve_triangular(cholesky(self._correlation(), lower=True), scaled, lower=True))

    def scatter(self) -> np.ndarray | None:
        """Covariance of the mean curve (n, n), N^2, from standard deviations and correlation length; None if unknown."""
        if not self.known:
            return None
        return np.asarray(self._correlation() * np.outer(self.deviation, self.deviation))

    def _correlation(self) -> np.ndarray:
        if self.correlation_length == 0.0:
            return np.eye(len(self.travel))
        return np.asarray(np.exp(-np.abs(self.travel[:, None] - self.travel[None, :]) / self.correlation_length))


@dataclass(frozen=True)
class Identification:
    """Result of an identification.

    Attributes
    ----------
    estimate : Estimate
        The parameters, then zero errors and drags ("zero of <test>", "drag of <test>", N).
    responses : tuple of Response
        Response of every test, with derivatives with respect to the parameters.
    added : tuple of (n,) arrays, N
        Zero error plus drag of every test.
    discrepancy : (tests,) array, N
        Standard deviation of the model discrepancy in each test, in addition to the scatter.
    cost : float
        Sum of squares of the weighted residuals.
    data : int
        Number of measured points.
    starts : start values (p,), cost, and end values (p,) of every start
    warnings : tuple of str
    """

    estimate: Estimate
    responses: tuple[Response, ...]
    added: tuple[np.ndarray, ...]
    discrepancy: np.ndarray
    cost: float
    data: int
    starts: tuple[tuple[np.ndarray, float, np.ndarray], ...]
    warnings: tuple[str, ...]


class _Problem:
    """Residuals and their derivatives with respect to the unknowns.

    The unknowns are the parameters (the logarithm of a positive one), then the zero errors and drags of the tests.
    """

    def __init__(self, tests: Sequence[ForceTest], parameters: Sequence[Parameter], priors: Sequence[Prior]) -> None:
        self.tests, self.parameters, self.priors = tests, parameters, priors
        self.paths = [parameter.path for parameter in parameters]
        self.logarithmic = np.array([parameter.lower > 0.0 for parameter in parameters])
        self.additions = [(k, *addition) for k, test in enumerate(tests) for addition in test.added_forces]
        self.last: tuple[np.ndarray, list[Response]] | None = None

    def to_unknowns(self, values: np.ndarray) -> np.ndarray:
        """Unknowns from parameters."""
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, values, 1.0)), values)

    def to_parameters(self, unknowns: np.ndarray) -> np.ndarray:
        """Parameters from unknowns."""
        own = unknowns[: len(self.paths)]
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, own, 0.0)), own)

    def responses(self, unknowns: np.ndarray) -> list[Response]:
        """Response of every test; the last result is stored."""
        if self.last is None or not np.array_equal(self.last[0], unknowns):
            values = dict(zip(self.paths, self.to_parameters(unknowns).tolist(), strict=True))
            found = [force_response(with_values(test.case, values), test.travel, self.paths) for test in self.tests]
            self.last = unknowns.copy(), found
        return self.last[1]

    def residuals(self, unknowns: np.ndarray) -> np.ndarray:
        """All weighted residuals; large constant values if the case cannot be solved."""
        try:
            responses = self.responses(unknowns)
        except CaseError:
            raise
        except FsmError:
            count = sum(len(test.travel) for test in self.tests) + len(self.additions) + len(self.priors)
            return np.full(count, _UNSOLVED)
        parts = [
            test.whitened(response.force + added - test.force)
            for test, response, added in zip(self.tests, responses, self.added(unknowns), strict=True)
        ]
        sizes = unknowns[len(self.paths) :].tolist()
        parts.append(np.array([size / deviation for size, (_, _, _, deviation) in zip(sizes, self.additions, strict=True)]))
        value = dict(zip(self.paths, self.to_parameters(unknowns).tolist(), strict=True))
        parts.append(np.array([
            math.log(value[prior.above] / (value[prior.below] if prior.below else 1.0) / prior.median) / prior.deviation
            for prior in self.priors
        ]))  # fmt: skip
        return np.concatenate(parts)

    def added(self, unknowns: np.ndarray) -> list[np.ndarray]:
        """Zero error plus drag of every test, N."""
        total = [np.zeros(len(test.travel)) for test in self.tests]
        for size, (k, _, shape, _) in zip(unknowns[len(self.paths) :].tolist(), self.additions, strict=True):
            total[k] += size * shape
        return total

    def jacobian(self, unknowns: np.ndarray, by_parameters: bool = False) -> np.ndarray:
        """d(residuals)/d(unknowns); with `by_parameters`, d(residuals)/d(parameters) without logarithms."""
        values = self.to_parameters(unknowns)
        chain = np.where(self.logarithmic & (not by_parameters), values, 1.0)
        count, parts = len(self.paths), []
        for k, (test, response) in enumerate(zip(self.tests, self.responses(unknowns), strict=True)):
            assert response.jacobian is not None
            if not np.all(np.isfinite(response.jacobian)):
                text = f"the structure snaps in the test {test.name!r}, so derivatives do not exist there"
                raise CaseError(Fault("curve", f"{text}; delete the rows at these travels"))
            rows = np.zeros((len(test.travel), count + len(self.additions)))
            rows[:, :count] = response.jacobian * chain
            for column, (number, _, shape, _) in enumerate(self.additions):
                if number == k:
                    rows[:, count + column] = shape
            parts.append(test.whitened(rows))
        addition_rows = np.zeros((len(self.additions), count + len(self.additions)))
        for row, (_, _, _, deviation) in enumerate(self.additions):
            addition_rows[row, count + row] = 1.0 / deviation
        prior_rows = np.zeros((len(self.priors), count + len(self.additions)))
        for row, prior in enumerate(self.priors):
            for path, sign in ((prior.above, 1.0), (prior.below, -1.0)):
                if path is None:
                    continue
                at = self.paths.index(path)
                prior_rows[row, at] = sign * chain[at] / values[at] / prior.deviation
        return np.concatenate([*parts, addition_rows, prior_rows])


def identify(
    tests: Sequence[ForceTest],
    parameters: Sequence[Parameter],
    priors: Sequence[Prior] = (),
    starts: int = 1,
    seed: int = 0,
    report_progress: Callable[[float], None] = lambda fraction: None,
) -> Identification:
    """Fit parameters to measured curves.

    Parameters
    ----------
    tests, parameters, priors : sequences of ForceTest, Parameter, Prior
    starts : int
        Number of starts: first the start values of the parameters, then random points within the bounds.
    seed : int
    report_progress : callable
        Called with the completed fraction of the work.

    Raises
    ------
    CaseError
        A path, a travel or a bound is invalid, or there are too few points.
    FsmError
        The case cannot be solved at any start.
    """
    for test in tests:
        for parameter in parameters:
            value_at(test.case, parameter.path)
    problem = _Problem(tests, parameters, priors)
    lower = problem.to_unknowns(np.array([p.lower for p in parameters]))
    upper = problem.to_unknowns(np.array([p.upper for p in parameters]))
    unbounded = np.full(len(problem.additions), np.inf)
    bounds = np.concatenate([lower, -unbounded]), np.concatenate([upper, unbounded])
    draws = np.random.default_rng(seed).uniform(lower, upper, size=(max(starts - 1, 0), len(lower)))
    first = problem.to_unknowns(np.array([p.start for p in parameters]))
    ends: list[tuple[np.ndarray, float, np.ndarray]] = []
    best: tuple[float, np.ndarray] | None = None
    failed: FsmError | None = None
    for number, begin in enumerate([first, *draws]):
        report_progress(number / starts)
        unknowns = np.clip(np.concatenate([begin, np.zeros(len(problem.additions))]), *bounds)
        try:
            problem.responses(unknowns)
        except CaseError:
            raise
        except FsmError as error:
            failed = error
            continue
        found = least_squares(
            problem.residuals, unknowns, problem.jacobian, bounds, x_scale="jac", xtol=1e-8, ftol=1e-9, gtol=1e-9
        )
        ends.append((problem.to_parameters(begin), 2.0 * float(found.cost), problem.to_parameters(found.x)))
        if best is None or found.cost < best[0]:
            best = float(found.cost), found.x
    if best is None:
        assert failed is not None
        raise failed
    return _identification(problem, best[1], ends, bounds)


def _identification(
    problem: _Problem,
    unknowns: np.ndarray,
    ends: list[tuple[np.ndarray, float, np.ndarray]],
    bounds: tuple[np.ndarray, np.ndarray],
) -> Identification:
    tests, names = problem.tests, [*problem.paths, *(name for _, name, _, _ in problem.additions)]
    residuals, jacobian = problem.residuals(unknowns), problem.jacobian(unknowns, by_parameters=True)
    values = np.concatenate([problem.to_parameters(unknowns), unknowns[len(problem.paths) :]])
    points = sum(len(test.travel) for test in tests)
    if len(residuals) < len(names) or (len(residuals) == len(names) and not all(test.known for test in tests)):
        text = (
            f"{points} data points cannot determine {len(names)} parameters and the scatter of the data; "
            "add points or remove parameters"
        )
        raise CaseError(Fault("parameter", text))
    spread = _spread(problem, residuals, jacobian)
    freedom = spread.freedom if math.isfinite(spread.freedom) else 0
    positive = tuple(path for path, logarithmic in zip(problem.paths, problem.logarithmic, strict=True) if logarithmic)
    estimate = Estimate(tuple(names), values, spread.covariance, freedom, positive)
    count = len(problem.paths)
    own = Estimate(estimate.names[:count], values[:count], estimate.covariance[:count, :count], estimate.freedom)
    warnings = identifiability(own)
    fitted = zip(tests, problem.responses(unknowns), problem.added(unknowns), spread.discrepancy.tolist(), strict=True)
    texts = (_misfit(test, response.force + added - test.force, size) for test, response, added, size in fitted)
    warnings += [text for text in texts if text]
    width = bounds[1][:count] - bounds[0][:count]
    for k, path in enumerate(problem.paths):
        if min(unknowns[k] - bounds[0][k], bounds[1][k] - unknowns[k]) < 1e-6 * width[k]:
            what = f"{path} ends at its bound {values[k]:.5g}, which the interval ignores"
            warnings.append(f"{what}; consider a wider bound")
    best = min(cost for _, cost, _ in ends)
    elsewhere = sum(cost > best + _SAME_MINIMUM * max(best, 1.0) for _, cost, _ in ends)
    if elsewhere:
        warnings.append(f"{elsewhere} of {len(ends)} starts ended in a worse fit: there are several minima; try more starts")
    cost = float(residuals @ residuals)
    responses, added = tuple(problem.responses(unknowns)), tuple(problem.added(unknowns))
    return Identification(
        estimate, responses, added, spread.discrepancy, cost, points, tuple(ends), tuple(warnings)
    )


def _spread(problem: _Problem, residuals: np.ndarray, jacobian: np.ndarray) -> ParameterSpread:
    """Covariance from repeats or known scatter, model discrepancy, and priors."""
    gain = fit_gain(jacobian)
    linearised, start = [], 0
    for test in problem.tests:
        stop = start + len(test.travel)
        # the whitened forces are W F, so d(parameter)/d(force) = gain W
        weight = test.whitened(np.eye(len(test.travel)))
        unweighted = np.linalg.solve(weight, np.column_stack([residuals[start:stop], jacobian[start:stop]]))
        force_gain = gain[:, start:stop] @ weight
        linearised.append(
            LinearisedTest(test.travel, -unweighted[:, 0], unweighted[:, 1:], force_gain, test.repeats, test.scatter())
        )
        start = stop
    prior_gain = gain[:, start:]
    return parameter_spread(linearised, prior_gain @ prior_gain.T)


def _misfit(test: ForceTest, residual: np.ndarray, discrepancy: float) -> str:
    """Warning of residuals that scatter does not explain; empty if there are none."""
    if not test.known:
        return ""
    worst = int(np.argmax(np.abs(residual) / test.deviation))
    multiple = abs(residual[worst]) / test.deviation[worst]
    limit = norm.ppf(1.0 - 0.5 * _FALSE_ALARM / len(residual))
    if multiple < limit or discrepancy == 0.0:
        return ""
    part = 100.0 * discrepancy / float(np.sqrt(np.mean(test.force**2)))
    return (
        f"{test.name}: residual of {multiple:.2g} standard deviations (scatter explains {limit:.2g}) at "
        f"{1e3 * test.travel[worst]:.4g} mm: the model does not fit the data; intervals include a model discrepancy of "
        f"{discrepancy:.3g} N ({part:.2g} % of the force)"
    )
