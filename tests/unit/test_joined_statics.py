"""Quasi-static paths of bodies with films, cables and bars: one kernel computes the same steps as Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.model.compile.compile_case import compile_case
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import PathSettings
from fsm.solve.statics.static import follow

TUBE = """
[sheet]
kind = "miura-tube"
columns = 2
a = "40 mm"
b = "60 mm"
sector_angle = "70 deg"
fold_angle = "89 deg"
facets = "bars"
thickness = "0.2 mm"
[[sheet.support]]
at = "edge left"
fixed = ["x"]
[[sheet.support]]
at = "vertices 1, 3"
fixed = ["z"]
[[sheet.support]]
at = "vertex 1"
fixed = ["y"]
[material]
young = "3 GPa"
poisson = 0.3
density = "1400 kg/m^3"
damping = "0.5 s"
[crease]
stiffness_per_length = "0.05 N m/rad/m"
[contact]
law = "linear"
stiffness = "2e4 N/m"
damping = "2e3 N s/m"
[friction]
law = "tanh"
mu_dynamic = 0.3
v_static = "1 um/s"
[[drive]]
edge = "right"
direction = [1, 0, 0]
guide = false
time = { kind = "table", time = [0, 200, 400], travel = ["0 mm", "-5 mm", "10 mm"] }
[solve]
method = "static"
max_step = "10 s"
"""
"""Bars, folds with dampers, and contact of facets with friction."""
MOVING = TUBE.replace('[crease]\n', '[crease]\nrest_angle = "80 deg"\n')
"""Rest angles move."""
CURVE = """law = "spline"
width = "60 mm"
angle = ["-90 deg", "-30 deg", "0 deg", "60 deg", "180 deg"]
moment = ["-4 N mm", "-2 N mm", "0 N mm", "3 N mm", "5 N mm"]
unloading = ["-5 N mm", "-3 N mm", "-1 N mm", "1 N mm", "3 N mm"]
"""
HYSTERESIS = TUBE.replace('stiffness_per_length = "0.05 N m/rad/m"\n', CURVE)
"""Creases dissipate energy along their path."""
SEAM = """
units = "SI"
[strip]
length = "120 mm"
width = "40 mm"
thickness = "0.5 mm"
panels = 3
fold_angle = "70 deg"
segments_per_panel = 2
held = []
[material]
young = "3 GPa"
poisson = 0.34
density = "1420 kg/m^3"
damping = "2 ms"
[crease]
law = "linear"
stiffness = "0.15 N m/rad"
[[scene.films]]
name = "film"
length = "60 mm"
width = "40 mm"
thickness = "25 um"
young = "3 GPa"
poisson = 0.34
density = "1420 kg/m^3"
viscosity = "1 ms"
mesh = [3, 2]
strain = [0.0002, 0]
position = ["71.054417 mm", 0, "37.587705 mm"]
held = ["right"]
[[scene.seams]]
name = "seam"
film = "film"
edge = "left"
bodies = ["panel 3 segment 2"]
stiffness = "1e7 Pa"
[[scene.cables]]
name = "cable"
start = ["40 mm", 0, "60 mm"]
end = ["41 mm", 0, "100 mm"]
diameter = "1 mm"
young = "1 GPa"
density = "1000 kg/m^3"
elements = 2
strain = 0.001
held = ["start", "end"]
[[drive]]
bodies = ["panel 1 segment 1", "panel 1 segment 2"]
direction = [-1, 0, 0]
speed = "10 mm/s"
travel = "4 mm"
[solve]
method = "static"
"""
"""Rigid segments with creases, a viscous film at oriented frames of a seam, and a cable, under gravity."""
FACETS = """
units = "SI"
[sheet]
kind = "plate"
length = "80 mm"
width = "20 mm"
thickness = "0.2 mm"
facets = "flexible"
mesh = [6, 2]
[[sheet.support]]
at = "edge left"
clamped = true
[material]
young = "3 GPa"
poisson = 0.3
density = "1400 kg/m^3"
damping = "1 ms"
[contact]
law = "linear"
stiffness = "2e4 N/m"
ramp = "1 um"
[[obstacle]]
name = "drum"
shape = "cylinder"
radius = "10 mm"
length = "40 mm"
position = ["50 mm", "10 mm", "-12 mm"]
[[drive]]
edge = "right"
direction = [0, 0, -1]
speed = "10 mm/s"
travel = "20 mm"
[solve]
method = "static"
"""
"""A viscous plate of flexible facets is bent over a cylinder; membrane efforts are unknowns of their own."""


def follow_case(path: Path, compiled: bool, end: float) -> tuple[Any, list[SavedState], Any]:
    """System, saved states and statistics of the beginning of a path."""
    _, system = compile_case(load_case(path).case)
    assert not system.in_python.of("static")
    if not compiled:
        system.__dict__["static_arrays"] = lambda ready: None
    saved = list[SavedState]()
    settings = PathSettings(end, 0.1 * end, rtol=1e-4)
    statistics, _ = follow(system, settings, np.linspace(0.0, end, 4).tolist(), saved.append)
    return system, saved, statistics


@pytest.mark.parametrize(
    ("text", "end"),
    [(TUBE, 260.0), (MOVING, 60.0), (HYSTERESIS, 60.0), (SEAM, 0.4), (FACETS, 1.0)],
    ids=["tube", "rest angles that move", "hysteresis", "seam", "flexible facets"],
)
def test_one_kernel_computes_the_steps_of_python(tmp_path: Path, text: str, end: float) -> None:
    """Steps, iterations, observations, coordinates and memory agree."""
    path = tmp_path / "case.toml"
    path.write_text(text)
    system, saved, statistics = follow_case(path, True, end)
    reference, expected, by_python = follow_case(path, False, end)
    assert (statistics.steps, statistics.newton_iterations) == (by_python.steps, by_python.newton_iterations)
    scales = system.scales()
    for one, other in zip(saved, expected, strict=True):
        moved = np.abs(system.difference(one.q, other.q)) / scales.span
        assert one.time == other.time and moved.max() < 1e-9
        energy, of_python = one.observation.energy, other.observation.energy
        assert energy.potential.keys() == of_python.potential.keys()
        largest = max(abs(value) for value in of_python.potential.values())
        for name, value in of_python.potential.items():
            assert energy.potential[name] == pytest.approx(value, rel=1e-7, abs=1e-9 * largest)
        powers = "kinetic", "dissipated_power", "input_power", "sliding_power"
        for name in powers:
            assert getattr(energy, name) == pytest.approx(getattr(of_python, name), rel=1e-5, abs=1e-9 * largest)
        np.testing.assert_allclose(one.observation.drive.force, other.observation.drive.force, rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(one.observation.pairs.force, other.observation.pairs.force, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(one.observation.pairs.gap, other.observation.pairs.gap, rtol=1e-6, atol=1e-12)
        assert one.observation.reaction == pytest.approx(other.observation.reaction, rel=1e-6)
    np.testing.assert_allclose(system.memory(), reference.memory(), rtol=1e-6, atol=1e-9)
