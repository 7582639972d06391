"""Cases of scissor arrays: a complete run, and mistakes that are reported early."""


import numpy as np
import pytest

from fsm.analyses.choose import analysis_of
from fsm.case.loading.load_case import load_case
from fsm.check.array import describe_array
from fsm.errors import CaseError
from fsm.results.store import read_solution
from fsm.results.summary_file import read_summary
from fsm.run import recorder
from fsm.run.run_case import run_case

CASE = """
analysis = "scissor"
[scissor]
units = 2
bar_length = 1.0
initial_angle = "75 deg"
elements_per_bar = 2
[bar]
width = 0.02
height = 0.012
[material]
young = 2.07e11
poisson = 0.0
density = 7850
damping = 0.0
[[force]]
point = "a1"
force = [0, -50]
time = { kind = "ramp", end = 0.02 }
[solve]
end_time = 0.2
step = 1e-3
rtol = 1e-4
[save]
interval = 0.02
"""


@pytest.fixture
def case_file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


@pytest.mark.figures
def test_a_whole_run(case_file, tmp_path):
    """Summary with its additional keys, points of a rigid array in the results, curves and pictures."""
    out = tmp_path / "out"
    summary = run_case(load_case(case_file), out, progress=False)
    assert summary == read_summary(out / "summary.json")
    assert summary["units"] == 2 and summary["elements_per_bar"] == 2
    assert set(summary["max_difference_rigid"]) == {"displacement_x", "displacement_y", "velocity", "acceleration"}
    assert list(summary["max_asynchronism"]) == ["a2-a3"]
    assert 0.0 < summary["max_difference_rigid"]["displacement_x"] < 0.01
    solution = read_solution(out / "result.h5")
    motion = solution.array
    assert motion.point_names == ("a1", "a2", "a3", "b1", "b2", "b3", "h1", "h2")
    assert motion.points.displacement.shape == motion.rigid.velocity.shape == (11, 8, 2)
    slope = np.gradient(motion.rigid.displacement[:, 2, 0], solution.time)
    assert slope[3:-1] == pytest.approx(motion.rigid.velocity[3:-1, 2, 0], rel=0.05)
    assert motion.stress.shape == (11, 4)
    for name in ("points.csv", "points.png", "rigid.png", "synchronism.png", "stress.png", "motion.gif", "energy.png"):
        assert (out / name).stat().st_size > 1000
    assert not (out / "force.csv").exists() and not (out / "force.png").exists()  # the array has no drive
    header = (out / "points.csv").read_text().splitlines()[0].split(",")
    assert header[:4] == ["time (s)", "a1 x (m)", "a1 y (m)", "a1 vx (m/s)"]


def test_rigid_bars_are_the_comparison(case_file, tmp_path):
    """`rigid = true` gives the results with which the flexible run compares itself."""
    run_case(load_case(case_file), tmp_path / "flexible", progress=False)
    summary = run_case(load_case(case_file, ["scissor.rigid=true"]), tmp_path / "rigid", progress=False)
    assert summary["method"] == "Radau-blocks"
    assert summary["max_difference_rigid"] == {}
    flexible, rigid = (read_solution(tmp_path / name / "result.h5").array for name in ("flexible", "rigid"))
    assert rigid.points.displacement == pytest.approx(flexible.rigid.displacement, abs=1e-6)


def test_the_plan_says_whose_steps_are_taken(case_file):
    """`solve.step` belongs to the stepwise methods; rigid bars are solved by Radau's method with its own steps."""

    def solver(*overrides):
        return next(line for line in describe_array(load_case(case_file, overrides).case) if line.startswith("solve"))

    assert "generalized-alpha, steps of 1 ms" in solver()
    assert "steps of 1 ms" in solver("scissor.rigid=true", "solve.method=generalized-alpha")
    assert "newmark, steps of 1 ms" in solver("solve.method=newmark")
    rigid = solver("scissor.rigid=true")
    assert "Radau-blocks" in rigid and "1 ms" not in rigid and "solve.step is not used" in rigid
    assert "solve.step" not in solver("scissor.rigid=true", "solve.step=none")


LATCH = ["stop.angle=73 deg", "stop.stiffness=2000", "stop.damping=1", "solve.end_time=0.4", "stop.latch=true"]


