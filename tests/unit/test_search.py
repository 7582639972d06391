"""Search of values: a wanted response, the best values under constraints, continuation, mistakes."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from click.testing import CliRunner

import fsm
from fsm.case.loading.model_file import read_file
from fsm.case.models.study import OptimiseFile
from fsm.cli.command_line import cli
from fsm.errors import NotConverged
from fsm.studies.optimise import optimise

STRIP = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
SMALL = ["strip.segments_per_panel=2", "drive.0.travel=12 mm", "save.every=1 mm", "expect=none"]
MODEL = """
from pathlib import Path

def f(x, y):
    with Path(__file__).with_name("calls").open("a") as file:
        file.write("x")
    if x > 1.9:
        raise ValueError("too large")
    return {"size": x * x + y * y, "sum": x + y}
"""
OF_MODEL = """
function = "model.py:f"
objective = { name = "size" }
constraint = [{ name = "sum", low = 1 }]
variable = [{ path = "x", low = 0, high = 2, start = 1.8 }, { path = "y", low = 0, high = 2 }]
"""


def run(*words: str) -> tuple[int, str]:
    found = CliRunner().invoke(cli, list(words))
    return found.exit_code, found.output


def sets(texts: list[str]) -> list[str]:
    return [word for text in texts for word in ("--set", text)]


def test_a_value_for_a_wanted_peak(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = [
        "solve-for",
        str(STRIP),
        "--reach",
        "peak_force=1 N",
        "--by",
        "strip.thickness",
        "--between",
        "0.2 mm",
        "0.5 mm",
    ]
    code, text = run(*words, "--out", str(out), *sets(SMALL))
    assert code == 0, text
    rows = list(csv.DictReader((out / "history.csv").open()))
    assert 3 <= len(rows) < 15
    assert (rows[0]["within the tolerance"], rows[-1]["within the tolerance"]) == ("0", "1")
    assert (out / "history.png").is_file()
    solved = fsm.load(out / "solved.toml")
    assert solved["strip.thickness"] == float(rows[-1]["strip.thickness (m)"])
    assert solved.run().summary["peak_force"] == pytest.approx(1.0, rel=1e-4)
    code, text = run(*words[:3], "peak_force=100 N", *words[4:], "--out", str(out), "--resume", *sets(SMALL))
    assert code == 2
    assert "100 N is not between them: give other ends" in text.splitlines()[-1]


def test_the_lightest_strip_with_a_given_peak(tmp_path: Path) -> None:
    """Exact derivatives; the lightest strip has the stiffest creases that are allowed."""
    (tmp_path / "optimise.toml").write_text(f"""
