"""Cable and membrane: rigid motions, tangents, energies, patch test, mass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fsm.kernels.programs import Program, half_sine, ramp, rectangle, sampled
from fsm.model.nodes.films.film import FilmMaterial, MembraneGroup
from fsm.model.nodes.loading import Loading, SupportMotion
from fsm.model.nodes.system.build import CableMaterial, FilmGrid, MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.nodes.tension_field import REMAINDER, SLACK, TAUT, WRINKLED

FILM = FilmMaterial(2.5e9, 0.34, 1420.0, 2e-4)
PATCH = FilmMaterial(7e10, 0.3, 2700.0, 1e-3)
STEEL = CableMaterial(2e11, 7800.0, 1e-3)


def builder(viscosity: float = 0.0, tension_field: bool = False, air: float = 0.0) -> tuple[MeshBuilder, FilmGrid]:
    """A film of 3 x 2 uneven cells with a patch, and a cable at a corner."""
    made = MeshBuilder()
    x, y = np.array([0.0, 0.08, 0.2, 0.3]), np.array([0.0, 0.11, 0.2])
    cells = np.array([[0, 0], [0, 1], [0, 0]])
    grid = made.film(x, y, (FILM, PATCH), cells, tension_field, viscosity, air=air)
    corner = int(grid.position[0, 0])
    made.cable(np.array([-0.1, -0.1, 0.0]), np.zeros(3), STEEL, 2, end_position=corner, viscosity=viscosity)
    return made, grid


def shaken(system: AncfSystem, size: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    """A state far from rest."""
    rng = np.random.default_rng(0)
    scale = np.where(np.arange(system.nq) % 9 < 3, 0.1, 1.0) * ~system.fixed
    q, _ = system.initial()
    return q + size * scale * rng.normal(size=system.nq), scale * rng.normal(size=system.nq)


def slopes(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Jacobian (n, n) by central differences."""
    steps = step * np.eye(len(x))
    return np.stack([(function(x + s) - function(x - s)) / (2 * step) for s in steps], axis=1)


@pytest.mark.parametrize("tension_field", [False, True])
@pytest.mark.parametrize("viscosity", [0.0, 1e-4])
def test_tangents_are_derivatives_of_the_force(viscosity: float, tension_field: bool) -> None:
    made, _ = builder(viscosity, tension_field)
    system = AncfSystem(made.build(), Loading(mass_damping=3.0))
    q, u = shaken(system)
    stiffness, damping = (matrix.toarray() for matrix in system.tangent(0.0, q, u))
    by_q = slopes(lambda x: system.force(0.0, x, u), q)
    by_u = slopes(lambda x: system.force(0.0, q, x), u, step=1.0)  # linear in u
    assert np.abs(stiffness + by_q).max() < 1e-7 * np.abs(stiffness).max()
    assert np.abs(damping + by_u).max() < 1e-8 * np.abs(damping).max()
    at_rest = system.linearise(0.0, q, None).stiffness
    by_rest = slopes(lambda x: system.force(0.0, x, None), q)
    assert np.abs(at_rest.bsr().toarray() + by_rest).max() < 1e-7 * np.abs(by_rest).max()


@pytest.mark.parametrize("tension_field", [False, True])
def test_forces_are_derivatives_of_the_energy(tension_field: bool) -> None:
    made, _ = builder(tension_field=tension_field)
    system = AncfSystem(made.build(), Loading(gravity=(0.0, 0.0, -9.81)))
    q, _ = shaken(system)
    free = ~system.fixed
    steps = 1e-6 * np.eye(system.nq)[free]
    energy = [sum(system.energies(0.0, x).values()) for s in steps for x in (q + s, q - s)]
    slope = -np.diff(np.reshape(energy, (-1, 2)), axis=1)[:, 0] / 2e-6
    force = system.force(0.0, q, None)
    np.testing.assert_allclose(slope, -force[free], atol=1e-6 * np.abs(force).max())


def test_dissipated_power_is_the_work_of_the_dampers() -> None:
    made, _ = builder(1e-4)
    system = AncfSystem(made.build(), Loading(mass_damping=3.0))
    q, u = shaken(system)
    u[system.fixed] = 0.0
    work = (system.force(0.0, q, None) - system.force(0.0, q, u)) @ u
    assert system.energy(0.0, q, u).dissipated_power == pytest.approx(work, rel=1e-10)


