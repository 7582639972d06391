"""Why steps are computed in Python: `fsm check`, the summary and the system of a run say the same."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from fsm.analyses.deploy import Deployment
from fsm.case.loading.load_case import LoadedCase
from fsm.case.models.case import Case
from fsm.check.report import describe
from fsm.model.plan.in_python import cost_in_python
from fsm.run.run_case import run_case
from fsm.run.summary import _COSTLY
from fsm.solve.equations.linear import LinearSolver

TABLE = {"law": "spline", "angle": [0.0, 1.0, 2.0], "moment": [0.0, 5e-3, 8e-3]}
STRIP: dict[str, Any] = {
    "strip": {
        "length": 0.24, "width": 0.04, "thickness": 3e-4, "panels": 4, "fold_angle": "50 deg", "segments_per_panel": 2,
    },
    "material": {"young": 3e9, "density": 800, "damping": "1 ms"}, "crease": {"law": "linear", "stiffness": 9e-3},
    "drive": [{"crease": 2, "direction": [0, 0, 1], "speed": 2e-3, "travel": 0.001}],
}  # fmt: skip
CONTACT = {"law": "hertz", "stiffness": 1e6, "thickness_in_gap": False}
SLIDING = {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 1e-3, "v_dynamic": 2e-3}


def strip(method: str, **more: Any) -> Case:
    """Pulled strip."""
    return Case.model_validate(STRIP | {"solve": {"method": method} | more.pop("solve", {})} | more)


def tube(method: str, facets: str) -> Case:
    """Tube of folded facets between two lids, with gas."""
    sheet = {
        "kind": "miura-tube", "columns": 2, "a": 0.04, "b": 0.06, "sector_angle": "70 deg", "fold_angle": "80 deg",
        "facets": facets, "thickness": 2e-4, "support": [{"at": "edge left"}],
    } | ({"mesh_size": 0.04} if facets == "flexible" else {})  # fmt: skip
    gas = {"closed_by": [{"cap": "edge left"}, {"cap": "edge right"}], "supply_pressure": 1e3}
    return Case.model_validate({
        "sheet": sheet, "material": STRIP["material"], "crease": {"law": "linear", "stiffness_per_length": 0.05},
        "gas": [gas], "solve": {"method": method, "end_time": 1.0},
    })  # fmt: skip


CASES: dict[str, tuple[Case, str]] = {
    "static": (strip("static"), ""),
    "static with contact": (strip("static", contact=CONTACT), ""),
    "motion with contact": (strip("generalized-alpha", contact=CONTACT), ""),
    "Radau": (strip("Radau"), 'the method "Radau" has no compiled form'),
    "two branches": (
        strip("generalized-alpha", crease=TABLE | {"unloading": [0.0, 2e-3, 5e-3]}),
        "",
    ),
    "two branches in statics": (strip("static", crease=TABLE | {"unloading": [0.0, 2e-3, 5e-3]}), ""),
    "friction along and across": (
        strip("generalized-alpha", contact=CONTACT, friction=SLIDING | {"across": 0.5}, solve={"spatial": True}),
        "",
    ),
    "gas in statics": (tube("static", "bars"), ""),
    "gas in motion": (tube("generalized-alpha", "bars"), ""),
    "gas of panels in statics": (tube("static", "rigid"), ""),
    "gas of flexible facets in statics": (tube("static", "flexible"), ""),
    "gas of panels in motion": (tube("generalized-alpha", "rigid"), ""),
}


@pytest.mark.parametrize("name", CASES)
def test_the_report_of_a_case_and_its_system_agree(name: str) -> None:
    case, reason = CASES[name]
    analysis = Deployment(case, "", [])
    assert "; ".join(analysis.in_python()) == reason
    line = next(line for line in describe(case) if line.startswith("compiled"))
    assert (line.split(": ", 1)[1] == reason) if reason else line.endswith("steps in one kernel")
    system, ready = analysis.enter(len(analysis.plan.steps) - 1, None), LinearSolver().ready
    method = analysis.method()[0]
    if method != "Radau":
        arrays = system.static_arrays(ready) if method == "static" else system.arrays(ready)
        assert (arrays is None) == bool(reason)


def test_a_released_strip_has_compiled_steps() -> None:
    """The half joints beside the driven line act from the second step on."""
    pull = {"name": "pull", "kind": "static", "drive": STRIP["drive"]}
    free = {"name": "free", "kind": "dynamic", "release": ["all"], "duration": "1 ms"}
    case = Case.model_validate({key: STRIP[key] for key in ("strip", "material", "crease")} | {"step": [pull, free]})
    analysis = Deployment(case, "", [])
    assert analysis.in_python() == ()
    system = analysis.enter(1, None)
    assert system.arrays(LinearSolver().ready) is not None
    assert [line.removeprefix("compiled").strip() for line in describe(case) if "kernel in step" in line] == [
        "steps in one kernel in step 'pull'", "steps in one kernel in step 'free'",
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["static", "two branches"])
def test_the_summary_says_why_steps_are_in_python(name: str, tmp_path: Path) -> None:
    case, reason = CASES[name]
    summary = run_case(LoadedCase(case, "", tmp_path / "case.toml"), tmp_path / "out", progress=False, figures=False)
    assert summary["steps_compiled"] is (not reason)
    assert summary["steps_in_python_because"] == ([reason] if reason else [])
    assert not any("in Python" in warning for warning in summary["warnings"])  # a short run


def test_the_cost_agrees_with_the_measured_strip() -> None:
    assert cost_in_python(120) == pytest.approx(301 / 32, rel=0.05)
    assert cost_in_python(10_000) < _COSTLY


def test_the_reasons_are_found_without_the_compiler(tmp_path: Path) -> None:
    lines = "import sys, fsm.check.report; assert 'numba' not in sys.modules"
    subprocess.run([sys.executable, "-c", lines], check=True, cwd=tmp_path)
