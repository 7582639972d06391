"""Observed quantities of contact pairs: areas of faces, friction and slip, and where the power is dissipated."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.scene import Body, ContactPair, Plate, Scene, Surface
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.interface.records import PairState
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

SPATIAL = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
LENGTH, WIDTHS, COUNT, THICKNESS = 0.06, (0.04, 0.03), 3, 1e-3
MU = 0.2


def stack(spatial: bool, friction: bool = True, layers: int = 2) -> SegmentSystem:
    """Panels of three loose segments each, one above the other with their faces just touching."""
    bodies, surfaces = [], []
    for layer in range(layers):
        plate = Plate(length=LENGTH / COUNT, width=WIDTHS[layer % 2], thickness=THICKNESS)
        names = [f"{layer}.{k}" for k in range(COUNT)]
        surfaces.append(Surface(name=f"panel {layer}", bodies=tuple(names)))
        bodies += [
            Body(
                name=name, mass=1e-3, inertia=(1e-7, 1e-7, 1e-7), plate=plate,
                position=((k + 0.5) * LENGTH / COUNT, 0.0, layer * THICKNESS),
            )
            for k, name in enumerate(names)
        ]  # fmt: skip
    pairs = tuple(ContactPair(first=a.name, second=b.name) for a, b in pairwise(surfaces))
    scene = Scene(
        bodies=tuple(bodies),
        surfaces=tuple(surfaces),
        pairs=pairs,
        contact=Contact(stiffness=1e8, damping=20.0, ramp=1e-5),
        friction=Friction(mu_static=0.3, mu_dynamic=MU, v_static=1e-3, v_dynamic=1e-2) if friction else None,
    )
    return compile_scene(scene, spatial)


def moved(system: SegmentSystem, across: float, along: float) -> np.ndarray:
    """A planar or spatial change of all bodies: each upper layer is moved further than the layer below."""
    change = np.zeros((system.n_free, system.size))
    for row, body in enumerate(system.bodies.free):
        layer = int(system.bodies.names[body].split(".")[0])
        change[row, 0] = layer * along
        change[row, 2 if system.spatial else 1] = layer * across
    return change.ravel()


def seen(system: SegmentSystem, depth: float, along: float = 0.0, speed: float = 0.0, closing: float = 0.0) -> PairState:
    q = system.retract(system.initial()[0], moved(system, -depth, along))
    return system.observe(0.0, q, moved(system, -closing, speed)).pairs


@SPATIAL
def test_area_of_faces_that_lie_on_each_other(spatial: bool) -> None:
    """Each face is checked against the other with half its weight; the sum is the mean of both."""
    system = stack(spatial)
    pairs = seen(system, depth=1e-5)
    assert pairs.area == pytest.approx([LENGTH * (WIDTHS[0] + WIDTHS[1]) / 2], rel=1e-12)
    assert pairs.gap == pytest.approx([-1e-5], rel=1e-6)
    assert system.contacts[0].geometry.area.sum() == pytest.approx(pairs.area[0], rel=1e-12)
    assert seen(system, depth=-1e-5).area == pytest.approx([0.0], abs=0.0)


@SPATIAL
def test_area_of_faces_that_lie_on_each_other_in_part(spatial: bool) -> None:
    """Accurate to the area of the points next to the edges."""
    area = seen(stack(spatial), depth=1e-5, along=0.4 * LENGTH).area[0]
    spacing = LENGTH / COUNT / 2
    assert area == pytest.approx(0.6 * LENGTH * 0.035, abs=spacing * 0.035)


@SPATIAL
def test_friction_and_slip_of_a_face_that_slides(spatial: bool) -> None:
    """All contacts slide alike, faster than v_dynamic: Coulomb's law for the whole face."""
    pairs = seen(stack(spatial), depth=1e-5, speed=0.05)
    assert pairs.force[0] > 0.1
    assert pairs.slip == pytest.approx([0.05], rel=1e-6)
    assert pairs.friction == pytest.approx(MU * pairs.force, rel=1e-6)
    assert pairs.friction_power == pytest.approx(pairs.friction * 0.05, rel=1e-6)
    assert pairs.damping_power == pytest.approx([0.0], abs=1e-12 * pairs.friction_power[0])


@SPATIAL
def test_damping_power_of_faces_that_close(spatial: bool) -> None:
    """Beyond the ramp the damper is that of the whole face: C v^2."""
    pairs = seen(stack(spatial, friction=False), depth=3e-5, closing=0.02)
    assert pairs.damping_power == pytest.approx([20.0 * 0.02**2], rel=1e-6)
    assert not pairs.friction.any()
    assert pairs.slip == pytest.approx([0.0], abs=1e-9)