def test_a_rigid_motion_is_free_of_force() -> None:
    made, _ = builder()
    system = AncfSystem(made.build())
    axis = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
    cross = np.cross(np.eye(3), axis)
    turn = np.eye(3) + np.sin(2.1) * cross + (1 - np.cos(2.1)) * cross @ cross
    q = (system.start.reshape(-1, 3) @ turn.T).reshape(-1, 9)
    q[:, :3] += [0.3, -0.2, 0.7]
    force = system.force(0.0, q.ravel(), None)[~system.fixed]
    assert np.abs(force).max() < 1e-11 * STEEL.young * STEEL.area
    assert sum(system.energies(0.0, q.ravel()).values()) < 1e-15


def test_patch_of_constant_strain() -> None:
    """Under a homogeneous stretch and shear, prescribed at the edge of an uneven mesh, the inside is in equilibrium with the
    exact energy."""
    made = MeshBuilder()
    x, y = np.array([0.0, 0.08, 0.2, 0.3]), np.array([0.0, 0.13, 0.2])
    grid = made.film(x, y, (FILM,))
    system = AncfSystem(made.build())
    gradient = np.array([[1.02, 0.01, 0.0], [-0.015, 0.99, 0.0], [0.0, 0.0, 1.0]])
    q = (system.start.reshape(-1, 3) @ gradient.T).ravel()
    inner = np.setdiff1d(np.arange(system.nq), grid.edge()[:, None] + np.arange(3))
    # tractions at the edge also load the slopes across it
    inner = np.setdiff1d(inner, np.unique(grid.edge() // 9)[:, None] * 9 + np.arange(9))
    force = system.force(0.0, q, None)
    assert np.abs(force[inner]).max() < 1e-12 * np.abs(force).max()
    strain = 0.5 * (gradient.T @ gradient - np.eye(3))
    plain = FILM.stretch
    density = 0.5 * plain * (
        strain[0, 0] ** 2 + strain[1, 1] ** 2 + 2 * FILM.poisson * strain[0, 0] * strain[1, 1]
        + 2 * (1 - FILM.poisson) * strain[0, 1] ** 2
    )  # fmt: skip
    assert sum(system.energies(0.0, q).values()) == pytest.approx(density * 0.06, rel=1e-12)


def test_patch_of_constant_curvature() -> None:
    """A small deflection w = x^2, y^2 or xy has the bending energy of a plate, on any mesh."""
    material = FilmMaterial(2.5e9, 0.34, 1420.0, 1e-3)
    for wxx, wyy, wxy in ((1e-3, 0, 0), (0, 1e-3, 0), (0, 0, 1e-3), (1e-3, -2e-3, 1e-3)):
        made = MeshBuilder()
        made.film(np.array([0.0, 0.08, 0.2, 0.3]), np.array([0.0, 0.13, 0.2]), (material,))
        system = AncfSystem(made.build())
        q = system.start.reshape(-1, 9).copy()
        x, y = q[:, 0], q[:, 1]
        q[:, 2] = 0.5 * wxx * x**2 + 0.5 * wyy * y**2 + wxy * x * y
        q[:, 5], q[:, 8] = wxx * x + wxy * y, wyy * y + wxy * x
        bend = sum(group.energies(q.ravel())[1] for group in system.mesh.groups)
        nu = material.poisson
        density = 0.5 * material.bending * (wxx**2 + wyy**2 + 2 * nu * wxx * wyy + 2 * (1 - nu) * wxy**2)
        assert bend == pytest.approx(density * 0.06, rel=1e-6)


def test_mass_of_a_translation_and_of_the_air() -> None:
    air = 0.25
    made, _ = builder(air=air)
    mesh = made.build()
    system = AncfSystem(mesh)
    mass = system.full_mass_matrix
    film = 0.06 * FILM.areal_density + 0.12 * 0.09 * (PATCH.areal_density - FILM.areal_density)
    cable = np.hypot(0.1, 0.1) * STEEL.density * STEEL.area
    for axis, wanted in ((0, film + cable), (1, film + cable), (2, film + cable + 0.06 * air)):
        u = np.zeros(system.nu).reshape(-1, 9)
        u[:, axis] = 1.0
        assert u.ravel() @ (mass @ u.ravel()) == pytest.approx(wanted, rel=1e-12)


def test_what_is_held_takes_no_part() -> None:
    made, grid = builder()
    made.hold(grid.edge("left"))
    system = AncfSystem(made.build())
    q, u = shaken(system)
    held = np.flatnonzero(system.fixed)
    moved = q.copy()
    moved[held[3]] = system.start[held[3]]
    linear = system.linearise(0.0, q, u)
    assert not np.any(linear.force[held])
    matrix = linear.stiffness.bsr().toarray()
    assert not np.any(matrix[held][:, ~system.fixed])
    assert not np.any(matrix[~system.fixed][:, held])
    reactions = system.reactions(0.0, q, None).ravel()
    assert not np.any(reactions[~system.fixed])
    assert np.abs(reactions[held]).max() > 0.0


def test_prescribed_motion_moves_what_it_names_and_tells_its_force() -> None:
    made, grid = builder()
    made.hold(grid.edge("left"))
    right = grid.position[-1]
    motion = SupportMotion(right, np.full(len(right), 1e-4), ramp(2.0))
    system = AncfSystem(made.build(), Loading(motions=(motion,)))
    q, _ = system.initial()
    here, rates = system.place(1.0, q, np.zeros(system.nu))
    assert rates is not None
    np.testing.assert_allclose(here[right] - system.start[right], 0.5e-4)
    np.testing.assert_allclose(rates[right], 0.5e-4)
    seen = system.observe(1.0, q, None)
    assert seen.drive.force[0] > 0.0
    ahead, behind = system.force(1.0 + 1e-6, q, None), system.force(1.0 - 1e-6, q, None)
    np.testing.assert_allclose(system.force_rate(1.0, q), (ahead - behind) / 2e-6, atol=1e-5 * np.abs(ahead).max())


def test_a_film_that_is_not_flat_at_rest() -> None:
    """The unstressed shape, for example with wrinkles, has no forces in any orientation."""
    made = MeshBuilder()
    made.film(np.array([0.0, 0.1, 0.25]), np.array([0.0, 0.12]), (FILM,))
    mesh = made.build()
    flat = AncfSystem(mesh)
    q, _ = shaken(flat)
    film = mesh.groups[0]
    assert isinstance(film, MembraneGroup)
    system = AncfSystem(replace(mesh, groups=(replace(film, rest=q),)))
    turned = (q.reshape(-1, 3) @ np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])).ravel()
    size = np.abs(flat.force(0.0, q, None)).max()
    for here in (q, turned):
        assert np.abs(system.force(0.0, here, None)).max() < 1e-12 * size
    stiffness = system.linearise(0.0, turned, None).stiffness.bsr().toarray()
    by_q = slopes(lambda x: system.force(0.0, x, None), turned)
    assert np.abs(stiffness + by_q).max() < 1e-7 * np.abs(stiffness).max()


