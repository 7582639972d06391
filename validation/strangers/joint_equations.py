"""Motion of bodies on ideal joints by equations that share nothing with fsm: absolute coordinates, velocities in inertial
axes, constraints at acceleration level, multipliers of least squares, SciPy's DOP853 without projection. A parallelogram,
which passes branch points, has the equation of its angle.

Joints are points that coincide, axes at right angles, and points in planes, each differentiated twice by hand.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from fsm.results.store import read_solution

__all__ = ["by_equations", "motion"]

_RTOL, _ATOL = 1e-10, 1e-12
_ALLOWED = 1e-4
"""Difference of positions, relative to the extent of the motion, above which a result is wrong."""
_MOST = 40_000
"""Largest number of evaluations; near a branch point of a linkage its equations have a rank that jumps."""
_SAME = 1e-10
"""Singular value relative to the largest one, below which rows are redundant."""
Vector = np.ndarray


@dataclass(frozen=True)
class _Motion:
    """Position vectors from the centres of both bodies, or directions fixed to them, with velocities."""

    w: tuple[Vector, Vector]
    v: tuple[Vector, Vector]
    place: tuple[Vector, Vector]


def _twice(w: Vector, s: Vector) -> Vector:
    return np.cross(w, np.cross(w, s))


class _Joint:
    """Rows (12,) of accelerations (a_1, alpha_1, a_2, alpha_2), and the rest of each second derivative."""

    def __init__(self, table: dict[str, Any], start: dict[str, tuple[Vector, Rotation]]) -> None:
        self.kind, self.names = table["kind"], (table["first"], table["second"])
        at, rest = np.array(table["at"], dtype=float), (np.zeros(3), Rotation.identity())
        to = np.array(table.get("to", table["at"]), dtype=float)
        one, two = (start.get(name, rest) for name in self.names)
        self.arms = one[1].inv().apply(at - one[0]), two[1].inv().apply(to - two[0])
        axis = np.array(table.get("axis", [0.0, 0.0, 1.0]), dtype=float)
        z = axis / np.linalg.norm(axis)
        if "second_axis" in table:
            x = np.array(table["second_axis"], dtype=float)
        else:
            x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
        x /= np.linalg.norm(x)
        axes = np.array([x, np.cross(z, x), z])
        self.axes = one[1].inv().apply(axes), two[1].inv().apply(axes)
        spring, damper = table.get("spring", {}), table.get("damper", {})
        self.stiffness, self.rest = spring.get("stiffness", 0.0), spring.get("rest", 0.0)
        self.damping = damper.get("coefficient", 0.0)

    def rows(self, m: _Motion, turned: tuple[Rotation, Rotation]) -> Iterator[tuple[Vector, float]]:
        """Rows and remainders of all constraints."""
        arms = turned[0].apply(self.arms[0]), turned[1].apply(self.arms[1])
        one, two = turned[0].apply(self.axes[0]), turned[1].apply(self.axes[1])
        apart = m.place[1] + arms[1] - m.place[0] - arms[0]
        speed = m.v[1] + np.cross(m.w[1], arms[1]) - m.v[0] - np.cross(m.w[0], arms[0])
        bend = _twice(m.w[1], arms[1]) - _twice(m.w[0], arms[0])
        if self.kind in ("revolute", "spherical", "universal", "fixed"):
            for n in np.eye(3):
                yield np.concatenate([-n, -np.cross(arms[0], n), n, np.cross(arms[1], n)]), n @ bend
        if self.kind == "distance":
            row = np.concatenate([-apart, -np.cross(arms[0], apart), apart, np.cross(arms[1], apart)])
            yield row, apart @ bend + speed @ speed
        if self.kind in ("cylindrical", "prismatic"):
            for n in one[:2]:  # n . apart = 0, n turns with the first body
                own = -np.cross(arms[0], n) + np.cross(n, apart)
                left = n @ bend + _twice(m.w[0], n) @ apart + 2.0 * np.cross(m.w[0], n) @ speed
                yield np.concatenate([-n, own, n, np.cross(arms[1], n)]), left
        pairs = {"revolute": [(2, 0), (2, 1)], "cylindrical": [(2, 0), (2, 1)], "universal": [(2, 0)]}
        pairs["prismatic"] = pairs["fixed"] = [(2, 0), (2, 1), (0, 1)]
        for i, j in pairs.get(self.kind, ()):
            a, b, none = one[i], two[j], np.zeros(3)
            left = _twice(m.w[0], a) @ b + a @ _twice(m.w[1], b) + 2.0 * np.cross(m.w[0], a) @ np.cross(m.w[1], b)
            yield np.concatenate([none, np.cross(a, b), none, np.cross(b, a)]), left

    def axis(self, turned: Rotation) -> Vector:
        """Axis in inertial axes."""
        return np.asarray(turned.apply(self.axes[0][2]))


class _Mechanism:
    def __init__(self, tables: dict[str, Any]) -> None:
        scene = tables["scene"]
        self.gravity, bodies = np.array(tables.get("gravity", [0.0] * 3), dtype=float), scene["bodies"]
        self.index = {body["name"]: i for i, body in enumerate(bodies)}
        self.mass = np.array([body["mass"] for body in bodies], dtype=float)
        self.inertia = np.array([body["inertia"] for body in bodies], dtype=float)
        turned = [Rotation.from_quat(body.get("orientation", [1.0, 0, 0, 0]), scalar_first=True) for body in bodies]
        start = {b["name"]: (np.array(b["position"], dtype=float), t) for b, t in zip(bodies, turned, strict=True)}
        self.joints = [_Joint(joint, start) for joint in scene["joints"]]
        self.n, self.evaluations = len(bodies), 0
        quaternions = [t.as_quat(scalar_first=True) for t in turned]
        places = np.concatenate([start[b["name"]][0] for b in bodies])
        speeds = np.zeros((self.n, 6))
        for i, body in enumerate(bodies):
            speeds[i, :3] = body.get("velocity", [0.0] * 3)
            speeds[i, 3:] = turned[i].apply(body.get("angular_velocity", [0.0] * 3))
        self.first = np.concatenate([places, np.concatenate(quaternions), speeds.ravel(), np.zeros(len(self.joints))])

    def rate(self, t: float, y: Vector) -> Vector:
        n = self.n
        self.evaluations += 1
        if self.evaluations > _MOST:
            raise ArithmeticError(f"more than {_MOST} evaluations")
        place, quaternion = y[: 3 * n].reshape(n, 3), y[3 * n : 7 * n].reshape(n, 4)
        speeds, angles = y[7 * n : 13 * n].reshape(n, 6), y[13 * n :]
        turned = [Rotation.from_quat(p, scalar_first=True) for p in quaternion]
        inverse, force = np.zeros((6 * n, 6 * n)), np.zeros(6 * n)
        for i in range(n):
            matrix, w = turned[i].as_matrix(), speeds[i, 3:]
            about = matrix @ np.diag(self.inertia[i]) @ matrix.T
            inverse[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = np.eye(3) / self.mass[i]
            inverse[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = np.linalg.inv(about)
            force[6 * i : 6 * i + 3] = self.mass[i] * self.gravity
            force[6 * i + 3 : 6 * i + 6] = -np.cross(w, about @ w)
        rows, left, spins = [], [], np.zeros(len(self.joints))
        ground = np.zeros(3), Rotation.identity(), np.zeros(6)
        for k, joint in enumerate(self.joints):
            at = [self.index.get(name, -1) for name in joint.names]
            ends = [ground if i < 0 else (place[i], turned[i], speeds[i]) for i in at]
            m = _Motion(
                (ends[0][2][3:], ends[1][2][3:]), (ends[0][2][:3], ends[1][2][:3]), (ends[0][0], ends[1][0])
            )  # fmt: skip
            for row, rest in joint.rows(m, (ends[0][1], ends[1][1])):
                whole = np.zeros(6 * n)
                for side, i in enumerate(at):
                    if i >= 0:
                        whole[6 * i : 6 * i + 6] += row[6 * side : 6 * side + 6]
                rows.append(whole)
                left.append(rest)
            axis = joint.axis(ends[0][1])
            spins[k] = (m.w[1] - m.w[0]) @ axis
            if joint.kind == "revolute":
                moment = -joint.stiffness * (angles[k] - joint.rest) - joint.damping * spins[k]
                for sign, i in ((-1.0, at[0]), (1.0, at[1])):
                    if i >= 0:
                        force[6 * i + 3 : 6 * i + 6] += sign * moment * axis
        jacobian = np.array(rows)
        free = inverse @ force
        effort = np.linalg.lstsq(jacobian @ inverse @ jacobian.T, jacobian @ free + np.array(left), rcond=_SAME)[0]
        acceleration = free - inverse @ (jacobian.T @ effort)
        of_quaternion = np.empty((n, 4))
        for i in range(n):
            w, p = speeds[i, 3:], quaternion[i]
            of_quaternion[i, 0] = -0.5 * w @ p[1:]
            of_quaternion[i, 1:] = 0.5 * (p[0] * w + np.cross(w, p[1:]))
        return np.concatenate([speeds[:, :3].ravel(), of_quaternion.ravel(), acceleration, spins])


def _parallelogram(tables: dict[str, Any], times: Sequence[float]) -> np.ndarray | None:
    """Positions as `motion` for a plane parallelogram at rest, by the equation of its angle; None for other mechanisms.

    Absolute coordinates lose rank where the bars are in line, and their motion may then leave the parallelogram.
    """
    joints, bodies = tables["scene"]["joints"], tables["scene"]["bodies"]
    points = [np.array(joint["at"], dtype=float) for joint in joints]
    if [body["name"] for body in bodies] != ["crank", "coupler", "rocker"]:
        return None
    bar = points[1] - points[0]
    if np.abs(points[2] - points[3] - bar).max() > 1e-9 * float(np.linalg.norm(bar)):
        return None
    axis = np.array(joints[0]["axis"], dtype=float) / np.linalg.norm(joints[0]["axis"])
    feet, arms = np.array([points[0], bodies[1]["position"] - bar, points[3]]), np.array([0.5 * bar, bar, 0.5 * bar])
    mass, gravity = np.array([body["mass"] for body in bodies]), np.array(tables["gravity"])
    inertia = float(mass @ (arms**2).sum(axis=1))
    for body in (bodies[0], bodies[2]):
        own = Rotation.from_quat(body["orientation"], scalar_first=True).inv().apply(axis)
        inertia += float(np.array(body["inertia"]) @ own**2)
    springs = [(sign, joint.get("spring", {})) for sign, joint in zip((1.0, -1.0, 1.0, 1.0), joints, strict=True)]
    damping = sum(joint.get("damper", {}).get("coefficient", 0.0) for joint in joints)

    def rate(t: float, y: Vector) -> list[float]:
        turned = Rotation.from_rotvec(axis * y[0]).apply(arms)
        moment = float(mass @ (np.cross(axis, turned) @ gravity)) - damping * y[1]
        for sign, spring in springs:
            moment -= sign * spring.get("stiffness", 0.0) * (sign * y[0] - spring.get("rest", 0.0))
        return [y[1], moment / inertia]

    angles = solve_ivp(rate, (0.0, float(times[-1])), [0.0, 0.0], "DOP853", times, rtol=1e-11, atol=1e-12).y[0]
    return np.array([feet + Rotation.from_rotvec(axis * angle).apply(arms) for angle in angles])


def motion(tables: dict[str, Any], times: Sequence[float]) -> np.ndarray:
    """Positions (m, n, 3) of all bodies at times (s), m.

    Parameters
    ----------
    tables : case with bodies and joints, all numbers in SI
    times : increasing, s

    Raises
    ------
    ArithmeticError
        The equations could not be integrated.
    """
    alone = _parallelogram(tables, times)
    if alone is not None:
        return alone
    mechanism = _Mechanism(tables)
    ends = (0.0, float(times[-1]))
    found = solve_ivp(mechanism.rate, ends, mechanism.first, "DOP853", times, rtol=_RTOL, atol=_ATOL)
    if not found.success or not math.isclose(found.t[-1], ends[1]):
        raise ArithmeticError(found.message)
    return np.asarray(found.y[: 3 * mechanism.n].T.reshape(len(times), mechanism.n, 3))


def by_equations(tables: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Verdict on the positions of all bodies in a folder of results, in the form of `validation.strangers.campaign`.

    Bodies whose own motion amplifies a change of 1e-6 as much (chaotic chains, branch points) are "sensitive".
    """
    solution = read_solution(folder / "result.h5")
    names = [body["name"] for body in tables["scene"]["bodies"]]
    places = np.stack([solution.channels[f"body.{name}.position"].values for name in names], axis=1)
    try:
        exact = motion(tables, solution.time.tolist())
    except ArithmeticError as error:
        return {"second": "failed", "by": f"own equations: {error}"}
    extent = float(np.ptp(exact.reshape(-1, 3), axis=0).max())
    off = float(np.abs(places - exact).max()) / extent
    verdict = {"second": "agrees" if off <= _ALLOWED else "differs", "by": "own equations", "of": "positions", "off": off}
    if off > _ALLOWED:
        lighter = {**tables, "gravity": [g * (1.0 + 1e-6) for g in tables["gravity"]]}
        moved = float(np.abs(motion(lighter, solution.time.tolist()) - exact).max()) / extent
        verdict |= {"nudged": moved} | ({"second": "sensitive"} if moved > 0.2 * off else {})
    return verdict | {"allowed": _ALLOWED}
