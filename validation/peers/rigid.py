"""Rigid mechanisms: their solutions in independent coordinates, and models of fsm with ideal joints.

A01, A02 and A04 are problems of the IFToMM multibody benchmark library: simple pendulum, N four-bar linkages in a row,
Bricard's linkage of six bars.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import GROUND, Body, Scene
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

__all__ = [
    "BRICARD", "GRAVITY", "TIMES", "TOP_TIMES", "WINDOWS", "WING", "bricard_model", "bricard_path", "four_bars_model",
    "four_bars_path", "pendulum_model", "pendulum_path", "run_model", "top_model", "top_path", "wing_model", "wing_path",
]  # fmt: skip

GRAVITY = 9.81
TIMES = np.arange(1, 21) * 0.5
TOP_TIMES = np.arange(1, 21) * 0.05
WINDOWS = 2

Path = np.ndarray
"""Position (times, 2 or 3) of one point, m."""


def _exact(rate: Callable, start: Sequence[float], times: np.ndarray) -> np.ndarray:
    ends = (0.0, float(times[-1]))
    return solve_ivp(rate, ends, start, method="DOP853", rtol=1e-11, atol=1e-12, t_eval=times).y


def run_model(
    system: SegmentSystem, settings: Settings, times: np.ndarray, shown: Callable[[np.ndarray], np.ndarray]
) -> Path:
    """Path at these times of the quantity that `shown` computes from q."""
    saved: list[SavedState] = []
    simulate(system, settings, [float(t) for t in times], saved.append)
    return np.array([shown(state.q) for state in saved])


# A01 --------------------------------------------------------------------------------------------------------------------


def pendulum_path() -> Path:
    """Direction of a pendulum: 1 kg on a massless rod of 1 m, released from the horizontal."""
    angle = _exact(lambda t, y: [y[1], -GRAVITY * math.sin(y[0])], [-0.5 * math.pi, 0.0], TIMES)[0]
    return np.stack([np.sin(angle), -np.cos(angle)], 1)


def pendulum_model() -> tuple[SegmentSystem, Callable[[np.ndarray], np.ndarray]]:
    """A body with the same equation of motion, because fsm requires a moment of inertia: its centre is at d with (d^2 +
    I/m)/d = 1 m."""
    d = 0.75
    moments = (d - d * d,) * 3
    body = Body(name="bob", mass=1.0, inertia=moments, position=(-d, 0.0, 0.0))
    return _compiled([body], [_hinge("hinge", GROUND, "bob", (0.0, 0.0, 0.0))]), lambda q: q[:3:2] / d


def _hinge(name: str, first: str, second: str, at: Sequence[float], axis: Sequence[float] = (0.0, 1.0, 0.0)) -> SceneJoint:
    return SceneJoint(name=name, kind="revolute", first=first, second=second, at=tuple(at), axis=tuple(axis))


def _compiled(bodies: Sequence[Body], joints: Sequence[SceneJoint], gravity: float = GRAVITY) -> SegmentSystem:
    scene = Scene(bodies=tuple(bodies), joints=tuple(joints), gravity=(0.0, 0.0, -gravity))
    return compile_scene(scene, spatial=True)


# A02 --------------------------------------------------------------------------------------------------------------------


def four_bars_path(windows: int = WINDOWS) -> Path:
    """Upper end of the first bar relative to its pivot; all upright bars rotate equally, and their tops start with 1 m/s."""
    inertia, weight = (windows + 1) / 3.0 + windows, GRAVITY * ((windows + 1) / 2.0 + windows)
    angle = _exact(lambda t, y: [y[1], weight / inertia * math.sin(y[0])], [0.0, 1.0], TIMES)[0]
    return np.stack([np.sin(angle), np.cos(angle)], 1)


def four_bars_model(windows: int = WINDOWS) -> tuple[SegmentSystem, Callable[[np.ndarray], np.ndarray]]:
    """Bars of 1 m and 1 kg: windows + 1 upright bars, and one bar between each two tops."""
    moments = (1.0 / 12.0,) * 3
    bodies, joints = [], []
    for i in range(windows + 1):
        bodies.append(
            Body(
                name=f"bar {i}",
                mass=1.0,
                inertia=moments,
                position=(float(i), 0.0, 0.5),
                velocity=(0.5, 0.0, 0.0),
                angular_velocity=(0.0, 1.0, 0.0),
            )
        )
        joints.append(_hinge(f"foot {i}", GROUND, f"bar {i}", (i, 0.0, 0.0)))
    for i in range(windows):
        bodies.append(
            Body(name=f"top {i}", mass=1.0, inertia=moments, position=(i + 0.5, 0.0, 1.0), velocity=(1.0, 0.0, 0.0))
        )
        joints.append(_hinge(f"left {i}", f"bar {i}", f"top {i}", (i, 0.0, 1.0)))
        joints.append(_hinge(f"right {i}", f"bar {i + 1}", f"top {i}", (i + 1.0, 0.0, 1.0)))
    return _compiled(bodies, joints), lambda q: 2.0 * q[:3:2]


# heavy top --------------------------------------------------------------------------------------------------------------


def top_path() -> Path:
    """Centre of the heavy top, by Euler's equations about the fixed point."""
    mass, moments = 15.0, np.array([15.234375, 0.46875, 15.234375])

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        w, x, yy, z = y[:4]
        omega = y[4:]
        down = -GRAVITY * mass * np.array([2 * (x * z - w * yy), 2 * (yy * z + w * x), w * w - x * x - yy * yy + z * z])
        moment = np.cross([0.0, 1.0, 0.0], down)
        turn = 0.5 * np.array([
            -x * omega[0] - yy * omega[1] - z * omega[2], w * omega[0] + yy * omega[2] - z * omega[1],
            w * omega[1] + z * omega[0] - x * omega[2], w * omega[2] + x * omega[1] - yy * omega[0],
        ])  # fmt: skip
        return np.concatenate([turn, (moment - np.cross(omega, moments * omega)) / moments])

    w, x, y, z = _exact(rate, [1.0, 0.0, 0.0, 0.0, 0.0, 150.0, -4.61538], TOP_TIMES)[:4]
    return np.stack([2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)], 1)