def test_latches_last_over_a_checkpoint(case_file, tmp_path, monkeypatch):
    """If it is interrupted after its hinges have latched, a run continues with the same latching times; the summary and the
    plan name them."""
    assert any("latch" in line for line in describe_array(load_case(case_file, LATCH).case))
    assert not any("latch" in line for line in describe_array(load_case(case_file, LATCH[:-1]).case))
    whole = run_case(load_case(case_file, LATCH), tmp_path / "whole", progress=False)
    assert [item["hinge"] for item in whole["latched"]] == ["h1", "h2"]
    times = [item["time"] for item in whole["latched"]]
    assert 0.2 < times[0] < times[1] < 0.3
    assert not any("latched" in line for line in whole["warnings"])
    monkeypatch.setattr(recorder, "CHECKPOINT_EVERY", 0.0)

    def cut(fraction):
        if fraction > 0.8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_case(load_case(case_file, LATCH), tmp_path / "cut", progress=cut)
    again = run_case(load_case(case_file, LATCH), tmp_path / "cut", progress=False, resume=True)
    assert again["latched"] == whole["latched"]
    one, two = (read_solution(tmp_path / name / "result.h5") for name in ("whole", "cut"))
    assert two.summary["latched"] == whole["latched"]
    travel = np.abs(one.array.points.displacement).max()
    assert np.abs(two.array.points.displacement - one.array.points.displacement).max() < 1e-4 * travel


def test_a_latch_that_is_not_reached(case_file, tmp_path):
    """The list is empty, and a warning names the hinges."""
    summary = run_case(load_case(case_file, [*LATCH, "stop.angle=20 deg"]), tmp_path / "out", progress=False)
    assert summary["latched"] == []
    assert "not latched at the end: h1, h2" in summary["warnings"]


@pytest.mark.parametrize(
    ("overrides", "path", "words"),
    [
        (["scissor.units=0"], "scissor.units", "at least 1"),
        (["scissor.initial_angle=90 deg"], "scissor.initial_angle", "less than"),
        (["scissor.shape=ring", "scissor.units=6", "scissor.initial_angle=25 deg"], "scissor.initial_angle", "deployed"),
        (["scissor.shape=ring", "scissor.units=6", "scissor.initial_angle=70 deg"], "scissor.initial_angle", "centre"),
        (["scissor.shape=ring"], "scissor", "at least 3 units"),
        (["scissor.shape=arched", "scissor.hinge=0.2", "scissor.units=40"], "scissor.units", "at most"),
        (["scissor.shape=arched"], "scissor", "is straight"),
        (["scissor.hinge=0.4"], "scissor", "needs hinge = 0.5"),
        (["stop.angle=80 deg", "stop.stiffness=100"], "stop.angle", "must be less than scissor.initial_angle"),
        (["force.0.point=a4"], "force.0.point", "a1 ... a3"),
        (["hold=[{point='q1'}]"], "hold.0.point", "no point"),
        (["hold=[{point='a1', kind='slider', direction=[1, 1]}]"], "hold.0.direction", "not parallel to an axis"),
        (["hold=[{point='a1', kind='slider'}]"], "hold.0", "direction"),
        (["force=none"], "force", "has no load"),
        (["force.0.radial=3", "force.0.force=none"], "force.0.radial", "no centre"),
        (["solve.end_time=none"], "solve.end_time", "missing"),
        (["solve.method=static", "solve.step=none"], "solve.method", "dynamic"),
        (["solve.increment=1 mm"], "solve.increment", "has no drive"),
        (["solve.imperfection=0.5"], "solve.imperfection", "has no drive"),
        (["bar=none"], "bar", "missing"),
        (["scissor.rigid=true", "stop.angle=20 deg", "stop.stiffness=10"], "stop", "rigid"),
        (["scissor.rigid=true", "stop.angle=20 deg", "stop.stiffness=10", "stop.latch=true"], "stop", "no latch"),
        (["stop.latch=true"], "stop.angle", "missing"),
        (["strip.length=1"], "strip", "not used"),
    ],
)  # fmt: skip
def test_mistakes(case_file, overrides, path, words):
    """One clear line with path, value and remedy."""
    with pytest.raises(CaseError) as error:
        load_case(case_file, overrides)
    told = [fault for fault in error.value.faults if fault.path == path]
    assert told and words in told[0].message, told


@pytest.mark.parametrize(("method", "step"), [("generalized-alpha", 1e-3), ("newmark", 1e-3), ("Radau", None)])
def test_whose_steps_are_taken(case_file, method, step):
    settings = analysis_of(load_case(case_file).case).settings(method)
    assert settings.step == step
