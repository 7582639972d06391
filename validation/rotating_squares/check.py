"""Rotating squares: forces compared with another program, hinges calibrated on two tests, gradients compared with complete
solves.

    python -m validation.rotating_squares.check [--parts forces fit gradients]

Exit code 1 means that a bound is not met. `python -m validation.rotating_squares.report` shows the parameters that affect
the prediction of shear.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fsm.calibrate.force import read_tests
from fsm.calibrate.identify import identify
from fsm.calibrate.response import force_response, peak_of, peak_response
from fsm.calibrate.study import read_study, value_at, with_values
from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case
from fsm.views.plots.style import COLOURS, WIDE, figure
from validation.gallery.command import command
from validation.gallery.drawing import bars, beside
from validation.gallery.record import Check, NotCompared, Part, Place, against, below
from validation.rotating_squares.dense import Squares, beams, springs

HERE = Path(__file__).parent
FOLDER = HERE.parents[1] / "folding_cases" / "rotating_squares"
STUDY = FOLDER / "calibration.toml"
STRIP = HERE.parents[1] / "folding_cases" / "strip_trial" / "case.toml"
SHEAR = ("drive.0.direction=[1, 0, 0]", "drive.0.travel=3.75")
SOURCE = {"lattice.axial": 120.0e3, "lattice.shear": 1191.7, "lattice.rotational": 1.5046e-3}
"""The source's own fit, to all its tests, shear among them; compared with, not used."""
SHIMS = (3200.0, 0.127, 8.1, 0.64)
"""Young's modulus (N/mm^2), thickness, width and clamp (mm) of the hinges in shims.toml."""
MODELS = {
    "springs": ("case.toml", SOURCE, springs(120.0, 1.1917, 1.5046), 0.0),
    "beams": ("shims.toml", {}, beams(*SHIMS), 0.64),
}
"""Case, changed values, law and clamp (mm) of the dense program."""
LOADINGS = {
    "tension": ((0, 0, 1), [0.35, 0.70, 1.05]),
    "compression": ((0, 0, -1), [0.25, 1.75, 3.75]),
    "shear": ((1, 0, 0), [1.25, 2.5, 3.75]),
}
"""Direction and displacements (mm)."""
GRADIENTS = {
    "material.young": 1e-3,
    "crease.stiffness": 1e-3,
    # complete solves give the peak to 1e-9, up to 2e-5 of this change; twice the change would not be small
    "contact.stiffness": 0.02,
    "material.damping": 0.1,
    "strip.thickness": 1e-3,
    "strip.width": 1e-3,
    "strip.fold_angle": 3e-5,
    "strip.length": 3e-5,
}
"""Parameters of the derivatives of the peak of the trial strip, and relative step of the central difference."""
TRAVEL = np.arange(0.0, 37.01, 0.5) * 1e-3
TESTS = "bertoldi-collab/DifFlexMM (MIT), testing machine, digitised from the published plot"


def moved(file: str, values: dict[str, float], direction: tuple[int, ...], travel: float) -> Case:
    """Case of the sample with changed values, moved in a direction by a travel in mm."""
    changes = [f"drive.0.direction={list(direction)}", f"drive.0.travel={travel}"]
    return with_values(load_case(FOLDER / file, changes).case, values)


def forces(place: Place) -> Iterator[Check]:
    """Forces in three loadings, with springs of the source and with beams, compared with a dense program."""
    for model, (file, values, law, clamp) in MODELS.items():
        picture, curves, points = place.out / f"forces_{model}.png", {}, {}
        for name, (direction, travel) in LOADINGS.items():
            case = moved(file, values, direction, travel[-1])
            found = force_response(case, 1e-3 * np.array(travel)).force
            expected = Squares(law, clamp).forces((direction[0], direction[2]), travel)
            line = np.linspace(0.0, travel[-1], 26)
            curves[name] = (line, force_response(case, 1e-3 * line).force)
            points[f"{name}, dense program"] = (travel, expected)
            for at, value, number in zip(travel, found, expected, strict=True):
                yield against(
                    f"{model}: {name} at {at:g} mm",
                    "120 N/mm, 1.1917 N/mm, 1.5046 N mm/rad" if model == "springs" else "3.2 GPa, 0.127 mm, clamp 0.64 mm",
                    float(value),
                    float(number),
                    "validation/rotating_squares/dense.py",
                    picture,
                    rtol=1e-7,
                    unit="N",
                )
        beside(picture, curves, points, "displacement (mm)", "force (N)", size=(5.6, 3.8))


