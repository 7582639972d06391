"""Meshes of the facets of patterns, and creases between flexible facets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fsm.builders.patterns.of_sheet import pattern_of
from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case
from fsm.model.joined.system import JoinedSystem

KINDS: dict[str, dict[str, Any]] = {
    "zigzag": {"columns": 3, "a": 0.1, "b": 0.05, "fold_angle": 0.5, "mesh_size": 0.03},
    "miura": {"columns": 2, "rows": 3, "a": 0.1, "b": 0.08, "sector_angle": 1.0, "fold_angle": 0.5, "mesh_size": 0.05},
    "kresling": {"sides": 6, "rows": 1, "radius": 0.1, "height": 0.1, "twist": 0.5, "mesh_size": 0.06},
}


def case(**sheet: Any) -> Case:
    return Case.model_validate(
        {
            "sheet": {"thickness": 1e-3, "facets": "flexible"} | sheet,
            "material": {"young": 3e9, "density": 1000.0},
            "crease": {"stiffness_per_length": 0.1},
            "solve": {"method": "static", "end_time": 1.0},
        }
    )


@pytest.mark.parametrize("grading", [0.0, 1.0])
@pytest.mark.parametrize("kind", list(KINDS))
def test_mesh_of_a_pattern(kind: str, grading: float) -> None:
    """All triangles are counter-clockwise and fill the faces; neighbours share nodes, and the initial state has no force."""
    data = case(kind=kind, mesh_grading=[grading, grading], **KINDS[kind])
    assert data.sheet is not None
    mesh, pattern = build_scene(data).built.facets.mesh, pattern_of(data.sheet)
    along = np.roll(mesh.plane, -1, axis=1) - mesh.plane
    area = 0.5 * (along[:, 0, 0] * along[:, 1, 1] - along[:, 0, 1] * along[:, 1, 0])
    assert area.min() > 0.0
    triangles = pattern.with_bend_lines()
    corners = triangles.vertices[np.array(triangles.faces)]
    whole = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert mesh.area == pytest.approx(whole, rel=1e-12)
    unlike = np.unique(mesh.positions.round(9), axis=0)
    assert len(mesh.nodes) == len(unlike)
    np.testing.assert_allclose(mesh.positions[mesh.vertices], pattern.vertices, atol=1e-12)
    assert sum(float(crease.lengths.sum()) for crease in mesh.creases) == pytest.approx(
        pattern.lengths[pattern.creases].sum(), rel=1e-12
    )
    _, system = compile_case(data)
    q, _ = system.initial()
    assert np.abs(system.force(0.0, q, None)).max() < 1e-6


@pytest.mark.parametrize("kind", list(KINDS))
def test_creases_of_flexible_facets(kind: str) -> None:
    """Fold angles at all nodes are those of the pattern, in any position; the tangent is the derivative of the force."""
    scene, system = compile_case(case(kind=kind, **KINDS[kind]))
    assert isinstance(system, JoinedSystem) and scene.built.facets is not None and scene.built.facets.folds is not None
    (creases,) = (group for group in system.elements.mesh.groups if group.name == "creases")
    q, _ = system.initial()
    turn, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    turned = (q.reshape(-1, 3) @ turn.T).ravel()
    for state in (q, turned):
        np.testing.assert_allclose(creases.angles(state), scene.built.facets.folds.start, atol=1e-9)
    random = np.random.default_rng(5)
    moved, direction = q + 1e-2 * random.normal(size=len(q)), random.normal(size=len(q))
    numeric = (creases.energy(moved + 1e-6 * direction, None)[0] - creases.energy(moved - 1e-6 * direction, None)[0]) / 2e-6
    force = np.zeros(len(q))
    creases.add_force(moved, None, force)
    assert -force @ direction == pytest.approx(numeric, rel=1e-6)
    free = ~system.elements.fixed
    direction[~free] = 0.0
    change = system.force(0.0, moved - 1e-6 * direction, None) - system.force(0.0, moved + 1e-6 * direction, None)
    product = system.linearise(0.0, moved, None).stiffness.times(direction)
    np.testing.assert_allclose(product[free], change[free] / 2e-6, atol=1e-5 * np.abs(product).max())


def test_polygons_are_divided() -> None:
    """A pentagon has triangles that share their slopes: it is one flexible facet."""
    angles = 2.0 * np.pi * np.arange(5) / 5
    vertices = [[float(np.cos(a)), float(np.sin(a)), 0.0] for a in angles]
    edges = [[k, (k + 1) % 5] for k in range(5)]
    sheet = {
        "vertices": vertices, "edges": edges, "assignment": ["B"] * 5, "angles": [0.0] * 5, "faces": [[0, 1, 2, 3, 4]],
        "mesh_size": 0.5,
    }  # fmt: skip
    facets = build_scene(case(**sheet)).built.facets
    assert facets.mesh.area == pytest.approx(2.5 * np.sin(2.0 * np.pi / 5.0), rel=1e-12)
    assert not facets.mesh.creases and facets.folds is None
    assert not facets.mesh.facet.any()
    assert len(facets.mesh.owner) == len(facets.mesh.nodes)


def test_flat_lines_of_a_folded_sheet() -> None:
    """Two strips at an angle share the slopes of a flat line; at a large angle the line is a stiff joint."""
    faces = [[0, 1, 4, 3], [1, 2, 5, 4]]
    edges, letters = [[1, 4], [0, 1], [1, 2], [2, 5], [5, 4], [4, 3], [3, 0]], ["F", *"BBBBBB"]
    for angle in (0.3, 1.2):
        c, s = float(np.cos(angle)), float(np.sin(angle))
        line = [[-1.0, 0.0], [0.0, 0.0], [c, s]]
        vertices = [[x, y, z] for y in (0.0, 1.0) for x, z in line]
        sheet = {"vertices": vertices, "edges": edges, "assignment": letters, "angles": [0.0] * 7, "faces": faces}
        data = case(mesh_size=0.5, **sheet)
        facets = build_scene(data).built.facets
        smooth = angle < 1.0
        assert facets.mesh.curved == smooth
        assert len(facets.mesh.creases) == (0 if smooth else 1)
        assert len(facets.mesh.owner) == len(facets.mesh.nodes) + (0 if smooth else 3)
        assert np.bincount(facets.mesh.facet).tolist() == [8, 8]
        normal = np.cross(*facets.mesh.slopes.transpose(1, 0, 2))
        middle = normal[np.abs(facets.mesh.positions[:, [0, 2]]).max(axis=1) < 1e-9]
        expected = [-np.sin(0.5 * angle), 0.0, np.cos(0.5 * angle)]
        assert np.allclose(middle, expected) == smooth
        _, system = compile_case(data)
        q, _ = system.initial()
        assert np.abs(system.force(0.0, q, None)).max() < 1e-6


def test_too_fine_a_mesh_is_refused() -> None:
    with pytest.raises(CaseError, match="at most 100,000 are allowed"):
        build_scene(case(kind="zigzag", **KINDS["zigzag"] | {"mesh_size": 1e-4}))


def test_graded_mesh_of_a_pattern() -> None:
    """Divisions of a graded crease follow a sine, and each node has half of the divisions beside it."""
    data = case(kind="miura", mesh_grading=[1.0, 1.0], **(KINDS["miura"] | {"mesh_size": 0.025}))
    mesh = build_scene(data).built.facets.mesh
    crease = max(mesh.creases, key=lambda one: len(one.sectors))
    places = mesh.positions[crease.sectors[:, 0]]
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    ends = np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, len(places)))
    np.testing.assert_allclose(steps, 0.5 * np.diff(ends) * steps.sum(), rtol=1e-9)
    np.testing.assert_allclose(crease.lengths, 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps)), rtol=1e-9)


def test_directions_of_grading_are_for_plates() -> None:
    with pytest.raises(ValueError, match=r"mesh_grading = \[1.0, 0.0\] must have two equal numbers"):
        case(kind="miura", mesh_grading=[1.0, 0.0], **KINDS["miura"])
