"""Stops and latches of hinges: moment, energy, dissipation and tangent are consistent; latching is stored and causes no
jump."""

import itertools
import math

import numpy as np
import pytest

from fsm.kernels.blocks import BlockMatrix
from fsm.model.nodes.assembly import slots_of
from fsm.model.nodes.beams.hinge import HingeGroup, Latches
from fsm.model.nodes.mesh import node_pattern
from tests.tangents import differences

LIMIT, STIFFNESS, DAMPING = 0.4, 3.0, 0.2
INITIAL, SIGN = 0.7, -1.0


def hinge(latched=False):
    law = np.array([[0.0, 0.0, 0.0, 0.0, 1.0, LIMIT, STIFFNESS, DAMPING]])
    group = HingeGroup(np.array([[0, 2]]), np.array([INITIAL]), np.array([SIGN]), law)
    group.times[:] = -1.0 if latched else math.inf
    return group


def turned(depth):
    """Slopes, not of unit length, of a hinge that is past its stop by this angle."""
    first, second = 0.3, 0.3 + INITIAL + SIGN * (LIMIT + depth)
    return np.array([1.1 * math.cos(first), 1.1 * math.sin(first), 0.9 * math.cos(second), 0.9 * math.sin(second)])


def spinning(q, rate):
    """Rates of the slopes: the hinge turns at this rate, and both slopes stretch a little."""
    return np.array([0.02 * q[0], 0.02 * q[1], -SIGN * rate * q[3] + 0.01 * q[2], SIGN * rate * q[2] + 0.01 * q[3]])


def force_of(group, q, u):
    force = np.zeros(4)
    group.add_force(q, u, force)
    return force


EITHER_WAY = pytest.mark.parametrize(
    ("latched", "depth", "rate"), list(itertools.product((False, True), (0.1, -0.1), (2.0, -2.0, -20.0)))
)
"""Stop and latch, on both sides, turning either way and so fast that the stop would pull."""


def moving(latched, depth, rate):
    """A hinge past its stop, its slopes and their rates."""
    q = turned(depth)
    return hinge(latched), q, spinning(q, rate)


@EITHER_WAY
def test_tangent_against_differences(latched, depth, rate):
    """K and D of a stop and of a latch, on both sides, while the stop pushes and while it would pull."""
    group, q, u = moving(latched, depth, rate)
    pattern = node_pattern(2, 2, (group,), ())
    slots = slots_of(group.vectors, 2, pattern.indptr, pattern.indices)
    force, stiffness, damping = np.zeros(4), pattern.zeros(), pattern.zeros()
    group.add_linearised(q, u, slots, force, stiffness, damping)
    assert np.array_equal(force, force_of(group, q, u))
    assert bool(np.any(force)) == (latched or (depth > 0.0 and rate > -1.0 / DAMPING))
    for analytic, moved in (
        (stiffness, lambda x: force_of(group, q + x, u)), (damping, lambda x: force_of(group, q, u + x)),
    ):  # fmt: skip
        by_force = -differences(moved, np.full(4, 1e-6))
        assert BlockMatrix(pattern, analytic).bsr().toarray() == pytest.approx(by_force, abs=1e-8)


@EITHER_WAY
def test_forces_are_those_of_the_energies(latched, depth, rate):
    """At rest the force is the gradient of the energy; in motion the additional power is dissipated and never negative."""
    group, q, u = moving(latched, depth, rate)
    slope = differences(lambda x: group.energy(q + x, None)[0], np.full(4, 1e-6))
    still = force_of(group, q, None)
    assert still == pytest.approx(-slope, abs=1e-8)
    dissipated = group.energy(q, u)[1]
    assert dissipated == pytest.approx((still - force_of(group, q, u)) @ u, abs=1e-12)
    assert dissipated >= 0.0
    if latched:
        assert group.energy(q, None)[0] == pytest.approx(STIFFNESS * abs(depth) ** 2.5 / 2.5, rel=1e-12)


def test_latching_jumps_nowhere():
    """When a hinge latches, force and energy do not change; at earlier times the earlier law still holds."""
    group = hinge()
    latches = Latches(group, ("h1",))
    short, past = turned(-0.05), turned(0.01)
    latches.commit(0.1, short, spinning(short, 3.0))
    assert latches.events() == [] and latches.open() == ["h1"]
    leaving = spinning(past, -1.5 / DAMPING)  # the stop does not push: the latch would pull at once
    latches.commit(0.2, past, leaving)
    assert latches.events() == []
    u = spinning(past, 3.0)
    latches.commit(0.3, past, u)
    assert latches.events() == [("h1", 0.3)] and latches.open() == []
    found = []
    for t in (0.3, math.nextafter(0.3, 1.0)):
        group.at(t, None)
        found.append((force_of(group, past, u), group.energy(past, u), force_of(group, short, u)))
    assert found[0][0] == pytest.approx(found[1][0], rel=1e-15)
    assert found[0][1] == pytest.approx(found[1][1], rel=1e-15)
    assert not np.any(found[0][2]) and np.any(found[1][2])
    latches.commit(0.4, short, u)  # permanently, with the time of latching
    assert latches.events() == [("h1", 0.3)]


def test_latches_are_remembered():
    """Hinges latched in a checkpoint are latched again; none is released."""
    first, second = Latches(hinge(), ("h1",)), Latches(hinge(), ("h1",))
    first.commit(0.3, turned(0.01), spinning(turned(0.01), 1.0))
    second.restore(first.times.copy())
    assert second.events() == [("h1", 0.3)]
    second.restore(np.zeros(0))
    assert second.events() == []
