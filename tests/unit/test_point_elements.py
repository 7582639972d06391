"""Elements between points: forces and tangents from one energy, wrenches without resultant, refused cases."""

import numpy as np
import pytest
from pydantic import ValidationError

from fsm.case.models.case import Case
from fsm.errors import CaseError
from fsm.extend import PointKind, add_point_element
from fsm.kernels.body_poses import retract_poses
from fsm.kernels.rotation import rotation_matrix
from fsm.model.bodies.group import BlockSums, BodyState, body_pattern
from fsm.model.elements.law_elements import PointGroup


def volume(x, stiffness):
    """Energy of a spring on the volume of a tetrahedron."""
    return 0.5 * stiffness * (np.linalg.det(x[1:] - x[0]) / 6.0) ** 2


def slopes(x, stiffness):
    a, b, c = x[1:] - x[0]
    value = a @ np.cross(b, c) / 6.0
    first = np.array([np.cross(b, c), np.cross(c, a), np.cross(a, b)]) / 6.0
    first = np.concatenate([-first.sum(axis=0)[None], first])

    def spin(v):
        return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])

    second = np.zeros((3, 3, 3, 3))
    for i, j, v in ((0, 1, c), (1, 2, a), (2, 0, b)):
        second[i, :, j], second[j, :, i] = -spin(v) / 6.0, spin(v) / 6.0
    whole = np.zeros((4, 3, 4, 3))
    whole[1:, :, 1:] = second
    whole[0, :, 1:] = -second.sum(axis=0)
    whole[1:, :, 0] = -second.sum(axis=2)
    whole[0, :, 0] = second.sum(axis=(0, 2))
    gradient = stiffness * value * first
    return gradient, stiffness * (np.multiply.outer(first, first) + value * whole)


@pytest.fixture
def model():
    """Two points on one body, one on another, one on the held ground; poses of all three."""
    rng = np.random.default_rng(7)
    turns = rng.normal(size=(3, 4))
    poses = np.concatenate([rng.normal(size=(3, 3)), turns / np.linalg.norm(turns, axis=1, keepdims=True)], axis=1)
    points = [tuple(row) for row in rng.normal(size=(4, 3))]
    group = PointGroup.of([("tetrahedron", PointKind(4, volume, slopes), 3.0, [1, 0, 2, 1], points)])
    return group, poses


def moved(poses, dx):
    out = poses.copy()
    out[1:] = retract_poses(poses[1:].ravel(), dx).reshape(2, 7)
    return out


def test_force_and_tangent_follow_from_the_energy(model):
    group, poses = model
    pattern = body_pattern(np.array([-1, 0, 1]), [group.pairs(poses)[0]], 6)
    rates, force, stiffness = np.zeros((3, 6)), np.zeros((3, 6)), pattern.zeros()
    group.add_linearised(BodyState(0.0, poses, rates), BlockSums(pattern, force, stiffness, pattern.zeros()))
    alone = np.zeros((3, 6))
    group.add_force(BodyState(0.0, poses, rates), alone)
    np.testing.assert_array_equal(alone, force)
    dense = np.zeros((12, 12))
    for row, column, block in zip(pattern.rows, pattern.indices, stiffness, strict=True):
        dense[6 * row : 6 * row + 6, 6 * column : 6 * column + 6] = block
    step = 1e-6
    for k in range(12):
        dx = np.zeros(12)
        dx[k] = step
        ends = [moved(poses, sign * dx) for sign in (1.0, -1.0)]
        energies = [sum(group.energy(BodyState(0.0, end, rates))[0].values()) for end in ends]
        assert force[1:].ravel()[k] == pytest.approx(-(energies[0] - energies[1]) / (2 * step), rel=1e-6, abs=1e-7)
        forces = [np.zeros((3, 6)), np.zeros((3, 6))]
        for end, out in zip(ends, forces, strict=True):
            group.add_force(BodyState(0.0, end, rates), out)
        difference = -(forces[0] - forces[1])[1:].ravel() / (2 * step)
        np.testing.assert_allclose(dense[:, k], difference, rtol=1e-6, atol=1e-6)


def test_forces_have_no_resultant(model):
    group, poses = model
    force = np.zeros((3, 6))
    group.add_force(BodyState(0.0, poses, np.zeros((3, 6))), force)
    np.testing.assert_allclose(force[:, :3].sum(axis=0), 0.0, atol=1e-12)
    axes = [rotation_matrix(pose[3:]) for pose in poses]
    moment = sum(np.cross(pose[:3], row[:3]) + turn @ row[3:] for pose, row, turn in zip(poses, force, axes, strict=True))
    np.testing.assert_allclose(moment, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"kind": "volumes"}, "volumes"),
        ({"points": [{"body": "ground"}] * 3}, "3 points; an element of kind 'volume' has 4"),
        ({"parameters": {"size": 1}}, "not used with kind"),
    ],
)
def test_wrong_elements_are_refused(change, text):
    add_point_element("volume", PointKind(4, volume, slopes))
    body = {"name": "a", "mass": 1.0, "inertia": [1.0, 1.0, 1.0]}
    element = {"name": "e", "kind": "volume", "points": [{"body": "ground"}] * 3 + [{"body": "a"}]} | change
    with pytest.raises((ValidationError, CaseError), match=text):
        Case.model_validate({"scene": {"bodies": [body], "point_elements": [element]}, "solve": {"end_time": 1.0}})