def top_model() -> tuple[SegmentSystem, Callable[[np.ndarray], np.ndarray]]:
    """The body has 15 kg, its centre is 1 m from the fixed point, and it rotates with 150 rad/s about its axis."""
    top = Body(
        name="top", mass=15.0, inertia=(0.234375, 0.46875, 0.234375), position=(0.0, 1.0, 0.0), velocity=(4.61538, 0.0, 0.0),
        angular_velocity=(0.0, 150.0, -4.61538),
    )  # fmt: skip
    fixed = SceneJoint(name="fixed point", kind="spherical", first=GROUND, second="top", at=(0.0, 0.0, 0.0))
    return _compiled([top], [fixed]), lambda q: q[:3]


# wing -------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Wing:
    """Panels in a row on hinges with springs and dampers, folded by half turns, which unfold in the x-y plane without
    weight."""

    panels: int = 6
    length: float = 0.8
    mass: float = 3.0
    stiffness: float = 0.4
    damping: float = 0.15

    @property
    def inertia(self) -> float:
        """Moment of inertia of a panel about its centre, kg m^2."""
        return self.mass * self.length**2 / 12.0

    @property
    def stowed(self) -> np.ndarray:
        """Angle of each hinge at the start, rad: a right angle, then half turns to both sides."""
        return np.array([0.5 * math.pi, *((-1.0) ** k * math.pi for k in range(1, self.panels))])

    @property
    def rest(self) -> np.ndarray:
        """Angle of each hinge at which its spring is free, rad: a right angle beyond the straight wing."""
        return -0.5 * math.pi * np.sign(self.stowed)


WING = Wing()