def fit(place: Place) -> Iterator[Check | NotCompared]:
    """Modulus and clamp of the hinges from tension and compression; check that the model lies in the band of both tests."""
    tests, parameters, priors = read_tests(read_study(STUDY), STUDY)
    found = identify(tests, parameters, priors, starts=3)
    picture = place.out / "fit.png"
    with figure(picture, WIDE) as fig:
        for ax, test, response, added in zip(fig.subplots(1, 2), tests, found.responses, found.added, strict=True):
            travel = 1e3 * test.travel
            ax.fill_between(
                travel,
                test.force - test.deviation,
                test.force + test.deviation,
                color="#666666",
                alpha=0.3,
                lw=0,
                label="band of the test",
            )
            ax.plot(travel, test.force, "o", ms=4, mfc="white", mec="black", label="test, mean")
            ax.plot(travel, response.force + added, color=COLOURS[0], label="fsm, with zero and drag")
            ax.plot(travel, response.force, "--", color=COLOURS[1], lw=1, label="fsm")
            ax.set(xlabel="displacement (mm)", ylabel="force (N)", title=test.name)
            ax.legend()
    for test, response, added in zip(tests, found.responses, found.added, strict=True):
        off = np.abs(response.force + added - test.force) / test.deviation
        bare = np.abs(response.force - test.force) / test.deviation
        where = ", ".join(f"{1e3 * s:.4g}" for s in test.travel[bare > 1.0])
        worst = int(np.argmax(off))
        yield below(
            f"{test.name}: worst point, in half bands",
            f"{len(off)} points",
            float(off[worst]),
            1.0,
            TESTS,
            picture,
            detail=f"at {1e3 * test.travel[worst]:.4g} mm; without zero and drag {np.sum(bare > 1.0)} points outside "
            f"({where or '-'} mm)",
        )
    yield NotCompared(
        "shear: 1.403 N (1.057 to 1.668) at 3.75 mm, predicted",
        TESTS,
        "the test in shear is not in the project; the prediction is kept in shear_prediction.csv to be judged",
    )


def gradients(place: Place) -> Iterator[Check]:
    """Gradient of the peak force of the trial strip by implicit differentiation, compared with complete solves."""
    case = load_case(STRIP, ["solve.rtol=1e-6"]).case
    peak = peak_response(case, TRAVEL, list(GRADIENTS))
    assert peak.gradient is not None
    picture, rows = place.out / "gradients.png", []
    for slope, (path, part) in zip(peak.gradient, GRADIENTS.items(), strict=True):
        wanted, value = _difference(case, TRAVEL, path, part), slope * value_at(case, path)
        rows.append((path, value, wanted))
        yield against(
            f"d(peak)/d(log {path})",
            f"peak {peak.force:.5f} N",
            float(value),
            wanted,
            "central differences of whole solves, two sizes",
            picture,
            atol=1e-5 * abs(wanted),
            unit="N",
        )
    names = [
        path.split(".")[1].replace("_", "\n") if "stiffness" not in path else path.replace(".", "\n") for path, *_ in rows
    ]
    bars(picture, names, [r[1] for r in rows], [r[2] for r in rows], "d(peak)/d(log p) (N)", size=(7.6, 3.6))


def _difference(case: Case, travel: np.ndarray, path: str, part: float) -> float:
    """d(peak)/d(log p) by central differences of two sizes and Richardson's step."""
    value, steps = value_at(case, path), []
    for size in (part, 0.5 * part):
        ends = [with_values(case, {path: value * (1.0 + sign * size)}) for sign in (1.0, -1.0)]
        more, less = (peak_of(force_response(end, travel)).force for end in ends)
        steps.append((more - less) / (2.0 * size))
    return (4.0 * steps[1] - steps[0]) / 3.0


TITLE = "Rotating squares: a measured sample"
PARTS: dict[str, Part] = {"forces": forces, "fit": fit, "gradients": gradients}

if __name__ == "__main__":
    sys.exit(command(PARTS, "rotating_squares", __doc__))
