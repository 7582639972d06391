"""Springs, dampers and stops on the coordinates of joints: forces against energies and tangents."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.interactions.openings import ALONG, TURN
from fsm.kernels.body_poses import retract_poses
from fsm.model.bodies.pattern import body_pattern
from fsm.model.elements.joint_forces import JointForceGroup


def group(kind: int, random: np.random.Generator) -> JointForceGroup:
    """A row of each: spring with a load, table with a damper, both stops with a damper."""
    law = np.array(
        [
            [3.0, 5.0, 0.4, 0.0, -np.inf, np.inf, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.7, -np.inf, np.inf, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 90.0, 91.0, 4.0, 0.3],
            [0.0, 0.0, 0.0, 0.0, -91.0, -90.0, 4.0, 0.3],
        ]
    )
    law = np.hstack([law, np.zeros((4, 6))])
    rows = np.array([[-90.0, 1.0], [-9.0, 3.0], [0.0, -2.0], [9.0, 5.0]])
    constants = np.tile(random.normal(size=10), (4, 1))
    first = np.array([0, 0, 4, 4, 4], dtype=np.int64)
    ends = np.tile(np.array([[1, 2]], dtype=np.int64), (4, 1))
    return JointForceGroup(ends, np.full(4, kind, dtype=np.int64), constants, law, first, rows, np.full(4, 6.0), ("a",) * 4)


@pytest.mark.parametrize("kind", [ALONG, TURN])
def test_forces_and_tangents(kind: int) -> None:
    random = np.random.default_rng(3)
    springs, poses, rates = group(kind, random), random.normal(size=(3, 7)), np.zeros((3, 6))
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1)[:, None]
    rates[1:] = 0.1 * random.normal(size=(2, 6))
    pattern = body_pattern(np.array([-1, 0, 1]), [springs.bodies], 6)

    def at(move: np.ndarray, faster: np.ndarray) -> tuple[np.ndarray, float, np.ndarray, np.ndarray]:
        placed = poses.copy()
        placed[1:] = retract_poses(poses[1:].ravel(), move).reshape(2, 7)
        moving = rates.copy()
        moving[1:] += faster.reshape(2, 6)
        force, stiffness, damping = np.zeros((3, 6)), pattern.zeros(), pattern.zeros()
        springs.add_linearised(0.0, placed, moving, pattern, force, stiffness, damping)
        again = np.zeros((3, 6))
        springs.add_force(0.0, placed, moving, again)
        assert again == pytest.approx(force, rel=1e-13)
        stored = springs.energy(0.0, placed, np.zeros((3, 6)))[0]["panels"]
        dense = [np.block([[data[0], data[1]], [data[2], data[3]]]) for data in (stiffness, damping)]
        return force[1:].ravel(), stored, dense[0], dense[1]

    none, units, step = np.zeros(12), np.eye(12), 1e-6
    _, _, stiffness, damping = at(none, none)
    slopes = np.array([(at(step * e, none)[0] - at(-step * e, none)[0]) / (2.0 * step) for e in units]).T
    assert stiffness == pytest.approx(-slopes, abs=1e-6 * np.abs(slopes).max())
    slopes = np.array([(at(none, step * e)[0] - at(none, -step * e)[0]) / (2.0 * step) for e in units]).T
    assert damping == pytest.approx(-slopes, abs=1e-7 * np.abs(slopes).max())
    rates[:] = 0.0
    slopes = np.array([(at(step * e, none)[1] - at(-step * e, none)[1]) / (2.0 * step) for e in units])
    assert at(none, none)[0] == pytest.approx(-slopes, abs=1e-6 * np.abs(slopes).max())
