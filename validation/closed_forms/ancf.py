"""Beams, cables, strings and plates of absolute nodal coordinates."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_3d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.programs import ramp
from fsm.model.nodes.arrays import FORCE, STIFFNESS, Q
from fsm.model.nodes.beams.bars import BarMaterial, BarMesh
from fsm.model.nodes.cable import CableGroup
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.group import ElementGroup
from fsm.model.nodes.loading import Forcing, Loading, SupportMotion, point_force
from fsm.model.nodes.mesh import Mesh, node_pattern
from fsm.model.nodes.system.build import CableMaterial, MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.equations.newton import equilibrium
from fsm.solve.modal import modes
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

__all__ = [
    "EndMoment", "cable_cantilever", "cable_pendulum", "clamped_beam", "deep_cantilever", "pendulum_cable", "plate_modes",
    "rolled_up", "string_ratio",
]  # fmt: skip

YOUNG, WIDTH, LENGTH = 2.07e11, 0.1, 2.0
"""The square beam of the cable cantilever: Pa, m, m."""
INERTIA = WIDTH**4 / 12


def clamped_beam(elements: int, engineering: bool = True, width: float = WIDTH) -> tuple[Mesh, int]:
    """A square beam along x, clamped at the origin; its mesh and the position at its tip."""
    builder = MeshBuilder(size=6)
    line = builder.cable(np.zeros(3), np.array([LENGTH, 0, 0]), CableMaterial(YOUNG, 7800.0, width), elements)
    builder.hold(line[0, 0])
    builder.hold(line[0, 1], (1, 2))
    mesh = builder.build()
    beam = mesh.groups[0]
    assert isinstance(beam, CableGroup)
    ones = np.ones(elements)
    beam = replace(beam, axial=YOUNG * width**2 * ones, bending=YOUNG * width**4 / 12 * ones, engineering=engineering)
    return replace(mesh, groups=(beam,)), int(line[-1, 0])


def cable_cantilever(elements: int, engineering: bool = True, load: float = 3.0, width: float = WIDTH) -> np.ndarray:
    """Tip displacement (along, down), m, under F = load E I/L^2."""
    mesh, tip = clamped_beam(elements, engineering, width)
    force = point_force(len(mesh.coordinates), tip, np.array([0, 0, -load * YOUNG * width**4 / 12 / LENGTH**2]))
    system = AncfSystem(mesh, Loading((Forcing(force, ramp()),)))
    q = equilibrium(system, system.initial()[0], np.linspace(0.0, 1.0, 9))
    return np.asarray(q[[tip, tip + 2]] - mesh.coordinates[[tip, tip + 2]])


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    first, moment = integers_2d(own, 0)[0, 0], floats_1d(own, 1)[0]
    a, force = floats_1d(table, Q)[first : first + 3], floats_1d(table, FORCE)
    square = a[0] ** 2 + a[1] ** 2 + a[2] ** 2
    force[first] -= moment * a[2] / square
    force[first + 2] += moment * a[0] / square
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _force(table, own, moving)
    first, moment, slot = integers_2d(own, 0)[0, 0], floats_1d(own, 1)[0], integers_2d(own, 2)[0, 0]
    a, stiffness = floats_1d(table, Q)[first : first + 3], floats_3d(table, STIFFNESS)
    square, turned = a[0] ** 2 + a[1] ** 2 + a[2] ** 2, (-a[2], 0.0, a[0])
    flat, size = stiffness.reshape(-1), stiffness.shape[1]
    for i in range(3):
        for j in range(3):
            flat[slot + i * size + j] += 2.0 * moment * turned[i] * a[j] / square**2
    flat[slot + 2] += moment / square
    flat[slot + 2 * size] -= moment / square
    return 0.0


@kernel
def _nothing(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    """Stored energy and dissipated power: a couple that follows has none."""
    return 0.0


class EndMoment(ElementGroup):
    """A couple M about y at the slope of a tip: follower forces M (r' x y)/|r'|^2 on this slope."""

    name = "moment"
    kernels = (_force, _tangent, _nothing, _nothing)

    def __init__(self, slope: int, moment: float) -> None:
        self.vectors = np.array([[slope]])
        self.moment = np.array([moment])

    @property
    def table(self) -> list[np.ndarray]:
        return [self.vectors, self.moment]


def rolled_up(elements: int = 16, steps: int = 24) -> np.ndarray:
    """Nodes (n + 1, 6), positions and slopes, of the square beam under 2 pi EI/L at its end."""
    mesh, tip = clamped_beam(elements)
    whole = 2 * math.pi * YOUNG * INERTIA / LENGTH
    q = mesh.coordinates
    for step in range(1, steps + 1):
        moment = EndMoment(tip + 3, whole * step / steps)
        system = AncfSystem(replace(mesh, groups=(*mesh.groups, moment)))
        if step > 1:  # all nodes are bent a little more, towards a circle
            angle = 2 * math.pi * step / steps * np.linspace(0, 1, elements + 1)
            radius = LENGTH * steps / (2 * math.pi * step)
            nodes = q.reshape(-1, 6).copy()
            nodes[:, 0], nodes[:, 2] = radius * np.sin(angle), radius * (1 - np.cos(angle))
            nodes[:, 3], nodes[:, 5] = np.cos(angle), np.sin(angle)
            q = nodes.ravel()
        q = equilibrium(system, q, np.array([0.0]))
    return np.asarray(q.reshape(-1, 6))


def string_ratio(ratio: float, elements: int = 8) -> float:
    """f/f0 of a tensioned string with a mass m in the middle, m/(mu L) = ratio."""
    length, strain = 1.0, 1e-3
    material = CableMaterial(2e11, 7800.0, 2e-4)
    builder = MeshBuilder(size=6)
    middle = np.array([length / 2, 0, 0])
    left = builder.cable(np.zeros(3), middle, material, elements)
    # the mass has a separate slope on each side, because the string has a kink there
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
    pulled = AncfSystem(mesh, Loading(motions=(SupportMotion(end, np.array([strain * length]), ramp()),)))
    q = pulled.place(1.0, equilibrium(pulled, pulled.initial()[0], np.array([0.0, 1.0])), None)[0]
    held = pulled.held(q, end)
    first = modes(held, 0.0, held.start, 2).frequencies[0]
    # in material lengths: tension over 1 + strain
    tension = thin[0].axial[0] * strain * (1 + 0.5 * strain)
    return float(first / (0.5 / length * math.sqrt(tension / density)))


def plate_modes(n: int, clamped: bool, count: int = 4) -> np.ndarray:
    """omega a^2 sqrt(rho h/D) of a square plate, nu = 0.3, on n x n cells, hinged or clamped all around."""
    side, young, poisson, density, thickness = 0.3, 7e10, 0.3, 2700.0, 1e-3
    material = FilmMaterial(young, poisson, density, thickness)
    rigidity = young * thickness**3 / (12 * (1 - poisson**2))  # this value was computed by this program, to detect changes
    builder = MeshBuilder()
    lines = np.linspace(0.0, side, n + 1)
    grid = builder.film(lines, lines, (material,))
    builder.hold(grid.edge())
    if clamped:
        builder.hold(np.unique(grid.edge() // 9) * 9 + 3, (2, 5))
    system = AncfSystem(builder.build())
    found = 2 * math.pi * modes(system, 0.0, system.start, count).frequencies
    return np.asarray(found * side**2 * math.sqrt(density * thickness / rigidity))


def deep_cantilever(
    element: str, count: int, length: float, height: float, force: float, factor: float = 5.0 / 6.0, nu: float = 0.3,
    young: float = 2.07e11, steps: int = 8,
) -> np.ndarray:  # fmt: skip
    """Displacement (along, across) of the tip of a planar beam 0.1 m wide under a force across, with a clamped section."""
    material = BarMaterial(young, nu, 7850.0, 0.1, height, shear_factor=factor)
    mesh = BarMesh(element, material)
    bar = mesh.bar("bar", [mesh.position((0.0, 0.0), "root"), mesh.position((length, 0.0), "tip")], (count,))
    values = np.array(mesh.values)
    held = np.zeros(values.size, dtype=bool)
    held[:2] = True
    clamped = bar.slopes[0] if element == "cable" else bar.sections[0]
    held[clamped : clamped + 2] = True
    groups = (mesh.group(),)
    pattern = node_pattern(len(values), 2, groups, ())
    whole = Mesh(
        values.ravel(), held, groups, (), np.zeros((0, 4), dtype=np.int64), tuple(mesh.names), pattern, 2,
        np.array(mesh.positions),
    )  # fmt: skip
    load = np.zeros(values.size)
    load[bar.positions[-1] + 1] = -force
    system = AncfSystem(whole, Loading((Forcing(load, ramp()),)))
    q = equilibrium(system, system.initial()[0], np.linspace(0.0, 1.0, steps + 1))
    return np.asarray(q[bar.positions[-1] + np.arange(2)] - [length, 0.0])


def pendulum_cable(elements: int) -> tuple[AncfSystem, int]:
    """The flexible pendulum and the position at its tip.

    L = 1.2, A = .0018, I = 1.215e-8, rho = 5540, E = .7e6, g = 9.81; pinned at the origin, released from the horizontal.
    """
    young, density, area, second = 0.7e6, 5540.0, 0.0018, 1.215e-8
    builder = MeshBuilder(size=6)
    material = CableMaterial(young, density, math.sqrt(4.0 * area / math.pi))
    line = builder.cable(np.zeros(3), np.array([1.2, 0, 0]), material, elements)
    builder.hold(line[0, 0])
    builder.hold(np.unique(line), (1,))
    mesh = builder.build()
    beam = mesh.groups[0]
    assert isinstance(beam, CableGroup)
    mesh = replace(mesh, groups=(replace(beam, bending=young * second * np.ones(elements), engineering=True),))
    return AncfSystem(mesh, Loading(gravity=(0.0, 0.0, -9.81))), int(line[-1, 0])


def cable_pendulum(elements: int, times: list[float], rtol: float = 1e-5) -> tuple[np.ndarray, float]:
    """Tip (x, z) of the flexible pendulum at these times, m, and the relative energy error."""
    system, tip = pendulum_cable(elements)
    saved: list[SavedState] = []
    _, energy_balance = simulate(system, Settings("Radau-blocks", rtol, times[-1]), times, saved.append)
    return np.array([state.q[[tip, tip + 2]] for state in saved]), energy_balance.relative_error
