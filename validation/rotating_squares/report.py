"""Tables for the README: parameters that affect the prediction of shear, smallest gaps of squares, time of gradients.

    python -m validation.rotating_squares.report [--out out/validation/rotating_squares] [--write]

--write writes the prediction to validation/rotating_squares/shear_prediction.csv.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from fsm.builders.scene import build_scene
from fsm.calibrate.band import linear_band
from fsm.calibrate.force import calibrate_force, read_tests
from fsm.calibrate.identify import ForceTest, Identification, Parameter, Prior, identify
from fsm.calibrate.parameters import value_at, with_values
from fsm.calibrate.report import Calibration, Options, table_lines, write_calibration
from fsm.calibrate.response import force_response, peak_response
from fsm.calibrate.study import read_study
from fsm.calibrate.uncertainty import Estimate
from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_case import path_settings
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.statics.static import follow
from validation.rotating_squares.check import FOLDER, GRADIENTS, HERE, SHEAR, SOURCE, STRIP, STUDY, TRAVEL

UNITS = np.array([1e-3, 1e-3, 1e3])
"""N/m, N/m, N m/rad as N/mm, N/mm, N mm/rad."""


def main() -> int:
    """Run all parts, print them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/validation/rotating_squares"))
    parser.add_argument("--write", action="store_true", help="put the prediction beside this file")
    options = parser.parse_args()
    chosen = Options()
    found = calibrate_force(STUDY, chosen)
    write_calibration(found, options.out, chosen)
    print("\n".join(table_lines(found, chosen)))
    if options.write:
        shutil.copy(options.out / "prediction.csv", HERE / "shear_prediction.csv")
    tests, parameters, priors = read_tests(read_study(STUDY), STUDY)
    begun = time.perf_counter()
    identify(tests, parameters, priors, starts=3)
    print(f"\nthree parameters on two curves, three starts, warm: {time.perf_counter() - begun:.1f} s")
    _choices(tests, parameters, priors)
    _gaps(found)
    _cost()
    return 0


def _choices(tests: list[ForceTest], parameters: list[Parameter], priors: list[Prior]) -> None:
    """Predictions with other assumptions at the end of the shear travel."""
    print("\n| choice | axial, N/mm | shear, N/mm | rotational, N mm/rad | shear l^2/rotational | force at 3.75 mm, N |")
    print("|---|---|---|---|---|---|")
    length = value_at(tests[0].case, "lattice.hinge_length")
    wide = [replace(p, upper=10.0 * p.upper) for p in parameters]

    def row(label: str, found: Identification) -> None:
        own = _own(found.estimate)
        band = _shear_end(own)
        k = own.values * UNITS
        ratio = own.values[1] * length**2 / own.values[2]
        shown = f"{k[0]:.4g} | {k[1]:.4g} | {k[2]:.3g} | {ratio:.3g} | {band[0]:.3f} ({band[1]:.3f} to {band[2]:.3f})"
        print(f"| {label} | {shown} |")

    row("as in the study", identify(tests, parameters, priors))
    row("no drag", identify([replace(t, drag=0.0) for t in tests], parameters, priors))
    row("no drag, no zero", identify([replace(t, drag=0.0, zero=0.0) for t in tests], parameters, priors))
    row("scatter of each point its own", identify([replace(t, correlation_length=0.0) for t in tests], parameters, priors))
    narrow = [replace(t, deviation=t.deviation / 1.96) for t in tests]
    row("half band as 95 %", identify(narrow, parameters, priors))
    for ratio in (4.0, 6.93, 12.0):
        fixed = Prior("lattice.shear", "lattice.rotational", ratio / length**2, 1e-3)
        row(f"shear l^2/rotational = {ratio:g}", identify(tests, wide, [fixed]))
    row("no prior", identify(tests, wide, []))
    whole = Estimate(tuple(SOURCE), np.array(list(SOURCE.values())), np.zeros((3, 3)))
    end = _shear_end(whole)[0]
    print(f"| the source's own fit, to all its tests | 120 | 1.192 | 1.50 | 4.01 | {end:.3f} |")


