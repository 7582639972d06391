"""A case in other units takes the same steps: no tolerance is a fixed number of metres, kilograms or seconds.

Round-off is compared with forces and with moments, so that no case is refused because of its units.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import fsm
from tests.case_texts import kresling_of_bars
from tests.scaled_case import Factors, scaled

_SAME = 1e-6
"""Largest relative difference of dimensionless results; round-off of contacts and of linear equations is far below it."""

STRIP = """
[strip]
length = "120 mm"
width = "20 mm"
thickness = "0.2 mm"
panels = 4
fold_angle = "70 deg"
segments_per_panel = 4
[material]
young = "3 GPa"
density = 1000
damping = "10 ms"
[crease]
law = "linear"
stiffness = "5 N mm/rad"
[[drive]]
crease = 2
direction = [0, 0, 1]
speed = "2 mm/s"
travel = "10 mm"
[save]
every = "5 mm"
"""
TOUCHING = STRIP + """
[contact]
damping = "10 N s/m"
[friction]
mu_static = 0.3
mu_dynamic = 0.2
v_static = "1 mm/s"
v_dynamic = "10 mm/s"
"""
SHEET = """
gravity = [0, 0, "-9.81 m/s^2"]
[sheet]
kind = "miura"
columns = 2
rows = 1
a = "50 mm"
b = "50 mm"
sector_angle = "60 deg"
fold_angle = "50 deg"
facets = "rigid"
thickness = "0.3 mm"
[[sheet.support]]
at = "facet 1"
[material]
young = "3 GPa"
density = 1000
damping = "0.1 ms"
[crease]
stiffness_per_length = 0.02
[solve]
method = "generalized-alpha"
rtol = 1e-5
end_time = "20 ms"
[save]
interval = "5 ms"
"""
BARS = kresling_of_bars("-20 N", "0.2 s", "50 ms")
FACETS = """
[sheet]
kind = "plate"
length = "100 mm"
width = "20 mm"
facets = "flexible"
mesh = [4, 1]
thickness = "0.3 mm"
[[sheet.support]]
at = "edge left"
clamped = true
[material]
young = "3 GPa"
density = 1000
damping = "1 ms"
"""
LOADED_FACETS = FACETS + """
[[load]]
at = "edge right"
force_per_length = [0, 0, "0.5 N/m"]
[solve]
end_time = "1 s"
[save]
interval = "0.5 s"
"""
TURNED_FACETS = FACETS + """
[[drive]]
edge = "right"
direction = [0, 0, 1]
turn = 0.1
rate = 0.1
axis = [0, -1, 0]
guide = false
[save]
interval = 0.5
"""
FALLING_FACETS = 'gravity = [0, 0, "-9.81 m/s^2"]\n' + FACETS + """
[solve]
method = "generalized-alpha"
end_time = "5 ms"
rtol = 1e-3
[save]
interval = "1 ms"
"""
BODIES = """
gravity = [0, 0, -9.81]
[contact]
restitution = 0.5
speed_floor = "2 mm/s"
stiffness = "2e7 N/m^1.5"
[friction]
law = "lugre"
mu_static = 0.3
mu_dynamic = 0.2
v_stribeck = "10 mm/s"
presliding = "10 um"
[[scene.bodies]]
name = "lower"
mass = "2 g"
inertia = [1.7e-7, 2.7e-7, 4.3e-7]
position = [0, 0, "6 mm"]
orientation = [0.996194698, 0, 0.087155743, 0]
plate = { length = "40 mm", width = "30 mm", thickness = "1.5 mm" }
[[obstacle]]
name = "table"
shape = "plane"
[[scene.pairs]]
first = "lower"
second = "table"
[solve]
end_time = "30 ms"
rtol = 1e-4
[save]
interval = "10 ms"
"""
FILM = """
analysis = "vibrate"
[membrane]
length = "100 mm"
width = "100 mm"
thickness = "25 um"
mesh = [2, 2]
[material]
young = "2.5 GPa"
density = 1400
[tension]
strain = 1e-3
[impact]
pulse = "half-sine"
force = "0.01 N"
duration = "5 ms"
point = [0, 0]
[vibration]
duration = "20 ms"
modes = 2
"""
ARRAY = """
analysis = "scissor"
[scissor]
shape = "linear"
units = 1
bar_length = "1 m"
initial_angle = "75 deg"
elements_per_bar = 2
[bar]
width = "20 mm"
height = "12 mm"
[material]
young = "207 GPa"
density = 7850
damping = 0
[[hold]]
point = "b1"
[[hold]]
point = "a1"
kind = "slider"
direction = [0, 1]
[[force]]
point = "a1"
force = [0, "-50 N"]
time = { kind = "ramp", end = "20 ms" }
[solve]
end_time = "0.1 s"
[save]
interval = "20 ms"
"""


def _with(text: str, method: str, **more: str) -> str:
    """Case text with a method and further keys of [solve]."""
    keys = "".join(f"{key} = {value}\n" for key, value in more.items())
    given = f'method = "{method}"\n{keys}'
    if "[solve]" not in text:
        return f"{text}[solve]\n{given}"
    lines = [line for line in text.splitlines() if not line.startswith(("method", *more))]
    return "\n".join(lines).replace("[solve]", f"[solve]\n{given}") + "\n"


CASES = {
    "strip": _with(STRIP, "static", rtol="1e-4"),
    "touching strip": _with(TOUCHING, "static", rtol="1e-4"),
    "strip in motion": _with(STRIP, "generalized-alpha", rtol="1e-3").replace('"2 mm/s"', '"100 mm/s"'),
    "sheet": SHEET,
    "slow sheet": SHEET.replace("-9.81", "-9.81e-4").replace("0.02", "2e-6").replace("20 ms", "2 s"),
    **{f"sheet, {m}": _with(SHEET, m) for m in ("mean-force", "Radau-blocks")},
    "bars": _with(BARS, "static", rtol="1e-4"),
    "bars by arc length": _with(BARS, "arc-length"),
    "bars in motion": _with(BARS, "generalized-alpha", rtol="1e-3"),
    "facets": _with(LOADED_FACETS, "static", rtol="1e-4"),
    "turned facets": _with(TURNED_FACETS, "static", rtol="1e-3"),
    "facets in motion": FALLING_FACETS,
    "bodies": BODIES,
    "film": FILM,
    "array": ARRAY,
}


def _numbers(result: Any, factors: Factors) -> tuple[tuple[int, int], int, list[np.ndarray]]:
    """Steps and warnings, Newton iterations, and dimensionless results of a run."""
    solution, summary = result.solution, result.summary
    energies = [energy / factors.of("J") for energy in solution.energy.values()]
    largest = max(float(np.abs(energy).max(initial=0.0)) for energy in energies) or 1.0
    places = [solution.time / factors.time, solution.shape / factors.length]
    counts = summary["steps"], len(summary["warnings"])
    return counts, summary["newton_iterations"], [*places, np.array(energies) / largest]


@pytest.mark.parametrize("name", CASES)
def test_a_similar_case_takes_the_same_steps(name: str) -> None:
    case, rng = fsm.load(CASES[name]), np.random.default_rng(3)
    one = Factors(1.0, 1.0, 1.0)
    counts, iterations, numbers = _numbers(case.run(), one)
    assert counts[0] > 1
    for factors in (Factors(4.0**-10, 4.0**-12, 4.0**-3), Factors(4.0**5, 4.0**14, 4.0**6), Factors.drawn(rng)):
        others = _numbers(scaled(case, factors).run(), factors)
        assert others[0] == counts, factors
        assert abs(others[1] - iterations) <= 0.01 * iterations
        for found, expected in zip(others[2], numbers, strict=True):
            assert np.abs(found - expected).max() <= _SAME * np.abs(expected).max()
