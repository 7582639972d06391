"""Frames on sides, edges and insides of facets, for rigid facets, bars and flexible facets; seams along edges."""

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
from fsm.model.compile.compile_case import compile_case
from fsm.model.plan.in_python import InPython
from fsm.model.system.frames import place_frames
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

FACETS: dict[str, dict[str, Any]] = {
    "rigid": {"facets": "rigid"}, "bars": {"facets": "bars"}, "flexible": {"facets": "flexible", "mesh_size": 0.05},
}  # fmt: skip
_G, _RHO, _T = 9.81, 800.0, 3e-4
_A, _B = 0.05, 0.04
_X = _A * math.cos(math.radians(30.0))


def zigzag(facets: str, scene: dict[str, Any], young: float = 3e9, **keys: Any) -> dict[str, Any]:
    """Zigzag of three panels under gravity; vertices 1 and 2 end its left edge."""
    sheet = {"kind": "zigzag", "columns": 3, "a": _A, "b": _B, "fold_angle": "30 deg", "thickness": _T} | FACETS[facets]
    return {
        "units": "SI", "sheet": sheet, "material": {"young": young, "poisson": 0.3, "density": _RHO},
        "crease": {"stiffness_per_length": 1.0}, "gravity": [0.0, 0.0, -_G], "scene": scene,
        "solve": {"error_estimates": "off"}, "step": [{"kind": "static", "duration": 1.0}],
    } | keys  # fmt: skip


def hinge(second: str, **keys: Any) -> dict[str, Any]:
    own = {"name": "root", "kind": "revolute", "first": "ground", "at": [0.0, 0.0, 0.0], "axis": [0.0, 1.0, 0.0]}
    return own | {"second": second, "spring": {"stiffness": 0.01, "rest": 0.0}} | keys


def tip(result: Any) -> np.ndarray:
    return np.asarray(result["point.tip.position"].values[-1])


END = {"name": "end", "on": "sheet", "place": "edge right"}
SAVE = {"points": {"tip": {"body": "end"}}, "channels": ["joint.*", "point.*"]}


@pytest.mark.parametrize("facets", FACETS)
def test_sheet_hangs_on_a_hinge_along_its_edge(facets: str, tmp_path: Path) -> None:
    """The hinge carries the weight, and the moment of its spring is that of the weight about it; E raised: rigid facets."""
    found = {}
    for name, second in {"edge": "sheet.left", "side": "sheet.vertices 2, 1", "body": "facet 1"}.items():
        data = zigzag(facets, {"joints": [hinge(second)], "frames": [END]}, young=3e13, save=SAVE)
        result = fsm.load(data).run(tmp_path / name, figures=False)
        weight = 3 * _A * _B * _T * _RHO * _G
        assert result["joint.root.force"].values[-1] == pytest.approx([0.0, 0.0, weight], abs=1e-7 * weight)
        found[name] = tip(result)
    assert found["side"] == pytest.approx(found["edge"], abs=1e-9)
    assert found["body"] == pytest.approx(found["edge"], abs=2e-6 if facets == "flexible" else 1e-9)
    rigid = fsm.load(zigzag("rigid", {"joints": [hinge("facet 1")], "frames": [END]}, save=SAVE)).run(
        tmp_path / "rigid", figures=False
    )
    assert found["edge"] == pytest.approx(tip(rigid), abs=1e-5)


def test_square_facet_on_a_sprung_hinge_bends_as_a_plate_of_zero_poisson_ratio(tmp_path: Path) -> None:
    """Tip of a square of side L under gravity p: L m/k + p L^4/(8 E t^3/12), with m = p L^2/2 per width; small angles."""
    side, thick, young, spring = 0.2, 1e-3, 5e9, 20.0
    load = 1000.0 * thick * _G
    wanted = side * (0.5 * load * side**3 / spring) + load * side**4 / (8.0 * young * thick**3 / 12.0)
    sheet = {"kind": "plate", "length": side, "width": side, "facets": "flexible", "mesh_size": 0.025, "thickness": thick}
    joint = hinge("sheet.left", spring={"stiffness": spring, "rest": 0.0})
    data = zigzag("rigid", {"joints": [joint], "frames": [END]}, save=SAVE) | {
        "sheet": sheet, "material": {"young": young, "poisson": 0.0, "density": 1000.0},
    }  # fmt: skip
    del data["crease"]
    result = fsm.load(data).run(tmp_path, figures=False)
    assert -tip(result)[2] == pytest.approx(wanted, rel=2e-3)
    angle = result["joint.root.angle"].values[-1]
    assert angle == pytest.approx(0.5 * load * side**3 / spring, rel=2e-3)


