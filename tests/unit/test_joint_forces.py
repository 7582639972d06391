"""Laws on the coordinates of joints: forces against energies and tangents."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from fsm.case.derived.rebound import rebound
from fsm.interactions.openings import ALONG, CONSTANTS, LENGTH, TURN
from fsm.kernels.body_poses import retract_poses
from fsm.kernels.programs import Piece, Program
from fsm.model.bodies.group import BlockSums, BodyState, body_pattern
from fsm.model.elements import joint_laws as laws
from fsm.model.elements.joint_forces import JointForceGroup
from tests.tangents import differences

_ENERGETIC = 8
"""Laws with an energy, without friction and motors."""


def group(kind: int, c: float, random: np.random.Generator) -> JointForceGroup:
    """A row of each law, at a coordinate c."""
    law = np.zeros((14, laws.COLUMNS))
    law[:, [laws.LOWER, laws.UPPER, laws.SLOWER, laws.OPENS_AT]] = -np.inf, np.inf, np.inf, np.inf
    law[:, laws.RATIO] = law[:, laws.SLOWEST] = 1.0
    law[0, [laws.LOAD, laws.SPRING, laws.REST]] = 3.0, 5.0, 0.4
    law[1, [laws.UPPER, laws.STOP, laws.STOP_DAMPER]] = c - 0.3, 4.0, 0.3
    law[2, [laws.LOWER, laws.STOP, laws.REBOUND]] = c + 0.3, 4.0, 0.7
    law[3, [laws.GAS, laws.GAS_AT, laws.COLUMN, laws.EXPONENT]] = 2.0, c + 0.1, 0.5, 1.3
    law[4, [laws.GAS, laws.GAS_AT, laws.COLUMN, laws.EXPONENT]] = 2.0, c + 0.1, 0.5, 1.0
    law[5, [laws.SLIDER, laws.SPRING_SLIDER]] = 0.2, 0.3
    law[6, [laws.LATCH_AT, laws.LATCH_SENSE, laws.LATCH, laws.LATCH_DAMPER]] = c + 0.2, 1.0, 9.0, 0.5
    law[7, [laws.SIDE, laws.DAMPER]] = 1.0, 0.6
    law[8, [laws.DAMPER]] = 0.7
    law[9, [laws.FRICTION, laws.SLIP_RATE]] = 0.8, 0.1
    law[10, [laws.FRICTION, laws.SLIP_RATE, laws.PRESLIDING]] = 0.8, 0.1, 0.2
    law[11, [laws.MOTOR, laws.RATIO]] = laws.CURVE, 3.0
    law[12, [laws.MOTOR, laws.BAND]] = laws.GOVERNED, 2.0
    law[13, laws.MOTOR] = laws.TORQUE
    tables: dict[tuple[int, int], list[list[float]]] = {
        (0, laws.OF_SPRING): [[c - 90.0, 1.0], [c - 9.0, 3.0], [c + 9.0, 5.0]],
        (5, laws.OF_HARNESS): [[c - 1.0, 1.0], [c + 2.0, 4.0]], (5, laws.OF_WIDTH): [[c - 1.0, 0.2], [c + 2.0, 0.8]],
        (7, laws.OF_SPRING): [[c - 1.0, 0.0], [c - 0.5, 0.0], [c + 1.0, 2.0]],
        (8, laws.OF_DAMPER): [[-9.0, -1.0], [0.0, 0.0], [9.0, 3.0]],
        (11, laws.OF_MOTOR): [[-9.0, 5.0], [9.0, 1.0]], (12, laws.OF_MOTOR): [[-9.0, 5.0], [9.0, 1.0]],
    }  # fmt: skip
    rows = {key: [[*row, math.nan] for row in table] for key, table in tables.items()}
    rows |= {
        (5, laws.OF_SPRING): [[c - 1.0, 0.3, 1.0], [c + 0.4, 2.0, -0.5], [c + 1.0, 1.0, 0.7]],  # cubic
        (5, laws.OF_SPRING_WIDTH): [[c - 1.0, 0.2, 0.1], [c + 2.0, 0.8, 0.0]],
    }
    each = [np.array(rows.get((i, k), np.zeros((0, 3)))) for i in range(len(law)) for k in range(laws.TABLES)]
    first = np.cumsum([0, *(len(table) for table in each)])
    n = len(law)
    programs = np.full((n, 2), -1, dtype=np.int64)
    programs[0, laws.FREE], programs[12, laws.PUSH], programs[13, laws.PUSH] = 1, 0, 0
    functions = tuple(Program((Piece(-math.inf, True, 0.0, (value,)),)) for value in (0.9, 0.05))
    found = JointForceGroup(
        np.tile(np.array([[1, 2]], dtype=np.int64), (n, 1)), np.full(n, kind, dtype=np.int64),
        np.tile(random.normal(size=CONSTANTS), (n, 1)), law, first, np.concatenate(each), np.full(n, c),
        tuple("abcdefghijklmn"), programs, functions, np.zeros(1), np.zeros((n, 2), dtype=np.int64),
    )  # fmt: skip
    memory = found.memory_of
    memory[laws.LATCHED * n + 6] = 1.0
    memory[laws.BRISTLE * n + 10], memory[laws.COORDINATE * n + 10] = 0.7, c - 0.04  # partly sliding
    memory[laws.HARNESS * n + 5], memory[laws.SPRING_SLID * n + 5] = 0.3, -0.2
    memory[laws.IMPACT * n + 2] = 1.4
    return found


@pytest.mark.parametrize("kind", [ALONG, TURN, LENGTH])
def test_forces_and_tangents(kind: int) -> None:
    random = np.random.default_rng(3)
    poses, rates = random.normal(size=(3, 7)), np.zeros((3, 6))
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1)[:, None]
    state = random.bit_generator.state
    c = float(group(kind, 0.0, random).states(0.0, poses, rates)[0, 0])
    random.bit_generator.state = state
    springs = group(kind, c, random)
    rates[1:] = 0.1 * random.normal(size=(2, 6))
    pattern = body_pattern(np.array([-1, 0, 1]), [springs.bodies], 6)

    def at(move: np.ndarray, faster: np.ndarray) -> tuple[np.ndarray, float, np.ndarray, np.ndarray]:
        placed = poses.copy()
        placed[1:] = retract_poses(poses[1:].ravel(), move).reshape(2, 7)
        moving = rates.copy()
        moving[1:] += faster.reshape(2, 6)
        force, stiffness, damping = np.zeros((3, 6)), pattern.zeros(), pattern.zeros()
        springs.add_linearised(BodyState(0.0, placed, moving), BlockSums(pattern, force, stiffness, damping))
        again = np.zeros((3, 6))
        springs.add_force(BodyState(0.0, placed, moving), again)
        assert again == pytest.approx(force, rel=1e-13)
        stored = springs.energy(BodyState(0.0, placed, np.zeros((3, 6))))[0]["panels"]
        dense = [np.block([[data[0], data[1]], [data[2], data[3]]]) for data in (stiffness, damping)]
        return force[1:].ravel(), stored, dense[0], dense[1]

    none, steps = np.zeros(12), np.full(12, 1e-6)
    _, _, stiffness, damping = at(none, none)
    slopes = differences(lambda x: at(x, none)[0], steps)
    assert stiffness == pytest.approx(-slopes, abs=1e-6 * np.abs(slopes).max())
    slopes = differences(lambda x: at(none, x)[0], steps)
    assert damping == pytest.approx(-slopes, abs=1e-7 * np.abs(slopes).max())
    rates[:] = 0.0
    springs.laws[_ENERGETIC:] = springs.laws[1]  # a stop
    springs.programs[1:] = -1
    springs.first[laws.TABLES * _ENERGETIC :] = springs.first[laws.TABLES * _ENERGETIC]
    slopes = differences(lambda x: at(x, none)[1], steps)
    assert at(none, none)[0] == pytest.approx(-slopes, abs=1e-6 * np.abs(slopes).max())


def test_rebound() -> None:
    """The work of a spring k p over an impact is zero: that of k p (1 + b p'/v) is the integral of v/(1 + b v)."""
    for e in (0.2, 0.5, 0.98):
        b = rebound(e)
        assert quad(lambda v, b=b: v / (1.0 + b * v), -e, 1.0, epsabs=1e-12)[0] == pytest.approx(0.0, abs=1e-9)
