"""Overlap of the folded state, and the film."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from fsm.analyses.panel_crossing import _crossing
from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.model.faults.overlap import Outline, find_overlaps, near_boxes, outlines
from fsm.views.pictures import preview as module
from fsm.views.pictures.preview import preview
from tests.case_texts import strip

ROOT = Path(__file__).parents[2]
CONTACT = {"stiffness": 1e5}
STRIP = f"""
gravity = [0, 0, -9.81]
{strip()}[solve]
end_time = 1.0
"""


def strip_case(angle: float = 80.0, contact: dict[str, Any] | None = CONTACT, **changes: Any) -> Case:
    strip = {"length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": f"{angle} deg"}
    drive = {"crease": 3, "speed": "2 mm/s", "travel": changes.pop("travel", "150 mm")}
    drive |= changes.pop("drive", {})
    data: dict[str, Any] = {
        "strip": strip | {"segments_per_panel": 5} | changes,
        "material": {"young": 3e9, "density": 800},
        "crease": {"law": "linear", "stiffness": 9e-3},
        "drive": [drive],
    }
    return Case.model_validate(data | ({"contact": contact} if contact else {}))


def vee(opening: float, thickness: float = 1e-3, joined: bool = True) -> list[Outline]:
    """Two panels 0.1 m long that meet at the origin."""
    arms = [np.array([[0.0, 0.0], [0.1 * math.cos(a), 0.1 * math.sin(a)]]) for a in (0.0, opening)]
    near = ("a", "b") if joined else ()
    return [Outline(name, arm, thickness, near) for name, arm in zip("ab", arms, strict=True)]


def panel(name: str, *points: tuple[float, float], thickness: float = 1e-3) -> Outline:
    return Outline(name, np.array(points), thickness)


@pytest.mark.parametrize("angle", [10, 45, 80, 83, 89])
def test_the_trial_strips_do_not_overlap(angle: float) -> None:
    assert find_overlaps(strip_case(angle)) == []


def test_strip_outlines_are_the_zigzag() -> None:
    panels = outlines(build_scene(strip_case(80)))
    assert [p.name for p in panels] == [f"panel {n}" for n in range(1, 7)]
    a, b = 0.08 * math.cos(math.radians(80)), 0.08 * math.sin(math.radians(80))
    for n, p in enumerate(panels):
        ends = [[n * a, b * (n % 2)], [(n + 1) * a, b * ((n + 1) % 2)]]
        np.testing.assert_allclose(p.points[[0, -1]], ends, atol=1e-15)
    assert panels[2].neighbours == ("panel 2", "panel 4")


def test_a_strip_folded_too_far_for_its_thickness() -> None:
    """At 89.9 degrees the layers of 0.3 mm overlap up to 86 mm from the crease: more than the whole panel."""
    depth = {(a, b): d for a, b, d in find_overlaps(strip_case(89.9))}
    for n in range(1, 6):
        at_quarter = 3e-4 - 2 * 0.02 * math.tan(math.radians(0.1))
        assert depth[f"panel {n}", f"panel {n + 1}"] == pytest.approx(at_quarter)
    parallel = 0.16 * math.sin(math.radians(89.9)) * math.cos(math.radians(89.9))
    assert depth["panel 1", "panel 3"] == pytest.approx(3e-4 - parallel)
    assert find_overlaps(strip_case(89.9, {"thickness_in_gap": False, **CONTACT})) == []
    assert find_overlaps(strip_case(89.9, None)) == []


def test_zone_at_a_crease_may_be_a_quarter_of_the_panel() -> None:
    limit = 2 * math.atan(1e-3 / (2 * 0.025))  # the zone t/(2 tan(opening/2)) is 25 mm
    assert find_overlaps(vee(1.001 * limit)) == []
    found = find_overlaps(vee(0.999 * limit))
    assert len(found) == 1
    assert 0 < found[0][2] < 1e-5


@given(opening=st.floats(0.05, math.pi), pieces=st.integers(1, 7))
def test_straight_neighbours_overlap_nowhere_else(opening: float, pieces: int) -> None:
    share = np.linspace(0, 1, pieces + 1)[:, None]
    cut = [Outline(p.name, share * p.points[1], p.thickness, p.neighbours) for p in vee(opening)]
    reverse = Outline("b", cut[1].points[::-1], 1e-3, ("a",))
    assert find_overlaps(cut) == find_overlaps([cut[0], reverse]) == []


def test_neighbours_that_come_back_to_each_other_overlap() -> None:
    straight = panel("a", (0, 0), (0.1, 0))
    curved = panel("b", (0, 0), (0.02, 0.04), (0.06, 0.04), (0.08, 0.0005))
    joined = [Outline(p.name, p.points, p.thickness, ("a", "b")) for p in (straight, curved)]
    assert find_overlaps(joined) == [("a", "b", pytest.approx(0.0005))]
    assert find_overlaps(joined, thickness_in_gap=False) == []


@given(gap=st.floats(-0.9e-3, 3e-3), shift=st.floats(-0.09, 0.09))
def test_parallel_panels(gap: float, shift: float) -> None:
    two = [panel("a", (0, 0), (0.1, 0)), panel("b", (shift, 1e-3 + gap), (0.1 + shift, 1e-3 + gap))]
    found = find_overlaps(two)
    if gap < -1e-9:
        assert found == [("a", "b", pytest.approx(-gap))]
    elif gap > 1e-9:
        assert found == []
    assert find_overlaps(two, thickness_in_gap=False) == []


@given(pieces=st.integers(1, 6), past=st.floats(0.001, 0.02))
def test_crossing_panels_are_found_with_and_without_thickness(pieces: int, past: float) -> None:
    share = np.linspace(0, 1, pieces + 1)[:, None]
    a = Outline("a", np.array([[-0.05, 0.0]]) + share * [[0.1, 0.0]], 1e-3)
    b = Outline("b", np.array([[0.0, 0.05]]) - share * [[0.0, 0.05 + past]], 1e-3)
    assert find_overlaps([a, b], thickness_in_gap=False) == [("a", "b", pytest.approx(past))]
    assert find_overlaps([a, b]) == [("a", "b", pytest.approx(past + 1e-3))]


def test_a_cross_through_the_corners_of_both_is_found() -> None:
    a = panel("a", (-1, 0), (0, 0), (1, 0))
    b = panel("b", (0, -0.5), (0, 0), (0, 0.5))
    assert find_overlaps([a, b], thickness_in_gap=False) == [("a", "b", pytest.approx(0.5))]


def test_panels_that_end_on_a_common_point_without_being_neighbours_overlap() -> None:
    assert len(find_overlaps(vee(1.0, joined=False))) == 1
    assert find_overlaps(vee(1.0)) == []


def test_few_panels() -> None:
    assert find_overlaps([]) == []
    assert find_overlaps([panel("a", (0, 0), (1, 0))]) == []


def test_a_long_strip_is_checked_quickly_enough_to_be_checked_always() -> None:
    a, b = 0.08 * math.cos(1.4), 0.08 * math.sin(1.4)
    knots = np.array([[n * a, b * (n % 2)] for n in range(1001)])
    names = [f"panel {n}" for n in range(1000)]
    near = [tuple(names[max(0, n - 1) : n + 2]) for n in range(1000)]
    many = [Outline(names[n], knots[n : n + 2], 3e-4, near[n]) for n in range(1000)]
    assert find_overlaps(many) == []


@pytest.mark.parametrize("count", [0, 1, 2, 300])
@pytest.mark.parametrize("stretch", [(1.0, 1.0), (1.0, 100.0), (100.0, 0.0)])
def test_near_boxes_are_those_of_all_with_all(count: int, stretch: tuple[float, float]) -> None:
    rng = np.random.default_rng(count)
    low = np.round(rng.random((count, 2)) * 20, 1) * stretch
    high = low + np.round(rng.random((count, 2)), 1) * rng.choice([0.0, 1.0, 5.0], (count, 1))
    near = np.all((low[:, None] <= high) & (low <= high[:, None]), axis=2)
    np.testing.assert_array_equal(np.column_stack(near_boxes(low, high)), np.argwhere(np.triu(near, 1)))


def cut_at(line: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """Intersection of two straight lines, as fractions of both."""
    along, across = line[1] - line[0], other[1] - other[0]
    one, two = np.linalg.solve(np.column_stack([along, -across]), other[0] - line[0])
    return one, two


def test_crossing_lines_are_those_of_all_with_all() -> None:
    rng = np.random.default_rng(1)
    start = rng.random((80, 2))
    end = start + 0.3 * rng.normal(size=(80, 2))
    lines = np.stack([start, end], axis=1)
    wanted = [
        (i, j) for i in range(80) for j in range(i + 1, 80) if all(0 < s < 1 for s in cut_at(lines[i], lines[j]))
    ]  # fmt: skip
    assert len(wanted) > 50
    found = _crossing(start[None], end[None], np.arange(80))
    assert [tuple(pair) for pair in found[:, 1:]] == wanted


@pytest.mark.nightly
@pytest.mark.parametrize("thickness", [0.01, 0.1])
def test_depths_of_crumpled_panels_are_those_of_all_pieces(thickness: float) -> None:
    """Compared with points along both lines, all pairs of them."""
    rng = np.random.default_rng(2)
    share = np.linspace(0, 1, 200)[:, None]
    touching = apart = 0
    for _ in range(60):
        lines = [np.cumsum(np.vstack([rng.random(2), 0.1 * rng.normal(size=(12, 2)) + 0.05]), axis=0) for _ in range(2)]
        dense = [np.vstack([a + share * (b - a) for a, b in pairwise(line)]) for line in lines]
        nearest = min(float(np.linalg.norm(dense[1] - point, axis=1).min()) for point in dense[0])
        if nearest < 2e-3:
            continue  # perhaps they cross
        found = find_overlaps([Outline(name, line, thickness) for name, line in zip("ab", lines, strict=True)])
        if nearest < thickness:
            assert found == [("a", "b", pytest.approx(thickness - nearest, abs=1e-3))]
            touching += 1
        elif nearest > thickness + 1e-3:
            assert found == []
            apart += 1
    assert apart > 3
    assert touching > 0


def test_a_plate_tilted_out_of_the_plane_is_refused() -> None:
    body = {
        "name": "flap", "mass": 1, "inertia": [1, 1, 1], "orientation": [math.cos(0.2), math.sin(0.2), 0, 0],
        "plate": {"length": 1, "width": 1, "thickness": 0.01},
    }  # fmt: skip
    with pytest.raises(CaseError, match=r"scene\.bodies\.flap: .*x-z plane"):
        find_overlaps(Scene.model_validate({"bodies": [body]}))


def frames(path: Path) -> list[np.ndarray]:
    with Image.open(path) as film:
        pictures = []
        for k in range(film.n_frames):
            film.seek(k)
            pictures.append(np.asarray(film.convert("L")))
        return pictures


def tallest(picture: np.ndarray) -> int:
    """Height of the drawing below the caption."""
    rows = np.flatnonzero((picture[40:] < 200).any(axis=1))
    return int(rows[-1] - rows[0])


@pytest.mark.parametrize("contact", [CONTACT, None])
def test_film(tmp_path: Path, contact: dict[str, Any] | None) -> None:
    preview(strip_case(contact=contact), tmp_path / "film" / "preview.gif")
    pictures = frames(tmp_path / "film" / "preview.gif")
    assert len(pictures) == module.FRAMES
    heights = [tallest(picture) for picture in pictures]
    # crease 3 rises from 79 mm to 229 mm over the lowest crease
    assert heights[-1] / heights[0] == pytest.approx(229 / 79, rel=0.05)
    assert all(np.diff(heights) >= -2)


def test_driven_crease_follows_the_drive_and_held_panels_stay() -> None:
    mechanism = module._mechanism(build_scene(strip_case()))
    shots, kept = module._run(mechanism, module.PIECES)
    assert kept
    crease = np.array([shot[2][-1][1] for shot in shots])
    share = np.linspace(0, 1, module.FRAMES)
    np.testing.assert_allclose(crease[:, 1], crease[0, 1] + 0.15 * share, atol=1.5e-3)
    np.testing.assert_allclose(crease[:, 0], crease[0, 0], atol=1.5e-3)
    for held in (0, 5):
        np.testing.assert_allclose(shots[-1][held], shots[0][held], atol=1e-12)


def test_touching_panels_keep_out_of_each_other() -> None:
    """The film with contact differs from the linkage, which passes through itself."""
    mechanism = module._mechanism(build_scene(strip_case(travel="30 mm")))
    shots, _ = module._run(mechanism, module.PIECES)
    lines = [np.array([row[0][0], *(piece[1] for piece in row)]) for row in shots[-1]]
    final = [Outline(str(n), line, 0.0, (str(n - 1), str(n + 1))) for n, line in enumerate(lines)]
    assert not [pair for pair in find_overlaps(final, thickness_in_gap=False) if pair[2] > 1e-4]
    through, _ = module._run(mechanism, 1)
    crossed = [Outline(str(n), row[0], 0.0, (str(n - 1), str(n + 1))) for n, row in enumerate(through[-1])]
    assert [pair for pair in find_overlaps(crossed, thickness_in_gap=False) if pair[2] > 1e-2]


def test_unguided_drive_leaves_the_crease_free_sideways() -> None:
    case = strip_case(held=[1], panels=4, length=0.32, drive={"crease": 2, "guide": False}, travel="100 mm")
    shots, _ = module._run(module._mechanism(build_scene(case)), 1)
    crease = np.array([shot[1][0][1] for shot in shots])
    assert crease[-1, 1] - crease[0, 1] == pytest.approx(0.1, abs=2e-3)
    assert abs(crease[-1, 0] - crease[0, 0]) > 0.01


def test_pieces_that_come_apart_are_not_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []
    run = module._run

    def apart(mechanism: Any, pieces: int) -> Any:
        tried.append(pieces)
        return run(mechanism, pieces)[0], False

    monkeypatch.setattr(module, "_run", apart)
    preview(strip_case(travel="20 mm"), tmp_path / "preview.gif")
    assert tried == [module.PIECES, 1]


def test_a_drive_across_the_plane_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match="x-z plane"):
        preview(strip_case(drive={"direction": [0, 1, 0]}), tmp_path / "preview.gif")


@pytest.mark.parametrize("name", ["membrane_impact", "scissor_array", "rotating_squares"])
def test_what_has_no_panels_on_creases_is_refused_in_a_line(tmp_path: Path, name: str) -> None:
    case = ROOT / "folding_cases" / name / "case.toml"
    result = CliRunner().invoke(cli, ["preview", str(case), "--out", str(tmp_path / "film.gif")])
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"{case}: ") and "not shown by the preview" in line and line.endswith("run the case instead")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["x.mp4", "p8", "folder", "folder.gif"])
def test_only_a_gif_is_written(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the mistake is reported before any computation."""
    monkeypatch.setattr(module, "_run", lambda *_: pytest.fail("it has begun"))
    for folder in ("folder", "folder.gif"):
        (tmp_path / folder).mkdir()
    (tmp_path / "case.toml").write_text(STRIP, encoding="utf-8")
    before = sorted(tmp_path.rglob("*"))
    out = tmp_path / name
    result = CliRunner().invoke(cli, ["preview", str(tmp_path / "case.toml"), "--out", str(out)])
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"{out}: ") and "FILE.gif" in line
    assert sorted(tmp_path.rglob("*")) == before


def test_the_terminal_says_what_stands_still(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(STRIP, encoding="utf-8")
    result = CliRunner().invoke(cli, ["preview", str(tmp_path / "case.toml"), "--out", str(tmp_path / "film.GIF")])
    assert result.exit_code == 0, result.output
    assert "leaves out loads and gravity" in result.stderr
    assert result.stdout == f"{tmp_path / 'film.GIF'}\n"


def test_scene_without_a_drive_stands_still(tmp_path: Path) -> None:
    case = strip_case().model_copy(update={"drive": ()})
    (note,) = preview(case, tmp_path / "preview.gif")
    assert "no drive" in note and "loads and gravity" in note
    pictures = frames(tmp_path / "preview.gif")
    assert np.abs(pictures[0].astype(int) - pictures[-1]).max() < 40