@pytest.mark.parametrize("facets", FACETS)
def test_a_cord_at_the_middle_of_a_side_holds_the_sheet(facets: str, tmp_path: Path) -> None:
    """The cord and the hinge carry the weight; the moment of the tension about the hinge is that of the weight."""
    middle = {"name": "middle", "on": "sheet", "place": "vertices 7, 8", "at": [0.5 * _B]}
    end = [3 * _X, 0.5 * _B, 0.5 * _A]
    cord = {"name": "stay", "first": "ground", "second": "middle", "at": [0.0, 0.5 * _B, 0.2], "to": end, "stiffness": 1e4}
    scene = {"joints": [hinge("sheet.left")], "cords": [cord], "frames": [middle]}
    save = {"points": {"tip": {"body": "middle"}}, "channels": ["joint.*", "point.*", "cord.*"]}
    result = fsm.load(zigzag(facets, scene, save=save)).run(tmp_path, figures=False)
    force, at = result["joint.root.force"].values[-1], tip(result)
    weight = 3 * _A * _B * _T * _RHO * _G
    pull = np.array([0.0, 0.0, weight]) - force  # of the cord on the sheet
    assert np.linalg.norm(pull) == pytest.approx(result["cord.stay.force"].values[-1], rel=1e-5)
    way = np.array([0.0, 0.5 * _B, 0.2]) - at
    assert np.cross(pull, way) == pytest.approx(np.zeros(3), abs=1e-6 * weight)
    assert result.summary["energy_error"] < 1e-6


