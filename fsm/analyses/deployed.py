"""The second stage of two: the strip as its deployment left it becomes the film that vibrates."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from fsm.analyses.film import FilmMesh
from fsm.ancf.air import air_mass
from fsm.ancf.build import FilmGrid
from fsm.ancf.film import FilmMaterial
from fsm.ancf.from_deployed import CreaseLine, DeployedStrip, deployed_mesh
from fsm.ancf.mesh import Mesh
from fsm.results.solution import Floats, Solution
from fsm.scene.builders.membrane import MeshLines
from fsm.scene.case import Case, Strip
from fsm.scene.materials import Crease, LinearCrease, SplineCrease
from fsm.scene.membrane import Deployed

__all__ = ["DeployedFilm", "film_of_deployment"]

_CREASE_COLUMNS = 8
"""Elements over the width of a crease."""
_SHARES = (0.0, 0.1, 0.25, 0.45, 0.7, 1.0)
"""Parts of the creases' moments that are put on one after the other."""


@dataclass(frozen=True, eq=False)
class DeployedFilm:
    """A film, and what held and drew the strip.

    Attributes
    ----------
    film : FilmMesh
    before : tuple of Mesh
        The same film with less and less of its creases' moments taken off: its equilibria lead to that of the film.
    held : int array
        Coordinates that are held.
    drawn : int array
        Those of them that drives draw at; they find their places under the forces that the deployment ended with, since a
        crease of some width takes up more of the strip than a line does, which would cost a taut strip its tension.
    forces : (nq,) array, N
    """

    film: FilmMesh
    before: tuple[Mesh, ...]
    held: np.ndarray
    drawn: np.ndarray
    forces: np.ndarray


def film_of_deployment(case: Case, solution: Solution) -> DeployedFilm:
    """The film that a deployed strip is, in the shape of the last record.

    Parameters
    ----------
    case : Case
        With both stages.
    solution : of the first one
    """
    strip, material, crease = case.strip, case.material, case.crease
    assert strip is not None and material is not None and crease is not None
    options = case.deployed or Deployed()
    panel_length = strip.length / strip.panels
    width = options.crease_width or 0.1 * panel_length
    place, position, across, panel = _middle_line(solution, panel_length)
    lines = _lines(strip, options, panel_length, width)
    sheet = FilmMaterial(material.young, material.poisson, material.density, strip.thickness)
    turns = _turns(position, across, panel)
    creases = [
        _crease_line(number * panel_length, turns[number - 1], number, strip, crease) for number in range(1, strip.panels)
    ]
    air = air_mass(case.air.length or strip.length, case.air.density) if case.air else 0.0
    viscosity = case.damping.material if case.damping else 0.0
    meshes = []
    for share in _SHARES:
        bent = tuple(
            replace(crease, free_angle=turn + share * (crease.free_angle - turn))
            for crease, turn in zip(creases, turns.tolist(), strict=True)
        )
        deployed = DeployedStrip(place, panel, position, across, strip.width, sheet, bent)
        mesh, grid = deployed_mesh(deployed, np.array(lines.x), np.array(lines.y), width, air, viscosity)
        meshes.append(mesh)
    # material places count from the middle of the strip, as those of any film do from their centre
    x = grid.x - float(np.interp(0.5 * strip.length, lines.x, grid.x))
    grid = FilmGrid(x, grid.y, grid.position)
    cells = np.zeros((len(x) - 1, len(grid.y) - 1), dtype=np.int64)
    corners = np.array([grid.position[i, j] for i, j in ((0, 0), (-1, 0), (-1, -1), (0, -1))])
    film = FilmMesh(mesh, grid, MeshLines(tuple(x), lines.y), (), cells, corners, np.zeros((4, 3)))
    flat = np.array(lines.x)
    held = _held(case, strip, film, flat, panel_length, width)
    drawn, forces = _pull(case, film, solution.force[-1], _driven(case, film, flat, panel_length))
    return DeployedFilm(film, tuple(meshes[:-1]), held, drawn, forces)


def _middle_line(solution: Solution, panel_length: float) -> tuple[Floats, Floats, Floats, np.ndarray]:
    """Material places and positions of the segments' ends, the direction across, and the panel of each segment."""
    quads, panel = solution.shape[-1], solution.layout.panel
    order = np.flatnonzero(panel > 0)
    quads, panel = quads[order], panel[order]
    start, end = quads[:, [0, 3]].mean(axis=1), quads[:, [1, 2]].mean(axis=1)
    sizes = np.linalg.norm(end - start, axis=1)
    for number in np.unique(panel):  # a plate keeps its length, but for the layers beside a crease
        sizes[panel == number] *= panel_length / sizes[panel == number].sum()
    place = np.concatenate([[0.0], np.cumsum(sizes)])
    position = np.vstack([start[:1], 0.5 * (end[:-1] + start[1:]), end[-1:]])
    across = (quads[:, 3] - quads[:, 0]).mean(axis=0)
    return place, position, across / np.linalg.norm(across), panel


