"""Ideal joints on beams, films and cables: frequencies, deflections and motions against closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import fsm
from fsm.errors import CaseError
from validation.flexible_wing.check import bending_frequencies

_E, _RHO, _W, _T = 70e9, 2700.0, 0.02, 5e-3
_EI, _LINE_MASS = _E * _W * _T**3 / 12.0, _RHO * _W * _T


def beam(**keys: Any) -> dict[str, Any]:
    own = {"name": "beam", "start": [0.0, 0.0, 0.0], "end": [1.0, 0.0, 0.0], "width": _W, "thickness": _T}
    return own | {"young": _E, "density": _RHO, "elements": 8} | keys


def film(**keys: Any) -> dict[str, Any]:
    own = {"name": "film", "position": [0.5, 0.0, 0.0], "length": 1.0, "width": 0.2, "thickness": _T, "mesh": [8, 2]}
    return own | {"young": _E, "poisson": 0.0, "density": _RHO} | keys


def hinge(name: str, first: str, second: str, x: float, **keys: Any) -> dict[str, Any]:
    kind = {"name": name, "kind": "revolute", "axis": [0.0, 1.0, 0.0], "at": [x, 0.0, 0.0]}
    return kind | {"first": first, "second": second} | keys


def case(joints: list[dict[str, Any]], solve: dict[str, Any] | None = None, **keys: Any) -> dict[str, Any]:
    own = {name: keys.pop(name) for name in list(keys) if name in ("step", "load", "save", "report")}
    return {
        "units": "SI", "scene": {"joints": joints, **keys}, "solve": {"error_estimates": "off"} | (solve or {}), **own,
    }  # fmt: skip


@pytest.mark.parametrize("part", ["beam", "film"])
def test_pinned_part_vibrates_as_an_euler_bernoulli_beam(part: str, tmp_path: Path) -> None:
    """f = (n pi)^2/(2 pi L^2) sqrt(EI/(rho A)), with one joint at each end or edge."""
    ends = ("start", "end") if part == "beam" else ("left", "right")
    joints = [hinge(end, "ground", f"{part}.{end}", x) for x, end in enumerate(ends)]
    parts = {"beams": [beam()]} if part == "beam" else {"films": [film()]}
    result = fsm.load(case(joints, step=[{"kind": "modes", "modes": 1}], **parts)).run(tmp_path, figures=False)
    wanted = 0.5 * math.pi * math.sqrt(_EI / _LINE_MASS)
    found = result.summary["step"][0]["frequencies_hz"][0]
    assert found == pytest.approx(wanted, rel=1e-3)


def deflected_tip(force: float, spring: float) -> tuple[float, float]:
    """Tip (x, z) of an inextensible beam of length 1 with the slope -F.../k at a torsion spring, under a force along -z.

    EI theta'' = F cos(theta), EI theta'(0) = k theta(0), theta'(1) = 0; theta is the angle below x.
    """

    def shot(start: float) -> np.ndarray:
        def rate(_: float, y: np.ndarray) -> list[float]:
            return [y[1], -force * math.cos(y[0]) / _EI, math.cos(y[0]), -math.sin(y[0])]

        return solve_ivp(rate, (0.0, 1.0), [start, spring * start / _EI, 0.0, 0.0], rtol=1e-11, atol=1e-13).y[:, -1]

    start = brentq(lambda angle: shot(angle)[1], 0.0, 1.4, xtol=1e-14)
    _, _, x, z = shot(start)
    return float(x), float(z)


@pytest.mark.parametrize("part", ["beam", "film"])
def test_tip_on_a_sprung_hinge_is_that_of_the_elastica(part: str, tmp_path: Path) -> None:
    force, spring = 15.0, 40.0
    root, tip = ("start", "end") if part == "beam" else ("left", "right")
    joint = hinge("root", "ground", f"{part}.{root}", 0.0, spring={"stiffness": spring, "rest": 0.0})
    parts = {"beams": [beam(elements=16)]} if part == "beam" else {"films": [film(width=_W, mesh=[16, 1])]}
    frames = [{"name": "tip", "on": part} | ({"at": [1.0]} if part == "beam" else {"edge": tip})]
    load = [{"body": "tip", "force": [0.0, 0.0, -force], "time": {"kind": "ramp", "end": 1.0}}]
    save = {"points": {"tip": {"body": "tip"}}, "channels": ["point.tip.position", "joint.root*"]}
    given = case([joint], step=[{"kind": "static", "duration": 1.0}], load=load, save=save, frames=frames, **parts)
    result = fsm.load(given).run(tmp_path, figures=False)
    found = result["point.tip.position"].values[-1]
    assert found[[0, 2]] == pytest.approx(deflected_tip(force, spring), abs=2e-5)
    assert result["joint.root.force"].values[-1] == pytest.approx([0.0, 0.0, force], abs=1e-6 * force)
    assert spring * result["joint.root.angle"].values[-1] == pytest.approx(force * found[0], rel=1e-6)


def test_heavy_beam_swings_as_a_rod(tmp_path: Path) -> None:
    """A pendulum from rest along x: the angle by quadrature, and the reaction 5/2 m g at the bottom."""
    stiff = beam(young=20e9, density=1000.0, thickness=_W, elements=2)
    save = {"interval": 0.05, "channels": ["joint.root*"]}
    joint, weight = hinge("root", "ground", "beam.start", 0.0), 1000.0 * _W**2 * 9.81
    given = case([joint], {"end_time": 0.5}, save=save, beams=[stiff], gravity=[0.0, 0.0, -9.81])
    result = fsm.load(given).run(tmp_path, figures=False)
    t, angle = result.solution.time, result["joint.root.angle"].values
    found = solve_ivp(
        lambda _, y: [y[1], 1.5 * 9.81 * math.cos(y[0])], (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-10, atol=1e-12
    )
    assert angle == pytest.approx(found.y[0], abs=2e-3)
    force = np.linalg.norm(result["joint.root.force"].values[-1])  # after the first vibrations, near the bottom
    assert force == pytest.approx(weight * math.hypot(2.5 * math.sin(angle[-1]), 0.25 * math.cos(angle[-1])), rel=0.02)
    assert np.abs(result["joint.root.position"].values).max() < 1e-9
    assert result.summary["energy_error"] < 1e-3


_PANEL = {"panels": 2, "length": 0.8, "width": 1.6, "thickness": 0.01, "mass": 3.5, "gap": 1e-3}


@pytest.mark.parametrize(("kind", "mesh", "within"), [("beam", [4, 1], 1e-4), ("film", [4, 6], 5e-3)])
def test_deployed_wing_vibrates_as_beams_on_springs(kind: str, mesh: list[int], within: float, tmp_path: Path) -> None:
    flexible = {"kind": kind, "young": 5e9, "mesh": mesh, "poisson": 0.0}
    keys = {"stowed": [0.0, 0.0], "hinge": {"spring": {"stiffness": 1e3, "rest": 0.0}}, "flexible": flexible}
    given = {"units": "SI", "wing": _PANEL | keys, "step": [{"kind": "modes", "modes": 1}]}
    found = fsm.load(given).run(tmp_path, figures=False).summary["step"][0]["frequencies_hz"][0]
    assert found == pytest.approx(bending_frequencies(5e9)[0], rel=within)


def test_stiff_panels_unfold_and_latch_as_rigid_ones(tmp_path: Path) -> None:
    """Differences of angles are proportional to 1/E; energy is accounted for in the impacts of latches and stops."""
    hinge_keys = {
        "spring": {"stiffness": 0.1, "rest": -0.5 * math.pi}, "damper": {"coefficient": 0.4},
        "stop": {"lower": 0.0, "stiffness": 1e3, "damping": 10.0}, "latch": {"at": 0.0, "stiffness": 1e3, "damping": 10.0},
    }  # fmt: skip
    found = {}
    for young in (0.0, 5e8, 5e9):
        keys = {"hinge": hinge_keys} | ({"flexible": {"young": young, "mesh": [2, 1]}} if young else {})
        given = {
            "units": "SI", "wing": _PANEL | keys, "solve": {"end_time": 4.9, "error_estimates": "off"},
            "save": {"interval": 0.1, "channels": ["joint.*"]},
        }  # fmt: skip
        found[young] = fsm.load(given).run(tmp_path / str(young), figures=False)
    before = found[0.0].solution.time < 4.5
    angles = {young: result["joint.hinge 2.angle"].values[before] for young, result in found.items()}
    soft, stiff = (np.abs(angles[young] - angles[0.0]).max() for young in (5e8, 5e9))
    assert stiff < 1e-3 and 0.7 < math.log10(soft / stiff) < 1.3
    latches = {young: result.summary["joint_events"][0] for young, result in found.items()}
    assert latches[5e9]["what"] == "latch closes" and latches[5e9]["joint"] == "hinge 2"
    assert latches[5e9]["time"] == pytest.approx(latches[0.0]["time"], abs=1e-3)
    assert latches[5e9]["rate_before"] == pytest.approx(latches[0.0]["rate_before"], rel=1e-2)
    assert max(result.summary["energy_error"] for result in found.values()) < 1e-3


def sheet_case(**joint: Any) -> dict[str, Any]:
    keys = {"name": "j", "kind": "spherical", "first": "ground", "second": "corner", "at": [0.0, 0.0, 0.0]} | joint
    bar = {"name": "t", "points": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], "bars": [[0, 1]], "stiffness": [1e4]}
    frame = {"name": "corner", "on": "t", "point": 0}
    return case([keys], {"end_time": 1.0}, trusses=[bar | {"mass": [1.0, 1.0]}], frames=[frame])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (sheet_case(kind="revolute", axis=[0.0, 1.0, 0.0]), "is a point without axes, which carries no moment; use kind"),
        (sheet_case(at=[0.1, 0.0, 0.0]), "`at` is 0.1 m off it|`at` is 100 mm off it"),
        (
            case([hinge("j", "ground", "beam.middle", 0.0)], {"end_time": 1.0}, beams=[beam()]),
            "no body is called 'beam.middle'",
        ),
        (
            case([hinge("j", "ground", "beam.end", 1.0)], {"end_time": 1.0, "method": "Radau"}, beams=[beam()]),
            '"Radau" is for bodies, joints and springs; the scene has films',
        ),
        (
            case(
                [], {"end_time": 1.0}, films=[film()],
                frames=[{"name": "f", "on": "film", "edge": "left", "at": [0.0, 0.0]}],
            ),
            "a frame on an `edge` has no `at`",
        ),
        (
            {"units": "SI", "wing": _PANEL | {"flexible": {"young": 1e9}, "hinge_axis": [0.0, 0.0, 1.0]}},
            'beams bend in the x-z plane; give hinge_axis = \\[0, 1, 0\\], or flexible.kind = "film"',
        ),
    ],
    ids=["moment on a point", "off a point", "no such end", "a reference", "edge and point", "beams across"],
)  # fmt: skip
def test_wrong_uses_are_refused(given: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=said):
        fsm.load(given).run(tmp_path, figures=False)


def test_check_names_joints_that_repeat_others_beside_flexible_parts() -> None:
    """A hinge on the end of a beam repeats nothing by itself; the same hinge again repeats all five directions."""
    once = [hinge("one", "ground", "beam.start", 0.0)]
    for joints, repeated in ((once, "0"), ([*once, hinge("again", "ground", "beam.start", 0.0)], "5")):
        lines = fsm.load(case(joints, {"end_time": 1.0}, beams=[beam()])).check().lines
        (line,) = [line for line in lines if "however the flexible parts deform" in line]
        assert f"{5 * len(joints)} locked directions at the start; {repeated} of them" in line
        assert ("again (along e1)" in line) == (repeated == "5")
