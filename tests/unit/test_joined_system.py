"""Rigid bodies and ANCF elements in one system: tangents, energies and maps of frames against differences."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.case.models.flexible import SceneCable, SceneFilm, SceneFrame
from fsm.case.models.loads import Drive, Load
from fsm.case.models.scene import Body, ForceElement, Plate, Scene
from fsm.kernels.body_poses import pose_difference
from fsm.model.bodies.group import BodyState
from fsm.model.compile.compile_joined import compile_model
from fsm.model.joined.system import JoinedSystem
from tests.tangents import differences


def scene(damped: bool = True) -> Scene:
    """A film with one held edge, a cable from its corner to a plate, and a second plate hinged to the film."""
    damping = (0.02, 0.03, 0.01) if damped else (0.0, 0.0, 0.0)
    viscosity = 1e-3 if damped else 0.0
    weight = Body(
        name="weight", mass=0.02, inertia=(2e-5, 3e-5, 4e-5), position=(0.5, 0.3, -0.2), velocity=(0.1, 0.2, -0.1),
        angular_velocity=(1.0, -2.0, 3.0), plate=Plate(length=0.05, width=0.05, thickness=1e-3),
    )  # fmt: skip
    turned = (np.cos(0.3), 0.0, np.sin(0.3), 0.0)
    flap = Body(name="flap", mass=0.01, inertia=(1e-5, 2e-5, 2.5e-5), position=(0.25, 0.0, 0.05), orientation=turned)
    film = SceneFilm(
        name="sail", length=0.4, width=0.3, thickness=1e-4, young=3e9, density=1400.0, mesh=(3, 2),
        orientation=(np.cos(0.1), np.sin(0.1), 0.0, 0.0), strain=(1e-3, 5e-4), viscosity=viscosity, held=("left",),
    )  # fmt: skip
    cable = SceneCable(
        name="rope", start=(0.25, 0.15, 0.03), end=(0.5, 0.3, -0.2), diameter=2e-3, young=1e9, density=900.0,
        elements=3, strain=1e-3, viscosity=viscosity,
    )  # fmt: skip
    frames = (
        SceneFrame(name="corner", on="sail", at=(0.2, 0.15)),
        SceneFrame(name="inside", on="sail", at=(0.13, 0.02)),
        SceneFrame(name="rope start", on="rope", at=(0.0,)),
        SceneFrame(name="rope end", on="rope", at=(0.37,)),
    )
    stiff = (1e3, 2e3, 3e3)
    elements = (
        ForceElement(name="a", inner="rope start", outer="corner", translation=stiff, translation_damping=damping),
        ForceElement(
            name="b", inner="weight", outer="rope end", translation=stiff, rotation=(0.01, 0.02, 0.03),
            point_inner=(0.01, 0.0, 0.005), rotation_damping=damping,
        ),
        ForceElement(
            name="c", inner="flap", outer="inside", translation=stiff, rotation=(0.3, 0.05, 0.2),
            point_inner=(-0.02, 0.0, 0.0), translation_damping=damping, rotation_damping=damping,
        ),
        ForceElement(name="d", inner="inside", outer="ground", translation=(10.0, 20.0, 5.0), rotation=(0.1, 0.1, 0.1)),
        ForceElement(name="e", inner="rope end", outer="corner", translation=(3.0, 2.0, 5.0)),
    )  # fmt: skip
    load = Load(body="corner", force=(0.1, 0.2, 0.3), moment=(0.01, 0.02, -0.03), follower=True)
    return Scene(
        bodies=(weight, flap), films=(film,), cables=(cable,), frames=frames, elements=elements, loads=(load,),
        gravity=(0.0, 0.5, -9.81),
    )  # fmt: skip


def moved(damped: bool = True, seed: int = 1) -> tuple[JoinedSystem, np.ndarray, np.ndarray]:
    system = compile_model(scene(damped))
    assert isinstance(system, JoinedSystem)
    generator = np.random.default_rng(seed)
    q, u = system.initial()
    q = system.retract(q, 0.02 * generator.standard_normal(system.nu) * ~system._fixed.ravel())
    u = u + 0.3 * generator.standard_normal(system.nu) * ~system._fixed.ravel()
    return system, q, u


def close(found: np.ndarray, wanted: np.ndarray, free: np.ndarray, rtol: float) -> None:
    scale = np.abs(wanted[np.ix_(free, free)]).max()
    rows = np.abs(wanted[np.ix_(free, free)]).max(axis=1, keepdims=True) + 1e-6 * scale
    assert np.all(np.abs(found - wanted)[np.ix_(free, free)] <= rtol * rows)


@pytest.mark.parametrize("moving", [False, True])
def test_tangents_are_those_of_the_force(moving: bool) -> None:
    system, q, u = moved()
    free = ~system._fixed.ravel()
    rates = u if moving else None
    linear = system.linearise(0.0, q, rates)
    assert np.allclose(linear.force, system.force(0.0, q, rates), rtol=1e-12, atol=1e-12)
    stiffness, damping = linear.stiffness.bsr().toarray(), linear.damping.bsr().toarray()
    by_q = -differences(lambda d: system.force(0.0, system.retract(q, d), rates), np.full(system.nu, 1e-6))
    close(stiffness, by_q, free, 1e-5)
    if moving:
        close(damping, -differences(lambda d: system.force(0.0, q, u + d), np.full(system.nu, 1e-4)), free, 1e-5)


def test_tangent_with_a_past_is_that_of_the_force() -> None:
    """Rates are increments since the last state over the time."""
    system, q, _ = moved()
    free = ~system._fixed.ravel()
    generator = np.random.default_rng(5)
    before = 0.0, system.retract(q, 0.01 * generator.standard_normal(system.nu) * free)
    t = 0.05

    def force(step: np.ndarray) -> np.ndarray:
        here = system.retract(q, step)
        return system.force(t, here, system.difference(before[1], here) / t, before)

    linear = system.linearise(t, q, system.difference(before[1], q) / t, before)
    whole = linear.stiffness.bsr().toarray() + linear.damping.bsr().toarray() / t
    close(whole, -differences(force, np.full(system.nu, 1e-6)), free, 2e-5)


def test_force_without_damping_is_the_slope_of_the_energy() -> None:
    system, q, _ = moved(damped=False)
    free = ~system._fixed.ravel()
    load = system.groups[-2]
    stored = lambda x: system.energy(0.0, system.retract(q, x), None).stored  # noqa: E731
    slope = np.where(free, differences(stored, np.full(system.nu, 1e-6)), 0.0)
    poses, rates = system.place(0.0, q, None)
    forces = np.zeros(rates.shape)
    load.add_force(BodyState(0.0, poses, rates), forces)
    applied = system._generalised(0.0, q, None, None, forces, whole=False)
    found = system.force(0.0, q, None) - applied
    assert np.allclose(found[free], -slope[free], rtol=1e-5, atol=1e-6 * np.abs(slope).max())


def test_power_is_the_rate_of_the_energy() -> None:
    system, q, u = moved()
    u = u * ~system._fixed.ravel()
    step = 1e-6
    along = system.retract(q, step * u), system.retract(q, -step * u)
    kinetic = float(u @ system.force(0.0, q, u))
    stored = [system.energy(0.0, here, None).stored for here in along]
    seen = system.energy(0.0, q, u)
    assert kinetic == pytest.approx(
        seen.input_power - seen.dissipated_power - (stored[0] - stored[1]) / (2.0 * step), rel=1e-5
    )


def test_increments_are_those_at_the_state_asked_for_last() -> None:
    system, q, u = moved()
    other = system.retract(q, 0.05 * u)
    system.place(0.0, q, None)
    expected = system.change(u)
    system.place(0.0, other, None)
    assert not np.allclose(system.change(u), expected)
    system.place(0.0, q, None)
    assert np.array_equal(system.change(u), expected)


def test_drives_have_their_mean_velocity_since_a_past_state() -> None:
    drive = Drive(body="flap", direction=(1.0, 0.0, 0.0), speed=0.1, travel=0.1, run_up=0.05)
    system = compile_model(scene().model_copy(update={"drives": (drive,)}))
    q, u = system.initial()
    t, row = 0.5, system.bodies.names.index("flap")
    at, mean = (system.place(t, q, u, before)[1][row, 0] for before in (None, (0.0, q)))
    assert mean == pytest.approx(system.motions[0].at(t)[0] / t)
    assert at == pytest.approx(system.motions[0].at(t)[1])
    assert at > 1.5 * mean


def test_frames_follow_their_elements() -> None:
    """The rate of a frame is the change of its pose."""
    system, q, u = moved()
    step = 1e-6
    rows = system.frames.bodies
    ends = [system.place(0.0, system.retract(q, sign * step * u), None)[0][rows].ravel() for sign in (-1.0, 1.0)]
    _, rates = system.place(0.0, q, u)
    found = np.asarray(pose_difference(*ends)).reshape(-1, 6) / (2.0 * step)
    assert np.allclose(found, rates[rows], rtol=1e-6, atol=1e-6)
