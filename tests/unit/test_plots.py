"""Plots: the figures are drawn, name their contents, and have units on their axes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib
import matplotlib.legend
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from fsm.results.quantities import summarise
from fsm.results.solution import ENERGIES, Layout, Solution
from fsm.views.plots.contact_map import HALF_HEIGHT, plot_contact_map
from fsm.views.plots.energy import STACK, plot_energy
from fsm.views.plots.figures import draw
from fsm.views.plots.force import plot_force, plot_overlay
from fsm.views.plots.motion import pick_records, plot_motion
from fsm.views.plots.png import write_png
from fsm.views.plots.style import STYLE, WIDE, evolution, figure, figure_unit, label_decades, shortened
from tests.unit.plot_runs import (
    ink,
    labels,
    strip_run,
    undriven,
    words,
)


def test_force(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run()
    plot_force(run, tmp_path / "plots" / "force.png")
    assert ink(tmp_path / "plots" / "force.png") > 0.02
    assert labels(figures[0]) == ["travel (mm)", "force (N)"]
    written = words(figures[0])
    assert "peak 2.00 N at 27.0 mm" in written
    assert "initial deformation" in written
    assert "contact from 13.0 mm" in written
    assert f"bending from {run.summary['bending_travel'] * 1e3:.1f} mm" in written
    line = figures[0].axes[0].lines[0]
    np.testing.assert_allclose(line.get_xdata(), run.travel[:, 0] * 1e3)
    np.testing.assert_allclose(line.get_ydata(), run.force[:, 0])


def test_force_finds_the_stages_where_the_summary_lacks_them(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run()
    run.summary = {}
    plot_force(run, tmp_path / "force.svg")
    assert "contact from 13.0 mm" in words(figures[0])


def test_force_of_several_drives(tmp_path: Path, figures: list[Figure]) -> None:
    plot_force(strip_run(drives=2), tmp_path / "force.pdf")
    assert {"crease 3", "crease 4"} <= set(words(figures[0]).splitlines())
    assert (tmp_path / "force.pdf").read_bytes().startswith(b"%PDF")


def test_turns_and_travels_have_separate_axes(tmp_path: Path, figures: list[Figure]) -> None:
    """A turn of 0.9 rad was drawn as a travel of 900 mm, and its moment in N."""
    run = strip_run(drives=3)
    plot_force(replace(run, layout=replace(run.layout, drive_names=("edge", "end (turn)", "rope"))), tmp_path / "force.png")
    force, moment = figures[0].axes
    assert (force.get_xlabel(), force.get_ylabel()) == ("travel (mm)", "force (N)")
    assert (moment.get_xlabel(), moment.get_ylabel()) == ("turn (deg)", "moment (N m)")
    assert [text.get_text() for text in moment.get_legend().get_texts()] == ["end (turn)"]
    assert {"edge", "rope"} <= {line.get_label() for line in force.lines}


def test_overlay(tmp_path: Path, figures: list[Figure]) -> None:
    curves = [(f"(80, {name})", strip_run(peak=peak)) for name, peak in (("low", 2.0), ("high", 3.0))]
    plot_overlay(curves, tmp_path / "overlay.png")
    assert ink(tmp_path / "overlay.png") > 0.01
    assert labels(figures[0]) == ["travel (mm)", "force (N)"]
    assert "(80, low): 2.00 N at 27.0 mm" in words(figures[0])
    assert "(80, high): 3.00 N at 27.0 mm" in words(figures[0])


def test_overlay_of_many_curves_tells_them_apart(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run(31)
    plot_overlay([(f"run {k}", run) for k in range(24)], tmp_path / "overlay.png")
    curves = [line for line in figures[0].axes[0].lines if len(np.atleast_1d(line.get_xdata())) > 1]
    assert len({(line.get_color(), line.get_linestyle()) for line in curves}) == 24


@pytest.mark.parametrize("name", ["$", "a$b$c", "$\\frac{", "x_$^", "%s {}", "\N{CJK UNIFIED IDEOGRAPH-65E5}", "y" * 100])
def test_names_are_drawn_as_they_are(tmp_path: Path, figures: list[Figure], name: str) -> None:
    run = strip_run(31, drives=2)
    layout = replace(run.layout, drive_names=(name, "other"), pair_names=(name, f"{name} 2"))
    draw(replace(run, layout=layout), tmp_path)
    assert any(shortened(name) in words(fig) for fig in figures)


LONG = "fold_angle-{} deg_travel-25 mm_friction-none"


@pytest.mark.parametrize(
    "names",
    [
        ["80 deg low", "80 deg high", "83 deg low", "83 deg high"],
        [LONG.format(k) for k in range(4)],
        [LONG.format(k) for k in range(12)],
        ["W" * 200, 60 * "word "],
        [f"run {k}" for k in range(100)],
    ],
    ids=["short", "long", "many long", "longer than a line", "hundred"],
)
def test_names_of_an_overlay_stay_in_the_figure(tmp_path: Path, figures: list[Figure], names: list[str]) -> None:
    run = strip_run(31)
    plot_overlay([(name, run) for name in names], tmp_path / "overlay.png")
    (fig,) = figures
    (legend,) = fig.findobj(matplotlib.legend.Legend)
    box, whole, curves = legend.get_window_extent(), fig.bbox, fig.axes[0].get_window_extent()
    assert box.x0 >= 0 and box.y0 >= 0
    assert box.x1 <= whole.x1 and box.y1 <= whole.y1
    assert curves.width > 0.35 * whole.width
    assert curves.height > 0.8 * WIDE[1] * fig.dpi
    written = words(fig).replace("\n", "").replace(" ", "")
    assert all(name.replace(" ", "") in written for name in names)


def snapping(peak: float = 0.4577) -> Solution:
    """A run with a snap and a dynamic peak, whose legend is wide."""
    run = strip_run(peak=peak)
    curve = run.force_curve
    path, force = curve.path.copy(), curve.force.copy()
    path[100:105], path[105:] = 1, 2
    force[102] = 3.0 * peak
    run.curve = replace(curve, path=path, force=force)
    run.summary = summarise(run.curve, run.layout.pair_names)
    event = {"kind": "snap", "travel": 0.1, "end_travel": 0.105, "force": 0.2 * peak, "end_force": 0.1 * peak}
    run.summary["events"] = [event]
    return run


def test_legends_of_a_run_stay_in_its_figures(tmp_path: Path, figures: list[Figure]) -> None:
    run = snapping()
    for plot in (plot_force, plot_motion, plot_contact_map):
        plot(run, tmp_path / "plot.png")
    for fig in figures:
        (legend,) = fig.legends
        box, whole = legend.get_window_extent(), fig.bbox
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= whole.x1 and box.y1 <= whole.y1
    assert "dynamic 1.37 N at 102 mm" in words(figures[0])


@pytest.mark.parametrize("height", [0.3, 0.8, 1.0, 1.1, 1.2, 1.5, 2.0])
def test_titles_of_the_motion_stay_in_the_figure(tmp_path: Path, height: float) -> None:
    run = snapping()
    run.shape[..., 2] *= height
    plot_motion(run, tmp_path / "motion.png")
    with Image.open(tmp_path / "motion.png") as picture:
        pixels = np.asarray(picture.convert("L"))
    assert (pixels[[0, -1]] == 255).all()
    assert (pixels[:, [0, -1]] == 255).all()


def test_an_overlay_cuts_dynamic_forces_off(tmp_path: Path, figures: list[Figure]) -> None:
    run = snapping()
    plot_overlay([("one", run)], tmp_path / "overlay.png")
    still, moving, marker = figures[0].axes[0].lines
    assert np.isnan(still.get_ydata()[100:105]).all()
    assert not np.isnan(moving.get_ydata()[99:106]).any()
    assert moving.get_linewidth() < still.get_linewidth()
    (top,) = marker.get_ydata()
    assert top == run.summary["peak_force"]
    assert max(np.nanmax(still.get_ydata()), np.nanmax(moving.get_ydata())) <= top * (1 + 1e-12)


def test_decades_are_labelled_in_plain_text(tmp_path: Path, figures: list[Figure]) -> None:
    """Labels of a spectrum read $\\mathdefault{10^{-3}}$, since names may hold a $ and formulas are not parsed."""
    with figure(tmp_path / "log.png") as fig:
        ax = fig.add_subplot()
        ax.loglog([3e-5, 20.0], [2.0, 8.0])
        label_decades(ax.xaxis)
        label_decades(ax.yaxis)
    x, y = ([label.get_text() for label in labels(which="both")] for labels in (ax.get_xticklabels, ax.get_yticklabels))
    assert {"0.001", "0.1"} <= set(x)
    assert len([text for text in y if text]) >= 2  # less than a decade has labels, too
    assert not any("$" in text for text in (*x, *y))


def test_png_files_hold_all_pixels(tmp_path: Path) -> None:
    pixels = np.random.default_rng(4).integers(0, 256, (17, 31, 4), dtype=np.uint8)
    write_png(tmp_path / "a.png", pixels[..., :3], 200.0)
    with Image.open(tmp_path / "a.png") as image:
        assert image.mode == "RGB" and np.array_equal(np.asarray(image), pixels[..., :3])
        assert image.info["dpi"] == pytest.approx((200.0, 200.0), rel=1e-3)


def test_energy(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run()
    plot_energy(run, tmp_path / "energy.png")
    assert ink(tmp_path / "energy.png") > 0.1
    assert labels(figures[0]) == ["travel (mm)", "energy since the start (mJ)", "balance residual (nJ)"]
    written = words(figures[0])
    assert "panels" in written
    assert "kinetic" not in written  # it is zero throughout
    top = max(path.vertices[:, 1].max() for c in figures[0].axes[0].collections for path in c.get_paths())
    work = figures[0].axes[0].lines[0].get_ydata()
    assert top == pytest.approx(work.max(), rel=1e-9)  # the stack and the dashed line end together


def test_every_energy_that_is_stored_is_stacked(tmp_path: Path, figures: list[Figure]) -> None:
    assert STACK.keys() == ENERGIES.keys() - {"work", "error"}
    run = strip_run()
    run.energy |= {"bars": run.energy["panels"], "hinges": run.energy["creases"]}
    run.energy |= {"panels": np.zeros(len(run)), "creases": np.zeros(len(run))}
    plot_energy(run, tmp_path / "energy.png")
    assert {"bars", "hinges"} <= set(words(figures[0]).splitlines())
    top = max(path.vertices[:, 1].max() for c in figures[0].axes[0].collections for path in c.get_paths())
    assert top == pytest.approx(figures[0].axes[0].lines[0].get_ydata().max(), rel=1e-9)


def test_scene_without_a_drive_is_drawn_over_time(tmp_path: Path, figures: list[Figure]) -> None:
    run = undriven(strip_run(31))
    plot_force(run, tmp_path / "force.png")
    plot_energy(run, tmp_path / "energy.png")
    plot_motion(run, tmp_path / "motion.png")
    plot_overlay([("free", run)], tmp_path / "overlay.png")
    assert labels(figures[0]) == ["time (s)", "normal force of contact (N)"]
    assert labels(figures[1])[0] == "time (s)"
    assert "75.0 s" in words(figures[2])
    assert "none of the runs has a drive" in words(figures[3])


def test_contact_map(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run()
    plot_contact_map(run, tmp_path / "contact.png")
    assert ink(tmp_path / "contact.png") > 0.05
    assert labels(figures[0]) == ["travel (mm)", "normal force (N)"]
    written = words(figures[0])
    assert "3-4" in written
    assert "1-2" not in written  # never touches
    assert "contact from 13.0 mm" in written
    assert "full height: contact area 274 mm²" in written
    (bands,) = (c for c in figures[0].axes[0].collections if c.get_array() is not None)
    touching = run.pair_force[:, 1] > 1e-9
    np.testing.assert_allclose(bands.get_array(), run.pair_force[touching, 1])
    boxes = np.array([path.vertices[:4] for path in bands.get_paths()])
    left, right, heights = boxes[:, 0, 0], boxes[:, 1, 0], np.ptp(boxes[:, :, 1], axis=1)
    np.testing.assert_allclose(left[1:], right[:-1])
    assert left[0] == pytest.approx(13.5)  # records are 1 mm apart, and the first record in contact is at 14 mm
    assert right[-1] == pytest.approx(150.0)
    assert heights[-1] == pytest.approx(2 * HALF_HEIGHT)
    assert (np.diff(heights) > 0).all()


def test_contact_map_marks_snaps(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run()
    run.summary["events"] = [{"kind": "snap", "travel": 0.05, "end_travel": 0.05}]
    plot_contact_map(run, tmp_path / "contact.png")
    assert "snap" in words(figures[0])
    assert any(np.allclose(line.get_xdata(), 50.0) for line in figures[0].axes[0].lines)


def test_contact_map_of_other_runs(tmp_path: Path, figures: list[Figure]) -> None:
    """Over time; for a file without areas; for many pairs; without contact; with one record."""
    free = undriven(strip_run(31))
    plot_contact_map(free, tmp_path / "contact.png")
    assert labels(figures[0]) == ["time (s)", "normal force (N)"]
    free.pair_area = np.full_like(free.pair_area, np.nan)
    plot_contact_map(free, tmp_path / "contact.png")
    assert "full height" not in words(figures[1])
    (bands,) = (c for c in figures[1].axes[0].collections if c.get_array() is not None)
    assert {round(float(np.ptp(path.vertices[:, 1])), 9) for path in bands.get_paths()} == {2 * HALF_HEIGHT}
    free.layout = Layout(pair_names=tuple(f"{k}-{k + 1}" for k in range(100)))
    free.pair_force = np.repeat(free.pair_force[:, 1:], 100, axis=1)
    free.pair_area = np.ones_like(free.pair_force)
    plot_contact_map(free, tmp_path / "contact.png")
    named = figures[2].axes[0].get_yticklabels()
    assert [label.get_text() for label in named[:2]] == ["0-1", "3-4"]
    free.pair_force = 0.0 * free.pair_force
    plot_contact_map(free, tmp_path / "contact.png")
    assert "nothing touches" in words(figures[3])
    alone = strip_run(1)
    alone.pair_force[:] = 1.0
    plot_contact_map(alone, tmp_path / "contact.png")


@pytest.mark.parametrize("n", [1, 2])
def test_very_short_runs_are_drawn(tmp_path: Path, n: int) -> None:
    run = strip_run(n)
    run.energy = {name: np.zeros(n) for name in ENERGIES}
    plot_force(run, tmp_path / "force.png")
    plot_energy(run, tmp_path / "energy.png")
    plot_motion(run, tmp_path / "motion.png")
    plot_overlay([("short", run)], tmp_path / "overlay.png")


def test_no_global_state_is_left_behind(tmp_path: Path) -> None:
    before = {name: matplotlib.rcParams[name] for name in STYLE}
    plot_force(strip_run(31), tmp_path / "force.png")
    assert {name: matplotlib.rcParams[name] for name in STYLE} == before


@pytest.mark.parametrize(
    ("value", "unit"), [(2.0, "J"), (0.02, "mJ"), (3e-6, "µJ"), (3e-9, "nJ"), (1e-12, "pJ"), (0, "J")]
)
def test_unit_of_energies_in_figures(value: float, unit: str) -> None:
    assert figure_unit("J", np.array([0.0, -value, np.nan])).name == unit


def test_what_comes_after_the_pull_is_drawn_over_time_or_steps() -> None:
    """Two fifths of the records are at the end of the travel, so in a plot over the travel they would coincide."""
    run = strip_run(101)
    assert evolution(run)[1] == "travel (mm)"
    travel = np.minimum(run.travel, run.travel[60])
    time = np.where(np.arange(101) <= 60, run.time, run.time[60] + 1e-4 * np.arange(-60, 41))
    rests = replace(run, travel=travel, time=time)
    assert evolution(rests)[1] == "time (s)"
    second = np.where(np.arange(101) <= 60, 0.0, 1e-3 * np.arange(-60, 41))[:, None]
    assert evolution(replace(rests, travel=np.hstack([travel, second])))[1] == "time (s)"  # another drive goes on
    named = replace(rests.layout, step_names=("start", "pull", "blow"))
    steps = replace(rests, step=np.where(np.arange(101) <= 60, 2, 3), layout=named)
    x, label = evolution(steps)
    assert label == "step: pull (45.0 s), blow (0.00400 s)"
    assert np.all(np.diff(x) > 0.0)
    assert (x[0], x[60], x[-1]) == pytest.approx((0.0, 1.0, 2.0))
    chosen = pick_records(steps)
    assert sum(record > 60 for record in chosen) == 3
