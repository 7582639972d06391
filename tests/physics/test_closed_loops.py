"""Mechanisms of one degree of freedom with closed loops against a second formulation.

The places of all bodies are closed forms of the angle x of the crank. With the inertia M(x) and the potential energy V(x),
trigonometric series, the motion is M x'' + M' x'^2/2 + V' = 0, which is integrated to 1e-11.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import fsm

_G = 9.81
_STEP = 2e-3
_WEIGHTS = (0.75, -0.15, 1.0 / 60.0)


class Link(NamedTuple):
    """Body of a mechanism: mass (kg), moments of inertia (kg m^2), and its place (m) and axes at an angle of the crank."""

    mass: float
    inertia: tuple[float, float, float]
    at: Callable[[float], tuple[np.ndarray, np.ndarray]]


def slope(of: Callable[[float], Any], x: float) -> Any:
    return sum(w * (of(x + k * _STEP) - of(x - k * _STEP)) for k, w in enumerate(_WEIGHTS, start=1)) / _STEP


def rates(link: Link, x: float) -> tuple[np.ndarray, np.ndarray]:
    """Velocity, and angular velocity in body axes, for x' = 1."""
    turned, spin = link.at(x)[1], slope(lambda y: link.at(y)[1], x)
    skew = turned.T @ spin
    return slope(lambda y: link.at(y)[0], x), np.array([skew[2, 1], skew[0, 2], skew[1, 0]])


def periodic(of: Callable[[float], float], points: int = 128) -> Callable[[float], tuple[float, float]]:
    """Trigonometric interpolation of a function of an angle, and its derivative."""
    parts = np.fft.rfft([of(2.0 * math.pi * k / points) for k in range(points)])[:-1] / points
    parts[1:] *= 2.0
    orders = np.arange(len(parts))

    def value(x: float) -> tuple[float, float]:
        waves = parts * np.exp(1j * orders * x)
        return float(waves.sum().real), float((1j * orders * waves).sum().real)

    return value


def exact(links: dict[str, Link], x: float, speed: float, times: np.ndarray) -> np.ndarray:
    """Angle of the crank (m,) at given times, from x and x' at the start."""

    def inertia(y: float) -> float:
        total = 0.0
        for link in links.values():
            v, w = rates(link, y)
            total += link.mass * float(v @ v) + float(np.array(link.inertia) @ w**2)
        return total

    mass = periodic(inertia)
    energy = periodic(lambda y: sum(_G * link.mass * float(link.at(y)[0][2]) for link in links.values()))

    def rate(_: float, y: np.ndarray) -> list[float]:
        m, by_angle = mass(y[0])
        return [y[1], -(0.5 * by_angle * y[1] ** 2 + energy(y[0])[1]) / m]

    found = solve_ivp(rate, (0.0, times[-1]), [x, speed], "DOP853", times, rtol=1e-11, atol=1e-12)
    return np.asarray(found.y[0])


def mechanism(links: dict[str, Link], x: float, speed: float, joints: list[dict[str, Any]], end: float) -> dict[str, Any]:
    bodies = []
    for name, link in links.items():
        place, turned = link.at(x)
        v, w = rates(link, x)
        bodies.append({
            "name": name, "mass": link.mass, "inertia": list(link.inertia), "position": place.tolist(),
            "orientation": Rotation.from_matrix(turned).as_quat(scalar_first=True).tolist(),
            "velocity": (speed * v).tolist(), "angular_velocity": (speed * w).tolist(),
        })  # fmt: skip
    return {
        "units": "SI", "gravity": [0.0, 0.0, -_G], "scene": {"bodies": bodies, "joints": joints},
        "solve": {"end_time": end, "error_estimates": "off"}, "save": {"interval": end / 10.0, "channels": ["joint.*"]},
    }  # fmt: skip


def joint(name: str, kind: str, first: str, second: str, at: np.ndarray, **keys: Any) -> dict[str, Any]:
    return {"name": name, "kind": kind, "first": first, "second": second, "at": at.tolist()} | keys


