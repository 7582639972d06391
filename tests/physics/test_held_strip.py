"""Warning about a last state that only friction and dampers hold: its force still changes towards another equilibrium."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.runs import run

CASE = """
[strip]
length = "114 mm"
width = "18 mm"
thickness = "0.11 mm"
panels = 3
fold_angle = "83 deg"
segments_per_panel = 8
held = [1]

[material]
young = "51 GPa"
poisson = 0.3
density = "1600 kg/m^3"
damping = "10 ms"

[crease]
law = "linear"
stiffness = "8.76 N mm/rad"

[contact]
stiffness = "1e10 N/m^1.5"
damping = "10 N s/m"
ramp = "10 um"

[friction]
mu_static = 0.37
mu_dynamic = 0.26
v_static = "1 mm/s"
v_dynamic = "10 mm/s"

[[drive]]
direction = [0, 0, 1]
crease = 2
speed = "0.5 mm/s"
travel = "15.1 mm"
"""


@pytest.mark.parametrize(("settings", "unstable"), [((), True), (("friction=none",), False)])
def test_unstable_last_state(settings: tuple[str, ...], unstable: bool, tmp_path: Path) -> None:
    _, summary = run(tmp_path, CASE, *settings)
    assert summary["unstable_at_end"] is unstable
    assert any("the last state is unstable" in warning for warning in summary["warnings"]) is unstable
