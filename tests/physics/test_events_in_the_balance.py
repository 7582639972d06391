"""Energy balance at events where forces jump: a step up to an event has the forces before it, the next step those after it.

Newmark's method conserves the energy of linear systems. Its balance therefore shows what is lost at the events.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.physics.test_ideal_joints import body, joint, mechanism, of, run


def balance(case: dict[str, Any], folder: Path) -> tuple[float, Any]:
    case["solve"] |= {"method": "newmark", "rtol": 1e-6}
    result = run(case, folder)
    return float(result.summary["energy_error"]), result


def test_a_damped_stop(tmp_path: Path) -> None:
    """A block on a spring hits a damped stop at its largest speed; the closed form is that of two damped vibrations."""
    k, c, stiffness = 40.0, 4.0, 400.0
    slide = joint("slide", "prismatic", "ground", "block", [0, 0, 0], axis=[1, 0, 0])
    slide |= {"spring": {"stiffness": k, "rest": 0.1}, "stop": {"upper": 0.1, "stiffness": stiffness, "damping": c}}
    error, result = balance(mechanism([body("block", [0, 0, 0], [0.1] * 3)], [slide], 0.4, 0.005), tmp_path)
    start = 0.5 * math.pi / math.sqrt(k)
    rate, decay = 0.1 * math.sqrt(k), 0.5 * c
    omega = math.sqrt(stiffness + k - decay**2)
    later = result.solution.time - start
    beyond = rate / omega * np.exp(-decay * later) * np.sin(omega * later)
    within = (later > 0.0) & (omega * later < 2.0)
    assert of(result, "joint.slide.displacement")[within] - 0.1 == pytest.approx(beyond[within], abs=1e-5)
    assert error < 2e-7
    assert of(result, "energy.numerical")[-1] == pytest.approx(0.0, abs=1e-8)  # nothing is lost at the event itself


def test_a_spool_that_stops_and_a_cord_that_becomes_taut(tmp_path: Path) -> None:
    """A weight on a damped cord is let down faster than it falls, until the spool stops; the cord jerks taut later."""
    reel = {"reel": 0.2, "time": {"kind": "table", "time": [0.0, 0.1, 1.0], "value": [0.0, 1.0, 1.0]}}
    line = {"name": "c", "first": "ground", "second": "ball", "at": [0, 0, 1], "to": [0, 0, 0], "stiffness": 4e3}
    case = mechanism([body("ball", [0, 0, 0], [0.1] * 3)], [], 0.4, 0.01, cords=[line | reel | {"damping": 60.0}])
    error, result = balance(case, tmp_path)
    force = of(result, "cord.c.force")
    assert not force[2:20].any() and force.max() > 60.0
    assert error < 2e-7
