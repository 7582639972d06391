"""Planar beam elements: energy, force and tangents are consistent, and rigid motions cost no energy."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from fsm.kernels.programs import ramp
from fsm.model.nodes.beams.bars import BarMaterial, BarMesh
from fsm.model.nodes.beams.beam_bernoulli import bernoulli_rows, bernoulli_shape
from fsm.model.nodes.beams.beam_strain import beam_rows, beam_shape
from fsm.model.nodes.loading import Forcing, Loading
from fsm.model.nodes.mesh import Mesh, node_pattern
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.equations.newton import equilibrium
from tests.tangents import differences

STEEL = BarMaterial(2e11, 0.3, 7850.0, 0.02, 0.01, damping=1e-3)
ELEMENTS = ("section", "green", "cable")
BENT = list(itertools.product(ELEMENTS, (0.0, 0.6)))
"""Elements and bends at the middle."""


def one_bar(element, kink=0.0, count=1):
    """A bar through three points, bent by `kink` at the middle point; the group, its coordinates as vectors, and the bar."""
    mesh = BarMesh(element, STEEL)
    end = (0.4 + 0.3 * math.cos(kink), 0.3 * math.sin(kink))
    points = [mesh.position(at, name) for name, at in (("a", (0.0, 0.0)), ("h", (0.4, 0.0)), ("b", end))]
    bar = mesh.bar("bar", points, (count, count))
    return mesh.group(), np.array(mesh.values), bar


@pytest.mark.parametrize(
    "function",
    [lambda x, y: 1 + 0 * x, lambda x, y: x, lambda x, y: x**2, lambda x, y: x**3, lambda x, y: y, lambda x, y: x * y,
     lambda x, y: x**2 * y],
)  # fmt: skip
def test_reproduces_its_polynomials(function):
    """1, x, x^2, x^3, y, xy and x^2 y, and their derivatives."""
    length, h = 0.7, 1e-5
    by_x = lambda x, y: (function(x + h, y) - function(x - h, y)) / (2 * h)  # noqa: E731
    by_y = lambda x, y: (function(x, y + h) - function(x, y - h)) / (2 * h)  # noqa: E731
    by_both = (by_y(h, 0.0) - by_y(-h, 0.0)) / (2 * h)
    e = np.array([f(x, 0.0) for x in (0.0, length) for f in (function, by_x, by_y)] + [by_both])
    x, y = np.array([0.1, 0.35, 0.6]), np.array([0.02, -0.03, 0.01])
    assert beam_shape(x / length, y, length) @ e == pytest.approx(function(x, y), abs=1e-9)
    rows = beam_rows(x / length, y, length) @ e
    assert rows[:, 0] == pytest.approx(by_x(x, y), abs=1e-8)
    assert rows[:, 1] == pytest.approx(by_y(x, y), abs=1e-8)


def test_rows_are_derivatives():
    """Both kinds of shape functions, by differences."""
    length, h = 0.7, 1e-6
    x, y = np.array([0.2, 0.5, 0.65]), np.array([0.01, -0.02, 0.03])
    along = lambda f: (f(x + h) - f(x - h)) / (2 * h)  # noqa: E731
    rows = beam_rows(x / length, y, length)
    assert rows[:, 0] == pytest.approx(along(lambda x: beam_shape(x / length, y, length)), abs=1e-8)
    assert rows[:, 2] == pytest.approx(along(lambda x: beam_rows(x / length, y, length)[:, 1]), abs=1e-8)
    rows = bernoulli_rows(x / length, length)
    assert rows[:, 0] == pytest.approx(along(lambda x: bernoulli_shape(x / length, length)), abs=1e-8)
    assert rows[:, 1] == pytest.approx(along(lambda x: bernoulli_rows(x / length, length)[:, 0]), abs=1e-7)


def deformed(values, seed=3, size=0.02):
    rng = np.random.default_rng(seed)
    return (values + size * rng.standard_normal(values.shape)).ravel(), rng.standard_normal(values.size)


@pytest.mark.parametrize(("element", "kink"), BENT)
def test_force_and_tangents_follow_from_the_energy(element, kink):
    """Force = -dU/dq at rest; K and D = -df/dq, -df/du with dampers; dissipation = -f_viscous . u."""
    group, values, _ = one_bar(element, kink)
    q, u = deformed(values)
    n = len(q)

    def force(q, u):
        out = np.zeros(n)
        group.add_force(q, u, out)
        return out

    slots = (group.vectors[:, :, None] // 2 * (n // 2) + group.vectors[:, None, :] // 2) * 4
    blocks = [np.zeros(((n // 2) ** 2, 2, 2)) for _ in range(2)]
    out = np.zeros(n)
    group.add_linearised(q, u, slots, out, *blocks)
    k, d = (b.reshape(n // 2, n // 2, 2, 2).transpose(0, 2, 1, 3).reshape(n, n) for b in blocks)
    assert out == pytest.approx(force(q, u), rel=1e-12)
    steps, scale = np.full(n, 1e-7), np.abs(k).max()
    assert force(q, None) == pytest.approx(-differences(lambda x: group.energy(q + x, None)[0], steps), abs=3e-8 * scale)
    assert k == pytest.approx(-differences(lambda x: force(q + x, u), steps), abs=1e-6 * scale)
    assert d == pytest.approx(-differences(lambda x: force(q, u + x), steps), abs=1e-6 * np.abs(d).max())
    assert group.energy(q, u)[1] == pytest.approx(-(force(q, u) - force(q, None)) @ u, rel=1e-10)


@pytest.mark.parametrize(("element", "kink"), BENT)
def test_rigid_motion_is_free_of_force(element, kink):
    """A bar that is rotated and moved has no force, up to the round-off of its axial stiffness."""
    group, values, bar = one_bar(element, kink, count=2)
    positions = np.unique(bar.positions) // 2
    for angle in (0.3, 2.0, -3.0):
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        q = values @ turn.T
        q[positions] += [0.3, -0.2]
        force = np.zeros(q.size)
        group.add_force(q.ravel(), None, force)
        assert np.abs(force).max() < 1e-14 * STEEL.young * STEEL.area * 100


@pytest.mark.parametrize("element", ELEMENTS)
def test_mass_of_rigid_motion(element):
    """The kinetic energy of translation and rotation is that of a rigid bar; the sections of a cable have no rotary
    inertia."""
    group, values, bar = one_bar(element, 0.6)
    part = group.mass()
    n = len(values)
    mass = np.zeros((n, 2, n, 2))
    for vectors, scalar, tensor in zip(part.vectors // 2, part.scalar, part.tensor, strict=True):
        mass[np.ix_(vectors, [0, 1], vectors, [0, 1])] += np.einsum("ij,ab->iajb", scalar, tensor)
    spin = np.array([[0.0, -1.0], [1.0, 0.0]])
    velocity = values @ spin.T * 2.0
    velocity[np.unique(bar.positions) // 2] += [0.7, -0.4]
    kinetic = 0.5 * np.einsum("ia,iajb,jb->", velocity, mass, velocity)
    ends = [values[0], values[1], values[2]]
    per_length = STEEL.density * STEEL.area
    expected = 0.0
    for a, b in itertools.pairwise(ends):
        length, middle = np.linalg.norm(b - a), 0.5 * (a + b)
        inertia = per_length * length * (length**2 + (0.0 if element == "cable" else STEEL.height**2)) / 12.0
        at = 2.0 * spin @ middle + [0.7, -0.4]
        expected += 0.5 * per_length * length * at @ at + 0.5 * inertia * 4.0
    assert kinetic == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("element", ["section", "green"])
def test_a_bent_bar_carries_its_moment_around_the_bend(element):
    """Cantilever bent at its middle, force at its tip: the axial strain is N/EA on either side of the bend.

    With slopes r_x that are continuous at the bend, the moment stretched the elements there, shorter elements more.
    """
    kink, force = 0.6, 1.0
    mesh = BarMesh(element, replace(STEEL, damping=0.0))
    end = (0.4 + 0.3 * math.cos(kink), 0.3 * math.sin(kink))
    points = [mesh.position(at, name) for name, at in (("a", (0.0, 0.0)), ("h", (0.4, 0.0)), ("b", end))]
    bar = mesh.bar("bar", points, (4, 4))
    group, values = mesh.group(), np.array(mesh.values)
    held = np.zeros(values.size, dtype=bool)
    held[bar.positions[0] + np.arange(2)] = held[bar.sections[0] + np.arange(2)] = True
    whole = Mesh(
        values.ravel(), held, (group,), (), np.zeros((0, 4), dtype=np.int64), tuple(mesh.names),
        node_pattern(len(values), 2, (group,), ()), 2, np.array(mesh.positions),
    )  # fmt: skip
    load = np.zeros(values.size)
    load[bar.positions[-1] + 1] = -force
    system = AncfSystem(whole, Loading((Forcing(load, ramp()),)))
    q = equilibrium(system, system.initial()[0], np.array([0.0, 1.0]))
    strains = group.strained(q).strain
    axial = strains[..., 0] if element == "section" else 0.5 * (strains[:, 0::2, 0] + strains[:, 1::2, 0])
    stretch = STEEL.young * STEEL.area * axial.mean(axis=1)
    assert stretch[:4] == pytest.approx(0.0, abs=0.03 * force)
    assert stretch[4:] == pytest.approx(-force * math.sin(kink), abs=0.03 * force)