def axes(first: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Axes whose first one is along a vector, and whose second one is at a right angle to it and to another vector."""
    e1 = first / np.linalg.norm(first)
    e2 = np.cross(across, e1)
    e2 = e2 / np.linalg.norm(e2)
    return np.column_stack([e1, e2, np.cross(e1, e2)])


def test_spatial_slider_crank(tmp_path: Path) -> None:
    """The spatial slider-crank of Haug (1989), also of the IFToMM library: a crank of 80 mm about x, a rod of 300 mm on a
    ball and on a universal joint, and a slider along x.
    """
    pivot, x, y = np.array([0.0, 0.1, 0.12]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])

    def end(angle: float) -> np.ndarray:
        return pivot + 0.08 * np.array([0.0, -math.sin(angle), math.cos(angle)])

    def slider(angle: float) -> np.ndarray:
        return math.sqrt(0.3**2 - float(end(angle)[1:] @ end(angle)[1:])) * x

    def rod(angle: float) -> tuple[np.ndarray, np.ndarray]:
        return 0.5 * (end(angle) + slider(angle)), axes(end(angle) - slider(angle), y)

    links = {
        "crank": Link(0.12, (1e-4, 1e-4, 1e-5), lambda a: (0.5 * (pivot + end(a)), axes(x, pivot - end(a)))),
        "rod": Link(0.5, (4e-4, 4e-3, 4e-3), rod),
        "slider": Link(2.0, (1e-4, 1e-4, 1e-4), lambda a: (slider(a), np.eye(3))),
    }
    joints = [
        joint("bearing", "revolute", "ground", "crank", pivot, axis=x.tolist()),
        joint("ball", "spherical", "crank", "rod", end(0.0)),
        joint("cross", "universal", "slider", "rod", slider(0.0), axis=y.tolist(), second_axis=rod(0.0)[1][:, 1].tolist()),
        joint("guide", "prismatic", "ground", "slider", slider(0.0), axis=x.tolist()),
    ]
    result = fsm.load(mechanism(links, 0.0, 6.0, joints, 1.5)).run(tmp_path, figures=False)
    angles = exact(links, 0.0, 6.0, result.time)
    assert np.ptp(angles) > 2.0 * math.pi
    assert result["joint.bearing.angle"].values == pytest.approx(angles, abs=1e-6)
    moved = [slider(a)[0] - slider(0.0)[0] for a in angles]
    assert result["joint.guide.displacement"].values == pytest.approx(np.array(moved), abs=1e-7)
    assert not result.summary["warnings"]


def meet(first: np.ndarray, reach: float, second: np.ndarray, other: float) -> np.ndarray:
    """Upper point at two distances from two points, in the plane of x and z."""
    way = second - first
    far = float(np.linalg.norm(way))
    along = (reach**2 - other**2 + far**2) / (2.0 * far)
    up = math.sqrt(reach**2 - along**2)
    return first + along / far * way + up / far * np.array([-way[2], 0.0, way[0]])


def test_six_bar(tmp_path: Path) -> None:
    """Watt's six-bar: a four-bar ABCD whose rocker DC carries E beyond C; EF joins it to the lever GF."""
    a, d, g = (np.array(p) for p in ([0.0, 0.0, 0.0], [0.8, 0.0, 0.0], [1.5, 0.0, 0.0]))
    y = np.array([0.0, 1.0, 0.0])

    def b(x: float) -> np.ndarray:
        return a + 0.2 * np.array([math.cos(x), 0.0, -math.sin(x)])

    def c(x: float) -> np.ndarray:
        return meet(b(x), 0.7, d, 0.5)

    def e(x: float) -> np.ndarray:
        return d + 1.3 * (c(x) - d)

    def f(x: float) -> np.ndarray:
        return meet(e(x), 0.9, g, 0.8)

    def bar(mass: float, size: float, start: Callable[[float], np.ndarray], end: Callable[[float], np.ndarray]) -> Link:
        turns = mass * size**2 / 12.0
        return Link(
            mass,
            (1e-4, turns, turns),
            lambda x: (0.5 * (start(x) + end(x)), axes(end(x) - start(x), -np.cross(y, end(x) - start(x)))),
        )

    links = {
        "crank": bar(1.0, 0.2, lambda x: a, b), "coupler": bar(2.0, 0.7, b, c), "rocker": bar(2.0, 0.65, lambda x: d, e),
        "link": bar(1.5, 0.9, e, f), "lever": bar(1.2, 0.8, lambda x: g, f),
    }  # fmt: skip
    pins = [("ground", "crank", a), ("crank", "coupler", b(0.3)), ("coupler", "rocker", c(0.3)), ("ground", "rocker", d),
            ("rocker", "link", e(0.3)), ("link", "lever", f(0.3)), ("ground", "lever", g)]  # fmt: skip
    joints = [joint(f"pin {k}", "revolute", *pin, axis=y.tolist()) for k, pin in enumerate(pins)]
    result = fsm.load(mechanism(links, 0.3, 12.0, joints, 1.0)).run(tmp_path, figures=False)
    angles = exact(links, 0.3, 12.0, result.time)
    assert np.ptp(angles) > 2.0 * math.pi
    assert result["joint.pin 0.angle"].values == pytest.approx(angles - 0.3, abs=1e-6)
    assert not result.summary["warnings"]
