"""Normals at the nodes of flat facets on a curved surface."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fsm.builders.patterns.pattern_mesh import pattern_mesh
from fsm.case.models.facet_mesh import FacetMesh
from fsm.case.pattern_files.pattern import Pattern, edge_groups


def mesh_of(points: np.ndarray, quads: bool, size: float = 100.0, mirrors: dict[str, int] | None = None) -> FacetMesh:
    """Mesh of a grid of points (m, n, 3); each cell is a quadrilateral or two triangles, and no line folds."""
    number = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    cells = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4).tolist()
    faces = [tuple(c) for c in cells] if quads else [t for a, b, c, d in cells for t in ((a, b, c), (a, c, d))]
    at = points.reshape(-1, 3)
    pattern = Pattern.of_faces(at, faces, None, edge_groups(at[:, :2], faces))
    letters = ["B" if pair.min() < 0 else "F" for pair in pattern.edge_faces]
    planes = {frozenset(pattern.groups[name]): axis for name, axis in (mirrors or {}).items()}
    return pattern_mesh(pattern.assigned(letters, np.zeros(len(letters))), size, mirrors=planes)


def normals(mesh: FacetMesh) -> np.ndarray:
    """Unit normals at the nodes."""
    return np.asarray(np.cross(mesh.slopes[:, 0], mesh.slopes[:, 1]))


def grid(cells: int, shift: float) -> np.ndarray:
    """Points (n, n, 2) of the unit square; inner points are shifted by a part of a cell."""
    x = np.stack(np.meshgrid(*2 * [np.linspace(0.0, 1.0, cells + 1)], indexing="ij"), axis=-1)
    moved = np.random.default_rng(5).uniform(-shift, shift, x.shape) / cells
    moved[[0, -1], :, 0] = moved[:, [0, -1], 1] = 0.0
    return x + moved


@pytest.mark.parametrize("shape", [(0.4, 0.4, 0.0), (0.4, -0.4, 0.0), (0.0, 0.3, 0.0), (0.2, -0.1, 0.3)])
def test_every_normal_of_a_shell_is_of_second_order(shape: tuple[float, float, float]) -> None:
    """Triangles of any shape on z = a x^2 + b y^2 + c x y + x^3/10, also at corners.

    The mean normal of flat facets is wrong by half of a cell's angle at boundaries, of first order.
    """
    errors = []
    for cells in (6, 12):
        x, y = np.moveaxis(grid(cells, 0.25), -1, 0)
        a, b, c = shape
        mesh = mesh_of(np.stack([x, y, a * x * x + b * y * y + c * x * y + 0.1 * x**3], axis=-1), quads=False)
        assert len(mesh.owner) == (cells + 1) ** 2
        x, y, _ = mesh.positions.T
        exact = np.column_stack([-2.0 * a * x - c * y - 0.3 * x * x, -2.0 * b * y - c * x, np.ones_like(x)])
        exact /= np.linalg.norm(exact, axis=1)[:, None]
        errors.append(np.linalg.norm(normals(mesh) - exact, axis=1).max())
    assert errors[0] < 0.02
    assert errors[1] < 0.4 * errors[0]


def sphere(cells: int) -> np.ndarray:
    """Points of an eighth of the unit sphere with a hole of 18 degrees."""
    angle = grid(cells, 0.0) * [0.5 * math.pi, math.radians(72.0)]
    (c, s), (cp, sp) = (np.moveaxis(np.stack([np.cos(a), np.sin(a)]), 0, 0) for a in np.moveaxis(angle, -1, 0))
    points = np.stack([cp * c, cp * s, sp], axis=-1)
    points[np.abs(points) < 1e-12] = 0.0
    return points


def test_shell_crosses_planes_of_symmetry_at_right_angles() -> None:
    """One slope of each node lies along the plane and the other along its axis; a support holds them as such."""
    mesh = mesh_of(sphere(6), quads=True, mirrors={"left": 0, "bottom": 1})
    for edge, axis in (("left", 0), ("bottom", 1)):
        along = mesh.along_edges(mesh.edges[edge])
        assert len(along) == 7
        for sector, slopes in along.items():
            assert len(slopes) == 1
            assert abs(normals(mesh)[sector, axis]) < 1e-12
            assert abs(mesh.slopes[sector, next(iter(slopes)), axis]) < 1e-12
    exact = mesh.positions / np.linalg.norm(mesh.positions, axis=1)[:, None]
    assert np.linalg.norm(normals(mesh) - exact, axis=1).max() < 0.02


def test_free_curved_edge_has_one_slope_along_it() -> None:
    """Chords of a parallel of the sphere turn within the surface; a support that holds this edge does not clamp it."""
    points = sphere(6)[:, ::-1]  # the equator is then the last line
    mesh = mesh_of(points, quads=True)
    top = points[:, 0]
    pairs = [(k, i) for k in range(len(mesh.triangles)) for i in range(3)]
    ends = mesh.ends(np.array(pairs))
    on = np.array([[np.linalg.norm(top - mesh.positions[s], axis=1).min() < 1e-12 for s in two] for two in ends.tolist()])
    along = mesh.along_edges(np.array(pairs)[on.all(axis=1)])
    assert [len(along[s]) for s in along if 1e-6 < mesh.positions[s, 0] < top[0, 0] - 1e-6] == 5 * [1]


@pytest.mark.parametrize("mirrors", [{}, {"bottom": 2}])
def test_flat_parts_of_large_facets_stay_flat(mirrors: dict[str, int]) -> None:
    """Facets of many cells keep their normals beside the lines between them, and a flat sheet stays flat."""
    x = np.array([0.0, 1.0, 1.0 + math.cos(0.4), 1.0 + math.cos(0.4) + math.cos(0.8)])
    z = np.array([0.0, 0.0, math.sin(0.4), math.sin(0.4) + math.sin(0.8)])
    points = np.stack([np.stack([x, np.full(4, y), z], axis=-1) for y in (0.0, 1.0)], axis=1)
    mesh = mesh_of(points, True, 0.25, mirrors)
    inside = np.abs(mesh.positions[:, None, 0] - x).min(axis=1) > 1e-9
    across = normals(mesh)[inside]
    angles = np.abs(np.arctan2(across[:, 0], across[:, 2]))
    assert np.abs(angles[:, None] - [0.0, 0.4, 0.8]).min(axis=1).max() < 1e-12
    ends = np.abs(np.arctan2(normals(mesh)[:, 0], normals(mesh)[:, 2]))[mesh.positions[:, 0] > x[-1] - 1e-9]
    assert ends == pytest.approx(0.8, abs=1e-12)