def _turns(position: Floats, across: Floats, panel: np.ndarray) -> Floats:
    """Turn of the strip at each crease about its width, rad; positive up where the strip goes along x."""
    along = np.diff(position, axis=0)
    at = np.flatnonzero(np.diff(panel) != 0)
    before, behind = along[at], along[at + 1]
    return np.arctan2(np.cross(behind, before) @ across, np.einsum("ka,ka->k", before, behind))


def _crease_line(place: float, turn: float, number: int, strip: Strip, crease: Crease) -> CreaseLine:
    """Stiffness of a crease at its present angle, and the turn at which it would have no moment."""
    folded = 2.0 * strip.fold_angle if crease.rest_angle is None else crease.rest_angle
    side = -1.0 if number % 2 else 1.0  # panels 1, 3, 5 rise: the strip turns down at crease 1
    psi = side * turn
    if isinstance(crease, LinearCrease):
        return CreaseLine(place, crease.stiffness, side * folded)
    assert isinstance(crease, SplineCrease)  # a family gives its curve when the case is read
    assert crease.angle is not None and crease.moment is not None
    law = CubicSpline if crease.interpolation == "cubic" else PchipInterpolator
    curve = law(np.array(crease.angle), np.array(crease.moment))
    opened = float(np.clip(folded - psi, crease.angle[0], crease.angle[-1]))
    stiffness, moment = crease.scale * float(curve(opened, 1)), crease.scale * float(curve(opened))
    return CreaseLine(place, stiffness, side * (psi + moment / stiffness))


def _lines(strip: Strip, options: Deployed, panel_length: float, width: float) -> MeshLines:
    """Mesh lines along the flat strip, on both sides of every crease, in it, and evenly between; and across."""
    lines: list[float] = []
    for number in range(strip.panels):
        begin = number * panel_length + (0.5 * width if number else 0.0)
        end = (number + 1) * panel_length - (0.5 * width if number < strip.panels - 1 else 0.0)
        count = options.elements_per_panel
        lines += [float(x) for x in np.linspace(begin, end, count + 1)]
        if number < strip.panels - 1:
            lines += [end + width * k / _CREASE_COLUMNS for k in range(1, _CREASE_COLUMNS)]
    across = np.linspace(-0.5 * strip.width, 0.5 * strip.width, options.elements_across + 1)
    return MeshLines(tuple(lines), tuple(float(y) for y in across))


def _held(case: Case, strip: Strip, film: FilmMesh, x: Floats, panel_length: float, width: float) -> np.ndarray:
    """All coordinates on held panels, and the positions of driven crease lines; x as if the strip were flat."""
    held = []
    for number in (1, strip.panels) if strip.held is None else strip.held:
        begin, end = (number - 1) * panel_length, number * panel_length
        low = begin + (0.5 * width if number > 1 else 0.0)
        high = end - (0.5 * width if number < strip.panels else 0.0)
        here = film.grid.position[(x >= low - 1e-12) & (x <= high + 1e-12)].ravel()
        held.append((here[:, None] + np.arange(9)).ravel())
    held += [(nodes[:, None] + np.arange(3)).ravel() for _, nodes in _driven(case, film, x, panel_length)]
    return np.unique(np.concatenate(held)) if held else np.zeros(0, dtype=np.int64)


def _driven(case: Case, film: FilmMesh, x: Floats, panel_length: float) -> list[tuple[int, np.ndarray]]:
    """Number of each drive of a crease, and the first coordinates of the positions on its line."""
    lines = [(k, drive.crease) for k, drive in enumerate(case.drive) if drive.crease is not None]
    return [(k, film.grid.position[int(np.argmin(np.abs(x - crease * panel_length)))]) for k, crease in lines]


def _pull(
    case: Case, film: FilmMesh, force: Floats, driven: list[tuple[int, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates along which drives pull, where that is along an axis, and the forces (nq,) that they end with."""
    free: list[np.ndarray] = []
    forces = np.zeros(len(film.mesh.coordinates))
    share = np.full(len(film.grid.y), 1.0)
    share[[0, -1]] = 0.5
    for number, nodes in driven:
        direction = np.array(case.drive[number].direction, dtype=float)
        (axes,) = np.nonzero(direction)
        if len(axes) == 1:
            free.append(nodes + axes[0])
            forces[nodes + axes[0]] += np.sign(direction[axes[0]]) * force[number] * share / share.sum()
    return (np.concatenate(free) if free else np.zeros(0, dtype=np.int64)), forces
