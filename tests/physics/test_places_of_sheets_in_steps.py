"""Driven places of sheets of rigid facets, bend lines and bars that begin in a later step and are released."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.runs import run

SHEET = """
[sheet]
kind = "miura"
columns = 2
rows = 2
a = 0.3
b = 0.3
sector_angle = "60 deg"
fold_angle = "35 deg"
facets = "{facets}"
thickness = "2 mm"
support = [
    {{ at = "edge left", fixed = ["x"] }}, {{ at = "vertex 1", fixed = ["y", "z"] }}, {{ at = "vertex 3", fixed = ["z"] }},
]
[material]
young = 3e9
density = 1000
[crease]
stiffness_per_length = 0.1
"""
DRIVE = """[[step.drive]]
name = "push"
{place}
direction = [-1, 0, 0]
guide = false
speed = "1 mm/s"
travel = "10 mm"
"""


def step(name: str, kind: str, more: str = "") -> str:
    return f'[[step]]\nname = "{name}"\nkind = "{kind}"\n{more}'


def frequencies(summary: dict[str, Any], name: str) -> np.ndarray:
    return np.array(next(part["frequencies_hz"] for part in summary["step"] if part["name"] == name))


@pytest.mark.parametrize(
    ("facets", "place"),
    [
        ("rigid", 'edge = "right"'),
        ("rigid", 'at = "edge right"'),
        ("bend-lines", 'edge = "right"'),
        ("bars", 'at = "edge right"'),
    ],
)
def test_before_the_drive_and_after_its_release_the_sheet_is_free(tmp_path: Path, facets: str, place: str) -> None:
    sheet, drive = SHEET.format(facets=facets), DRIVE.format(place=place)
    _, alone = run(tmp_path, sheet + step("before", "modes") + '[solve]\nmethod = "static"\n')
    text = step("before", "modes") + step("push", "static", drive) + step("free", "relax", 'release = ["push"]\n')
    solution, summary = run(tmp_path, sheet + text + step("after", "modes"))
    expected = frequencies(alone, "before")
    np.testing.assert_allclose(frequencies(summary, "before"), expected, rtol=1e-7)
    np.testing.assert_allclose(frequencies(summary, "after"), expected, rtol=1e-5)
    moved = np.abs(solution.q - solution.q[0]).max(axis=1)
    assert moved.max() > 9e-3
    assert moved[-1] < 1e-3 * moved.max()
    assert not any("separate" in line for line in summary["warnings"])


def peaks(summary: dict[str, Any]) -> dict[str, float]:
    return {part["name"]: part["peak_force"] for part in summary["step"] if "peak_force" in part}


@pytest.mark.parametrize("facets", ["rigid", "bars"])
def test_a_drive_begins_again_where_its_place_is(tmp_path: Path, facets: str) -> None:
    """A load moves the free place before the first drive, which begins there; the drive after a release begins at rest."""
    sheet, drive = SHEET.format(facets=facets), DRIVE.format(place='edge = "right"')
    load = '[[step.load]]\nat = "edge right"\nname = "pull"\nforce = [0.005, 0, 0]\n'
    text = step("load", "static", load) + step("push", "static", 'release = ["pull"]\n' + drive)
    text += step("free", "relax", 'release = ["push"]\n') + step("again", "static", drive)
    _, summary = run(tmp_path, sheet + text)
    found, stretched = peaks(summary), summary["step"][0]["loads"]["pull"]["displacement"]
    assert stretched > 1e-4
    shorter = drive.replace('"10 mm"', repr(0.01 - stretched))
    for name, same in (("again", drive), ("push", shorter)):
        _, alone = run(tmp_path, sheet + step("alone", "static", same))
        assert found[name] == pytest.approx(peaks(alone)["alone"], rel=1e-4)
