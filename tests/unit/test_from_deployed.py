"""A deployed strip as a film: shape, length, creases, air along its own normals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fsm.model.nodes.facets.crease_line import crease_line
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.system.from_deployed import CreaseLine, DeployedStrip, deployed_mesh
from fsm.model.nodes.system.system import AncfSystem

SHEET = FilmMaterial(3e9, 0.3, 800.0, 3e-4)


def bent(turn: float, stretch: float = 0.0, free: float | None = None, stiffness: float = 2e-3) -> DeployedStrip:
    """Two panels of 80 mm in ten segments each, the second turned down by an angle."""
    place = np.linspace(0.0, 0.16, 21)
    down = np.array([np.cos(turn), 0.0, -np.sin(turn)])
    knee = np.array([0.08 * (1 + stretch), 0.0, 0.0])
    far = np.clip(place - 0.08, 0.0, None)[:, None] * down * (1 + stretch)
    position = np.where(place[:, None] <= 0.08, place[:, None] / 0.08 * knee, knee + far)
    crease = CreaseLine(0.08, stiffness, -turn if free is None else free)  # down is negative
    panel = np.repeat([1, 2], 10)
    return DeployedStrip(place, panel, position, np.array([0.0, 1.0, 0.0]), 0.04, SHEET, (crease,))


LINES = np.unique(np.concatenate([np.linspace(0.0, 0.08, 7), np.linspace(0.08, 0.16, 7)]))
ACROSS = np.linspace(-0.02, 0.02, 3)


def test_a_flat_strip_is_a_flat_film() -> None:
    mesh, grid = deployed_mesh(bent(0.0), LINES, ACROSS)
    assert np.array_equal(grid.x, LINES)
    system = AncfSystem(mesh)
    assert np.abs(system.force(0.0, mesh.coordinates, None)).max() < 1e-9
    assert sum(system.energies(0.0, mesh.coordinates).values()) == pytest.approx(0.0, abs=1e-15)


def test_a_drawn_strip_is_as_tense_as_its_joints() -> None:
    """Every joint open by 1e-4 of its segment: Green strain 1e-4, stress E/(1 - nu^2) times that."""
    mesh, _ = deployed_mesh(bent(0.0, 1e-4), LINES, ACROSS)
    stress = mesh.groups[0].stress(mesh.coordinates).principal  # type: ignore[attr-defined]
    assert stress[..., 0] == pytest.approx(np.full(stress.shape[:2], 3e9 / 0.91 * 1e-4), rel=1e-3)


@pytest.mark.parametrize("turn", [0.3, 1.0, -0.7, 2.8])
def test_a_crease_is_sharp_and_panels_are_flat(turn: float) -> None:
    """Without a moment in the crease there is no strain, at any fold angle."""
    mesh, grid = deployed_mesh(bent(turn), LINES, ACROSS)
    middle = mesh.coordinates[grid.position[:, 1][:, None] + np.arange(3)]
    assert middle[-1] == pytest.approx([0.08 + 0.08 * np.cos(turn), 0.0, -0.08 * np.sin(turn)], abs=1e-9)
    strain = mesh.groups[0].strains(mesh.coordinates)  # type: ignore[attr-defined]
    assert np.abs(strain).max() < 1e-9
    assert np.abs(AncfSystem(mesh).force(0.0, mesh.coordinates, None)).max() < 1e-6


def test_the_moment_of_a_crease() -> None:
    """Held flat against its free angle, the line stores k psi^2/2; its nodes' moments add up to k psi."""
    psi, k = 0.4, 2e-3
    mesh, grid = deployed_mesh(bent(0.0, free=psi, stiffness=k), LINES, ACROSS)
    system = AncfSystem(mesh)
    assert sum(system.energies(0.0, mesh.coordinates).values()) == pytest.approx(0.5 * k * psi**2, rel=1e-9)
    force = system.force(0.0, mesh.coordinates, None)
    fold = int(np.argmin(np.abs(LINES - 0.08)))
    assert force[grid.behind[fold] + 2].sum() == pytest.approx(k * psi, rel=1e-9)
    assert force[grid.position[fold] + 5].sum() == pytest.approx(-k * psi, rel=1e-9)


@pytest.mark.parametrize("viscosity", [0.0, 1e-3])
@pytest.mark.parametrize("turn", [0.4, -2.9])
def test_tangents_of_a_crease_line(turn: float, viscosity: float) -> None:
    """Stiffness and damping against differences of the force, force against those of the energy, in a random state."""
    slopes = np.array([[1.0, 0.0, 0.0], [np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0]])
    rng = np.random.default_rng(1)
    q, u = (np.tile(slopes, (2, 1)) + 0.05 * rng.standard_normal((6, 3))).ravel(), rng.standard_normal(18)
    lines = crease_line(
        3 * np.arange(6).reshape(2, 3), np.array([0.7, 1.3]), np.array([0.1, -0.2]), np.full(2, turn), viscosity
    )
    slots = np.array([[[9 * 6 * i + 9 * j for j in group] for i in group] for group in ((0, 1, 2), (3, 4, 5))])

    def force(x: np.ndarray, v: np.ndarray | None) -> np.ndarray:
        total = np.zeros(18)
        lines.add_force(x, v, total)
        return total

    def slope(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
        return np.stack([(function(x + h) - function(x - h)) / 2e-6 for h in 1e-6 * np.eye(18)], axis=-1)

    stiffness, damping, total = np.zeros((36, 3, 3)), np.zeros((36, 3, 3)), np.zeros(18)
    lines.add_linearised(q, u, slots, total, stiffness, damping)
    full = [data.reshape(6, 6, 3, 3).transpose(0, 2, 1, 3).reshape(18, 18) for data in (stiffness, damping)]
    assert total == pytest.approx(force(q, u), abs=1e-14)
    assert np.abs(full[0] + slope(lambda x: force(x, u), q)).max() < 1e-7
    assert np.abs(full[1] + slope(lambda v: force(q, v), u)).max() < 1e-7
    assert force(q, None) == pytest.approx(-slope(lambda x: np.array(lines.energy(x, None)[0]), q), abs=1e-7)
    assert lines.energy(q, u)[1] == pytest.approx((force(q, None) - force(q, u)) @ u, abs=1e-12)


def test_air_goes_along_the_normal() -> None:
    """If the bent film moves as a whole, the air acts on the square of the normal's component, panel by panel."""
    turn, air = 1.0, 0.3
    still, _ = deployed_mesh(bent(turn), LINES, ACROSS)
    moved, _ = deployed_mesh(bent(turn), LINES, ACROSS, air)
    u = np.zeros(len(still.coordinates))
    u[2::9] = 1.0
    kinetic = [AncfSystem(mesh).energy(0.0, mesh.coordinates, u * ~mesh.fixed).kinetic for mesh in (still, moved)]
    assert kinetic[0] == pytest.approx(0.5 * SHEET.areal_density * 0.04 * 0.16, rel=1e-6)
    assert kinetic[1] - kinetic[0] == pytest.approx(0.5 * air * 0.04 * 0.08 * (1.0 + np.cos(turn) ** 2), rel=1e-6)
