"""Two boxes: integrals over their common volume, energy, tangent, and motions of faces, edges and corners."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

import fsm
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem
from tests.tangents import check_force, check_tangents

_STIFFNESS = 1e6
_LINEAR = {"law": "linear", "stiffness": _STIFFNESS, "ramp": 1e-12}
_SIZES = ((0.1, 0.08, 0.06), (0.09, 0.2, 0.07))
_SIDE = 0.1
_FAR = 1.0
"""Distance at the start, m: cases with overlaps are refused."""
_ASKEW = [Rotation.from_rotvec([0.3, 0.5, -0.2]), Rotation.from_rotvec([-0.4, 0.1, 0.6])]


def quaternion(turn: Rotation) -> list[float]:
    return [float(x) for x in turn.as_quat(scalar_first=True)]


def case(bodies: list[dict[str, Any]], boxes: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    """Boxes on the bodies of the same number; each touches the next one."""
    named = [
        {"name": f"body {k}", "mass": 0.5, "inertia": [2e-3, 1e-3, 2e-3], "velocity": [0.3, -0.2, 0.1 * k],
         "angular_velocity": [2.0, -3.0, 1.0 + k]} | body
        for k, body in enumerate(bodies)
    ]  # fmt: skip
    solids = [{"name": f"box {k}", "shape": "box", "body": f"body {k}"} | box for k, box in enumerate(boxes)]
    pairs = [{"first": f"box {k}", "second": f"box {k + 1}"} for k in range(len(boxes) - 1)]
    given = {"units": "SI", "scene": {"bodies": named, "obstacles": solids, "pairs": pairs}, "contact": _LINEAR}
    return given | {"solve": {"end_time": 1e-3, "spatial": True}} | more


def placed(
    sizes: Any, places: list[Any], turns: list[Rotation], **more: Any
) -> tuple[SegmentSystem, np.ndarray, np.ndarray]:
    """System, and a configuration with both boxes at given places, with a velocity. The boxes are fixed to their bodies
    beside the middles and askew.
    """
    bodies, boxes, centres = [], [], []
    for k in range(2):
        body, middle = turns[k] * _ASKEW[k].inv(), np.array([0.01, -0.02, 0.015 * k])
        centres.append(np.asarray(places[k]) - body.apply(middle))
        bodies.append({"position": [_FAR * k, 0.0, 0.0], "orientation": quaternion(body)})
        boxes.append({"size": list(sizes[k]), "position": middle.tolist(), "orientation": quaternion(_ASKEW[k])})
    system = compile_case(fsm.load(case(bodies, boxes, **more)).model)[1]
    q, u = system.initial()
    q[:3], q[7:10] = centres
    return system, q, u


def halfspaces(size: Any, place: np.ndarray, turn: Rotation) -> np.ndarray:
    """Planes (6, 4) of a box: n.x + c <= 0."""
    normals = turn.apply(np.concatenate([np.eye(3), -np.eye(3)]))
    return np.column_stack([normals, -normals @ place - 0.5 * np.tile(size, 2)])


def inner_point(planes: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre and radius of the largest ball inside the half spaces; the radius is below zero if there is none."""
    found = linprog([0, 0, 0, -1], np.column_stack([planes[:, :3], np.ones(len(planes))]), -planes[:, 3],
                    bounds=[(None, None)] * 4)  # fmt: skip
    return found.x[:3], float(found.x[3])


def integral(sizes: Any, places: list[np.ndarray], turns: list[Rotation]) -> float:
    """Depth below the nearest face of the first box, integrated over the common volume of both boxes, m^4."""
    own, other = (halfspaces(*given) for given in zip(sizes, places, turns, strict=True))
    total = 0.0
    for face in range(6):
        nearest = own[face] - np.delete(own, face, axis=0)  # its distance is the smallest one
        planes = np.concatenate([own, other, -nearest])
        centre, radius = inner_point(planes)
        if radius <= 1e-9:
            continue
        points = HalfspaceIntersection(planes, centre).intersections
        hull = ConvexHull(points)
        for corners in points[hull.simplices]:
            tetrahedron = np.vstack([centre, corners])
            volume = abs(np.linalg.det(tetrahedron[1:] - centre)) / 6.0
            total -= volume * (tetrahedron @ own[face, :3] + own[face, 3]).mean()
    return total