def wing_path(wing: Wing = WING) -> Path:
    """Centre of the last panel, by Lagrange's equations of the directions of the panels."""
    n, m, length = wing.panels, wing.mass, wing.length
    arms = length * (np.tri(n, k=-1) + 0.5 * np.eye(n))  # row i: parts of each direction in the centre of panel i
    coupling = m * arms.T @ arms

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        phi, omega = y[:n], y[n:]
        apart = phi[:, None] - phi
        angle, speed = np.diff(phi, prepend=0.0), np.diff(omega, prepend=0.0)
        moment = -wing.stiffness * (angle - wing.rest) - wing.damping * speed
        load = moment - np.append(moment[1:], 0.0) - (coupling * np.sin(apart)) @ omega**2
        return np.concatenate([omega, np.linalg.solve(coupling * np.cos(apart) + wing.inertia * np.eye(n), load)])

    phi = _exact(rate, [*np.cumsum(wing.stowed), *np.zeros(n)], TIMES)[:n]
    return np.stack([arms[-1] @ np.cos(phi), arms[-1] @ np.sin(phi)], 1)


def wing_model(wing: Wing = WING) -> tuple[SegmentSystem, Callable[[np.ndarray], np.ndarray]]:
    """The same panels on revolute joints."""
    bodies, joints, at, last = [], [], np.zeros(3), GROUND
    for k, phi in enumerate(np.cumsum(wing.stowed)):
        along, turn = wing.length * np.array([math.cos(phi), math.sin(phi), 0.0]), (math.cos(0.5 * phi), math.sin(0.5 * phi))
        bodies.append(
            Body(
                name=f"panel {k}", mass=wing.mass, inertia=(0.01, wing.inertia, wing.inertia),
                position=tuple(at + 0.5 * along), orientation=(turn[0], 0.0, 0.0, turn[1]),
            )
        )  # fmt: skip
        spring = {"stiffness": wing.stiffness, "rest": wing.rest[k]}
        hinge = _hinge(f"hinge {k}", last, f"panel {k}", at, (0.0, 0.0, 1.0)).model_dump(exclude_unset=True)
        acting = {"angle": wing.stowed[k], "spring": spring, "damper": {"coefficient": wing.damping}}
        joints.append(SceneJoint(**hinge, **acting))
        at, last = at + along, f"panel {k}"
    return _compiled(bodies, joints, 0.0), lambda q: q[-7:-5]


# A04 --------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Linkage:
    """Bars between the corners, of which the last is the ground; at every corner there is a hinge normal to the two bars
    that meet there."""

    corners: np.ndarray
    axes: np.ndarray
    slender: float = 1e-3
    """Moment of inertia of a bar about itself, kg m^2; across it 1/12."""


def _cube() -> Linkage:
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, -1], [1, 1, -1], [0, 1, -1], [0, 1, 0]], dtype=float)
    bars = np.roll(corners, -1, axis=0) - corners
    return Linkage(corners, np.array([np.cross(bars[i - 1], bars[i]) for i in range(6)]))


BRICARD = _cube()
"""Six edges of a cube of 1 m; the sixth, from (0, 1, 0) to the origin, stands still. Gravity along -z."""


def _pose(angles: np.ndarray, linkage: Linkage) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners 0 to 6 and axes of the chain that starts with bar 0 and is rotated at corners 0 to 5, including the sixth
    bar."""
    bars = np.roll(linkage.corners, -1, axis=0) - linkage.corners
    turn = np.eye(3)
    at, points, axes = np.zeros(3), [np.zeros(3)], []
    for axis, bar, angle in zip(linkage.axes, bars, angles, strict=True):
        axes.append(turn @ axis)
        k = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
        turn = turn @ (np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k)
        at = at + turn @ bar
        points.append(at)
    return np.array(points), np.array(axes), turn


def _closing(angles: np.ndarray, linkage: Linkage) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Opening of the loop (6,), its derivative (6, 6), and the corners."""
    points, axes, turn = _pose(angles, linkage)
    spin = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    slopes = np.vstack([np.cross(axes, points[6] - points[:6]).T, axes.T])
    return np.concatenate([points[6], spin]), slopes, points


