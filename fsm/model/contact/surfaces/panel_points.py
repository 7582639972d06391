"""Contact points of one segmented panel: positions, weights and other data that depend on this panel alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fsm.case.models.scene import Body, Plate
from fsm.kernels.rotation import rotation_matrix


@dataclass(frozen=True)
class PanelPoints:
    """Points of a panel in the order of its bodies; in space two lines of points.

    Attributes
    ----------
    bodies : (b,) int array
        Bodies of the panel, in order along it.
    length, thickness : m
    ends : lengths of the first and of the last body, m
    middle : (3,) array, m
    normal, direction : (3,) arrays
        Third axis of the middle body; first axis of the first body.
    body : (n,) int array
    place : (n, 2) array
        x and y in the body's axes, m.
    along : (n,) array
        Distance from the start of the panel, m.
    inset : (n,) array
        Half the thickness at each point, m.
    weight, area : (n,) arrays
        Length (m) and area (m^2) of the panel that a point represents.
    half_cell : (n,) array
        Half the length of the cell around the point, m; a cell at a segment end extends into the next segment.
    at_end : (n,) bool array
        Whether a point is at an end of the panel.
    """

    bodies: np.ndarray
    length: float
    thickness: float
    ends: tuple[float, float]
    middle: np.ndarray
    normal: np.ndarray
    direction: np.ndarray
    body: np.ndarray
    place: np.ndarray
    along: np.ndarray
    inset: np.ndarray
    weight: np.ndarray
    area: np.ndarray
    half_cell: np.ndarray
    at_end: np.ndarray

    @classmethod
    def of(
        cls,
        numbers: np.ndarray,
        bodies: Sequence[Body],
        mean_length: float,
        rule: tuple[np.ndarray, np.ndarray],
        spatial: bool,
    ) -> PanelPoints:
        """Create the points of a panel.

        Parameters
        ----------
        numbers : (b,) int array
        bodies : bodies of the panel; all have a plate
        mean_length : m
            Mean length of the moving segments. A held panel is divided into cells of this length.
        rule : nodes and weights of a quadrature on -1..1, ends included
        spatial : two lines of points across the width instead of one
        """
        plates = [_plate(body) for body in bodies]
        lengths = np.array([plate.length for plate in plates])
        starts = np.concatenate([[0.0], np.cumsum(lengths)])
        cells = [max(1, round(p.length / mean_length)) if b.held else 1 for p, b in zip(plates, bodies, strict=True)]
        which = np.repeat(np.arange(len(plates)), cells)  # body of each cell
        number_in_body = np.concatenate([np.arange(count) for count in cells])
        nodes, weights = rule
        lanes = np.array([-1.0, 1.0]) / math.sqrt(3.0) if spatial else np.zeros(1)  # the two Gauss points
        cell = (lengths / cells)[which][:, None]
        x = (number_in_body[:, None] + 0.5 + 0.5 * nodes) * cell - 0.5 * lengths[which][:, None]
        half = np.where(np.abs(nodes) == 1.0, 0.5, 0.25) * weights * cell

        zero = np.zeros_like(x, dtype=np.int64)

        def rows(column: np.ndarray) -> np.ndarray:
            """Values per point from an array (cells, nodes) or (cells,)."""
            return np.repeat((column + zero).ravel(), len(lanes))

        width = rows(np.array([plate.width for plate in plates])[which][:, None])
        weight = rows(0.5 * weights * cell) / len(lanes)
        along, length = rows((starts[:-1] + 0.5 * lengths)[which][:, None] + x), float(starts[-1])
        return cls(
            numbers, length, plates[0].thickness, (plates[0].length, plates[-1].length),
            np.mean([body.position for body in bodies], axis=0), _axis(bodies[len(bodies) // 2], 2), _axis(bodies[0], 0),
            rows(numbers[which][:, None]),
            np.column_stack([rows(x), np.tile(lanes, x.size) * 0.5 * width]),
            along,
            0.5 * rows(np.array([plate.thickness for plate in plates])[which][:, None]),
            weight,
            weight * width,
            rows(half),
            np.minimum(along, length - along) < 1e-9 * length,
        )  # fmt: skip

    @property
    def columns(self) -> tuple[np.ndarray, ...]:
        """Columns of the table of points: body, place, along, inset, weight, area, half cell, at an end."""
        return (self.body, self.place, self.along, self.inset, self.weight, self.area, self.half_cell, self.at_end)

    @property
    def largest_cell(self) -> float:
        """Length of the largest cell, m."""
        return 2.0 * float(self.half_cell.max())


def _plate(body: Body) -> Plate:
    assert body.plate is not None
    return body.plate


def _axis(body: Body, component: int) -> np.ndarray:
    return np.asarray(rotation_matrix(np.array(body.orientation))[:, component])
