"""Wings of hinged panels against minimal coordinates, quadrature and closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import quad, solve_ivp
from scipy.spatial.transform import Rotation

import fsm
from fsm.builders.scene import build_scene
from fsm.cli.command_line import cli
from fsm.errors import CaseError

_L, _W, _T, _GAP, _MASS = 0.8, 1.5, 0.02, 0.05, 3.0
_INERTIA = _MASS * (_L**2 + _T**2) / 12.0
_SPRING, _DAMPER = {"stiffness": 0.4, "rest": -1.0}, {"coefficient": 0.15}


def wing(panels: int, hinge: dict[str, Any], end: float, every: float = 0.1, **keys: Any) -> dict[str, Any]:
    size = {"length": _L, "width": _W, "thickness": _T, "mass": _MASS, "gap": _GAP}
    return {
        "units": "SI", "wing": {"panels": panels, **size, "hinge": hinge, **keys},
        "solve": {"end_time": end, "error_estimates": "off"}, "save": {"interval": every, "channels": ["joint.*.rate"]},
    }  # fmt: skip


def two_panels(t: np.ndarray, stiffness: tuple[float, float]) -> np.ndarray:
    """Angles of both hinges, (2, n), by Lagrange's equations of the directions of the panels, as complex numbers x - i z."""
    offset = -0.5j * _GAP
    b, a = _L - offset, 0.5 * _L + offset  # from the base to hinge 2, from there to the middle of panel 2

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        (phi, psi), (u, v) = y[:2], y[2:]
        angle, speed = np.array([-phi, psi - phi]), np.array([-u, v - u])
        first, second = -np.array(stiffness) * (angle - _SPRING["rest"]) - _DAMPER["coefficient"] * speed
        coupling = _MASS * b * np.conj(a) * np.exp(1j * (phi - psi))
        mass = np.array([
            [_INERTIA + 0.25 * _MASS * _L**2 + _MASS * abs(b) ** 2, coupling.real],
            [coupling.real, _INERTIA + _MASS * abs(a) ** 2],
        ])  # fmt: skip
        loads = np.array([-first - second - coupling.imag * v * v, second + coupling.imag * u * u])
        return np.array([u, v, *np.linalg.solve(mass, loads)])

    start = [-0.5 * math.pi, 0.5 * math.pi, 0.0, 0.0]
    found = solve_ivp(rate, (0.0, t[-1]), start, method="DOP853", t_eval=t, rtol=1e-12, atol=1e-12).y
    return np.array([-found[0], found[1] - found[0]])


@pytest.mark.parametrize("failed", [(), ("spring 2",)], ids=["all springs", "one spring failed"])
def test_two_panels_move_as_in_minimal_coordinates(failed: tuple[str, ...], tmp_path: Path) -> None:
    case = wing(2, {"spring": _SPRING, "damper": _DAMPER}, 2.0, failed=list(failed))
    result = fsm.load(case).run(tmp_path)
    angles = np.array([result[f"joint.hinge {k}.angle"].values for k in (1, 2)])
    stiffness = _SPRING["stiffness"]
    expected = two_panels(result.solution.time, (stiffness, 0.0 if failed else stiffness))
    assert angles == pytest.approx(expected, abs=1e-6 * math.pi)
    assert np.ptp(expected[1]) > 0.5 and len(result.summary["report"]) == 2


def synchronised(panels: int, t: np.ndarray, springs: int) -> np.ndarray:
    """Part of the stowed angles that is left, (n,), by Lagrange's equation of this one coordinate."""
    stowed = np.array([0.5 * math.pi, *[math.pi] * (panels - 1)])

    def inertia(part: float) -> float:
        point, moved, total = 0j, 0j, 0.0
        for number in range(panels):  # directions of the panels are -1, 1, -1, ... times a right angle times the part
            sense = (-1.0) ** (number + 1) * 0.5 * math.pi
            side = 0.0 if number == 0 else 0.5j * sense / abs(sense) * _GAP
            turned, far = np.exp(1j * sense * part), 0.5j * -sense / abs(sense) * _GAP
            centre = turned * (0.5 * _L - side)
            point, moved = point + centre, moved + 1j * sense * centre
            total += _MASS * abs(moved) ** 2 + _INERTIA * sense**2
            rest = turned * (0.5 * _L + far)
            point, moved = point + rest, moved + 1j * sense * rest
        return total

    def rate(_: float, y: np.ndarray) -> list[float]:
        part, speed = y
        slope = (inertia(part + 1e-5) - inertia(part - 1e-5)) / 2e-5
        angle = stowed * part
        efforts = -_DAMPER["coefficient"] * stowed * speed
        efforts[:springs] -= _SPRING["stiffness"] * (angle[:springs] - _SPRING["rest"])
        return [speed, (stowed @ efforts - 0.5 * slope * speed**2) / inertia(part)]

    return solve_ivp(rate, (0.0, t[-1]), [1.0, 0.0], method="DOP853", t_eval=t, rtol=1e-11, atol=1e-12).y[0]


