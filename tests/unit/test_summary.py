"""Advice in a summary."""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fsm.analyses.deploy_warnings import _unstable_at_end, pull_warnings
from fsm.results.solution import ENERGIES, Layout, Solution
from fsm.run.round_off import RoundOff
from fsm.run.summary import summary_of, unstable_passages
from fsm.run.summary_text import summary_lines
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import Statistics
from fsm.solve.outcome.status import Event
from fsm.solve.settings import Settings
from tests.runs import run


def warned(
    method: str, off: float, step: float | None = None, statistics: Statistics | None = None, drives: tuple[str, ...] = ()
) -> list[str]:
    """Warnings of a run with this method, with or without a fixed step, whose energy balance is off by a part of the
    supplied work."""
    analysis = SimpleNamespace(
        summarise=lambda solution, statistics: {},
        warnings=lambda solution, summary: [],
        steps=lambda: [SimpleNamespace(settings=Settings(method, 1e-4, 1.0, step=step))],
        system=SimpleNamespace(nu=9, dof=9),
        in_python=lambda: (),
    )
    travel = np.zeros((1, len(drives)))
    layout = Layout(drive_names=drives)
    solution = SimpleNamespace(
        time=np.zeros(1), travel=travel, force=travel, negative_pivots=np.zeros(1), layout=layout, step=np.ones(1)
    )
    balance = SimpleNamespace(relative_error=off, relative_drift=off, relative_numerical=0.0)
    exact = RoundOff(1e6, 1e-10, 1.0)
    made = cast(Any, analysis), cast(Any, solution), statistics or Statistics(method), cast(EnergyBalance, balance)
    summary = summary_of(*made, [], exact)
    return list(summary["warnings"])


@pytest.mark.parametrize(
    ("drive", "told"),
    [
        ("arm (turn)", "snap at 11.46 deg of turn: solved with inertia until 17.19 deg; moment 5 N m before, 1 N m after"),
        ("arm", "snap at 200 mm of travel: solved with inertia until 300 mm; force 5 N before, 1 N after"),
    ],
)
def test_an_event_of_a_drive_that_turns_is_told_in_degrees(drive: str, told: str) -> None:
    event = Event("snap", 1.0, 1.1, 0.2, 0.3, 5.0, 1.0)
    statistics = Statistics("static", events=[event])
    assert warned("static", 0.0, statistics=statistics, drives=(drive,)) == [told]


@pytest.mark.parametrize(
    ("method", "step", "helps", "useless"),
    [
        ("modal", None, "vibration.modes", "rtol"),
        ("generalized-alpha", None, "tighten rtol", "vibration.modes"),
        ("generalized-alpha", 1e-4, "reduce solve.step", "rtol"),
    ],
)
def test_a_balance_that_is_off_is_told_with_what_helps(
    method: str, step: float | None, helps: str, useless: str
) -> None:
    (line,) = warned(method, 0.02, step)
    assert "energy balance residual: 0.02" in line
    assert helps in line and useless not in line
    assert warned(method, 1e-4) == []


STRIP = """
[strip]
length = 0.48
width = 0.04
thickness = 3e-4
panels = 6
fold_angle = "80 deg"
segments_per_panel = 2
[material]
young = 3e9
density = 800
[crease]
law = "spline"
angle = ["-3 deg", "0 deg", "5 deg"]
moment = [-4e-4, 0, 7e-4]
interpolation = "pchip"
[[drive]]
crease = 3
direction = [0, 0, 1]
speed = "2 mm/s"
travel = "10 mm"
[solve]
rtol = 1e-4
[save]
every = "1 mm"
"""


def extrapolated(folder: Path, *overrides: str) -> tuple[list[str], Solution]:
    """Warnings for creases beyond their data in a run of the strip, and the results of the run."""
    solution, summary = run(folder, STRIP, *overrides)
    found = [line for line in summary["warnings"] if "measured angles" in line]
    return found, solution


def openings(solution: Solution, crease: int) -> np.ndarray:
    """How far a crease is opened from folded, deg, by the directions of the segments beside it in the saved states."""
    along = solution.shape[:, :, 1] - solution.shape[:, :, 0]
    angle = np.degrees(np.arctan2(along[..., 2], along[..., 0]))
    panel = solution.layout.panel
    before, after = np.flatnonzero(panel == crease)[-1], np.flatnonzero(panel == crease + 1)[0]
    return np.asarray(160.0 - np.abs(angle[:, before] - angle[:, after]))


