"""Two stiffnesses from the tubes of one shape, and the forces of tubes of other shapes with a band."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from validation.kresling_tube.measured import compressions
from validation.kresling_tube.tube import force, preset, wall_thickness

__all__ = ["CALIBRATED", "SAMPLES", "SEED", "TRAVEL", "Fit", "Prediction", "calibrate", "predict", "response"]

CALIBRATED = 0.75
TRAVEL = np.linspace(0.0, 21e-3, 85)
"""Travels of a prediction, m. Beyond, the measured forces rise; the model has no contact of the walls."""
SAMPLES, SEED = 400, 24
PRINT_ERROR = 0.1e-3
"""Largest error of the thickness of a print, m; tubes of a shape have the same."""
_YOUNG = 10e6
_CREASES = np.geomspace(2.0, 18.0, 7)
"""Stiffness of creases over the preset, of the runs between which forces are interpolated."""
_GRID = 2001


@dataclass(frozen=True)
class Fit:
    """Stiffness of the calibrated tubes.

    Attributes
    ----------
    membrane : Young's modulus times thickness, N/m
    crease : N m/rad per m
    residual : root mean square of the residual over the largest measured force
    """

    membrane: float
    crease: float
    residual: float


@dataclass(frozen=True)
class Prediction:
    """Forces at the travels `TRAVEL`, N: with the fit to the mean of the calibrated tubes, and 95 % band."""

    force: np.ndarray
    low: np.ndarray
    high: np.ndarray


@cache
def response(folder: Path, ratio: float) -> CubicSpline:
    """Force at `TRAVEL` per membrane stiffness E t, m, as a function of log(crease stiffness/(E t)), from runs in `folder`.

    All stiffness of the model is in proportion to E t or to the crease stiffness, so one parameter is left.
    """
    thickness = wall_thickness(ratio)
    membrane = _YOUNG * thickness
    creases = _CREASES * preset(ratio, _YOUNG, thickness)
    runs = [
        force(folder / f"{ratio}_{number}", ratio, _YOUNG, thickness, float(crease), TRAVEL) / membrane
        for number, crease in enumerate(creases)
    ]
    return CubicSpline(np.log(creases / membrane), np.array(runs))


def calibrate(folder: Path, measured: np.ndarray) -> Fit:
    """Least squares of E t and crease stiffness to forces (n,) of tubes with the ratio `CALIBRATED`."""
    curve = response(folder, CALIBRATED)
    logs = np.linspace(curve.x[0], curve.x[-1], _GRID)
    travel = compressions(CALIBRATED)[0]
    shapes = np.array([np.interp(travel, TRAVEL, shape) for shape in curve(logs)])
    scales = shapes @ measured / np.einsum("ij,ij->i", shapes, shapes)
    residuals = np.sqrt(np.mean((scales[:, None] * shapes - measured) ** 2, axis=1))
    best = int(np.argmin(residuals))
    membrane = float(scales[best])
    return Fit(membrane, float(np.exp(logs[best])) * membrane, float(residuals[best] / measured.max()))


def predict(folder: Path, ratio: float) -> Prediction:
    """Forces of tubes of a ratio.

    The band has the scatter of the calibrated tubes, the error of the thickness of prints of different shapes, the scatter
    of the travel at which a tube begins to carry load, and the residual of the fit.
    """
    known, tests = compressions(CALIBRATED)
    late = float(np.std([np.interp(0.5 * test.max(), test[:5], known[:5]) for test in tests], ddof=1))
    error = 0.0 if ratio == CALIBRATED else PRINT_ERROR
    mean = calibrate(folder, tests.mean(axis=0))
    fits = [calibrate(folder, test) for test in tests]
    nominal = _forces(folder, ratio, mean, wall_thickness(ratio) / wall_thickness(CALIBRATED))
    random = np.random.default_rng(SEED)
    samples = []
    for _ in range(SAMPLES):
        here, there = random.uniform(-error, error, 2)
        thinner = (wall_thickness(ratio) + here) / (wall_thickness(CALIBRATED) + there)
        forces = _forces(folder, ratio, fits[random.integers(len(fits))], float(thinner))
        samples.append(np.interp(TRAVEL - random.normal(0.0, late), TRAVEL, forces))
    low, high = np.quantile(samples, (0.025, 0.975), axis=0)
    misfit = 2.0 * mean.residual * nominal.max()
    return Prediction(nominal, low - misfit, high + misfit)


def _forces(folder: Path, ratio: float, fit: Fit, thinner: float) -> np.ndarray:
    """Forces of a tube of `thinner` times the thickness: E t is linear in t, creases are as t^(8/3), as in the preset."""
    membrane, crease = fit.membrane * thinner, fit.crease * thinner ** (8.0 / 3.0)
    return np.asarray(membrane * response(folder, ratio)(np.log(crease / membrane)))
