"""Second stage of two: the deployed strip as a film that vibrates."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from fsm.analyses.film import FilmMesh
from fsm.builders.strip import segment_lengths
from fsm.case.derived.membrane import MeshLines
from fsm.case.models.case import Case, Strip
from fsm.case.models.materials import Crease, LinearCrease, SplineCrease
from fsm.case.models.membrane import Deployed
from fsm.errors import NotConverged
from fsm.kernels.interpolation import interpolate
from fsm.model.nodes.films.air import air_mass
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.system.build import FilmGrid
from fsm.model.nodes.system.from_deployed import CreaseLine, DeployedStrip, deployed_mesh
from fsm.model.system.system import SegmentSystem
from fsm.results.film import Floats
from fsm.results.solution import Solution
from fsm.solve.equations.relax import relaxed

_SAME_PLACE = 1e-6
"""Distance, relative to the length of a panel, below which two mesh lines coincide."""
_FINER = 1.5
"""Ratio of the numbers of elements of the finer mesh and of the mesh itself, in both directions."""


@dataclass(frozen=True, eq=False)
class DeployedFilm:
    """Film of a deployed strip, and its coordinates that supports and drives of the strip hold.

    Attributes
    ----------
    film : FilmMesh
    held : int array
    finer : DeployedFilm, optional
        The strip on a finer mesh, to compute the error of this mesh.
    """

    film: FilmMesh
    held: np.ndarray
    finer: DeployedFilm | None = None


def film_of_deployment(case: Case, solution: Solution, system: SegmentSystem) -> DeployedFilm:
    """Film of a deployed strip at rest, after its drives have stopped.

    Parameters
    ----------
    case : Case
        Case with both stages.
    solution : solution of the first stage
    system : SegmentSystem
        System of the first stage.

    Raises
    ------
    NotConverged
        The strip has no equilibrium at the end of the drives.
    """
    strip, material, crease = case.strip, case.material, case.crease
    assert strip is not None and material is not None and crease is not None
    options = case.deployed or Deployed()
    panel_length = strip.length / strip.panels
    place, position, across, panel = _middle_line(_shape_at_rest(solution, system), solution.layout.panel, panel_length)
    for end, where in _known_places(case, strip, solution).items():
        position[int(np.argmin(np.abs(place - end * panel_length)))] = where
    clamped = _clamped(case, strip, panel_length)
    sheet = FilmMaterial(material.young, material.poisson, material.density, strip.thickness)
    turns = _turns(position, across, panel)
    creases = tuple(
        _crease_line(number * panel_length, turns[number - 1], number, strip, crease) for number in range(1, strip.panels)
    )
    air = air_mass(case.air.length or strip.length, case.air.density) if case.air else 0.0
    viscosity = case.damping.material if case.damping else 0.0
    deployed = DeployedStrip(place, panel, position, across, strip.width, sheet, creases)

    def on(options: Deployed, finer: DeployedFilm | None) -> DeployedFilm:
        lines = _lines(strip, options, panel_length, clamped)
        mesh, grid = deployed_mesh(deployed, np.array(lines.x), np.array(lines.y), air, viscosity)
        held = _held(case, grid, panel_length, clamped)
        # material coordinates start at the middle of the strip, as for all films
        grid = FilmGrid(grid.x - 0.5 * strip.length, grid.y, grid.position, grid.behind)
        cells = np.zeros((len(grid.x) - 1, len(grid.y) - 1), dtype=np.int64)
        corners = np.array([grid.position[i, j] for i, j in ((0, 0), (-1, 0), (-1, -1), (0, -1))])
        film = FilmMesh(mesh, grid, MeshLines(tuple(grid.x), lines.y), (), cells, corners, np.zeros((4, 3)))
        return DeployedFilm(film, held, finer)

    return on(options, on(_finer(options), None))


def _finer(options: Deployed) -> Deployed:
    along, across = (math.ceil(_FINER * n) for n in (options.elements_per_panel, options.elements_across))
    return options.model_copy(update={"elements_per_panel": along, "elements_across": across})


def _shape_at_rest(solution: Solution, system: SegmentSystem) -> Floats:
    """Corners of the segments in equilibrium; the drives rest at their final positions, without damper forces."""
    t, q = float(solution.time[-1]), solution.q[-1]
    try:
        return system.shape(t, relaxed(system, t, q).q)
    except NotConverged as error:
        raise NotConverged(f"equilibrium of the strip at the end of its drives: {error}") from None


def _middle_line(quads: Floats, panel: np.ndarray, panel_length: float) -> tuple[Floats, Floats, Floats, np.ndarray]:
    """Material coordinates and positions of the segments' ends, direction across, and panel of each segment."""
    order = np.flatnonzero(panel > 0)
    quads, panel = quads[order], panel[order]
    start, end = quads[:, [0, 3]].mean(axis=1), quads[:, [1, 2]].mean(axis=1)
    sizes = np.linalg.norm(end - start, axis=1)
    for number in np.unique(panel):  # a plate has constant length, except in the layers beside a crease
        sizes[panel == number] *= panel_length / sizes[panel == number].sum()
    place = np.concatenate([[0.0], np.cumsum(sizes)])
    position = np.vstack([start[:1], 0.5 * (end[:-1] + start[1:]), end[-1:]])
    across = (quads[:, 3] - quads[:, 0]).mean(axis=0)
    return place, position, across / np.linalg.norm(across), panel