def degrees(line: str) -> float:
    found = re.search(r"by ([0-9.]+) deg", line)
    assert found is not None, line
    return float(found[1])


def test_creases_beyond_their_data_are_told_with_how_far(tmp_path: Path) -> None:
    """The pictures show the angle without half segments in series: opened past the end, and closed before the beginning."""
    (opened, closed), solution = extrapolated(tmp_path, "strip.half_cell=false")
    assert opened.startswith("crease 1, crease 5 opened beyond the measured angles, which end at 5 deg, crease ")
    assert degrees(opened) == pytest.approx(openings(solution, 1).max() - 5.0, rel=0.01)
    assert closed.startswith("crease 3 closed beyond the measured angles, which begin at -3 deg, by ")
    assert degrees(closed) == pytest.approx(-3.0 - openings(solution, 3).min(), rel=0.01)
    assert "extrapolated linearly there; extend the test" in opened


def test_half_segments_have_their_share_of_how_far(tmp_path: Path) -> None:
    """o + M(o) f is the angle of the segments; beyond the last measured angle M is continued linearly."""
    (_, closed), solution = extrapolated(tmp_path)
    flexibility = 0.04 / (3e9 * 0.04 * 3e-4**3 / 12.0)
    moment = 4e-4 / math.radians(3.0)  # the slope of PCHIP at the ends is near the chords'
    by_itself = (-openings(solution, 3).min() - 3.0 - math.degrees(4e-4 * flexibility)) / (1.0 + moment * flexibility)
    assert degrees(closed) == pytest.approx(by_itself, rel=0.05)


def test_creases_within_their_data_raise_no_warning(tmp_path: Path) -> None:
    wide = ["crease.angle=['-170 deg', '0 deg', '170 deg']", "crease.moment=[-8e-3, 0, 8e-3]"]
    assert extrapolated(tmp_path, *wide)[0] == []
    linear = ["crease={law='linear', stiffness=9e-3}"]
    assert extrapolated(tmp_path, *linear)[0] == []


@pytest.mark.parametrize(
    ("peak", "magnitude", "told"), [(-0.17, None, False), (-0.17, 0.3, True), (0.5, 0.3, False), (0.0, None, False)]
)
def test_a_run_that_only_pushes_is_told_of(peak: float, magnitude: float | None, told: bool) -> None:
    """Without a quasi-static part a negative peak has no largest magnitude beside it: the run ended in an internal error."""
    summary = {"peak_force": peak, "peak_travel": 0.01, "peak_kind": "dynamic", "largest_magnitude": magnitude,
               "largest_magnitude_travel": None if magnitude is None else 0.02}  # fmt: skip
    lines = summary_lines(summary, Path("out"))
    assert any("-0.3 N at 20 mm" in line for line in lines) == told


TAUT = """
[strip]
length = 0.3
width = 0.04
thickness = 0.2e-3
panels = 3
fold_angle = "60 deg"
segments_per_panel = 4
held = [1]
[material]
young = "4 GPa"
density = "1380 kg/m^3"
[crease]
law = "linear"
stiffness = "9 N mm/rad"
[[drive]]
body = "panel 3 segment 4"
direction = [1, 0, 0]
speed = "4 mm/s"
travel = "TRAVEL mm"
"""


@pytest.mark.parametrize(("travel", "told"), [(40, False), (94.1, True)])
def test_a_strip_that_is_stretched_is_told_of(tmp_path: Path, travel: float, told: bool) -> None:
    """From crease 1 to the driven segment, 94 mm along and 11 mm down, it reaches to 93 mm, less at its bend of 60 deg."""
    warnings = run(tmp_path, TAUT.replace("TRAVEL", str(travel)))[1]["warnings"]
    pattern = r"stretched by over 1 % from ([\d.]+) mm of travel on, by ([\d.]+) % at its end"
    matches = [match for text in warnings if (match := re.search(pattern, text))]
    assert bool(matches) == told
    if told:
        assert 80.0 < float(matches[0][1]) <= 94.1 and 1.0 < float(matches[0][2]) < 10.0


def pulled(travel: list[float], force: list[float], kinetic: list[float] | None = None, **energy: list[float]) -> Any:
    """Records of a pull, 1 s apart, with energies that are zero unless given."""
    n, given = len(travel), energy | ({} if kinetic is None else {"kinetic": kinetic})
    energies = {name: np.array(given.get(name, [0.0] * n)) for name in ENERGIES}
    return SimpleNamespace(
        time=np.arange(float(n)), travel=np.array(travel)[:, None], force=np.array(force)[:, None], energy=energies,
        layout=Layout(drive_names=("arm",)),
    )  # fmt: skip


