"""Ligaments: measures from their definition, forces from the energy, tangents, symmetry, no work in a rigid motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

from fsm.builders.lattice import build_lattice
from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case
from fsm.case.models.scene import Body, ForceElement, Scene
from fsm.errors import CaseError
from fsm.interactions.ligament_planar import ligament_constants_planar, measure_ligament_planar, stored_ligament_planar
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.views.pictures.preview import preview


def pair(damping: float = 0.0, swapped: bool = False, bends: bool = False) -> SegmentSystem:
    ends = [("one", (0.4, 0.0, 0.1)), ("two", (-0.3, 0.0, -0.2))]
    (inner, point_inner), (outer, point_outer) = ends[::-1] if swapped else ends
    stiffness, turning = (300.0, 0.0, 50.0), (0.0, 2.0, 0.0)
    hinge = ForceElement(
        name="hinge", inner=inner, outer=outer, point_inner=point_inner, point_outer=point_outer, frame="chord", bends=bends,
        translation=stiffness, rotation=turning, translation_damping=tuple(damping * k for k in stiffness),
        rotation_damping=tuple(damping * k for k in turning),
    )  # fmt: skip
    bodies = (
        Body(name="one", mass=1.0, inertia=(1.0, 1.0, 1.0), orientation=(np.cos(0.1), 0.0, np.sin(0.1), 0.0)),
        Body(name="two", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(1.0, 0.0, 0.2)),
    )
    return compile_scene(Scene(bodies=bodies, elements=(hinge,)))


def moved(system: SegmentSystem, size: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    q, _ = system.initial()
    return q + size * generator.normal(size=system.nq), generator.normal(size=system.nu)


def test_free_of_force_as_given() -> None:
    system = pair()
    assert np.abs(system.force(0.0, system.initial()[0], None)).max() < 1e-13


@pytest.mark.parametrize("seed", range(5))
def test_measures_are_length_and_turn_of_the_chord(seed: int) -> None:
    generator = np.random.default_rng(seed)
    poses = generator.normal(size=(2, 3))
    points = generator.normal(size=(2, 1, 2))
    bodies = np.array([[0, 1]])
    constants = ligament_constants_planar(poses, bodies, *points, np.ones((1, 3)), np.zeros((1, 3)), np.zeros(1, bool))

    def ends(at: np.ndarray) -> complex:
        # z up, x right: phi about +y turns clockwise
        tips = [complex(*pose[:2]) + complex(*p[0]) * np.exp(-1j * pose[2]) for pose, p in zip(at, points, strict=True)]
        return tips[0] - tips[1]

    later = poses + 0.2 * generator.normal(size=(2, 3))
    value, _, _ = measure_ligament_planar(later, np.zeros((2, 3)), bodies, constants)
    before, after = ends(poses), ends(later)
    turn = later[:, 2] - poses[:, 2]
    shear = -np.angle(after / before * np.exp(1j * turn.mean()))
    np.testing.assert_allclose(value[0], [abs(after) - abs(before), abs(before) * shear, turn[0] - turn[1]], atol=1e-12)


def test_a_chord_that_comes_to_point_backwards_jumps_in_angle_but_not_in_rate() -> None:
    """A jump of 2 pi was counted as a rate: balances of lattices with short soft hinges were off by the work of their
    dampers."""
    length, damping, step = 0.3, 2.0, 0.5
    bodies, points, still = np.array([[0, 1]]), np.zeros((2, 1, 2)), np.zeros((2, 3))

    def at(angle: float) -> np.ndarray:
        return np.array([[length * np.cos(angle), -length * np.sin(angle), 0.0], [0.0, 0.0, 0.0]])

    k, c = np.ones((1, 3)), np.full((1, 3), damping)
    constants = ligament_constants_planar(at(0.0), bodies, *points, k, c, np.zeros(1, bool))
    before, _, _ = measure_ligament_planar(at(np.pi - 0.01), still, bodies, constants)
    after, _, _ = measure_ligament_planar(at(np.pi + 0.02), still, bodies, constants)
    assert after[0, 1] - before[0, 1] == pytest.approx((0.03 - 2.0 * np.pi) * length)
    _, power = stored_ligament_planar(at(np.pi + 0.02), still, bodies, constants, before, 1.0 / step)
    assert power == pytest.approx(damping * (0.03 * length / step) ** 2)


@pytest.mark.parametrize("bends", [False, True])
@pytest.mark.parametrize("size", [1e-3, 0.1, 0.4])
def test_force_is_the_slope_of_the_energy(size: float, bends: bool) -> None:
    system = pair(bends=bends)
    q, _ = moved(system, size)
    h = 1e-6
    steps = h * np.eye(system.nq)
    slope = [(system.energy(0.0, q + s, None).stored - system.energy(0.0, q - s, None).stored) / (2 * h) for s in steps]
    np.testing.assert_allclose(system.force(0.0, q, None), -np.array(slope), rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("damping", [0.0, 0.3])
@pytest.mark.parametrize("past", [False, True])
@pytest.mark.parametrize("bends", [False, True])
def test_tangents_against_differences(damping: float, past: bool, bends: bool) -> None:
    system = pair(damping, bends=bends)
    q, u = moved(system, 0.3)
    before = (0.0, moved(system, 0.1, 1)[0]) if past else None
    linear = system.linearise(0.5, q, u, before)
    h = 1e-6
    by_q = np.array([system.force(0.5, q - s, u, before) - system.force(0.5, q + s, u, before) for s in h * np.eye(6)])
    by_u = np.array([system.force(0.5, q, u - s, before) - system.force(0.5, q, u + s, before) for s in h * np.eye(6)])
    stiffness, rate = linear.stiffness.bsr().toarray(), linear.damping.bsr().toarray()
    if past:  # rates are differences from the past: their part is D/dt, in D
        np.testing.assert_allclose(stiffness + rate / 0.5, by_q.T / (2 * h), atol=2e-7 * np.abs(stiffness).max())
    else:
        np.testing.assert_allclose(stiffness, by_q.T / (2 * h), atol=1e-7 * np.abs(stiffness).max())
        np.testing.assert_allclose(rate, by_u.T / (2 * h), atol=1e-7 * np.abs(stiffness).max())


def test_the_same_from_either_body() -> None:
    one, other = pair(0.2, bends=True), pair(0.2, swapped=True, bends=True)
    q, u = moved(one, 0.3)
    np.testing.assert_allclose(one.force(0.0, q, u), other.force(0.0, q, u), rtol=1e-12, atol=1e-12)


def elastica(axial: float, bending: float, length: float, pull: float, across: float, turn: float) -> tuple[float, ...]:
    """Displacement along, force across and moment at the end of a clamped extensible beam; its pull, displacement across and
    rotation are given.
    """

    def slopes(s: np.ndarray, y: np.ndarray, load: np.ndarray) -> np.ndarray:
        cosine, sine = np.cos(y[2]), np.sin(y[2])
        stretched = 1.0 + (pull * cosine + load[0] * sine) / axial
        dx, dy = stretched * cosine, stretched * sine
        return np.array([dx, dy, y[3] / bending, pull * dy - load[0] * dx])

    def ends(a: np.ndarray, b: np.ndarray, load: np.ndarray) -> np.ndarray:
        return np.array([*a[:3], b[1] - across, b[2] - turn])

    s = np.linspace(0.0, length, 21)
    found = solve_bvp(slopes, ends, s, np.array([s, 0 * s, 0 * s, 0 * s]), p=np.zeros(1), tol=1e-8)
    assert found.success
    return found.y[0, -1] - length, found.p[0], found.y[3, -1]


@pytest.mark.parametrize("pull", [0.0, 1.0])
@pytest.mark.parametrize(("across", "turn"), [(0.1, 0.02), (0.1, 0.15), (0.0, 0.3)])
def test_a_bent_ligament_is_nearly_the_elastica(pull: float, across: float, turn: float) -> None:
    """A polyester shim of 3.5 mm, 0.127 mm thick and 8.1 mm wide (N, mm), with the rotations of the rotating squares."""
    length, width, thickness, young = 3.5, 8.1, 0.127, 3200.0
    axial, bending = young * width * thickness, young * width * thickness**3 / 12.0
    k = np.array([axial / length, 12.0 * bending / length**3, bending / length])
    bodies, start, point = np.array([[0, 1]]), np.array([[length, 0.0, 0.0], [0.0, 0.0, 0.0]]), np.zeros((1, 2))
    constants = ligament_constants_planar(start, bodies, point, point, k[None], np.zeros((1, 3)), np.ones(1, bool))

    def at(along: float) -> np.ndarray:
        """Forces (along, across) and moment; z is up, and a rotation about y is positive from z to x."""
        later = start + np.array([[along, across, -turn], [0.0, 0.0, 0.0]])
        value, _, gradient = measure_ligament_planar(later, 0.0 * start, bodies, constants)
        return np.asarray((k * value[0]) @ gradient[0, :, :3] * [1.0, 1.0, -1.0])

    along = brentq(lambda x: at(x)[0] - pull, -0.1, 0.1, xtol=1e-12)
    shortened, force, moment = elastica(axial, bending, length, pull, across, turn)
    np.testing.assert_allclose(at(along)[1:], [force, moment], rtol=0.01)
    # a pull straightens the middle of the beam, which the cubic does not
    assert along == pytest.approx(shortened, rel=0.08 if pull else 0.01, abs=1e-4)


def test_moving_as_one_costs_nothing() -> None:
    system = pair(bends=True)
    q, _ = moved(system, 0.2)
    turn, shift = 2.5, np.array([0.7, -0.4])
    poses = q.reshape(2, 3).copy()
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    poses[:, :2] = poses[:, :2] @ rotation.T + shift
    poses[:, 2] += turn
    assert system.energy(0.0, poses.ravel(), None).stored == pytest.approx(system.energy(0.0, q, None).stored, rel=1e-12)
    force = system.force(0.0, q, None).reshape(2, 3)
    np.testing.assert_allclose(force[:, :2].sum(axis=0), 0.0, atol=1e-12)


LATTICE = {
    "columns": 3, "rows": 4, "spacing": 0.015, "hinge_length": 0.00225, "angle": "20 deg", "axial": 1.2e5, "shear": 1200.0,
    "rotational": 1.5e-3, "depth": 0.01, "density": 1200.0,
}  # fmt: skip


def lattice(**case: object) -> Case:
    return Case.model_validate({"lattice": LATTICE, "solve": {"end_time": 1.0}, **case})


def test_squares_face_each_other_over_the_hinge_length() -> None:
    scene = build_lattice(lattice())
    poses = {
        body.name: (np.array(body.position)[[0, 2]], 2 * np.arctan2(body.orientation[2], body.orientation[0]))
        for body in scene.bodies
    }

    def place(name: str, point: tuple[float, float, float]) -> np.ndarray:
        centre, turn = poses[name]
        rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        return centre + rotation @ np.array(point)[[0, 2]]

    assert len(scene.elements) == 2 * 4 + 3 * 3
    for hinge in scene.elements:
        chord = place(hinge.inner, hinge.point_inner) - place(hinge.outer, hinge.point_outer)
        assert np.hypot(*chord) == pytest.approx(0.00225, rel=1e-12)
        across = poses[hinge.inner][0] - poses[hinge.outer][0]
        assert abs(across @ chord) == pytest.approx(0.015 * 0.00225, rel=1e-12)  # along x or along z
    # the right corner of square (1, 1) is 20 degrees below the x axis, at the radius of the corners
    hinge = scene.elements[0]
    corner = place(hinge.outer, hinge.point_outer)
    assert np.degrees(np.arctan2(corner[1], corner[0])) == pytest.approx(-20.0)
    assert np.hypot(*corner) == pytest.approx(0.5 * (0.015 - 0.00225) / np.cos(np.radians(20)))


def test_hinges_that_are_beams_begin_inside_the_squares_and_have_the_stiffness_of_beams() -> None:
    """E = 3 GPa, 10 mm x 0.2 mm, 2.25 mm + 2 x 0.5 mm between the clamps."""
    springs = ("axial", "shear", "rotational")
    beam = {"hinge_young": 3e9, "hinge_thickness": 2e-4, "hinge_clamp": 5e-4}
    keys = {key: value for key, value in LATTICE.items() if key not in springs} | beam
    hinges = build_lattice(Case.model_validate({"lattice": keys, "solve": {"end_time": 1.0}})).elements
    length, bending = 3.25e-3, 3e9 * 0.01 * 2e-4**3 / 12
    for hinge, same in zip(hinges, build_lattice(lattice()).elements, strict=True):
        assert hinge.bends and not same.bends
        assert hinge.translation == pytest.approx((3e9 * 0.01 * 2e-4 / length, 0.0, 12 * bending / length**3))
        assert hinge.rotation == pytest.approx((0.0, bending / length, 0.0))
        for point, corner in ((hinge.point_inner, same.point_inner), (hinge.point_outer, same.point_outer)):
            apart = np.subtract(corner, point)
            assert np.hypot(*apart[::2]) == pytest.approx(5e-4)
            # the hinge lies along the rows or columns, at 20 degrees to the diagonal of its square
            assert apart @ corner == pytest.approx(5e-4 * np.hypot(corner[0], corner[2]) * np.cos(np.radians(20)))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"hinge_young": 3e9}, "axial is a spring and hinge_young belongs to a beam"),
        ({"axial": None, "shear": None, "rotational": None, "hinge_young": 3e9}, "hinge_thickness is missing; add it"),
        ({"shear": None}, "shear is missing; add it, or give hinge_young and hinge_thickness"),
    ],
)
def test_hinges_are_springs_or_beams(changes: dict[str, float | None], said: str) -> None:
    keys = {key: value for key, value in {**LATTICE, **changes}.items() if value is not None}
    with pytest.raises(ValueError, match=said):
        Case.model_validate({"lattice": keys, "solve": {"end_time": 1.0}})


def test_edges_are_held_and_driven_together() -> None:
    case = lattice(drive=[{"edge": "top", "speed": 1e-4, "travel": 1e-3}])
    scene = build_lattice(case)
    assert [body.name for body in scene.bodies if body.held] == ["block 1.1", "block 2.1", "block 3.1"]
    assert scene.drives[0].moved == ("block 1.4", "block 2.4", "block 3.4")
    system = compile_scene(scene)
    assert system.n_free == 6
    end = system.end_time()
    assert end is not None
    q, _ = system.initial()
    reactions = system.reactions(end, q, None)
    force = system.observe(end, q, None).drive.force[0]
    assert force == pytest.approx(reactions[[10, 11, 12], 1].sum()) and force > 0.0


def test_a_lattice_has_no_preview(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match="not shown by the preview"):
        preview(lattice(drive=[{"edge": "top", "speed": 1e-4, "travel": 1e-3}]), tmp_path / "film.gif")


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("solve.spatial=true", "in its plane only"),
        ("drive.0.edge=bottom", "is held"),
        ("contact.stiffness=1e5", "rigid and have no contact; remove section [contact]"),
        ("strip.length=1", "both define a model"),
        ("drive.0.body=block 1.6", "give one of"),
    ],
)
def test_what_a_lattice_cannot_have_is_refused(override: str, said: str) -> None:
    with pytest.raises(CaseError) as caught:
        load_case(Path(__file__).parents[2] / "folding_cases" / "rotating_squares" / "case.toml", [override])
    assert said in str(caught.value)


def test_a_lattice_is_of_the_plane() -> None:
    with pytest.raises(CaseError, match="only in a plane model"):
        compile_scene(build_lattice(lattice()), spatial=True)
