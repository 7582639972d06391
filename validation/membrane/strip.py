"""Sheared strip: wrinkles resolved by the mesh, the tension field, and the closed form.

A strip of Kapton with clamped long edges; the upper edge is moved along itself by 1 mm. The film starts with waves, and its
energy is decreased until it reaches a stable shape.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache

import numpy as np

from fsm.analyses.stretch import settled
from fsm.kernels.programs import ramp
from fsm.model.nodes.films.film import FilmMaterial, MembraneGroup
from fsm.model.nodes.films.wrinkle import lifted, strip_wrinkles
from fsm.model.nodes.loading import Loading, SupportMotion
from fsm.model.nodes.shape import cable_shape
from fsm.model.nodes.system.build import FilmGrid, MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.equations.relax import relaxed

FILM = FilmMaterial(3.5e9, 0.31, 1500.0, 25e-6)
HEIGHT, SHEAR, PULL = 0.128, 1e-3, 5e-5
"""Height of the strip, shear and pull of its upper edge, m."""


@dataclass(frozen=True)
class Wrinkled:
    """Resolved wrinkles; lengths in m, stresses in Pa.

    Attributes
    ----------
    half_wavelength, amplitude : across the wrinkles, along the middle line, in the middle half of the length
    resolved, tension_field : mean larger principal stress in the middle quarter of the length and half of the height
    smaller : mean smaller principal stress there, resolved
    energy : J
        If one strip has several stable shapes, the shape of least energy is used.
    iterations : number of iterations of the energy descent
    seconds : processor time
    """

    half_wavelength: float
    amplitude: float
    resolved: float
    tension_field: float
    smaller: float
    energy: float
    iterations: int
    seconds: float


def sheared_strip(length: float, cell: float, tension_field: bool) -> tuple[AncfSystem, FilmGrid]:
    """The strip with its upper edge to be moved; the motion is complete at time 1. The strip starts in plain shear."""
    builder = MeshBuilder()
    x, y = (np.linspace(0.0, size, round(size / cell) + 1) for size in (length, HEIGHT))
    grid = builder.film(x, y, (FILM,), tension_field=tension_field)
    upper = grid.edge("top")
    builder.hold(grid.edge("bottom"))
    builder.hold(upper, (2,))
    for side in (0, -1):
        builder.hold(grid.position[:, side] + 6, (2,))  # the edge is clamped, so it has no slope across
    mesh = builder.build()
    moved = np.concatenate([upper, upper + 1])
    is_position = moved % 9 < 3
    way = np.where(is_position, np.where(moved % 9 == 0, SHEAR, PULL), 0.0)
    start = mesh.coordinates.reshape(-1, 9).copy()
    part = start[:, 1] / HEIGHT
    start[:, 0] += SHEAR * part
    start[:, 1] += PULL * part
    start[:, 6] += SHEAR / HEIGHT
    start[:, 7] += PULL / HEIGHT
    system = AncfSystem(mesh, Loading(motions=(SupportMotion(moved, way, ramp()),)), mesh.coordinates)
    free = ~system.fixed
    system.start[free] = start.ravel()[free]
    return system, grid


def wrinkled_strip(length: float, cell: float, seed: float = 1.0, max_iterations: int = 1500) -> Wrinkled:
    """Solve the strip on square cells (m).

    Parameters
    ----------
    length, cell : m
    seed : half-wavelength of the initial shape over that of the closed form The amplitude is that of the closed form.
    """
    begun = time.thread_time()
    system, grid = sheared_strip(length, cell, False)
    closed = strip_wrinkles(HEIGHT, FILM.thickness, FILM.poisson, SHEAR / HEIGHT)
    wave = np.pi / (np.sqrt(2.0) * seed * closed.half_wavelength)

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.asarray(closed.amplitude * np.sin(np.pi * y / HEIGHT) * np.cos(wave * (x - y)))

    start = lifted(system.start, grid.position, height)
    start[system.fixed] = system.start[system.fixed]
    found = relaxed(system, 1.0, start, tolerance=1e-6, max_iterations=max_iterations)
    q = system.place(1.0, found.q, None)[0]
    resolved, plain = middle_stress(system, q, length), tension_field_stress(length, cell)
    half_wavelength, amplitude = waves(q, grid, cell, length)
    seconds = time.thread_time() - begun
    energy = sum(system.energies(1.0, found.q).values())
    return Wrinkled(half_wavelength, amplitude, resolved[0], plain[0], resolved[1], energy, found.iterations, seconds)


@cache
def tension_field_stress(length: float, cell: float) -> np.ndarray:
    """`middle_stress` of the strip as a tension field; it does not depend on the initial waves of the other models."""
    field, _ = sheared_strip(length, cell, True)
    slack = settled(field, 1.0, field.initial()[0], tolerance=1e-6)
    return middle_stress(field, field.place(1.0, slack.q, None)[0], length)


def middle_stress(system: AncfSystem, q: np.ndarray, length: float) -> np.ndarray:
    """Mean principal stresses in the middle quarter of the length and half of the height, Pa."""
    group = system.mesh.groups[0]
    assert isinstance(group, MembraneGroup)
    stress = group.stress(q)
    x, y = stress.position[..., 0], stress.position[..., 1]
    middle = (np.abs(x - 0.5 * length) < length / 8) & (np.abs(y - 0.5 * HEIGHT) < HEIGHT / 4)
    return np.asarray(stress.principal[middle].mean(axis=0))


def waves(q: np.ndarray, grid: FilmGrid, cell: float, length: float) -> tuple[float, float]:
    """Half-wavelength across wrinkles at 45 degrees and mean height of crests and troughs, m, near the middle line."""
    parts = np.linspace(0.0, 1.0, 21)[:-1]
    shapes = cable_shape(parts, cell)
    row = grid.position.shape[1] // 2
    lengths, heights = [], []
    for j in range(row - 2, row + 3):
        nodes = grid.position[:, j]
        w, slope = q[nodes + 2], q[nodes + 5]
        z = (np.stack([w[:-1], slope[:-1], w[1:], slope[1:]], axis=1) @ shapes.T).ravel()
        x = (grid.x[:-1, None] + cell * parts).ravel()
        keep = np.abs(x - 0.5 * length) < 0.25 * length
        x, z = x[keep], z[keep]
        lengths.append(np.mean(np.diff(x[:-1][z[:-1] * z[1:] < 0.0])) / np.sqrt(2.0))
        size = np.abs(z)
        heights.append(np.mean(size[1:-1][(size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])]))
    return float(np.mean(lengths)), float(np.mean(heights))
