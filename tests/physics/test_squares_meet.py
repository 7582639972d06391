"""Squares of a lattice that meet give a warning, or are named in the message of a failed run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fsm.errors import EnergyAbort, NotConverged
from tests.runs import run

LATTICE = """
[lattice]
columns = {columns}
rows = 4
spacing = {spacing}
hinge_length = {hinge}
angle = "10 deg"
axial = 120000
shear = {shear}
rotational = {rotational}
depth = 0.005
density = 7850
damping = "1 ms"
[[drive]]
edge = "top"
direction = [0, 0, -1]
speed = "1 mm/s"
travel = {travel}
"""


def solved(folder: Path, **values: Any) -> dict[str, Any]:
    return run(folder, LATTICE.format(**{"columns": 2, "spacing": 0.01, "hinge": 0.0005} | values))[1]


def test_a_lattice_pressed_too_far_says_so_where_it_fails(tmp_path: Path) -> None:
    """Stiff hinges hardly allow the squares to rotate: their ligaments are compressed to zero length at 1.53 mm."""
    with pytest.raises((EnergyAbort, NotConverged), match=r"Squares block \d.\d and block \d.\d meet at 1\.\d+ mm"):
        solved(tmp_path, shear=60000, rotational=0.6, travel=0.008)


def test_squares_that_meet_are_warned_of(tmp_path: Path) -> None:
    """The travel ends just before the end above; a lattice that is compressed less gives no warning."""
    stiff = {"shear": 60000, "rotational": 0.6}
    late, early = (solved(tmp_path, **stiff, travel=travel)["warnings"] for travel in (0.00152, 0.0005))
    assert any("meet at 1." in line and "reduce the travel" in line for line in late)
    assert not any("meet at" in line for line in early)