@SPATIAL
def test_nothing_touches(spatial: bool) -> None:
    pairs = seen(stack(spatial), depth=-1e-4, speed=0.05, closing=0.02)
    assert pairs.gap[0] == pytest.approx(1e-4, rel=1e-6)
    for name, values in vars(pairs).items():
        assert name == "gap" or not values.any(), name


@SPATIAL
@pytest.mark.parametrize("friction", [True, False])
def test_powers_of_the_pairs_are_all_that_is_dissipated(spatial: bool, friction: bool) -> None:
    system, rng = stack(spatial, friction, layers=3), np.random.default_rng(4)
    q = system.retract(system.initial()[0], moved(system, -1e-5, 0.0))
    size = 1e-6 * np.ones((system.n_free, system.size))
    size[:, system.size // 2 + (not spatial) :] *= 100.0
    q = system.retract(q, (size * rng.normal(size=size.shape)).ravel())
    u = (0.02 * rng.normal(size=(system.n_free, system.size)) * (size / 1e-6) ** 0.5).ravel()
    observed = system.observe(0.0, q, u)
    pairs, energy = observed.pairs, observed.energy
    assert (pairs.force > 0.0).all()
    total = pairs.friction_power.sum() + pairs.damping_power.sum()
    assert total == pytest.approx(energy.dissipated_power, rel=1e-12)
    at_rest, _ = system.balance(0.0, q, None, contacts=True)
    forces = at_rest.reshape(system.n_free, system.size)[:, : 3 if spatial else 2]
    assert system.contact_force(0.0, q) >= np.abs(forces).max() > 0.0
    assert (pairs.damping_power > 0.0).all()
    assert (pairs.friction_power > 0.0).all() == friction
    np.testing.assert_array_equal(energy.pair_power, [pairs.friction_power, pairs.damping_power])
    # and this is the power that the forces remove from the motion
    moving, resting = system.force(0.0, q, u), system.force(0.0, q, 0 * u)
    gyroscopic = 0.0 if not spatial else float(only_gyroscopic(system, u) @ u)
    assert energy.dissipated_power == pytest.approx(-float((moving - resting) @ u) + gyroscopic, rel=1e-9)


def only_gyroscopic(system: SegmentSystem, u: np.ndarray) -> np.ndarray:
    apart = system.retract(system.initial()[0], moved(system, 0.1, 0.0))
    return system.force(0.0, apart, u)


@pytest.mark.parametrize("method", ["Radau", "BDF", "generalized-alpha"])
def test_energies_of_the_pairs_are_all_that_was_dissipated(method: str) -> None:
    """A plate is thrown onto another and slides: no other element dissipates energy."""
    system = stack(False)
    q, u = system.retract(system.initial()[0], moved(system, 2e-5, 0.0)), moved(system, -0.01, 0.05)
    saved: list[SavedState] = []
    settings = Settings(method, 1e-6, 5e-3)
    _, energy_balance = simulate(system, settings, list(np.linspace(0.0, 5e-3, 101)), saved.append, start=(0.0, q, u))
    assert energy_balance.relative_error < 1e-3
    for state in saved:
        assert abs(state.error) < 1e-3 * energy_balance.dissipated
        assert state.pair_energy.sum() == pytest.approx(state.dissipated, rel=1e-9, abs=1e-15)
    friction, damping = saved[-1].pair_energy[:, 0]
    assert friction > 0.0
    assert damping > 0.0
    assert energy_balance.pair_energy == pytest.approx(saved[-1].pair_energy, rel=1e-9)


def test_groups_that_share_a_pair_are_put_together() -> None:
    force, slip = np.array([1.0, 0.0, 2.0]), np.array([0.3, 0.0, 0.1])
    one = PairState(force, np.array([-1.0, 3.0, -1.0]), force, force, slip, force, 2 * force)
    other = PairState(3 * force, np.array([2.0, 1.0, -2.0]), force, 2 * force, 2 * slip, force, force)
    both = one.joined(other)
    np.testing.assert_array_equal(both.force, 4 * force)
    np.testing.assert_array_equal(both.gap, [-1.0, 1.0, -2.0])
    np.testing.assert_array_equal(both.area, 2 * force)
    np.testing.assert_array_equal(both.friction, 3 * force)
    np.testing.assert_allclose(both.slip, (0.25 + 1.5) * slip)
    np.testing.assert_array_equal(both.friction_power, 2 * force)
    np.testing.assert_array_equal(both.damping_power, 3 * force)
