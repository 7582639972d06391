"""Sides of contact points that slide over the end of a surface at which the panels of a chain are joined.

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

from typing import NamedTuple

import numpy as np

from fsm.case.models.scene import ContactPair


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