@pytest.mark.parametrize("failed", [(), ("spring 6",)], ids=["all springs", "one spring failed"])
def test_six_panels_with_a_cable_move_as_one(failed: tuple[str, ...], tmp_path: Path) -> None:
    case = wing(6, {"spring": _SPRING, "damper": _DAMPER}, 5.0, 0.2, synchronisation="cable", failed=list(failed))
    result = fsm.load(case).run(tmp_path)
    angles = np.array([result[f"joint.hinge {k}.angle"].values for k in range(1, 7)])
    expected = synchronised(6, result.solution.time, 5 if failed else 6)
    assert angles[0] == pytest.approx(0.5 * math.pi * expected, abs=1e-6 * math.pi)
    assert angles[1:] == pytest.approx(np.tile(2.0 * angles[0], (5, 1)), abs=1e-9)
    assert expected[-1] < 0.5


def test_cables_have_the_ratios_of_the_stowed_angles() -> None:
    yoke, stowed = {"length": 0.4, "mass": 1.0}, [1.5, 3.0, 2.0]
    keys = {"yoke": yoke, "stowed": stowed, "synchronisation": "cable", "failed": ["cable 2"]}
    scene = build_scene(fsm.load(wing(2, {}, 1.0, cable={"stiffness": "40 N m/rad"}, **keys)).model)
    (cable,) = scene.couplings
    assert cable.joints == ("root", "hinge 1") and cable.parameters["ratio"] == 0.5
    assert cable.parameters["stiffness"] == 40.0 and not cable.ideal


@pytest.mark.parametrize("stiffness", [0.0, 1.2], ids=["momentum", "spring"])
def test_a_panel_latches_by_momentum_or_by_its_spring(stiffness: float, tmp_path: Path) -> None:
    """Time by quadrature, rate before the latch, impulse of the stop, and largest moment."""
    inertia, hold, begin = _INERTIA + 0.25 * _MASS * _L**2, 400.0, 0.5 * math.pi
    pace = 0.0 if stiffness else 0.8
    hinge = {"latch": {"at": 0.0, "stiffness": hold}, "stop": {"lower": 0.0, "stiffness": hold}}
    hinge |= {"spring": {"stiffness": stiffness, "rest": 0.0}} if stiffness else {}
    case = wing(1, hinge, 1.5 if stiffness else 2.3, 5e-3)
    if pace:  # the panel is thrown: its body has a velocity
        body = build_scene(fsm.load(case).model).bodies[0]
        turning = {"angular_velocity": [0.0, pace, 0.0], "velocity": [pace * body.position[2], 0.0, 0.0]}
        scene = fsm.load(case).model.scene.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
        scene["bodies"] = [scene["bodies"][0] | turning]
        case = {name: value for name, value in case.items() if name != "wing"} | {"scene": scene}
    result = fsm.load(case).run(tmp_path)
    time, angle = result.solution.time, np.asarray(result["joint.hinge 1.angle"].values)
    rate, closed = (np.asarray(result[f"joint.hinge 1.{name}"].values) for name in ("rate", "latched"))

    def speed(at: float) -> float:
        return math.sqrt(pace**2 + stiffness * (begin**2 - at**2) / inertia)

    if stiffness:  # the substitution of the sine removes the pole of the integrand at the start
        reached = quad(lambda x: begin * math.cos(x) / speed(begin * math.sin(x)), 0.0, 0.5 * math.pi - 1e-9)[0]
    else:
        reached = begin / pace
    held, (latch, hit) = math.sqrt((hold + stiffness) / inertia), result.summary["joint_events"][:2]
    assert (latch["what"], hit["what"]) == ("latch closes", "stop is hit")
    assert latch["time"] == pytest.approx(reached, rel=1e-6) and latch["rate_before"] == pytest.approx(-speed(0.0), rel=1e-5)
    turned_back = 2.0 * inertia * speed(0.0) * hold / (hold + stiffness)  # of the momentum, half a swing on stop and spring
    assert hit["impulse"] == pytest.approx(turned_back, rel=2e-3)
    assert latch["largest"] == pytest.approx(hold * speed(0.0) / held, rel=2e-3)  # at the steps
    first = int(np.flatnonzero(closed)[0])
    assert time[first - 1] <= reached <= time[first]
    beyond = rate[first + 1] ** 2 + (held * angle[first + 1]) ** 2
    assert math.sqrt(beyond) == pytest.approx(speed(0.0), rel=1e-5)  # elastic latch: a harmonic motion


