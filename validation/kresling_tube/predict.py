"""Modulus and settling travel from the tubes of one shape, and the forces of tubes of other shapes with a band."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from validation.kresling_tube.measured import compressions
from validation.kresling_tube.tube import MESH, YOUNG, force, wall_thickness

__all__ = ["CALIBRATED", "TRAVEL", "Fit", "Prediction", "calibrate", "fitted", "predict", "response"]

CALIBRATED = 0.75
TRAVEL = np.linspace(0.0, 21e-3, 85)
"""Travels of a prediction, m. Beyond, the measured forces rise; the model has no contact of the walls."""
SAMPLES, SEED = 400, 24
PRINT_ERROR = 0.1e-3
"""Largest error of the thickness of a print, m; tubes of a shape have the same."""
MODEL = 0.05
"""Error of the force due to mesh, supports and folds, relative to the force (README.md): standard deviation."""
_THICKER = 1.15
"""Factor on the thickness of a second run, from which the power of the thickness follows."""
_LATE = np.linspace(0.0, 2e-3, 81)
"""Travels at which a tube may begin to carry load, m."""


@dataclass(frozen=True)
class Fit:
    """Tubes of a shape.

    Attributes
    ----------
    young : Young's modulus, Pa
    late : travel at which a tube carries load, m; before, it settles between the plates
    residual : root mean square of the residual over the largest measured force
    """

    young: float
    late: float
    residual: float


@dataclass(frozen=True)
class Prediction:
    """Forces at the travels `TRAVEL`, N: with the fit to the mean of the calibrated tubes, and 95 % band."""

    force: np.ndarray
    low: np.ndarray
    high: np.ndarray


@cache
def response(folder: Path, ratio: float, thickness: float, mesh: float = MESH) -> CubicSpline:
    """Force over Young's modulus, m^2, as a function of the travel, m, from a run in `folder`; zero before."""
    run = force(folder / f"{ratio}_{1e3 * thickness:.4f}_{1e3 * mesh:g}", ratio, thickness, TRAVEL, mesh=mesh) / YOUNG
    return CubicSpline(TRAVEL, run)


def fitted(curve: CubicSpline, travel: np.ndarray, measured: np.ndarray) -> Fit:
    """Least squares of modulus and settling travel to measured forces (n,), N, at travels (n,), m."""
    fits = []
    for late in _LATE:
        shape = curve(np.maximum(travel - late, 0.0))
        young = float(shape @ measured / (shape @ shape))
        residual = float(np.sqrt(np.mean((young * shape - measured) ** 2)) / measured.max())
        fits.append(Fit(young, float(late), residual))
    return min(fits, key=lambda fit: fit.residual)


def calibrate(folder: Path, measured: np.ndarray, mesh: float = MESH) -> Fit:
    """Fit to forces (n,), N, of tubes with the ratio `CALIBRATED`."""
    return fitted(response(folder, CALIBRATED, wall_thickness(CALIBRATED), mesh), compressions(CALIBRATED)[0], measured)


def predict(folder: Path, ratio: float) -> Prediction:
    """Forces of tubes of a ratio.

    The band has the scatter of the calibrated tubes, the errors of the thickness of both prints and of the model, and the
    residual of the fit.
    """
    tests = compressions(CALIBRATED)[1]
    mean = calibrate(folder, tests.mean(axis=0))
    fits = [calibrate(folder, test) for test in tests]
    own, other = wall_thickness(ratio), wall_thickness(CALIBRATED)
    error = 0.0 if ratio == CALIBRATED else PRINT_ERROR
    curves = [(response(folder, r, t), response(folder, r, _THICKER * t)) for r, t in ((ratio, own), (CALIBRATED, other))]
    nominal = _force(curves[0][0], mean, TRAVEL)
    powers = [np.log(thick(TRAVEL[1:]) / thin(TRAVEL[1:])) / np.log(_THICKER) for thin, thick in curves]
    random = np.random.default_rng(SEED)
    samples = []
    for _ in range(SAMPLES):
        here, there = 1.0 + random.uniform(-error, error, 2) / (own, other)
        factor = (1.0 + random.normal(0.0, MODEL)) * here ** np.median(powers[0]) / there ** np.median(powers[1])
        samples.append(factor * _force(curves[0][0], fits[random.integers(len(fits))], TRAVEL))
    low, high = np.quantile(samples, (0.025, 0.975), axis=0)
    misfit = 2.0 * mean.residual * nominal.max()
    return Prediction(nominal, low - misfit, high + misfit)


def _force(curve: CubicSpline, fit: Fit, travel: np.ndarray) -> np.ndarray:
    return np.asarray(fit.young * curve(np.maximum(travel - fit.late, 0.0)))
