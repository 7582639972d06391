"""One measured structure with four kinds of facets: error against the test, and run time.

    FSM_KRESLING_TESTS=FOLDER python -m validation.kresling_tube.ladder [--mesh 10 7.5]

Each kind is calibrated on the tubes of ratio 0.75 and predicts the two others: flexible facets by Young's modulus, the other
kinds also by the stiffness of their folds. Facets are triangles, so "bend-lines" are rigid facets.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from validation.kresling_tube.measured import RATIOS, compressions
from validation.kresling_tube.predict import CALIBRATED, TRAVEL, fitted
from validation.kresling_tube.tube import YOUNG, force, wall_thickness

_FOLDS = 1e-2, 1e2
"""Range of the stiffness of folds with `YOUNG`, N m/rad per m."""
_RIGID = 8.0 / 3.0
"""Power of the thickness in the stiffness of folds (Liu and Paulino, 2017)."""

Curves = Callable[[float], CubicSpline]
"""Force over Young's modulus as a function of the travel, by the ratio of a tube."""


def main() -> int:
    """Print a row for each kind of facets."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mesh", nargs="+", type=float, default=[10.0, 7.5], help="cells of flexible facets, mm")
    meshes = parser.parse_args().mesh
    print("| facets | run, s | residual of the fit | ratio 0.69: peak | rms | ratio 0.85: peak | rms |")
    print("|---|---|---|---|---|---|---|")
    with TemporaryDirectory() as folder:
        for kind in ("rigid", "bars"):
            _print(kind, *_with_folds(Path(folder), kind))
        for mesh in meshes:
            _print(f"flexible, cells of {mesh:g} mm", *_timed(_runs(Path(folder), "flexible", 0.0, 1e-3 * mesh)))
    return 0


def _print(name: str, curves: Curves, seconds: float) -> None:
    travel, tests = compressions(CALIBRATED)
    fit, row = fitted(curves(CALIBRATED), travel, tests.mean(axis=0)), list[str]()
    for ratio in (one for one in RATIOS if one != CALIBRATED):
        mean = compressions(ratio)[1].mean(axis=0)
        found = fit.young * curves(ratio)(np.maximum(TRAVEL - fit.late, 0.0))
        rms = np.sqrt(np.mean((np.interp(travel, TRAVEL, found) - mean) ** 2)) / mean.max()
        row += [f"{100.0 * (found.max() / mean.max() - 1.0):+.0f} %", f"{100.0 * rms:.0f} %"]
    print(f"| {name} | {seconds:.2g} | {100.0 * fit.residual:.1f} % | {' | '.join(row)} |", flush=True)


def _with_folds(folder: Path, kind: str) -> tuple[Curves, float]:
    """Curves with the folds that fit the calibrated tubes best."""
    travel, tests = compressions(CALIBRATED)

    def misfit(log: float) -> float:
        return fitted(_runs(folder, kind, float(np.exp(log)), 0.0)(CALIBRATED), travel, tests.mean(axis=0)).residual

    best = minimize_scalar(misfit, bounds=tuple(np.log(_FOLDS)), method="bounded", options={"xatol": 0.02})
    return _timed(_runs(folder, kind, float(np.exp(best.x)), 0.0))


def _runs(folder: Path, kind: str, fold: float, mesh: float) -> Curves:
    known: dict[float, CubicSpline] = {}

    def curve(ratio: float) -> CubicSpline:
        if ratio not in known:
            thickness = wall_thickness(ratio)
            own = fold * (thickness / wall_thickness(CALIBRATED)) ** _RIGID
            known[ratio] = CubicSpline(TRAVEL, force(folder, ratio, thickness, TRAVEL, kind, own, mesh) / YOUNG)
        return known[ratio]

    return curve


def _timed(curves: Curves) -> tuple[Curves, float]:
    """Curves, and the processor time of the calibrated one, s."""
    begun = time.process_time()
    curves(CALIBRATED)
    return curves, time.process_time() - begun


if __name__ == "__main__":
    sys.exit(main())
