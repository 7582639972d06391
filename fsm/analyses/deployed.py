"""The second stage of two: the strip as its deployment left it becomes the film that vibrates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from fsm.analyses.film import FilmMesh
from fsm.ancf.air import air_mass
from fsm.ancf.film import FilmMaterial
from fsm.ancf.from_deployed import CreaseLine, DeployedStrip, deployed_mesh
from fsm.results.solution import Floats, Solution
from fsm.scene.builders.membrane import MeshLines
from fsm.scene.case import Case, Strip
from fsm.scene.materials import Crease, LinearCrease, SplineCrease
from fsm.scene.membrane import Deployed

__all__ = ["DeployedFilm", "film_of_deployment"]

_CREASE_COLUMNS = 2
"""Elements over the width of a crease."""


@dataclass(frozen=True, eq=False)
class DeployedFilm:
    """A film and the coordinates that what held and drew the strip holds."""

    film: FilmMesh
    held: np.ndarray


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
    turns = _turns(place, position, across, panel)
    creases = tuple(
        _crease_line(number * panel_length, turns[number - 1], number, strip, crease) for number in range(1, strip.panels)
    )
    air = air_mass(case.air.length or strip.length, case.air.density) if case.air else 0.0
    viscosity = case.damping.material if case.damping else 0.0
    mesh, grid = deployed_mesh(
        DeployedStrip(place, position, across, strip.width, sheet, creases),
        np.array(lines.x) + 0.5 * strip.length, np.array(lines.y), width, air, viscosity,
    )  # fmt: skip
    # material places count from the film's centre, as those of any film
    grid = type(grid)(np.array(lines.x), np.array(lines.y), grid.position)
    cells = np.zeros((len(lines.x) - 1, len(lines.y) - 1), dtype=np.int64)
    corners = np.array([grid.position[i, j] for i, j in ((0, 0), (-1, 0), (-1, -1), (0, -1))])
    film = FilmMesh(mesh, grid, lines, (), cells, corners, np.zeros((4, 3)))
    return DeployedFilm(film, _held(case, strip, film, panel_length, width))


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


def _turns(place: Floats, position: Floats, across: Floats, panel: np.ndarray) -> Floats:
    """Angle from the segment before to the one behind each crease, about `across`, rad; positive towards along x across."""
    along = np.diff(position, axis=0)
    at = np.flatnonzero(np.diff(panel) != 0)
    before, behind = along[at], along[at + 1]
    sine = np.einsum("ka,ka->k", np.cross(behind, before), np.broadcast_to(across, before.shape))
    return np.arctan2(sine, np.einsum("ka,ka->k", before, behind))


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
    """Mesh lines from the strip's centre: on both sides of every crease and in it, and evenly between."""
    lines: list[float] = []
    for number in range(strip.panels):
        begin = number * panel_length + (0.5 * width if number else 0.0)
        end = (number + 1) * panel_length - (0.5 * width if number < strip.panels - 1 else 0.0)
        count = options.elements_per_panel
        lines += [float(x) for x in np.linspace(begin, end, count + 1)]
        if number < strip.panels - 1:
            lines += [end + width * k / _CREASE_COLUMNS for k in range(1, _CREASE_COLUMNS)]
    across = np.linspace(-0.5 * strip.width, 0.5 * strip.width, options.elements_across + 1)
    return MeshLines(tuple(x - 0.5 * strip.length for x in lines), tuple(float(y) for y in across))


def _held(case: Case, strip: Strip, film: FilmMesh, panel_length: float, width: float) -> np.ndarray:
    """All coordinates on held panels, and the positions of driven crease lines."""
    x = np.array(film.lines.x) + 0.5 * strip.length
    held = []
    for number in (1, strip.panels) if strip.held is None else strip.held:
        begin, end = (number - 1) * panel_length, number * panel_length
        low = begin + (0.5 * width if number > 1 else 0.0)
        high = end - (0.5 * width if number < strip.panels else 0.0)
        here = film.grid.position[(x >= low - 1e-12) & (x <= high + 1e-12)].ravel()
        held.append((here[:, None] + np.arange(9)).ravel())
    for drive in case.drive:
        if drive.crease is not None:
            nearest = int(np.argmin(np.abs(x - drive.crease * panel_length)))
            held.append((film.grid.position[nearest][:, None] + np.arange(3)).ravel())
    return np.unique(np.concatenate(held)) if held else np.zeros(0, dtype=np.int64)
