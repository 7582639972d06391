"""Uncertainty band of a force-displacement curve, and interval of its peak, from the uncertainty of parameters.

Linear band: the variance of the force is J C J^T, with J = dF/dp at the estimate and C the covariance of the parameters.
Monte Carlo band: the case is solved with parameters drawn from the estimate, on several processes. The band lies between
quantiles of the force at every travel. For a positive parameter, random values of its logarithm are drawn, so the parameter
stays positive.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import norm

from fsm.calibrate.response import Response, force_response, peak_of
from fsm.calibrate.study import with_values
from fsm.calibrate.uncertainty import Estimate
from fsm.case.models.case import Case
from fsm.errors import CaseError, FsmError
from fsm.run.workers import run_jobs
from fsm.text.short_repr import ShortRepr


@dataclass(frozen=True, repr=False)
class Band(ShortRepr):
    """Force curve with its uncertainty band.

    Attributes
    ----------
    travel, force, low, high : (n,) arrays, m and N
    peak : (value, low, high), N
    samples : int
        Number of Monte Carlo samples; 0 for a linear band.
    failed : int
        Number of samples that could not be solved.
    """

    travel: np.ndarray
    force: np.ndarray
    low: np.ndarray
    high: np.ndarray
    peak: tuple[float, float, float]
    samples: int = 0
    failed: int = 0


def linear_band(response: Response, estimate: Estimate, level: float = 0.95) -> Band:
    """Band by sensitivities.

    Parameters
    ----------
    response : Response
        Response at the estimate, with derivatives with respect to the parameters of the estimate in their order.
    estimate : Estimate
    level : -
        Confidence level.
    """
    assert response.jacobian is not None
    half_width = estimate.quantile(level) * _standard_deviation(response.jacobian, estimate)
    peak = peak_of(response)
    assert peak.gradient is not None
    peak_half_width = estimate.quantile(level) * float(_standard_deviation(peak.gradient[None], estimate)[0])
    return Band(
        response.travel, response.force, response.force - half_width, response.force + half_width,
        (peak.force, peak.force - peak_half_width, peak.force + peak_half_width),
    )  # fmt: skip


def widen_band(band: Band, deviation: np.ndarray, level: float = 0.95) -> Band:
    """Band of a measured force: add independent standard deviations (n,), N, in quadrature on either side."""
    half_width = norm.ppf(0.5 + 0.5 * level) * deviation
    value, low, high = band.peak
    at_peak = float(np.interp(band.travel[int(np.argmax(band.force))], band.travel, half_width))
    return replace(
        band,
        low=band.force - np.hypot(band.force - band.low, half_width),
        high=band.force + np.hypot(band.high - band.force, half_width),
        peak=(value, value - float(np.hypot(value - low, at_peak)), value + float(np.hypot(high - value, at_peak))),
    )


def _standard_deviation(jacobian: np.ndarray, estimate: Estimate) -> np.ndarray:
    """Standard deviations of forces, (n,), from their derivatives with respect to the parameters, (n, p)."""
    return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", jacobian, estimate.covariance, jacobian)))


def sampled_band(
    case: Case,
    response: Response,
    estimate: Estimate,
    level: float = 0.95,
    samples: int = 200,
    seed: int = 0,
    workers: int | None = None,
    report_progress: Callable[[float], None] = lambda fraction: None,
) -> Band:
    """Band by Monte Carlo.

    Parameters
    ----------
    case : Case
    response : response of the case at the estimate
    estimate : Estimate
        Estimated parameters; their names are paths of the case.
    level : -
        Confidence level.
    samples : int
    seed : int
    workers : int, optional
        Number of processes, by default one per core. The random samples do not depend on the number of processes.
    report_progress : callable
        Called with the completed fraction of the work.

    Raises
    ------
    FsmError
        Fewer than nine samples in ten could be solved.
    """
    draws = _draw_parameters(estimate, samples, np.random.default_rng(seed))
    jobs = [(case, response.travel, estimate.names, draw) for draw in draws]
    forces: list[np.ndarray | None] = [None] * samples
    for done, outcome in enumerate(run_jobs(_solve_sample, jobs, workers or os.cpu_count() or 1), 1):
        forces[outcome.job] = outcome.value
        report_progress(done / samples)
    solved = np.array([force for force in forces if force is not None])
    failed = samples - len(solved)
    if len(solved) < 0.9 * samples:
        text = f"{failed} of {samples} Monte Carlo samples could not be solved (at most one in ten may fail): the estimate"
        raise FsmError(f"{text} is too uncertain; add tests or a prior, or set samples = 0 for a linear band")
    edges = [0.5 - 0.5 * level, 0.5 + 0.5 * level]
    low, high = np.quantile(solved, edges, axis=0)
    peaks = [peak_of(Response(response.travel, force)).force for force in solved]
    peak = peak_of(response).force
    bounds = np.quantile(peaks, edges)
    return Band(response.travel, response.force, low, high, (peak, float(bounds[0]), float(bounds[1])), samples, failed)


def _draw_parameters(estimate: Estimate, samples: int, generator: np.random.Generator) -> np.ndarray:
    """Random parameters from an estimate, (samples, p)."""
    values = estimate.values
    positive = values > 0.0
    scale = np.where(positive, values, 1.0)
    start = np.where(positive, np.log(np.where(positive, values, 1.0)), values)
    drawn = generator.multivariate_normal(np.zeros(len(values)), estimate.covariance / np.outer(scale, scale), size=samples)
    if estimate.freedom:  # Student's t
        drawn /= np.sqrt(generator.chisquare(estimate.freedom, size=(samples, 1)) / estimate.freedom)
    unknowns = start + drawn
    return np.where(positive, np.exp(np.where(positive, unknowns, 0.0)), unknowns)


def _solve_sample(job: tuple[Case, np.ndarray, Sequence[str], np.ndarray]) -> Any:
    """Forces of one sample; None if it cannot be solved."""
    case, travel, paths, values = job
    try:
        return force_response(with_values(case, dict(zip(paths, values.tolist(), strict=True))), travel).force
    except CaseError:
        raise
    except FsmError:
        return None
