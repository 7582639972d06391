"""Page of all kinds of figures, from results that this script computes.

    python docs/figures/draw.py [--keep FOLDER]

The script writes docs/figures.md and the pictures beside this file. `--keep` uses results in a folder again.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
WIDTH = 720
"""Largest width of a picture, pixels."""


class Shown(NamedTuple):
    """Picture of the page: its file, the file of the run, and the text below it."""

    name: str
    source: str
    text: str


RUNS: dict[str, list[str]] = {
    "strip": ["run", "strip_trial/case.toml", "--set", 'save.channels=["crease.*.angle", "crease.*.moment"]'],
    "spatial": ["run", "miura_push/case.toml"],
    "squares": ["run", "rotating_squares/case.toml"],
    "plates": ["run", "dropped_plates/case.toml"],
    "sail": ["run", "sail_on_cables/case.toml"],
    "held": ["run", "film_on_strip/case.toml"],
    "array": ["run", "scissor_array/case.toml"],
    "film": ["run", "membrane_impact/case.toml"],
    "tube": ["run", "kresling/case.toml"],
    "wing": ["run", "{data}/wing.toml"],
    "table": ["table", "strip_pull/table.csv"],
    "study": ["table", "membrane_impact/tension.csv"],
    "lattice": ["calibrate", "force", "rotating_squares/calibration.toml"],
    "hinge": ["calibrate", "crease", "{data}/hinge.csv"],
    "creep": ["calibrate", "relaxation", "{data}/creep.csv"],
    "panel": ["calibrate", "bending", "{data}/cantilever.csv"],
}
"""Commands of the runs; files are in folding_cases, or among the data that `measured` writes."""

SECTIONS: dict[str, list[Shown]] = {
    "Pull of a strip": [
        Shown(
            "force",
            "strip/force.png",
            "`force.png` shows the force over the travel, the peak, and the stages as shades of grey.",
        ),
        Shown(
            "motion",
            "strip/motion.png",
            "`motion.png` shows shapes of a plane motion; the titles contain travel, force and stage.",
        ),
        Shown(
            "energy",
            "strip/energy.png",
            "`energy.png` shows the energies since the start, the work, and the balance residual.",
        ),
        Shown("contact", "strip/contact.png", "`contact.png` shows the normal force and the contact area of every pair."),
        Shown("channels", "strip/channels.png", "`channels.png` shows recorded channels (`--channel PATTERN`)."),
        Shown("slide", "slide/force.png", "`--style slide` gives larger letters and thicker lines in the same size."),
    ],
    "Motion in space": [
        Shown("sheet", "spatial/motion.png", "A Miura sheet is pushed together; facets are drawn with their outlines."),
        Shown("sail", "sail/motion.png", "A film hangs on cables and a post."),
        Shown("held", "held/motion.png", "A strip holds a film: it is pulled, and then the film is struck."),
        Shown("tube", "tube/motion.png", "A Kresling tube is pressed flat."),
        Shown(
            "load",
            "tube/load.png",
            "`load.png` shows a path by arc length with limit points; the line is dashed along unstable equilibria.",
        ),
        Shown(
            "pattern",
            "pattern.png",
            "`fsm preview` of a sheet draws the flat pattern with numbers, and the initial state.",
        ),
    ],
    "Motion in a plane": [
        Shown("squares", "squares/motion.png", "Rotating squares."),
        Shown("plates", "plates/motion.png", "Three plates fall on a table."),
    ],
    "Mechanisms": [
        Shown("wing", "wing/motion.png", "A solar wing unfolds: bodies are drawn by lines between their joints."),
        Shown("report", "wing/report.png", "`report.png` shows the channels of `report`, and when latches close."),
        Shown("margin", "wing/margin.png", "`margin.png` shows available and required moments of hinges over their angles."),
    ],
    "Scissor arrays": [
        Shown("array", "array/motion.png", "`motion.png` shows the motion, and `motion.gif` shows it as an animation."),
        Shown("points", "array/points.png", "`points.png` shows the motion of the upper points."),
        Shown("rigid", "array/rigid.png", "`rigid.png` compares flexible bars with rigid bars."),
        Shown("synchronism", "array/synchronism.png", "`synchronism.png` shows the differences between neighbouring units."),
        Shown("stress", "array/stress.png", "`stress.png` shows the largest normal stress of every bar."),
    ],
    "Vibration of films": [
        Shown("tension", "film/tension.png", "`tension.png` shows principal stresses, and wrinkled and slack elements."),
        Shown("modes", "film/modes.png", "`modes.png` shows natural modes."),
        Shown("history", "film/history.png", "`history.png` shows the displacement of the probes after the impact."),
        Shown("spectrum", "film/spectrum.png", "`spectrum.png` shows the amplitude spectra and the natural frequencies."),
    ],
    "Tables of cases": [
        Shown("overlay", "table/overlay.png", "`overlay.png` shows the force curves of all rows."),
        Shown(
            "study", "study/study.png",
            "`study.png` shows results of films over the quantity that a table varies, with reference values.",
        ),
    ],
    "Calibration": [
        Shown("curves", "hinge/curves.png", "`curves.png` shows the moment of creases with the 95 % band."),
        Shown("residuals", "hinge/residuals.png", "`residuals.png` shows the measured moment minus the fitted moment."),
        Shown(
            "loops",
            "hinge/loops.png",
            "`loops.png` shows the loading moment minus the unloading moment; the area is the dissipated energy.",
        ),
        Shown("relaxation", "creep/relaxation.png", "`relaxation.png` shows the rest angle over the time since release."),
        Shown("bending", "panel/bending.png", "`bending.png` shows the deflection of a cantilever."),
        Shown("fit", "lattice/fit.png", "`fit.png` shows tests of a structure with the calibrated model."),
        Shown(
            "prediction",
            "lattice/prediction.png",
            "`prediction.png` shows the prediction for another load, with its band.",
        ),
    ],
}
"""Pictures by the headings of the page."""

INTRODUCTION = """# Figures

