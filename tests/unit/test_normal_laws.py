"""Every law of the normal force: slopes against central differences, smooth start, no pull, energy, dissipation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from fsm.case.models.contact import NORMAL_KEYS, Contact
from fsm.laws.normal import NORMAL_LAWS
from fsm.laws.normal.flores import damping_factor as flores
from fsm.laws.normal.hunt_crossley import damping_factor as hunt_crossley
from fsm.laws.normal.lankarani_nikravesh import damping_factor as lankarani_nikravesh
from fsm.laws.normal.restitution import damping_factor as exact

K, C, RAMP = 2e5, 40.0, 1e-4
FLOOR = 1e-3
RESTITUTION = [name for name, law in NORMAL_LAWS.items() if law.restitution]
CONTACTS = {
    **{name: Contact(law=name, stiffness=K, damping=C, ramp=RAMP) for name in ("hertz", "impact", "linear")},
    "hertz 2.2": Contact(stiffness=K, exponent=2.2, damping=C, ramp=RAMP),
    "undamped": Contact(stiffness=K),
    **{
        f"{name} {c}": Contact(law=name, stiffness=K, restitution=c, speed_floor=FLOOR)
        for name in RESTITUTION
        for c in (0.1, 0.5, 0.9)
    },
}
every_contact = pytest.mark.parametrize("contact", CONTACTS.values(), ids=CONTACTS.keys())


def evaluate(
    contact: Contact, depth: np.ndarray, closing: np.ndarray, onset: np.ndarray | float = 0.0, share: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    law = NORMAL_LAWS[contact.law]
    shape = np.shape(depth)
    onset, share = np.broadcast_to(onset, shape).copy(), np.full(shape, share)
    return law.force(np.asarray(depth, float), np.asarray(closing, float), onset, share, law.params(contact))


def states(seed: int, count: int = 4000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depths, closing speeds of both signs and onset speeds, half of them 0, over several decades."""
    rng = np.random.default_rng(seed)
    depth = 10 ** rng.uniform(-6, -2, count)
    closing = 10 ** rng.uniform(-5, 1, count) * rng.choice([-1.0, 1.0], count)
    onset = 10 ** rng.uniform(-5, 1, count) * rng.choice([0.0, 1.0], count)
    return depth, closing, onset


def test_the_scene_knows_the_same_laws() -> None:
    assert list(NORMAL_LAWS) == list(NORMAL_KEYS)
    for name, keys in NORMAL_KEYS.items():
        assert NORMAL_LAWS[name].restitution == ("restitution" in keys.needed)


@every_contact
def test_slopes(contact: Contact) -> None:
    """All branches: below and above the ramp, with known and unknown onset speed, and separating so fast that the force is
    cut off."""
    depth, closing, onset = states(1)
    away = np.abs(depth / RAMP - 1) > 5e-3
    depth, closing, onset = depth[away], closing[away], onset[away]
    force, slopes = evaluate(contact, depth, closing, onset)
    steps = (1e-3 * depth, 1e-3 * np.minimum(np.abs(closing), FLOOR))
    for column, step in enumerate(steps):
        moved = [
            evaluate(contact, depth + n * step * (column == 0), closing + n * step * (column == 1), onset)[0]
            for n in (-2, -1, 1, 2)
        ]
        found = (8 * (moved[2] - moved[1]) - (moved[3] - moved[0])) / (12 * step)
        same = (moved[0] > 0) == (moved[3] > 0)  # not across the cut-off
        assert same.mean() > 0.98
        # besides the error of the difference, round-off of the force
        allowed = 1e-9 * np.abs(slopes[:, column]) + 1e-14 * force / step
        assert np.all(np.abs(found - slopes[:, column])[same] <= allowed[same])
    if contact.law not in ("hertz", "impact", "linear") or contact.damping > 0:
        assert 0.02 < np.mean(force == 0.0) < 0.6
        assert not slopes[force == 0.0].any()
    else:
        assert np.all(force > 0.0) and not slopes[:, 1].any()


