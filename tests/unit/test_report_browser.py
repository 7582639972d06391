"""Page of a report in a browser: it plays, follows a run, selects parts, and needs no network."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.run.run_case import run_case
from fsm.views.report.fields import fold_angles
from fsm.views.report.shapes import creases_of
from fsm.views.report.write import report_page
from tests.unit.plot_runs import strip_run, undriven
from tests.unit.test_report_page import EVIL, strip
from validation.benchmarks.reports import folded

websocket = pytest.importorskip("websocket", reason="websocket-client is not installed; it drives the browser")
from tests.browser import CHROMIUM, Browser, NoBrowser  # noqa: E402

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed (Debian: apt-get install chromium)")

READY = "document.body && document.body.dataset.ready === 'true'"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    try:
        found = Browser(tmp_path_factory.mktemp("profile"))
    except NoBrowser as error:
        pytest.skip(str(error))
    with found:
        yield found


@pytest.fixture(scope="module")
def page(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Browser:
    """Browser with the page of a strip; later tests open other pages."""
    opened(browser, tmp_path_factory.mktemp("page"), {"strip": strip()})
    browser.run("fsmReport.page.curves.drawAll()")
    browser.wait("fsmReport.page.curves.shown.every((one) => one.wired)")
    return browser


def opened(browser: Browser, folder: Path, runs: dict[str, Solution]) -> str:
    """Open the page of runs from disk, and return its address."""
    path = folder / "report.html"
    path.write_text(report_page(runs), encoding="utf-8")
    browser.open(path.as_uri(), READY)
    return path.as_uri()


def check_quiet(browser: Browser) -> None:
    """No error in the console, and no request besides the page."""
    assert [text for text in browser.messages if "GL Driver Message" not in text] == []
    assert browser.run("fsmReport.errors") == []
    assert set(browser.requests) == {browser.run("location.href")}


def pixels(browser: Browser) -> str:
    return browser.run("(fsmReport.page.player.render(), document.getElementById('canvas').toDataURL())")


def changed(browser: Browser, name: str, value: str) -> None:
    """Set a control to a value, as a user does."""
    events = "for (const kind of ['input', 'change']) one.dispatchEvent(new Event(kind));"
    browser.run(f"(() => {{ const one = document.getElementById('{name}'); one.value = {value!r}; {events} }})()")


def test_slider_moves_the_shape_and_the_cursors(page: Browser) -> None:
    changed(page, "slider", "0")
    before, points = pixels(page), page.run("Array.from(fsmReport.page.player.points)")
    changed(page, "slider", "30")
    moved = page.run("Array.from(fsmReport.page.player.points)")
    run = strip()
    expected = float(np.abs(run.shape[30] - run.shape[0]).max())
    assert max(abs(a - b) for a, b in zip(points, moved, strict=True)) == pytest.approx(expected, rel=1e-3)
    assert pixels(page) != before
    assert "travel 112.5 mm" in page.run("document.getElementById('now').textContent")
    lines = page.run("fsmReport.page.curves.shown.map((one) => [one.plot.key, one.line.hidden, one.line.offsetLeft])")
    assert {key for key, hidden, _ in lines if not hidden} >= {"force", "energy", "contact"}
    axis = "fsmReport.page.curves.shown[0].box._fullLayout.xaxis"
    assert lines[0][2] == pytest.approx(page.run(f"{axis}._offset + {axis}.d2p(112.5)"), abs=1.5)
    check_quiet(page)


@pytest.mark.nightly
def test_pointing_at_a_curve_moves_the_shape(page: Browser) -> None:
    changed(page, "slider", "0")
    page.run("document.getElementById('curves').scrollIntoView()")
    left, top, width, height = page.run(
        "(() => { const box = document.querySelector('#curves .nsewdrag').getBoundingClientRect();"
        " return [box.left, box.top, box.width, box.height]; })()"
    )
    page.move(left + 0.5 * width, top + 0.5 * height)
    page.wait("Math.abs(fsmReport.page.frame - 20) < 1.01", 20)
    assert page.run("fsmReport.page.curves.follow")
    check_quiet(page)


@pytest.mark.nightly
def test_play_views_section_and_start_shape(page: Browser) -> None:
    changed(page, "slider", "0")
    changed(page, "speed", "4")
    page.run("document.getElementById('play').click()")
    page.wait("fsmReport.page.frame > 5", 30)
    page.run("document.getElementById('play').click()")
    assert page.run("document.getElementById('play').textContent") == "Play"
    pictures = set()
    for view in ("iso", "front", "side", "top"):
        page.run(f"document.querySelector('[data-view={view}]').click()")
        pictures.add(pixels(page))
    page.run("document.querySelector('[data-view=iso]').click()")
    changed(page, "section", "x")
    pictures.add(pixels(page))
    changed(page, "section", "")
    changed(page, "rest", "beside")
    pictures.add(pixels(page))
    changed(page, "rest", "none")
    assert pixels(page) in pictures
    assert len(pictures) == 6
    check_quiet(page)


@pytest.mark.nightly
def test_every_colour_differs(page: Browser) -> None:
    names = page.run("Array.from(document.getElementById('colour').options, (option) => option.value)")
    assert {"part", "displacement", "fold angle", "curvature"} <= set(names)
    changed(page, "slider", "30")
    pictures = set()
    for name in names:
        changed(page, "colour", name)
        pictures.add(pixels(page))
        assert page.run("document.getElementById('legend').hidden") == (name == "part")
    assert len(pictures) == len(names)
    changed(page, "colour", "part")
    check_quiet(page)


def test_a_click_plots_a_channel(page: Browser) -> None:
    changed(page, "slider", "0")
    page.run("window.scrollTo(0, 0)")
    place = page.run("""(() => {
        const player = fsmReport.page.player, corners = [0, 1, 2, 3].map((k) => player.data.quads[4 * 44 + k]);
        player.render();
        const middle = corners.map((k) => player.vertex(k)).reduce((a, b) => a.add(b)).multiplyScalar(0.25);
        const at = middle.project(player.camera), box = player.canvas.getBoundingClientRect();
        return [box.left + (at.x + 1) * box.width / 2, box.top + (1 - at.y) * box.height / 2];
    })()""")
    page.move(*place)
    page.wait("document.getElementById('tip').textContent === 'panel 6'", 20)
    page.click(*place)
    page.wait("document.querySelector('#object-plots .js-plotly-plot')", 20)
    assert page.run("document.getElementById('object-name').textContent") == "panel 6"
    assert page.run("document.querySelector('#object-plots h3').firstChild.textContent") == "panel 6.displacement"
    page.run("fsmReport.page.select(fsmReport.page.objects.find((one) => one.name === 'crease.3'))")
    page.wait("document.querySelectorAll('#object-plots .js-plotly-plot').length === 2", 20)
    shown = page.run("Array.from(fsmReport.page.curves.shown.at(-1).plot.lines[0].y)")
    run = strip()
    np.testing.assert_allclose(shown, np.degrees(fold_angles(run, creases_of(run))[:, 2]), rtol=1e-5)
    check_quiet(page)


@pytest.mark.nightly
def test_light_and_dark(page: Browser) -> None:
    style = "getComputedStyle(document.body).color + getComputedStyle(document.body).backgroundColor"
    first = page.run(style)
    page.run("document.getElementById('theme').click()")
    assert page.run(style) != first
    page.run("document.getElementById('theme').click()")
    assert page.run(style) == first
    check_quiet(page)


def test_names_are_text(browser: Browser, tmp_path: Path) -> None:
    run = strip(drive_names=(EVIL,), pair_names=(f"{EVIL} - panel 2", "3-4"))
    run.pair_force[:, 0] = 1.0
    run.summary["warnings"] = [EVIL]
    opened(browser, tmp_path, {EVIL: run, "other": strip()})
    browser.run("fsmReport.page.curves.drawAll()")
    browser.wait("fsmReport.page.curves.shown.every((one) => one.wired)")
    assert browser.run("document.title") != "owned"
    assert browser.run("document.querySelectorAll('b').length") == 0
    assert EVIL in browser.run("document.getElementById('texts').textContent")
    assert "</script><script>" in browser.run("document.getElementById('curves').textContent")
    check_quiet(browser)


CASES = Path(__file__).parents[2] / "folding_cases"
SMALL = {
    "strip_trial": ["drive.0.travel=2 mm", "strip.segments_per_panel=4", 'save.channels=["crease.*"]', "expect=none"],
    "rotating_squares": ["drive.0.travel=0.14", 'save.channels=["crease.*.force", "crease.*.position"]'],
    "scissor_array": ["solve.end_time=30 ms", 'save.channels=["*"]'],
    "beam_between_panels": ["solve.end_time=2 ms", 'save.channels=["*"]'],
    "membrane_impact": ["membrane.mesh=[8, 8]", "vibration.duration=50 ms", "vibration.modes=6"],
}
"""Case of every kind with overrides that shorten it."""


@pytest.mark.nightly
@pytest.mark.parametrize("name", SMALL)
def test_a_case_of_every_kind(browser: Browser, tmp_path: Path, name: str) -> None:
    run_case(load_case(CASES / name / "case.toml", SMALL[name]), tmp_path, progress=False)
    check_case(browser, tmp_path, {name: read_solution(tmp_path / "result.h5")})


@pytest.mark.nightly
def test_a_crease_of_a_sheet_without_channels_is_picked(browser: Browser, tmp_path: Path) -> None:
    """The part had no name, so a click selected the facet behind it."""
    overrides = ["sheet.columns=3", "sheet.rows=3", "drive.0.travel=0.1"]
    run_case(load_case(CASES / "miura_push" / "case.toml", overrides), tmp_path, progress=False, figures=False)
    opened(browser, tmp_path, {"sheet": read_solution(tmp_path / "result.h5")})
    found = browser.run("""(() => {
        const player = fsmReport.page.player, box = player.canvas.getBoundingClientRect();
        player.render();
        return player.data.creases.map((crease) => {
            const [a, b] = crease.corners.map((k) => player.vertex(player.data.quads[k]));
            const at = a.lerp(b, 0.5).project(player.camera);
            const hit = player.pick(box.left + (at.x + 1) * box.width / 2, box.top + (1 - at.y) * box.height / 2);
            return hit && hit.kind === "crease" ? player.data.creases[hit.index].name === crease.name : false;
        });
    })()""")
    assert len(found) == 12
    assert sum(found) >= 9  # facets in front may hide others
    assert "fold angle" in browser.run("Array.from(document.getElementById('colour').options, (option) => option.value)")
    check_quiet(browser)


SHORTER = {
    "slit_annulus": ["sheet.mesh=[4, 30]", "load.0.force_per_length=[0, 0, 0.2]"],
    "tape_spring": ["sheet.mesh=[12, 8]", "drive.0.turn=0.03", "expect=none"],
    "pleated_cone": ["sheet.rows=1", 'drive.0.time.travel=["0 mm", "-4.6 mm", "87.33 mm"]'],
}
"""Overrides of shipped cases that take minutes."""


@pytest.mark.nightly
def test_a_picture_needs_few_triangles(browser: Browser, tmp_path: Path) -> None:
    """Creases and hidden arrows drew thirty triangles each: 83,000 for a sheet of 1296 panels, four pictures a second."""
    opened(browser, tmp_path, {"sheet": folded(400, 5)})
    assert browser.run("fsmReport.page.player.data.creases.length") == 760
    assert browser.run("(fsmReport.page.player.render(), fsmReport.page.player.renderer.info.render.triangles)") < 2500
    changed(browser, "colour", "fold angle")
    assert len(set(browser.run("Array.from(fsmReport.page.player.creases.mesh.geometry.attributes.color.array)"))) > 3
    check_quiet(browser)


@pytest.mark.nightly
def test_a_bent_crease_is_one_object(browser: Browser, tmp_path: Path) -> None:
    """A crease between flexible facets has several pieces of line; a click on any of them selects it."""
    file = Path(__file__).parents[2] / "fsm" / "cli" / "templates" / "flexible.toml"
    run_case(load_case(file, ["drive.0.travel=0.5 mm"]), tmp_path, progress=False, figures=False)
    opened(browser, tmp_path, {"sheet": read_solution(tmp_path / "result.h5")})
    assert browser.run("[fsmReport.page.player.data.creases.length, fsmReport.page.player.creases.count]") == [4, 16]
    found = browser.run("""(() => {
        const player = fsmReport.page.player, box = player.canvas.getBoundingClientRect(), { ends } = player.creases;
        player.view("top");
        player.render();
        return player.creaseOf.map((crease, k) => {
            const at = player.vertex(ends[2 * k]).lerp(player.vertex(ends[2 * k + 1]), 0.5).project(player.camera);
            const hit = player.pick(box.left + (at.x + 1) * box.width / 2, box.top + (1 - at.y) * box.height / 2);
            return hit !== null && hit.kind === "crease" && hit.index === crease;
        });
    })()""")
    assert sum(found) >= 14  # pieces at the inner vertex are near each other
    changed(browser, "colour", "fold angle")
    check_quiet(browser)


@pytest.mark.nightly
def test_the_cursor_follows_a_load_path(browser: Browser, tmp_path: Path) -> None:
    """The load curve of a path by arc length had no link with the motion, and its unstable part looked stable."""
    run_case(load_case(CASES / "kresling" / "case.toml"), tmp_path, progress=False, figures=False)
    run = read_solution(tmp_path / "result.h5")
    opened(browser, tmp_path, {"tube": run})
    browser.run("fsmReport.page.curves.drawAll()")
    browser.wait("fsmReport.page.curves.shown.every((one) => one.wired)")
    browser.run("fsmReport.page.show(60)")
    one = "fsmReport.page.curves.shown.find((one) => one.plot.key === 'load')"
    hidden, left, names = browser.run(
        f"[{one}.line.hidden, {one}.line.offsetLeft, {one}.plot.lines.map((line) => line.name)]"
    )
    assert run.load_path is not None
    way = 1e3 * np.interp(browser.run("fsmReport.page.curves.time"), run.time, run.load_path.way[:, 0])
    axis = f"{one}.box._fullLayout.xaxis"
    assert not hidden
    assert left == pytest.approx(browser.run(f"{axis}._offset + {axis}.d2p({float(way)})"), abs=1.5)
    assert names == ["load on edge top", "load on edge top, unstable"]
    check_quiet(browser)


@pytest.mark.nightly
def test_lines_of_a_large_sheet_wait_until_the_picture_rests(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path, {"sheet": folded(400, 5)})
    shown = browser.run("""(() => {
        const player = fsmReport.page.player, shown = [];
        player.setLines(player.outline, new Array(10000).fill(0));
        for (const [slow, drawn] of [[true, -Infinity], [true, performance.now() + 1e6], [false, performance.now()]]) {
            Object.assign(player, { slow, drawn });
            fsmReport.page.show(2 + shown.length);
            player.render();
            shown.push(player.outline.visible);
        }
        player.slow = true;
        player.render();
        return shown;
    })()""")
    assert shown == [True, False, True]
    browser.wait("fsmReport.page.player.outline.visible", 20)  # after a rest
    check_quiet(browser)


@pytest.mark.nightly
def test_views_contain_the_motion_and_use_the_window(browser: Browser, tmp_path: Path) -> None:
    """A view reserved space for a sphere around the motion: a tube filled a third of the window."""
    opened(browser, tmp_path, {"sheet": folded(100, 5)})
    for view in ("iso", "front", "side", "top"):
        browser.run(f"document.querySelector('[data-view={view}]').click()")
        reach = browser.run("""(() => {
            const player = fsmReport.page.player, reach = [0, 0];
            player.render();
            for (const frame of [0, player.frames - 1]) {
                player.show(frame);
                for (let k = 0; k < player.vertices; k++) {
                    const { x, y } = player.vertex(k).project(player.camera);
                    reach[0] = Math.max(reach[0], Math.abs(x)); reach[1] = Math.max(reach[1], Math.abs(y));
                }
            }
            return reach;
        })()""")
        assert 0.5 < max(reach) < 1.0, view
    check_quiet(browser)


@pytest.mark.nightly
def test_a_moving_picture_of_many_facets_has_fewer_pixels(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path, {"sheet": folded(4200, 3)})
    ratios = browser.run("""(() => {
        const player = fsmReport.page.player, ratios = [];
        for (const [slow, drawn] of [[true, -Infinity], [true, performance.now() + 1e6], [false, performance.now()]]) {
            Object.assign(player, { slow, drawn });
            player.render();
            ratios.push(player.renderer.getPixelRatio());
        }
        Object.assign(player, { slow: true, drawn: performance.now() + 500 });
        player.render();
        return ratios;
    })()""")
    assert ratios == [1, 0.7, 1]
    browser.wait("fsmReport.page.player.renderer.getPixelRatio() === 1", 20)  # after a rest
    check_quiet(browser)


@pytest.mark.nightly
def test_results_with_missing_numbers_are_not_drawn_as_their_minimum(browser: Browser, tmp_path: Path) -> None:
    """A missing number had a line at the smallest number; the scatter of two stages had the same quantity on all axes."""
    runs = {"a": strip_run(21, peak=1.0), "b": strip_run(21), "c": strip_run(21, peak=3.0)}
    for name in ("a", "b"):
        runs[name].summary["max_stress"] = runs[name].summary["peak_force"]
    opened(browser, tmp_path, runs)
    browser.wait("['scatter', 'parallel'].every((id) => document.getElementById(id)._fullLayout)")
    assert set(browser.run("document.getElementById('parallel').data[0].dimensions.map((one) => one.values.length)")) == {2}
    assert browser.run("document.getElementById('parallel-note').textContent") == "2 of 3 results have all of these numbers."
    chosen = browser.run("['x', 'y', 'colour'].map((axis) => document.getElementById(`scatter-${axis}`).value)")
    assert chosen[0] != chosen[1]
    opened(browser, tmp_path, {"pull": strip_run(21), "free": undriven(strip_run(11))})
    for box in ("scatter-box", "parallel-box"):
        assert browser.run(f"document.getElementById('{box}').hidden")
    check_quiet(browser)


@pytest.mark.nightly
@pytest.mark.parametrize("name", sorted(path.parent.name for path in CASES.glob("*/case.toml")))
def test_every_shipped_case(browser: Browser, tmp_path: Path, name: str) -> None:
    run_case(load_case(CASES / name / "case.toml", SHORTER.get(name, [])), tmp_path, progress=False)
    check_case(browser, tmp_path, {path.parent.name: read_solution(path) for path in sorted(tmp_path.rglob("result.h5"))})


def check_case(browser: Browser, folder: Path, runs: dict[str, Solution]) -> None:
    """The page of a run shows its motion, all curves, all colours and all objects without an error."""
    opened(browser, folder, runs)
    browser.run("fsmReport.page.curves.drawAll()")
    browser.wait("fsmReport.page.curves.shown.length && fsmReport.page.curves.shown.every((one) => one.wired)")
    pictures = set()
    for share in (0.0, 1.0):
        browser.run(f"fsmReport.page.show({share} * (fsmReport.page.result.player.records.length - 1))")
        pictures.add(pixels(browser))
    assert len(pictures) == 2, "the structure moves"
    for name in browser.run("Array.from(document.getElementById('colour').options, (option) => option.value)"):
        changed(browser, "colour", name)
    browser.run("fsmReport.page.objects.slice(0, 12).forEach((one) => fsmReport.page.select(one))")
    browser.run("fsmReport.page.result.player.modes.slice(0, 2).forEach((mode, k) => fsmReport.page.chooseMode(String(k)))")
    assert (folder / "report.html").stat().st_size < 10_000_000
    check_quiet(browser)


@pytest.mark.nightly
def test_several_results_and_a_run_without_drive(browser: Browser, tmp_path: Path) -> None:
    runs = {"a": strip_run(21, peak=1.0), "b": strip_run(21), "free": undriven(strip_run(11))}
    opened(browser, tmp_path, runs)
    browser.wait("['overlay', 'scatter', 'parallel'].every((id) => document.getElementById(id)._fullLayout)")
    assert browser.run("document.getElementById('overlay').data.length") == 2
    browser.run("fsmReport.page.choose(2)")
    browser.wait("fsmReport.page.number === 2 && fsmReport.page.result.name === 'free'")
    options = "Array.from(document.getElementById('over').options, (option) => option.value).join()"
    browser.wait(f"{options} === 'time,record'")
    check_quiet(browser)
