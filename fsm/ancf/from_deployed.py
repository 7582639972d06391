"""A deployed strip of rigid segments as a film: its shape, its tension, its creases as lines of less bending stiffness.

The film's material lines are the strip's: X along it as if it were flat, Y across. Where a segment's joints have been drawn
apart, the film is stretched as much, which is the strip's tension. A crease with the moment M and the stiffness
k = dM/dpsi at its present angle psi becomes a line of width w whose bending stiffness over the strip's width b is

    D_crease b/w = k,    with the angle psi - M/k without moment,

so that moment and stiffness are those of the crease. Panels are flat without load. A crease that is still folded is rounded
off over its line, whose material is as long as the round is, so that the way from panel to panel stays the same.
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
        Turn of the film from before to behind the crease, about its width, at which it would have no moment; positive up.
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
    panel : (n,) int array
        Number of the panel that each is part of.
    position : (n + 1, 3) array, m
        Where they are, in the middle of the width.
    across : (3,) array
        Unit vector along the width.
    width : m
    material : FilmMaterial
    creases : those that turn
    """

    place: np.ndarray
    panel: np.ndarray
    position: np.ndarray
    across: np.ndarray
    width: float
    material: FilmMaterial
    creases: tuple[CreaseLine, ...]


@dataclass(frozen=True, eq=False)
class _Line:
    """The middle line at the mesh lines: material places of the film (m), positions, slopes (n, 3), turn without load."""

    x: np.ndarray
    position: np.ndarray
    slope: np.ndarray
    turn: np.ndarray


def deployed_mesh(
    strip: DeployedStrip, place: np.ndarray, y: np.ndarray, crease_width: float, air: float = 0.0, viscosity: float = 0.0
) -> tuple[Mesh, FilmGrid]:
    """The strip as a film; its coordinates are those of the deployed shape.

    Parameters
    ----------
    strip : DeployedStrip
    place, y : m
        Mesh lines: along the strip as if it were flat, with lines at crease_width/2 on both sides of every crease; across,
        from -width/2 to width/2.
    crease_width : m
    air : kg/m^2
        Mass of air on the motion normal to the deployed shape.
    viscosity : s

    Returns
    -------
    Mesh, FilmGrid
        The grid's x are material places of the film, from 0 where the strip begins.
    """
    place, y = np.asarray(place, dtype=float), np.asarray(y, dtype=float)
    line = _line(strip, place, crease_width)
    middle = 0.5 * (place[1:] + place[:-1])
    factor = np.ones((len(place) - 1, len(y) - 1))
    for crease in strip.creases:
        here = np.abs(middle - crease.place) < 0.5 * crease_width
        width = float(np.sum(np.diff(line.x)[here]))
        factor[here] = crease.stiffness * width / (strip.material.bending * strip.width)
    builder = MeshBuilder()
    grid = builder.film(line.x, y, (strip.material,), viscosity=viscosity, bending_factor=factor)
    mesh = builder.build()
    shape = _placed(mesh, grid, strip, line.position, line.slope)
    rest = _placed(mesh, grid, strip, *_unloaded(strip, line))
    groups = tuple(replace(group, rest=rest) if isinstance(group, MembraneGroup) else group for group in mesh.groups)
    masses = (*mesh.masses, *(_air(group, shape, air) for group in groups if isinstance(group, MembraneGroup) and air))
    return replace(mesh, coordinates=shape, groups=groups, masses=masses), grid


def _line(strip: DeployedStrip, place: np.ndarray, crease_width: float) -> _Line:
    """The middle line: along the segments on panels, round in creases."""
    steps = np.diff(strip.place)
    slopes = np.diff(strip.position, axis=0) / steps[:, None]
    middle = strip.place[:-1] + 0.5 * steps
    position = np.column_stack([np.interp(place, strip.place, strip.position[:, axis]) for axis in range(3)])
    slope = np.empty_like(position)
    ends = [crease.place for crease in strip.creases]
    of = np.searchsorted(ends, place, side="right")
    for number, panel in enumerate(dict.fromkeys(strip.panel.tolist())):
        here, own = of == number, strip.panel == panel
        slope[here] = np.column_stack([np.interp(place[here], middle[own], slopes[own, axis]) for axis in range(3)])
    gaps, turn = np.diff(place), np.zeros(len(place))
    for crease in strip.creases:
        inside = np.flatnonzero(np.abs(place - crease.place) <= 0.5 * crease_width * (1.0 + 1e-9))
        first, last = int(inside[0]), int(inside[-1])
        part = (place[first : last + 1] - place[first]) / (place[last] - place[first])
        chord = position[last] - position[first]
        angle = _angle(slope[first], slope[last], strip.across)
        arc = float(np.linalg.norm(chord)) / float(np.sinc(angle / (2.0 * np.pi)))
        sizes = np.interp(part, [0.0, 1.0], [np.linalg.norm(slope[k]) for k in (first, last)])
        start = slope[first] / np.linalg.norm(slope[first])
        way = arc * _way(start, strip.across, angle, part)
        position[first : last + 1] = position[first] + way + part[:, None] * (chord - way[-1])
        slope[first : last + 1] = _around(start, strip.across, angle, part) * sizes[:, None]
        gaps[first:last] = arc / sizes.mean() * np.diff(part)
        turn += crease.free_angle * np.clip((place - place[first]) / (place[last] - place[first]), 0.0, 1.0)
    return _Line(np.concatenate([[0.0], np.cumsum(gaps)]), position, slope, turn)


def _angle(first: np.ndarray, last: np.ndarray, across: np.ndarray) -> float:
    """Turn from one direction to another about `across`; positive up, from x towards z for a width along y."""
    return float(np.arctan2(np.cross(last, first) @ across, first @ last))


def _around(first: np.ndarray, across: np.ndarray, angle: float, part: np.ndarray) -> np.ndarray:
    """The direction turned by parts of an angle, (n, 3)."""
    up = np.cross(first, across)
    return np.cos(angle * part)[:, None] * first + np.sin(angle * part)[:, None] * up


def _way(first: np.ndarray, across: np.ndarray, angle: float, part: np.ndarray) -> np.ndarray:
    """Way along an even bend of length 1 after parts of it, (n, 3)."""
    half = 0.5 * angle * part
    chord = part * np.sinc(half / np.pi)
    return chord[:, None] * _around(first, across, 1.0, half)


def _unloaded(strip: DeployedStrip, line: _Line) -> tuple[np.ndarray, np.ndarray]:
    """Positions and slopes of the strip without load: straight panels, creases bent evenly to their free angles."""
    along = line.slope[0] - strip.across * (line.slope[0] @ strip.across)
    along /= np.linalg.norm(along)
    position = [line.position[0]]
    for k, step in enumerate(np.diff(line.x)):
        start = _around(along, strip.across, 1.0, line.turn[k : k + 1])[0]
        position.append(position[-1] + step * _way(start, strip.across, line.turn[k + 1] - line.turn[k], np.ones(1))[0])
    return np.array(position), _around(along, strip.across, 1.0, line.turn)


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
