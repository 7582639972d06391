"""Cuts of sheets: both sides are separate from end to end, for all kinds of facets."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from fsm.analyses.sheet_motion import sheet_of, vertices_of
from fsm.builders.patterns.cuts import open_cuts
from fsm.builders.patterns.of_sheet import flexible_mesh, pattern_of
from fsm.case.loading.load_case import load_case
from fsm.case.pattern_files.fold_file import read_fold
from fsm.cli.command_line import cli
from fsm.results.solution import Solution
from tests.runs import run

SIDES = [(-4, 0), (60, 0), (100, 0), (100, 20), (100, 40), (60, 40), (4, 40), (0, 20)]
CUT: dict[str, Any] = {
    "frame_unit": "mm", "vertices_coords": [*SIDES, (60, 20)],
    "edges_vertices": [*((k, (k + 1) % 8) for k in range(8)), (7, 8), (8, 3), (1, 8), (8, 5)],
    "edges_assignment": [*"BBBBBBBBCFFF"],
}  # fmt: skip
"""Sheet with two legs beside a cut from vertex 8, in the middle of the left side, to vertex 9."""
NOTCH: dict[str, Any] = CUT | {
    "vertices_coords": [*SIDES[:7], (0, 19.98), (60, 20), (0, 20.02)],
    "edges_vertices": [*((k, k + 1) for k in range(6)), (6, 9), (9, 8), (8, 7), (7, 0), (8, 3), (1, 8), (8, 5)],
    "edges_assignment": [*"BBBBBBBBBBFFF"],
}
"""The same sheet with a notch of 0.04 mm; vertices 8 and 10 are its corners."""
LAW = """
thickness = "0.3 mm"
[material]
young = "3 GPa"
poisson = 0.0
density = "1000 kg/m^3"
[crease]
stiffness_per_length = "0.05 N m/rad/m"
[solve]
method = "static"
end_time = "100 s"
[save]
interval = "100 s"
"""
MESH = {"flexible": 'mesh_size = "5 mm"'}
RIGHT = '\n[[sheet.support]]\nat = "vertices 3, 4, 5"\n{clamped}\n[[sheet.support]]\nat = "vertices 2, 9, 6"\n'
LINE = '<path fill="none" stroke="{}" d="M{},{} L{},{}"/>'
CONTACT = '\n[contact]\nlaw = "linear"\nstiffness = "1e5 N/m"\nthickness_in_gap = {}\n'
GRAVITY = "gravity = [0, 0, -9.81]\n"


def solved(folder: Path, text: str, pattern: str, name: str = "pattern.fold") -> Solution:
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(pattern, encoding="utf-8")
    return run(folder, text)[0]


def legs(
    folder: Path, base: dict[str, Any], facets: str, letters: str, held: str, more: str = "", before: str = ""
) -> Solution:
    """Sheet with two legs, whose letters replace the last ones of the pattern; 2 mN act at the corner of the first leg."""
    data = base | {"edges_assignment": [*base["edges_assignment"][: -len(letters)], *letters]}
    text = f'{before}[sheet]\npattern = "pattern.fold"\nfacets = "{facets}"\n{MESH.get(facets, "")}{LAW}{held}{more}\n'
    return solved(folder, text + '[[load]]\nat = "vertex 1"\nforce = [0, 0, "2 mN"]\n', json.dumps(data))


def rise(solution: Solution, *vertices: int) -> np.ndarray:
    """Displacement along z of vertices (numbers from 1) at the end, mm."""
    case, _ = sheet_of(solution)
    at, rows = vertices_of(solution)[:, :, 2], np.array(vertices) - 1
    if case.sheet is not None and case.sheet.facets == "flexible":
        mesh = flexible_mesh(case.sheet)
        rows = np.searchsorted(mesh.nodes, mesh.owner[mesh.vertices[rows]])
    return np.asarray(1e3 * (at[-1, rows] - at[0, rows]))


@pytest.mark.parametrize("facets", ["rigid", "bend-lines", "bars", "flexible"])
def test_a_leg_beside_a_cut_turns_alone(facets: str, tmp_path: Path) -> None:
    """Both legs have a crease at their root. The force turns the first leg, as beside a notch; the second does not move."""
    held = '\n[[sheet.support]]\nat = "vertices 2, 3, 4, 5, 6, 9"\n'
    if facets == "flexible":
        held = "".join(f'\n[[sheet.support]]\nat = "facet {k}"\n' for k in (2, 4))
    cut, notch = (legs(tmp_path / name, base, facets, "FVV", held) for name, base in (("cut", CUT), ("notch", NOTCH)))
    turned, other = rise(cut, 1, 8), rise(cut, 7, 10)
    np.testing.assert_allclose(turned, rise(notch, 1, 8), rtol=0.01)
    np.testing.assert_allclose(other, 0.0, atol=1e-4)  # springs hold the vertices of rigid facets
    if facets == "rigid":  # force times arm equals stiffness times angle
        angle = math.asin(turned[0] / 64.0)
        assert 2e-3 * 0.064 * math.cos(angle) == pytest.approx(0.05 * 0.02 * angle, rel=1e-5)


@pytest.mark.parametrize("facets", ["bars", "flexible"])
def test_a_plate_with_a_cut_bends_as_with_a_notch(facets: str, tmp_path: Path) -> None:
    held = RIGHT.format(clamped="clamped = true" if facets == "flexible" else "")
    cut, notch = (legs(tmp_path / name, base, facets, "FFF", held) for name, base in (("cut", CUT), ("notch", NOTCH)))
    found, wanted = (rise(solution, 1, 7, 8, 10) for solution in (cut, notch))
    np.testing.assert_allclose(found, wanted, rtol=0.01, atol=1e-9)
    assert found[0] > 5.0 * abs(found[1]) and found[2] > 5.0 * abs(found[3])


@pytest.mark.parametrize("facets", ["bars", "flexible"])
@pytest.mark.parametrize("in_gap", ["true", "false"])
def test_both_sides_of_a_cut_do_not_press_each_other(facets: str, in_gap: str, tmp_path: Path) -> None:
    """With contact, both legs move as without it, although their sides touch at the start and slide past each other."""
    held = RIGHT.format(clamped="clamped = true" if facets == "flexible" else "")
    alone, touching = (
        legs(tmp_path / f"{len(more)}", CUT, facets, "FFF", held, more, GRAVITY) for more in ("", CONTACT.format(in_gap))
    )
    np.testing.assert_allclose(rise(touching, 1, 7, 8, 10), rise(alone, 1, 7, 8, 10), rtol=1e-6, atol=1e-9)
    assert np.abs(rise(touching, 8) - rise(touching, 10)) > 0.1
    assert not json.loads((tmp_path / str(len(CONTACT.format(in_gap))) / "out" / "summary.json").read_text())["contact"]


def popup(left: float, middle: float, right: float) -> str:
    """Card with a valley at x = 100 mm, and two cuts; a strip between them has valleys at its ends and a mountain."""
    lines = [("#0f0", left, y, right, y) for y in (40, 80)] + [("#f00", middle, 40, middle, 80)]
    lines += [("#00f", x, y, x, y + 40) for x, y in ((100, 0), (100, 80), (left, 40), (right, 40))]
    frame = '<rect fill="none" stroke="#000" x="0" y="0" width="200" height="120"/>'
    text = "".join(LINE.format(*line) for line in lines)
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 120">{frame}{text}</svg>'


def card(facets: str, keys: str, more: str = "") -> str:
    size = 'mesh_size = "100 mm"' if facets == "flexible" else ""
    sheet = f'[sheet]\npattern = "card.svg"\nscale = "1 mm"\nfacets = "{facets}"\n{size}\n{keys}'
    return f'{sheet}{LAW}\n[[sheet.support]]\nat = "facet 1"\n{more}'


@pytest.mark.parametrize("places", [(60, 100, 140), (50, 80, 130), (35, 75, 140)])
@pytest.mark.parametrize("facets", ["rigid", "bars", "flexible"])
def test_cards_start_folded(facets: str, places: tuple[float, float, float], tmp_path: Path) -> None:
    """The card and its strip are a parallelogram, so all fold angles are equal."""
    (tmp_path / "card.svg").write_text(popup(*places), encoding="utf-8")
    (tmp_path / "case.toml").write_text(card(facets, "fold = 0.4"), encoding="utf-8")
    pattern = pattern_of(load_case(tmp_path / "case.toml").case.sheet)
    folds = [edge for edge in pattern.creases.tolist() if pattern.assignment[edge] in "MV"]
    assert len(folds) == 5
    np.testing.assert_allclose(pattern.fold_angles()[folds], 0.4 * pattern.target[folds], rtol=1e-8)


@pytest.mark.parametrize("facets", ["rigid", "bars", "flexible"])
@pytest.mark.parametrize("contact", [False, True])
def test_cards_fold_to_their_state(facets: str, contact: bool, tmp_path: Path) -> None:
    """All creases reach 99 % of 90 degrees (the dampers lag by 1 %), edges keep their lengths, and facets do not touch."""
    more = CONTACT.format("true") if contact else ""
    solution = solved(tmp_path, card(facets, "fold_to = 0.5", more), popup(50, 80, 130), "card.svg")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["folded"]["least"] == pytest.approx(0.99, abs=1e-3)
    assert not [text for text in summary["warnings"] if "mesh" not in text] and not summary["contact"]
    assert CliRunner().invoke(cli, ["export", str(tmp_path / "out"), "--to", "fold"]).exit_code == 0
    text = (tmp_path / "out" / "result.fold").read_text(encoding="utf-8")
    start, last = (read_fold(text, None, number) for number in (1, len(solution)))
    np.testing.assert_allclose(last.lengths, start.lengths, rtol=1e-5)
    data = json.loads(text)
    assert "C" not in data["edges_assignment"]
    again = open_cuts(read_fold(text, None, 0))
    assert len(again.vertices) == len(data["vertices_coords"]) and len(again.faces) == len(data["faces_vertices"])
    if facets != "flexible":
        np.testing.assert_allclose(again.vertices[:, :2], data["vertices_coords"], atol=1e-12)
        assert {frozenset(face) for face in again.faces} == {frozenset(face) for face in data["faces_vertices"]}