def random_pair(seed: int, deep: float) -> tuple[list[np.ndarray], list[Rotation]]:
    """Boxes at random, with the deepest corners of both up to a part of the smallest size inside the other."""
    random = np.random.default_rng(seed)
    turns = [Rotation.random(random_state=2 * seed + k) for k in range(2)]
    way = random.normal(size=3)
    way /= np.linalg.norm(way)
    beside = np.cross(way, random.normal(size=3))
    far, near, places = 0.4, 0.0, [0.02 * beside, np.zeros(3)]
    for _ in range(60):  # distance at which they touch
        middle = 0.5 * (far + near)
        both = [halfspaces(size, place + k * middle * way, turn)
                for k, (size, place, turn) in enumerate(zip(_SIZES, places, turns, strict=True))]  # fmt: skip
        near, far = (middle, far) if inner_point(np.concatenate(both))[1] > 0.0 else (near, middle)
    return [places[0], (near - deep * min(_SIZES[0])) * way], turns


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("deep", [-0.003, 0.003, 0.1, 0.3])
def test_energy_is_the_integral_over_the_common_volume(seed: int, deep: float) -> None:
    places, turns = random_pair(seed, deep)
    system, q, u = placed(_SIZES, places, turns)
    energy = system.energy(0.0, q, u).potential["contact"]
    known = _STIFFNESS / (_SIZES[0][0] * _SIZES[0][1]) * integral(_SIZES, places, turns)
    assert (energy > 0.0) == (deep > 0.0)
    assert energy == pytest.approx(known, rel=1e-5 if deep > 0.01 else 2e-2, abs=0.0)


_HERTZ = {"law": "hertz", "stiffness": 1e8, "points_per_segment": 1}


@pytest.mark.parametrize("law", [_LINEAR, _HERTZ], ids=["linear", "hertz"])
@pytest.mark.parametrize("seed", range(4))
def test_forces_are_those_of_the_energy_and_tangents_those_of_the_forces(seed: int, law: dict[str, Any]) -> None:
    places, turns = random_pair(seed, 0.05 if seed % 2 else 0.2)
    smooth, q, _ = placed(_SIZES, places, turns, contact=law)
    force = check_force(smooth, q, 1e-7)
    bodies = [Rotation.from_quat(q[7 * k + 3 : 7 * k + 7], scalar_first=True) for k in range(2)]
    wrenches = force.reshape(2, 2, 3)
    moment = sum(np.cross(q[7 * k : 7 * k + 3], wrenches[k, 0]) + bodies[k].apply(wrenches[k, 1]) for k in range(2))
    assert force[:3] + force[6:9] == pytest.approx(0.0, abs=1e-12 * np.abs(force).max())
    assert moment == pytest.approx(0.0, abs=1e-11 * np.abs(force).max())
    rough = {"contact": law | {"damping": 20.0}, "friction": {"law": "tanh", "mu_dynamic": 0.3, "v_static": 0.1}}
    check_tangents(*placed(_SIZES, places, turns, **rough), (1e-7, 1e-7))


_EDGE, _CORNER = Rotation.from_euler("x", 45, degrees=True), Rotation.align_vectors([[0, 0, 1]], [[1, 1, 1]])[0]
_FLAT = Rotation.identity()
_ACROSS = Rotation.from_euler("z", 90, degrees=True) * _EDGE
_OBLIQUE = Rotation.from_euler("z", 30, degrees=True) * _EDGE


