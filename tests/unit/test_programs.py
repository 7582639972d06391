"""Programs of drives and loads over time: tables from files, and one clear line for each mistake."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.check.report import describe
from fsm.errors import CaseError
from tests.scene_text import bodies, spring

ARM = bodies(arm=1.0, hand=1.0) + spring("spring", "arm", "hand", 100.0)


def _case(tmp_path: Path, drive: str, more: str = "", units: str = "SI") -> Path:
    path = tmp_path / "case.toml"
    path.write_text(f'units = "{units}"\n{ARM}\n[[drive]]\nbody = "hand"\n{drive}\n{more}', encoding="utf-8")
    return path


def test_a_table_in_a_file_is_the_table_in_the_case(tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("time (ms); travel (mm)\n0; 0\n500; 12\n1000; -6\n", encoding="utf-8")
    in_file = load_case(_case(tmp_path, 'time = { kind = "table", file = "way.csv" }'))
    rows = 'time = { kind = "table", time = [0, "0.5 s", 1], travel = ["0 mm", "12 mm", "-0.6 cm"] }'
    inline = load_case(_case(tmp_path, rows))
    assert inline.case.drive[0].travel == pytest.approx(0.012)
    np.testing.assert_allclose(inline.case.drive[0].time.value, [0.0, 1.0, -0.5])
    assert in_file.case.drive[0].travel == pytest.approx(0.012)
    np.testing.assert_allclose(in_file.case.drive[0].time.value, [0.0, 1.0, -0.5])
    again = tmp_path / "again.toml"
    again.write_text(in_file.text, encoding="utf-8")
    assert load_case(again).case == in_file.case
    millimetres = load_case(_case(tmp_path, 'time = { kind = "table", time = [0, 1], travel = [0, 12] }', units="mm-N-s"))
    assert millimetres.case.drive[0].travel == pytest.approx(0.012)


def test_a_force_by_a_table_has_the_direction_of_its_vector(tmp_path: Path) -> None:
    load = '[[load]]\nbody = "arm"\nforce = [0, 0, -2]\ntime = { kind = "table", time = [0, 1], force = ["0 N", "30 N"] }'
    case = load_case(_case(tmp_path, 'speed = 1\ntravel = 1', load)).case
    assert case.load[0].force == (0.0, 0.0, -30.0)
    assert case.load[0].time.value == (0.0, 1.0)


CORD = """
[[scene.cords]]
name = "cord"
first = "ground"
second = "hand"
at = [0, 0, 1]
to = [0, 0, 0]
stiffness = 100
reel = 0.1
time = { kind = "table", file = "steps.csv" }
"""
MOTOR = """
[[scene.joints]]
name = "hinge"
kind = "revolute"
first = "ground"
second = "arm"
at = [0, 0, 0]
axis = [0, 1, 0]
motor = { torque = 1, time = { kind = "table", file = "steps.csv" } }
"""
REST = """
[[scene.elements]]
name = "actuator"
inner = "arm"
outer = "hand"
rotation = [0, 1, 0]
rest_turn = 1
rest_time = { kind = "table", file = "steps.csv" }
"""


@pytest.mark.parametrize(
    ("part", "place"),
    [(CORD, "cords.0.time"), (MOTOR, "joints.0.motor.time"), (REST, "elements.1.rest_time")],
    ids=["cord", "motor", "rest angle"],
)
def test_a_table_in_a_file_is_read_wherever_a_function_of_time_is(tmp_path: Path, part: str, place: str) -> None:
    (tmp_path / "steps.csv").write_text("time (s), value\n0, 0\n2, 1\n", encoding="utf-8")
    case = load_case(_case(tmp_path, "travel = 1\nspeed = 1", part)).case
    here: Any = case.scene
    for key in place.split("."):
        here = here[int(key)] if key.isdigit() else getattr(here, key)
    assert (here.time, here.value, here.file) == ((0.0, 2.0), (0.0, 1.0), None)
    (tmp_path / "steps.csv").unlink()
    with pytest.raises(CaseError, match=f"scene.{place}.file: cannot read"):
        load_case(_case(tmp_path, "travel = 1\nspeed = 1", part))


MISTAKES = (
    ("speed = 1", "give `travel` (a length) or `turn` (an angle); both are missing"),
    ("travel = 1", "`speed` is missing"),
    ("turn = 1", "`rate` is missing"),
    ("travel = 1\nspeed = 1\nturn = 1", "both are given"),
    ("turn = 1\nspeed = 1\nrate = 1", "no `speed`"),
    ("turn = 1\nrate = 1\naxis = [0, 0, 0]", "is not a direction"),
    ('travel = 1\nspeed = 1\ntime = { kind = "ramp", end = 1 }', "remove `speed` and `run_up`, or remove `time`"),
    ('travel = 1\ntime = { kind = "constant" }', "is a motion"),
    ('travel = 1\ntime = { kind = "cycle", period = 1 }', "time.cycles: is missing"),
    ('time = { kind = "table", time = [0, 1], travel = [0, 0] }', "all rows of travel are zero"),
    ('time = { kind = "table", time = [0, 1], force = [0, 1] }', "has the column `travel` or `turn`, not `force`"),
    ('time = { kind = "table", time = [0, 1], travel = [0, 1], value = [0, 1] }', "it has value and travel"),
    ('travel = 1\ntime = { kind = "table", time = [0, 1], travel = [0, 1] }', "here and in the table"),
    ('time = { kind = "table", file = "none.csv" }', "cannot read"),
    ('time = { kind = "table", file = "bad.csv" }', "unknown column `distance`"),
    ('time = { kind = "table", file = "text.csv" }', "line 3: needs two numbers"),
    ('time = { kind = "table", file = "unit.csv" }', "column `travel`"),
)


@pytest.mark.parametrize(("drive", "message"), MISTAKES)
def test_mistakes_have_one_clear_line(tmp_path: Path, drive: str, message: str) -> None:
    (tmp_path / "bad.csv").write_text("time, distance\n0, 0\n1, 1\n", encoding="utf-8")
    (tmp_path / "text.csv").write_text("time, travel\n0, 0\n1, one\n", encoding="utf-8")
    (tmp_path / "unit.csv").write_text("time, travel (kg)\n0, 0\n1, 1\n", encoding="utf-8")
    with pytest.raises(CaseError) as error:
        describe(load_case(_case(tmp_path, drive)).case)
    assert message in str(error.value)
    assert len(error.value.faults) == 1
    assert error.value.faults[0].path.startswith("drive.0")
