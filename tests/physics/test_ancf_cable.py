"""ANCF cable against cantilevers, a rolled-up beam, strings."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fsm.ancf.build import CableMaterial, MeshBuilder
from fsm.ancf.cable import CableGroup
from fsm.ancf.group import MassPart
from fsm.ancf.loading import Forcing, Loading, Motion, point_force
from fsm.ancf.mesh import Mesh
from fsm.ancf.pulse import Ramp
from fsm.ancf.system import AncfSystem
from fsm.solve.modal import modes
from fsm.solve.newton import equilibrium

YOUNG, WIDTH, LENGTH = 2.07e11, 0.1, 2.0
AREA, INERTIA = WIDTH**2, WIDTH**4 / 12


def clamped_beam(elements: int, engineering: bool = True) -> tuple[Mesh, int]:
    """A square beam along x, clamped at the origin; its mesh and the position at its tip."""
    builder = MeshBuilder(size=6)
    line = builder.cable(np.zeros(3), np.array([LENGTH, 0, 0]), CableMaterial(YOUNG, 7800.0, WIDTH), elements)
    builder.hold(line[0, 0])
    builder.hold(line[0, 1], (1, 2))
    mesh = builder.build()
    beam = mesh.groups[0]
    assert isinstance(beam, CableGroup)
    ones = np.ones(elements)
    beam = replace(beam, axial=YOUNG * AREA * ones, bending=YOUNG * INERTIA * ones, engineering=engineering)
    return replace(mesh, groups=(beam,)), int(line[-1, 0])


def cantilever(elements: int, engineering: bool = True) -> np.ndarray:
    """Tip displacement (along, down) under F = 3 E I/L^2."""
    mesh, tip = clamped_beam(elements, engineering)
    force = point_force(len(mesh.coordinates), tip, np.array([0, 0, -3 * YOUNG * INERTIA / LENGTH**2]))
    system = AncfSystem(mesh, Loading((Forcing(force, Ramp()),)))
    q = equilibrium(system, system.initial()[0], np.linspace(0.0, 1.0, 9))
    return q[[tip, tip + 2]] - mesh.coordinates[[tip, tip + 2]]


def test_cantilever_with_one_element_and_converged() -> None:
    # published one-element value, and a converged one of another program; both with the engineering strain
    np.testing.assert_allclose(cantilever(1), [-0.362245, -0.994145], atol=1e-6)
    np.testing.assert_allclose(cantilever(64), [-0.508537304, -1.207239855], atol=2e-8)


def test_cantilever_converges_at_fourth_order_with_either_strain() -> None:
    for engineering in (True, False):
        fine = cantilever(64, engineering)
        errors = [np.linalg.norm(cantilever(n, engineering) - fine) for n in (8, 16)]
        assert math.log2(errors[0] / errors[1]) == pytest.approx(5.6, abs=0.5)
    # Green strain: the same but for eps^2/2 of the stretch
    np.testing.assert_allclose(cantilever(64, False), [-0.508537304, -1.207239855], atol=1e-6)


class EndMoment:
    """A couple M about y at the slope of a tip: forces M (y x r')/|r'|^2 on it, which follow."""

    name = "moment"
    rate_dependent = False

    def __init__(self, slope: int, moment: float) -> None:
        self.vectors = np.array([[slope]])
        self.moment = moment

    def mass(self) -> MassPart:
        return MassPart(np.zeros((0, 1), dtype=np.int64), np.zeros((0, 1, 1)), np.eye(3))

    def add_force(self, q: np.ndarray, u: np.ndarray | None, force: np.ndarray) -> None:
        first = self.vectors[0, 0]
        a = q[first : first + 3]
        force[first : first + 3] += self.moment * np.cross([0.0, -1.0, 0.0], a) / (a @ a)

    def add_linearised(
        self, q: np.ndarray, u: np.ndarray | None, slots: np.ndarray, force: np.ndarray, stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:  # fmt: skip
        self.add_force(q, u, force)
        first = self.vectors[0, 0]
        a = q[first : first + 3]
        cross = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        turn = self.moment * (cross / (a @ a) - 2 * np.outer(cross @ a, a) / (a @ a) ** 2)
        flat, size = stiffness.reshape(-1), stiffness.shape[1]
        for i in range(3):
            for j in range(3):
                flat[slots[0, 0, 0] + i * size + j] -= turn[i, j]

    def energy(self, q: np.ndarray, u: np.ndarray | None) -> tuple[float, float]:
        return 0.0, 0.0


def test_a_moment_rolls_a_beam_up_into_a_circle() -> None:
    elements, steps = 16, 24
    mesh, tip = clamped_beam(elements)
    whole = 2 * math.pi * YOUNG * INERTIA / LENGTH
    q = mesh.coordinates
    for step in range(1, steps + 1):
        system = AncfSystem(replace(mesh, groups=(*mesh.groups, EndMoment(tip + 3, whole * step / steps))))
        if step > 1:  # bend all a little more, as a circle would
            angle = 2 * math.pi * step / steps * np.linspace(0, 1, elements + 1)
            radius = LENGTH * steps / (2 * math.pi * step)
            nodes = q.reshape(-1, 6).copy()
            nodes[:, 0], nodes[:, 2] = radius * np.sin(angle), radius * (1 - np.cos(angle))
            nodes[:, 3], nodes[:, 5] = np.cos(angle), np.sin(angle)
            q = nodes.ravel()
        q = equilibrium(system, q, np.array([0.0]))
    nodes = q.reshape(-1, 6)
    assert np.linalg.norm(nodes[-1, :3]) < 1e-4 * LENGTH
    middle = nodes[elements // 2, [0, 2]]
    np.testing.assert_allclose(middle, [0.0, LENGTH / math.pi], atol=1e-4 * LENGTH)
    np.testing.assert_allclose(nodes[-1, 3:], [1.0, 0.0, 0.0], atol=1e-3)


@pytest.mark.parametrize(("ratio", "wanted"), [(0.0, 1.0), (0.5, 0.6855592720), (1.0, 0.5477053736)])
def test_string_with_a_central_mass(ratio: float, wanted: float) -> None:
    """f/f0 of a tensioned string with a mass m in the middle, m/(mu L) = ratio."""
    length, strain, elements = 1.0, 1e-3, 8
    material = CableMaterial(2e11, 7800.0, 2e-4)
    builder = MeshBuilder(size=6)
    middle = np.array([length / 2, 0, 0])
    left = builder.cable(np.zeros(3), middle, material, elements)
    # a slope of its own on either side of the mass, where the string has a kink
    right = builder.cable(middle, 2 * middle, material, elements, start_position=int(left[-1, 0]))
    builder.hold(left[0, 0])
    builder.hold(right[-1, 0], (1, 2))
    density = material.density * material.area
    if ratio:
        builder.point_mass(int(left[-1, 0]), ratio * density * length)
    mesh = builder.build()
    thin = [group for group in mesh.groups if isinstance(group, CableGroup)]
    mesh = replace(mesh, groups=tuple(replace(group, bending=1e-6 * group.bending) for group in thin))  # a string
    end = right[-1:, 0]
    pulled = AncfSystem(mesh, Loading(motions=(Motion(end, np.array([strain * length]), Ramp()),)))
    q = pulled.place(1.0, equilibrium(pulled, pulled.initial()[0], np.array([0.0, 1.0])), None)[0]
    held = pulled.held(q, end)
    first = modes(held, 0.0, held.start, 2).frequencies[0]
    # in material lengths: tension over 1 + strain
    tension = thin[0].axial[0] * strain * (1 + 0.5 * strain)
    plain = 0.5 / length * math.sqrt(tension / density)
    assert first / plain == pytest.approx(wanted, rel=1e-4)
