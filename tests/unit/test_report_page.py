"""Page of a report: data, bounds of its size, and text that is never code."""

from __future__ import annotations

import base64
import gzip
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from fsm.cli.command_line import cli
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.results.writer import write_solution
from fsm.views.report.fields import fold_angles, pair_sides
from fsm.views.report.packing import pack_doubles, pack_floats, pack_integers, pack_levels, safe_json
from fsm.views.report.shapes import creases_of, parts_of, shown_shapes
from fsm.views.report.write import library, report_page
from tests.unit.plot_runs import FOLD, strip_run

EVIL = '</script><script>document.title="owned"</script> $x$ ../../up <b>'


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    """Array of a packed text, as the page computes it."""
    kind = np.dtype({"f4": "<f4", "f8": "<f8", "u4": "<u4", "u2": "<u2"}[packed["type"]])
    raw = np.frombuffer(gzip.decompress(base64.b64decode(packed["data"])), np.uint8)
    values = np.ascontiguousarray(raw.reshape(kind.itemsize, -1).T).view(kind).reshape(packed["shape"])
    if packed["type"] != "u2":
        return values
    levels = np.cumsum(values, axis=0, dtype=np.uint16)
    low, high = np.array(packed["low"]), np.array(packed["high"])
    return np.where(levels == 65535, np.nan, low + (high - low) / 65534 * levels)


def strip(**changes: Any) -> Solution:
    """Run of a strip whose case is known to be a strip."""
    run = strip_run(41)
    run.layout = replace(run.layout, **({"case_text": 'title = "test strip"\n[strip]\npanels = 6\n'} | changes))
    return run


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return json.loads(found[1])


