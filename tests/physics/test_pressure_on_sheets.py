"""Pressure on sheets: derivatives, closed forms of plates, membranes and rings, and the energy balance."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.builders.patterns.plates import rectangle_mesh
from fsm.case.models.facet_mesh import facet_vectors
from fsm.errors import CaseError
from fsm.kernels.blocks import BlockMatrix
from fsm.kernels.programs import CONSTANT
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.facets.facet_group import FacetGroup
from fsm.model.nodes.facets.pressure import PressedFaces, PressureGroup
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.mesh import node_pattern

POINTS = np.array([[0.0, 0.0], [1.0, 0.1], [1.1, 0.9], [0.1, 1.0], [0.4, 0.5]])
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
ANGLES = np.array([0.3, -0.7, 0.9, 0.1, -0.4])
YOUNG, THICK = 2e9, 1e-3


def summary(
    sheet: dict[str, Any], pressure: float, folder: Path, method: str = "static", poisson: float = 0.3, **more: Any
) -> dict[str, Any]:
    data = {
        "sheet": {"kind": "plate", "facets": "flexible", "thickness": THICK} | sheet,
        "material": {"young": YOUNG, "poisson": poisson, "density": 1390.0},
        "load": [{"name": "gas", "at": "all", "pressure": pressure}],
        "solve": {"method": method, "end_time": 1.0}, "save": {"interval": 0.5, "channels": ["load.*"]},
    }  # fmt: skip
    return fsm.load(data | more, folder=folder).run(folder / "out", figures=False).summary


def test_force_and_tangent_are_derivatives() -> None:
    """On a flat sheet the sum is p times the area; the tangent is exact, and symmetric at the node inside."""
    faces = [
        PressedFaces((9 * TRIANGLES[:, :, None] + np.array([0, 3, 6])).reshape(-1, 9), np.zeros(4), POINTS[TRIANGLES],
                     ANGLES[TRIANGLES]),
        PressedFaces(9 * TRIANGLES, np.zeros(4), np.zeros((0, 3, 2)), np.zeros((0, 3))),
    ]  # fmt: skip
    flat = np.zeros((5, 3, 3))
    flat[:, 0, :2] = POINTS
    flat[:, 1, 0], flat[:, 1, 1] = np.cos(ANGLES), np.sin(ANGLES)
    flat[:, 2, 0], flat[:, 2, 1] = -np.sin(ANGLES), np.cos(ANGLES)
    q = flat.ravel() + 0.1 * np.random.default_rng(1).normal(size=45)
    group = FacetGroup(faces[0].vectors, POINTS[TRIANGLES], ANGLES[TRIANGLES], FilmMaterial(1.0, 0.3, 1.0, 1.0))
    pattern = node_pattern(5, 9, [group], [])

    def force(one: PressedFaces, q: np.ndarray) -> np.ndarray:
        out = np.zeros(45)
        PressureGroup("gas", one, 2.0, CONSTANT).add_force(q, None, out)
        return out

    for one in faces:
        total = force(one, flat.ravel()).reshape(5, 3, 3)[:, 0].sum(axis=0)
        np.testing.assert_allclose(total, [0.0, 0.0, 2.0 * group.rows.area.sum()], atol=1e-12)
        data, slots = pattern.zeros(), slots_of(one.vectors, 9, pattern.indptr, pattern.indices)
        PressureGroup("gas", one, 2.0, CONSTANT).add_linearised(q, None, slots, np.zeros(45), data, data)
        matrix = BlockMatrix(pattern, data).bsr().toarray()
        columns = np.array([-(force(one, q + d) - force(one, q - d)) / 2e-6 for d in 1e-6 * np.eye(45)]).T
        np.testing.assert_allclose(matrix, columns, rtol=0.0, atol=1e-8 * np.abs(matrix).max())
        inner = matrix[36:, 36:]
        np.testing.assert_allclose(inner, inner.T, rtol=0.0, atol=1e-12 * np.abs(matrix).max())


def test_swept_volume() -> None:
    """A sheet that moves along its normal sweeps its area times the displacement."""
    vectors = (9 * TRIANGLES[:, :, None] + np.array([0, 3, 6])).reshape(-1, 9)
    faces = PressedFaces(vectors, np.arange(4), POINTS[TRIANGLES], ANGLES[TRIANGLES]).of(np.array([1, 2]))
    group = PressureGroup("gas", faces, 1.0, CONSTANT)
    start = np.zeros((5, 3, 3))
    start[:, 0, :2] = POINTS
    start[:, 1, 0], start[:, 1, 1] = np.cos(ANGLES), np.sin(ANGLES)
    start[:, 2, 0], start[:, 2, 1] = -np.sin(ANGLES), np.cos(ANGLES)
    end = start.copy()
    end[:, 0] += [0.3, 0.1, 0.2]
    corners = POINTS[TRIANGLES[1:3]]
    sides = corners[:, 1:] - corners[:, :1]
    area = 0.5 * np.linalg.det(sides).sum()
    assert group.swept(start.ravel(), end.ravel()) == pytest.approx(0.2 * area, rel=1e-12)


def test_clamped_square_plate(tmp_path: Path) -> None:
    """Small deflection 0.00126532 p a^4/D (Timoshenko and Woinowsky-Krieger, 1959), in few steps despite small forces."""
    side, errors = 0.1, []
    stiffness = YOUNG * THICK**3 / (12.0 * 0.91)
    pressure = 1e-3 * THICK * stiffness / (0.00126532 * side**4)
    middle = [[0.5 * side - 1e-6, 0.5 * side - 1e-6, -1.0], [0.5 * side + 1e-6, 0.5 * side + 1e-6, 1.0]]
    for cells in (8, 16):
        sheet = {
            "length": side, "width": side, "mesh": [cells, cells], "probe": [{"name": "middle", "at": middle}],
            "support": [{"at": f"edge {name}", "clamped": True} for name in ("left", "right", "bottom", "top")],
        }  # fmt: skip
        found = summary(sheet, pressure, tmp_path)
        assert found["newton_iterations"] < 40
        errors.append(found["probe_displacement"]["middle"][2] / (1e-3 * THICK) - 1.0)
    assert 0.0 < errors[1] < 8e-3
    assert errors[1] < 0.3 * errors[0]


def test_disc_on_a_hinged_edge(tmp_path: Path) -> None:
    """Small deflection (5 + nu) p a^4/(64 (1 + nu) D) of a simply supported disc."""
    stiffness = YOUNG * THICK**3 / (12.0 * 0.91)
    sheet = {
        "outer_radius": 0.1, "mesh_size": 0.0125, "support": [{"at": "edge outer", "fixed": ["z"]},
        {"at": "vertex 1", "fixed": ["x", "y"]}, {"at": [[0.09, -0.001, -1], [0.2, 0.001, 1]], "fixed": ["y"]}],
        "probe": [{"name": "middle", "at": "vertex 1"}],
    }  # fmt: skip
    found = summary(sheet, 1.0, tmp_path)["probe_displacement"]["middle"][2]
    assert found == pytest.approx(5.3 * 0.1**4 / (64.0 * 1.3 * stiffness), rel=5e-3)


def test_clamped_membrane_disc(tmp_path: Path) -> None:
    """Hencky (1915): w = 0.65344 a (p a/(E t))^(1/3) for nu = 0.3; the volume is the work divided by the mean pressure."""
    thick, radius, pressure = 5e-5, 0.1, 1e3
    sheet = {
        "outer_radius": radius, "mesh_size": radius / 5, "thickness": thick, "support": [{"at": "edge outer"}],
        "probe": [{"name": "middle", "at": "vertex 1"}],
    }  # fmt: skip
    found = summary(sheet, pressure, tmp_path)
    exact = 0.65344 * radius * (pressure * radius / (YOUNG * thick)) ** (1 / 3)
    assert found["probe_displacement"]["middle"][2] == pytest.approx(exact, rel=1e-2)
    assert found["energy_error"] < 1e-3
    volume = found["channels"]["load.gas.volume"]["max"]
    # between a cone and a cylinder of this height; 0.53 of the cylinder for Hencky's shape
    assert 0.45 < volume / (math.pi * radius**2 * exact) < 0.6


def ring(pressure: float, mesh: list[int], folder: Path, method: str) -> dict[str, Any]:
    """Quarter of a ring of radius 0.1 m and width 0.01 m between planes of symmetry."""
    sheet = {
        "length": 0.05 * math.pi, "width": 0.01, "radius": 0.1, "mesh": mesh, "probe": [{"name": "top", "at": "vertex 1"}],
        "support": [{"at": "edge left", "mirror": "x"}, {"at": "edge right", "mirror": "z"},
                    {"at": "edge bottom", "mirror": "y"}],
    }  # fmt: skip
    return summary(sheet, pressure, folder, method, poisson=0.0)


def test_ring_under_internal_pressure(tmp_path: Path) -> None:
    """The radius grows by p R^2/(E t)."""
    errors = []
    for mesh in ([8, 2], [16, 4]):
        found = ring(1e4, mesh, tmp_path, "static")["probe_displacement"]["top"][2]
        errors.append(abs(found / (1e4 * 0.01 / (YOUNG * THICK)) - 1.0))
    assert errors[1] < 1e-2
    assert errors[1] < 0.4 * errors[0]


def test_ring_buckles_under_external_pressure(tmp_path: Path) -> None:
    """At 3 D/R^3 if the pressure follows the normals (Levy, 1884); a dead load would give 4."""
    unit = YOUNG * THICK**3 / 12.0 / 0.1**3
    ring(-4.0 * unit, [16, 1], tmp_path, "arc-length")
    with (tmp_path / "out" / "load.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    size = np.array([float(row["gas, pressure (Pa)"]) for row in rows]) / -unit
    negative = np.array([float(row["negative modes"]) for row in rows])
    assert negative[size < 2.9].max() == 0
    assert negative[size > 3.1].min() == 1
    assert "volume of gas, pressure (m^3)" in rows[0]


def test_facets_of_other_kinds(tmp_path: Path) -> None:
    """Pressure on a Miura sheet gives rigid facets, bars, and stiff flexible facets the same force of the drive."""
    common = {
        "kind": "miura", "columns": 2, "rows": 2, "a": 1.0, "b": 1.0, "sector_angle": "60 deg", "fold_angle": "40 deg",
        "thickness": 0.02,
        "support": [{"at": "edge left", "fixed": ["x"]}, {"at": "vertices 1, 3", "fixed": ["z"]},
                    {"at": "vertex 1", "fixed": ["y"]}],
    }  # fmt: skip
    forces = []
    for more in ({"facets": "rigid"}, {"facets": "bars", "bend_stiffness_per_length": 1e6}):
        data = {
            "sheet": common | more, "material": {"young": 1e9, "density": 1000.0},
            "crease": {"law": "linear", "stiffness_per_length": 1.0},
            "load": [{"at": "facets 1, 2", "pressure": "0.5 Pa"}], "solve": {"method": "static"},
            "drive": [{"edge": "right", "direction": [-1, 0, 0], "travel": 0.05, "speed": 0.01, "guide": False}],
            "save": {"every": 0.05},
        }  # fmt: skip
        forces.append(fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False).summary["final_force"])
    assert forces[1] == pytest.approx(forces[0], rel=2e-2)


@pytest.mark.parametrize(
    ("load", "text"),
    [
        ({"pressure": 1.0}, "give `body`"),
        ({"at": "edge left", "pressure": 1.0}, "names no facets"),
        ({"at": "facet 2", "pressure": 1.0}, "there is no number 2; the sheet has 1 facets"),
        ({"at": "all", "pressure": 1.0, "force": [0, 0, 1]}, "remove `force`"),
        ({"at": "all", "pressure": "1 N"}, "Pa"),
    ],
)
def test_faults_are_told(load: dict[str, Any], text: str) -> None:
    data = {
        "sheet": {"kind": "plate", "facets": "flexible", "thickness": 1e-3, "outer_radius": 0.1, "mesh_size": 0.05},
        "material": {"young": 1e9, "density": 1000.0}, "load": [load], "solve": {"method": "static", "end_time": 1.0},
    }  # fmt: skip
    with pytest.raises(CaseError, match=text):
        fsm.load(data, folder=Path.cwd()).check()


@pytest.mark.parametrize("shift", [0.0, 0.2])
def test_cells_share_a_pressure_equally(shift: float) -> None:
    """On a flat rectangle each corner of a cell has a quarter of its load, whatever its diagonal; the sum is p A."""
    size, (nx, ny) = np.array([0.4, 0.3]), (4, 3)
    moved = np.zeros((nx + 1, ny + 1, 2))
    moved[1:-1, 1:-1] = shift * np.random.default_rng(3).uniform(-0.1, 0.1, (nx - 1, ny - 1, 2))
    mesh = rectangle_mesh(*size, (nx, ny), moved=moved)
    faces = mesh.loaded
    pressed = PressedFaces(
        3 * facet_vectors(mesh, faces.triangles), faces.facet, faces.plane, faces.angle, faces.weight
    )
    q = np.stack([mesh.positions, *mesh.slopes.swapaxes(0, 1)], axis=1).ravel()
    for one in (pressed, pressed.straight()):
        force = np.zeros_like(q)
        PressureGroup("gas", one, 2.0, CONSTANT).add_force(q, None, force)
        normal = force.reshape(nx + 1, ny + 1, 3, 3)[:, :, 0, 2]
        assert normal.sum() == pytest.approx(2.0 * size.prod(), rel=1e-12)
        if not shift:
            quarters = np.zeros((nx + 1, ny + 1))
            for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
                quarters[i : i + nx, j : j + ny] += 0.25 * 2.0 * size.prod() / (nx * ny)
            np.testing.assert_allclose(normal, quarters, rtol=1e-12)


@pytest.mark.parametrize(("cells", "lid"), [((8, 3), False), ((16, 12), True)])
def test_radius_of_a_tube(cells: tuple[int, int], lid: bool, tmp_path: Path) -> None:
    """Half of a tube: each node far from its end moves out by p R^2/(E t) (1 - nu^2) between planes, by (1 - nu/2) under a
    lid.

    A lid has straight edges, so cells of the angle a have cos(a/2) of the hoop force, -0.5 %.
    """
    radius, poisson, strain = 0.1, 0.3, 2e-3 if lid else 1e-4
    sheet = {
        "kind": "plate", "facets": "flexible", "thickness": 1e-4, "length": math.pi * radius, "width": 0.8, "radius": radius,
        "mesh": cells, "support": [
            {"at": "edge left", "mirror": "x"}, {"at": "edge right", "mirror": "x"}, {"at": "edge bottom", "mirror": "y"},
            *([] if lid else [{"at": "edge top", "mirror": "y"}]), {"at": "vertex 1", "fixed": ["z"]},
        ],
    }  # fmt: skip
    closed = [{"axis": "x"}, {"axis": "y"}, {"cap": "edge top"} if lid else {"axis": "y", "at": 0.8}]
    data = {
        "sheet": sheet, "material": {"young": YOUNG, "poisson": poisson, "density": 1390.0},
        "gas": [{"closed_by": closed, "supply_pressure": strain * YOUNG * 1e-4 / radius}],
        "solve": {"method": "static", "end_time": 1.0}, "save": {"interval": 1.0},
    }  # fmt: skip
    q = fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False).solution.q
    start, end = (state.reshape(cells[0] + 1, cells[1] + 1, 3, 3)[:, : cells[1] // 4 + 1, 0] for state in q[[0, -1]])
    centre = 0.5 * (end[0] + end[-1])
    grown = np.linalg.norm((end - centre)[..., [0, 2]], axis=-1) / radius - 1.0
    expected = strain * (1.0 - 0.5 * poisson if lid else 1.0 - poisson**2)
    assert np.linalg.norm(start[0, 0] - start[-1, 0]) == pytest.approx(2.0 * radius, rel=1e-12)
    np.testing.assert_allclose(grown, expected, rtol=0.02 if lid else 0.01)
