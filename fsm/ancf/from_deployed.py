"""A deployed strip of rigid segments as a film: its shape, its tension, its creases as lines of less bending stiffness.

The film's material lines are the strip's: X along it as if it were flat, Y across. Where a segment's joints have been drawn
apart, the film is stretched as much, which is the strip's tension. A crease with the moment M and the stiffness
k = dM/dpsi at its present angle psi becomes a line of width w whose bending stiffness over the strip's width b is

    D_crease b/w = k,    with the angle psi - M/k without moment,

so that moment and stiffness are those of the crease. Panels are flat without load.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fsm.ancf.build import FilmGrid, MeshBuilder
from fsm.ancf.film import FilmMaterial, MembraneGroup, film_mass
from fsm.ancf.group import MassPart
from fsm.ancf.mesh import Mesh

__all__ = ["CreaseLine", "DeployedStrip", "deployed_mesh"]


@dataclass(frozen=True)
class CreaseLine:
    """A crease of a deployed strip.

    Attributes
    ----------
    place : m
        Along the strip, as if it were flat.
    stiffness : N m/rad
        Over the width of the strip, at its present angle.
    free_angle : rad
        Turn of the film from before to behind the crease, about its width, at which it would have no moment.
    """

    place: float
    stiffness: float
    free_angle: float


@dataclass(frozen=True, eq=False)
class DeployedStrip:
    """A strip of segments at the end of its deployment.

    Attributes
    ----------
    place : (n + 1,) array, m
        Ends of the segments along the strip, as if it were flat.
    position : (n + 1, 3) array, m
        Where they are, in the middle of the width.
    across : (3,) array
        Unit vector along the width.
    width : m
    material : FilmMaterial
    creases : those that turn
    """

    place: np.ndarray
    position: np.ndarray
    across: np.ndarray
    width: float
    material: FilmMaterial
    creases: tuple[CreaseLine, ...]


def deployed_mesh(
    strip: DeployedStrip, x: np.ndarray, y: np.ndarray, crease_width: float, air: float = 0.0, viscosity: float = 0.0
) -> tuple[Mesh, FilmGrid]:
    """The strip as a film; its coordinates are those of the deployed shape.

    Parameters
    ----------
    strip : DeployedStrip
    x, y : mesh lines, m
        Along it, with lines at crease_width/2 on both sides of every crease; across, from -width/2 to width/2.
    crease_width : m
    air : kg/m^2
        Mass of air on the motion normal to the deployed shape.
    viscosity : s
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    middle = 0.5 * (x[1:] + x[:-1])
    factor = np.ones((len(x) - 1, len(y) - 1))
    for crease in strip.creases:
        soft = crease.stiffness * crease_width / (strip.material.bending * strip.width)
        factor[np.abs(middle - crease.place) < 0.5 * crease_width] = soft
    builder = MeshBuilder()
    grid = builder.film(x, y, (strip.material,), viscosity=viscosity, bending_factor=factor)
    mesh = builder.build()
    shape = _placed(mesh, grid, strip, *_deployed_line(strip, x))
    rest = _placed(mesh, grid, strip, *_unloaded_line(strip, x, crease_width))
    groups = tuple(replace(group, rest=rest) if isinstance(group, MembraneGroup) else group for group in mesh.groups)
    masses = (*mesh.masses, *(_air(group, shape, air) for group in groups if isinstance(group, MembraneGroup) and air))
    return replace(mesh, coordinates=shape, groups=groups, masses=masses), grid


def _deployed_line(strip: DeployedStrip, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and slopes (n, 3) of the strip's middle line at material places."""
    steps = np.diff(strip.place)
    slopes = np.diff(strip.position, axis=0) / steps[:, None]
    middle = strip.place[:-1] + 0.5 * steps
    position = np.column_stack([np.interp(x, strip.place, strip.position[:, axis]) for axis in range(3)])
    slope = np.column_stack([np.interp(x, middle, slopes[:, axis]) for axis in range(3)])
    # between segments that make an angle the chord is too short
    size = np.interp(x, middle, np.linalg.norm(slopes, axis=1))
    return position, slope * (size / np.linalg.norm(slope, axis=1))[:, None]


def _unloaded_line(strip: DeployedStrip, x: np.ndarray, crease_width: float) -> tuple[np.ndarray, np.ndarray]:
    """The same of the strip without load: straight panels, creases bent evenly to their free angles, no stretch."""
    turn = np.zeros(len(x))
    for crease in strip.creases:
        part = np.clip((x - crease.place) / crease_width + 0.5, 0.0, 1.0)
        turn += crease.free_angle * part
    along = np.diff(strip.position, axis=0)[0]
    along -= strip.across * (along @ strip.across)
    along /= np.linalg.norm(along)
    up = np.cross(along, strip.across)
    fine = np.linspace(0.0, 1.0, 33)
    position = [strip.position[0]]
    for k, step in enumerate(np.diff(x)):
        angle = turn[k] + (turn[k + 1] - turn[k]) * fine
        chord = np.trapezoid(np.column_stack([np.cos(angle), np.sin(angle)]), fine, axis=0) * step
        position.append(position[-1] + chord[0] * along + chord[1] * up)
    slope = np.cos(turn)[:, None] * along + np.sin(turn)[:, None] * up
    return np.array(position), slope


def _placed(mesh: Mesh, grid: FilmGrid, strip: DeployedStrip, position: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Coordinates of the mesh with the middle line along these points, straight across."""
    q = mesh.coordinates.copy()
    for i in range(len(grid.x)):
        for j, y in enumerate(grid.y):
            at = int(grid.position[i, j])
            q[at : at + 3] = position[i] + y * strip.across
            q[at + 3 : at + 6] = slope[i]
            q[at + 6 : at + 9] = strip.across
    return q


def _air(group: MembraneGroup, shape: np.ndarray, air: float) -> MassPart:
    """Air on the motion along each element's own normal in a shape."""
    corners = shape[group.vectors[:, ::3, None] + np.arange(3)]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    tensor = np.ascontiguousarray(normal[:, :, None] * normal[:, None, :])
    return MassPart(group.vectors, film_mass(group.sides, np.full(len(group.sides), air)), tensor)
