"""Membrane elements as a group: material, unstressed shape, mass, stresses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.model.nodes import tension_field as tension
from fsm.model.nodes.films.array_films import FILMS
from fsm.model.nodes.films.membrane import (
    MembraneArrays,
    curvatures_at,
    stored_energy,
    strains_at,
)
from fsm.model.nodes.group import ElementGroup, MassPart
from fsm.model.nodes.shape import gauss, membrane_shape

POINTS = (4, 3)
"""Gauss points along a side, for stretch and for bending.

Test: six lowest frequencies of a tensioned square with 6 x 6 cells. With 5 points in stretch they change by 6e-6. With
3 points some motions have no stiffness and become unstable under tension along their slopes. Three points in bending
are exact for small deflections of a flat plate.
"""

_STRETCH = ((1, 0), (0, 1))
_BEND = ((1, 0), (0, 1), (2, 0), (0, 2), (1, 1))
_UNSTRESSED = 1e-6
"""Strain relative to the largest strain, below which a compression is round-off and causes no wrinkle."""


@dataclass(frozen=True)
class FilmMaterial:
    """Isotropic material of a film.

    Attributes
    ----------
    young : Pa
    poisson : -
    density : kg/m^3
    thickness : m
    """

    young: float
    poisson: float
    density: float
    thickness: float

    @property
    def stretch(self) -> float:
        """C = E t/(1 - nu^2), N/m."""
        return self.young * self.thickness / (1.0 - self.poisson**2)

    @property
    def bending(self) -> float:
        """D = E t^3/(12 (1 - nu^2)), N m."""
        return self.stretch * self.thickness**2 / 12.0

    @property
    def areal_density(self) -> float:
        """rho t, kg/m^2."""
        return self.density * self.thickness

    @property
    def moduli(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness for exx, eyy, 2 exy (N/m), and for kxx, kyy, 2 kxy (N m), (3, 3)."""
        nu = self.poisson
        unit = np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
        return self.stretch * unit, self.bending * unit


@dataclass(frozen=True)
class LaminateMaterial(FilmMaterial):
    """Laminate without coupling of stretch and bending; its isotropic constants belong to its stiffest direction.

    Attributes
    ----------
    membrane, plate : (3, 3) arrays, N/m and N m
        Stiffness A for exx, eyy, 2 exy, and D for kxx, kyy, 2 kxy.
    """

    membrane: np.ndarray
    plate: np.ndarray

    @property
    def moduli(self) -> tuple[np.ndarray, np.ndarray]:
        """A and D."""
        return self.membrane, self.plate


@dataclass(frozen=True)
class FilmStress:
    """Stresses at the points of stretch of a group, (m, s) arrays.

    Attributes
    ----------
    position : (m, s, 3) array, m
        Positions in the deformed shape.
    principal : (m, s, 2) array, Pa
        Cauchy stresses, the larger first.
    direction : (m, s, 3) array
        Unit vector of the larger principal stress, in the surface.
    state : TAUT, WRINKLED or SLACK by the mixed criterion
    area : m^2
        Area that each point represents.
    """

    position: np.ndarray
    principal: np.ndarray
    direction: np.ndarray
    state: np.ndarray
    area: np.ndarray


