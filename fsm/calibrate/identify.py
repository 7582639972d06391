"""Parameters of cases from measured force-displacement curves, several tests at once, by least squares.

The residuals of a test at the travels s_i are (F(s_i; p) + b - F_i)/sigma_i, with the scatter sigma_i of the test and, if
it is said to be off, the zero b of its load cell, which is then estimated too, with a residual b/sigma_b of its own;
likewise a drag d (1 - exp(-s/s_d)), the force that hysteresis adds once a loading is under way. Where the scatter of
neighbouring points is alike, its correlation is exp(-|s_i - s_j|/l), and residuals are whitened with the Cholesky factor of
that matrix. What is known beforehand of a ratio p_j/p_k adds (log(p_j/p_k) - log m)/s.

Derivatives are those of `fsm.calibrate.sensitivity`. Parameters that must be positive are sought by their logarithm;
several starts are drawn within the bounds, and the best end is taken. The covariance is that of whole repeats and of the
misfit of the model's form (`fsm.calibrate.discrepancy`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares
from scipy.stats import norm

from fsm.calibrate.discrepancy import Rows, Spread, spread_of
from fsm.calibrate.parameters import value_at, with_values
from fsm.calibrate.respond import Response, respond
from fsm.calibrate.uncertainty import Estimate, fit_gain, identifiability
from fsm.errors import CaseError, Fault, FsmError
from fsm.scene.case import Case

__all__ = ["Identification", "Measured", "Parameter", "Prior", "identify"]

_AWAY = 1e3
"""Weighted residuals of parameters with which the case cannot be solved."""
_CHANCE = 0.01
"""Probability with which the largest of all deviations is called a misfit although it is scatter."""
_SAME = 1e-3
"""Difference of two ends, relative to the best sum of squares, below which they count as the same."""


@dataclass(frozen=True)
class Parameter:
    """What is to be identified: dotted path, bounds and start, SI."""

    path: str
    lower: float
    upper: float
    start: float


@dataclass(frozen=True)
class Prior:
    """What is known of a ratio of two parameters before any test: its median, the standard deviation of its logarithm."""

    above: str
    below: str
    median: float
    deviation: float


@dataclass(frozen=True)
class Measured:
    """One test.

    Attributes
    ----------
    name : str
    case : Case
        Of this test, with its own loading.
    travel, force : (n,) arrays, m and N
    deviation : (n,) array, N
        Standard deviation of the force; ones where it is not known.
    known : bool
        Whether the deviations are known, or only their ratio.
    alike : m
        Travel over which the scatter is alike; 0: independent.
    zero : N
        Standard deviation of the zero of the load cell; 0: it is not off.
    drag : N
        Standard deviation of a force that builds up as the loading begins; 0: there is none.
    drag_over : m
        Travel over which it does, s_d.
    repeats : (r, n) array, N
        Whole curves whose mean is `force`; none where only the scatter is known, or nothing.
    """

    name: str
    case: Case
    travel: np.ndarray
    force: np.ndarray
    deviation: np.ndarray
    known: bool = True
    alike: float = 0.0
    zero: float = 0.0
    drag: float = 0.0
    drag_over: float = 1.0
    repeats: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def extras(self) -> list[tuple[str, np.ndarray, float]]:
        """Name, shape (n,) and standard deviation (N) of what the test adds to the force of the case."""
        found = []
        if self.zero > 0.0:
            found.append((f"zero of {self.name}", np.ones(len(self.travel)), self.zero))
        if self.drag > 0.0:
            found.append((f"drag of {self.name}", 1.0 - np.exp(-self.travel / self.drag_over), self.drag))
        return found

    def whitened(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) or (n, p), N, as multiples of independent standard deviations."""
        scaled = values / (self.deviation if values.ndim == 1 else self.deviation[:, None])
        if self.alike == 0.0:
            return np.asarray(scaled)
        return np.asarray(solve_triangular(cholesky(self._correlation(), lower=True), scaled, lower=True))

    def scatter(self) -> np.ndarray | None:
        """Covariance of the mean curve (n, n), N^2, from what is said of its scatter; None where nothing is known."""
        if not self.known:
            return None
        return np.asarray(self._correlation() * np.outer(self.deviation, self.deviation))

    def _correlation(self) -> np.ndarray:
        if self.alike == 0.0:
            return np.eye(len(self.travel))
        return np.asarray(np.exp(-np.abs(self.travel[:, None] - self.travel[None, :]) / self.alike))


