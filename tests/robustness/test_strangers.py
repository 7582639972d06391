"""The campaign of randomly generated cases is deterministic, can be resumed, and judges the results."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from validation.strangers import campaign
from validation.strangers.campaign import fsm_command, nudge_of, read_lines, row_key, run_campaign
from validation.strangers.cases import KINDS, Row, draw, rows
from validation.strangers.drawn import Drawn
from validation.strangers.launch import Command, Course, Ended, side_by_side
from validation.strangers.report import report, write_csv
from validation.strangers.second import compared, worst
from validation.strangers.verdict import cause_of, first_words


@pytest.mark.parametrize("kind", KINDS)
def test_a_case_is_the_same_every_time(kind: str) -> None:
    drawn = [draw(kind, index, 1) for index in range(12)]
    assert [draw(kind, index, 1) for index in reversed(range(12))] == drawn[::-1]
    assert draw(kind, 3, 2) != drawn[3]
    assert len({row_key(one) for one in drawn}) == 12


def test_strips_are_not_drawn_taut() -> None:
    """The chord over the panels on each side of a driven crease is never longer than the panels."""
    driven = 0
    for index in range(120):
        tables = draw("strips", index, 1).tables
        drive = tables.get("drive", [{}])[0]
        if "crease" not in drive:
            continue
        strip, crease = tables["strip"], drive["crease"]
        panel, angle = number(strip["length"]) / strip["panels"], np.radians(number(strip["fold_angle"]))
        lines = [panel * np.array([i * np.cos(angle), (i % 2) * np.sin(angle)]) for i in range(strip["panels"] + 1)]
        way = np.array(drive["direction"], dtype=float)[[0, 2]]
        for travel in np.linspace(0.0, number(drive["travel"]), 9)[1:]:
            at = lines[crease] + travel * way / np.linalg.norm(way)
            assert np.linalg.norm(at - lines[1]) <= (crease - 1) * panel * (1.0 + 1e-6)
            if "held" not in strip:
                assert np.linalg.norm(at - lines[-2]) <= (strip["panels"] - 1 - crease) * panel * (1.0 + 1e-6)
        driven += 1
    assert driven > 40


def test_deployed_strips_end_taut_and_hardly_stretched() -> None:
    """The driven crease ends at the distance of its panels from the held one, and 300 millionths of it at most."""
    for index in range(60):
        tables = draw("deployed", index, 1).tables
        strip, drive = tables["strip"], tables["drive"][0]
        panel, angle = number(strip["length"]) / strip["panels"], np.radians(number(strip["fold_angle"]))
        crease = drive["crease"]
        start = panel * np.array([(crease - 1) * np.cos(angle), ((crease % 2) - 1) * np.sin(angle)])
        chord = np.linalg.norm(start + [number(drive["travel"]), 0.0])
        assert 0.0 < chord / ((crease - 1) * panel) - 1.0 < 3.1e-4


def test_falling_plates_are_drawn_above_each_other() -> None:
    """The lowest point of each plate is above the highest point drawn below the plate, including the roll in space."""
    falling = 0
    for index in range(120):
        tables = draw("scenes", index, 1).tables
        bodies, obstacles = tables["scene"]["bodies"], tables.get("obstacle", [])
        if len(obstacles) < 1 or bodies[0]["name"] != "plate 1":
            continue
        top = max([0.0, *(2.0 * number(one["position"][2]) for one in obstacles if one["shape"] != "plane")])
        for body in bodies:
            up = Rotation.from_quat(np.roll(body.get("orientation", [1, 0, 0, 0]), -1)).as_matrix()[2]
            sides = [number(body["plate"][key]) for key in ("length", "width", "thickness")]
            half = 0.5 * float(np.abs(up[:2]) @ sides[:2]) + 0.5 * sides[2]  # plates are rounded at their edges
            assert number(body["position"][2]) - half > top, (index, body["name"])
            top = number(body["position"][2]) + half
        falling += 1
    assert falling > 20


def number(text: str) -> float:
    return float(text.split()[0])


def test_the_full_campaign_has_its_numbers() -> None:
    found = rows(2400, tuple(KINDS), 1)
    assert {kind: sum(row.kind == kind for row in found) for kind in KINDS} == {
        "strips": 400, "released": 150, "lattices": 100, "films": 300, "deployed": 150, "arrays": 200, "scenes": 200,
        "sheets": 200, "packed": 500, "mechanisms": 200,
    }  # fmt: skip
    assert 350 < sum(row.checked for row in found) < 490
    few = rows(60, tuple(KINDS), 1)
    assert set(few) < set(found)


@pytest.mark.parametrize(
    ("code", "said", "cause"),
    [
        (0, "results out", "solved"),
        (2, "case.toml: strip.length: ...", "refused"),
        (3, "no stable equilibrium was found", "equilibrium"),
        (3, "more steps than max_steps", "steps"),
        (3, "step size below the smallest", "not converged"),
        (5, "the energy balance residual is above", "energy"),
        (1, "internal error: KeyError", "internal"),
        (-11, "", "crash"),
        (None, "case.toml: 45 %, 300 steps", "time"),
    ],
)
def test_a_verdict_is_that_of_exit_code_and_message(code: int | None, said: str, cause: str) -> None:
    assert cause_of(Ended(code, said, 1.0, 1.0)) == cause


def test_the_line_that_is_kept_is_the_message_and_not_the_progress() -> None:
    said = "case.toml: compiling kernels, once\n\rcase.toml: 13 %, 146 steps\n/tmp/x/case.toml: film: no good\n"
    assert first_words(Ended(3, said, 1.0, 1.0), "/tmp/x/") == "case.toml: film: no good"


@pytest.mark.nightly
def test_commands_that_crash_or_hang_are_told_apart(tmp_path: Path) -> None:
    def run(command: Command) -> int:
        if command.arguments == ("crash",):
            os.kill(os.getpid(), signal.SIGTERM)
        while command.arguments == ("hang",):
            pass
        print("done")
        return 7

    def course(name: str) -> Course:
        ended = yield Command((name,), tmp_path / name, 1.0)
        return name, ended.code, ended.said

    found = set(side_by_side((course(name) for name in ("crash", "hang", "end")), 2, run))
    assert found == {("crash", -signal.SIGTERM, ""), ("hang", None, ""), ("end", 7, "done\n")}


@pytest.mark.nightly
def test_a_campaign_goes_on_and_runs_again_only_what_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[str] = []

    def course(row: Row, seed: int, *_: object) -> Course:
        ran.append(f"{row.kind}:{row.index}")
        ended = yield Command((), tmp_path / "said", 5.0)
        found = {"kind": row.kind, "index": row.index, "key": row_key(draw(row.kind, row.index, seed)), "code": ended.code}
        return found | {"source": campaign.made_by()["source"]}

    monkeypatch.setattr(campaign, "course_of", course)
    monkeypatch.setattr(campaign, "fsm_command", lambda command: 3 if ran[-1] == "films:1" else 0)
    path, wanted = tmp_path / "rows.jsonl", [Row("films", index, False) for index in range(3)]
    run_campaign(path, wanted[:2], 1)
    assert ran == ["films:0", "films:1"]
    path.write_text(path.read_text() + '{"kind": "films", "ind')  # the file ends in the middle of a line
    assert [line["index"] for line in run_campaign(path, wanted, 1)] == [0, 1, 2]
    assert ran[2:] == ["films:2"]
    monkeypatch.setattr(campaign, "made_by", lambda: {"source": "another"})
    run_campaign(path, wanted, 1, earlier=True)  # of other sources only the solved cases count
    assert ran[3:] == ["films:1"]
    run_campaign(path, wanted, 1)
    assert ran[4:] == ["films:0", "films:2"]
    assert len(read_lines(path)) == 6


@pytest.mark.nightly
def test_a_few_cases_end_to_end(tmp_path: Path) -> None:
    """Through the command itself, one of them with a second solver; and the tables that are made of it."""
    wanted = [Row("scenes", 4, True), Row("lattices", 1, False)]
    lines = run_campaign(tmp_path / "seed_1.jsonl", wanted, 1)
    assert [line["cause"] for line in lines] == ["solved", "solved"]
    assert lines[0]["second"] in ("agrees", "sensitive")
    assert not (tmp_path / "seed_1_running").exists()
    text = report(lines, 1)
    assert "| scenes | 1 | 1 | 100.0 | - | 1 | 0 |" in text
    write_csv(tmp_path / "rows.csv", lines)
    assert len((tmp_path / "rows.csv").read_text().splitlines()) == 3


def test_the_worst_number_is_that_beyond_its_own_bound() -> None:
    assert worst([("peak", 0.01, 0.02), ("mode 1", 0.03, 0.5)]) == ("peak", 0.01, 0.02)


@pytest.mark.parametrize(
    ("tables", "setting"),
    [
        ({"strip": {"length": "480 mm"}}, "strip.length=480.00048 mm"),
        ({"scene": {"bodies": [{"mass": "2 g"}]}}, "scene.bodies.0.mass=2.000002 g"),
        ({"scene": {"bodies": [{"mass": 0.5}]}}, "scene.bodies.0.mass=0.5000005"),
    ],
)
def test_a_case_is_nudged_by_a_millionth(tables: dict[str, object], setting: str) -> None:
    assert nudge_of(Drawn(tables)) == ["--set", setting]


def test_the_command_returns_its_exit_code(tmp_path: Path) -> None:
    assert fsm_command(Command(("check", str(tmp_path / "none.toml")), tmp_path / "said", 1.0)) == 2


def test_an_error_is_compared_over_what_it_is_stated_over(tmp_path: Path) -> None:
    """The error of a reduced model is relative to the displacement of the full model: 0.5 of 1.5 m is 33 %, not 50 % of 1
    m."""
    told = {"method": "modal", "amplitude_center": 1.0, "reduced_error": 0.35}, {"amplitude_center": 1.5}
    for name, summary in zip(("first", "second"), told, strict=True):
        (tmp_path / name).mkdir()
        (tmp_path / name / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    (_, off, allowed) = worst(compared("films", tmp_path / "first", tmp_path / "second", 1e-6))
    assert off == pytest.approx(1.0 / 3.0) and allowed == pytest.approx(0.37)


def test_a_frequency_of_less_than_three_periods_is_not_compared(tmp_path: Path) -> None:
    """The summary warns of such a frequency; with more periods it gives no warning."""
    for resolution, of in ((0.9, ["amplitude_center"]), (0.2, ["frequency_hz", "amplitude_center"])):
        told = [{"frequency_hz": f, "frequency_resolution_hz": resolution, "amplitude_center": 1.0} for f in (0.88, 0.48)]
        for name, summary in zip(("first", "second"), told, strict=True):
            (tmp_path / name).mkdir(exist_ok=True)
            (tmp_path / name / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
        assert [item[0] for item in compared("films", tmp_path / "first", tmp_path / "second", 1e-6)] == of
