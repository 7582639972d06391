"""Natural modes: beams and strings against exact frequencies, Lanczos against a dense solver, unstable states, clusters.

The beams are chains of rigid segments with joints EI/l and half a cell at a clamp, L = EI = rho A = 1, so that omega is
(beta L)^2: the roots of cos x cosh x = -1 (cantilever), sin x = 0 (pinned), cos x cosh x = 1 (free). EA = GA = 1e7:
shear lowers the frequencies of Euler and Bernoulli by about (n pi)^2 EI/(2 GA), 5e-6 of the third.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.case.models.loads import Load
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.kernels.blocks import BlockMatrix
from fsm.model.bodies.group import body_pattern
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve import modal
from fsm.solve.equations.newton import equilibrium, negative_pivots
from fsm.solve.interface.records import Linearised
from fsm.solve.interface.system import System
from fsm.solve.modal import Modes, modes

STIFF = 1e7
BETA = {
    "cantilever": (1.87510407, 4.69409113, 7.85475744),
    "pinned": (math.pi, 2 * math.pi, 3 * math.pi),
    "free": (4.73004074, 7.85320462, 10.9956079),
}
COUNTS = (8, 16, 32, 64)


def joint(inner: str, outer: str, arm: float, flexible: float, bending: tuple[float, float, float]) -> ForceElement:
    """Joint between the end of `inner` and the start of `outer`, a piece of beam `flexible` long; arm: half a segment."""
    return ForceElement(
        name=f"{inner} - {outer}",
        inner=inner,
        outer=outer,
        point_inner=(arm if inner != GROUND else 0.0, 0.0, 0.0),
        point_outer=(-arm if outer != GROUND else 1.0, 0.0, 0.0),
        translation=(STIFF / flexible,) * 3,
        rotation=(bending[0] / flexible, bending[1] / flexible, bending[2] / flexible),
    )


def beam(
    count: int,
    ends: str,
    bending: tuple[float, float, float] = (1.0, 1.0, 1.0),
    polar: float = 2e-8,
    tip_mass: float = 0.0,
    loads: tuple[Load, ...] = (),
    stretch: float = 0.0,
) -> Scene:
    """Unit beam along x; torsion and bending stiffness of its joints, polar inertia a length."""
    length = 1.0 / count
    bodies = []
    for i in range(count):
        mass = length + (tip_mass if i == count - 1 else 0.0)
        across = length**3 / 12 + polar * length / 2
        bodies.append(
            Body(
                name=f"{i}",
                mass=mass,
                inertia=(polar * length, across, across),
                position=((i + 0.5) * length + (i + 0.5) * stretch * length, 0.0, 0.0),
            )
        )
    elements = [joint(f"{i}", f"{i + 1}", length / 2, length, bending) for i in range(count - 1)]
    pin = (bending[0], 0.0, 0.0)
    if ends == "cantilever":
        elements.append(joint(GROUND, "0", length / 2, length / 2, bending))
    elif ends == "pinned":
        elements.append(joint(GROUND, "0", length / 2, length / 2, pin))
        last = joint(f"{count - 1}", GROUND, length / 2, length / 2, pin)
        elements.append(last.model_copy(update={"point_outer": (1.0 + stretch, 0.0, 0.0)}))
    return Scene(bodies=tuple(bodies), elements=tuple(elements), loads=loads)


def found(scene: Scene, spatial: bool, count: int) -> tuple[SegmentSystem, Modes]:
    system = compile_scene(scene, spatial)
    assert system.spatial == spatial
    return system, modes(system, 0.0, system.initial()[0], count)


def dense(system: SegmentSystem | Given, q: np.ndarray) -> np.ndarray:
    """All omega^2."""
    stiffness = system.linearise(0.0, q, None).stiffness
    inertia = BlockMatrix(stiffness.pattern, system.inertia(q, stiffness.pattern))
    return eigh(stiffness.symmetric().bsr().toarray(), inertia.bsr().toarray(), eigvals_only=True)


class Given(System):
    """Matrices without mechanics: uncoupled copies of one chain, so that every frequency comes in a cluster."""

    def __init__(self, copies: int, length: int, step: float = 0.9) -> None:
        link = np.column_stack([np.arange(length - 1), np.arange(1, length)])
        pairs = [link + copy * length for copy in range(copies)]
        self.pattern = body_pattern(np.arange(copies * length), pairs, 3)
        self.data, self.mass = self.pattern.zeros(), self.pattern.zeros()
        self.data[:] = -step * np.eye(3)
        self.data[self.pattern.diagonal] = 2 * np.eye(3)
        self.mass[self.pattern.diagonal] = np.diag([1.0, 2.0, 3.0]) + 0.1  # not diagonal
        self.nu = 3 * copies * length

    def linearise(self, t: float, q: np.ndarray, u: np.ndarray | None) -> Linearised:
        matrix = BlockMatrix(self.pattern, self.data)
        return Linearised(np.zeros(self.nu), matrix, matrix)

    def inertia(self, q: np.ndarray, pattern: object) -> np.ndarray:
        return self.mass


NOWHERE = np.zeros(0)

# against exact frequencies --------------------------------------------------------------------------------------------


def test_cantilever_converges_with_second_order() -> None:
    exact = np.array(BETA["cantilever"]) ** 2
    omega = np.array([np.sqrt(found(beam(count, "cantilever"), False, 3)[1].squared) for count in COUNTS])
    errors = np.abs(omega / exact - 1)
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2.0, abs=0.1)
    assert omega[-1] + (omega[-1] - omega[-2]) / 3 == pytest.approx(exact, rel=2e-5)


@pytest.mark.parametrize(("ends", "rigid"), [("pinned", 0), ("free", 3)])
def test_without_a_clamp_better_than_second_order(ends: str, rigid: int) -> None:
    # the errors of O(l^2) come from the half cell of the clamp; the remaining errors are O(l^4) and the shear
    exact = np.array(BETA[ends]) ** 2
    for count in COUNTS:
        omega = np.sqrt(found(beam(count, ends), False, rigid + 3)[1].squared[rigid:])
        assert omega == pytest.approx(exact, rel=1e-5 + 25.0 / count**4)


def test_free_beam_has_its_rigid_motions() -> None:
    for spatial, rigid in ((False, 3), (True, 6)):
        _, result = found(beam(32, "free", (2e-6, 1.0, 4.0)), spatial, 12)
        assert np.abs(result.squared[:rigid]).max() < 50 * result.resolution
        assert result.squared[rigid] > 200.0
        assert not result.unstable.any()
        # the error was 620 times as large in the plane with one inverse iteration instead of three
        assert result.residuals.max() < 50 * result.resolution


def test_spatial_cantilever_bends_both_ways_and_twists() -> None:
    # EI_z = 4 EI_y: twice the frequencies; torsion: 10 (2k - 1) pi/2, from G J = 2e-6 and a polar inertia of 2e-8
    bends = np.array(BETA["cantilever"]) ** 2
    exact = np.sort(np.concatenate([bends, 2 * bends, 5 * math.pi * np.array([1, 3, 5])]))[:8]
    omega = [np.sqrt(found(beam(n, "cantilever", (2e-6, 1.0, 4.0)), True, 8)[1].squared) for n in COUNTS]
    errors = np.abs(omega / exact - 1)
    # the third frequency of the stiffer plane is four times closer to that of shear and rotary inertia
    assert np.log2(errors[1:-1] / errors[2:]) == pytest.approx(2.0, abs=0.1)
    planar = np.sqrt(found(beam(32, "cantilever"), False, 3)[1].squared)
    assert omega[2][[0, 3, 6]] == pytest.approx(planar, rel=1e-7)


def test_equal_stiffness_both_ways_gives_pairs() -> None:
    _, result = found(beam(32, "cantilever", (2e-6, 1.0, 1.0)), True, 12)
    pairs = np.array([0, 3, 6, 10])
    assert result.squared[pairs] == pytest.approx(result.squared[pairs + 1], abs=10 * result.resolution)
    assert result.squared[0] == pytest.approx(BETA["cantilever"][0] ** 4, rel=1e-3)


def test_string_under_tension() -> None:
    # f_n = n/(2 L) sqrt(N/mu); stretched by N/EA = 1e-5, joints without bending stiffness; the ends are pinned
    tension = 100.0
    exact = np.arange(1, 5) / 2 * math.sqrt(tension)
    errors = []
    for count in COUNTS:
        system, result = found(beam(count, "pinned", (0.0, 0.0, 0.0), stretch=tension / STIFF), False, 4)
        assert np.abs(system.force(0.0, system.initial()[0], None)).max() < 1e-6
        errors.append(result.frequencies / exact - 1)
    orders = np.log2(np.array(errors[1:-1]) / errors[2:])
    assert orders == pytest.approx(2.0, abs=0.1)


# unstable states ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("load", "planes"), [(2.0, 0), (30.0, 2), (70.0, 3), (300.0, 6)])
@pytest.mark.parametrize("spatial", [False, True])
def test_as_many_unstable_modes_as_critical_loads_passed(load: float, planes: int, spatial: bool) -> None:
    # Euler's loads of a cantilever: (2 k - 1)^2 pi^2/4 = 2.47, 22.2, 61.7, 121, 200, 299; in space every one twice
    push = Load(body="31", point=(1 / 64, 0.0, 0.0), force=(-load, 0.0, 0.0))
    system = compile_scene(beam(32, "cantilever", (2e-6, 1.0, 1.0), loads=(push,)), spatial)
    q = equilibrium(system, system.initial()[0], np.zeros(1))
    result = modes(system, 0.0, q, 15)
    expected = 2 * planes if spatial else planes
    assert int(result.unstable.sum()) == expected == negative_pivots(system, 0.0, q)
    np.testing.assert_array_equal(result.frequencies < 0.0, result.unstable)
    assert result.squared == pytest.approx(dense(system, q)[:15], abs=100 * result.resolution)


def test_a_follower_is_seen_in_the_asymmetry() -> None:
    def pushed(follower: bool) -> float:
        push = Load(body="15", point=(1 / 32, 0.0, 0.0), force=(-5.0, 0.0, 0.0), follower=follower)
        system = compile_scene(beam(16, "cantilever", loads=(push,)), False)
        q = equilibrium(system, system.initial()[0], np.zeros(1))
        return modes(system, 0.0, q, 3).asymmetry

    assert pushed(False) < 1e-12
    assert pushed(True) > 1e-8


# against the dense solver ---------------------------------------------------------------------------------------------


def strip(spatial: bool) -> SegmentSystem:
    data = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": 1.4,
            "segments_per_panel": 5 if spatial else 15,
        },
        "material": {"young": 3e9, "density": 800.0, "damping": 1e-2},
        "crease": {"law": "linear", "stiffness": 9e-3},
        "contact": {"stiffness": 1e9},
        "drive": [{"crease": 3, "speed": 0.02, "travel": 0.02}],
    }  # fmt: skip
    return compile_scene(build_scene(Case.model_validate(data)), spatial)


@pytest.mark.parametrize("spatial", [False, True])
def test_pulled_strip_as_a_dense_solver_has_it(spatial: bool) -> None:
    system = strip(spatial)
    q = system.initial()[0]
    exact = dense(system, q)
    for count, shift in ((1, None), (10, None), (10, exact[20] * 1.01)):
        result = modes(system, 0.0, q, count, shift)
        assert result.method == "lanczos"
        wanted = exact if shift is None else np.sort(exact[np.argsort(np.abs(exact - shift))[:count]])
        assert result.squared == pytest.approx(wanted[:count], rel=1e-10, abs=20 * result.resolution)
        assert result.residuals.max() < 100 * result.resolution


@pytest.mark.parametrize("spatial", [False, True])
def test_heavy_tip(spatial: bool) -> None:
    system, result = found(beam(32, "cantilever", (2e-6, 1.0, 1.0), tip_mass=1e4), spatial, 8)
    assert result.method == "lanczos"
    assert result.squared == pytest.approx(dense(system, system.initial()[0])[:8], abs=20 * result.resolution)
    # 3 EI/(m L^3), half a segment from the end; the mass of the beam is 1e-4 of the tip mass
    assert result.squared[0] == pytest.approx(3 / (1e4 * (1 - 1 / 64) ** 3), rel=2e-3)


@pytest.mark.parametrize(("copies", "length"), [(1, 8), (30, 4), (5, 20), (60, 2)])
@pytest.mark.parametrize("count", [1, 4, 35])
def test_clusters_are_complete(copies: int, length: int, count: int) -> None:
    system = Given(copies, length)
    first, second = modes(system, 0.0, NOWHERE, count), modes(system, 0.0, NOWHERE, count)  # type: ignore[arg-type]
    count = min(count, system.nu)
    assert first.squared == pytest.approx(dense(system, NOWHERE)[:count], rel=1e-10)
    np.testing.assert_array_equal(first.shapes, second.shapes)
    inertia = BlockMatrix(system.pattern, system.mass).bsr()
    assert first.shapes @ (inertia @ first.shapes.T) == pytest.approx(np.eye(count), abs=1e-12)
    assert first.residuals.max() < 100 * first.resolution


def test_any_number_of_modes() -> None:
    system = Given(1, 24)
    exact = dense(system, NOWHERE)
    for count in range(1, system.nu + 3):
        result = modes(system, 0.0, NOWHERE, count)  # type: ignore[arg-type]
        assert result.squared == pytest.approx(exact[:count], rel=1e-10)
        assert result.shapes.shape == (min(count, system.nu), system.nu)


def test_far_below_zero_and_near_it_at_once() -> None:
    system = Given(3, 20)
    system.data[system.pattern.diagonal[7]] = -1e6 * np.eye(3)
    result = modes(system, 0.0, NOWHERE, 8)  # type: ignore[arg-type]
    assert result.squared == pytest.approx(dense(system, NOWHERE)[:8], rel=1e-10, abs=20 * result.resolution)
    assert int(result.unstable.sum()) == 3


def test_a_mode_that_lanczos_missed_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    system, near, calls = Given(4, 10), modal._near, []

    def forgetful(problem: modal._Problem, shift: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        squared, shapes = near(problem, shift, count)
        calls.append(count)
        kept = np.arange(count) != 1 if len(calls) == 1 else np.full(count, True)
        return squared[kept], shapes[kept]

    monkeypatch.setattr(modal, "_near", forgetful)
    result = modes(system, 0.0, NOWHERE, 6)  # type: ignore[arg-type]
    assert len(calls) == 2
    assert result.squared == pytest.approx(dense(system, NOWHERE)[:6], rel=1e-10)


def test_the_sign_of_a_mode_does_not_depend_on_the_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    """Solvers may give a mode of either sign."""
    system, solver = Given(1, 6), modal._dense
    before = modes(system, 0.0, NOWHERE, 18).shapes  # type: ignore[arg-type]

    def turned(*arguments: Any) -> tuple[np.ndarray, np.ndarray]:
        squared, shapes = solver(*arguments)
        return squared, -shapes

    monkeypatch.setattr(modal, "_dense", turned)
    found = modes(system, 0.0, NOWHERE, 18).shapes  # type: ignore[arg-type]
    np.testing.assert_array_equal(found, before)


def test_no_modes_of_nothing() -> None:
    system = compile_scene(Scene(bodies=(Body(name="a", mass=1.0, inertia=(1.0, 1.0, 1.0), held=True),)), False)
    assert len(modes(system, 0.0, system.initial()[0]).squared) == 0
    with pytest.raises(ValueError, match="1 or more"):
        modes(system, 0.0, system.initial()[0], 0)