Every run draws its figures. `fsm plot RESULT.h5` draws them again, and `result.plot(...)` draws one of them in
[Python](python.md).

| option | meaning |
|---|---|
| `--style paper` | sizes for a printed page: 122 mm or 183 mm wide, letters of 7 to 9 points; the default |
| `--style slide` | letters 1.4 times and lines 1.6 times as large in the same sizes |
| `--format png`, `svg`, `pdf` | pixels (200 per inch); lines and letters in "svg" and "pdf", except maps of modes |

`fsm run`, `fsm table` and `fsm plot` have these options. The letters are DejaVu Sans. An SVG file names the
font, and a PDF file contains it. The colours follow Okabe and Ito (2008), so that colour-blind readers can distinguish
them; a colour has one meaning in a figure.

`make figures` computes all figures of this page. Data of creases, relaxation and the cantilever are synthetic.
"""


def measured(folder: Path) -> None:
    """Write synthetic tests: loading and unloading of creases with repeats, relaxation, and a cantilever."""
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(3)
    rows = ["press_time [h],repeat,branch,angle [deg],moment [N mm]"]
    for hours in (1, 24):
        for repeat in (1, 2, 3):
            scale = random.normal(1.0, 0.03)
            for branch, loss in (("loading", 1.0), ("unloading", 0.82)):
                angles = np.linspace(0.0, 90.0, 31)
                angles = angles if branch == "loading" else angles[::-1]
                for angle in angles:
                    share = angle / 90.0
                    loop = 1.0 - (1.0 - loss) * (4.0 * share * (1.0 - share))
                    moment = scale * loop * 6.0 * (1.0 - 0.1 * np.log10(hours)) * np.tanh(1.5 * share)
                    noise = random.normal(0.0, 0.05)
                    rows.append(f"{hours},{repeat},{branch},{angle:.2f},{moment + noise:.4f}")
    (folder / "hinge.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    rows = ["time [s],angle [deg],repeat"]
    for repeat in (1, 2, 3):
        start = 40.0 + random.normal(0.0, 0.8)
        for time in np.logspace(0, 5, 26):
            rows.append(f"{time:.4g},{start + 4.0 * np.log1p(time / 30.0) + random.normal(0.0, 0.3):.3f},{repeat}")
    (folder / "creep.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    rows = ["force [mN],deflection [mm],length [mm],width [mm],thickness [mm]"]
    from fsm.calibrate.bending import cantilever_curve

    length, rigidity = 0.08, 2.7e-4
    curve = cantilever_curve(0.7)
    for force in np.linspace(0.005, 0.16, 16):
        deflection = length * float(curve(force * length**2 / rigidity)) + random.normal(0.0, 3e-4)
        rows.append(f"{1e3 * force:.2f},{1e3 * deflection:.3f},80,40,0.3")
    (folder / "cantilever.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")


def fsm(*arguments: str) -> None:
    """Run a command."""
    print("fsm", *arguments, flush=True)
    subprocess.run([sys.executable, "-m", "fsm", *arguments], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


def compute(folder: Path) -> None:
    """Compute all results that are not there yet, and draw their figures."""
    data = folder / "data"
    measured(data)
    (data / "wing.toml").unlink(missing_ok=True)
    fsm("init", "wing", str(data / "wing.toml"))
    for name, (command, *arguments) in RUNS.items():
        files = [
            text.format(data=data) if "{data}" in text else str(Path("folding_cases") / text) if "/" in text else text
            for text in arguments
        ]
        out, result = folder / name, folder / name / "result.h5"
        if command == "run" and result.is_file():
            fsm("plot", str(result))
        elif command == "calibrate" or not (out / "summary.csv").is_file():
            fsm(command, *files, "--out", str(out), "--quiet")
    strip = str(folder / "strip" / "result.h5")
    fsm("plot", strip, "--channel", "crease.*")
    fsm("plot", strip, "--style", "slide", "--out", str(folder / "slide"))
    fsm("preview", "folding_cases/fold_file/case.toml", "--out", str(folder / "pattern.png"))


def small(source: Path, target: Path) -> None:
    """Write a picture with at most `WIDTH` pixels across and 256 colours, of which none is far from its original."""
    with Image.open(source) as picture:
        whole = picture.convert("RGB")
    if whole.width > WIDTH:
        whole = whole.resize((WIDTH, round(whole.height * WIDTH / whole.width)), Image.Resampling.LANCZOS)
    # a palette by the median of all pixels merges the colours of thin lines
    whole.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(target, optimize=True)


def page() -> str:
    """Text of the page."""
    parts = [INTRODUCTION]
    for heading, pictures in SECTIONS.items():
        parts.append(f"## {heading}\n")
        for shown in pictures:
            words = shown.text.replace("`", "").removesuffix(".")
            parts.append(f"```{{image}} figures/{shown.name}.png\n:alt: {words}\n:width: 85%\n```\n\n{shown.text}\n")
    return "\n".join(parts)


def main() -> None:
    """Write the page and its pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--keep", metavar="FOLDER", help="folder of the results; absent: a temporary one")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="fsm-figures-") as temporary:
        folder = Path(chosen.keep or temporary).resolve()
        compute(folder)
        for pictures in SECTIONS.values():
            for shown in pictures:
                small(folder / shown.source, HERE / f"{shown.name}.png")
    (HERE.parent / "figures.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
