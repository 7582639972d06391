"""A drive that moves a crease line through a held panel is refused where contact keeps panels apart."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsm.case.loading.load_case import load_case
from fsm.errors import CaseError

CASE = """
[strip]
length = "188 mm"
width = "12 mm"
thickness = "0.26 mm"
panels = 4
fold_angle = "79 deg"
{held}
[material]
young = "3.5 GPa"
poisson = 0.34
density = "1400 kg/m^3"
[crease]
law = "linear"
stiffness = "1 N mm/rad"
{contact}
[[drive]]
direction = {direction}
crease = 2
speed = "2 mm/s"
travel = "{travel} mm"
guide = {guide}
"""


def loaded(folder: Path, **texts: str) -> None:
    values = {"held": "", "contact": "[contact]", "direction": "[1, 0, 1]", "travel": "36.7", "guide": "true"} | texts
    (folder / "case.toml").write_text(CASE.format(**values), encoding="utf-8")
    load_case(folder / "case.toml")


def test_a_way_through_a_held_panel_is_refused(tmp_path: Path) -> None:
    """Crease 2 starts at x = 2 x 47 mm cos 79 deg and meets panel 4 at x = 17.94 + s, z = s with s = 15.02 mm."""
    with pytest.raises(CaseError, match=r"drive\.0\.travel: 36\.7 mm lead crease 2 through panel 4.* meet at 21\.24 mm"):
        loaded(tmp_path)


@pytest.mark.parametrize(
    "texts",
    [
        {"travel": "21"},
        {"contact": ""},
        {"held": "held = [1]"},
        {"direction": "[0, 0, 1]"},
        {"guide": "false"},
    ],
)
def test_other_ways_are_free(texts: dict[str, str], tmp_path: Path) -> None:
    loaded(tmp_path, **texts)