def test_parts_meet_at_their_hinges_in_any_direction() -> None:
    """Bodies and joints of a stowed wing, turned back one after the other, are those of the deployed wing in a row."""
    turned = Rotation.from_rotvec([0.3, -0.8, 0.5])
    along, axis, up = turned.as_matrix().T
    yoke = {"length": 0.4, "width": 0.3, "mass": 1.0}
    stowed = [1.2, 2.9, 3.0, 2.5]
    case = wing(3, {}, 1.0, yoke=yoke, along=list(2.0 * along), hinge_axis=list(axis), stowed=stowed, at=[1.0, 2.0, 3.0])
    scene = build_scene(fsm.load(case).model)
    assert [joint.name for joint in scene.joints] == ["root", "hinge 1", "hinge 2", "hinge 3"]
    places = [np.array(body.position) for body in scene.bodies]
    sides = [Rotation.from_quat(body.orientation, scalar_first=True) for body in scene.bodies]
    points, axes = ([np.array(getattr(joint, of)) for joint in scene.joints] for of in ("at", "axis"))
    for number, joint in enumerate(scene.joints):
        back, point = Rotation.from_rotvec(-joint.angle * axes[number]), points[number]
        places[number:] = [point + back.apply(place - point) for place in places[number:]]
        sides[number:] = [back * side for side in sides[number:]]
        points[number:] = [point + back.apply(at - point) for at in points[number:]]
        axes[number:] = [back.apply(one) for one in axes[number:]]
    middles = [0.2, 0.4 + 0.5 * _L, 0.4 + 1.5 * _L, 0.4 + 2.5 * _L]
    for place, side, middle in zip(places, sides, middles, strict=True):
        assert place == pytest.approx(np.array([1.0, 2.0, 3.0]) + middle * along, abs=1e-12)
        assert side.as_matrix() == pytest.approx(turned.as_matrix(), abs=1e-12)
    offsets = [float((point - [1.0, 2.0, 3.0]) @ up) for point in points]
    assert offsets == pytest.approx([0.0, -0.5 * _GAP, 0.5 * _GAP, -0.5 * _GAP], abs=1e-12)
    assert scene.bodies[1].mass == _MASS and scene.bodies[1].inertia[1] == pytest.approx(_INERTIA)


def test_a_second_row_lies_on_its_panels_and_beside_them() -> None:
    turned = Rotation.from_rotvec([0.3, -0.8, 0.5])
    along, axis, _ = turned.as_matrix().T
    for edge, way in (("left", 1.0), ("right", -1.0)):
        side = {"panels": [2, 3], "width": 0.7, "edge": edge}
        case = wing(3, {}, 1.0, along=list(along), hinge_axis=list(axis), side=side)
        scene = build_scene(fsm.load(case).model)
        bodies, joints = ({one.name: one for one in of} for of in (scene.bodies, scene.joints))
        width = case["wing"]["width"]
        for number in (2, 3):
            panel, other, hinge = bodies[f"panel {number}"], bodies[f"side {number}"], joints[f"hinge side {number}"]
            pose = Rotation.from_quat(panel.orientation, scalar_first=True)
            on = pose.inv().apply(np.subtract(other.position, panel.position))
            assert on == pytest.approx([0.0, way * 0.5 * (width - 0.7), _GAP * np.sign(on[2])], abs=1e-12)
            nearer = np.subtract(bodies["panel 2"].position, bodies["panel 3"].position) @ pose.as_matrix()[:, 2]
            assert number == 2 or on[2] * nearer < 0.0  # the last one is on the outside
            back = Rotation.from_rotvec(-hinge.angle * np.array(hinge.axis))
            place = np.array(hinge.at) + back.apply(np.subtract(other.position, hinge.at))
            beside = pose.inv().apply(place - panel.position)
            assert beside == pytest.approx([0.0, way * 0.5 * (width + 0.7), 0.0], abs=1e-12)
            assert other.mass == pytest.approx(_MASS * 0.7 / width)


