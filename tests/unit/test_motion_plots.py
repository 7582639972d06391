"""Figures of the motion: in the plane, in space, and with obstacles."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import ImageDraw

from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.errors import CaseError
from fsm.model.compile.compile import compile_scene
from fsm.results.solution import Solution
from fsm.views.plots.motion import _title, leaves_plane, pick_records, plot_motion
from fsm.views.plots.movie import write_gif
from fsm.views.plots.style import rounded
from tests.unit.plot_runs import (
    CELLS,
    ink,
    labels,
    strip_run,
    undriven,
    words,
)


def test_motion_in_the_plane(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run()
    plot_motion(run, tmp_path / "motion.png")
    assert ink(tmp_path / "motion.png") > 0.01
    assert len(figures[0].axes) == 6
    assert set(labels(figures[0])) == {"x (mm)", "z (mm)"}
    assert all(ax.get_aspect() == 1.0 for ax in figures[0].axes)
    assert len({ax.get_xlim() + ax.get_ylim() for ax in figures[0].axes}) == 1
    assert "27.0 mm, 2.00 N" in words(figures[0])
    drawn = figures[0].axes[0].collections[0].get_segments()
    assert len(drawn) == 6 * CELLS
    np.testing.assert_allclose(drawn[0][0], [0, 0], atol=1e-9)
    ends = run.shape[0, CELLS, 1] * 1e3
    np.testing.assert_allclose(drawn[CELLS][1], ends[[0, 2]])


@pytest.mark.parametrize("views", [1, 2, 4, 6])
def test_pictures_in_the_plane_do_not_overlap(views: int, tmp_path: Path, figures: list[Figure]) -> None:
    plot_motion(strip_run(), tmp_path / "motion.png", views)
    fig = figures[0]
    boxes = [ax.get_tightbbox() for ax in fig.axes] + [legend.get_window_extent() for legend in fig.legends]
    for k, box in enumerate(boxes):
        assert box.x0 >= 0.0 and box.y0 >= 0.0 and box.x1 <= fig.bbox.width and box.y1 <= fig.bbox.height
        for other in boxes[:k]:
            assert not box.overlaps(other)


def test_a_figure_is_drawn_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Figure] = []
    draw = Figure.draw
    monkeypatch.setattr(Figure, "draw", lambda self, renderer: (drawn.append(self), draw(self, renderer))[1])
    plot_motion(strip_run(), tmp_path / "motion.png")
    assert len(drawn) == 1


def test_motion_of_a_scissor_array_lies_in_x_and_y(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run(31)
    run.layout = replace(run.layout, case_text="[scissor]\nunits = 2\n")
    plot_motion(run, tmp_path / "motion.png")
    assert set(labels(figures[0])) == {"x (mm)", "y (mm)"}


def test_animation_of_a_scissor_array_lies_in_x_and_y(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn, text = list[str](), ImageDraw.ImageDraw.text

    def kept(draw: ImageDraw.ImageDraw, at: Any, words: str, **options: Any) -> None:
        drawn.append(words)
        text(draw, at, words, **options)

    monkeypatch.setattr(ImageDraw.ImageDraw, "text", kept)
    run = strip_run(3)
    run.layout = replace(run.layout, case_text="[scissor]\nunits = 2\n")
    write_gif(run, tmp_path / "motion.gif")
    assert "x to the right, y upwards" in drawn
    assert ink(tmp_path / "motion.gif") > 0.001


def test_squares_of_a_lattice_are_seen_as_squares(tmp_path: Path, figures: list[Figure]) -> None:
    """Hinges join their corners: facing corners of neighbours are a hinge apart."""
    case = """
        [lattice]
        columns = 2
        rows = 2
        spacing = 0.015
        hinge_length = 0.002
        angle = 0.3
        axial = 1e5
        shear = 1e3
        rotational = 1e-3
        depth = 0.01
        density = 1000
        """
    lattice = Case.model_validate(tomllib.loads(case))
    system = compile_scene(build_scene(lattice))
    run = undriven(strip_run(1))
    run.layout = replace(run.layout, case_text=case)
    run.shape = system.shape(0.0, system.initial()[0])[None]
    plot_motion(run, tmp_path / "motion.png")
    ax = figures[0].axes[0]
    first, second, *_ = (path.vertices[:4] for path in ax.collections[0].get_paths())
    side = np.sqrt(2.0) * (15.0 - 2.0) / (2.0 * np.cos(0.3))
    for square in (first, second):
        np.testing.assert_allclose(np.linalg.norm(square - np.roll(square, 1, axis=0), axis=1), side)
    apart = np.linalg.norm(first[:, None] - second[None], axis=-1)
    assert apart.min() == pytest.approx(2.0)
    assert ax.get_xlim()[0] < first[:, 0].min()  # the obstacles are completely in the picture


def test_motion_out_of_the_plane_is_drawn_in_space(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run(31, out=0.02)
    plot_motion(run, tmp_path / "motion.png")
    assert all(ax.name == "3d" for ax in figures[0].axes)
    assert ink(tmp_path / "motion.png") > 0.01


OBSTACLES = """
[[obstacle]]
name = "floor"
shape = "plane"
position = [0.0, 0.0, -0.001]

[[obstacle]]
name = "post"
shape = "cylinder"
radius = 0.01
length = 0.1
position = [0.3, 0.0, 0.05]