@dataclass(frozen=True)
class Identification:
    """What was found.

    Attributes
    ----------
    estimate : Estimate
        The parameters, then what tests add ("zero of <test>", "drag of <test>", N).
    responses : of every test, with derivatives by the parameters
    added : of every test, (n,) array, N
        What zero and drag add.
    discrepancy : (tests,) array, N
        Standard deviation of the misfit of the model's form in each test, beyond the scatter of the test.
    cost : sum of squares of weighted residuals
    data : int
        Number of measured points.
    starts : values (p,), cost and end (p,) of every start
    warnings : texts
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
    """Residuals and their derivatives by the unknowns: parameters (their logarithms where positive), then what tests add."""

    def __init__(self, tests: Sequence[Measured], parameters: Sequence[Parameter], priors: Sequence[Prior]) -> None:
        self.tests, self.parameters, self.priors = tests, parameters, priors
        self.paths = [parameter.path for parameter in parameters]
        self.logarithmic = np.array([parameter.lower > 0.0 for parameter in parameters])
        self.extras = [(k, *extra) for k, test in enumerate(tests) for extra in test.extras]
        self.last: tuple[np.ndarray, list[Response]] | None = None

    def inward(self, values: np.ndarray) -> np.ndarray:
        """Unknowns of parameters."""
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, values, 1.0)), values)

    def outward(self, unknowns: np.ndarray) -> np.ndarray:
        """Parameters of unknowns."""
        inner = unknowns[: len(self.paths)]
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, inner, 0.0)), inner)

    def responses(self, unknowns: np.ndarray) -> list[Response]:
        """Of every test."""
        if self.last is None or not np.array_equal(self.last[0], unknowns):
            values = dict(zip(self.paths, self.outward(unknowns).tolist(), strict=True))
            found = [respond(with_values(test.case, values), test.travel, self.paths) for test in self.tests]
            self.last = unknowns.copy(), found
        return self.last[1]

    def residuals(self, unknowns: np.ndarray) -> np.ndarray:
        """All weighted residuals; large ones where the case cannot be solved."""
        try:
            responses = self.responses(unknowns)
        except CaseError:
            raise
        except FsmError:
            return np.full(sum(len(test.travel) for test in self.tests) + len(self.extras) + len(self.priors), _AWAY)
        parts = [
            test.whitened(response.force + added - test.force)
            for test, response, added in zip(self.tests, responses, self.added(unknowns), strict=True)
        ]
        sizes = unknowns[len(self.paths) :].tolist()
        parts.append(np.array([size / deviation for size, (_, _, _, deviation) in zip(sizes, self.extras, strict=True)]))
        value = dict(zip(self.paths, self.outward(unknowns).tolist(), strict=True))
        parts.append(np.array([
            math.log(value[prior.above] / value[prior.below] / prior.median) / prior.deviation for prior in self.priors
        ]))  # fmt: skip
        return np.concatenate(parts)

    def added(self, unknowns: np.ndarray) -> list[np.ndarray]:
        """What every test adds to the force of its case."""
        total = [np.zeros(len(test.travel)) for test in self.tests]
        for size, (k, _, shape, _) in zip(unknowns[len(self.paths) :].tolist(), self.extras, strict=True):
            total[k] += size * shape
        return total

    def jacobian(self, unknowns: np.ndarray, outward: bool = False) -> np.ndarray:
        """d(residuals)/d(unknowns), or by the parameters themselves."""
        values = self.outward(unknowns)
        chain = np.where(self.logarithmic & (not outward), values, 1.0)
        count, parts = len(self.paths), []
        for k, (test, response) in enumerate(zip(self.tests, self.responses(unknowns), strict=True)):
            assert response.jacobian is not None
            if not np.all(np.isfinite(response.jacobian)):
                text = f"the structure snaps in the test {test.name!r}: no derivatives there; leave those travels out"
                raise CaseError(Fault("curve", text))
            rows = np.zeros((len(test.travel), count + len(self.extras)))
            rows[:, :count] = response.jacobian * chain
            for column, (of, _, shape, _) in enumerate(self.extras):
                if of == k:
                    rows[:, count + column] = shape
            parts.append(test.whitened(rows))
        own = np.zeros((len(self.extras), count + len(self.extras)))
        for row, (_, _, _, deviation) in enumerate(self.extras):
            own[row, count + row] = 1.0 / deviation
        known = np.zeros((len(self.priors), count + len(self.extras)))
        for row, prior in enumerate(self.priors):
            for path, sign in ((prior.above, 1.0), (prior.below, -1.0)):
                at = self.paths.index(path)
                known[row, at] = sign * chain[at] / values[at] / prior.deviation
        return np.concatenate([*parts, own, known])


def identify(
    tests: Sequence[Measured],
    parameters: Sequence[Parameter],
    priors: Sequence[Prior] = (),
    starts: int = 1,
    seed: int = 0,
    tell: Callable[[float], None] = lambda fraction: None,
) -> Identification:
    """Fit parameters to measured curves.

    Parameters
    ----------
    tests, parameters, priors : what is fitted, what may change, what is known
    starts : int
        How many; the first is that of the parameters, others are drawn within the bounds.
    seed : int
    tell : callable
        Called with the fraction done.

    Raises
    ------
    CaseError
        Paths, travels or bounds that cannot be used.
    FsmError
        The case can be solved from none of the starts.
    """
    for test in tests:
        for parameter in parameters:
            value_at(test.case, parameter.path)
    problem = _Problem(tests, parameters, priors)
    lower = problem.inward(np.array([p.lower for p in parameters]))
    upper = problem.inward(np.array([p.upper for p in parameters]))
    free = np.full(len(problem.extras), np.inf)
    bounds = np.concatenate([lower, -free]), np.concatenate([upper, free])
    draws = np.random.default_rng(seed).uniform(lower, upper, size=(max(starts - 1, 0), len(lower)))
    first = problem.inward(np.array([p.start for p in parameters]))
    ends: list[tuple[np.ndarray, float, np.ndarray]] = []
    best: tuple[float, np.ndarray] | None = None
    failed: FsmError | None = None
    for number, begin in enumerate([first, *draws]):
        tell(number / starts)
        unknowns = np.clip(np.concatenate([begin, np.zeros(len(problem.extras))]), *bounds)
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
        ends.append((problem.outward(begin), 2.0 * float(found.cost), problem.outward(found.x)))
        if best is None or found.cost < best[0]:
            best = float(found.cost), found.x
    if best is None:
        assert failed is not None
        raise failed
    return _found(problem, best[1], ends, bounds)


def _found(
    problem: _Problem,
    unknowns: np.ndarray,
    ends: list[tuple[np.ndarray, float, np.ndarray]],
    bounds: tuple[np.ndarray, np.ndarray],
) -> Identification:
    tests, names = problem.tests, [*problem.paths, *(name for _, name, _, _ in problem.extras)]
    residuals, jacobian = problem.residuals(unknowns), problem.jacobian(unknowns, outward=True)
    values = np.concatenate([problem.outward(unknowns), unknowns[len(problem.paths) :]])
    points = sum(len(test.travel) for test in tests)
    if len(residuals) < len(names) or (len(residuals) == len(names) and not all(test.known for test in tests)):
        text = f"{points} points do not give {len(names)} parameters and their scatter; leave some out, or give more points"
        raise CaseError(Fault("parameter", text))
    spread = _spread(problem, unknowns, residuals, jacobian)
    freedom = spread.freedom if math.isfinite(spread.freedom) else 0
    positive = tuple(path for path, sought in zip(problem.paths, problem.logarithmic, strict=True) if sought)
    estimate = Estimate(tuple(names), values, spread.covariance, freedom, positive)
    count = len(problem.paths)
    own = Estimate(estimate.names[:count], values[:count], estimate.covariance[:count, :count], estimate.freedom)
    warnings = identifiability(own)
    fitted = zip(tests, problem.responses(unknowns), problem.added(unknowns), spread.discrepancy.tolist(), strict=True)
    texts = (_misfit(test, response.force + added - test.force, size) for test, response, added, size in fitted)
    warnings += [text for text in texts if text]
    reach = bounds[1][:count] - bounds[0][:count]
    for k, path in enumerate(problem.paths):
        if min(unknowns[k] - bounds[0][k], bounds[1][k] - unknowns[k]) < 1e-6 * reach[k]:
            warnings.append(f"{path} ends at a bound, {values[k]:.5g}; its interval does not know of the bound")
    best = min(cost for _, cost, _ in ends)
    elsewhere = sum(cost > best + _SAME * max(best, 1.0) for _, cost, _ in ends)
    if elsewhere:
        warnings.append(f"{elsewhere} of {len(ends)} starts ended in a worse fit: there are several minima")
    cost = float(residuals @ residuals)
    responses, added = tuple(problem.responses(unknowns)), tuple(problem.added(unknowns))
    return Identification(
        estimate, responses, added, spread.discrepancy, cost, points, tuple(ends), tuple(warnings)
    )


def _spread(problem: _Problem, unknowns: np.ndarray, residuals: np.ndarray, jacobian: np.ndarray) -> Spread:
    """Covariance from whole repeats, from the scatter that is known, from the misfit of the form, and from priors."""
    gain = fit_gain(jacobian)
    rows, start = [], 0
    for test in problem.tests:
        stop = start + len(test.travel)
        # whitened = W forces, so d(parameter)/d(force) = gain W
        weight = test.whitened(np.eye(len(test.travel)))
        unweighted = np.linalg.solve(weight, np.column_stack([residuals[start:stop], jacobian[start:stop]]))
        of_forces = gain[:, start:stop] @ weight
        rows.append(Rows(test.travel, -unweighted[:, 0], unweighted[:, 1:], of_forces, test.repeats, test.scatter()))
        start = stop
    beside = gain[:, start:]
    return spread_of(rows, beside @ beside.T)


def _misfit(test: Measured, off: np.ndarray, discrepancy: float) -> str:
    """Warning of a fit that scatter does not explain; empty if there is none."""
    if not test.known:
        return ""
    worst = int(np.argmax(np.abs(off) / test.deviation))
    multiple = abs(off[worst]) / test.deviation[worst]
    if multiple < norm.ppf(1.0 - 0.5 * _CHANCE / len(off)) or discrepancy == 0.0:
        return ""
    part = 100.0 * discrepancy / float(np.sqrt(np.mean(test.force**2)))
    return (
        f"{test.name}: the fit is off by {multiple:.2g} standard deviations at {1e3 * test.travel[worst]:.4g} mm: the model "
        f"does not have the form of the data; intervals include a misfit of {discrepancy:.3g} N ({part:.2g} % of the force)"
    )
