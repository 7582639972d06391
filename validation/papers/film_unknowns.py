"""Values of air, patch and pulse that would reproduce the numbers of the paper on the film, which does not state them.

    python -m validation.papers.film_unknowns

Changes in % of the case in folding_cases/membrane_impact: the lowest natural frequency, with a part of the air or a denser
patch; the largest displacement of centre and patch as the patch grows from 10 to 20 mm, with a longer pulse. One minute.
"""

from __future__ import annotations

import numpy as np

from fsm.analyses.reduced import reduced_model
from fsm.analyses.vibrate import VibrationAnalysis
from fsm.case.loading.load_case import load_case
from fsm.kernels.programs import half_sine
from fsm.model.nodes.loading import Forcing
from fsm.model.nodes.system.reduced import ReducedModel
from validation.papers.film import BIN, FOLDER

AIR, STEEL = 1.2, 7850.0
"""Densities of the case, kg/m^3; the added mass is proportional to the density of air."""
SIZE, PULL = (-4.88, -12.2, 7.32), (20.58, 38.24)
"""Values of the paper: patches of 15 and 20 mm, and no patch, relative to 10 mm; 15 and 20 N relative to 10 N."""


def film(*overrides: str) -> VibrationAnalysis:
    """Tensioned film of the case, with its modes."""
    analysis = VibrationAnalysis(load_case(FOLDER / "case.toml", ("impact=none", *overrides)).case, "case.toml")
    analysis.initialise([])
    return analysis


def frequencies(air: float, patch: float) -> tuple[list[float], list[float]]:
    """Changes of the lowest frequency, %: with size, with pull; a part of the air, times the density of steel."""
    given = (f"air.density={air * AIR} kg/m^3", "vibration.modes=4")
    dense = f"patch.0.density={patch * STEEL} kg/m^3"
    sizes = [film(*given, dense, f"patch.0.size={size} mm") for size in (10, 15, 20)] + [film(*given, "patch=none")]
    pulls = [film(*given, dense, f"tension.pull={pull} N") for pull in (10, 15, 20)]
    size, pull = ([float(f.modes.frequencies[0]) for f in films] for films in (sizes, pulls))
    return [100 * (f / size[0] - 1) for f in size[1:]], [100 * (f / pull[0] - 1) for f in pull[1:]]


def amplitudes(of: VibrationAnalysis, model: ReducedModel, pulse: float) -> np.ndarray:
    """Largest normal displacement of centre and patch after a pulse (s) in the middle."""
    point, start = of.film.point(0.0, 0.0), of.film.mesh.coordinates
    forcing = Forcing(point.load(len(start), 0.2 * point.axes(start)[2]), half_sine(pulse))
    response = model.respond(pulse + 0.15, min(2e-4, pulse / 50.0), (forcing,))
    moved = np.array([of.probes(model.coordinates(a))[:2, 2] for a in response.amplitude[::2]])
    return np.abs(moved).max(axis=0)


def main() -> None:
    """Print both tables."""
    print("| air | patch | 10 -> 15 mm | 10 -> 20 mm | 10 mm -> none | 10 -> 15 N | 10 -> 20 N | all within a bin |")
    print("|---|---|---|---|---|---|---|---|")
    for air, patch in ((1, 1), (0.5, 1), (0.42, 1), (0.4, 1), (0.38, 1), (1, 2), (1, 2.1), (1, 2.2), (0.67, 1.4)):
        size, pull = frequencies(air, patch)
        off = np.abs((100.0 + np.array(size + pull)) / (100.0 + np.array(SIZE + PULL)) - 1.0)
        cells = " | ".join(f"{change:+.1f}" for change in size + pull)
        print(f"| {air:g} | {patch:g} | {cells} | {'no' if (off > BIN / 100).any() else 'yes'} |", flush=True)
    print("\n| pulse (ms) | over the period | centre | patch |\n|---|---|---|---|")
    films = [film(f"patch.0.size={size} mm", "vibration.modes=80") for size in (10, 15, 20)]
    models = [reduced_model(of.system, of.modes, False) for of in films]  # type: ignore[arg-type]
    for pulse in (1e-3, 5e-3, 0.01, 0.015, 0.02, 0.03, 0.045, 0.06, 0.08):
        found = np.array([amplitudes(of, model, pulse) for of, model in zip(films, models, strict=True)])
        change = 100.0 * (found / found[0] - 1.0)
        part = pulse * films[0].modes.frequencies[0]
        cells = " | ".join(f"{change[1, k]:+.1f}, {change[2, k]:+.1f}" for k in (0, 1))
        print(f"| {1e3 * pulse:g} | {part:.2f} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
