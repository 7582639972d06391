"""Contact of panels that consist of segments: probe points of one panel touch the C1 surface of another (docs/theory.md)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.contact.shapes import ContactForces
from fsm.interactions.search.box_tree import fit_tree, window_pieces
from fsm.interactions.search.chord import chord_boxes
from fsm.interactions.search.contact_body_pairs import coupled_bodies
from fsm.interactions.search.displacement_bound import furthest_motion, moved_beyond
from fsm.interactions.surfaces.probe_sides import over_ends, passed_through, probe_sides, round_tips, turned_sides
from fsm.interactions.surfaces.surface import BARE
from fsm.model.bodies.pattern import BodyPattern
from fsm.model.contact.contact_geometry import ActiveContacts, ContactKinematics, Tapered
from fsm.model.contact.surfaces.corner_sides import Corners

Kernel = Callable[..., Any]

_RENEWAL = 0.4
"""Displacement relative to the margin after which the contact search is renewed."""


class Probes(NamedTuple):
    """Probes: contact points that are fixed on one panel and touch the surface of another. Each probe is a slot.

    Attributes
    ----------
    body : (n,) int array
    place : (n,) array of x in the plane, (n, 2) of (x, y) in space, m, body axes
    side : (n,) array
        +1 or -1: initial side of the surface.
    straight : (n,) array
        Fraction of a tip of the surface that is straight for this probe, or CAP or BARE
        (`fsm.interactions.surfaces.surface`).
    inset : (n,) array, m
        Half thickness of the probe's own panel.
    clearance : (n,) array, m
        Distance of the middle surfaces at which the faces touch.
    depth_limit : (n,) array, m
        Depth above which a probe counts as having passed through the surface, or round its end.
    share : (n,) array
        Fraction of the face that belongs to the point.
    area : (n,) array, m^2
        Area of the point: half from its own face, half from the opposite face.
    pair : (n,) int array
        Number of the contact pair.
    cell : (n, 2) array, m
        Half the cell of the point, and half the largest cell of its panel, if the share is tapered at the ends of the
        surface (`fsm.interactions.surfaces.end_taper`); else zeros.
    first_piece, last_piece : (n,) int arrays
        First and last piece of the surface within reach of each probe.
    """

    body: np.ndarray
    place: np.ndarray
    side: np.ndarray
    straight: np.ndarray
    inset: np.ndarray
    clearance: np.ndarray
    depth_limit: np.ndarray
    share: np.ndarray
    area: np.ndarray
    pair: np.ndarray
    cell: np.ndarray
    first_piece: np.ndarray
    last_piece: np.ndarray


class Surfaces(NamedTuple):
    """All surfaces.

    Attributes
    ----------
    owners, stations : pieces, see `fsm.interactions.surfaces.surface`
    extra : arrays
        Further geometry for the kernels: half widths in space, empty in the plane.
    bodies, radii : (n,) arrays
        Bodies whose motion renews the broad phase, and the distance of their farthest point, m.
    """

    owners: np.ndarray
    stations: np.ndarray
    extra: tuple[np.ndarray, ...]
    bodies: np.ndarray
    radii: np.ndarray


class SurfaceKernels(NamedTuple):
    """The kernels of `fsm.interactions.surfaces.closest_planar` and `gap_planar`, or of their spatial twins, and the
    chords.
    """

    chords: Kernel
    points: Kernel
    heights: Kernel
    find: Kernel
    measure: Kernel
    tangent: Kernel
    tapered: Kernel


class SurfaceContacts:
    """Probes on surfaces; see `ContactGeometry`.

    The broad phase stores the window of pieces within reach of each probe. The broad phase is renewed when a body of a
    surface has moved by a part of the margin. The contacts do not depend on the time of the renewal.

    A probe over a surface keeps its side at any depth, unless it slides round the tip. A probe that passes over the end of a
    surface takes its present side; `fsm.model.contact.surfaces.corner_sides` treats corners of joined panels.

    Parameters
    ----------
    kernels : SurfaceKernels
    probes : Probes
    corners : Corners
    surfaces : Surfaces
    margin : m
    """

    def __init__(
        self, kernels: SurfaceKernels, probes: Probes, corners: Corners, surfaces: Surfaces, margin: float
    ) -> None:
        self.kernels, self.probes, self.corners = kernels, probes, corners
        self.surfaces, self.margin = surfaces, margin
        self.share, self.area, self.pair = probes.share, probes.area, probes.pair
        self.slips = 1 if probes.place.ndim == 1 else 3
        self.side = probes.side.copy()
        self.refreshes = 0
        self.tapers = bool(probes.cell.any())
        half_cell, largest = probes.cell.T
        self.no_share = np.where(probes.straight == BARE, np.maximum(0.5 * largest - half_cell, 0.0), -1.0)
        # a surface reaches beyond its chords by its tips, and a probe may be as deep as its limit
        stations = surfaces.stations
        self.tips = np.maximum(-stations[:, 4], stations[:, 5] - 1.0)
        beyond = self.tips * (stations[:, 3] - stations[:, 0])
        seen = np.maximum(probes.clearance + margin, probes.depth_limit)
        self.reach = seen + 2.0 * _RENEWAL * margin + float(beyond.max())
        count = len(probes.body)
        self.nearest = np.full(count, -1, dtype=np.int64)
        self._nearest_of_all = self.nearest.copy()
        self.window = np.zeros((count, 2), dtype=np.int64)
        self.reference: np.ndarray | None = None
        self._within: np.ndarray | None = None
        self._pairs = np.zeros((0, 2), dtype=np.int64)
        self._height = np.empty(count)
        self._height_at: np.ndarray | None = None
        self._height_farther = 0.0
        self._committed: np.ndarray | None = None
        self._buffers = (
            np.empty(count, dtype=np.int64),
            np.empty(count, dtype=np.int64),
            np.empty(count),
            np.empty(probes.place.shape),
            np.empty(count),
        )

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """See `ContactGeometry`; the probes never change their numbers."""
        return slots

    # search ----------------------------------------------------------------------------------------------------------

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `ContactGeometry`."""
        self._refresh(poses)
        return self._pairs, self.refreshes

    def _refresh(self, poses: np.ndarray) -> None:
        probes, surfaces, kernels = self.probes, self.surfaces, self.kernels
        if poses is self._within:  # the array is the same object
            return
        self._within = poses
        if self.reference is not None and not moved_beyond(
            poses, self.reference, surfaces.bodies, surfaces.radii, _RENEWAL * self.margin
        ):
            return
        self.reference = poses.copy()
        chords = kernels.chords(poses, surfaces.owners, surfaces.stations, *surfaces.extra)
        dimension = 2 if self.slips == 1 else 3
        inverse, bound = chords[:, 2 * dimension], chords[:, 2 * dimension + 1]
        # sum of the distance of pieces from their chords and the length of the tips beyond the ends
        bulge = float((bound - self.tips / np.sqrt(inverse)).max())
        window_pieces(
            kernels.points(poses, probes.body, probes.place), probes.first_piece, probes.last_piece, chords,
            fit_tree(*chord_boxes(chords)), self.reach + bulge, 2.0 * (2.0 * _RENEWAL * self.margin + bulge),
            self.nearest, self.window,
        )  # fmt: skip
        self._pairs = coupled_bodies(probes.body, self.window, surfaces.owners, len(poses))
        self.refreshes += 1

    def find(self, poses: np.ndarray, below: float) -> ActiveContacts:
        """See `ContactGeometry`; `at` contains pieces, sides and positions on the pieces."""
        self._refresh(poses)
        probes, surfaces = self.probes, self.surfaces
        count: int = self.kernels.find(
            poses, probes.body, probes.place, self.side, probes.straight, probes.clearance, probes.depth_limit,
            self.no_share, self.window, surfaces.owners, surfaces.stations, *surfaces.extra, below, self._buffers,
        )  # fmt: skip
        slot, piece, side, at, gap = (buffer[:count].copy() for buffer in self._buffers)
        return ActiveContacts(slot, gap, (piece, side, at))

    # measure ------------------------------------------------------------------------------------------------------------

    def measure(self, poses: np.ndarray, rates: np.ndarray, touching: ActiveContacts) -> ContactKinematics:
        """See `ContactGeometry`."""
        probes, surfaces, count = self.probes, self.surfaces, len(touching.slot)
        measured = ContactKinematics(
            *self.kernels.measure(
                poses, rates, (touching.slot, *touching.at), probes.body, probes.place, probes.straight, probes.clearance,
                probes.inset, surfaces.owners, surfaces.stations,
            )
        )  # fmt: skip
        if not self.tapers:
            return measured
        piece, _, at = touching.at
        tapered = Tapered(
            *self.kernels.tapered(
                poses, measured.bodies, count, touching.slot, piece, at, probes.place, probes.cell, surfaces.stations
            )
        )  # fmt: skip
        return measured._replace(tapered=tapered) if len(tapered.rows) else measured

    def add_tangent(
        self,
        poses: np.ndarray,
        rates: np.ndarray,
        touching: ActiveContacts,
        measured: ContactKinematics,
        forces: ContactForces,
        pattern: BodyPattern,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """See `ContactGeometry`."""
        probes, surfaces = self.probes, self.surfaces
        self.kernels.tangent(
            poses, rates, measured.bodies, measured.gradient, (touching.slot, *touching.at), probes.place, probes.straight,
            probes.clearance, probes.inset, surfaces.stations, forces, pattern.index, stiffness, damping,
        )  # fmt: skip

    # memory ---------------------------------------------------------------------------------------------------------

    def commit(self, poses: np.ndarray, young: np.ndarray | None = None) -> None:
        """See `ContactGeometry`."""
        probes, height = self.probes, self._heights(poses)
        nearest, last = self._nearest_of_all, probes.last_piece
        side = probe_sides(self.side, height, probes.depth_limit)
        near = over_ends(self.side, height, probes.depth_limit, nearest, probes.first_piece, last)
        behind = near[(self.side[near] * height[near] < 0.0) & (probes.straight[near] >= 0.0)]
        if len(behind):
            slot, gap, (piece, facing, at) = self.find(poses, self.margin)
            place = np.ascontiguousarray(at.reshape(len(slot), -1)[:, 0])
            round_it = round_tips(
                slot, gap, piece, facing, place, self.surfaces.stations, probes.straight, probes.clearance, height
            )
            behind = behind[round_it[behind]]
            side[behind] = -self.side[behind]
        at_end = (nearest[near] == last[near] - 1).astype(np.int64)
        corners = self.corners.twin, self.corners.across, self.corners.inside, self.corners.inside_across
        self.side = turned_sides(corners, self.side, side, height, probes.depth_limit, near, at_end)
        self._committed = poses

    def memory(self) -> np.ndarray:
        """See `ContactGeometry`; the memory consists of the sides, followed by the committed poses, if there are any."""
        return self.side.copy() if self._committed is None else np.concatenate([self.side, self._committed.ravel()])

    def restore(self, memory: np.ndarray) -> None:
        """See `ContactGeometry`."""
        count = len(self.probes.side)
        self.side = memory[:count].copy() if len(memory) else self.probes.side.copy()
        committed = memory[count:].reshape(-1, 3 if self.slips == 1 else 7)
        self._committed = committed.copy() if len(committed) else None

    def clear_caches(self) -> None:
        """See `ContactGeometry`."""
        self.reference = self._within = self._height_at = None
        self.nearest[:] = -1
        self._nearest_of_all[:] = -1

    def crossed(self, poses: np.ndarray) -> tuple[int, ...]:
        """See `ContactGeometry`: pairs with a probe deeper than its limit, or on the other side without contact.

        A depth larger than the possible motion since the last commit does not count. On a surface bent to a loop, the
        nearest piece may change from one side of a distant probe to the other.
        """
        motion, deepest, before = 0.0, np.inf, np.zeros(0)
        if self._committed is not None:
            motion = self._motion(self._committed, poses)
            deepest = 2.0 * motion + 0.5 * self.margin  # heights have an error of a fraction of a segment
            if motion <= _RENEWAL * self.margin:
                motion = 0.0  # only probes within reach have a side
            if motion > 0.5 * self.margin:  # a probe outside the reach had no side, and may have passed through
                before = self._heights(self._committed, 2.0 * motion)
        height = self._heights(poses, 2.0 * motion)
        through = passed_through(self.side, self.probes.depth_limit, height, before, deepest)
        return tuple(int(pair) for pair in np.unique(self.pair[through])) if len(through) else ()

    def _motion(self, before: np.ndarray, after: np.ndarray) -> float:
        """Upper bound of the displacement of any point of a surface, m."""
        return float(furthest_motion(before, after, self.surfaces.bodies, self.surfaces.radii))

    def _heights(self, poses: np.ndarray, farther: float = 0.0) -> np.ndarray:
        """Heights of all probes within their reach plus a given distance, m; cached values if these are sufficient."""
        at = self._height_at
        if at is not None and farther <= self._height_farther and (at is poses or np.array_equal(at, poses)):
            return self._height
        self._height_at, self._height_farther = poses, farther
        probes, surfaces = self.probes, self.surfaces
        first, last = probes.first_piece, probes.last_piece
        if farther == 0.0:
            self._refresh(poses)
            first, last = np.ascontiguousarray(self.window.T)
        height = np.empty(len(probes.body))
        self.kernels.heights(
            poses, probes.body, probes.place, probes.straight, probes.depth_limit, first, last, surfaces.owners,
            surfaces.stations, *surfaces.extra, self.reach + farther, self._nearest_of_all, height,
        )  # fmt: skip
        self._height = height
        return height