@pytest.mark.parametrize(
    ("lower", "upper", "reach", "force"),
    [
        (_FLAT, _FLAT, 0.5, lambda d, k: k * _SIDE**2 * d),
        (_FLAT, _EDGE, math.sqrt(0.5), lambda d, k: k * _SIDE * d**2 / math.sqrt(2)),
        (_EDGE, _FLAT, 0.5, lambda d, k: k * _SIDE * d**2),
        (_FLAT, _CORNER, math.sqrt(0.75), lambda d, k: 0.5 * k * d**3),
        (_CORNER, _FLAT, 0.5, lambda d, k: math.sqrt(0.75) * k * d**3),
        (_EDGE, _ACROSS, math.sqrt(0.5), lambda d, k: math.sqrt(2) / 3 * k * d**3),
        (_EDGE, _OBLIQUE, math.sqrt(0.5), lambda d, k: 2 * math.sqrt(2) / 3 * k * d**3),
    ],
    ids=["face", "edge on face", "face on edge", "corner on face", "face on corner", "crossed edges", "oblique edges"],
)
def test_kinds_of_contact(lower: Rotation, upper: Rotation, reach: float, force: Any) -> None:
    """The upper box is slightly smaller, so it is the foundation."""
    sizes, depth = [[_SIDE] * 3, [1.001 * _SIDE] * 3], 2e-5
    tall = {_FLAT: 0.5, _EDGE: math.sqrt(0.5), _CORNER: math.sqrt(0.75)}[lower] * sizes[1][0]
    rough = {"law": "tanh", "mu_dynamic": 0.3, "v_static": 1e-6}
    system, q, _ = placed(sizes, [[0.0, 0.0, tall + reach * _SIDE - depth], [0.0] * 3], [upper, lower], friction=rough)
    known = force(depth, _STIFFNESS / _SIDE**2)
    found = system.force(0.0, q, np.eye(12)[0])
    assert found[2] == pytest.approx(known, rel=2e-3, abs=0.0)
    assert found[0] == pytest.approx(-0.3 * found[2], rel=1e-4, abs=0.0)  # it slides along x


@pytest.mark.parametrize("seed", range(4))
def test_the_force_is_continuous_along_a_motion(seed: int) -> None:
    """Corners, edges and faces come into contact and leave it; half of the step halves the largest change."""
    places, turns = random_pair(seed, 0.1)
    system, q, _ = placed(_SIZES, places, turns)
    way = np.random.default_rng(seed).normal(size=12) * np.tile([0.015] * 3 + [0.6] * 3, 2)

    def largest_change(steps: int) -> float:
        path = [system.force(0.0, system.retract(q, part * way), None) for part in np.linspace(0.0, 1.0, steps + 1)]
        return float(np.abs(np.diff(path, axis=0)).max())

    assert largest_change(800) < 0.55 * largest_change(400)


def inertia(mass: float, size: Any) -> list[float]:
    square = np.square(size)
    return [float(x) for x in mass / 12.0 * (square.sum() - square)]


_Given = tuple[Any, float | None, Any, dict[str, Any]]


def run(folder: Path, boxes: list[_Given], end: float, contact: dict[str, Any], **more: Any) -> fsm.Result:
    """Motion of boxes at rest, given by size, mass (None: held), place, and further keys of the body."""
    bodies = [
        {"mass": mass or 1.0, "inertia": inertia(mass or 1.0, size), "position": place, "held": mass is None,
         "velocity": [0.0] * 3, "angular_velocity": [0.0] * 3} | keys
        for size, mass, place, keys in boxes
    ]  # fmt: skip
    given = {
        "gravity": [0.0, 0.0, -9.81], "contact": {"law": "linear", "stiffness": 1e6, "ramp": 1e-8} | contact,
        "solve": {"end_time": end, "rtol": 1e-6, "spatial": True, "error_estimates": "off"},
        "save": {"interval": end / 20.0, "channels": ["body.*", "contact.*", "energy.*"]},
    } | more  # fmt: skip
    return fsm.load(case(bodies, [{"size": list(size)} for size, *_ in boxes], **given)).run(folder, figures=False)


_TABLE: _Given = ((0.3, 0.3, 0.05), None, [0.0, 0.0, 0.0], {})


def test_a_stack_of_three_carries_its_weight(tmp_path: Path) -> None:
    """The upper boxes overhang, so their pressure is not even; the lowest one sinks by its law."""
    sizes, masses = [(0.1, 0.1, 0.1), (0.2, 0.05, 0.04), (0.06, 0.06, 0.06)], [0.5, 0.3, 0.2]
    places = [[0.0, 0.0, 0.075], [0.01, 0.0, 0.145], [0.005, 0.0, 0.195]]
    boxes = [_TABLE] + [(s, m, [x, y, z + 1e-7], {}) for s, m, (x, y, z) in zip(sizes, masses, places, strict=True)]
    rough = {"law": "tanh", "mu_dynamic": 0.4, "v_static": 1e-4}
    result = run(tmp_path, boxes, 0.2, {"damping": 2000.0}, friction=rough)
    for k in range(3):
        force = np.asarray(result[f"contact.box {k} - box {k + 1}.normal_force"].values)[-1]
        assert force == pytest.approx(9.81 * sum(masses[k:]), rel=1e-3)
    sunk = 0.075 - np.asarray(result["body.body 1.position"].values)[-1, 2]
    assert sunk == pytest.approx(9.81 * sum(masses) / 1e6, rel=2e-2)
    turned = np.asarray(result["body.body 3.rotation"].values)[-1]
    assert np.abs(turned).max() < 1e-3 and result.summary["unstable_equilibria"] == 0


