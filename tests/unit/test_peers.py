"""Work-precision comparison with another program: the time to reach an error, tables, and reference solutions of
mechanisms."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from fsm.errors import NotConverged
from validation.gallery.record import NotCompared, Place
from validation.peers import gallery, rigid
from validation.peers.cases import ALL
from validation.peers.sweep import (
    FSM,
    PEER,
    PLAIN,
    PeerCase,
    Point,
    Run,
    measure,
    plot,
    ratio,
    table,
    time_to_error,
    verdict,
    write_csv,
)


def sweep(tool: str, *rows: tuple[float, float], method: str = "m") -> list[Point]:
    return [Point(tool, method, f"run {k}", seconds, error) for k, (seconds, error) in enumerate(rows)]


def test_between_two_points_a_power_law() -> None:
    # error = 1/seconds^2, so 1e-3 is reached at sqrt(1000)
    found = time_to_error(sweep(FSM, (10.0, 1e-2), (100.0, 1e-4)), 1e-3)
    assert found is not None
    assert found.seconds == pytest.approx(math.sqrt(1000.0))
    assert found.point.setting == "run 1"
    assert not found.bound


def test_a_point_that_is_beaten_in_both_does_not_count() -> None:
    # the second run is slower and less accurate than the first, and the third is accurate by chance
    found = time_to_error(sweep(FSM, (1.0, 1e-2), (5.0, 0.3), (4.0, 1e-4)), 1e-3)
    assert found is not None
    assert found.seconds == pytest.approx(2.0)


def test_the_quickest_run_may_be_good_enough_and_none_may_be() -> None:
    found = time_to_error(sweep(FSM, (2.0, 1e-5), (3.0, 1e-6)), 1e-3)
    assert found is not None
    assert (found.seconds, found.bound) == (2.0, True)
    assert time_to_error(sweep(FSM, (1.0, 0.1), (9.0, 0.002)), 1e-3) is None
    assert time_to_error([], 1e-3) is None


def test_an_error_of_nothing_is_no_division_by_zero() -> None:
    found = time_to_error(sweep(FSM, (1.0, 1e-2), (3.0, 0.0)), 1e-3)
    assert found is not None
    assert 1.0 < found.seconds < 3.0


def test_the_better_method_counts_and_who_wins_is_said() -> None:
    points = [
        *sweep(FSM, (8.0, 1e-4)),
        *sweep(FSM, (4.0, 1e-4), method="other"),
        *sweep(PEER, (1.0, 1e-4)),
    ]
    assert ratio(points, 1e-3) == pytest.approx(0.25)
    assert verdict(points, 1e-3) == "**Exudyn 4 times faster**"
    assert verdict(points[:2], 1e-3) == "only fsm gets there"
    assert math.isnan(ratio(points[:2], 1e-3))
    assert verdict([], 1e-3) == "neither gets there"
    plain = [*points, *sweep(PLAIN, (12.0, 1e-4))]
    assert ratio(plain, 1e-3) == pytest.approx(0.25)
    assert ratio(plain, 1e-3, PLAIN) == pytest.approx(3.0)
    assert verdict(plain, 1e-3, PLAIN) == "fsm 3 times faster"


def case(points: list[Point]) -> PeerCase:
    settings = {FSM: "springs of 1 N/m", PEER: "constraints, modified Newton"}
    return PeerCase("top", "a top", "its own equation", settings, list, points=points)


def test_the_table_shows_times_settings_and_the_winner(tmp_path: Path) -> None:
    shown = case([*sweep(FSM, (0.5, 1e-4)), *sweep(PEER, (0.002, 1e-2), (0.02, 1e-4))])
    text = table([shown])
    for part in ("springs of 1 N/m", "constraints, modified Newton", "its own equation", "≤ 500 ms (m, run 0)", "6.32 ms",
                 "**Exudyn 79 times faster**"):  # fmt: skip
        assert part in text, part
    widths = {line.count("|") for line in text.splitlines() if line}
    assert widths == {5, 6, 8}
    plain = table([case([*shown.points, *sweep(PLAIN, (4.0, 1e-4))])])
    assert "6.32 ms (m, run 1) | **Exudyn 79 times faster** | ≤ 4000 ms (m, run 0) | fsm 8 times faster |" in plain
    assert "| a top | Exudyn, m | ≤ 2 ms | 6.32 ms |" in text
    assert "not possible: no gears" in table([PeerCase("x", "x", "", {}, list, impossible="not possible: no gears")])
    write_csv(shown, {"cpu": "some"}, tmp_path / "top.csv")
    with (tmp_path / "top.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["tool"] for row in rows] == [FSM, PEER, PEER]
    assert rows[2]["cpu"] == "some"
    assert float(rows[2]["error"]) == 1e-4
    assert plot(shown, tmp_path / "top.png").stat().st_size > 1000


def test_programs_take_turns_and_what_fails_is_left_out() -> None:
    order: list[str] = []

    def run(tool: str, setting: str, seconds: float, error: float) -> Run:
        def solve() -> tuple[float, float]:
            order.append(tool)
            if error < 0.0:
                raise NotConverged("at t = 1 s")
            return seconds + 1e-3 * len(order), error

        return Run(tool, "m", setting, solve)

    told: list[str] = []
    runs = [run(FSM, "a", 0.1, 0.1), run(FSM, "b", 0.1, -1.0), run(PEER, "a", 0.1, 0.2), run(PEER, "lost", 0.1, 3.0)]
    points = measure([*runs, run(PEER, "long", 60.0, 0.2)], 3, told.append)
    assert [(point.tool, point.setting, point.runs) for point in points] == [
        (FSM, "a", 3),
        (PEER, "a", 3),
        (PEER, "long", 1),
    ]
    assert points[0].seconds < 0.1035  # the first run after the warm-up was the shortest
    assert len(told) == 2
    assert "at t = 1 s" in told[0]
    assert order[-4:] == [FSM, PEER, FSM, PEER]


def test_what_is_short_is_solved_several_times_in_its_turn() -> None:
    seconds = {"short": iter([9.0, 9e-3, 5e-3, 8e-3, *[7e-3] * 90]), "nothing": iter([0.0] * 100)}

    def run(setting: str) -> Run:
        return Run(FSM, "m", setting, lambda: (next(seconds[setting]), 0.1))

    points = measure([run("short"), run("nothing")], 2)
    # 9 + 5 + 8 ms, then three times 7 ms; the first run of all is the warm-up
    assert [(point.setting, point.runs, point.seconds) for point in points] == [("short", 6, 5e-3), ("nothing", 40, 0.0)]


def test_references_of_the_linkages() -> None:
    # a pendulum from horizontal passes the lowest point after K(1/2) sqrt(L/g): 4 K sqrt(L/g) is its period
    path = rigid.pendulum_path()
    assert np.allclose(np.linalg.norm(path, axis=1), 1.0)
    period = 4.0 * 1.8540746773013719 / math.sqrt(rigid.GRAVITY)
    phase = rigid.TIMES / period
    nearest = int(np.abs(phase - np.round(phase * 2) / 2).argmin())
    assert abs(path[nearest, 0]) > 0.9
    top = rigid.top_path()
    assert top[0] == pytest.approx((0.2257411175, 0.9734319843, -0.0383551802), abs=1e-8)
    assert top[-1] == pytest.approx((0.1733439641, 0.6400885921, -0.7484907911), abs=1e-8)
    corner = rigid.bricard_path()
    assert np.allclose(corner, rigid.bricard_path(0.04), atol=1e-5)
    # the third corner is two bars from the origin and two from the other fixed corner
    assert np.linalg.norm(corner, axis=1).max() < 3.0
    assert corner[:, 2].max() <= 1e-9 - 0.9


def test_without_exudyn_nothing_is_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gallery, "THERE", False)
    for part in gallery.PARTS.values():
        (only,) = part(Place(tmp_path))
        assert isinstance(only, NotCompared)
        assert "not installed" in only.reason


def test_the_strip_is_held_against_default_and_tuned_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = [*sweep(FSM, (1.0, 1e-4)), *sweep(PEER, (2.0, 1e-4)), *sweep(PLAIN, (20.0, 1e-4))]
    shown = PeerCase("x", "a strip", "itself", {PEER: "tuned", PLAIN: "plain"}, list, points=points)
    wanted: list[str] = []

    def measured(name: str, place: Place) -> tuple[PeerCase, Path]:
        wanted.append(name)
        return shown, tmp_path / "x.png"

    monkeypatch.setattr(gallery, "THERE", True)
    monkeypatch.setattr(gallery, "_measured", measured)
    checks = list(gallery.strip(Place(tmp_path)))
    assert wanted == [f"strip_{n}_{where}" for n in (4, 10, 20) for where in ("plane", "space")]
    assert [check.name.rpartition(", ")[2] for check in checks[:2]] == ["default settings", "tuned settings"]
    assert [check.error for check in checks] == pytest.approx([0.05, 0.5] * 6)
    assert [check.tolerance for check in checks] == pytest.approx([0.1, 0.1, 1 / 3, 1 / 3] * 3)
    assert "plain" in checks[0].detail


def test_every_problem_shows_its_reference_and_the_settings_of_both() -> None:
    for name, make in ALL.items():
        made = make()
        assert made.name == name
        assert len(made.reference) > 10
        assert set(made.settings) == ({FSM, PEER, PLAIN} if name.startswith("strip_") else {FSM, PEER})
        assert all(len(text) > 10 for text in made.settings.values())