def _own(estimate: Estimate) -> Estimate:
    return replace(estimate, names=estimate.names[:3], values=estimate.values[:3], covariance=estimate.covariance[:3, :3])


def _shear(values: dict[str, float]) -> Case:
    return with_values(load_case(FOLDER / "case.toml", SHEAR).case, values)


def _shear_end(estimate: Estimate) -> tuple[float, float, float]:
    """Force at 3.75 mm and its linear band."""
    case = _shear(dict(zip(estimate.names, estimate.values.tolist(), strict=True)))
    band = linear_band(force_response(case, np.linspace(0.0, 3.75e-3, 6), list(estimate.names)), estimate)
    return float(band.force[-1]), float(band.low[-1]), float(band.high[-1])


def _gaps(found: Calibration) -> None:
    """Smallest distance between a corner and another square, without hinges, in all three loadings."""
    print("\n| loading | smallest gap, hinges aside, mm | at the start |")
    print("|---|---|---|")
    quantities = {one.name: one.value for one in found.quantities if one.name.startswith("lattice.")}
    study = read_study(STUDY)
    for name, changes in (*((curve.name, curve.set) for curve in study.curve), ("shear", SHEAR)):
        case = with_values(load_case(FOLDER / "case.toml", changes).case, quantities)
        system = compile_scene(build_scene(case))
        motion = system.motions[0]
        times = [motion.time_of(s) for s in np.linspace(0.0, motion.travel, 6)[1:]]
        gaps = [_gap(system.place(0.0, system.initial()[0], None)[0], case)]
        kept: list[SavedState] = []
        follow(system, path_settings(case, system, times[-1]), times, kept.append)
        gaps += [_gap(system.place(saved.time, saved.q, None)[0], case) for saved in kept]
        print(f"| {name} | {1e3 * min(gaps):.3f} | {1e3 * gaps[0]:.3f} |")


def _gap(poses: np.ndarray, case: Case) -> float:
    """Smallest distance between a corner of a square and another square, without corners that hinges join."""
    assert case.lattice is not None
    lattice = case.lattice
    radius = (lattice.spacing - lattice.hinge_length) / (2.0 * np.cos(lattice.angle))
    angles = np.pi / 4 + np.pi / 2 * np.arange(4)
    turned = -poses[1:, 2, None] + angles
    corners = poses[1:, None, :2] + radius * np.stack([np.cos(turned), np.sin(turned)], axis=-1)
    least = np.inf
    for i, square in enumerate(corners):
        for j, other in enumerate(corners):
            apart = [abs(a - b) for a, b in zip(divmod(i, lattice.columns), divmod(j, lattice.columns), strict=True)]
            if i == j or max(apart) > 1:
                continue
            hinged = np.argmin(np.hypot(*(other - poses[1 + i, :2]).T)) if sum(apart) == 1 else -1
            for k, corner in enumerate(other):
                if k != hinged:
                    least = min(least, *(_distance(corner, a, b) for a, b in pairwise([*square, square[0]])))
    return float(least)


def _distance(point: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    part = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return float(np.hypot(*(point - a - part * (b - a))))


def _cost() -> None:
    """Time of the gradient of the peak relative to the time of the solve."""
    case = load_case(STRIP, ["solve.rtol=1e-6"]).case
    paths = list(GRADIENTS)
    works = (
        lambda: force_response(case, TRAVEL),
        lambda: peak_response(case, TRAVEL, paths[:2]),
        lambda: peak_response(case, TRAVEL, paths[:4]),
        lambda: peak_response(case, TRAVEL, paths),
    )
    # the runs alternate, so that other work on the machine affects all of them equally
    alone, *more = np.min([[_timed(work) for work in works] for _ in range(9)], axis=0)
    print(f"\nforward solve {alone:.3f} s of one core; with the gradient by")
    for count, seconds in zip((2, 4, 8), more, strict=True):
        print(f"- {count} of these parameters, in turn: {100 * (seconds / alone - 1):.0f} % more")


def _timed(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun


if __name__ == "__main__":
    sys.exit(main())
