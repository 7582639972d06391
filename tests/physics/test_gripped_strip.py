"""Strips gripped at an end line or at a whole panel, and the travel at which they are taut."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.api.case import load
from fsm.case.loading.load_case import load_case
from fsm.errors import CaseError
from fsm.results.store import read_solution
from fsm.run.run_case import run_case

STRIP = """
[strip]
length = "{length} mm"
width = "25 mm"
thickness = "{thickness} mm"
panels = {panels}
fold_angle = "{angle} deg"
segments_per_panel = 2
half_cell = false
[material]
young = "200 GPa"
density = "1000 kg/m^3"
[crease]
law = "linear"
stiffness = "5 N mm/rad"
[[drive]]
{drive}
speed = "1 mm/s"
travel = "{travel} mm"
[solve]
method = "static"
"""


def strip(folder: Path, drive: str, **keys: Any) -> Path:
    """Case of a strip that is nearly rigid between its creases."""
    known = {"length": 600, "thickness": 3, "panels": 5, "angle": 75, "travel": 40, "drive": drive} | keys
    (folder / "case.toml").write_text(STRIP.format(**known), encoding="utf-8")
    return folder / "case.toml"


def checked(folder: Path, drive: str, *held: int, **keys: Any) -> str:
    case = load(strip(folder, drive, **keys))
    return str((case.set("strip.held", list(held)) if held else case).check())


def test_the_end_of_a_strip_is_pulled_by_a_line_about_which_the_panel_rotates(tmp_path: Path) -> None:
    """Panels 2 and 3 form a triangle with the path: cos(psi) = d/(2a), U = k (1 + 4) (phi - psi)^2/2, F = dU/dd."""
    path = strip(tmp_path, 'end = "last"\ndirection = [1, 0, 0]', length=300, panels=3, angle=60)
    summary = run_case(load_case(path), tmp_path / "out", progress=False)
    solution = read_solution(tmp_path / "out" / "result.h5")
    psi = np.arccos(np.cos(math.radians(60.0)) + solution.travel[:, 0] / 0.2)
    force = 5.0 * 5e-3 * (math.radians(60.0) - psi) / (0.2 * np.sin(psi))
    np.testing.assert_allclose(solution.force[:, 0], force, atol=2e-3 * force[-1])
    assert summary["drive"] == "last end"
    held = [body for body in solution.layout.body_names if body.startswith("panel 1")]
    assert held == []  # the first panel is held, and the last is free


def test_a_gripped_panel_moves_as_a_whole(tmp_path: Path) -> None:
    """As all of its segments, given as bodies."""
    forces = []
    for number, part in enumerate(("panel = 5", 'bodies = ["panel 5 segment 1", "panel 5 segment 2"]')):
        path = strip(tmp_path, f"{part}\ndirection = [1, 0, 0.1]")
        loaded = load_case(path, ["strip.held=[1]"] if number else [])
        run_case(loaded, tmp_path / str(number), progress=False)
        solution = read_solution(tmp_path / str(number) / "result.h5")
        assert solution.layout.drive_names == ("panel 5 segments 1 to 2",)
        forces.append(solution.force)
    np.testing.assert_array_equal(*forces)
    assert np.abs(forces[0]).max() > 0.0


@pytest.mark.parametrize(
    ("drive", "held", "text"),
    [
        # crease 1 and the last end are at the same height, 4 a cos(75 deg) apart; the panels between them are 4 a long
        ('end = "last"\ndirection = [1, 0, 0]', (), "taut at 355.8 mm of travel: panels 2 to 5 are straight"),
        ('end = "last"\ndirection = [2, 0, 0]', (), "guided: the line moves along its direction only"),
        ('end = "last"\nguide = false\ndirection = [1, 0, 0]', (), "not guided: the line can also move"),
        ('body = "panel 5 segment 2"\ndirection = [1, 0, 0]', (1,), "the driven segments translate and keep their angles"),
        # crease 4 is one panel lower than crease 1: (3 a cos(75 deg), -a sin(75 deg)), and 3 a away when taut
        ('panel = 5\ndirection = [1, 0, 0]', (), "taut at 247.7 mm of travel: panels 2 to 4 are straight"),
        ('crease = 2\ndirection = [1, 0, 0]', (), "locked: panel 2 is straight at the start"),
        ('crease = 2\ndirection = [1, 0, 0]', (), "held panels and the driven line lock, because panel 2"),
        ('end = "last"\ndirection = [1, 0, 0]', (), "1 held"),
    ],
)  # fmt: skip
def test_a_check_says_what_is_driven_and_when_it_is_taut(
    tmp_path: Path, drive: str, held: tuple[int, ...], text: str
) -> None:
    assert text in checked(tmp_path, drive, *held)


def test_a_travel_beyond_the_full_length_is_told_before_the_run(tmp_path: Path) -> None:
    drive = 'end = "last"\ndirection = [1, 0, 0]'
    assert "longer than 355.8 mm" not in checked(tmp_path, drive, travel=355)
    assert "the travel of 357 mm is longer than 355.8 mm" in checked(tmp_path, drive, travel=357)


@pytest.mark.parametrize(
    ("drive", "fault"),
    [
        ("panel = 6", "drive.0.panel: must be a panel number from 1 to 5; it is 6"),
        ("panel = 2", "drive.0.panel: panel 2 is held by `strip.held`"),
        ('end = "first"', "drive.0.end: panel 1 is held by `strip.held`"),
        ('end = "last"\npanel = 5', "give one of"),
        ('end = "middle"', "drive.0.end: must be"),
    ],
)
def test_faults_of_grips(tmp_path: Path, drive: str, fault: str) -> None:
    path = strip(tmp_path, drive)
    with pytest.raises(CaseError) as caught:
        load_case(path, ["strip.held=[1, 2]"])
    assert fault in str(caught.value)


@pytest.mark.parametrize(("part", "name"), [('end = "last"', "last end"), ("panel = 5", "panel 5")])
def test_a_grip_is_driven_again_and_released_in_steps(tmp_path: Path, part: str, name: str) -> None:
    """An end line has no mass: it stays in place where it is released, and the end of the strip is free."""
    path = strip(tmp_path, f"{part}\ndirection = [1, 0, 0]")
    head, _, tail = path.read_text(encoding="utf-8").partition("[[drive]]")
    drive, _, solve = tail.partition("[solve]")
    steps = f'[[step]]\nname = "pull"\nkind = "static"\n[[step.drive]]{drive}'
    steps += f'[[step]]\nname = "back"\nkind = "static"\n[[step.drive]]{drive.replace("[1, 0, 0]", "[-1, 0, 0]")}'
    steps += f'[[step]]\nname = "free"\nkind = "relax"\nrelease = ["{name}"]\n'
    path.write_text(f"{head}{steps}[solve]{solve}", encoding="utf-8")
    text = str(load(path).check())
    assert "3 back: static" in text and "4 free: relax" in text
