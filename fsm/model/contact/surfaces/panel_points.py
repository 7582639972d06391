"""Contact points of one segmented panel: positions, weights and other data that depend on this panel alone.

Sides of contact points that slide over the end of a surface at which the panels of a chain are joined.

A joint near a touched panel is both the end of one panel and the start of the next panel, and each panel has a probe there.
Both probes are at one point and have the same side. If one of the two panels also has its other joint on the touched panel,
the probe of this panel determines the side at any depth.

Two joined surfaces form a corner. A point that presses on one surface near the corner may be slightly inside this surface
when it passes over the end of the other surface. The point comes from outside the corner, so its correct sides are outside
both surfaces. If the contact used its present side of the other surface, the contact force would pull the point in and hold
it there. The point therefore has contact with the surface in which it is less deep. The contact changes to the other surface
when both depths are equal. A point may also move round the corner so closely that no step finds it beyond the end of the
other surface. The contact with the other surface then ends when the depth of the point on the wrong side exceeds the depth
at which its share counts. The function `fsm.interactions.surfaces.probe_sides.turned_sides` detects this.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fsm.case.models.scene import Body, ContactPair, Plate
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


class Corners(NamedTuple):
    """Relations between the sides of probes at corners of joined panels. Ends of surfaces have the numbers 0 (start) and 1
    (end).

    Attributes
    ----------
    twin : (n,) int array
        Probe of the other panel at the same joint, which determines the side of this probe; without one, the number of the
        probe itself.
    across : (n, 2) int array
        Probe of the same point on the panel that is joined to the touched surface at that end; -1 if there is no such probe.
    inside : (n, 2) array
        Side of the touched surface that is inside the corner.
    inside_across : (n, 2) array
        Side of the joined panel that is inside the corner.
    """

    twin: np.ndarray
    across: np.ndarray
    inside: np.ndarray
    inside_across: np.ndarray


def find_corners(
    pairs: list[tuple[int, ContactPair]], pair: np.ndarray, second: np.ndarray, point: np.ndarray, end: np.ndarray,
    side: np.ndarray,
) -> Corners:  # fmt: skip
    """Corners of all probes.

    Parameters
    ----------
    pairs : numbers and contact pairs, ascending
    pair, second : (n,) int arrays
        Number of the pair of each probe, and whether it is on the second panel; the probes are in the order of these two.
    point : (n,) int array
        Number of the point in its panel; numbers ascend along the panel.
    end : (n,) int array
        -1 at the start of the panel, 1 at its end, 0 between.
    side : (n,) array
        Initial sides.
    """
    twin, count = np.arange(len(pair)), len(pair)
    across, inside = np.full((count, 2), -1, dtype=np.int64), np.zeros((count, 2))
    inside_across = np.zeros((count, 2))
    order = 2 * pair + second
    rows = {}
    for number, each in pairs:
        for k, (own, other) in enumerate(((each.first, each.second), (each.second, each.first))):
            first, last = np.searchsorted(order, (2 * number + k, 2 * number + k + 1))
            rows[own, other] = np.arange(first, last)
    joined = [(each.first, each.second) for _, each in pairs if each.shared == "end-start"]
    beside = {-1: {two: one for one, two in joined}, 1: dict(joined)}
    shared = {*joined, *((two, one) for one, two in joined)}
    for (own, other), mine in rows.items():
        for at_end, sign in enumerate((-1, 1)):
            mate = beside[sign].get(own)
            if mate is not None and (own, other) not in shared and (mate, other) in shared:
                theirs = rows[mate, other]
                twin[mine[end[mine] == sign]] = theirs[end[theirs] == -sign]
            mate = beside[sign].get(other)
            if mate is None or (own, mate) not in rows:
                continue
            theirs = rows[own, mate]
            place = np.minimum(np.searchsorted(point[theirs], point[mine]), len(theirs) - 1)
            same = point[theirs[place]] == point[mine]
            across[mine[same], at_end] = theirs[place[same]]
            inside[mine, at_end] = side[rows[mate, other][0]]
            inside_across[mine, at_end] = side[rows[other, mate][0]]
    return Corners(twin, across, inside, inside_across)
