"""Builder of planar meshes of bars with common points; elements share coordinates, so there are no constraint equations.

At each node a bar has a separate position and separate slopes. At a common point (hinge) all bars use one position (master
and slaves, Peng et al. 2019, eq. 13, positions only) and keep separate slopes. At its middle point a bar has one section
vector r_y, which transmits the moment. The bar has a separate r_x on each side of this point, because the hinge causes a
jump of axial and shear forces. The second half may be at an angle to the first. The section vectors of the second half are
then stored rotated back by this angle, so both halves share r_y. A cable has no section vector. A cable has one r_x at the
middle point. The second half stores it rotated back, as other bars do with r_y.

Numbering of an array end to end: the specification matrix method of Peng et al. (2019), section 3, as a permutation.

Each unit lists first the coordinates of its left boundary, then its inner coordinates, and last the coordinates of its right
boundary. The right boundary of a unit is the left boundary of the next unit. B has a single 1 in each row and column, and
maps the new order to the original one. The inverse is its transpose. In the new order the matrices of an array are
block-banded with the width of one unit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np

from fsm.model.nodes.beams.beam_bernoulli import bernoulli_rows, bernoulli_shape, bernoulli_strains
from fsm.model.nodes.beams.beam_green import green_strains
from fsm.model.nodes.beams.beam_group import BeamGroup
from fsm.model.nodes.beams.beam_section import section_strains
from fsm.model.nodes.beams.beam_strain import beam_rows, beam_shape, gauss_points

Element = Literal["section", "green", "cable"]


@dataclass(frozen=True)
class BarMaterial:
    """Material and rectangular section of bars.

    Attributes
    ----------
    young, poisson, density : Pa, -, kg/m^3
    width, height : m
        Width across the plane of the array, and height in this plane.
    damping : s
        Kelvin-Voigt time.
    shear_factor : -
    """

    young: float
    poisson: float
    density: float
    width: float
    height: float
    damping: float = 0.0
    shear_factor: float = 5.0 / 6.0

    @property
    def area(self) -> float:
        """m^2."""
        return self.width * self.height

    @property
    def shear(self) -> float:
        """E/2(1 + nu), Pa."""
        return self.young / (2.0 * (1.0 + self.poisson))


@dataclass(frozen=True, eq=False)
class BarNodes:
    """Indices of a bar's coordinates, in order along the bar.

    Attributes
    ----------
    positions, slopes : (n + 1,) int arrays
        First coordinates of r and r_x at the nodes; r_x of a cable is rotated back to the first half.
    sections : (n + 1,) int array
        First coordinates of r_y, rotated back to the first half; empty for a cable.
    at : (n + 1,) array, m
        Positions of the nodes along the bar.
    elements : slice of the group's elements
    """

    positions: np.ndarray
    slopes: np.ndarray
    sections: np.ndarray
    at: np.ndarray
    elements: slice


@dataclass
class BarMesh:
    """Builder of bars; vectors of two coordinates are numbered in the order of their creation.

    Attributes
    ----------
    element : str
        See `fsm.case.models.scissor.Scissor`.
    material : BarMaterial
    """

    element: Element
    material: BarMaterial
    values: list[tuple[float, float]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    positions: list[int] = field(default_factory=list)
    bars: list[BarNodes] = field(default_factory=list)
    _vectors: list[list[int]] = field(default_factory=list)
    _lengths: list[float] = field(default_factory=list)
    _bends: list[float] = field(default_factory=list)

    def position(self, at: tuple[float, float], name: str) -> int:
        """Add a position; returns its first coordinate."""
        self.positions.append(self._vector(at, name))
        return self.positions[-1]

    def bar(self, name: str, points: Sequence[int], elements: Sequence[int]) -> BarNodes:
        """Add a bar through points.

        Parameters
        ----------
        name : str
        points : first coordinates of the positions on the bar, in order
        elements : number of elements between two successive positions
        """
        places = [np.array(self.values[point // 2]) for point in points]
        pieces = list(pairwise(places))
        angles = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pieces]
        first, at = len(self._vectors), 0.0
        nodes: list[tuple[int, list[int], float]] = []
        for k, ((a, b), angle, count) in enumerate(zip(pieces, angles, elements, strict=True)):
            length = float(np.linalg.norm(b - a)) / count
            if k == 0:
                nodes.append((points[0], self._slopes(angle, angle, f"{name} start"), 0.0))
            for i in range(1, count + 1):
                begin, slopes, _ = nodes[-1]
                if i == 1 and k and self.element != "cable":
                    after = self._vector((math.cos(angle), math.sin(angle)), f"{name} node {len(nodes) - 1}")
                    slopes = [after, slopes[1]]
                mixed = [self._vector((0.0, 0.0), f"{name} element {len(nodes)}")] if self.element != "cable" else []
                last = i == count
                label = f"{name} node {len(nodes)}"
                here = points[k + 1] if last else self.position(tuple(a + (b - a) * i / count), label)
                at += length
                nodes.append((here, self._slopes(angle, angles[0], label), at))
                self._vectors.append([begin, *slopes, here, *nodes[-1][1], *mixed])
                self._lengths.append(length)
                self._bends.append(angle - angles[0])
        self.bars.append(
            BarNodes(
                np.array([node[0] for node in nodes]),
                np.array([node[1][0] for node in nodes]),
                np.array([node[1][1] for node in nodes if len(node[1]) > 1], dtype=np.int64),
                np.array([node[2] for node in nodes]),
                slice(first, len(self._vectors)),
            )
        )
        return self.bars[-1]

    def group(self) -> BeamGroup:
        """Create the group of all elements."""
        build = {"section": self._section, "green": self._green, "cable": self._cable}[self.element]
        lengths = np.array(self._lengths)
        _, unlike, same = np.unique((lengths / lengths.max()).round(12), return_index=True, return_inverse=True)
        parts = [build(float(length)) for length in lengths[unlike]]
        rows, stiffness, masses = (np.stack(part)[same.ravel()] for part in zip(*parts, strict=True))
        beta = np.full(len(lengths), self.material.damping)
        vectors = np.array(self._vectors, dtype=np.int64)
        frames = np.zeros((*vectors.shape, 2))
        frames[..., 0] = 1.0
        through = _SLOPES if self.element == "cable" else _SECTIONS
        frames[:, through, 0], frames[:, through, 1] = np.cos(self._bends)[:, None], np.sin(self._bends)[:, None]
        return BeamGroup(_STRAINS[self.element], vectors, frames, rows, stiffness, beta, masses)

    def renumbered(self, order: np.ndarray) -> BarMesh:
        """Copy of the mesh in which vector `order[i]` has number i."""
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))

        def moved(first: np.ndarray) -> np.ndarray:
            return np.asarray(2 * place[np.asarray(first, dtype=np.int64) // 2])

        bars = [
            BarNodes(moved(bar.positions), moved(bar.slopes), moved(bar.sections), bar.at, bar.elements) for bar in self.bars
        ]
        return BarMesh(
            self.element, self.material, [self.values[i] for i in order], [self.names[i] for i in order],
            [int(i) for i in moved(np.array(self.positions))], bars,
            [[int(i) for i in moved(np.array(vectors))] for vectors in self._vectors], self._lengths, self._bends,
        )  # fmt: skip

    def _vector(self, value: tuple[float, float], name: str) -> int:
        self.values.append((float(value[0]), float(value[1])))
        self.names.append(name)
        return 2 * (len(self.values) - 1)

    def _slopes(self, angle: float, first: float, name: str) -> list[int]:
        """Add r_x, and r_y rotated back to the first half of the bar (of a cable r_x, rotated back)."""
        if self.element == "cable":
            return [self._vector((math.cos(first), math.sin(first)), name)]
        along = self._vector((math.cos(angle), math.sin(angle)), name)
        return [along, self._vector((-math.sin(first), math.cos(first)), name)]

    # data of elements of one length: rows (g, p, v), stiffness (g, s), masses (v, v)

    def _section(self, length: float) -> tuple[np.ndarray, ...]:
        m = self.material
        xi, weight = gauss_points(3, 0.0, 1.0)
        axial = m.young * m.area
        stiffness = [axial, m.shear_factor * m.shear * m.area, axial * m.height**2 / 12.0, axial]
        rows = beam_rows(xi, np.zeros_like(xi), length)
        return rows, np.outer(length * weight, stiffness), self._masses(length)

    def _green(self, length: float) -> tuple[np.ndarray, ...]:
        m = self.material
        xi, y, weight = _over_section(3, length, m.height, m.width)
        rows = beam_rows(xi, y, length)[:, :2]
        return rows, np.outer(weight, [m.young, m.young, m.shear_factor * m.shear]), self._masses(length)

    def _cable(self, length: float) -> tuple[np.ndarray, ...]:
        m = self.material
        xi, weight = gauss_points(4, 0.0, 1.0)
        shape = bernoulli_shape(xi, length)
        masses = np.einsum("g,gi,gj->ij", m.density * m.area * length * weight, shape, shape)
        xi, weight = gauss_points(3, 0.0, 1.0)
        axial = m.young * m.area
        return bernoulli_rows(xi, length), np.outer(length * weight, [axial, axial * m.height**2 / 12.0]), masses

    def _masses(self, length: float) -> np.ndarray:
        m = self.material
        xi, y, weight = _over_section(4, length, m.height, m.width)
        shape = beam_shape(xi, y, length)
        return np.asarray(np.einsum("g,gi,gj->ij", m.density * weight, shape, shape))


_SECTIONS = [2, 5, 6]
"""Indices of r_y and r_xy among the vectors of an element."""
_SLOPES = [1, 3]
"""Indices of r_x among the vectors of a cable."""
_STRAINS = {"section": section_strains, "green": green_strains, "cable": bernoulli_strains}


def _over_section(count: int, length: float, height: float, width: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss points x/L and y (m), with `count` points along the axis and two across it, and their volumes (m^3)."""
    xi, along = gauss_points(count, 0.0, 1.0)
    y, across = gauss_points(2, -0.5 * height, 0.5 * height)
    return np.repeat(xi, 2), np.tile(y, count), np.outer(length * along, width * across).ravel()


def end_to_end(units: Sequence[Sequence[int]]) -> np.ndarray:
    """Order of the numbers used by units, from the first unit to the last, each number once.

    Numbers that a unit shares with the next unit come last; the other numbers keep the order of the lists.
    """
    order: list[int] = []
    done: set[int] = set()
    for k, unit in enumerate(units):
        later = set(units[k + 1]) if k + 1 < len(units) else set()
        first = [i for i in unit if i not in done and i not in later]
        last = [i for i in unit if i not in done and i in later]
        for i in dict.fromkeys([*first, *last]):
            order.append(i)
            done.add(i)
    return np.array(order, dtype=np.int64)
