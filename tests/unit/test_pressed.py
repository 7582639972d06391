"""Contacts that Newton's method of statics linearises at other depths: unchanged quantities, and convergence."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.case.models.contact import Contact
from fsm.interactions.contact.contact_depths import advance_depths
from fsm.laws.normal import NORMAL_LAWS
from fsm.model.bodies.group import BlockSums, BodyState
from fsm.model.contact.contact_memory import ContactDepths
from fsm.model.system.system import SegmentSystem
from tests.unit.test_contact_forces import SPATIAL, only_contacts, pressed, pressed_strip

TIME = 0.5
SINCE = 0.02


def own_depths(system: SegmentSystem, q: np.ndarray) -> tuple[ContactDepths, ...]:
    """Depths of the contacts without this change."""
    group = only_contacts(system)
    touching = group.geometry.find(system.place(TIME, q, None)[0], 0.0)
    assert len(touching.slot) > 3
    return (ContactDepths(group.geometry.keys(touching.slot), -touching.gap, 0.0),)


def moved(system: SegmentSystem, seed: int, size: float) -> np.ndarray:
    """Increments of all coordinates: m and radians times size."""
    return size * np.random.default_rng(seed).normal(size=system.nu) * system.scales().increment


@SPATIAL
@pytest.mark.parametrize("damping", [0.0, 40.0], ids=["elastic", "damped"])
def test_linearised_at_their_own_depths_they_are_as_ever(spatial: bool, damping: float) -> None:
    system = pressed_strip(spatial, friction=True, damping=damping)
    q = pressed(system, 3)
    before = (TIME - SINCE, system.retract(q, moved(system, 4, 1e-3)))
    u = system.difference(before[1], q) / SINCE
    efforts = system.efforts(TIME, q, before)
    plain = system.linearise(TIME, q, u, before)
    mixed = system.linearise(TIME, q, u, before, efforts, own_depths(system, q))
    size = np.abs(plain.force).max()
    np.testing.assert_allclose(mixed.force, plain.force, atol=1e-12 * size)
    for own, other in ((mixed.stiffness, plain.stiffness), (mixed.damping, plain.damping)):
        np.testing.assert_allclose(own.data, other.data, atol=1e-11 * np.abs(other.data).max())


@SPATIAL
def test_at_another_depth_the_force_is_on_the_tangent_of_the_law_there(spatial: bool) -> None:
    """1e6 d^1.5 on every contact becomes 1e6 (d*^1.5 + 1.5 d*^0.5 (d - d*)), and friction with it."""
    system = pressed_strip(spatial, friction=True)
    q = pressed(system, 3)
    u = np.random.default_rng(5).normal(size=system.nu) * system.scales().velocity
    (own,) = own_depths(system, q)
    half = ContactDepths(own.key, 0.5 * own.depth, 0.0)
    group = only_contacts(system)
    poses, rates = system.place(TIME, q, u)

    def acting(depths: ContactDepths | None) -> np.ndarray:
        pattern = system.linearise(TIME, q, u).stiffness.pattern
        force = np.zeros(rates.shape)
        at = BodyState(TIME, poses, rates)
        group.add_linearised(at, BlockSums(pattern, force, pattern.zeros(), pattern.zeros()), depths)
        return force

    # at half of every depth: sqrt(1/8) + 1.5 sqrt(1/2) 1/2 of the normal force and of the friction
    np.testing.assert_allclose(acting(half), (0.125**0.5 + 0.75 * 0.5**0.5) * acting(None), rtol=1e-9, atol=1e-9)


@SPATIAL
@pytest.mark.parametrize("damping", [0.0, 40.0], ids=["elastic", "damped"])
def test_advanced_they_are_the_new_depths_to_first_order(spatial: bool, damping: float) -> None:
    system = pressed_strip(spatial, damping=damping)
    q = pressed(system, 3)
    before = (TIME - SINCE, system.retract(q, moved(system, 4, 1e-5)))
    errors = []
    for size in (1e-6, 5e-7):
        dx = moved(system, 6, size)
        u = system.difference(before[1], q) / SINCE
        (advanced,) = system.advance_depths(TIME, q, u, before, dx, own_depths(system, q))
        there = system.retract(q, dx)
        (found,) = own_depths(system, there)
        np.testing.assert_array_equal(advanced.key, found.key)
        # the law at the new depth and rate equals the extrapolated force
        law, share = only_contacts(system).normal, only_contacts(system).geometry.share[found.key]
        kept = np.zeros(len(found.key))
        closing = []
        for state in (q, there):
            poses, rates = system.place(TIME, state, system.difference(before[1], state) / SINCE, before)
            closing.append(-only_contacts(system).geometry.measure(poses, rates, 0.0).rate[:, 0])
        depth = own_depths(system, q)[0].depth
        old, slopes = law.law.force(depth, closing[0], kept, share, law.params)
        new, _ = law.law.force(found.depth, closing[1], kept, share, law.params)
        by_force = depth * (new / old) ** (old / (depth * slopes[:, 0]))
        errors.append(np.abs(advanced.depth - by_force).max())
    assert errors[0] > 3.0 * errors[1]


@pytest.mark.parametrize(("name", "exponent"), [("linear", 1.0), ("hertz", 1.5)])
@pytest.mark.parametrize("depth", [2e-6, 2e-5], ids=["in the ramp", "beyond the ramp"])
@pytest.mark.parametrize("closing", [0.0, 1e-4, -1e-5])
def test_depths_converge_to_the_geometric_depth(name: str, exponent: float, depth: float, closing: float) -> None:
    """Iterations without motion; with the exponent of the law at large depths, the depths in the ramp would alternate."""
    law = NORMAL_LAWS[name]
    params = law.params(Contact(law=name, exponent=exponent, stiffness=1e5, damping=50.0, ramp=1e-5))
    speed, weight, still = np.array([closing]), np.ones(1), np.zeros((1, 3))
    at = np.array([0.3 * depth])
    for _ in range(40):
        normal, slopes = law.force(at, speed, np.zeros(1), weight, params)
        acting = normal + slopes[:, 0] * (depth - at)
        at = advance_depths(
            np.zeros((1, 1), dtype=int), np.zeros((1, 2, 3)), still, 50.0, at, normal, acting,
            np.ascontiguousarray(slopes[:, 0]), np.ascontiguousarray(slopes[:, 1]),
        )  # fmt: skip
    assert at[0] == pytest.approx(depth, rel=1e-9)


def test_a_contact_that_has_opened_is_held_until_it_would_pull() -> None:
    system = pressed_strip(False)
    q = pressed(system, 3, depth=-4e-4)  # apart by some tenths of a millimetre
    group = only_contacts(system)
    poses, rates = system.place(TIME, q, None)
    assert not len(group.geometry.find(poses, 0.0).slot)
    near = group.geometry.find(poses, group.geometry.margin)
    closest = near.slot[[np.argmin(near.gap)]]
    held = (ContactDepths(closest, np.array([1e-6]), 0.0),)
    pattern = system.linearise(TIME, q, None).stiffness.pattern
    force = np.zeros(rates.shape)
    group.add_linearised(BodyState(TIME, poses, rates), BlockSums(pattern, force, pattern.zeros(), pattern.zeros()), held[0])
    assert np.abs(force).max() > 0.0  # drawn together, as far as this iteration moves them
    together = np.zeros((system.n_free, 3))
    for row, body in enumerate(system.bodies.free):
        panel = system.bodies.names[body].split()[1]
        together[row, 0] = {"3": 1e-3, "4": -1e-3}.get(panel, 0.0)
    (stays,) = system.advance_depths(TIME, q, None, None, together.ravel(), held)
    assert stays.key.tolist() == closest.tolist()
    assert stays.depth[0] > 1e-6
    (gone,) = system.advance_depths(TIME, q, None, None, -together.ravel(), held)
    assert not len(gone.key)


def test_new_contacts_are_taken_no_deeper_than_the_largest_reaction_presses_them() -> None:
    system = pressed_strip(False)
    q = pressed(system, 3)
    group, depth = only_contacts(system), own_depths(system, q)[0].depth
    key, most = own_depths(system, q)[0].key, 0.3
    share = group.geometry.share[key]
    poses, rates = system.place(TIME, q, None)
    pattern = system.linearise(TIME, q, None).stiffness.pattern

    def linearised(known: ContactDepths) -> np.ndarray:
        """Depths at which the law is linearised."""
        force = np.zeros(rates.shape)
        at = BodyState(TIME, poses, rates)
        group.add_linearised(at, BlockSums(pattern, force, pattern.zeros(), pattern.zeros()), known)
        assert group.geometry.keys(group.geometry.common.slot[: len(key)]).tolist() == key.tolist()
        return group.geometry.common.at[: len(key)].copy()

    def elastic(depth: np.ndarray) -> np.ndarray:
        still, law = np.zeros_like(depth), group.normal.law
        return np.asarray(law.force(depth, still, np.ones_like(depth), share, group.normal.params)[0])

    at = linearised(ContactDepths(key[:0], np.zeros(0), most))
    force = elastic(depth)
    np.testing.assert_allclose(elastic(at), np.minimum(force, most), rtol=1e-12)
    assert force.max() > most > 0.0
    known = linearised(ContactDepths(key[1:3], np.array([1e-6, 2e-6]), most))
    assert known[1:3].tolist() == [1e-6, 2e-6]
    assert known[0] == at[0]
