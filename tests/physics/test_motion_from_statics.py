"""Transition from statics to motion with inertia: energy that was given to the motion is work, not an error of the energy
balance."""

from __future__ import annotations

import math
from pathlib import Path

from fsm.analyses.deploy import Deployment
from fsm.case.loading.load_case import read_case
from fsm.solve.settings import Settings
from fsm.solve.statics.static import follow

OPENING = [math.radians(x) for x in range(-30, 181, 10)]
MOMENT = [
    -7.6654e-08, -5.2832e-08, -2.6974e-08, 0.0, 2.6974e-08, 5.2832e-08, 7.6654e-08,
    9.7839e-08, 1.1614e-07, 1.3159e-07, 1.4445e-07, 1.5507e-07, 1.6383e-07, 1.711e-07,
    1.772e-07, 1.8239e-07, 1.8689e-07, 1.9087e-07, 1.9446e-07, 1.9776e-07, 2.0084e-07,
    2.0376e-07,
]  # fmt: skip
CASE = {
    "strip": {
        "length": 0.17966825786751323, "width": 0.025871247371529103, "thickness": 2.889738894081611e-05, "panels": 7,
        "fold_angle": 1.257698851226408, "held": [1], "segments_per_panel": 20,
    },
    "material": {"young": 569269114.207501, "poisson": 0.23695903229736973, "density": 978.5934609198516},
    "crease": {
        "law": "spline", "interpolation": "pchip", "angle": OPENING, "moment": MOMENT,
    },
    "load": [
        {
            "body": "panel 7 segment 20", "force": [4.166780902701369e-06, 0.0, -8.410526524070256e-07],
            "time": {"kind": "ramp", "end": 9.108391650962057},
        },
    ],
    "solve": {"end_time": 9.108391650962057, "method": "static"},
}  # fmt: skip


def test_a_limp_strip_that_a_force_sets_going() -> None:
    """The kinetic energy is forty times the energy turned over before; the earlier balance had this error, and motions ended
    immediately."""
    case, faults = read_case(CASE, Path())
    assert case is not None, faults
    deployment = Deployment(case, "", None)
    settings = deployment.settings("static")
    assert not isinstance(settings, Settings)
    statistics, energy_balance = follow(deployment.system, settings, [], lambda saved: None)
    assert "motion" in [event.kind for event in statistics.events]
    assert energy_balance.relative_error < 1e-2


ANGLES = [math.radians(120.0 * k / 27.0) for k in range(28)]
DEPLOYED = {
    "stages": ["deploy", "vibrate"],
    "strip": {
        "length": 0.06, "width": 0.008, "thickness": 3e-5, "panels": 4, "fold_angle": math.radians(60.0), "held": [1],
        "segments_per_panel": 20,
    },
    "material": {"young": 193e9, "poisson": 0.3, "density": 7850.0},
    "crease": {"law": "spline", "angle": ANGLES, "moment": [2.422e-5 * x / (1.0 + 1.2776 * x) for x in ANGLES]},
    "drive": [{"crease": 3, "direction": [1, 0, 0], "speed": 2e-3, "travel": 15.0031e-3}],
    "damping": {"air": 2.0},
}  # fmt: skip


def test_a_motion_that_goes_on_keeps_its_velocities() -> None:
    """A strip snaps straight as it is pulled taut, and statics fails to continue before the strip has come to rest.

    At each restart the velocities were again balanced with the dampers, which added energy.
    """
    case, faults = read_case(DEPLOYED, Path())
    assert case is not None, faults
    deployment = Deployment(case, "", None)
    settings = deployment.settings("static")
    assert not isinstance(settings, Settings)
    _, energy_balance = follow(deployment.system, settings, [], lambda saved: None)
    assert energy_balance.relative_error < 1e-2
