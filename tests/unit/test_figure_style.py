"""Style and format of figures; each colour is used once; outlines, labels and legends of the figures of films."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from fsm.case.models.scene import Body, Plate, Scene
from fsm.cli.command_line import cli
from fsm.model.compile.compile import compile_scene
from fsm.results.channel import Channel, ChannelInfo
from fsm.results.film import Film
from fsm.results.quantities import STAGES
from fsm.results.solution import Layout, Solution
from fsm.results.writer import ResultWriter
from fsm.views.plots.channels import plot_channels
from fsm.views.plots.contact_map import plot_contact_map
from fsm.views.plots.drawing import drawing
from fsm.views.plots.energy import STACK, plot_energy
from fsm.views.plots.figures import draw, figures_of
from fsm.views.plots.force import plot_force, plot_overlay
from fsm.views.plots.motion import plot_motion
from fsm.views.plots.parts import colours_of_parts, handles_of_parts, polygons
from fsm.views.plots.style import COLOURS, rounded, stage_shade
from fsm.views.plots.vibration import plot_modes, plot_tension
from tests.unit.plot_runs import strip_run, undriven, words
from tests.unit.test_report_page import records_of, saved


def sizes(fig: Figure) -> tuple[float, float]:
    ax = fig.axes[0]
    return ax.xaxis.label.get_fontsize(), ax.lines[0].get_linewidth()


def test_a_slide_has_larger_letters_and_thicker_lines(tmp_path: Path, figures: list[Figure]) -> None:
    for style in ("paper", "slide"):
        with drawing(style):
            plot_force(strip_run(31), tmp_path / f"{style}.png")
    (letters, lines), (larger, thicker) = map(sizes, figures)
    assert letters == 9.0
    assert larger > 1.3 * letters
    assert thicker > 1.3 * lines


def test_the_effort_of_a_turning_drive_is_a_moment(tmp_path: Path, figures: list[Figure]) -> None:
    """The axes had N m and angles, but the peak and the stages had N and mm."""
    run = strip_run(31)
    turning = replace(run, layout=replace(run.layout, drive_names=("lid (turn)",)))
    plot_force(turning, tmp_path / "force.png")
    plot_contact_map(turning, tmp_path / "contact.png")
    plot_overlay([("a", turning)], tmp_path / "overlay.png")
    plot_overlay([("a", turning), ("b", run)], tmp_path / "both.png")
    force, contact, overlay, both = map(words, figures)
    for text in (force, contact, overlay):
        assert "deg" in text
        assert not re.search(r" mm\b(?!²)|\(mm\)| N at", text)
    assert "travel (mm) or turn (deg)" in both and "force (N) or moment (N m)" in both


@pytest.mark.parametrize(("suffix", "text"), [(".svg", b">travel (mm)</text>"), (".pdf", b"/FontFile2")])
def test_figures_for_a_paper_are_drawn_in_lines_and_letters(tmp_path: Path, suffix: str, text: bytes) -> None:
    with drawing(suffix=suffix):
        paths = draw(strip_run(31), tmp_path)
    assert {path.suffix for path in paths} == {suffix}
    assert text in (tmp_path / f"force{suffix}").read_bytes()


def test_figures_of_an_earlier_run_in_another_format_are_deleted(tmp_path: Path) -> None:
    run = strip_run(11)
    draw(run, tmp_path)
    with drawing(suffix=".pdf"):
        draw(run, tmp_path)
    assert (tmp_path / "force.png").is_file()  # the same run, drawn again
    (tmp_path / "spectrum.svg").touch()
    with drawing(suffix=".pdf"):
        draw(run, tmp_path, alone=True)
    assert {path.name for path in tmp_path.iterdir()} == {"force.pdf", "motion.pdf", "energy.pdf", "contact.pdf"}


@pytest.mark.figures
def test_commands_have_a_style_and_a_format(tmp_path: Path) -> None:
    case = Path(__file__).parents[2] / "folding_cases" / "rotating_squares" / "case.toml"
    (tmp_path / "case.toml").write_text(case.read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "table.csv").write_text("case,drive.0.travel\na,0.14 mm\n", encoding="utf-8")
    chosen = ["--format", "svg", "--style", "slide", "--quiet"]
    table = ["table", str(tmp_path / "table.csv"), "--out", str(tmp_path / "out"), "--figures", "all"]
    done = CliRunner().invoke(cli, [*table, *chosen])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "out" / "overlay.svg").is_file()
    text = (tmp_path / "out" / "a" / "force.svg").read_text(encoding="utf-8")
    assert "font-size: 12.6px" in text  # 1.4 times 9
    result = str(tmp_path / "out" / "a" / "result.h5")
    done = CliRunner().invoke(cli, ["plot", result, "--out", str(tmp_path / "again"), "--format", "pdf"])
    assert done.exit_code == 0, done.output
    assert {path.suffix for path in (tmp_path / "again").iterdir()} == {".pdf"}


@pytest.mark.parametrize("panels", [6, 12, 30])
def test_no_two_panels_have_one_colour(panels: int) -> None:
    run = strip_run(3)
    shape = np.repeat(run.shape[:, :1], panels, axis=1)
    run = replace(run, shape=shape, layout=replace(run.layout, panel=np.arange(1, panels + 1)))
    assert len(set(colours_of_parts(run))) == panels
    named = [handle.get_label() for handle in handles_of_parts(run)]
    assert named[0] == "panel 1"
    assert named[-1] == f"panel {panels}"


def test_stages_and_energies_have_colours_of_their_own() -> None:
    shades = {stage_shade({"name": name}) for name in STAGES}
    assert len(shades) == len(STAGES)
    assert not {colour for colour, _ in shades} & set(COLOURS)
    assert len({to_hex(colour) for _, colour in STACK.values()}) == len(STACK)


def test_the_motion_names_panels_and_stages(tmp_path: Path, figures: list[Figure]) -> None:
    plot_motion(strip_run(), tmp_path / "motion.png")
    written = words(figures[0]).splitlines()
    assert {f"panel {k}" for k in range(1, 7)} <= set(written)
    assert {"initial deformation", "bending"} <= set(written)


def test_energies_that_cannot_be_seen_have_no_colour_in_the_legend(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run()
    run.energy["kinetic"] = 1e-4 * run.energy["work"]
    plot_energy(run, tmp_path / "energy.png")
    assert "each below 0.2 %:\nkinetic" in words(figures[0])


def outline(corners: int) -> Solution:
    """A plate with a regular outline in space, in one record."""
    angles = 2.0 * np.pi * np.arange(corners) / corners
    points = [(0.01 * float(np.cos(a)), 0.01 * float(np.sin(a))) for a in angles]
    plate = Plate(length=0.02, width=0.02, thickness=1e-3, outline=points)
    bodies = [Body(name=f"plate {k}", mass=0.01, inertia=[1e-6] * 3, position=[0.03 * k, 0, 0], plate=plate) for k in (0, 1)]
    system = compile_scene(Scene(bodies=bodies))
    run = undriven(strip_run(1))
    names, panels = system.quad_names, system.panels
    layout = Layout(panel=panels, quad_names=names)
    return replace(run, shape=system.shape(0.0, system.initial()[0])[None], layout=layout)


@pytest.mark.parametrize("corners", [3, 4, 5, 6, 9])
def test_outlines_of_facets_are_polygons(corners: int) -> None:
    faces, first = polygons(outline(corners), 0)
    assert [len(face) for face in faces] == [corners, corners]
    assert first[0] == 0
    sides = np.linalg.norm(faces[1] - np.roll(faces[1], 1, axis=0), axis=1)
    np.testing.assert_allclose(sides, 0.02 * np.sin(np.pi / corners))


@pytest.mark.parametrize("sides", [(1.0, 1.0, 1.0), (1.0, 1.0, 0.05), (0.1, 0.1, 1.0), (1.0, 0.2, 0.2)])
def test_axes_in_space_have_labels_and_numbers_that_do_not_meet(
    sides: tuple[float, float, float], tmp_path: Path, figures: list[Figure]
) -> None:
    run = strip_run(3, out=0.02)
    sizes = np.ptp(run.shape.reshape(-1, 3), axis=0)
    run.shape *= np.array(sides) / sizes
    plot_motion(run, tmp_path / "motion.png")
    for ax in figures[0].axes:
        assert [ax.get_xlabel(), ax.get_ylabel(), ax.get_zlabel()] == ["x (mm)", "y (mm)", "z (mm)"]
        for axis, own_low, own_high in ((ax.xaxis, True, False), (ax.yaxis, False, False), (ax.zaxis, False, True)):
            low, high = axis.get_view_interval()
            places = (axis.get_majorticklocs() - low) / (high - low)
            assert 1 <= len(places) <= 6
            assert places.min() > (-1e-6 if own_low else 0.05)
            assert places.max() < (1.0 + 1e-6 if own_high else 0.95)


def film_run() -> Solution:
    """A film of 6 x 3 elements with two modes, a patch and wrinkles."""
    x, y = np.meshgrid(np.linspace(0, 0.2, 7), np.linspace(0, 0.1, 4), indexing="ij")
    grid = np.stack([x, y, 0 * x], axis=-1)
    shape = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2).reshape(1, -1, 4, 3)
    count = shape.shape[1]
    modes = np.stack([np.sin(np.pi * k * shape[0, ..., :1] / 0.2) * [0, 0, 1] for k in (1, 2)])
    film = Film(
        probe_names=("center",), probe_rest=np.zeros((1, 3)), frequency=np.array([10.0, 20.0]), mode_shape=modes,
        stress=np.column_stack([np.linspace(1e6, 2e6, count), np.linspace(0, 1e6, count)]),
        direction=np.tile([1.0, 0.0, 0.0], (count, 1)), state=np.repeat([0, 1], count // 2),
    )  # fmt: skip
    run = undriven(strip_run(1))
    panel = np.where(np.arange(count) == 4, 1, 0)
    return replace(run, shape=shape, layout=Layout(panel=panel, film=film))


def test_modes_and_tension_have_axes_colour_bars_and_names(tmp_path: Path, figures: list[Figure]) -> None:
    run = film_run()
    plot_modes(run, tmp_path / "modes.png")
    plot_tension(run, tmp_path / "tension.png")
    modes, tension = map(words, figures)
    assert {"x (mm)", "y (mm)", "1: 10 Hz", "2: 20 Hz"} <= set(modes.splitlines())
    assert "normal displacement" in modes
    assert "larger principal stress (MPa)" in tension
    assert "smaller principal stress (MPa)" in tension
    assert {"x (mm)", "y (mm)", "patch", "direction of the larger stress"} <= set(tension.splitlines())
    assert "wrinkled: 53 % of the elements" in tension  # 9 of the 17 elements without a patch


def test_long_names_of_channels_leave_room_for_the_curves(tmp_path: Path, figures: list[Figure]) -> None:
    run = strip_run(31)
    names = [f"a very long name of a body of a machine {k}.position" for k in range(40)]
    channels = {name: Channel(ChannelInfo(name, "m"), np.arange(31.0)) for name in names}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plot_channels(replace(run, channels=channels), ["*"], tmp_path / "channels.png")
    (ax,) = figures[0].axes
    assert ax.get_window_extent().width > 0.7 * figures[0].bbox.width
    assert len({(line.get_color(), line.get_linestyle()) for line in ax.lines}) == 40


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (27.06, "27.1"), (2.0, "2.00"), (1234.0, "1230"), (-4200.0, "-4200"), (3e7, "3.00e+07")]
)
def test_numbers_have_three_digits(value: float, text: str) -> None:
    assert rounded(value) == text


@pytest.mark.parametrize("name", ["<script>alert(1)</script>", "$HOME", "../../outside", "/etc/passwd", 'a"b&c', "]]>"])
def test_names_in_figures_are_text(name: str, tmp_path: Path) -> None:
    run = strip_run(11, drives=2)
    layout = replace(run.layout, drive_names=(name, "other"), pair_names=(name, f"{name} 2"))
    out = tmp_path / "deep" / "out"
    with drawing(suffix=".svg"):
        draw(replace(run, layout=layout), out)
    assert {path for path in tmp_path.rglob("*") if path.is_file()} == set(out.iterdir())
    root = ElementTree.parse(out / "force.svg").getroot()
    assert not [item for item in root.iter() if "script" in str(item.tag)]
    assert name in [item.text for item in root.iter() if str(item.tag).endswith("text")]


@pytest.mark.parametrize("damage", ["cut", "bytes", "empty", "text", "missing"])
def test_damaged_results_are_not_drawn(damage: str, tmp_path: Path) -> None:
    file = saved(strip_run(5), tmp_path / "result.h5")
    content = file.read_bytes()
    changed = {
        "cut": content[: len(content) // 2], "bytes": content[:200] + bytes(200) + content[400:], "empty": b"",
        "text": b"<script>alert(1)</script>",
    }  # fmt: skip
    file.unlink()
    if damage != "missing":
        file.write_bytes(changed[damage])
    found = CliRunner().invoke(cli, ["plot", str(file), "--out", str(tmp_path / "out")])
    assert found.exit_code == 2, found.output
    assert len(found.output.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("out", "options", "files"),
    [
        ("x.png", [], ["x.png"]), ("motion.pdf", [], ["motion.pdf"]),
        ("angle.svg", ["--channel", "crease.1.angle"], ["angle.svg"]),
        ("figures", [], ["contact.png", "energy.png", "force.png", "motion.png"]),
        ("out.v1", ["--channel", "crease.*"], ["channels.png"]),
    ],
)  # fmt: skip
def test_plots_are_written_where_the_option_says(tmp_path: Path, out: str, options: list[str], files: list[str]) -> None:
    """`--out x.png` made a folder of this name."""
    run, info, result = strip_run(11), ChannelInfo("crease.1.angle", "rad", (), "angle"), tmp_path / "run" / "result.h5"
    with ResultWriter(result, replace(run.layout, channels=(info,))) as writer:
        for k, record in enumerate(records_of(run)):
            writer.append(replace(record, channels={info.name: np.array(0.1 * k)}))
        writer.finish(replace(writer.solution(), stats=run.stats, summary=run.summary))
    target = tmp_path / "new" / out
    done = CliRunner().invoke(cli, ["plot", str(result), "--out", str(target), *options])
    assert done.exit_code == 0, done.output
    folder = target.parent if target.suffix in (".png", ".svg", ".pdf") else target
    assert sorted(path.name for path in folder.iterdir()) == files


def test_a_format_that_figures_do_not_have_is_refused(tmp_path: Path) -> None:
    done = CliRunner().invoke(cli, ["plot", "result.h5", "--out", str(tmp_path / "x.jpg")])
    assert done.exit_code == 2 and ".png, .svg, .pdf" in done.output
    assert not list(tmp_path.iterdir())


def test_bodies_without_a_shape_have_no_picture_of_their_motion() -> None:
    solution = strip_run()
    assert "motion.png" in figures_of(solution)
    assert "motion.png" not in figures_of(replace(solution, shape=solution.shape[:, :0]))
