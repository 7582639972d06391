"""Prediction of the force of the pulled sheet, with a band.

    python -m validation.kirigami.predict --out out/kirigami

Runs that are complete in the folder are not repeated.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from validation.kirigami.models import MODELS
from validation.kirigami.sheet import EXTENSION, curve

__all__ = ["AT", "Terms", "predicted"]

AT = 1e-3 * np.arange(0.0, 73.5, 0.5)
"""Extensions of the prediction, m."""
BEST = "mesh-4-graded-width-0.1"
"""Model of the prediction: the finest mesh, with slits of 0.1 mm."""
_FINER = "small-8-graded-width-0.1", "small-4-graded-width-0.1"
"""Small models whose ratio corrects the prediction for the size of its cells."""
_NARROW = "mesh-4-graded", "mesh-4-graded-width-0.1"
_WIDE = "mesh-3-graded-width-0.2", "mesh-3-graded-width-0.1"
"""Models whose ratios are the effects of slits without width, and of slits of 0.2 mm."""
_HEADER = "extension_mm,force_N,low_N,high_N"
_YOUNG = 0.05
"""Relative uncertainty of Young's modulus."""
_THICKNESS = 3.0 * 0.03
"""Relative effect of the uncertainty of the thickness on a force in proportion to its cube."""
_ZERO = 0.5e-3
"""Uncertainty of the extension at which the sheet begins to carry load, with slip in the clamps, m."""
_RELAXED = 0.05
"""Part of the force that a polymer may lose by relaxation; it widens the band below."""
_YIELDED = (0.0, 0.028, 0.13, 0.329), (0.0, 20e-3, 50e-3, 73e-3)
"""Part of the area with bending strains above 2 %, at extensions (m). The lower bound loses half of this part of the force,
because polymers yield there; the prediction is elastic.
"""

Terms = dict[str, tuple[np.ndarray, np.ndarray]]
"""Contributions to the band, N: distances below and above the prediction, by name."""


def forces(name: str, folder: Path) -> np.ndarray:
    """Force of a model at the extensions `AT`, N; a small model is compared at the same part of its largest extension."""
    found = curve(MODELS[name], folder / name)
    largest = MODELS[name].extension
    return np.asarray(np.interp(AT / EXTENSION, np.array(found["extension"]) / largest, found["force"]))


def _either(difference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.abs(difference), np.abs(difference)


def _upward(difference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.maximum(-difference, 0.0), np.maximum(difference, 0.0)


def predicted(folder: Path) -> tuple[np.ndarray, Terms]:
    """Prediction (N) at `AT` and the contributions to its band."""

    def ratio(name: str, base: str) -> np.ndarray:
        one, other = forces(name, folder), forces(base, folder)
        return np.divide(one, other, out=np.ones_like(one), where=other > 0.0)

    refined = ratio(*_FINER)
    force = np.maximum(forces(BEST, folder), 0.0) * refined + 0.0
    slope = np.gradient(force, AT)
    terms: Terms = {
        "Young's modulus": _either(_YOUNG * force),
        "thickness": _either(_THICKNESS * force),
        "extension and clamps": _either(_ZERO * slope),
        "free length at the clamps": _either(0.5 * (ratio("clear-1.9", "mesh-2") - 1.0) * force),
        "mesh": _either((1.0 - refined) * force),
        "slits without width": _upward((ratio(*_NARROW) - 1.0) * force),
        "slits twice as wide": _upward((ratio(*_WIDE) - 1.0) * force),
        "both senses of tilt": _upward((ratio("two-senses", "mesh-2") - 1.0) * force),
        "relaxation": (_RELAXED * force, np.zeros_like(force)),
        "yield": (0.5 * np.interp(AT, _YIELDED[1], _YIELDED[0]) * force, np.zeros_like(force)),
    }
    return force, terms


def band(force: np.ndarray, terms: Terms) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper bound, N: roots of the sums of squares of all contributions."""
    low, high = (np.sqrt(sum(np.square(term[side]) for term in terms.values())) for side in (0, 1))
    return np.maximum(force - low, 0.0), force + high


def write(folder: Path, file: Path) -> None:
    """Write the prediction at `AT` with its band, and print the contributions."""
    force, terms = predicted(folder)
    low, high = band(force, terms)
    rows = np.column_stack([1e3 * AT, force, low, high])
    np.savetxt(file, rows, fmt=("%.1f", "%.4f", "%.4f", "%.4f"), delimiter=",", comments="", header=_HEADER)
    shown = [1.0, 10.0, 30.0, 50.0, 60.0, 73.0]
    at = [int(np.argmin(np.abs(1e3 * AT - one))) for one in shown]
    print(f"{'extension (mm)':28}", *(f"{one:14.0f}" for one in shown))
    print(f"{'force (N)':28}", *(f"{force[k]:14.3f}" for k in at))
    print(f"{'band (N)':28}", *(f"{f'{low[k]:.2f} to {high[k]:.2f}':>14}" for k in at))
    for name, (below, above) in terms.items():
        print(f"{name:28}", *(f"{f'-{below[k]:.3f} +{above[k]:.3f}':>14}" for k in at))


def main() -> None:
    """Run the models that have no results yet, and write the prediction."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs")
    parser.add_argument("--file", type=Path, default=Path(__file__).with_name("prediction.csv"), help="file to write")
    parser.add_argument("--only", nargs="*", help="names of models to run, or all; without a prediction")
    arguments = parser.parse_args()
    if arguments.only is None:
        write(arguments.out, arguments.file)
        return
    for name in arguments.only or MODELS:
        found = curve(MODELS[name], arguments.out / name)
        print(
            f"{name}: {found['unknowns']} unknowns, {found['steps']} steps, {found['iterations']} iterations, "
            f"{found['seconds']:.0f} s, {found['force'][-1]:.3f} N at {1e3 * found['extension'][-1]:.1f} mm",
            flush=True,
        )


if __name__ == "__main__":
    main()
