"""Contact of panels that consist of segments: probe points of one panel touch the C1 surface of another (docs/theory.md)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.search.contact_body_pairs import coupled_bodies
from fsm.interactions.surfaces.surface import BARE
from fsm.kernels.tables import empty_arrays
from fsm.model.bodies.contact_arrays import RENEWAL
from fsm.model.contact.contact_table import ContactTable
from fsm.model.contact.surfaces.array_surfaces import HEIGHTS, PLANAR_SURFACES, SPATIAL_SURFACES, TAPERS, SurfaceArrays
from fsm.model.contact.surfaces.panel_points import Corners

_AHEAD, _NEAR = 1, 0.1
"""Number of further pieces, beyond the near ones, that a pattern couples with a probe, and gap over the margin up to which
a further pattern has blocks. The pattern then remains valid while the probe slides or comes nearer."""
_KEPT = 4
"""Number of earlier patterns whose pairs a new pattern keeps: predictions and rejected steps reach the same bodies again."""


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


class SurfaceContacts(ContactTable):
    """Probes on surfaces; see `ContactTable`.

    The broad phase stores the window of pieces within reach of each probe. The broad phase is renewed when a body of a
    surface has moved by a part of the margin. The contacts do not depend on the time of the renewal.

    A probe over a surface keeps its side at any depth, unless it slides round the tip. A probe that passes over the end of a
    surface takes its present side; `fsm.model.contact.surfaces.panel_points` treats corners of joined panels. A pair has
    passed through if a probe is deeper than its limit, or on the other side without contact. A depth larger than the
    possible motion since the last accepted state does not count: on a surface bent to a loop, the nearest piece may change
    from one side of a distant probe to the other.

    Parameters
    ----------
    probes : Probes
    corners : Corners
    surfaces : Surfaces
    margin : m
    """

    coupled_bodies, fades = 3, True

    def __init__(self, probes: Probes, corners: Corners, surfaces: Surfaces, margin: float) -> None:
        self.probes, self.corners, self.surfaces = probes, corners, surfaces
        spatial, (half_cell, largest), stations = probes.place.ndim == 2, probes.cell.T, surfaces.stations
        kernels = SPATIAL_SURFACES if spatial else PLANAR_SURFACES
        moving = np.ascontiguousarray(surfaces.bodies, dtype=np.int64), np.ascontiguousarray(surfaces.radii)
        super().__init__(kernels, 3 if spatial else 1, margin, *moving, empty_arrays(SurfaceArrays))
        no_share = np.where(probes.straight == BARE, np.maximum(0.5 * largest - half_cell, 0.0), -1.0)
        # a surface reaches beyond its chords by its tips, and a probe may be as deep as its limit
        tips = np.maximum(-stations[:, 4], stations[:, 5] - 1.0)
        beyond = tips * (stations[:, 3] - stations[:, 0])
        seen = np.maximum(probes.clearance + margin, probes.depth_limit)
        reach, count = seen + 2.0 * RENEWAL * margin + float(beyond.max()), len(probes.body)
        none = np.full(count, -1, dtype=np.int64)
        own = SurfaceArrays(
            probes.body, probes.place, probes.straight, probes.inset, probes.clearance, probes.depth_limit, probes.cell,
            probes.first_piece, probes.last_piece, probes.side.copy(), surfaces.owners, stations,
            surfaces.extra[0] if surfaces.extra else np.zeros(0), no_share, tips, reach, corners.twin, corners.across,
            corners.inside, corners.inside_across, none, none.copy(), np.zeros((count, 2), dtype=np.int64), none.copy(),
            np.zeros(count), np.zeros((0, 0)), none.copy(), np.zeros(count), np.zeros(probes.place.shape),
        )  # fmt: skip
        self.with_slots(own, count, probes.share, probes.area, probes.pair)
        self.common.state[TAPERS] = int(probes.cell.any())
        self._ahead: list[np.ndarray] = []

    @property
    def side(self) -> np.ndarray:
        """Present side of each probe: +1 or -1; 0 without a side."""
        return np.asarray(self.own.side)

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """See `ContactTable`; the probes never change their numbers."""
        return slots

    def coupled(self) -> np.ndarray:
        """See `ContactTable`."""
        return self._coupled_by(self.own.window)

    def _coupled_by(self, window: np.ndarray) -> np.ndarray:
        return np.asarray(coupled_bodies(self.own.body, window, self.own.owners, len(self.common.committed)))

    def coupled_first(self, poses: np.ndarray) -> np.ndarray:
        """See `ContactTable`: the pairs of contacts with a gap below the margin."""
        return self._coupled_near(poses, self.margin)

    def coupled_ahead(self) -> np.ndarray:
        """See `ContactTable`: the pairs of contacts near the poses of the last search, and those of the last patterns."""
        now = self._coupled_near(self.common.found_poses.copy(), _NEAR * self.margin)
        self._ahead = [now, *self._ahead[:_KEPT]]
        return np.concatenate(self._ahead)

    def _coupled_near(self, poses: np.ndarray, below: float) -> np.ndarray:
        """Pairs of contacts with a gap below a bound (m), and those with some more pieces."""
        own, near = self.own, self.find(poses, below)
        piece, window = own.found_piece[: len(near.slot)], np.zeros((len(own.body), 2), dtype=np.int64)
        window[near.slot, 0] = np.maximum(piece - _AHEAD, own.first_piece[near.slot])
        window[near.slot, 1] = np.minimum(piece + _AHEAD + 1, own.last_piece[near.slot])
        return self._coupled_by(window)

    def size_for(self, bodies: int) -> None:
        """See `ContactTable`."""
        super().size_for(bodies)
        if len(self.own.height_at) != bodies:
            self.table.replace(self.common, self.own._replace(height_at=np.zeros(self.common.reference.shape)))

    def load_own(self, memory: np.ndarray) -> None:
        """See `ContactTable`: sides of all probes."""
        self.own.side[:] = memory if len(memory) else self.probes.side
        self._forget_nearest()

    def _forget_nearest(self) -> None:
        self.common.state[HEIGHTS] = 0
        self.own.nearest[:] = self.own.nearest_of_all[:] = -1

    def own_memory(self) -> np.ndarray:
        """See `ContactTable`."""
        return self.side.copy()

    def clear_caches(self) -> None:
        """See `ContactTable`."""
        super().clear_caches()
        self._forget_nearest()
        self._ahead = []