@pytest.mark.parametrize("facets", ["bars", "flexible"])
@pytest.mark.parametrize(
    ("place", "at", "point"),
    [
        ("edge right", [], [3 * _X, 0.5 * _B, 0.5 * _A]), ("vertices 7, 8", [0.01], None), ("vertices 8, 7", [0.01], None),
        ("vertices 3, 4", [], [_X, 0.5 * _B, 0.5 * _A]),
        ("facet 1", [0.25 * _X, 0.011, 0.125 * _A], [0.25 * _X, 0.011, 0.125 * _A]),
    ],
)  # fmt: skip
def test_frames_move_with_a_rigid_motion(facets: str, place: str, at: list[float], point: list[float] | None) -> None:
    """The point is where it was asked for; a linear motion of the whole mesh moves frames as it moves their place."""
    frame = {"name": "frame", "on": "sheet", "place": place, "at": at}
    system = compile_case(fsm.load(zigzag(facets, {"frames": [frame], "joints": [hinge("sheet.left")]}))._loaded.case)[1]
    frames, row = system.frames, system.bodies.names.index("frame")
    start = system.elements.start
    poses, near = np.zeros((len(system.bodies.names), 7)), np.tile([1.0, 0.0, 0.0, 0.0], (len(frames.bodies), 1))
    place_frames(frames, start, near, poses)
    before = poses[row].copy()
    if point is not None:
        assert before[:3] == pytest.approx(point, abs=1e-12)
    elif place == "vertices 7, 8":
        assert before[:3] == pytest.approx([3 * _X, 0.01, 0.5 * _A], abs=1e-12)
    else:
        assert before[:3] == pytest.approx([3 * _X, _B - 0.01, 0.5 * _A], abs=1e-12)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    shift = np.where(np.repeat(system.elements.mesh.is_position, 1), np.tile([1.0, 2.0, 3.0], len(start) // 3), 0.0)
    moved = (start.reshape(-1, 3) @ turn.T).ravel() + shift
    place_frames(frames, moved, near, poses)
    assert poses[row, :3] == pytest.approx(turn @ before[:3] + [1.0, 2.0, 3.0], abs=1e-12)
    half = math.sqrt(0.5)
    w, x, y, z = before[3:]
    turned = half * np.array([w - z, x - y, y + x, z + w])  # of 90 degrees about z, then the frame
    assert abs(turned @ poses[row, 3:]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("facets", "frame", "words"),
    [
        ("flexible", {"place": "vertices 1, 4"}, "no facet has a side between vertices 1, 4"),
        ("bars", {"place": "vertices 1, 2, 3"}, "a side by its two ends"),
        ("rigid", {"place": "edge top"}, "on several rigid facets, facet 1, facet 2, facet 3"),
        ("flexible", {"place": "vertices 1, 2", "at": [0.05]}, "give 0 to 0.04 m"),
        ("flexible", {"place": "facet 1", "at": [0.0, 0.0, 0.01]}, "m off facet 1 at the start"),
        ("rigid", {"place": "facet 9", "at": [0.0, 0.0, 0.0]}, "there is no facet 9; the sheet has 3 facets"),
        ("bars", {"place": "facet 1"}, "on a facet, (x, y, z)"),
        ("flexible", {"place": "edge left", "at": [0.01]}, "an edge of the sheet has no first vertex"),
        ("rigid", {"edge": "left"}, 'give place = "edge left"'),
    ],
)  # fmt: skip
def test_faulty_places_are_named(facets: str, frame: dict[str, Any], words: str) -> None:
    with pytest.raises(CaseError) as error:
        compile_case(fsm.load(zigzag(facets, {"frames": [{"name": "frame", "on": "sheet"} | frame]}))._loaded.case)
    assert words in str(error.value)


def clamped_tip(force: float) -> tuple[float, float]:
    """Tip (x, z) of an inextensible clamped beam of length 1 with EI = 1 under a force along -z."""

    def shot(curvature: float) -> np.ndarray:
        def rate(_: float, y: np.ndarray) -> list[float]:
            return [y[1], -force * math.cos(y[0]), math.cos(y[0]), -math.sin(y[0])]

        return solve_ivp(rate, (0.0, 1.0), [0.0, curvature, 0.0, 0.0], rtol=1e-11, atol=1e-13).y[:, -1]

    start = brentq(lambda curvature: shot(curvature)[1], 0.0, 1.001 * force, xtol=1e-14)
    return float(shot(start)[2]), float(shot(start)[3])


@pytest.mark.parametrize(("part", "within"), [("film", 5e-4), ("sheet", 4e-3)])
def test_tip_of_a_clamped_strip_is_that_of_the_elastica(part: str, within: float, tmp_path: Path) -> None:
    """A wide strip without transverse contraction bends to a cylinder, however wide it is."""
    young, thick, width, force = 70e9, 1e-3, 0.5, 2.0
    load = force * young * width * thick**3 / 12.0
    seam = {"name": "clamp", "film": part, "edge": "left", "bodies": ["ground"], "clamped": True}
    end = {"name": "end", "on": part} | ({"edge": "right"} if part == "film" else {"place": "edge right"})
    scene: dict[str, Any] = {"seams": [seam], "frames": [end]}
    given: dict[str, Any] = {
        "units": "SI", "scene": scene, "step": [{"kind": "static", "duration": 1.0}], "solve": {"error_estimates": "off"},
        "load": [{"body": "end", "force": [0.0, 0.0, -load], "time": {"kind": "ramp", "end": 1.0}}],
        "save": {"points": {"tip": {"body": "end"}}, "channels": ["point.*", "joint.clamp*.force", "joint.clamp*.moment"]},
    }  # fmt: skip
    if part == "film":
        scene["films"] = [{
            "name": "film", "position": [0.5, 0.0, 0.0], "length": 1.0, "width": width, "thickness": thick, "young": young,
            "poisson": 0.0, "density": 2700.0, "mesh": [16, 4],
        }]  # fmt: skip
    else:
        plate = {"kind": "plate", "length": 1.0, "width": width, "facets": "flexible", "mesh_size": 0.0625}
        plate["thickness"] = thick
        given |= {"sheet": plate, "material": {"young": young, "poisson": 0.0, "density": 2700.0}}
    result = fsm.load(given).run(tmp_path, figures=False)
    x, z = clamped_tip(force)
    assert tip(result)[[0, 2]] == pytest.approx([x, z], abs=within)
    names = {name for name in result.channels if name.startswith("joint.clamp (") and name.endswith(".force")}
    total = sum(result[name].values[-1] for name in names)
    assert len(names) > 4
    assert total == pytest.approx([0.0, 0.0, load], abs=1e-5 * load)
    assert result.summary["energy_error"] < 1e-3


def test_a_seam_along_a_line_that_is_not_straight_is_clamped() -> None:
    seam = {"name": "seam", "film": "sheet", "edge": "top", "bodies": ["ground"]}
    with pytest.raises(CaseError, match="edge top is not straight"):
        compile_case(fsm.load(zigzag("flexible", {"seams": [seam]}))._loaded.case)


@pytest.mark.parametrize("facets", ["bars", "flexible"])
@pytest.mark.parametrize("place", ["edge right", "vertices 8, 7", "vertices 3, 4"])
def test_axes_of_a_line_have_unit_length_at_the_start(facets: str, place: str) -> None:
    """Sums of nodal vectors for the slopes along and across the line, which a stretch of the sheet stretches alike."""
    scene = {"frames": [{"name": "frame", "on": "sheet", "place": place}], "joints": [hinge("sheet.left")]}
    system = compile_case(fsm.load(zigzag(facets, scene))._loaded.case)[1]
    frames, row = system.frames, system.bodies.names.index("frame")
    number = int(np.flatnonzero(frames.bodies == row)[0])
    own = slice(frames.first[number], frames.first[number + 1])
    vectors = system.elements.start[frames.vectors[own][:, None] + np.arange(3)]
    along, across = frames.along[own] @ vectors, frames.across[own] @ vectors
    assert [np.linalg.norm(along), np.linalg.norm(across), along @ across] == pytest.approx([1.0, 1.0, 0.0], abs=1e-9)
    assert abs(along[1]) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("second", ["support", "sheet.left"])
def test_a_flexible_sheet_that_starts_off_its_equilibrium_keeps_the_balance_of_energies(second: str, tmp_path: Path) -> None:
    """It settles at the start; the energy that it loses there is dissipated, half of the work of the weight if linear."""
    joints = [] if second == "support" else [hinge(second, spring={"stiffness": 0.02, "rest": 0.0})]
    data = zigzag("flexible", {"joints": joints})
    if second == "support":
        data["sheet"]["support"] = [{"at": "edge left", "fixed": ["x", "y", "z"], "clamped": True}]
        del data["scene"]
    result = fsm.load(data).run(tmp_path, figures=False)
    energy = result.solution.energy
    fall = energy["gravity"][0] - energy["gravity"][-1]
    assert energy["dissipated"][-1] == pytest.approx(0.5 * fall, rel=0.15)
    assert result.summary["energy_error"] < 1e-5


def swinging(damping: float) -> dict[str, Any]:
    """Sheet on spherical joints at the ends of its left edge."""
    frames = [{"name": f"v{k}", "on": "sheet", "place": f"vertex {k}"} for k in (1, 2)]
    joints = [
        {"name": f"s{k}", "kind": "spherical", "first": "ground", "second": f"v{k}", "at": [0.0, _B * (k - 1), 0.0]}
        for k in (1, 2)
    ]
    return moving({"frames": [*frames, END], "joints": joints}, damping)


def moving(scene: dict[str, Any], damping: float) -> dict[str, Any]:
    case = zigzag("flexible", scene) | {
        "material": {"young": 3e9, "poisson": 0.3, "density": _RHO} | ({"damping": damping} if damping else {}),
        "solve": {"end_time": 0.1, "error_estimates": "off", "method": "generalized-alpha", "rtol": 1e-6},
        "save": SAVE | {"interval": 0.02, "channels": ["point.*"]},
    }
    del case["step"]
    return case


@pytest.mark.parametrize("damping", [0.0, 1e-3])
def test_a_damped_sheet_swings_on_joints_as_on_supports(damping: float, tmp_path: Path) -> None:
    """Damped modes that are much faster than the steps: projections to the joints must not excite them."""
    held = moving({"frames": [END]}, damping)
    held["sheet"]["support"] = [{"at": "edge left", "fixed": ["x", "y", "z"]}]
    on_joints, on_supports = (
        fsm.load(case).run(tmp_path / name, figures=False) for name, case in (("joints", swinging(damping)), ("held", held))
    )
    assert tip(on_joints) == pytest.approx(tip(on_supports), abs=2e-5)
    lost, wanted = (float(result.solution.energy["dissipated"][-1]) for result in (on_joints, on_supports))
    assert lost == pytest.approx(wanted, rel=0.02, abs=1e-12)
    assert on_joints.summary["energy_error"] < 2e-4
    assert on_joints.summary["steps"] < 1.2 * on_supports.summary["steps"]


def test_steps_in_python_of_a_damped_sheet_on_joints_are_the_compiled_ones() -> None:
    ends = []
    for reasons in ((), ("a test",)):
        _, system = compile_case(fsm.load(swinging(1e-3)).model)
        system.in_python = InPython(reasons)
        saved = list[SavedState]()
        simulate(system, Settings("generalized-alpha", 1e-5, 0.01, rho_inf=0.6), [0.01], saved.append)
        ends.append(np.concatenate([saved[-1].q, saved[-1].u]))
    assert ends[1] == pytest.approx(ends[0], abs=1e-8)
