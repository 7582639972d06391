"""Bodies with a prescribed motion, for kernels: poses, rates and reactions; see `fsm.model.bodies.turns` for the
equations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.pieces import program_at
from fsm.kernels.programs import Pieces
from fsm.kernels.tensor import Vector, crossed, quaternion_product


class Driven(NamedTuple):
    """Bodies of all motions.

    Attributes
    ----------
    programs : Pieces
        Travel or turn of every motion.
    bodies, motions : (m,) int arrays
        Driven bodies, and the motion of each.
    directions : (n_motions, 2 or 3) array
        Zero for a turn.
    turning : (k, 2) int array
        Motion and body of all bodies that turn.
    turns : (k, 12) array
        Axis, centre, arm from the centre at the start, and axis in the body.
    start : (m, 3 or 7) array
        Poses without travel.
    scale : (n_motions,) array
        Divisors that convert forces of motions to N; see `fsm.solve.interface.scales.Scales`.
    """

    programs: Pieces
    bodies: np.ndarray
    motions: np.ndarray
    directions: np.ndarray
    turning: np.ndarray
    turns: np.ndarray
    start: np.ndarray
    scale: np.ndarray


@kernel
def _parts(turn: np.ndarray) -> tuple[Vector, Vector, Vector, Vector]:
    """Axis, centre, arm, and axis in the body."""
    return (
        (turn[0], turn[1], turn[2]), (turn[3], turn[4], turn[5]), (turn[6], turn[7], turn[8]), (turn[9], turn[10], turn[11])
    )  # fmt: skip


@kernel
def _turned_arm(axis: Vector, arm: Vector, angle: float) -> Vector:
    """Arm after a rotation (formula of Rodrigues)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    along = (1.0 - cosine) * (axis[0] * arm[0] + axis[1] * arm[1] + axis[2] * arm[2])
    across = crossed(axis, arm)
    return (
        cosine * arm[0] + sine * across[0] + along * axis[0],
        cosine * arm[1] + sine * across[1] + along * axis[1],
        cosine * arm[2] + sine * across[2] + along * axis[2],
    )


@kernel
def _set_row(row: np.ndarray, velocity: Vector, factor: float, spin: Vector) -> None:
    """Write the rates of a body: the velocity, and `factor` times `spin` as angular velocity."""
    if row.shape[0] == 3:
        row[0], row[1], row[2] = velocity[0], velocity[2], factor * spin[1]
    else:
        for k in range(3):
            row[k], row[3 + k] = velocity[k], factor * spin[k]


@kernel
def _speed(driven: Driven, motion: int, t: float, before: float) -> tuple[float, float]:
    """Travel of a motion, and its speed; if `before` is earlier than t, its mean speed since then."""
    travel, speed, _ = program_at(driven.programs, motion, t)
    if before < t:
        speed = (travel - program_at(driven.programs, motion, before)[0]) / (t - before)
    return travel, speed


@kernel
def place_driven(driven: Driven, t: float, before: float, poses: np.ndarray, rates: np.ndarray) -> None:
    """Write poses and rates of the driven bodies at a time (s) into the arrays of all bodies. If `before` (s) is earlier
    than t, the rates are means since then.
    """
    n = driven.directions.shape[1]
    for i in range(driven.bodies.shape[0]):
        body, motion = driven.bodies[i], driven.motions[i]
        travel, speed = _speed(driven, motion, t, before)
        for k in range(poses.shape[1]):
            poses[body, k] = driven.start[i, k]
        for k in range(n):
            poses[body, k] += travel * driven.directions[motion, k]
            rates[body, k] = speed * driven.directions[motion, k]
    for i in range(driven.turning.shape[0]):
        motion, body = driven.turning[i, 0], driven.turning[i, 1]
        angle, speed = _speed(driven, motion, t, before)
        axis, centre, at_start, own = _parts(driven.turns[i])
        arm = _turned_arm(axis, at_start, angle)
        velocity = crossed(axis, arm)
        velocity = (speed * velocity[0], speed * velocity[1], speed * velocity[2])
        if before < t:
            old = _turned_arm(axis, at_start, angle - speed * (t - before))
            duration = t - before
            velocity = ((arm[0] - old[0]) / duration, (arm[1] - old[1]) / duration, (arm[2] - old[2]) / duration)
        if poses.shape[1] == 3:
            poses[body, 0], poses[body, 1] = centre[0] + arm[0], centre[2] + arm[2]
            poses[body, 2] += axis[1] * angle
        else:
            half = 0.5 * angle
            sine = np.sin(half)
            own_turn = (poses[body, 3], poses[body, 4], poses[body, 5], poses[body, 6])
            turned = quaternion_product((np.cos(half), sine * axis[0], sine * axis[1], sine * axis[2]), own_turn)
            for k in range(3):
                poses[body, k] = centre[k] + arm[k]
            for k in range(4):
                poses[body, 3 + k] = turned[k]
        _set_row(rates[body], velocity, speed, own)