def _mass(rate: np.ndarray, angles: np.ndarray, linkage: Linkage) -> float:
    """Twice the kinetic energy of the five bars that move."""
    points, axes, _ = _pose(angles, linkage)
    total, spin, speed = 0.0, np.zeros(3), np.zeros(3)
    for i in range(5):
        spin = spin + rate[i] * axes[i]
        bar = points[i + 1] - points[i]
        centre = speed + np.cross(spin, 0.5 * bar)
        along = spin @ bar
        total += centre @ centre + (spin @ spin - along**2) / 12.0 + linkage.slender * along**2
        speed = speed + np.cross(spin, bar)
    return total


def bricard_path(step: float = 0.02, linkage: Linkage = BRICARD) -> Path:
    """Corner 3 of the linkage. The only motion of the linkage is first followed as a curve of its six angles, by the length
    of this curve."""

    def tangent(angles: np.ndarray, before: np.ndarray) -> np.ndarray:
        found = np.linalg.svd(_closing(angles, linkage)[1])[2][-1]
        return found if found @ before > 0.0 else -found

    rows = {}
    first = np.linalg.svd(_closing(np.zeros(6), linkage)[1])[2][-1]
    for sign in (1, -1):
        angles, direction = np.zeros(6), sign * first
        for k in range(round(6.0 / step) + 1):
            direction = tangent(angles, direction)
            points = _closing(angles, linkage)[2]
            height = 0.5 * (points[:5, 2] + points[1:6, 2]).sum()
            rows[sign * k] = (_mass(direction, angles, linkage), GRAVITY * height, *points[3])
            middle = tangent(angles + 0.5 * step * direction, direction)
            again = tangent(angles + 0.5 * step * middle, direction)
            last = tangent(angles + step * again, direction)
            angles = angles + step / 6.0 * (direction + 2.0 * middle + 2.0 * again + last)
            for _ in range(3):
                gap, slopes, _ = _closing(angles, linkage)
                angles = angles - np.linalg.lstsq(slopes, gap, rcond=1e-6)[0]
    numbers = sorted(rows)
    curve = CubicSpline(step * np.array(numbers), np.array([rows[k] for k in numbers]))

    def rate(t: float, y: np.ndarray) -> list[float]:
        inertia, slope = curve(y[0]), curve(y[0], 1)
        return [y[1], -(slope[1] + 0.5 * slope[0] * y[1] ** 2) / inertia[0]]

    return np.asarray(curve(_exact(rate, [0.0, 0.0], TIMES)[0])[:, 2:])


def bricard_model(linkage: Linkage = BRICARD) -> tuple[SegmentSystem, Callable[[np.ndarray], np.ndarray]]:
    """Five bars and six hinges; fsm needs no removal of the redundant hinge constraint."""
    bars = np.roll(linkage.corners, -1, axis=0) - linkage.corners
    bodies = [
        Body(
            name=f"bar {i}", mass=1.0, position=tuple(linkage.corners[i] + 0.5 * bars[i]),
            inertia=tuple(np.where(np.abs(bars[i]) > 0.5, linkage.slender, 1.0 / 12.0)),
        )
        for i in range(5)
    ]  # fmt: skip
    joints = []
    for i in range(6):
        first, second = (f"bar {i - 1}" if i else GROUND), (f"bar {i}" if i < 5 else GROUND)
        joints.append(_hinge(f"hinge {i}", first, second, linkage.corners[i], linkage.axes[i]))
    system = _compiled(bodies, joints)
    far = 0.5 * bars[2]

    def corner(q: np.ndarray) -> np.ndarray:
        w, v = q[17], q[18:21]
        return q[14:17] + far + 2.0 * np.cross(v, np.cross(v, far) + w * far)

    return system, corner
