"""A deployed strip as a film: shape, length, creases, air along its own normals."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.ancf.film import FilmMaterial
from fsm.ancf.from_deployed import CreaseLine, DeployedStrip, deployed_mesh
from fsm.ancf.system import AncfSystem

SHEET = FilmMaterial(3e9, 0.3, 800.0, 3e-4)
WIDTH = 0.01


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


LINES = np.concatenate([np.linspace(0.0, 0.075, 6), np.linspace(0.075, 0.085, 9)[1:-1], np.linspace(0.085, 0.16, 6)])
ACROSS = np.linspace(-0.02, 0.02, 3)


def test_a_flat_strip_is_a_flat_film() -> None:
    mesh, grid = deployed_mesh(bent(0.0), LINES, ACROSS, WIDTH)
    assert np.allclose(grid.x, LINES, rtol=0, atol=1e-12)
    system = AncfSystem(mesh)
    assert np.abs(system.force(0.0, mesh.coordinates, None)).max() < 1e-9
    assert sum(system.energies(0.0, mesh.coordinates).values()) == pytest.approx(0.0, abs=1e-15)


def test_a_drawn_strip_is_as_tense_as_its_joints() -> None:
    """Every joint open by 1e-4 of its segment: Green strain 1e-4, stress E/(1 - nu^2) times that."""
    mesh, _ = deployed_mesh(bent(0.0, 1e-4), LINES, ACROSS, WIDTH)
    stress = mesh.groups[0].stress(mesh.coordinates).principal  # type: ignore[attr-defined]
    assert stress[..., 0] == pytest.approx(np.full(stress.shape[:2], 3e9 / 0.91 * 1e-4), rel=1e-3)


@pytest.mark.parametrize("turn", [0.3, 1.0, -0.7])
def test_a_crease_is_rounded_off_and_keeps_the_ways(turn: float) -> None:
    """Panels stay where they are; in the round the film is as long as its arc, so nothing is stretched."""
    mesh, grid = deployed_mesh(bent(turn), LINES, ACROSS, WIDTH)
    middle = mesh.coordinates[grid.position[:, 1][:, None] + np.arange(3)]
    assert middle[-1] == pytest.approx([0.08 + 0.08 * np.cos(turn), 0.0, -0.08 * np.sin(turn)], abs=1e-9)
    arc = grid.x[13] - grid.x[5]
    assert arc == pytest.approx(WIDTH * np.cos(turn / 2) * (turn / 2) / np.sin(turn / 2), rel=1e-6)
    strain = mesh.groups[0].strains(mesh.coordinates)  # type: ignore[attr-defined]
    assert np.abs(strain).max() < 1e-4
    assert np.abs(AncfSystem(mesh).force(0.0, mesh.coordinates, None)).max() < 1e-6


def test_the_moment_of_a_crease() -> None:
    """Held flat against its free angle, the line stores what the crease does, k psi^2/2: bent one way, a film has D."""
    psi, k = 0.4, 2e-3
    mesh, _ = deployed_mesh(bent(0.0, free=psi, stiffness=k), LINES, ACROSS, WIDTH)
    stored = sum(AncfSystem(mesh).energies(0.0, mesh.coordinates).values())
    assert stored == pytest.approx(0.5 * k * psi**2, rel=0.01)


def test_air_goes_along_the_normal() -> None:
    """Moving the bent film as a whole, air counts with the square of the normal's component, panel by panel."""
    turn, air = 1.0, 0.3
    still, _ = deployed_mesh(bent(turn), LINES, ACROSS, WIDTH)
    moved, grid = deployed_mesh(bent(turn), LINES, ACROSS, WIDTH, air)
    u = np.zeros(len(still.coordinates)).reshape(-1, 9)
    u[:, 2] = 1.0
    kinetic = [AncfSystem(mesh).energy(0.0, mesh.coordinates, u.ravel()).kinetic for mesh in (still, moved)]
    area = 0.04 * grid.x[-1]
    assert kinetic[0] == pytest.approx(0.5 * SHEET.areal_density * area, rel=1e-6)
    panels = 0.5 * air * 0.04 * 0.075 * (1.0 + np.cos(turn) ** 2)
    assert kinetic[1] - kinetic[0] == pytest.approx(panels, rel=0.15)  # and the round between them
    assert kinetic[1] - kinetic[0] > panels
