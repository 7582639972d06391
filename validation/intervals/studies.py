"""Coverage of the intervals and bands of `fsm calibrate force`, over synthetic studies.

    python -m validation.intervals [--studies 200] [--seed 1] [--workers 2]

Each study has its own seed: a folded strip of four panels, pulled at two fold angles, with three to six complete repeats of
each test. Each repeat has its own bending stiffness and crease stiffness (scatter 1.5 % each), force scale and zero of the
load cell (1 % and 0.5 % of the peak), and noise (0.3 % of the peak). Half of the studies have creases that soften or stiffen
by up to 30 % per radian, but are fitted with linear creases, so the model has the wrong form. In this case the stiffness of
the crease has no true value, and only the force is compared.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fsm.calibrate.band import linear_band, widen_band
from fsm.calibrate.data import MeasuredTable
from fsm.calibrate.force import force_test, relative_misfit
from fsm.calibrate.identify import ForceTest, Parameter, identify
from fsm.calibrate.response import force_response
from fsm.calibrate.study import MeasuredCurve, with_values
from fsm.calibrate.uncertainty import Estimate
from fsm.case.models.case import Case
from fsm.run.workers import run_jobs

LEVEL = 0.95
YOUNG, CREASE = 3e9, 0.02
TESTED, PREDICTED = ("70 deg", "80 deg"), "75 deg"
POINTS = 15
TRAVEL = 0.02


@dataclass(frozen=True)
class Covered:
    """True values of a study that are inside their intervals: parameters, fractions of both curves (fit, prediction),
    peak."""

    parameters: tuple[bool, ...]
    fitted: float
    predicted: float
    peak: bool


def strip(angle: str, crease: dict[str, object]) -> Case:
    """A strip of four panels with the first held, pulled straight at its third crease."""
    return Case.model_validate({
        "strip": {"length": 0.16, "width": 0.04, "thickness": 2e-4, "panels": 4, "fold_angle": angle, "held": [1],
                  "segments_per_panel": 3},
        "material": {"young": YOUNG, "density": 800.0},
        "crease": crease,
        "drive": [{"crease": 3, "direction": [1, 0, 0], "speed": 2e-3, "travel": TRAVEL}],
        "solve": {"method": "static", "rtol": 1e-5},
    })  # fmt: skip


def linear() -> dict[str, object]:
    """The crease of the model."""
    return {"law": "linear", "stiffness": CREASE}


def curved(part: float) -> dict[str, object]:
    """A crease whose stiffness changes by `part` over one radian."""
    angle = np.linspace(-1.5, 1.5, 31)
    moment = CREASE * (angle + 0.5 * part * angle * np.abs(angle))
    return {"law": "spline", "angle": angle.tolist(), "moment": moment.tolist()}


def study(seed: tuple[int, int]) -> Covered:
    """Draw one study, calibrate, and compare with the truth."""
    generator = np.random.default_rng(seed)
    wrong = bool(seed[1] % 2)
    part = float(generator.uniform(-0.3, 0.3)) if wrong else 0.0
    crease = curved(part) if wrong else linear()
    at = np.linspace(0.0, TRAVEL, POINTS + 1)[1:]
    scale = "crease.scale" if wrong else "crease.stiffness"
    size = 1.0 if wrong else CREASE
    paths = ["material.young", scale]
    tests: list[ForceTest] = []
    for angle in TESTED:
        truth = force_response(strip(angle, crease), at, paths)
        assert truth.jacobian is not None
        peak = float(np.abs(truth.force).max())
        repeats = int(generator.integers(3, 7))
        own = 0.015 * generator.normal(size=(repeats, 2)) * np.array([YOUNG, size])
        curves = truth.force + own @ truth.jacobian.T
        curves *= 1.0 + 0.01 * generator.normal(size=(repeats, 1))
        curves += 0.005 * peak * generator.normal(size=(repeats, 1)) + 0.003 * peak * generator.normal(size=curves.shape)
        numbers = np.repeat(np.arange(1.0, repeats + 1), len(at))
        columns = {"displacement": np.tile(at, repeats), "force": curves.ravel(), "repeat": numbers}
        table = MeasuredTable(columns, np.arange(curves.size) + 2, angle)
        tests.append(force_test(MeasuredCurve(name=angle, data=Path("none")), strip(angle, linear()), table))
    unknown = [Parameter("material.young", 0.3 * YOUNG, 3.0 * YOUNG, 1.2 * YOUNG),
               Parameter("crease.stiffness", 0.3 * CREASE, 3.0 * CREASE, 0.8 * CREASE)]  # fmt: skip
    found = identify(tests, unknown)
    estimate = found.estimate
    low, high = estimate.interval(LEVEL).T
    inside = tuple(bool(a <= b <= c) for a, b, c in zip(low, (YOUNG, CREASE), high, strict=True))
    fitted = []
    for angle, response, misfit in zip(TESTED, found.responses, found.discrepancy.tolist(), strict=True):
        band = widen_band(linear_band(response, estimate, LEVEL), np.full(len(at), misfit), LEVEL)
        force = force_response(strip(angle, crease), at).force
        fitted.append(np.mean((band.low <= force) & (force <= band.high)))
    predicted, peak = _predicted(estimate, relative_misfit(tests, found), at, crease)
    return Covered(() if wrong else inside, float(np.mean(fitted)), predicted, peak)


def _predicted(estimate: Estimate, misfit: float, at: np.ndarray, crease: dict[str, object]) -> tuple[float, bool]:
    """Fraction of the predicted curve whose band contains the true curve, and whether the interval of the peak contains the
    true peak."""
    values = dict(zip(estimate.names, estimate.values.tolist(), strict=True))
    response = force_response(with_values(strip(PREDICTED, linear()), values), at, list(estimate.names))
    band = linear_band(response, estimate, LEVEL)
    band = widen_band(band, np.full(len(at), misfit * math.sqrt(np.mean(response.force**2))), LEVEL)
    force = force_response(strip(PREDICTED, crease), at).force
    inside = np.mean((band.low <= force) & (force <= band.high))
    return float(inside), bool(band.peak[1] <= force.max() <= band.peak[2])


def main() -> None:
    """Run the studies and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--studies", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    jobs = [(given.seed, number) for number in range(given.studies)]
    found: dict[int, Covered] = {}
    for outcome in run_jobs(study, jobs, given.workers):
        if outcome.error:
            raise SystemExit(f"study {outcome.job}: {'; '.join(outcome.error)}\n{outcome.trace}")
        found[outcome.job] = outcome.value
    print("| form of the model | studies | parameters | fitted curves | predicted curve | predicted peak |")
    print("|---|---|---|---|---|---|")
    for name, remainder in (("right", 0), ("wrong", 1)):
        some = [found[number] for number in sorted(found) if number % 2 == remainder]
        parameters = [np.mean(one.parameters) for one in some if one.parameters]
        cells = [f"{100 * np.mean(parameters):.1f} %" if parameters else "-"]
        cells += [f"{100 * np.mean([getattr(one, key) for one in some]):.1f} %" for key in ("fitted", "predicted", "peak")]
        print(f"| {name} | {len(some)} | " + " | ".join(cells) + " |")