[[obstacle]]
name = "block"
shape = "box"
size = [0.02, 0.03, 0.04]
position = [0.0, 0.0, 0.1]
orientation = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]
body = "carrier"
"""


def with_obstacles(run: Solution) -> Solution:
    """The block on a body that goes from x = 0.1 to 0.2 m, and turns by a right angle."""
    q = np.zeros((len(run), 3))
    q[:, 0] = np.linspace(0.1, 0.2, len(run))
    q[:, 2] = np.linspace(0.0, np.pi / 2, len(run))
    layout = replace(run.layout, case_text=OBSTACLES, body_names=("carrier",))
    return replace(run, q=q, layout=layout)


def test_obstacles_in_the_plane(tmp_path: Path, figures: list[Figure]) -> None:
    """A half-plane as large as the picture, a circle, and a rectangle that moves with its body."""
    plot_motion(with_obstacles(strip_run()), tmp_path / "motion.png")
    floor, post, block = (path.vertices for path in figures[0].axes[0].collections[1].get_paths())
    assert floor[:, 1].max() == pytest.approx(-1.0)
    low, high = figures[0].axes[0].get_xlim()
    assert floor[:, 0].min() < low
    assert floor[:, 0].max() > high > 310.0  # the post is in the picture
    np.testing.assert_allclose(np.hypot(*(post - [300.0, 50.0]).T), 10.0)
    np.testing.assert_allclose([block.min(axis=0), block.max(axis=0)], [[80.0, 90.0], [120.0, 110.0]])
    last = figures[0].axes[-1].collections[1].get_paths()[2].vertices
    np.testing.assert_allclose([last.min(axis=0), last.max(axis=0)], [[290.0, -20.0], [310.0, 20.0]], atol=1e-9)
    assert len({ax.get_xlim() + ax.get_ylim() for ax in figures[0].axes}) == 1


def test_obstacles_that_move_stay_in_the_picture(tmp_path: Path, figures: list[Figure]) -> None:
    """A ball without a plate rolled out of it; here the block goes to x = 0.2 m, the post stands at 0.3 m."""
    run = with_obstacles(strip_run())
    alone = OBSTACLES.replace("position = [0.3, 0.0, 0.05]", "position = [0.1, 0.0, 0.05]")
    layout = replace(run.layout, panel=np.zeros(0, dtype=np.int64), case_text=alone)
    plot_motion(replace(run, shape=np.zeros((len(run), 0, 4, 3)), layout=layout), tmp_path / "motion.png")
    low, high = figures[0].axes[0].get_xlim()
    assert low < 80.0 < 210.0 < high


@pytest.mark.parametrize(
    "text",
    [
        OBSTACLES.replace('shape = "plane"', 'shape = "heap"'),
        OBSTACLES.replace("radius = 0.01", 'radius = "wide"'),
        OBSTACLES.replace("[0.0, 0.0, 0.1]", "[0.0, 0.1]"),
        "obstacle = [1, 2]",
    ],
)
def test_obstacles_of_a_damaged_result_are_refused_in_words(tmp_path: Path, text: str) -> None:
    run = with_obstacles(strip_run())
    with pytest.raises(CaseError, match="damaged: its obstacles cannot be drawn"):
        plot_motion(replace(run, layout=replace(run.layout, case_text=text)), tmp_path / "motion.png")


def test_obstacles_in_space(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run(31, out=0.02)
    plot_motion(run, tmp_path / "without.png")
    plot_motion(with_obstacles(run), tmp_path / "motion.png")
    plates, solids, planes = (figures[1].axes[0].collections[k] for k in range(3))
    assert len(plates.get_facecolor()) > 1
    assert solids.get_alpha() == 0.3
    assert planes.get_alpha() == 0.15
    assert len(figures[0].axes[0].collections) == 1


def test_what_counts_as_leaving_the_plane() -> None:
    flat = strip_run(5).shape
    assert not leaves_plane(flat)
    assert leaves_plane(strip_run(5, out=0.002).shape)
    twisted = flat.copy()
    twisted[-1, :, 3, 2] += 1e-3
    assert leaves_plane(twisted)
    assert not leaves_plane(np.zeros((3, 0, 4, 3)))


def test_records_of_the_motion() -> None:
    run = strip_run()
    chosen = pick_records(run)
    assert len(chosen) == 6
    assert chosen[0] == 0
    assert chosen[-1] == len(run) - 1
    assert int(np.argmax(run.force)) in chosen
    assert pick_records(strip_run(3)) == [0, 1, 2]
    assert pick_records(strip_run(1)) == [0]


def test_titles_have_the_force_of_the_drive_that_has_one(tmp_path: Path) -> None:
    """Titles had "100 mm, 0 N" below a second drive whose peak was 45 N."""
    run = strip_run(31, drives=2)
    idle = np.stack([1e-9 * run.force[:, 0], run.force[:, 0]], axis=1)
    other = replace(run, force=idle, travel=np.stack([run.travel[:, 0], 2.0 * run.travel[:, 0]], axis=1))
    assert _title(other, 30, []) == f"{rounded(2e3 * run.travel[30, 0])} mm, {rounded(run.force[30, 0])} N"
    assert _title(run, 30, []).startswith(f"{rounded(1e3 * run.travel[30, 0])} mm")