case = "{STRIP}"
set = {json.dumps([*SMALL, "drive.0.travel=7 mm"])}
objective = {{ name = "mass" }}
constraint = [{{ name = "peak_force", value = "1 N" }}]
variable = [
    {{ path = "strip.thickness", low = "0.2 mm", high = "0.5 mm" }},
    {{ path = "crease.stiffness", low = "5 N mm/rad", high = "15 N mm/rad" }},
]
""")
    found = optimise(tmp_path / "optimise.toml", tmp_path / "out", progress=False)
    assert found.method == "SLSQP"
    assert found.kept
    assert found.values["crease.stiffness"] == pytest.approx(15e-3, rel=1e-3)
    assert found.responses["peak_force"] == pytest.approx(1.0, rel=1e-3)
    assert found.responses["mass"] == pytest.approx(0.48 * 0.04 * 800.0 * found.values["strip.thickness"])
    assert len(found.search.points) < 20


def test_a_search_without_derivatives_and_its_continuation(tmp_path: Path) -> None:
    """Least x^2 + y^2 with x + y of at least 1: both are 1/2. Runs that fail are avoided; a repetition makes no runs."""
    (tmp_path / "model.py").write_text(f"{MODEL}# {tmp_path}\n")
    (tmp_path / "optimise.toml").write_text(OF_MODEL)
    found = optimise(tmp_path / "optimise.toml", tmp_path / "out", progress=False)
    assert found.method == "COBYQA"
    assert list(found.values.values()) == pytest.approx([0.5, 0.5], abs=0.01)
    assert len(found.search.points) <= 40
    calls, failed = tmp_path / "calls", found.search.runs.count(None)
    assert json.loads((tmp_path / "out" / "optimise.json").read_text())["failed"] == failed
    calls.write_text("")
    again = optimise(tmp_path / "optimise.toml", tmp_path / "out", progress=False, resume=True)
    assert again.search.points == found.search.points
    assert len(calls.read_text()) == failed
    (tmp_path / "optimise.toml").write_text(OF_MODEL.replace("low = 1", "low = 9"))
    with pytest.raises(NotConverged, match=r"no run keeps all constraints; the nearest, .* misses sum"):
        optimise(tmp_path / "optimise.toml", tmp_path / "out", progress=False)


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (["--reach", "peak_force", "--by", "strip.thickness"], "write response=value"),
        (["--reach", "peak_force=1 m", "--by", "strip.thickness"], '--reach: "1 m" has the wrong unit; give a value in N'),
        (["--reach", "peak_force=1 N", "--by", "strip.panels"], "strip.panels: has whole numbers"),
        (["--reach", "peak_forse=1 N", "--by", "strip.thickness"], "did you mean `peak_force`?"),
    ],
)
def test_a_mistake_gives_one_line(words: list[str], wanted: str, tmp_path: Path) -> None:
    ends = ["--between", "0.2 mm", "0.5 mm"]
    code, text = run("solve-for", str(STRIP), *words, *ends, "--out", str(tmp_path / "out"), "--quiet", *sets(SMALL))
    assert code == 2
    assert wanted in text
    assert len(text.splitlines()) == 1


@pytest.mark.parametrize(
    ("old", "new", "wanted"),
    [
        ("low = 0, high = 2, start", "low = 3, high = 2, start", "variable.0: x: low = 3.0 is not below high = 2.0"),
        ("start = 1.8", "start = 5", "variable.0.start: 5.0 is not between low = 0.0 and high = 2.0"),
        ("low = 1 }", "low = 1, value = 2 }", "sum: a constraint has a value or bounds, not both; remove one"),
        (", low = 1 }", "}", "sum: a constraint needs low, high or value"),
        ('name = "size"', 'name = "sise"', "f returns no sise; did you mean `size`?"),
        ("objective", "objectiv", "objectiv: unknown key; did you mean `objective`?"),
    ],
)
def test_a_mistake_in_a_file_gives_one_line(old: str, new: str, wanted: str, tmp_path: Path) -> None:
    (tmp_path / "model.py").write_text(MODEL)
    (tmp_path / "optimise.toml").write_text(OF_MODEL.replace(old, new, 1))
    code, text = run("optimise", str(tmp_path / "optimise.toml"), "--out", str(tmp_path / "out"), "--quiet")
    assert code == 2, text
    assert wanted in text
    assert len(text.splitlines()) == 1, text


def test_a_case_with_a_wanted_peak_in_python() -> None:
    case = fsm.load(STRIP).set(
        {"strip.segments_per_panel": 2, "drive.0.travel": "3 mm", "save.every": "1 mm", "contact": None}
    )
    solved = case.set("expect", None).solve_for("peak_force=0.08 N", "material.young", (2e9, "4 GPa"))
    assert solved.run().summary["peak_force"] == pytest.approx(0.08, rel=1e-4)


def test_the_file_that_init_writes(tmp_path: Path) -> None:
    code, text = run("init", "optimise", str(tmp_path / "optimise.toml"))
    assert code == 0
    assert "next: fsm optimise" in text
    found = read_file(tmp_path / "optimise.toml", OptimiseFile)
    assert found.objective.key == "mass"
    assert [one.path for one in found.variable] == ["strip.thickness", "crease.stiffness"]
    code, text = run("help", "optimise.constraint")
    assert code == 0
    assert "prescribed value, in place of bounds" in text
