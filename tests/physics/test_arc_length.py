"""Paths under force control through limit points, from the case file: the shallow truss of von Mises compared with its
closed form."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.errors import CaseError
from tests.physics.test_steps import run

BASE, RISE, BAR = 1.0, 0.2, 1000.0
"""Half span (m), rise (m), stiffness of each bar (N/m)."""
LENGTH = float(np.hypot(BASE, RISE))

TRUSS = f"""
[[scene.bodies]]
name = "apex"
mass = 0.1
inertia = [1e-3, 1e-3, 1e-3]
position = [0, 0, {RISE}]
[[scene.elements]]
name = "left"
inner = "apex"
outer = "ground"
point_outer = [{-BASE}, 0, 0]
frame = "chord"
translation = [{BAR}, 0, 0]
[[scene.elements]]
name = "right"
inner = "apex"
outer = "ground"
point_outer = [{BASE}, 0, 0]
frame = "chord"
translation = [{BAR}, 0, 0]
[[scene.elements]]
name = "upright"
inner = "apex"
outer = "ground"
rotation = [0, 1, 0]
"""


def force(way: np.ndarray) -> np.ndarray:
    """Closed form: force (N) on the apex as a function of its downward displacement (m)."""
    height = RISE - way
    return 2.0 * BAR * (LENGTH / np.hypot(BASE, height) - 1.0) * height


def limits() -> tuple[np.ndarray, np.ndarray]:
    """Displacements (m) and forces (N) at both limit points."""
    length = np.cbrt(LENGTH * BASE**2)
    ways = RISE - np.array([1.0, -1.0]) * np.sqrt(length**2 - BASE**2)
    return ways, force(ways)


def by_step(most: float) -> str:
    return TRUSS + f"""
[[step]]
name = "press"
kind = "static"
solve = {{ method = "arc-length" }}
[[step.load]]
name = "weight"
body = "apex"
force = [0, 0, {-most}]
"""


def by_case(most: float) -> str:
    load = f'[[load]]\nname = "weight"\nbody = "apex"\nforce = [0, 0, {-most}]\n'
    ramp = 'time = { kind = "ramp", end = 1, shape = "unbounded" }\n'
    return TRUSS + load + ramp + '[solve]\nmethod = "arc-length"\nend_time = 1\n'


@pytest.mark.parametrize("text", [by_step, by_case])
def test_the_truss_of_von_mises_by_force(tmp_path: Path, text: Any) -> None:
    ways, peaks = limits()
    most = 1.5 * float(peaks[0])
    solution, summary = run(tmp_path, text(most))
    path = solution.load_path
    assert path is not None
    assert path.names == ("weight",)
    size, way = path.size[:, 0], path.way[:, 0]
    np.testing.assert_allclose(size, force(way), atol=1e-7 * most)
    assert size[-1] == pytest.approx(most, rel=1e-12)
    assert way[-1] > 2 * RISE  # the apex hangs below its supports
    unstable = (way > ways[0]) & (way < ways[1])
    np.testing.assert_array_equal(path.stable == 0.0, unstable)
    found = summary["step"][-1]["limit_points"]
    assert [point["loads"]["weight"]["size"] for point in found] == pytest.approx(peaks.tolist(), rel=1e-3)
    assert [point["loads"]["weight"]["displacement"] for point in found] == pytest.approx(ways.tolist(), abs=0.02)
    assert summary["method"] == "arc-length"
    # the work of the load is stored in the bars
    stored = 0.5 * 2 * BAR * (np.hypot(BASE, RISE - way[-1]) - LENGTH) ** 2
    assert solution.energy["panels"][-1] + solution.energy["creases"][-1] == pytest.approx(stored, rel=1e-6)
    assert solution.energy["work"][-1] == pytest.approx(stored, rel=1e-2)
    assert summary["energy_error"] < 1e-2
    assert np.all(np.diff(solution.time) > 0.0)
    assert solution.program_time.max() <= 1.0 and np.any(np.diff(solution.program_time) < 0.0)
    with (tmp_path / "out" / "load.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[-1]["weight (N)"]) == pytest.approx(most)
    assert float(rows[-1]["displacement of weight (m)"]) == pytest.approx(way[-1])


def test_shorter_steps_along_the_path_reduce_the_error_of_the_work(tmp_path: Path) -> None:
    """The work is a trapezoidal sum, of second order in the step."""
    text, errors = by_case(1.5 * float(limits()[1][0])), []
    for k, most in enumerate(("20 ms", "10 ms", "5 ms")):
        (tmp_path / str(k)).mkdir()
        _, summary = run(tmp_path / str(k), text, f'solve.max_step="{most}"')
        errors.append(summary["energy_error"])
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.3)


def test_past_the_snap_by_arc_length_and_then_a_motion(tmp_path: Path) -> None:
    """The truss is loaded past its snap and released below: it swings about its mirror image, from rest."""
    _, peaks = limits()
    text = by_step(1.2 * float(peaks[0]))
    text += '[[step]]\nname = "swing"\nkind = "dynamic"\nduration = 0.1\nrelease = ["weight"]\n'
    solution, summary = run(tmp_path, text)
    z = solution.q[solution.step == 2, 1]
    assert z[0] < -RISE and z.max() > -RISE and z.max() < 0.0
    assert summary["step"][1]["method"] == "generalized-alpha"


def test_a_path_by_arc_length_needs_something_that_changes(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match="needs a load or a drive that changes"):
        run(tmp_path, TRUSS + '[[step]]\nkind = "static"\nsolve = { method = "arc-length" }\n')