@every_contact
@pytest.mark.parametrize("onset", [0.0, 0.5])
@pytest.mark.parametrize("closing", [-0.3, 0.0, 0.3])
def test_start_is_smooth(contact: Contact, closing: float, onset: float) -> None:
    """No force at and above the face; force and slope grow from zero with the depth, damping included."""
    outside = np.array([0.0, -1e-9, -1.0])
    force, slopes = evaluate(contact, outside, np.full(3, closing), onset)
    assert not force.any() and not slopes.any()
    depth = 10.0 ** -np.arange(6, 15)
    force, slopes = evaluate(contact, depth, np.full(9, closing), onset)
    # of all laws here: K d^1.5 (1 + h d'/v0) or K d^2/(2 ramp), and STEP < 3 (d/ramp)^2; the largest h is Flores'
    h = flores(0.1)
    most = (1 + h) * K * depth**1.5 + K * depth**2 / RAMP + 3 * C * (depth / RAMP) ** 2
    assert np.all(force <= most)
    assert np.all(np.abs(slopes[:, 0]) <= 2.2 * most / depth)
    assert np.all(np.abs(slopes[:, 1]) <= 1.001 * h * K * depth**1.5 / FLOOR + 3 * C * (depth / RAMP) ** 2)


@every_contact
@given(depth=st.floats(1e-9, 1e-2), closing=st.floats(-1e3, 1e3), onset=st.sampled_from([0.0, 1e-6, 1e-2, 1.0]))
def test_never_pulls(contact: Contact, depth: float, closing: float, onset: float) -> None:
    (force,), (slopes,) = evaluate(contact, np.array([depth]), np.array([closing]), onset)
    assert force >= 0.0 and slopes[1] >= 0.0
    (elastic,), _ = evaluate(contact, np.array([depth]), np.zeros(1), onset)
    assert (force - elastic) * closing >= 0.0  # the damping force dissipates energy
    if force == 0.0:
        assert closing < 0.0 and not slopes.any()


@every_contact
def test_share_multiplies_everything(contact: Contact) -> None:
    depth, closing, onset = states(2, 100)
    whole, part = evaluate(contact, depth, closing, onset), evaluate(contact, depth, closing, onset, 0.3)
    for a, b in zip(whole, part, strict=True):
        np.testing.assert_allclose(0.3 * a, b, rtol=1e-14)
    law = NORMAL_LAWS[contact.law]
    energies = [law.energy(depth, np.full(100, w), law.params(contact)) for w in (1.0, 0.3)]
    np.testing.assert_allclose(0.3 * energies[0], energies[1], rtol=1e-14)


@every_contact
def test_energy_is_the_integral_of_the_elastic_force(contact: Contact) -> None:
    law = NORMAL_LAWS[contact.law]
    for depth in (-1e-3, 0.0, 0.3 * RAMP, RAMP, 20 * RAMP):
        energy = law.energy(np.array([depth]), np.array([0.3]), law.params(contact))[0]
        work = 0.0
        if depth > 0:
            points = [RAMP] if depth > RAMP else None
            work = quad(
                lambda d: evaluate(contact, np.array([d]), np.zeros(1), 0.5, 0.3)[0][0], 0.0, depth,
                epsabs=0, epsrel=1e-12, points=points,
            )[0]  # fmt: skip
        assert energy == pytest.approx(work, rel=1e-9, abs=0.0)


@every_contact
@pytest.mark.parametrize("onset", [0.0, 0.05])
def test_a_closed_cycle_takes_energy_out(contact: Contact, onset: float) -> None:
    """d = a (1 - cos(w t))/2: the work equals the loss of the damping, and vanishes without damping."""
    phase = np.linspace(0.0, 2 * np.pi, 40001)
    for amplitude, frequency in ((5e-5, 30.0), (1e-3, 3.0), (3e-3, 300.0)):
        depth = 0.5 * amplitude * (1 - np.cos(phase))
        force, _ = evaluate(contact, depth, 0.5 * amplitude * frequency * np.sin(phase), onset)
        work = np.trapezoid(force, depth)
        elastic, _ = evaluate(contact, depth, np.zeros_like(depth), onset)
        loaded = np.trapezoid(elastic[:20001], depth[:20001])
        law = NORMAL_LAWS[contact.law]
        if law.rate_dependent(law.params(contact)):
            assert work > 1e-5 * loaded
        else:
            assert abs(work) < 1e-12 * loaded


@pytest.mark.parametrize("name", RESTITUTION)
def test_full_restitution_is_elastic(name: str) -> None:
    contact = Contact(law=name, stiffness=K, restitution=1.0)
    law = NORMAL_LAWS[name]
    assert not law.rate_dependent(law.params(contact))
    depth, closing, onset = states(3, 100)
    np.testing.assert_array_equal(evaluate(contact, depth, closing, onset)[0], evaluate(contact, depth, 0 * depth)[0])