def test_hold_downs_release_a_wing_in_two_stages(tmp_path: Path) -> None:
    """All parts rest until .1 s; then the stack turns about its root, and from .3 s on all hinges open."""
    stack = ["panel 1", "panel 2", "side 2"]
    clamps = [{"parts": ["base", "panel 1"], "release": "100 ms"}, {"parts": stack, "release": 0.3}]
    side = {"hinge": {"spring": _SPRING}}
    result = fsm.load(wing(2, {"spring": _SPRING}, 0.4, hold_downs=clamps, side=side)).run(tmp_path)
    time = result.solution.time
    one, two, three = (np.asarray(result[f"joint.hinge {name}.angle"].values) for name in ("1", "2", "side 2"))
    assert np.ptp(one[time <= 0.1]) < 1e-12 and one[0] - one[-1] > 1e-3
    for folded in (two, three):
        assert np.ptp(folded[time <= 0.3]) < 1e-10 and folded[0] - folded[-1] > 1e-4
    assert [event["time"] for event in result.summary["joint_events"]] == [0.1, 0.3]
    assert result.summary["energy_error"] < 1e-8


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"hold_downs": [{"release": 1.0, "parts": ["base", "panel 9"]}]}, "no part of the wing is called 'panel 9'"),
        ({"side": {"panels": [3]}}, "`side.panels` has numbers from 1 to 2"),
        ({"side": {}, "failed": ["spring side 1"]}, "'spring side 1' is unknown"),
        ({"failed": ["spring 4"]}, "wing: failed part 'spring 4' is unknown"),
        ({"failed": ["latch 1"]}, "this hinge has no latch"),
        ({"stowed": [1.0]}, "`stowed` has 1 angles, and the wing has 2 hinges"),
        ({"hinge_axis": [1.0, 1.0, 0.0]}, "right angle"),
        ({"base": "satellite"}, 'wing.base: must be "ground" or a body of'),
        ({"cable": {"stiffness": 40.0}}, "`cable` needs `synchronisation"),
        ({"synchronisation": "cable", "failed": ["cable 1"]}, "no cable ends at this hinge"),
        ({"synchronisation": "cable", "stowed": [0.0, 1.0]}, "cables need stowed angles that are not zero"),
        ({"density": 100.0}, "give `mass` or `density`"),
        ({"hinge": {"spring": {"stiffness": "1 N/m"}}}, "wing.hinge.spring.stiffness"),
    ],
)
def test_faults_of_wings_are_named(keys: dict[str, Any], text: str) -> None:
    with pytest.raises(CaseError) as refused:
        fsm.load(wing(2, {"spring": _SPRING}, 1.0) | {"wing": wing(2, {"spring": _SPRING}, 1.0)["wing"] | keys})
    assert text in str(refused.value)


def test_a_wing_hangs_on_a_body_of_the_scene(tmp_path: Path) -> None:
    """A free base recoils: the centre of mass of all rests."""
    base = {"name": "satellite", "mass": 40.0, "inertia": [5.0, 5.0, 5.0], "position": [-0.4, 0.0, 0.0]}
    case = wing(2, {"spring": _SPRING}, 1.0, base="satellite") | {"scene": {"bodies": [base]}}
    case["save"]["channels"] = ["body.*.position"]
    result = fsm.load(case).run(tmp_path)
    parts = [(40.0, "satellite"), (_MASS, "panel 1"), (_MASS, "panel 2")]
    centre = sum(mass * np.asarray(result[f"body.{name}.position"].values) for mass, name in parts)
    assert np.abs(centre - centre[0]).max() < 1e-9
    assert np.ptp(np.asarray(result["body.satellite.position"].values), axis=0).max() > 0.01


def test_impulses_of_latches_that_close_together(tmp_path: Path) -> None:
    """A cable turns hinges by twice the angle of the root: so do the impulses compare, whichever joint ends the step."""
    assert CliRunner().invoke(cli, ["init", "wing", str(tmp_path / "wing.toml")]).exit_code == 0
    case = fsm.load(tmp_path / "wing.toml").set({"wing.hinge.spring.stiffness": 0.116, "solve.end_time": 6.6})
    for tolerance in (1e-6, 1e-8):
        events = case.set({"solve.rtol": tolerance}).run(figures=False).summary["joint_events"]
        impulse = {event["joint"]: event["impulse"] for event in events if event["what"] == "latch closes"}
        assert [impulse[f"hinge {k}"] for k in range(1, 5)] == pytest.approx([2.0 * impulse["root"]] * 4, rel=1e-3)
        assert impulse["root"] == pytest.approx(0.0545, rel=3e-3)
