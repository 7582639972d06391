"""Film that this page and the comparisons with other programs use: 300 x 300 x 0.025 mm, polyimide, edges moved outwards by
1e-3 and held."""

from __future__ import annotations

import math

import numpy as np

from fsm.analyses.stretch import tensioned
from fsm.kernels.programs import ramp
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.loading import Loading, SupportMotion
from fsm.model.nodes.system.build import FilmGrid, MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.modal import modes

FILM = FilmMaterial(2.5e9, 0.34, 1420.0, 25e-6)
SIDE, STRAIN = 0.3, 1e-3
AMPLITUDE = 5e-4
"""Amplitude of the free vibration in the first mode, m."""


def pulled_film(n: int) -> tuple[AncfSystem, np.ndarray, FilmGrid]:
    """The film on n x n cells, the coordinates of its moved edges, and its nodes."""
    builder = MeshBuilder()
    lines = np.linspace(0.0, SIDE, n + 1)
    grid = builder.film(lines, lines, (FILM,))
    edge = grid.edge()
    builder.hold(edge, (2,))
    mesh = builder.build()
    plane = np.concatenate([edge, edge + 1])
    middle = np.where(plane % 9 < 2, 0.5 * SIDE, 0.0)
    motion = SupportMotion(plane, STRAIN * (mesh.coordinates[plane] - middle), ramp())
    return AncfSystem(mesh, Loading(motions=(motion,))), plane, grid


def tensioned_film(n: int) -> tuple[AncfSystem, FilmGrid]:
    """The film at rest, tensioned."""
    system, plane, grid = pulled_film(n)
    return tensioned(system, plane), grid


def plucked_film(n: int, amplitude: float = AMPLITUDE) -> tuple[AncfSystem, int]:
    """Tensioned film that passes through its rest position with the velocity of its first mode, and the height of its
    centre."""
    system, grid = tensioned_film(n)
    first = modes(system, 0.0, system.start, 1)
    height = int(grid.nearest(0.5 * SIDE, 0.5 * SIDE)) + 2
    rate = first.shapes[0] / first.shapes[0][height] * amplitude * 2 * math.pi * first.frequencies[0]
    return AncfSystem(system.mesh, None, system.start, rate), height


def exact_frequencies(count: int) -> np.ndarray:
    """Frequencies (Hz) of the stretched, hinged plate in material lengths; Green strain and tension are uniform."""
    tension = FILM.stretch * (1 + FILM.poisson) * STRAIN * (1 + 0.5 * STRAIN)
    waves = [(i * math.pi / SIDE) ** 2 + (j * math.pi / SIDE) ** 2 for i in range(1, 20) for j in range(1, 20)]
    k = np.array(waves)
    squared = (FILM.bending * k**2 / (1 + STRAIN) ** 2 + tension * k) / FILM.areal_density
    return np.sort(np.sqrt(squared) / (2 * math.pi))[:count]


def frequency(time: np.ndarray, height: np.ndarray) -> float:
    """Frequency from the first and the last time at which the height passes upwards through zero, Hz."""
    here = np.flatnonzero((height[:-1] < 0.0) & (height[1:] >= 0.0))
    cuts = time[here] - height[here] * (time[here + 1] - time[here]) / (height[here + 1] - height[here])
    return float((len(cuts) - 1) / (cuts[-1] - cuts[0]))
