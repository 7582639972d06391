"""Derivatives of the openings of ideal joints."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.interactions.openings import ACROSS, ALONG, CONSTANTS, DISTANCE, LENGTH, SCREW, TURN, bend, opening
from fsm.kernels.body_poses import retract_poses

Evaluated = tuple[float, np.ndarray, np.ndarray]


@pytest.mark.parametrize("kind", [ALONG, ACROSS, DISTANCE, TURN, LENGTH, SCREW])
def test_derivatives(kind: int) -> None:
    random = np.random.default_rng(kind)
    poses, constants = random.normal(size=(2, 7)), random.normal(size=CONSTANTS)
    constants[6] = 1.3
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1)[:, None]

    def at(increment: np.ndarray) -> Evaluated:
        gradient, hessian, moved = np.zeros(12), np.zeros((12, 12)), retract_poses(poses.ravel(), increment)
        return opening(kind, moved[:7], moved[7:], constants, 0.2, gradient, hessian), gradient, hessian

    value, gradient, hessian = at(np.zeros(12))
    alone = np.zeros(12)
    assert opening(kind, poses[0], poses[1], constants, 0.2, alone, np.zeros((0, 12))) == pytest.approx(value, rel=1e-14)
    assert alone == pytest.approx(gradient, rel=1e-14)
    step, units = 1e-5, np.eye(12)
    slopes = [(at(step * e)[0] - at(-step * e)[0]) / (2.0 * step) for e in units]
    bends = [(at(step * e)[1] - at(-step * e)[1]) / (2.0 * step) for e in units]
    assert gradient == pytest.approx(np.array(slopes), abs=1e-8)
    assert hessian == pytest.approx(np.array(bends).T, abs=1e-8)
    rates = random.normal(size=12)
    assert bend(kind, poses[0], poses[1], constants, rates) == pytest.approx(rates @ hessian @ rates, rel=1e-12)


def test_round_off_is_no_opening() -> None:
    poses, work = np.zeros((2, 7)), (np.zeros(12), np.zeros((12, 12)))
    poses[:, 3] = 1.0
    poses[1, 0] = 100.0 * (1.0 + 1e-15)
    along_x = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 100.0])
    assert opening(ALONG, poses[0], poses[1], along_x, 0.0, *work) == 0.0
    poses[1, 0] = 100.0 * (1.0 + 1e-13)
    assert opening(ALONG, poses[0], poses[1], along_x, 0.0, *work) == pytest.approx(1e-11, rel=1e-2, abs=0.0)