def _known_places(case: Case, strip: Strip, solution: Solution) -> dict[int, Floats]:
    """Exact positions of panel ends at held panels and driven lines, by number of the crease.

    Elsewhere the spring between two segments is stretched, and the position is the middle of both ends.
    """
    known = {}
    for drive in case.drive:
        line = drive.line(strip.panels)
        if line is not None and drive.guide:
            x, z = strip.crease_point(line)
            direction = np.array(drive.direction) / np.linalg.norm(drive.direction)
            known[line] = np.array([x, 0.0, z]) + float(solution.travel[-1, case.drive.index(drive)]) * direction
    for number in sorted(case.held_panels):
        for end in (number - 1, number):
            x, z = strip.crease_point(end)
            known[end] = np.array([x, 0.0, z])
    return known


def _turns(position: Floats, across: Floats, panel: np.ndarray) -> Floats:
    """Rotation of the strip at each crease about its width, rad; positive upwards for a strip along x."""
    along = np.diff(position, axis=0)
    at = np.flatnonzero(np.diff(panel) != 0)
    before, behind = along[at], along[at + 1]
    return np.arctan2(np.cross(behind, before) @ across, np.einsum("ka,ka->k", before, behind))


def _crease_line(place: float, turn: float, number: int, strip: Strip, crease: Crease) -> CreaseLine:
    """Stiffness of a crease at its present angle, and the rotation at which its moment is zero."""
    folded = strip.crease_angle if crease.rest_angle is None else crease.rest_angle
    side = -1.0 if number % 2 else 1.0  # panels 1, 3, 5 rise: the strip bends down at crease 1
    psi = side * turn
    if isinstance(crease, LinearCrease):
        return CreaseLine(place, crease.stiffness, side * folded)
    assert isinstance(crease, SplineCrease)  # the curve of a family is computed when the case is read
    assert crease.angle is not None and crease.moment is not None
    curve = interpolate(np.array(crease.angle), np.array(crease.moment), crease.interpolation)
    opened = float(np.clip(folded - psi, crease.angle[0], crease.angle[-1]))
    stiffness, moment = crease.scale * float(curve(opened, 1)), crease.scale * float(curve(opened))
    return CreaseLine(place, stiffness, side * (psi + moment / stiffness))


def _lines(
    strip: Strip, options: Deployed, panel_length: float, clamped: list[tuple[float, float]]
) -> MeshLines:
    """Mesh lines along the flat strip (at creases, beside them, at equal distances between them, and at ends of clamps), and
    across it.
    """
    beside = 0.5 * (options.crease_width or 0.1 * panel_length)
    lines: list[float] = []
    for number in range(strip.panels):
        begin, end = number * panel_length, (number + 1) * panel_length
        first = begin + beside if number else begin
        last = end - beside if number < strip.panels - 1 else end
        lines += [begin, *np.linspace(first, last, options.elements_per_panel + 1).tolist(), end]
    lines += [place for ends in clamped for place in ends]
    lines.sort()
    distinct = [lines[0]]
    for place in lines[1:]:
        if place - distinct[-1] > _SAME_PLACE * panel_length:
            distinct.append(place)
    across = np.linspace(-0.5 * strip.width, 0.5 * strip.width, options.elements_across + 1)
    return MeshLines(tuple(distinct), tuple(float(y) for y in across))


def _clamped(case: Case, strip: Strip, panel_length: float) -> list[tuple[float, float]]:
    """Ends of clamped parts along the flat strip: held panels and driven segments."""
    parts = []
    for number in sorted(case.held_panels):
        parts.append(((number - 1) * panel_length, number * panel_length))
    ends = np.concatenate([[0.0], np.cumsum(segment_lengths(strip))])
    for drive in case.drive:
        for body in drive.moved if drive.panel is None else (drive.part,):
            found = re.fullmatch(r"panel (\d+)(?: segment (\d+))?", body)
            if found is not None:
                begin = (int(found[1]) - 1) * panel_length
                first, last = (ends[0], ends[-1]) if found[2] is None else ends[int(found[2]) - 1 : int(found[2]) + 1]
                parts.append((begin + float(first), begin + float(last)))
    return parts


def _held(case: Case, grid: FilmGrid, panel_length: float, clamped: list[tuple[float, float]]) -> np.ndarray:
    """All coordinates of clamped parts and of driven crease lines; x is the coordinate along the flat strip."""
    held = []
    for begin, end in clamped:
        first, last = (int(np.argmin(np.abs(grid.x - place))) for place in (begin, end))
        nodes = grid.position[first : last + 1]
        held += [nodes, nodes + 6, grid.position[first + 1 : last + 1] + 3, grid.behind[first:last]]
    vectors = [(first.ravel()[:, None] + np.arange(3)).ravel() for first in held]
    for drive in case.drive:
        number = None if case.strip is None else drive.line(case.strip.panels)
        if number is None:
            continue
        line = grid.position[int(np.argmin(np.abs(grid.x - number * panel_length)))]
        (axes,) = np.nonzero(np.array(drive.direction))
        if drive.guide or len(axes) > 1:  # the driven line also remains straight
            vectors += [(line[:, None] + [0, 1, 2, 6, 7, 8]).ravel()]
        else:
            vectors += [line + axes[0]]
    return np.unique(np.concatenate(vectors)) if vectors else np.zeros(0, dtype=np.int64)
