"""Whole folded structures that touch themselves: the Z-folded tube and the pleated cone of `folding_cases`.

Each run is compared with runs of half the step and of other friction coefficients. The table has the length at the end, the
peak force or the pressure at a length of 300 mm, the energy balance, and the largest number of facets in contact at a time.
The table also has the number of saved states with intersections by `ipctk.has_intersections` (extra `peers`), and the
largest difference of symmetric copies over the size of the folded structure.

    python -m validation.sheets.whole [--only z_tube/gas] [--variants step friction]
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

import fsm
from fsm.errors import FsmError
from fsm.results.quantities import FACET_FORCES
from fsm.results.store import read_solution
from validation.sheets.self_contact import intersecting

__all__ = ["CASES", "VARIANTS", "asymmetry", "measured"]

ROOT = Path(__file__).parents[2] / "folding_cases"
CASES = {"z_tube/case": 10.0, "z_tube/gas": 10.0, "pleated_cone/case": 20.0}
"""Files with their longest steps, s."""
VARIANTS = {
    "step": [("half of the step", {"solve.max_step": 0.5}), ("a quarter of the step", {"solve.max_step": 0.25})],
    "friction": [("friction 0", {"friction": None}), ("friction 1", {"friction.mu_dynamic": 1.0})],
    "thickness": [("0.02 mm thick", {"sheet.thickness": 2e-5})],
}
"""Changes of a case; steps are relative to those of the case."""
_FILLED, _LENGTH = 400.0, 0.3
"""Time from which gas fills the tube, s, and the length at which its pressure is compared, m."""


class Row(NamedTuple):
    """Results of a run.

    Attributes
    ----------
    final : length of the tube or height of the cone at the end, m
    peak : peak force, N; with gas the pressure above that outside at a length of 0.3 m, Pa
    touching, facets : largest number of facets in contact at one time, and number of all facets
    states, intersections : saved states, and those with intersections
    asymmetry : see `asymmetry`
    seconds : processor time, s
    """

    final: float
    peak: float
    energy_error: float
    touching: int
    facets: int
    states: int
    intersections: int
    asymmetry: float
    seconds: float


def asymmetry(vertices: np.ndarray, cone: bool) -> float:
    """Largest difference of symmetric copies of vertices (n, rings, corners, 3) over the size of the first state."""
    size = float(np.ptp(vertices[0].reshape(-1, 3), axis=0).max())
    if not cone:  # the plane z = 0 is a plane of symmetry of the tube
        return float(np.abs(vertices[:, :, [0, 3, 2, 1]] * [1.0, 1.0, -1.0] - vertices).max()) / size
    count, largest = vertices.shape[2], 0.0
    for k in range(1, count):
        c, s = math.cos(2.0 * math.pi * k / count), math.sin(2.0 * math.pi * k / count)
        turned = vertices[:, :, 0] @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        largest = max(largest, float(np.abs(turned - vertices[:, :, k]).max()))
    return largest / size


def measured(case: fsm.Case, folder: Path) -> Row:
    """Run a case, and measure its result."""
    begun = time.process_time()
    result = case.run(folder, figures=False)
    used = time.process_time() - begun
    solution = read_solution(folder / "result.h5")
    sheet = case.model.sheet
    assert sheet is not None
    corners = sheet.sides or 4
    rings = (sheet.rows if sheet.sides else sheet.columns) or 1
    vertices = solution.q[:, -3 * corners * (rings + 1) :].reshape(len(solution), rings + 1, corners, 3)
    length = vertices[:, -1, :, 2 if sheet.sides else 0].mean(axis=1)
    peak = result.summary["peak_force"]
    if case.model.gas:
        filled = solution.time >= _FILLED
        peak = np.interp(_LENGTH, length[filled], result["gas.air.pressure"].values[filled] - 1e5)
    forces = solution.channels[FACET_FORCES].values
    return Row(
        float(length[-1]), float(peak), float(result.summary["energy_error"]),
        int((forces > 0.0).sum(axis=1).max()), forces.shape[1], len(solution), len(intersecting(solution.shape)),
        asymmetry(vertices, bool(sheet.sides)), used,
    )  # fmt: skip


def _variants(name: str, kinds: list[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    yield "as shipped", {}
    for kind in kinds:
        for text, change in VARIANTS[kind]:
            yield text, {key: value * CASES[name] if kind == "step" else value for key, value in change.items()}


def main() -> None:
    """Table of all runs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=list(CASES), help="one file")
    parser.add_argument("--variants", nargs="*", choices=list(VARIANTS), default=["step", "friction"])
    given = parser.parse_args()
    heads = ["case", "run", "end (mm)", "peak (N or Pa)", "energy error", "touch", "intersections", "asymmetry", "time (s)"]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for name in CASES if given.only is None else [given.only]:
        for text, change in _variants(name, given.variants):
            case = fsm.load(ROOT / f"{name}.toml")
            for key, value in change.items():
                case = case.set(key, value)
            with TemporaryDirectory() as folder:
                try:
                    row = measured(case, Path(folder) / "out")
                except FsmError as error:
                    print(f"| {name} | {text} | failed: {str(error)[:160]} |", flush=True)
                    continue
            print(
                f"| {name} | {text} | {1e3 * row.final:.3f} | {row.peak:.4f} | {row.energy_error:.1e} | {row.touching} of "
                f"{row.facets} | {row.intersections} of {row.states} | {row.asymmetry:.1e} | {row.seconds:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
