"""What the uncertainty of parameters makes of a force-displacement curve: a band, and an interval of its peak.

Linear: the variance of the force is J C J^T, with J = dF/dp at the estimate. Monte Carlo: the case is solved with parameters
drawn from the estimate, on several processes, and the band lies between quantiles at every travel. A parameter
that is positive is drawn by its logarithm, so that it stays so.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import norm

from fsm.calibrate.parameters import with_values
from fsm.calibrate.respond import Response, peak_of, respond
from fsm.calibrate.uncertainty import Estimate
from fsm.errors import CaseError, FsmError
from fsm.pool import run_jobs
from fsm.scene.case import Case

__all__ = ["Band", "linear_band", "sampled_band", "widened"]


@dataclass(frozen=True)
class Band:
    """A force with its band.

    Attributes
    ----------
    travel, force, low, high : (n,) arrays, m and N
    peak : (value, low, high), N
    samples : int
        Curves it was drawn from; 0 of a linear one.
    lost : int
        Draws that could not be solved.
    """

    travel: np.ndarray
    force: np.ndarray
    low: np.ndarray
    high: np.ndarray
    peak: tuple[float, float, float]
    samples: int = 0
    lost: int = 0


def linear_band(response: Response, estimate: Estimate, level: float = 0.95) -> Band:
    """Band by sensitivities.

    Parameters
    ----------
    response : Response
        At the estimate, with derivatives by its parameters, in their order.
    estimate : Estimate
    level : -
    """
    assert response.jacobian is not None
    reach = estimate.quantile(level) * _spread(response.jacobian, estimate)
    peak = peak_of(response)
    assert peak.gradient is not None
    off = estimate.quantile(level) * float(_spread(peak.gradient[None], estimate)[0])
    return Band(
        response.travel, response.force, response.force - reach, response.force + reach,
        (peak.force, peak.force - off, peak.force + off),
    )  # fmt: skip


def widened(band: Band, deviation: np.ndarray, level: float = 0.95) -> Band:
    """The band of what a test would measure: independent deviations (n,), N, are added in quadrature, on either side."""
    reach = norm.ppf(0.5 + 0.5 * level) * deviation
    value, low, high = band.peak
    there = float(np.interp(band.travel[int(np.argmax(band.force))], band.travel, reach))
    return replace(
        band,
        low=band.force - np.hypot(band.force - band.low, reach),
        high=band.force + np.hypot(band.high - band.force, reach),
        peak=(value, value - float(np.hypot(value - low, there)), value + float(np.hypot(high - value, there))),
    )


def _spread(jacobian: np.ndarray, estimate: Estimate) -> np.ndarray:
    """Standard deviations of forces, (n,)."""
    return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", jacobian, estimate.covariance, jacobian)))


def sampled_band(
    case: Case,
    response: Response,
    estimate: Estimate,
    level: float = 0.95,
    samples: int = 200,
    seed: int = 0,
    workers: int | None = None,
    tell: Callable[[float], None] = lambda fraction: None,
) -> Band:
    """Band by Monte Carlo.

    Parameters
    ----------
    case : Case
    response : of the case at the estimate
    estimate : Estimate
        Its names are paths of the case.
    level : -
    samples : int
    seed : int
    workers : int, optional
        Processes; one a core if absent. The draws do not depend on it.
    tell : callable
        Called with the fraction done.

    Raises
    ------
    FsmError
        Fewer than nine draws in ten could be solved.
    """
    draws = _drawn(estimate, samples, np.random.default_rng(seed))
    jobs = [(case, response.travel, estimate.names, draw) for draw in draws]
    forces: list[np.ndarray | None] = [None] * samples
    for done, outcome in enumerate(run_jobs(_solved, jobs, workers or os.cpu_count() or 1), 1):
        forces[outcome.job] = outcome.value
        tell(done / samples)
    kept = np.array([force for force in forces if force is not None])
    if len(kept) < 0.9 * samples:
        raise FsmError(f"{samples - len(kept)} of {samples} draws could not be solved: the estimate is too uncertain")
    edges = [0.5 - 0.5 * level, 0.5 + 0.5 * level]
    low, high = np.quantile(kept, edges, axis=0)
    peaks = [peak_of(Response(response.travel, force)).force for force in kept]
    peak = peak_of(response).force
    bounds = np.quantile(peaks, edges)
    return Band(
        response.travel, response.force, low, high, (peak, float(bounds[0]), float(bounds[1])), samples, samples - len(kept)
    )


def _drawn(estimate: Estimate, samples: int, generator: np.random.Generator) -> np.ndarray:
    """Parameters drawn from an estimate, (samples, p)."""
    values = estimate.values
    positive = values > 0.0
    scale = np.where(positive, values, 1.0)
    start = np.where(positive, np.log(np.where(positive, values, 1.0)), values)
    drawn = generator.multivariate_normal(np.zeros(len(values)), estimate.covariance / np.outer(scale, scale), size=samples)
    if estimate.freedom:  # Student's t
        drawn /= np.sqrt(generator.chisquare(estimate.freedom, size=(samples, 1)) / estimate.freedom)
    unknowns = start + drawn
    return np.where(positive, np.exp(np.where(positive, unknowns, 0.0)), unknowns)


def _solved(job: tuple[Case, np.ndarray, Sequence[str], np.ndarray]) -> Any:
    """Forces of one draw; nothing where it cannot be solved."""
    case, travel, paths, values = job
    try:
        return respond(with_values(case, dict(zip(paths, values.tolist(), strict=True))), travel).force
    except CaseError:
        raise
    except FsmError:
        return None