def test_a_tilted_box_falls_and_keeps_its_energy(tmp_path: Path) -> None:
    """Corners, edges and faces hit a held box without loss; it bounces off and falls past it."""
    fall = {"orientation": quaternion(Rotation.random(random_state=2)), "angular_velocity": [1.0, 2.0, 0.0]}
    boxes = [_TABLE, ((0.1, 0.08, 0.05), 0.5, [0.0, 0.0, 0.16], fall)]
    solve = {"end_time": 0.5, "rtol": 1e-7, "spatial": True, "error_estimates": "off"}
    result = run(tmp_path, boxes, 0.5, {"stiffness": 1e7, "ramp": 1e-6}, solve=solve)
    assert np.asarray(result["contact.box 0 - box 1.gap"].values).min() < 0.0
    assert result.summary["energy_error"] < 1e-6


@pytest.mark.parametrize("slope", [0.29, 0.35])
def test_a_box_slides_where_the_slope_exceeds_the_friction(tmp_path: Path, slope: float) -> None:
    mu, angle, v_static, end = 0.3, math.atan(slope), 1e-4, 0.2
    gravity = [9.81 * math.sin(angle), 0.0, -9.81 * math.cos(angle)]
    boxes = [_TABLE, ((0.1, 0.1, 0.06), 0.5, [-0.05, 0.0, 0.055], {})]
    rough = {"law": "tanh", "mu_dynamic": mu, "v_static": v_static}
    result = run(tmp_path, boxes, end, {"damping": 2000.0}, gravity=gravity, friction=rough)
    velocity = np.asarray(result["body.body 1.velocity"].values)[:, 0]
    if slope < mu:
        assert velocity[-1] == pytest.approx(v_static * math.atanh(slope / mu), rel=1e-3)
    else:
        wanted = 9.81 * (math.sin(angle) - mu * math.cos(angle)) * 0.5 * end
        assert velocity[-1] - velocity[10] == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize(("beyond", "tips"), [(-2e-3, False), (2e-3, True)])
def test_a_box_tips_where_its_centre_is_past_the_edge(tmp_path: Path, beyond: float, tips: bool) -> None:
    boxes = [_TABLE, ((0.1, 0.1, 0.06), 0.5, [0.15 + beyond, 0.0, 0.055], {})]
    rough = {"law": "tanh", "mu_dynamic": 0.5, "v_static": 1e-4}
    result = run(tmp_path, boxes, 0.3, {"stiffness": 1e9, "damping": 1e5}, friction=rough)
    turned = np.asarray(result["body.body 1.rotation"].values)[-1, 1]
    assert turned > 0.5 if tips else abs(turned) < 2e-3


def test_a_step_does_not_carry_a_thin_box_through_a_thin_box() -> None:
    """Both states of the step have no contact; the boxes overlap between them, or beside each other do not."""
    flat = (0.1, 0.1, 0.002)
    for beside, rejected in ((0.01, True), (0.11, False)):
        system, q, u = placed([flat, flat], [[beside, 0.0, 0.05], [0.0] * 3], [_FLAT, _FLAT])
        system.commit(0.0, q, u)
        q[2] -= 0.1
        assert not system.force(0.0, q, None).any()
        assert (system.rejection(1e-3, q, u, 1e-3) is not None) == rejected


@pytest.mark.parametrize(
    ("boxes", "more", "said"),
    [
        ([{}, {"shape": "cylinder", "size": None, "radius": 0.1, "length": 0.2}], {}, "a box and a cylinder do not touch"),
        ([{}, {}], {"contact": {"law": "restitution", "stiffness": 1e6, "restitution": 0.5}}, "`restitution` refers to it"),
    ],
    ids=["cylinder", "restitution"],
)  # fmt: skip
def test_refused(boxes: list[dict[str, Any]], more: dict[str, Any], said: str) -> None:
    solids = [{key: value for key, value in ({"size": [0.1] * 3} | box).items() if value is not None} for box in boxes]
    bodies = [{"position": [float(k), 0.0, 0.0]} for k in range(2)]
    with pytest.raises(CaseError, match=said):
        compile_case(fsm.load(case(bodies, solids, **more)).model)