def test_an_onset_that_is_not_known_yet_is_the_speed_itself() -> None:
    """Far above the floor the same force and at rest a finite slope; at any speed at most h times the elastic force."""
    contact = CONTACTS["restitution 0.5"]
    h = exact(0.5)
    (elastic,), _ = evaluate(contact, np.array([1e-3]), np.zeros(1))
    for speed in (0.1, 1.0, 100.0):
        unknown, known = (evaluate(contact, np.array([1e-3]), np.array([speed]), v0)[0][0] for v0 in (0.0, speed))
        assert unknown == pytest.approx(known, rel=1e-15)
        assert known == pytest.approx(elastic * (1 + h), rel=(FLOOR / speed) ** 2)
    _, (slopes,) = evaluate(contact, np.array([1e-3]), np.zeros(1))
    assert slopes[1] == pytest.approx(elastic * h / FLOOR)


def test_a_slow_press_is_elastic() -> None:
    """Well below the floor the damping decreases in proportion to speed, for any onset speed."""
    contact = CONTACTS["restitution 0.5"]
    (elastic,), _ = evaluate(contact, np.array([1e-3]), np.zeros(1))
    for onset in (0.0, 1e-9):
        for speed in (1e-5, 1e-6):
            (force,), _ = evaluate(contact, np.array([1e-3]), np.array([speed]), onset)
            assert force / elastic - 1 == pytest.approx(exact(0.5) * speed / FLOOR, rel=1e-4)


def test_linear_law_is_hooke_beyond_its_ramp() -> None:
    contact = Contact(law="linear", stiffness=K, damping=C, ramp=RAMP)
    force, slopes = evaluate(contact, np.array([0.5 * RAMP, RAMP, 3 * RAMP]), np.array([0.0, 0.2, 0.2]))
    np.testing.assert_allclose(force, [K * RAMP / 8, 0.5 * K * RAMP + 0.2 * C, 2.5 * K * RAMP + 0.2 * C], rtol=1e-13)
    np.testing.assert_allclose(slopes, [[0.5 * K, 0.5 * C], [K, C], [K, C]], rtol=1e-12)


def test_impact_is_the_adams_function() -> None:
    """max(0, K d^e + STEP(d, 0, 0, ramp, C) d'), implemented independently."""
    depth, closing, _ = states(4)
    x = np.minimum(depth / RAMP, 1.0)
    wanted = np.maximum(0.0, K * depth**1.5 + C * x**2 * (3 - 2 * x) * closing)
    for name in ("hertz", "impact"):
        np.testing.assert_allclose(evaluate(CONTACTS[name], depth, closing)[0], wanted, rtol=1e-9, atol=1e-12)


# h of the coefficient of restitution --------------------------------------------------------------------------


def test_exact_factor() -> None:
    """docs/theory.md; and the equation itself, from the limit of small c to that of c = 1."""
    table = {0.1: 9.998159, 0.3: 3.087082, 0.5: 1.432751, 0.7: 0.634828, 0.9: 0.166482}
    for c, h in table.items():
        assert exact(c) == pytest.approx(h, abs=5.1e-7)
    for c in (0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99):
        h = exact(c)
        assert h * (1 + c) == pytest.approx(np.log((1 + h) / (1 - h * c)), rel=2e-9)
    assert exact(1.0) == 0.0
    for c in (1e-8, 1e-3, 0.02):
        assert exact(c) == pytest.approx(1 / c, rel=1e-12)
    for below in (1e-3, 1e-6, 1e-10):  # 3/2 (1 - c)/(1 - c + c^2) to second order
        c = 1 - below
        assert exact(c) == pytest.approx(1.5 * (1 - c) / (1 - c + c * c), rel=10 * below**2 + 1e-12, abs=1e-16)
    grid = np.linspace(0.01, 1.0, 500)
    assert np.all(np.diff([exact(c) for c in grid]) < 0)


@pytest.mark.parametrize("c", [0.0, -0.1, 1.001, float("nan")])
def test_exact_factor_needs_a_restitution_that_can_be(c: float) -> None:
    with pytest.raises(ValueError, match="must be above 0 and at most 1"):
        exact(c)


def test_factors_of_the_approximations() -> None:
    assert hunt_crossley(0.5) == pytest.approx(0.75)
    assert lankarani_nikravesh(0.5) == pytest.approx(0.5625)
    assert flores(0.5) == pytest.approx(1.6)
    # all agree with the exact coefficient to first order at c = 1, except Flores (8/5 instead of 3/2)
    for factor in (hunt_crossley, lankarani_nikravesh):
        assert factor(1 - 1e-6) == pytest.approx(exact(1 - 1e-6), rel=1e-5)