def test_states_of_a_tension_field() -> None:
    made = MeshBuilder()
    made.film(np.array([0.0, 0.1]), np.array([0.0, 0.1]), (FILM,), tension_field=True)
    system = AncfSystem(made.build())
    nu = FILM.poisson

    def stressed(x: float, y: float) -> tuple[int, np.ndarray]:
        q = (system.start.reshape(-1, 3) * np.sqrt([1 + 2 * x, 1 + 2 * y, 1.0])).ravel()
        system.release(0.0, q, REMAINDER)
        stress = system.mesh.groups[0].stress(q)
        return int(stress.state[0, 0]), stress.principal[0, 0]

    assert stressed(1e-3, 1e-4)[0] == TAUT
    state, principal = stressed(1e-3, -2e-3)
    assert state == WRINKLED
    assert principal[0] == pytest.approx(FILM.young * 1e-3, rel=4e-3)
    assert abs(principal[1]) < 1e-12 * principal[0]
    state, principal = stressed(-1e-3, -2e-3)
    assert state == SLACK
    assert np.abs(principal).max() < 1e-12 * FILM.young * 1e-3
    # the film is taut until the smaller stress vanishes, at e2 = -nu e1, not until the smaller strain vanishes
    for part, expected in ((0.5, TAUT), (0.99, TAUT), (1.01, WRINKLED)):
        assert stressed(1e-3, -part * nu * 1e-3)[0] == expected, part
    # at that border the stress does not jump
    below, above = (stressed(1e-3, -nu * 1e-3 * (1 + e))[1] for e in (1e-9, -1e-9))
    np.testing.assert_allclose(below, above, atol=1e-3)


@pytest.mark.parametrize(
    ("pulse", "area"),
    [
        (half_sine(0.01), 0.02 / np.pi), (rectangle(0.004), 0.004),
        (sampled((0.0, 0.001, 0.005), (0.0, 1.0, 0.0)), 0.0025),
    ],
)
def test_pulses(pulse: Program, area: float) -> None:
    times = np.linspace(-0.002, 0.02, 22001)
    values = np.array([pulse.at(float(t))[0] for t in times])
    assert np.trapezoid(values, times) == pytest.approx(area, rel=1e-3)
    assert pulse.at(0.0)[0] == 0.0
    inside = 0.0021
    slope = (pulse.at(inside + 1e-8)[0] - pulse.at(inside - 1e-8)[0]) / 2e-8
    assert pulse.at(inside)[1] == pytest.approx(slope, abs=1e-4 * max(abs(slope), 1.0))
    assert max(pulse.breaks()) <= 0.01