def saved(run: Solution, path: Path) -> Path:
    """Results file with the records of a run."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_solution(path, run)
    return path


def records_of(run: Solution) -> list[Any]:
    from fsm.results.solution import PAIRS, Record

    return [
        Record(
            run.time[k], run.q[k], run.u[k], run.travel[k], run.force[k], {name: e[k] for name, e in run.energy.items()},
            **{name: getattr(run, name)[k] for name in PAIRS}, shape=run.shape[k],
        )
        for k in range(len(run))
    ]  # fmt: skip


def test_packed_arrays_come_back() -> None:
    rng = np.random.default_rng(1)
    values = np.cumsum(rng.normal(size=(50, 7, 3)), axis=0)
    np.testing.assert_array_equal(unpacked(pack_doubles(values)), values)
    np.testing.assert_array_equal(unpacked(pack_floats(values)), values.astype(np.float32))
    np.testing.assert_array_equal(unpacked(pack_integers([[1, 2**32 - 1]])), [[1, 2**32 - 1]])
    values[3, 2, 1] = np.nan
    for per_column in (False, True):
        packed = pack_levels(values, per_column)
        found = unpacked(packed)
        span = np.max(np.array(packed["high"]) - np.array(packed["low"]))
        np.testing.assert_allclose(found, values, atol=0.51 * span / 65534)
        assert np.isnan(found[3, 2, 1])
    assert np.isnan(unpacked(pack_levels(np.full((2, 3), np.nan)))).all()
    np.testing.assert_array_equal(unpacked(pack_levels(np.full((2, 3), 4.0))), np.full((2, 3), 4.0))


def test_json_cannot_end_its_element() -> None:
    text = safe_json({EVIL: [EVIL, np.nan, np.inf, np.float64(1.5), np.arange(2)]})
    assert not set("<>&") & set(text)
    assert json.loads(text) == {EVIL: [EVIL, None, None, 1.5, [0, 1]]}


def test_libraries_come_from_installed_packages() -> None:
    assert "WebGLRenderer" in library("three")
    assert "</script" not in library("three").lower()
    assert len(library("plotly")) > 1_000_000


def test_shapes_of_a_strip() -> None:
    run = strip()
    shown = shown_shapes(run, 10**6)
    assert shown.records.tolist() == list(range(41))
    assert not shown.thinned
    positions, quads = unpacked(shown.data["positions"]), unpacked(shown.data["quads"])
    np.testing.assert_allclose(positions[:, quads], run.shape, atol=1e-5 * shown.data["size"])
    assert positions.shape[1] < 0.7 * 4 * run.shape.shape[1], "corners of neighbours are one vertex"
    creases = creases_of(run)
    assert [crease.name for crease in creases] == [f"crease.{k}" for k in range(1, 6)]
    np.testing.assert_allclose(fold_angles(run, creases)[0], 2.0 * FOLD, atol=1e-6)
    parts = parts_of(run)
    assert parts.names == [f"panel {k}" for k in range(1, 7)]


def test_shapes_are_thinned_to_a_budget() -> None:
    run = strip()
    whole = shown_shapes(run, 10**6)
    less = shown_shapes(run, whole.size // 3)
    assert less.size <= whole.size // 3
    assert less.records[0] == 0
    assert less.records[-1] == 40
    assert less.thinned == (
        f"The player shows {len(less.records)} of 41 records, equally spaced, and interpolates between them."
    )
    assert len(shown_shapes(run, 1).records) == 2, "the first and the last shape are always shown"


@pytest.mark.parametrize(
    ("name", "sides"),
    [("a - b", ("a", "b")), ("a - b - c", ("a - b", "c")), ("x", ("x", ""))],
)
def test_sides_of_a_pair(name: str, sides: tuple[str, str]) -> None:
    assert pair_sides(name, ["a", "b", "c", "a - b"]) == sides


def test_page_holds_no_code_of_names() -> None:
    run = strip(drive_names=(EVIL,), pair_names=(EVIL, "3-4"))
    run.summary["warnings"] = [EVIL]
    page = report_page({EVIL: run}, title=EVIL)
    assert page.lower().count("<script") == 4
    assert page.lower().count("</script") == 4
    data = data_of(page)
    assert data["title"] == EVIL
    assert data["results"][0]["name"] == EVIL
    assert 'http-equiv="Content-Security-Policy" content="default-src \'none\'' in page


def test_page_states_what_the_run_was() -> None:
    run = strip()
    run.summary |= {"energy_error": 1e-4, "warnings": ["careful"]}
    run.layout = replace(run.layout, provenance={"fsm": "0.1.0", "machine": "secret host", "command": "fsm run /secret"})
    page = report_page({"run": run})
    sections = {section["title"]: section for section in data_of(page)["results"][0]["sections"]}
    assert ["energy balance residual", "0.01 % (relative to the reference energy)"] in sections["Error estimates"]["rows"]
    assert sections["Warnings"]["lines"] == ["careful"]
    assert "secret" not in page


def test_several_results_are_compared() -> None:
    runs = {name: strip_run(41, peak=peak) for name, peak in (("a", 1.0), ("b", 2.0))}
    for angle, run in zip((60, 70), runs.values(), strict=True):
        run.layout = replace(run.layout, case_text=f"[strip]\nfold_angle = {np.radians(angle)}\npanels = 6\n")
    found = data_of(report_page(runs))["compare"]
    assert found["names"] == ["a", "b"]
    columns = {column["name"]: column for column in found["columns"]}
    assert "strip.panels" not in columns
    assert columns["strip.fold_angle"]["unit"] == "deg"
    np.testing.assert_allclose(columns["strip.fold_angle"]["values"], [60, 70])
    np.testing.assert_allclose(columns["peak force"]["values"], [1.0, 2.0], rtol=1e-2)
    assert [one["name"] for one in found["overlay"]] == ["a", "b"]


def test_command(tmp_path: Path) -> None:
    result = saved(strip(), tmp_path / "a <b>" / "result.h5")
    out = tmp_path / "pages" / "report.html"
    done = CliRunner().invoke(cli, ["report", str(result.parent), "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert done.output.strip() == str(out)
    assert sorted(path.name for path in tmp_path.rglob("*") if path.is_file()) == ["report.html", "result.h5"]
    assert out.stat().st_size < 10_000_000
    assert read_solution(result).layout.case["title"] == "test strip"


def test_damaged_results_are_one_line(tmp_path: Path) -> None:
    result = saved(strip(), tmp_path / "result.h5")
    content = result.read_bytes()
    out = tmp_path / "report.html"
    cut = tmp_path / "cut.h5"
    cut.write_bytes(content[: len(content) // 2])
    for bad in (cut, tmp_path / "none.h5", tmp_path / "empty"):
        if bad.name == "empty":
            bad.mkdir()
        done = CliRunner().invoke(cli, ["report", str(result), str(bad), "--out", str(out)])
        assert done.exit_code == 2, done.output
        assert len(done.output.strip().splitlines()) == 1
        assert str(bad) in done.output
        assert not out.exists()
    done = CliRunner().invoke(cli, ["report", str(result), "--out", str(tmp_path / "report.png")])
    assert done.exit_code == 2
    assert "--out" in done.output


def test_parts_have_the_names_in_the_result(tmp_path: Path) -> None:
    run = strip()
    count = run.shape.shape[1]
    panel = np.zeros(count, dtype=np.int64)
    panel[-3:] = -2
    names = tuple("base" if k < 5 else f"lid {EVIL}" if k < count - 3 else "rope" for k in range(count))
    run.layout = replace(run.layout, panel=panel, quad_names=names)
    read = read_solution(saved(run, tmp_path / "result.h5"))
    assert read.layout.quad_names == names
    parts = parts_of(read)
    assert list(zip(parts.names, parts.kinds, strict=True)) == [
        ("base", "plate"), (f"lid {EVIL}", "plate"), ("rope", "cable")
    ]  # fmt: skip
    assert parts.quads("rope").tolist() == [count - 3, count - 2, count - 1]


def test_bodies_and_films_of_a_scene_are_parts() -> None:
    from fsm.case.loading.load_case import load_case
    from fsm.model.compile.compile_case import compile_case

    cases = Path(__file__).parents[2] / "folding_cases"
    _, system = compile_case(load_case(cases / "plate_on_film" / "case.toml").case)
    assert system.quad_names == ("plate", *["film"] * 64)
    assert len(system.quad_names) == len(system.shape(0.0, system.initial()[0]))
    _, system = compile_case(load_case(cases / "sail_on_cables" / "case.toml").case)
    assert list(dict.fromkeys(system.quad_names)) == ["post", "sail", "halyard", "back stay", "left stay", "right stay"]
    assert len(system.quad_names) == len(system.panels)


def test_creases_of_a_sheet_are_those_of_their_channels(tmp_path: Path) -> None:
    """Names, corners and angles follow from the pattern in the case and from the shape; channels are not needed."""
    from fsm.case.loading.load_case import load_case
    from fsm.run.run_case import run_case

    case = Path(__file__).parents[2] / "folding_cases" / "fold_file" / "case.toml"
    run_case(load_case(case, ['save.channels=["crease.*.angle"]']), tmp_path, progress=False, figures=False)
    run = read_solution(tmp_path / "result.h5")
    found = creases_of(run)
    recorded = {name.removesuffix(".angle"): np.abs(channel.values.ravel()) for name, channel in run.channels.items()}
    assert {crease.name for crease in found} == recorded.keys()
    for crease, angle in zip(found, fold_angles(run, found).T, strict=True):
        np.testing.assert_allclose(angle, recorded[crease.name], atol=1e-6)
    for crease in found:
        first, second = run.shape[:, crease.first], run.shape[:, crease.second]
        for corner in crease.corners:
            line = run.shape.reshape(len(run), -1, 3)[:, corner, None]
            for side in (first, second):
                assert np.linalg.norm(side - line, axis=-1).min(axis=1).max() < 1e-6


@pytest.mark.parametrize(("kind", "facets"), [("kresling", 12), ("flexible", 4), ("pattern", 8)])
def test_creases_of_every_model_of_facets(kind: str, facets: int, tmp_path: Path) -> None:
    """Bars and flexible facets had no creases in the page, and flexible facets were one part."""
    import fsm

    file = tmp_path / "case.toml"
    assert CliRunner().invoke(cli, ["init", kind, str(file)]).exit_code == 0
    short = {
        "kresling": {"load.0.force": [0, 0, -5]}, "flexible": {"drive.0.travel": 0.001}, "pattern": {"sheet.fold_to": 0.2}
    }  # fmt: skip
    run = fsm.load(file).set(short[kind]).run(channels=["crease.*.angle"] if kind == "pattern" else []).solution
    creases, parts = creases_of(run), parts_of(run)
    assert [name for name in parts.names if name.startswith("facet ")] == [f"facet {k}" for k in range(1, facets + 1)]
    assert len(creases) == {"kresling": 12, "flexible": 4, "pattern": 4}[kind]
    corners = run.shape.reshape(len(run), -1, 3)
    for crease in creases:
        assert parts.of_quad[crease.first] != parts.of_quad[crease.second]
        for side in (crease.first, crease.second):
            line = corners[:, list(crease.corners)][:, :, None]
            near = np.linalg.norm(run.shape[:, side][:, None] - line, axis=-1).min(axis=2)
            assert (np.sort(near, axis=1)[:, :2] < 1e-9).all()  # both sides have two corners on the line
        places = corners[0, list(crease.corners)].reshape(-1, 2, 3)
        assert np.allclose(places[1:, 0], places[:-1, 1])  # the pieces follow each other
    angles = fold_angles(run, creases)
    assert (np.abs(angles[-1] - angles[0]) > 1e-4).any()
    for crease, angle in zip(creases, angles.T, strict=True):
        if f"{crease.name}.angle" in run.channels:
            np.testing.assert_allclose(angle, np.abs(run.channels[f"{crease.name}.angle"].values.ravel()), atol=1e-6)


@pytest.mark.parametrize("name", ["miura_push", "slit_annulus"])
def test_a_sheet_whose_pattern_does_not_fit_has_no_creases(name: str) -> None:
    from fsm.case.loading.load_case import load_case

    text = load_case(Path(__file__).parents[2] / "folding_cases" / name / "case.toml").text
    assert creases_of(strip(case_text=text)) == []


def test_view_opens_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or True)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    done = CliRunner().invoke(cli, ["view", str(saved(strip(), tmp_path / "a" / "result.h5"))])
    assert done.exit_code == 0, done.output
    page = Path(done.output.strip())
    assert page.is_file()
    assert page.is_relative_to(tmp_path)
    assert opened == [page.as_uri()]


@pytest.mark.parametrize("text", ["[strip", 'strip = 3\nscene = "x"\nobstacle = 7\ndrive = [1]\n', "[lattice]\n[strip]\n"])
def test_a_damaged_case_is_no_traceback(tmp_path: Path, text: str) -> None:
    run = strip(case_text=text)
    done = CliRunner().invoke(cli, ["report", str(saved(run, tmp_path / "result.h5")), "--out", str(tmp_path / "a.html")])
    assert done.exit_code in (0, 2), done.output
    assert "internal error" not in done.output
    if done.exit_code:
        assert str(tmp_path / "result.h5") in done.output


def test_many_results_fit_in_a_page() -> None:
    runs = {f"run {k}": strip_run(9, peak=1.0 + k) for k in range(44)}
    page = report_page(runs)
    assert len(page) < 10_000_000
    results = data_of(page)["results"]
    assert ["player" in result for result in results] == [True] * 40 + [False] * 4
    assert results[-1]["notes"][0] == (
        "The page has motion and curves for 40 results only, and not for this result."
    )
    assert len(data_of(page)["compare"]["overlay"]) == 44


def test_a_strip_without_summary_and_numbers_of_its_case() -> None:
    run = strip()
    run.summary = {}
    assert "player" in data_of(report_page({"part": run}))["results"][0]
