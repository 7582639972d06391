"""Conversion of a deployed strip of rigid segments to a film with the same shape and tension; creases become lines where the
slope jumps.

The material coordinates of the film are those of the strip: X along the flat strip, Y across it. The film has the same
stretch as the joints of the segments, and therefore the tension of the strip. Panels are flat in the unloaded state. A
crease is a line on which the slope along X jumps, with a torsional spring (`fsm.model.nodes.facets.crease_line`). At its
present rotation psi a crease has the moment M and the stiffness k = dM/dpsi. The spring has the stiffness k and zero moment
at psi - M/k.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fsm.model.nodes.facets.crease_line import crease_line
from fsm.model.nodes.facets.folds import FoldGroup
from fsm.model.nodes.films.film import FilmMaterial, MembraneGroup, film_mass
from fsm.model.nodes.group import MassPart
from fsm.model.nodes.mesh import Mesh
from fsm.model.nodes.system.build import FilmGrid, MeshBuilder


@dataclass(frozen=True)
class CreaseLine:
    """A crease of a deployed strip.

    Attributes
    ----------
    place : m
        Coordinate along the strip in its flat state.
    stiffness : N m/rad
        Stiffness over the width of the strip, at the present angle.
    free_angle : rad
        Rotation of the film from before to behind the crease, about the width, at which the crease has no moment;
        positive upwards.
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
        Ends of the segments along the strip in its flat state.
    panel : (n,) int array
        Number of the panel of each segment.
    position : (n + 1, 3) array, m
        Positions of the ends, in the middle of the width.
    across : (3,) array
        Unit vector along the width.
    width : m
    material : FilmMaterial
    creases : creases that can turn
    """

    place: np.ndarray
    panel: np.ndarray
    position: np.ndarray
    across: np.ndarray
    width: float
    material: FilmMaterial
    creases: tuple[CreaseLine, ...]


def deployed_mesh(
    strip: DeployedStrip, place: np.ndarray, y: np.ndarray, air: float = 0.0, viscosity: float = 0.0
) -> tuple[Mesh, FilmGrid]:
    """Mesh of the strip as a film in the deployed shape.

    Parameters
    ----------
    strip : DeployedStrip
    place, y : m
        Mesh lines: `place` along the strip in its flat state, with one line on every crease; `y` across, from -width/2 to
        width/2.
    air : kg/m^2
        Mass of air on the motion normal to the deployed shape.
    viscosity : s
        Kelvin-Voigt time of film and creases.

    Returns
    -------
    Mesh, FilmGrid
        The x coordinates of the grid start at the beginning of the strip.
    """
    place, y = np.asarray(place, dtype=float), np.asarray(y, dtype=float)
    folds = [int(np.argmin(np.abs(place - crease.place))) for crease in strip.creases]
    builder = MeshBuilder()
    grid = builder.film(place, y, (strip.material,), viscosity=viscosity, folds=folds)
    before, behind = _slopes(strip, place, folds)
    if folds:
        builder.add(_crease_lines(strip, grid, folds, before, behind, viscosity))
    mesh = builder.build()
    shape = mesh.coordinates.copy()
    middle = np.column_stack([np.interp(place, strip.place, strip.position[:, axis]) for axis in range(3)])
    position = middle[:, None] + y[:, None] * strip.across
    owners = np.where(grid.behind == grid.position + 3, grid.position, grid.behind - 3)  # nodes that own the slopes
    for nodes, slope in ((owners, behind), (grid.position, before)):
        shape[nodes[:, :, None] + np.arange(3)] = position
        shape[nodes[:, :, None] + np.arange(3, 6)] = slope[:, None]
    shape[grid.position[:, :, None] + np.arange(6, 9)] = strip.across
    groups = [group for group in mesh.groups if isinstance(group, MembraneGroup)]
    masses = (*mesh.masses, *(_air(group, shape, air) for group in groups if air))
    return replace(mesh, coordinates=shape, masses=masses), grid


def _slopes(strip: DeployedStrip, place: np.ndarray, folds: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Slopes along X before and behind every mesh line, (n, 3); the two slopes are different on folds only."""
    steps = np.diff(strip.place)
    slopes, middle = np.diff(strip.position, axis=0) / steps[:, None], strip.place[:-1] + 0.5 * steps
    before, behind = np.empty((len(place), 3)), np.empty((len(place), 3))
    ends = [0, *folds, len(place) - 1]
    for panel, first, last in zip(dict.fromkeys(strip.panel.tolist()), ends, ends[1:], strict=False):
        own, here = strip.panel == panel, place[first : last + 1]
        along = np.column_stack([np.interp(here, middle[own], slopes[own, axis]) for axis in range(3)])
        before[first + 1 : last + 1], behind[first:last] = along[1:], along[:-1]
    before[0], behind[-1] = behind[0], before[-1]
    return before, behind


def _crease_lines(
    strip: DeployedStrip, grid: FilmGrid, folds: list[int], before: np.ndarray, behind: np.ndarray, viscosity: float
) -> FoldGroup:
    """Springs of all creases, distributed over the nodes of their lines."""
    gaps = np.diff(grid.y) / (grid.y[-1] - grid.y[0])
    share = 0.5 * (np.append(gaps, 0.0) + np.insert(gaps, 0, 0.0))
    at = grid.position[folds]
    vectors = np.stack([at + 3, grid.behind[folds], at + 6], axis=-1).reshape(-1, 3)
    free = np.array([crease.free_angle for crease in strip.creases])
    turn = np.array([_turn(before[i], behind[i], strip.across) for i in folds])
    stiffness = np.array([crease.stiffness for crease in strip.creases])
    count = len(share)
    return crease_line(
        vectors, np.outer(stiffness, share).ravel(), np.repeat(free, count), np.repeat(turn, count), viscosity
    )


def _turn(first: np.ndarray, last: np.ndarray, across: np.ndarray) -> float:
    """Rotation from one direction to another about `across`; positive from x towards z if `across` is y."""
    return float(np.arctan2(np.cross(last, first) @ across, first @ last))


def _air(group: MembraneGroup, shape: np.ndarray, air: float) -> MassPart:
    """Added mass of air for motion along the normal of each element in a shape."""
    corners = shape[group.vectors[:, ::3, None] + np.arange(3)]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    tensor = np.ascontiguousarray(normal[:, :, None] * normal[:, None, :])
    return MassPart(group.vectors, film_mass(group.sides, np.full(len(group.sides), air)), tensor)
