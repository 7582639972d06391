"""Studies: designs, scatter, Sobol indices, failed runs, continuation, and mistakes of users."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np
import pandas
import pytest
from click.testing import CliRunner
from scipy import stats

import fsm
from fsm.case.loading.model_file import read_file
from fsm.case.models.solve import Save
from fsm.case.models.study import StudyFile
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.studies.problem import Run, evaluate
from fsm.studies.result import StudyResult, sobol_indices
from fsm.studies.scatter import values_at
from fsm.studies.search import JOURNAL
from fsm.studies.study import _prepare, run_study
from fsm.studies.study_page import write_figures_and_page

ISHIGAMI = """
from math import sin

def f(x1, x2, x3):
    return sin(x1) + 7.0 * sin(x2) ** 2 + 0.1 * x3**4 * sin(x1)
"""
ANGLE = f"low = {-math.pi}, high = {math.pi}"
OF_ISHIGAMI = f"""
function = "model.py:f"
seed = 3
design = {{ kind = "sobol", sample = 1024 }}
response = [{{ name = "f" }}]
parameter = [{{ path = "x1", {ANGLE} }}, {{ path = "x2", {ANGLE} }}, {{ path = "x3", {ANGLE} }}]
"""
COUNTED = """
from pathlib import Path

def f(a, b):
    with Path(__file__).with_name("calls").open("a") as file:
        file.write("x")
    if a > 0.8:
        raise ValueError(f"a = {a} is too large")
    return {"sum": a + 2.0 * b, "product": a * b}
