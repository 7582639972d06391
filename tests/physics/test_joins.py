"""Shipped cases that join films, cables and beams with rigid bodies: they keep their energy, and give what they should."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.run import run_case
from fsm.scene.load_case import load_case

CASES = Path(__file__).parents[2] / "folding_cases"
BALANCED = 1e-5
"""Energy error over the energy turned over."""


def run(name: str, folder: Path, *overrides: str) -> tuple[dict[str, Any], Solution]:
    summary = run_case(load_case(CASES / name / "case.toml", list(overrides)), folder, progress=False)
    return summary, read_solution(folder / "result.h5")


def test_film_pulled_by_a_strip_and_struck_keeps_its_energy(tmp_path: Path) -> None:
    """The work of the drive and of the blow is in the strip, in the film, in the motion, and in the dampers of the strip."""
    quick = "drive.0.time.end=30 ms", 'load.0.time.time=["32 ms", "32.5 ms", "33 ms"]', "solve.end_time=35 ms"
    summary, solution = run("film_on_strip", tmp_path, *quick)
    assert summary["energy_error"] < BALANCED
    assert solution.travel[-1, 0] == pytest.approx(0.015)
    before, after = (int(np.searchsorted(solution.time, t)) for t in (0.0319, 0.0332))
    assert solution.energy["work"][after] > 1.05 * solution.energy["work"][before]
    assert solution.energy["kinetic"][after] > 3.0 * solution.energy["kinetic"][before]
    # the drive pulls against the strip all the way, without jumps: dampers see mean rates
    assert 0.2 < solution.force[before, 0] < 2.0
    assert np.abs(np.diff(solution.force[: before + 1, 0])).max() < 0.2


def test_sail_on_cables_keeps_its_energy(tmp_path: Path) -> None:
    """A blow on the post runs through the cable to the corner of the film."""
    summary, solution = run("sail_on_cables", tmp_path, "solve.end_time=4 ms", "scene.films.0.mesh=[4, 4]")
    assert summary["method"] == "mean-force"
    assert summary["energy_error"] < BALANCED
    assert np.ptp(solution.energy["film"]) > 0.05 * solution.energy["work"].max()


def test_plate_bounces_on_the_film(tmp_path: Path) -> None:
    """All the energy that the plate loses is in the film, and it flies off again."""
    short = "scene.bodies.0.position=[0.006, 0.004, 0.003]", "solve.end_time=6 ms", "scene.films.0.mesh=[4, 4]"
    summary, solution = run("plate_on_film", tmp_path, *short)
    assert summary["energy_error"] < BALANCED
    assert summary["contact"][0]["largest_force"] > 1.0
    height, speed = solution.q[:, 2], solution.u[:, 2]
    assert speed[0] == pytest.approx(-2.0)
    assert speed[-1] > 0.5
    assert height.min() < 0.0 < height[-1]
    assert solution.pair_force[-1, 0] < 0.05 * solution.pair_force.max()


def test_beam_between_panels_keeps_its_energy(tmp_path: Path) -> None:
    """Energy of the creases goes to the beam and to the motion of the panel."""
    summary, solution = run("beam_between_panels", tmp_path, "solve.end_time=20 ms")
    assert summary["energy_error"] < BALANCED
    assert solution.energy["beam"].max() > 0.01 * np.ptp(solution.energy["creases"])
    assert summary["dof"] == 6 + 9 * 4  # the panel, and x and z of positions and slopes of nine nodes