@dataclass(frozen=True, eq=False)
class MembraneGroup(ElementGroup):
    """Membrane elements of one material; see `fsm.model.nodes.films.membrane`.

    Attributes
    ----------
    vectors : (m, 12) int array
        First coordinates of r, r_X, r_Y at the nodes A, B, C, D.
    sides : (m, 2) array, m
        b along X, c along Y.
    material : FilmMaterial
    tension_field : whether the film carries no compression
    viscosity : s
        Kelvin-Voigt.
    rest : (n,) array or None
        All coordinates in the unstressed shape; flat if absent.
    name : name of its energy
    points : Gauss points per side, for stretch and for bending
    """

    vectors: np.ndarray
    sides: np.ndarray
    material: FilmMaterial
    tension_field: bool = False
    viscosity: float = 0.0
    rest: np.ndarray | None = None
    name: str = "film"
    points: tuple[int, int] = POINTS
    kernels = FILMS

    @property
    def table(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [*self.arrays, np.array([self.viscosity])]

    @property
    def wave_speed(self) -> float:
        """Speed of axial waves, m/s."""
        return math.sqrt(self.material.stretch / self.material.areal_density)

    def mass(self) -> MassPart:
        """See `ElementGroup`: exact, int rho t S_i S_j dX dY."""
        density = np.full(len(self.sides), self.material.areal_density)
        return MassPart(self.vectors, film_mass(self.sides, density), np.eye(3))

    def energies(self, q: np.ndarray) -> tuple[float, float]:
        """Energy of stretch and of bending, J."""
        stretch, bend = stored_energy(self.arrays, q)
        return float(stretch), float(bend)

    def strains(self, q: np.ndarray) -> np.ndarray:
        """Green strains xx, yy, xy at the points of stretch, (m, s, 3)."""
        return np.asarray(strains_at(self.arrays, q))

    def stress(self, q: np.ndarray) -> FilmStress:
        """Principal stresses where the stretch is integrated."""
        strain = self.strains(q)
        shapes = [membrane_shape(*self._stretch_points[0], derivative=d) for d in ((0, 0), *_STRETCH)]
        e = q[self.vectors[:, :, None] + np.arange(3)] * self._scale[:, :, None]
        position, x, y = (np.einsum("si,mia->msa", shape, e) for shape in shapes)
        x, y = x / self.sides[:, :1, None], y / self.sides[:, 1:, None]
        states = tension.film_states(strain, self.material.poisson)
        # under tension along one axis, round-off of the stress across this axis is no wrinkle
        middle, half = 0.5 * (strain[..., 0] + strain[..., 1]), 0.5 * (strain[..., 0] - strain[..., 1])
        radius, nu = np.hypot(half, strain[..., 2]), self.material.poisson
        across = (1.0 + nu) * middle - (1.0 - nu) * radius
        states[(states == tension.WRINKLED) & (across > -_UNSTRESSED * np.abs(strain).max(initial=0.0))] = tension.TAUT
        tensor = self._cauchy(strain, x, y)
        values, vectors = np.linalg.eigh(tensor)
        # two of the three directions lie in the surface; the third has no stress
        flat = np.argmax(np.abs(np.einsum("msak,msa->msk", vectors, np.cross(x, y))), axis=-1)
        keep = np.array([[2, 1], [2, 0], [1, 0]])[flat]
        principal = np.take_along_axis(values, keep, axis=-1)
        direction = np.take_along_axis(vectors, keep[..., None, :1], axis=-1)[..., 0]
        area = np.prod(self.sides, axis=1)[:, None] * self._stretch_points[1]
        return FilmStress(position, principal, direction, states, area)

    def _cauchy(self, strain: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Cauchy stresses F S F^T/J over the thickness, (m, s, 3, 3), Pa."""
        resultant = self._resultants(strain)
        frame = np.stack([x, y], axis=-1)
        second = np.empty((*strain.shape[:2], 2, 2))
        second[..., 0, 0], second[..., 1, 1] = resultant[..., 0], resultant[..., 1]
        second[..., 0, 1] = second[..., 1, 0] = resultant[..., 2]
        stretched = np.linalg.norm(np.cross(x, y), axis=-1)
        tensor = frame @ second @ np.swapaxes(frame, -1, -2)
        return np.asarray(tensor / (stretched * self.material.thickness)[..., None, None])

    def _resultants(self, strain: np.ndarray) -> np.ndarray:
        """Second Piola-Kirchhoff resultants xx, yy, xy, N/m."""
        material, arrays = self.material, self.arrays
        remainder, width = (float(x) for x in arrays.remainder)
        return np.asarray(
            tension.film_resultants(strain, material.stretch, material.poisson, remainder, width, arrays.release)
        )

    def release(self, q: np.ndarray, remainder: float) -> None:
        """Remove the compression from a tension field in a configuration; see `fsm.model.nodes.tension_field`.

        Parameters
        ----------
        remainder : - Fraction eps of the plain law after this call.
        """
        if self.tension_field:
            strain, material = self.strains(q), self.material
            width = tension.ROUNDED * tension.mean_tension(strain) if remainder >= tension.MOVING else 0.0
            tension.film_releases(strain, material.stretch, material.poisson, remainder, width, self.arrays.release)
            self.arrays.remainder[:] = remainder, width

    @property
    def _scale(self) -> np.ndarray:
        return self.arrays.scale

    @cached_property
    def _stretch_points(self) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        return _square(self.points[0])

    @cached_property
    def arrays(self) -> MembraneArrays:
        """Arrays of the kernels."""
        flat = self._flat_arrays
        if self.rest is None:
            return flat
        return flat._replace(rest_strain=strains_at(flat, self.rest), rest_curvature=curvatures_at(flat, self.rest))

    @cached_property
    def _flat_arrays(self) -> MembraneArrays:
        count = len(self.sides)
        stretch_points, stretch_weights = self._stretch_points
        bend_points, bend_weights = _square(self.points[1])
        rows = np.concatenate(
            [membrane_shape(*stretch_points, derivative=d) for d in _STRETCH]
            + [membrane_shape(*bend_points, derivative=d) for d in _BEND]
        )
        scale = np.tile(np.column_stack([np.ones(count), self.sides]), 4)
        material = self.material
        stiffness = np.column_stack(
            [np.full(count, material.stretch), np.full(count, material.poisson), np.full(count, material.bending)]
        )
        return MembraneArrays(
            np.ascontiguousarray(self.vectors), np.ascontiguousarray(scale), np.ascontiguousarray(self.sides),
            np.ascontiguousarray(stiffness), np.array([tension.REMAINDER if self.tension_field else 1.0, 0.0]),
            np.zeros((count, len(stretch_weights), 3)), np.zeros((count, len(stretch_weights), 3)),
            np.zeros((count, len(bend_weights), 3)), np.ascontiguousarray(rows.T), np.ascontiguousarray(rows),
            stretch_weights, bend_weights,
        )  # fmt: skip


def film_mass(sides: np.ndarray, areal_density: np.ndarray) -> np.ndarray:
    """Mass matrices int m S_i S_j dX dY of elements, (m, 12, 12), kg times metres for slopes; m (m,) in kg/m^2."""
    (x, y), weights = _square(5)
    shapes = membrane_shape(x, y)
    unit = np.einsum("g,gi,gj->ij", weights, shapes, shapes)
    scale = np.tile(np.column_stack([np.ones(len(sides)), sides]), 4)
    mass = (areal_density * np.prod(sides, axis=1))[:, None, None] * unit
    return np.asarray(mass * scale[:, :, None] * scale[:, None, :])


def _square(count: int) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Gauss points (x, y) of the unit square and their weights."""
    points, weights = gauss(count)
    x, y = (grid.ravel() for grid in np.meshgrid(points, points, indexing="ij"))
    return (x, y), np.outer(weights, weights).ravel()
