"""The rim of a cylinder is a circle: gaps, energy and motion do not depend on its rotation about its own axis."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fsm
from fsm.interactions.shapes.shape_distance import CYLINDER, HALF_SPACE
from fsm.model.contact.shapes.shape_contacts import ShapeContacts
from fsm.model.contact.shapes.shape_tables import Shape, as_polygon, as_rectangle
from fsm.model.contact.shapes.side_contacts import SideContacts
from fsm.results.store import read_solution

RADIUS, HALF = 0.05, 0.005
SQUARE = np.array([[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]])


def on(floor: str) -> tuple[ShapeContacts, float]:
    """Contacts of a cylinder of body 1 with a floor of body 0 at z = 0, and the height of the face of the floor."""
    pair, cylinder = np.array([[0, 1]]), Shape(1, CYLINDER, (RADIUS, HALF, RADIUS))
    if floor == "plane":
        return SideContacts([cylinder, Shape(0, HALF_SPACE, (np.inf,) * 3)], pair, True, 0.1), 0.0
    thick = 1e-3
    plate = as_rectangle(0, 0.4, 0.4, thick) if floor == "plate" else as_polygon(0, SQUARE, (True,) * 4, thick)
    return SideContacts([plate, cylinder], np.array([[0, 1]]), True, 0.1), thick / 2


def turned(tilt: float, towards: float, own: float) -> np.ndarray:
    """Orientation of a cylinder whose axis has an angle from the vertical, rotated by `own` about its axis, degrees."""
    return np.asarray(Rotation.from_euler("YXZ", [own, 90.0 - tilt, towards], degrees=True).inv().as_quat(scalar_first=True))


def pose(tilt: float, towards: float, own: float, height: float) -> np.ndarray:
    out = np.zeros((2, 7))
    out[0, 3], out[1, 3:], out[1, :3] = 1.0, turned(tilt, towards, own), (0.013, 0.007, height)
    return out


@pytest.mark.parametrize("floor", ["plane", "plate", "facet"])
@pytest.mark.parametrize("tilt", [0.01, 4.0, 30.0, 89.0])
def test_the_gap_is_that_of_a_circle(floor: str, tilt: float) -> None:
    """The lowest point is R sin(tilt) + h cos(tilt) below the centre, in all rotations about the axis."""
    contacts, top = on(floor)
    angle, height = np.radians(tilt), top + 0.07
    wanted = height - top - RADIUS * np.sin(angle) - HALF * np.cos(angle)
    for own in (0.0, 10.0, 22.5, 33.0, 45.0):
        for towards in (0.0, 77.0):
            gap = contacts.find(pose(tilt, towards, own, height), 0.08).gap
            assert gap.min() == pytest.approx(wanted, abs=1e-15)


def energy_and_force(contacts: ShapeContacts, poses: np.ndarray) -> tuple[float, np.ndarray]:
    touching = contacts.find(poses, 0.0)
    gradient = contacts.measure(poses, np.zeros((2, 6)), 0.0).gradient
    share, depth = contacts.share[touching.slot], -touching.gap
    return float(np.sum(share * depth**2.5)), np.einsum("i,ij->j", 2.5 * share * depth**1.5, gradient[:, 0])


@pytest.mark.parametrize("tilt", [1e-3, 0.02, 0.3])
def test_a_cap_has_one_energy_for_all_rotations_and_its_gradient(tilt: float) -> None:
    """Some or all points of a cap have contact; forces and moments are the derivatives of their energy."""
    contacts, _ = on("plane")
    height, found = HALF + RADIUS * np.sin(np.radians(tilt)) - 5e-5, []
    for own in (0.0, 22.5, 40.0):
        poses = pose(tilt, 30.0, own, height)
        contacts.commit(poses)
        energy, force = energy_and_force(contacts, poses)
        found.append(energy)
        for k in range(6):
            step, values = 1e-8 if k >= 3 else 1e-9, []
            for sign in (-1.0, 1.0):
                moved = poses.copy()
                if k < 3:
                    moved[1, k] += sign * step
                else:
                    change = Rotation.from_rotvec(sign * step * np.eye(3)[k - 3])
                    whole = Rotation.from_quat(poses[1, 3:], scalar_first=True) * change
                    moved[1, 3:] = whole.as_quat(scalar_first=True)
                values.append(energy_and_force(contacts, moved)[0])
            numeric = (values[1] - values[0]) / (2.0 * step)
            assert force[k] == pytest.approx(-numeric, abs=1e-5 * np.abs(force).max())
    assert found == pytest.approx([found[0]] * 3, rel=1e-9)


def test_an_euler_disc_keeps_its_angle(tmp_path: Path) -> None:
    """Steady precession without friction: Omega^2 = 4 g/(R sin(alpha)) with the centre at rest."""
    radius, half, alpha, mass = 0.0375, 1e-4, np.radians(20.0), 0.1
    omega = np.sqrt(4.0 * 9.81 / (radius * np.sin(alpha)))
    along, across = 0.25 * mass * radius**2, 0.5 * mass * radius**2
    case: dict[str, Any] = {
        "gravity": [0.0, 0.0, -9.81],
        "contact": {"law": "linear", "stiffness": 2e6, "ramp": 1e-7},
        "scene": {
            "bodies": [{
                "name": "disc", "mass": mass, "inertia": [along, across, along],
                "position": [0.0, 0.0, radius * np.sin(alpha) + half * np.cos(alpha)],
                "orientation": turned(20.0, 0.0, 0.0).tolist(),
            }],
            "pairs": [{"first": "rim", "second": "table"}],
        },
        "obstacle": [
            {"name": "rim", "shape": "cylinder", "radius": radius, "length": 2.0 * half, "body": "disc"},
            {"name": "table", "shape": "plane"},
        ],
        "solve": {"end_time": 0.2, "rtol": 1e-5, "spatial": True},
        "save": {"interval": 0.005},
    }  # fmt: skip
    # without friction the disc spins about the diameter through the contact point only
    frame = Rotation.from_quat(case["scene"]["bodies"][0]["orientation"], scalar_first=True)
    up = frame.inv().apply([0.0, 0.0, 1.0])
    diameter = np.array([up[0], 0.0, up[2]]) / np.hypot(up[0], up[2])
    case["scene"]["bodies"][0]["angular_velocity"] = (omega * np.sin(alpha) * diameter).tolist()
    fsm.load(case, folder=tmp_path).run(tmp_path, figures=False)
    q = read_solution(tmp_path / "result.h5").q
    axis = Rotation.from_quat(q[:, 3:7], scalar_first=True).apply([0.0, 1.0, 0.0])
    tilt = np.degrees(np.arccos(np.abs(axis[:, 2])))
    assert np.abs(tilt - 20.0).max() < 0.05
    assert np.ptp(np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))) == pytest.approx(0.2 * omega, rel=0.01)
