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
from fsm.calibrate.force import calibrate_force, read_tests
from fsm.calibrate.identify import ForceTest, Identification, Parameter, Prior, identify
from fsm.calibrate.report import Calibration, Options, table_lines, write_calibration
from fsm.calibrate.response import force_response, peak_response
from fsm.calibrate.study import read_study, with_values
from fsm.calibrate.uncertainty import Estimate
from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_case import path_settings
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.statics.static import follow
from validation.rotating_squares.check import FOLDER, GRADIENTS, HERE, SHEAR, STRIP, STUDY, TRAVEL
from validation.rotating_squares.dense import Squares, beams

UNITS = np.array([1e-9, 1e3])
"""Pa and m as GPa and mm."""


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
    whole = identify(tests, parameters, priors, starts=3)
    print(f"\ntwo parameters on two curves, three starts, warm: {time.perf_counter() - begun:.1f} s")
    _choices(tests, parameters, priors)
    _left_out(tests, parameters, priors)
    _height(whole)
    _gaps(found)
    _cost()
    return 0


def _choices(tests: list[ForceTest], parameters: list[Parameter], priors: list[Prior]) -> None:
    """Predictions with other assumptions at the end of the shear travel."""
    print("\n| choice | modulus, GPa | clamp, mm | shear l^2/rotational | sum of squares | force at 3.75 mm, N |")
    print("|---|---|---|---|---|---|")

    def row(label: str, found: Identification, **values: float) -> None:
        own = _own(found.estimate)
        force = _shear_end(own, **values)
        young, clamp = own.values * UNITS
        ratio = 12.0 * (2.25 / (2.25 + 2.0 * clamp)) ** 2
        shown = (
            f"{young:.3g} | {clamp:.3g} | {ratio:.3g} | {found.cost:.3g} | {force:.3f}"
        )
        print(f"| {label} | {shown} |")

    def changed(**values: float) -> list[ForceTest]:
        return [replace(t, case=with_values(t.case, values)) for t in tests]

    row("as in the study", identify(tests, parameters, priors))
    row("no drag", identify([replace(t, drag=0.0) for t in tests], parameters, priors))
    row("no drag, no zero", identify([replace(t, drag=0.0, zero=0.0) for t in tests], parameters, priors))
    row("separate scatter of each point", identify([replace(t, correlation_length=0.0) for t in tests], parameters, priors))
    narrow = [replace(t, deviation=t.deviation / np.sqrt(3.0)) for t in tests]
    row("scatter of the mean of three samples", identify(narrow, parameters, priors))
    for young in (3e9, 4e9, 5e9):
        row(f"modulus {1e-9 * young:g} GPa", identify(tests, parameters, [Prior("lattice.hinge_young", None, young, 1e-3)]))
    row("no prior", identify(tests, parameters, []))
    for angle in (19.0, 21.0):
        case = {"lattice.angle": np.deg2rad(angle)}
        row(f"squares rotated by {angle:g} degrees", identify(changed(**case), parameters, priors), **case)


def _own(estimate: Estimate) -> Estimate:
    return replace(estimate, names=estimate.names[:2], values=estimate.values[:2], covariance=estimate.covariance[:2, :2])


def _shear(values: dict[str, float]) -> Case:
    return with_values(load_case(FOLDER / "shims.toml", SHEAR).case, values)


def _shear_end(estimate: Estimate, **values: float) -> float:
    """Force at 3.75 mm."""
    case = _shear({**dict(zip(estimate.names, estimate.values.tolist(), strict=True)), **values})
    return float(force_response(case, np.linspace(0.0, 3.75e-3, 6)).force[-1])


def _left_out(tests: list[ForceTest], parameters: list[Parameter], priors: list[Prior]) -> None:
    """Each test predicted from the other one."""
    print("\n| fit to | modulus, GPa | clamp, mm | error of the other test (rms), % | force at 3.75 mm, N |")
    print("|---|---|---|---|---|")
    for test, other in (tests, tests[::-1]):
        found = identify([test], parameters, priors)
        own = _own(found.estimate)
        values = dict(zip(own.names, own.values.tolist(), strict=True))
        force = force_response(with_values(other.case, values), other.travel).force
        error = 100.0 * np.sqrt(np.mean((force - other.force) ** 2) / np.mean(other.force**2))
        young, clamp = own.values * UNITS
        print(f"| {test.name} | {young:.3g} | {clamp:.3g} | {error:.3g} | {_shear_end(own):.3f} |")


def _height(found: Identification) -> None:
    """Shear force with the top row at constant height, and free to move normal to the rows; error of the cubic."""
    young, clamp = found.estimate.values[:2] * np.array([1e-6, 1e3])
    travel = [1.25, 2.5, 3.75]
    print("\n| top row | " + " | ".join(f"{at:g} mm, N" for at in travel) + " |")
    print("|---|---|---|---|")
    for label, terms, free in (
        ("constant height", 1, False),
        ("constant height, further shape", 2, False),
        ("free", 1, True),
    ):
        law = beams(young, 0.127, 8.1, clamp, terms=terms)
        shown = " | ".join(f"{force:.4f}" for force in Squares(law, clamp, free).forces((1.0, 0.0), travel))
        print(f"| {label} | {shown} |")


def _gaps(found: Calibration) -> None:
    """Smallest distance between a corner and another square, without hinges, in all three loadings."""
    print("\n| loading | smallest gap, hinges aside, mm | at the start |")
    print("|---|---|---|")
    quantities = {one.name: one.value for one in found.quantities if one.name.startswith("lattice.")}
    study = read_study(STUDY)
    for name, changes in (*((curve.name, curve.set) for curve in study.curve), ("shear", SHEAR)):
        case = with_values(load_case(FOLDER / "shims.toml", changes).case, quantities)
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