@kernel
def accelerate_driven(driven: Driven, t: float, out: np.ndarray) -> None:
    """Write the accelerations of the driven bodies at a time (s) into an array (n_bodies, 3 or 6)."""
    n = driven.directions.shape[1]
    for i in range(driven.bodies.shape[0]):
        body, motion = driven.bodies[i], driven.motions[i]
        _, _, bend = program_at(driven.programs, motion, t)
        for k in range(out.shape[1]):
            out[body, k] = bend * driven.directions[motion, k] if k < n else 0.0
    for i in range(driven.turning.shape[0]):
        motion, body = driven.turning[i, 0], driven.turning[i, 1]
        angle, speed, bend = program_at(driven.programs, motion, t)
        axis, _, arm, own = _parts(driven.turns[i])
        across = crossed(axis, _turned_arm(axis, arm, angle))
        inward = crossed(axis, across)
        bent = (
            bend * across[0] + speed**2 * inward[0], bend * across[1] + speed**2 * inward[1],
            bend * across[2] + speed**2 * inward[2],
        )  # fmt: skip
        _set_row(out[body], bent, bend, own)


@kernel
def driven_power(driven: Driven, inertia: np.ndarray, rates: np.ndarray, wrenches: np.ndarray) -> tuple[float, float]:
    """Power (W) of the reactions to `wrenches` (n_bodies, 3 or 6), and kinetic energy (J) of the driven bodies."""
    power = kinetic = 0.0
    for i in range(driven.bodies.shape[0]):
        body = driven.bodies[i]
        for k in range(rates.shape[1]):
            power -= wrenches[body, k] * rates[body, k]
            kinetic += 0.5 * inertia[body, k] * rates[body, k] ** 2
    return power, kinetic


@kernel
def fill_reactions(driven: Driven, t: float, inertia: np.ndarray, wrenches: np.ndarray, out: np.ndarray) -> float:
    """Write the travels (n_motions,) of the drives and their forces or moments to `out`. The force of a drive balances the
    wrenches on its bodies and their inertial forces.

    Returns the largest inertial part of the force of a drive, N.
    """
    count, n = driven.directions.shape
    against_inertia = np.zeros(count)
    for motion in range(count):
        out[motion], out[count + motion] = program_at(driven.programs, motion, t)[0], 0.0
    for i in range(driven.bodies.shape[0]):
        body, motion = driven.bodies[i], driven.motions[i]
        _, _, acceleration = program_at(driven.programs, motion, t)
        for k in range(n):
            along = driven.directions[motion, k]
            against_inertia[motion] += along * inertia[body, k] * along * acceleration
            out[count + motion] -= along * wrenches[body, k]
    twist, change = np.empty(inertia.shape[1]), np.empty(inertia.shape[1])
    for i in range(driven.turning.shape[0]):
        motion, body = driven.turning[i, 0], driven.turning[i, 1]
        angle, speed, acceleration = program_at(driven.programs, motion, t)
        axis, _, arm, own = _parts(driven.turns[i])
        across = crossed(axis, _turned_arm(axis, arm, angle))
        inward = crossed(axis, across)
        _set_row(twist, across, 1.0, own)
        velocity = (
            acceleration * across[0] + speed * speed * inward[0],
            acceleration * across[1] + speed * speed * inward[1],
            acceleration * across[2] + speed * speed * inward[2],
        )
        _set_row(change, velocity, acceleration, own)
        for k in range(inertia.shape[1]):
            against_inertia[motion] += twist[k] * inertia[body, k] * change[k]
            out[count + motion] -= twist[k] * wrenches[body, k]
    largest = 0.0
    for motion in range(count):
        out[count + motion] += against_inertia[motion]
        largest = max(largest, abs(against_inertia[motion]) / driven.scale[motion])
    return largest
