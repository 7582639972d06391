"""Shipped cases that join films, cables and beams with rigid bodies: energy is conserved, and the results are as
expected."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.run.run_case import run_case

CASES = Path(__file__).parents[2] / "folding_cases"
BALANCED = 1e-5
"""Energy error over the reference energy."""


def run(name: str, folder: Path, *overrides: str) -> tuple[dict[str, Any], Solution]:
    summary = run_case(load_case(CASES / name / "case.toml", list(overrides)), folder, progress=False)
    return summary, read_solution(folder / "result.h5")


def test_film_pulled_by_a_strip_and_struck_keeps_its_energy(tmp_path: Path) -> None:
    """The work of the drive and of the impact is stored in the strip and in the film, is kinetic energy, or is dissipated in
    the strip."""
    quick = "step.1.duration=3 ms", "strip.segments_per_panel=4", 'scene.seams.0.bodies=["panel 3 segment 4"]'
    moved = "step.0.drive.0.bodies=" + str([f"panel 1 segment {k}" for k in range(1, 5)])
    summary, solution = run("film_on_strip", tmp_path, *quick, moved)
    assert [step["method"] for step in summary["step"]] == ["relax", "static", "mean-force"]
    assert summary["energy_error"] < BALANCED
    assert any(event["kind"] == "vibration" for event in summary["events"])  # the film that vibrates
    assert not any("snap" in warning for warning in summary["warnings"])
    pull, strike = (solution.step == number for number in (2, 3))
    assert solution.travel[-1, 0] == pytest.approx(0.015)
    assert np.all(np.diff(solution.force[pull, 0]) > 0.0)
    # dampers are not affected by the earlier speed of the drive, and drive forces are means over steps
    assert np.abs(np.diff(solution.force[strike, 0], prepend=solution.force[pull, 0][-1])).max() < 0.3
    assert solution.energy["work"][-1] > 1.2 * solution.energy["work"][pull][-1]
    assert solution.energy["kinetic"][strike].max() > 0.1 * np.ptp(solution.energy["work"][strike])
    assert solution.energy["dissipated"][-1] > solution.energy["dissipated"][pull][-1]


def test_sail_on_cables_keeps_its_energy(tmp_path: Path) -> None:
    """An impact on the post passes through the cable to the corner of the film."""
    summary, solution = run("sail_on_cables", tmp_path, "solve.end_time=4 ms", "scene.films.0.mesh=[4, 4]")
    assert summary["method"] == "mean-force"
    assert summary["energy_error"] < BALANCED
    assert np.ptp(solution.energy["film"]) > 0.05 * solution.energy["work"].max()


def test_plate_bounces_on_the_film(tmp_path: Path) -> None:
    """The film has all the energy that the plate loses, and the plate separates again."""
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
    """The energy of the creases becomes energy of the beam and motion of the panel."""
    summary, solution = run("beam_between_panels", tmp_path, "solve.end_time=20 ms")
    assert summary["energy_error"] < BALANCED
    assert solution.energy["beam"].max() > 0.01 * np.ptp(solution.energy["creases"])
    assert summary["dof"] == 6 + 9 * 4  # coordinates of the panel, and x and z of positions and slopes of nine nodes