def of_pull(solution: Any, structure: bool = True, method: str = "static", **summary: Any) -> list[str]:
    force, travel = solution.force[:, 0], solution.travel[:, 0]
    found = {"peak_kind": "quasi-static", "peak_travel": travel[np.argmax(force)], "peak_force": force.max(),
             "final_force": force[-1], "method": method, "events": []}  # fmt: skip
    return pull_warnings(solution, found | summary, structure)


@pytest.mark.parametrize(("final", "told"), [(2.0, True), (1.999, True), (1.3, False)])
def test_a_force_that_falls_after_the_travel_has_ended_is_not_rising(final: float, told: bool) -> None:
    """The first of two drives ends first, with its peak, and the other drive takes the load."""
    solution = pulled([0.0, 9e-3, 9e-3], [0.0, 2.0, final])
    assert any("still rising" in line for line in of_pull(solution)) == told


def test_a_constant_force_is_not_rising() -> None:
    """A belt that drags a box needs the same force everywhere; its largest force may be anywhere."""
    assert of_pull(pulled([0.0, 0.5, 0.9, 1.0], [0.0, 2.0, 2.0, 2.0 + 1e-9]), structure=False) == []
    assert any("still rising" in line for line in of_pull(pulled([0.0, 0.5, 0.9, 1.0], [0.0, 1.0, 1.8, 2.0])))


@pytest.mark.parametrize(
    ("creases", "structure", "method", "told"),
    [
        ([0.0, 1e-6, 1e-3, 4e-3], True, "generalized-alpha", ""),  # the elastic energy is still small at the start
        ([0.0, 1e-6, 1e-5, 9e-5], True, "generalized-alpha", "not quasi-static: at 100 mm of travel"),
        ([0.0, 1e-6, 1e-5, 9e-5], True, "static", "statics neglects inertia, but at 100 mm of travel"),
        ([0.0, 1e-6, 1e-5, 9e-5], False, "generalized-alpha", ""),  # a machine: its force is due to inertia at any speed
    ],
)
def test_a_pull_is_told_to_be_slower_only_if_that_helps(
    creases: list[float], structure: bool, method: str, told: str
) -> None:
    solution = pulled([0.0, 0.1, 0.5, 1.0], [0.0, 1.0, 3.0, 2.0], [0.0, 1e-6, 1e-6, 1e-6], creases=creases)
    lines = of_pull(solution, structure, method)
    assert len(lines) == bool(told) and all(line.startswith(told) for line in lines)


def test_kinetic_energy_in_a_snap_of_statics_is_no_fast_pull() -> None:
    solution = pulled([0.0, 0.1, 0.5, 1.0], [0.0, 1.0, 3.0, 2.0], [0.0, 1.0, 0.0, 0.0], creases=[0.0, 1.0, 1.0, 1.0])
    assert of_pull(solution) != []
    assert of_pull(solution, events=[{"time": 0.5, "end_time": 1.5}]) == []


@pytest.mark.parametrize(("drive", "told"), [("arm (turn)", "from 11.46 deg of turn"), ("arm", "from 200 mm of travel")])
def test_an_unstable_end_of_a_drive_that_turns_is_told_in_degrees(drive: str, told: str) -> None:
    solution: Any = SimpleNamespace(
        travel=np.array([[0.0], [0.2], [0.3]]), negative_pivots=np.array([0, 0, 1]), layout=Layout(drive_names=(drive,)),
        energy={"kinetic": np.zeros(3), "panels": np.ones(3)},
    )  # fmt: skip
    (line,) = _unstable_at_end(solution)
    assert told in line


@pytest.mark.parametrize(("kinetic", "kind"), [(0.02, "vibration"), (0.001, "unstable")])
def test_a_negative_pivot_in_a_fast_motion_is_no_snap(kinetic: float, kind: str) -> None:
    """A snap begins near an equilibrium, not in a motion with a kinetic energy above 1 % of the elastic energy."""
    solution: Any = SimpleNamespace(
        time=np.arange(4.0), negative_pivots=np.array([0, 1, 0, 0]), step=np.ones(4), travel=np.arange(4.0)[:, None],
        force=np.zeros((4, 1)), energy={"kinetic": np.full(4, kinetic), "panels": np.ones(4)},
    )  # fmt: skip
    assert [event.kind for event in unstable_passages(solution, [])] == [kind]
