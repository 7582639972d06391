"""Loads that grow in time, without drives: slow ones follow equilibria, fast ones are named, and motions start from zero."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import fsm
from tests.case_texts import kresling_of_bars

STRIP = """
[strip]
length = "600 mm"
width = "25 mm"
thickness = "0.125 mm"
panels = 5
fold_angle = "75 deg"
segments_per_panel = 10
held = [1]
[material]
young = "2.5 GPa"
density = 1420
damping = "10 ms"
[crease]
law = "linear"
stiffness = "1.5 N mm/rad"
[[load]]
body = "panel 5 segment 10"
force = ["2 mN", 0, 0]
time = { kind = "ramp", shape = "linear", end = "100 s" }
[solve]
end_time = "100 s"
method = "static"
[save]
interval = "0.5 s"
"""
KRESLING = kresling_of_bars("-40 N", "0.4 s", "5 ms").replace("[material]", '[sheet.bars]\nlaw = "ogden"\n[material]')


def _at(result: Any, displacement: float) -> float:
    """Load (N) at a displacement (m) of a path of equilibria."""
    path = result.solution.load_path
    return float(np.interp(displacement, path.way[:, 0], path.size[:, 0]))


def test_a_slow_ramp_follows_the_equilibria() -> None:
    """The same curve by arc length; a straight line over 270 mm was a motion whose records were left out."""
    case = fsm.load(STRIP)
    ramp, arc = case.run(), case.set({"solve.method": "arc-length", "save.interval": None}).run()
    assert ramp.summary["events"] == []
    assert _at(ramp, 0.05) == pytest.approx(_at(arc, 0.05), rel=0.02)


def test_a_fast_ramp_is_named_with_its_loads_and_the_remedy() -> None:
    case = fsm.load(STRIP).set({"load.0.time.end": "1 s", "solve.end_time": "1 s", "save.interval": "20 ms"})
    (text,) = (text for text in case.run().summary["warnings"] if "too fast" in text)
    assert "mm): solved with inertia until" in text
    assert 'set solve.method = "arc-length"' in text


def test_a_fast_ramp_in_a_step_is_named_with_its_loads() -> None:
    """Loads at the start of the motion, with the displacement since the start of the step."""
    steps = """
[[step]]
name = "slow"
kind = "static"
duration = "1 s"
[[step]]
name = "fast"
kind = "static"
duration = "1.1 s"
"""
    table = '{ kind = "table", time = [0, 2, 2.1], value = [0, 0.02, 1] }'
    text = STRIP.replace('{ kind = "ramp", shape = "linear", end = "100 s" }', table).replace('end_time = "100 s"\n', "")
    coarse = text.replace("segments_per_panel = 10", "segments_per_panel = 3").replace("segment 10", "segment 3")
    summary = fsm.load(coarse.replace('"0.5 s"', '"0.25 s"') + steps).run().summary
    (event,) = summary["events"]
    ((name, (size, moved)),) = event["loads"].items()
    assert (event["kind"], event["time"], size) == ("motion", pytest.approx(2.0, abs=0.02), pytest.approx(4e-5, rel=0.5))
    assert 2e-3 < moved < 5e-3
    (warning,) = (text for text in summary["warnings"] if "too fast" in text)
    assert f"({name} {1e3 * size:.4g} mN at {1e3 * moved:.4g} mm): solved with inertia until" in warning


def test_bars_move_from_rest_with_default_settings() -> None:
    """The energies of a load that begins to grow are below their round-off; the run ended at 200,000 steps before 10 ms."""
    moved = fsm.load(KRESLING).run()
    still = fsm.load(KRESLING).set("solve.method", "static").run()
    assert moved.summary["method"] == "mean-force"
    assert moved.summary["steps"] < 5000
    way = [float((one.shape[0] - one.shape[-1])[..., 2].max()) for one in (moved, still)]  # the twist decays slowly
    assert way[0] == pytest.approx(way[1], rel=1e-3)


def test_a_motion_past_a_limit_load_is_a_snap() -> None:
    """Dampers let the bars lag behind their path of equilibria, whose limit load is 65.3 N by arc length."""
    text = kresling_of_bars("-70 N", "0.2 s", "20 ms").replace("[material]", '[sheet.bars]\nlaw = "ogden"\n[material]')
    summary = fsm.load(text).set("solve.method", "static").run().summary
    (event,) = summary["events"]
    ((size, _),) = event["loads"].values()
    assert (event["kind"], size) == ("snap", pytest.approx(65.3, rel=0.03))
    assert any("limit load reached" in text for text in summary["warnings"])