"""
OF_COUNTED = """
function = "model.py:f"
design = { kind = "latin", sample = 40 }
response = [{ name = "sum" }, { name = "product" }]
parameter = [{ path = "a", low = 0, high = 1 }, { path = "b", low = 0, high = 1 }]
"""


def study(folder: Path, text: str, model: str = "", **options: object) -> StudyResult:
    if model:
        (folder / "model.py").write_text(model)
    (folder / "study.toml").write_text(text)
    return run_study(folder / "study.toml", folder / "out", workers=1, progress=False, page=False, **options)  # type: ignore[arg-type]


def test_indices_of_the_ishigami_function_are_within_their_intervals(tmp_path: Path) -> None:
    """Exact indices: Ishigami and Homma (1990), with a = 7 and b = 0.1."""
    found = study(tmp_path, OF_ISHIGAMI, ISHIGAMI).indices("f")
    assert found is not None
    part = 1.0 + 0.1 * math.pi**4 / 5.0
    first = np.array([0.5 * part**2, 49.0 / 8.0, 0.0])
    both = 0.01 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    variance = first.sum() + both
    exact = first / variance, (first + [both, 0.0, both]) / variance
    for value, interval, wanted in (
        (found.first, found.first_interval, exact[0]),
        (found.total, found.total_interval, exact[1]),
    ):
        assert np.all((interval[:, 0] <= wanted) & (wanted <= interval[:, 1]))
        assert np.all(interval[:, 1] - interval[:, 0] < 0.35)
        assert np.all(np.abs(value - wanted) < 0.1)
    numbers = json.loads((tmp_path / "out" / "study.json").read_text())["responses"]["f"]["sobol"]
    assert numbers["groups"]["x2"]["first"] == pytest.approx(found.first[1])


def test_estimates_are_those_of_scipy() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.random((2, 64, 3))
    mixed = [np.where(np.arange(3) == k, b, a) for k in range(3)]
    model = lambda x: x[:, 0] + x[:, 1] * x[:, 2]  # noqa: E731
    response = np.concatenate([model(x) for x in (a, b, *mixed)])
    found = sobol_indices(response, 64, 0.95, 0)
    parts = response.reshape(5, 1, 64)
    wanted = stats.sobol_indices(func={"f_A": parts[0], "f_B": parts[1], "f_AB": parts[2:]}, n=64)
    assert found is not None
    assert found.first == pytest.approx(wanted.first_order, abs=1e-13)
    assert found.total == pytest.approx(wanted.total_order, abs=1e-13)


def test_failed_runs_are_counted_by_cause_and_left_out(tmp_path: Path) -> None:
    found = study(tmp_path, OF_COUNTED, COUNTED)
    too_large = found.design.values[:, 0] > 0.8
    assert found.failed == too_large.sum() == 8  # a Latin hypercube of 40 rows
    ((text, count, numbers),) = found.causes()
    assert "is too large" in text
    assert (count, numbers) == (8, np.flatnonzero(too_large).tolist())
    assert np.array_equal(np.isnan(found.response("sum")), too_large)
    fitted = found.regression("sum")
    assert fitted is not None
    assert fitted.slope == pytest.approx([1.0, 2.0])
    assert fitted.determination == pytest.approx(1.0)
    rows = list(csv.DictReader((tmp_path / "out" / "study.csv").open()))
    assert [bool(row["error"]) for row in rows] == too_large.tolist()
    table = pandas.read_parquet(tmp_path / "out" / "study.parquet")
    assert list(table.columns) == list(rows[0])
    assert table[["a", "b"]].to_numpy().tolist() == found.design.values.tolist()
    assert table["sum"].isna().tolist() == too_large.tolist()
    assert table["error"].tolist() == [row["error"] for row in rows]
    write_figures_and_page(found, tmp_path / "out", tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "Failed runs" in page
    assert "is too large" in page


def test_indices_of_a_sample_with_failed_runs(tmp_path: Path) -> None:
    found = study(tmp_path, OF_ISHIGAMI.replace("model.py:f", "late.py:f"), (tmp_path / "late.py").write_text(
        ISHIGAMI.replace("return", "if x2 > 3.0: raise ValueError('late')\n    return")) and "")  # fmt: skip
    indices = found.indices("f")
    assert indices is not None
    assert 0 < indices.lost == 1024 - indices.rows < 200


def test_a_study_continues_after_a_line_that_was_cut(tmp_path: Path) -> None:
    counted = f"{COUNTED}# {tmp_path}\n"  # a file with the same content is executed once
    first = study(tmp_path, OF_COUNTED, counted)
    journal, calls = tmp_path / "out" / JOURNAL, tmp_path / "calls"
    whole = journal.read_text().splitlines(keepends=True)
    assert len(whole) == 1 + 32  # the nominal run, and the runs that did not fail
    journal.write_text("".join(whole[:20]) + whole[20][:30])
    calls.write_text("")
    again = study(tmp_path, OF_COUNTED, resume=True)
    assert len(calls.read_text()) == (33 - 20) + 8  # the missing runs and those that failed
    assert again.runs == first.runs
    calls.write_text("")
    study(tmp_path, OF_COUNTED, resume=True)
    assert len(calls.read_text()) == 8  # the cut line took no other with it
    calls.write_text("")
    (tmp_path / "model.py").write_text(counted.replace("2.0 * b", "3.0 * b"))
    assert study(tmp_path, OF_COUNTED, resume=True).nominal.responses["sum"] == pytest.approx(0.5 + 1.5)
    assert len(calls.read_text()) == 41  # another function: no run is kept


def prepared(folder: Path, parameters: str, more: str = "") -> tuple:
    (folder / "model.py").write_text("def f(**values):\n    return 0.0\n")
    text = f'function = "model.py:f"\nresponse = [{{ name = "f" }}]\nparameter = [{parameters}]\n{more}'
    (folder / "study.toml").write_text(text)
    path = folder / "study.toml"
    return _prepare(read_file(path, StudyFile), path, ())


def test_scatter_has_the_distribution_of_the_file(tmp_path: Path) -> None:
    half, student = math.exp(0.1 * stats.norm.ppf(0.975)), 0.5 * stats.t.ppf(0.975, 7)
    posterior = {
        "kind": "force",
        "quantities": [
            {"name": "k", "value": 2.0, "standard_error": 0.2, "low": 2.0 / half, "high": 2.0 * half},
            {"name": "m", "value": 5.0, "standard_error": 0.5, "low": 5.0 - student, "high": 5.0 + student},
        ],
        "correlation": [[1.0, -0.6], [-0.6, 1.0]],
    }  # fmt: skip
    (tmp_path / "calibration.json").write_text(json.dumps(posterior))
    rows = (
        '{ path = "n", distribution = "normal", mean = 3, sigma = "10 %" }',
        '{ path = "l", distribution = "lognormal", mean = 3, sigma = 0.6 }',
        '{ path = "t", distribution = "triangular", low = 0, mode = 1, high = 4 }',
        '{ path = "v", values = [1, 2, 5] }',
        '{ path = "k", posterior = "calibration.json" }',
        '{ path = "m", posterior = "calibration.json" }',
    )
    more = 'correlation = [{ between = ["n", "l"], value = 0.5 }]\ndesign = { kind = "latin", sample = 4000 }'
    _, scatters, design, _ = prepared(tmp_path, ", ".join(rows), more)
    normal, lognormal, triangle, values, k, m = design.values.T
    assert [normal.mean(), normal.std()] == pytest.approx([3.0, 0.3], rel=0.01)
    assert [lognormal.mean(), lognormal.std()] == pytest.approx([3.0, 0.6], rel=0.02)
    assert triangle.mean() == pytest.approx(5.0 / 3.0, rel=0.01)
    assert np.unique(values, return_counts=True)[1] == pytest.approx([4000 / 3] * 3, rel=0.01)
    assert np.log(k).std() == pytest.approx(0.1, rel=0.02)
    assert (m.mean(), m.var()) == pytest.approx((5.0, 0.25 * 7.0 / 5.0), rel=0.05)  # Student's t with 7 degrees of freedom
    assert stats.spearmanr(normal, lognormal)[0] == pytest.approx(6.0 / np.pi * np.arcsin(0.25), abs=0.03)
    assert stats.spearmanr(k, m)[0] == pytest.approx(6.0 / np.pi * np.arcsin(-0.3), abs=0.03)
    assert sorted(map(sorted, design.groups)) == [[0, 1], [2], [3], [4, 5]]
    assert scatters[0].high == pytest.approx(3.0 + 0.3 * stats.norm.ppf(0.975))
    alone = values_at(scatters[:1], np.eye(1), np.array([[0.5]]))
    assert alone == pytest.approx(np.array([[3.0]]))


def test_designs_without_probabilities(tmp_path: Path) -> None:
    rows = '{ path = "a", low = 0, high = 2 }, { path = "b", values = [10, 20] }'
    grid = prepared(tmp_path, rows, 'design = { kind = "grid", points = 3 }')[2]
    assert grid.values.tolist() == [[a, b] for a in (0.0, 1.0, 2.0) for b in (10.0, 20.0)]
    one = prepared(tmp_path, rows, 'design = { kind = "one-at-a-time", points = 2 }')[2]
    assert one.values.tolist() == [[0.0, 20.0], [2.0, 20.0], [1.0, 10.0], [1.0, 20.0]]
    (tmp_path / "rows.csv").write_text("b;a\n10;0,5\n20;1,5\n")
    table = prepared(tmp_path, rows, 'design = { kind = "csv", file = "rows.csv" }')[2]
    assert table.values.tolist() == [[0.5, 10.0], [1.5, 20.0]]


def test_a_study_of_a_strip(tmp_path: Path) -> None:
    """The responses of a row are those of a run of the case with the same values, to the last bit."""
    for kind in ("strip", "study"):
        assert CliRunner().invoke(cli, ["init", kind, str(tmp_path / f"{kind}.toml")]).exit_code == 0
    text = (tmp_path / "study.toml").read_text().replace("sample = 12", "sample = 3").replace("case.toml", "strip.toml", 1)
    more = ["strip.segments_per_panel=2", "drive.0.travel=6 mm", "save.every=3 mm"]
    (tmp_path / "study.toml").write_text(text)
    found = run_study(tmp_path / "study.toml", tmp_path / "out", more, workers=1, progress=False, page=False)
    units = [one.unit for one in found.scatters]
    values = {
        path: f"{x!r} {unit}" for path, x, unit in zip(found.paths, found.design.values[1].tolist(), units, strict=True)
    }
    own = {"strip.segments_per_panel": 2, "drive.0.travel": "6 mm", "save.every": "3 mm", "contact.damping": None}
    case = fsm.load(tmp_path / "strip.toml").set(own | values)
    run = found.runs[1]
    assert run is not None
    summary = case.run(channels="crease.3.angle").summary
    assert run.responses["peak_force"] == summary["peak_force"]
    assert run.responses["min of crease.3.angle"] == summary["channels"]["crease.3.angle"]["min"]
    assert run.units == {"peak_force": "N", "peak_travel": "m", "min of crease.3.angle": "rad"}
    assert len(run.curve) == 101
    assert (tmp_path / "out" / "study.csv").read_text().startswith("run,material.young (Pa),strip.thickness (m),")


def test_a_study_of_forces_saves_few_states(tmp_path: Path) -> None:
    """Steps then need not end at saved states; the peak stays within the tolerance."""
    assert CliRunner().invoke(cli, ["init", "strip", str(tmp_path / "strip.toml")]).exit_code == 0
    own = ["strip.segments_per_panel=4", "drive.0.travel=6 mm", "expect=none"]
    parameter = 'parameter = [{ path = "strip.thickness", low = 1, high = 2 }]'
    start = f'case = "strip.toml"\nset = {json.dumps(own)}\n{parameter}\n'
    file = tmp_path / "study.toml"

    def nominal(response: str, *more: str) -> tuple[Run, Save]:
        file.write_text(f"{start}response = [{response}]\n")
        problem, *_ = _prepare(read_file(file, StudyFile), file, more)
        return evaluate(problem, {}), problem.case({}).case.save

    few, save = nominal('{ name = "peak_force" }')
    assert save.intervals == 10
    assert nominal('{ name = "energy_error" }')[1].intervals is None
    assert nominal('{ channel = "crease.3.angle", of = "min" }')[1].intervals is None
    all_of_them, save = nominal('{ name = "peak_force" }', "save.every=0.1 mm")
    assert (save.every, save.intervals) == (1e-4, None)
    assert few.responses["peak_force"] == pytest.approx(all_of_them.responses["peak_force"], rel=1e-3)
    assert few.responses != all_of_them.responses


ONE = 'case = "case.toml"\n[[parameter]]\npath = "strip.thickness"\n'
CSV = 'low = 1\nhigh = 2\n[design]\nkind = "csv"\nfile = "rows.csv"'
PAIR = 'low = 1\nhigh = 2\n[[correlation]]\nbetween = ["strip.thickness", "x"]\nvalue = 0.5'
RANGE = "low = 1\nhigh = 2"
MISTAKES = {
    "unit": (ONE + 'low = "1 N"\nhigh = "2 mm"', 'parameter.0.low: "1 N" has the wrong unit; give a value in m'),
    "order": (ONE + 'low = "2 mm"\nhigh = "1 mm"', "low = 2 mm is not below high = 1 mm"),
    "sigma": (ONE + 'distribution = "normal"', 'strip.thickness: distribution = "normal" needs sigma'),
    "zero": (ONE + 'distribution = "normal"\nsigma = "0 %"', "parameter.0.sigma: is 0 %; a standard deviation is above 0"),
    "path": (ONE.replace("ness", "nes") + RANGE, "strip.thicknes: unknown key; did you mean `strip.thickness`?"),
    "key": (ONE + "lo = 1\nhigh = 2", "parameter.0.lo: unknown key; did you mean `low`?"),
    "both": (ONE + "values = [1, 2]\nlow = 1", "`values` is the whole scatter; remove low"),
    "text": (ONE.replace("strip.thickness", "contact.law") + RANGE, "contact.law: is not a number of the case"),
    "sample": (f"{ONE}{RANGE}\n[design]\nsample = 100", "sample = 100 is no power of 2, which a Sobol sequence needs"),
    "many": (f'{ONE}{RANGE}\n[design]\nkind = "latin"\nsample = 200000', "design.sample: makes 200,000 runs; at most"),
    "posterior": (ONE + 'posterior = "no.json"', "parameter.0.posterior: cannot read"),
    "column": (ONE + CSV, "column strip.width: is no [[parameter]] of the study"),
    "correlation": (ONE + PAIR, "names x, which is no [[parameter]]"),
    "case": (f'case = "none.toml"\n[[parameter]]\npath = "a"\n{RANGE}', "none.toml"),
    "function": (f'function = "model.py:g"\n[[parameter]]\npath = "a"\n{RANGE}', "function: has no function g"),
    "response": (
        f'{ONE}low = "0.2 mm"\nhigh = "0.3 mm"\n[[response]]\nname = "peak_forse"',
        "the summary has no number peak_forse; did you mean `peak_force`?",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_gives_one_line(name: str, tmp_path: Path) -> None:
    text, wanted = MISTAKES[name]
    assert CliRunner().invoke(cli, ["init", "strip", str(tmp_path / "case.toml")]).exit_code == 0
    (tmp_path / "model.py").write_text("def f(a):\n    return a\n")
    (tmp_path / "rows.csv").write_text("strip.thickness,strip.width\n1 mm,2 mm\n")
    (tmp_path / "study.toml").write_text(text)
    fast = ["--set", "drive.0.travel=1 mm", "--set", "strip.segments_per_panel=1"] if name == "response" else []
    found = CliRunner().invoke(cli, ["study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out"), *fast])
    assert found.exit_code == 2, found.output
    lines = [line for line in found.output.splitlines() if wanted in line]
    assert len(lines) == 1, found.output
    assert len(found.output.splitlines()) == 1


def test_correlations_that_contradict_each_other(tmp_path: Path) -> None:
    rows = ", ".join(f'{{ path = "{name}", low = 0, high = 1 }}' for name in "abc")
    pairs = ", ".join(f'{{ between = ["{a}", "{b}"], value = -0.9 }}' for a, b in ("ab", "bc", "ac"))
    with pytest.raises(CaseError, match="contradict each other"):
        prepared(tmp_path, rows, f"correlation = [{pairs}]")
