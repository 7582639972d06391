"""Edges of zigzag outlines, the mean plane, and pictures of faulty patterns."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import fsm
from fsm.builders.patterns.generators import miura, waterbomb
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.fold_file import read_fold
from fsm.case.pattern_files.pattern import Pattern, PatternFault, edge_groups
from fsm.errors import CaseError
from fsm.views.pictures.sheet_picture import draw_fault, draw_sheet

CASE = """
[sheet]
pattern = "p.svg"
scale = "1 mm"
thickness = "0.2 mm"
[material]
young = "3 GPa"
density = "1000 kg/m^3"
[crease]
stiffness_per_length = "0.05 N m/rad/m"
[solve]
end_time = 1
"""


@pytest.mark.parametrize(("columns", "rows"), [(3, 3), (4, 5), (3, 2)])
def test_edge_of_a_zigzag_is_its_whole_line(columns: int, rows: int) -> None:
    """The edges of a Miura sheet that is read from a file are those of the generated one."""
    sheet = miura(columns, rows, 1.0, 1.0, 1.3, 0.0)
    flat = np.round(sheet.vertices[:, :2], 9)
    letters = [*sheet.assignment]
    data = {"vertices_coords": flat.tolist(), "edges_vertices": sheet.edges.tolist(), "edges_assignment": letters}
    read = read_fold(json.dumps(data), 1.0)
    for name, expected in sheet.groups.items():
        found = {tuple(row) for row in read.vertices[list(read.groups[name]), :2]}
        assert found == {tuple(row) for row in flat[list(expected)]}
    shifted = waterbomb(4, 3, 1.0)
    left = shifted.vertices[list(shifted.groups["left"]), :2]
    assert sorted({float(x) for x in left[:, 0]}) == [0.0, 0.5] and np.ptp(left[:, 1]) == 3.0


def test_edges_of_other_outlines_are_on_the_box() -> None:
    """A triangle and a regular polygon have the vertices on the sides of their box."""
    turn = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    assert edge_groups(circle, [range(16)])["left"] == (8,)
    triangle = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]])
    assert edge_groups(triangle, [(0, 1, 2)]) == {"bottom": (0, 1), "right": (1,), "top": (2,), "left": (0,)}


def written(pattern: Pattern, turn: np.ndarray, **keys: object) -> Sheet:
    vertices = pattern.vertices @ turn.T + [3.0, 2.0, 1.0]
    return Sheet(
        vertices=vertices.tolist(), edges=pattern.edges.tolist(), assignment=pattern.assignment,
        angles=np.nan_to_num(pattern.target).tolist(), faces=pattern.faces, thickness=1e-3, **keys,
    )  # fmt: skip


def test_mean_plane() -> None:
    """A Miura sheet that is turned out of its plane lies in z = 0 again, seen from the same side, with its distances."""
    sheet = miura(3, 3, 1.0, 1.0, 1.0, 0.6)
    tilt = 0.7
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    for part in (turn, turn @ turn @ turn):  # 40 and 120 degrees: the second is seen from behind, and remains so
        before = pattern_of(written(sheet, part))
        found = pattern_of(written(sheet, part, align="mean plane"))
        assert abs(found.vertices[:, 2].mean()) < 1e-12
        np.testing.assert_allclose(np.linalg.svd(found.vertices - found.vertices.mean(axis=0))[2][2][:2], 0.0, atol=1e-12)
        np.testing.assert_allclose(found.lengths, before.lengths, rtol=1e-12)
        np.testing.assert_allclose(found.fold_angles(), before.fold_angles(), atol=1e-9)
        assert (found.normals()[:, 2].sum() > 0.0) == (before.normals()[:, 2].sum() > 0.0)
    with pytest.raises(CaseError, match="`align` is for crease patterns only"):
        Sheet(kind="plate", length=1, width=1, thickness=1e-3, facets="flexible", mesh=(2, 2), align="mean plane")


FRAME = '<svg xmlns="http://www.w3.org/2000/svg"><rect width="90" height="60" stroke="#000"/>'


@pytest.mark.parametrize(
    ("lines", "override", "message"),
    [
        ('<path d="M0,30 H40" stroke="red"/>', "", "ends inside of a facet near (0.04, -0.03) m"),
        ('<path d="M40,0 L45,30 L40,60" stroke="red"/>', "sheet.fold=0.5", "vertex 6 cannot fold from flat"),
        ('<path d="M40,0 L45,30 L40,60" stroke="red"/>', "", "vertex 6 cannot fold from flat"),
    ],
)
def test_preview_is_written_and_marks_faults(tmp_path: Path, lines: str, override: str, message: str) -> None:
    """The place of a fault, and vertices that cannot fold, are red; the picture is written for refused patterns too."""
    (tmp_path / "p.svg").write_text(f"{FRAME}{lines}</svg>", encoding="utf-8")
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    out = tmp_path / "out.png"
    command = [sys.executable, "-m", "fsm", "preview", "case.toml", "--out", str(out)]
    done = subprocess.run(
        [*command, *(["--set", override] if override else [])], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert message in done.stderr and done.returncode == (0 if lines.startswith('<path d="M40') and not override else 2)
    from PIL import Image

    pixels = np.asarray(Image.open(out).convert("RGB")).astype(int)
    assert np.count_nonzero((pixels[..., 0] > 180) & (pixels[..., 1] < 60) & (pixels[..., 2] < 60)) > 20


def test_fold_names_the_vertices_that_cannot_fold() -> None:
    at = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [1.2, 1], [1, 2]]
    data = {
        "vertices_coords": at, "edges_vertices": [[0, 4], [4, 1], [1, 2], [2, 6], [6, 3], [3, 0], [4, 5], [5, 6]],
        "edges_assignment": [*"BBBBBBMM"],
    }  # fmt: skip
    pattern = read_fold(json.dumps(data), 1.0)
    with pytest.raises(CaseError, match=r"sheet\.fold: .*; vertex 6 cannot fold from flat"):
        pattern_of(written(pattern, np.eye(3), fold=0.5))


@pytest.mark.parametrize(("size", "unit", "last"), [(3e-5, "mm", 0.03), (5e-6, "um", 5.0), (40.0, "m", 40.0)])
@pytest.mark.parametrize("facets", ["rigid", "flexible", "faulty"])
def test_units_of_the_preview(size: float, unit: str, last: float, facets: str, tmp_path: Path, monkeypatch: Any) -> None:
    """The axes of a sheet have the unit of its size, as figures of results; so have those of a faulty pattern."""
    shown: list[tuple[str, float]] = []
    draw = Figure.draw

    def drawn(self: Figure, renderer: Any) -> None:
        shown.extend((ax.get_xlabel(), float(np.ptp(ax.get_xlim()))) for ax in self.axes if ax.get_xlabel())
        draw(self, renderer)

    monkeypatch.setattr(Figure, "draw", drawn)
    out = tmp_path / "out.png"
    if facets == "faulty":
        ends = size * np.array([[[0, 0], [1, 0]], [[1, 0], [1, 1]]])
        draw_fault(PatternFault("fault", size * np.ones((1, 2))).among(ends, ["B", "B"]), out)
    else:
        mesh = {"mesh_size": size / 4} if facets == "flexible" else {}
        sheet = {
            "kind": "miura", "columns": 2, "rows": 2, "a": size / 2, "b": size / 2, "sector_angle": "89 deg",
            "fold_angle": 0.0, "thickness": 1e-3 * size, "facets": facets,
        }  # fmt: skip
        material, solve = {"young": 1e9, "density": 1e3}, {"method": "static", "end_time": 1}
        case = {"sheet": sheet | mesh, "material": material, "crease": {"stiffness_per_length": 1.0}, "solve": solve}
        draw_sheet(fsm.load(case, folder=tmp_path).model, out)
    assert shown
    for label, width in shown:
        assert label == f"x ({unit})"
        assert 0.99 * last <= width < 1.6 * last
