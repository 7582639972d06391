"""Contact pairs of panels cut into segments become probes on pieces of surfaces (docs/theory.md)."""

from __future__ import annotations

import math
from itertools import accumulate

import numpy as np

from fsm.interactions import end_taper, gap_planar, gap_spatial, gap_spatial_tangent
from fsm.interactions.chord import chords_planar, chords_spatial
from fsm.interactions.quadrature import gauss_lobatto
from fsm.interactions.surface import BARE, CAP, STRAIGHT, TIP, pieces_of
from fsm.kernels.rotation import rotation_matrix
from fsm.scene.contact import Contact
from fsm.scene.scene import Body, ContactPair, Plate, Scene
from fsm.segments.surface_contacts import Probes, SurfaceContacts, SurfaceKernels, Surfaces

__all__ = ["compile_surfaces"]

_DEEPEST = 0.05
"""Depth at which a point counts as having gone through a panel, over the panel's length."""
_SEGMENTS_DEEP = 4.0
"""The same over the length of a segment; the smaller of both holds. Pieces farther away need not be watched."""

_EDGE = TIP / 4.0
"""Length over which the end of a panel comes in over the end of another one of its chain, over the length of that."""

_TIPS = {"end-start": (0.0, STRAIGHT), "chain": (BARE, BARE), "none": (BARE, CAP)}
"""Tips of a surface for the points of another one, and for its ends, by what the two share. What comes head on is met by
its end. Points that end where the surface does are tapered there."""

_PLANAR = SurfaceKernels(
    chords_planar,
    gap_planar.probe_points_planar,
    gap_planar.heights_planar,
    gap_planar.find_contacts_planar,
    gap_planar.measure_gap_planar,
    gap_planar.tangent_gap_planar,
    end_taper.tapered_planar,
)
_SPATIAL = SurfaceKernels(
    chords_spatial,
    gap_spatial.probe_points_spatial,
    gap_spatial.heights_spatial,
    gap_spatial.find_contacts_spatial,
    gap_spatial.measure_gap_spatial,
    gap_spatial_tangent.tangent_gap_spatial,
    end_taper.tapered_spatial,
)


def compile_surfaces(
    scene: Scene, contact: Contact, bodies: tuple[Body, ...], spatial: bool
) -> tuple[SurfaceContacts, ...]:
    """The geometry of all pairs of surfaces; none where nothing of them can move."""
    compiler = _SurfaceCompiler(scene, contact, bodies, spatial)
    return (compiler.geometry(),) if compiler.pairs else ()


class _SurfaceCompiler:
    """Pairs of panels as probes on surfaces."""

    def __init__(self, scene: Scene, contact: Contact, bodies: tuple[Body, ...], spatial: bool) -> None:
        self.scene, self.contact, self.all_bodies, self.spatial = scene, contact, bodies, spatial
        self.index = {body.name: i for i, body in enumerate(bodies)}
        self.members_of = {surface.name: surface.bodies for surface in scene.surfaces}
        # pairs of surfaces of which something can move, with their numbers
        self.pairs = [
            (number, pair)
            for number, pair in enumerate(scene.pairs)
            if pair.first in self.members_of and pair.second in self.members_of and not self._fixed(pair)
        ]
        moving = [plate.length for body in bodies if (plate := body.plate) and not body.held]
        self._longest, self._mean_length = max(moving, default=1.0), float(np.mean(moving or [1.0]))
        self._shallowest = _SEGMENTS_DEEP * self._longest
        self._lobatto = gauss_lobatto(contact.points_per_segment + 1)
        self._known_points: dict[int, list[tuple[float, float, float]]] = {}

    def geometry(self) -> SurfaceContacts:
        """Everything put together."""
        members = {
            name: np.array([self.index[body] for body in bodies], dtype=np.int64)
            for name, bodies in self.members_of.items()
        }
        first_piece, owners, stations = {}, [], []
        total = 0
        for name, bodies in members.items():
            half = np.array([self._plate(b).length / 2 for b in bodies])
            own, stat = pieces_of(bodies, half)
            first_piece[name] = (total, total + len(own))
            owners.append(own)
            stations.append(stat)
            total += len(own)
        rows = [row for number, pair in self.pairs for row in self._probes(number, pair, members, first_piece)]
        columns = [np.array(column) for column in zip(*rows, strict=True)]
        place = columns[1] if self.spatial else np.ascontiguousarray(columns[1][:, 0])
        body, number, first, last = (columns[k].astype(np.int64) for k in (0, 9, 11, 12))
        probes = Probes._make((body, place, *columns[2:9], number, columns[10], first, last))
        owner_table = np.vstack(owners)
        extra: tuple[np.ndarray, ...] = ()
        if self.spatial:
            extra = (np.array([self._plate(a).width / 2 for a, _ in owner_table]),)
        surface_bodies = np.unique(np.concatenate(list(members.values())))
        radii = np.array([math.hypot(self._plate(b).length, self._plate(b).width) / 2 for b in surface_bodies])
        return SurfaceContacts(
            _SPATIAL if self.spatial else _PLANAR,
            probes,
            Surfaces(owner_table, np.vstack(stations), extra, surface_bodies, radii),
            2.0 * self._longest,
        )

    def _fixed(self, pair: ContactPair) -> bool:
        """Nothing of the pair can move."""
        names = (*self.members_of[pair.first], *self.members_of[pair.second])
        return all(self.all_bodies[self.index[name]].held for name in names)

    def _plate(self, body: int) -> Plate:
        plate = self.all_bodies[body].plate
        assert plate is not None
        return plate

    def _probes(
        self,
        number: int,
        pair: ContactPair,
        members: dict[str, np.ndarray],
        first_piece: dict[str, tuple[int, int]],
    ) -> list[tuple[object, ...]]:
        """Both panels probe each other, each with half the weight."""
        rows: list[tuple[object, ...]] = []
        for own, other, at_end in ((pair.first, pair.second, True), (pair.second, pair.first, False)):
            bodies, opposite = members[own], members[other]
            plates = [self._plate(b) for b in bodies]
            starts = [0.0, *accumulate(plate.length for plate in plates)]
            facing = sum(self._plate(b).length for b in opposite)  # the stiffness is that of the smaller face
            side = self._side(bodies, opposite)
            thickness = self._plate(opposite[0]).thickness / 2
            opening, deepest = self._opening(bodies, opposite), self._deepest(opposite)
            narrow, largest = self._largest_cell(bodies, opposite)
            edge = _EDGE * facing / end_taper.TAPER
            for body, plate, start in zip(bodies.tolist(), plates, starts, strict=False):
                length, lanes = plate.length, self._lanes(body)
                for x, weight, half_cell in self._points(body):
                    inset = plate.thickness / 2
                    clearance = inset + thickness
                    if not self.contact.thickness_in_gap:
                        inset = clearance = 0.0
                    if pair.shared == "end-start":
                        from_crease = starts[-1] - start - length / 2 - x if at_end else start + length / 2 + x
                        if from_crease < 1e-9 * starts[-1]:
                            continue  # the crease itself: the layers are one there, and their gap is noise
                        # the thickness grows from nothing with the distance from the crease
                        reduced = min(clearance, 0.5 * from_crease * opening)
                        inset *= reduced / clearance if clearance else 1.0
                        clearance = reduced
                    share = 0.5 * weight / min(starts[-1], facing)
                    area = 0.5 * weight * plate.width
                    along = start + length / 2 + x
                    at_an_end = min(along, starts[-1] - along) < 1e-9 * starts[-1]
                    straight = _TIPS[pair.shared][int(at_an_end)]
                    cell = (0.5 * edge, edge) if at_an_end else (narrow * half_cell, narrow * largest)
                    if straight != BARE:
                        cell = (0.0, 0.0)
                    for lane, lane_share in lanes:
                        rows.append(
                            (body, (x, lane), side, straight, inset, clearance, min(deepest, self._shallowest + clearance),
                             share * lane_share, area * lane_share, number, cell, *first_piece[other])
                        )  # fmt: skip
        return rows

    def _points(self, body: int) -> list[tuple[float, float, float]]:
        """Places along a segment (m, from its centre) and the lengths they stand for: Gauss-Lobatto, ends included.

        Third, half the length of the cell around each: that of an end goes on into the next segment. A held panel is one
        long plate: it is cut into cells about as long as the segments that move.
        """
        if body not in self._known_points:
            length = self._plate(body).length
            cells = max(1, round(length / self._mean_length)) if self.all_bodies[body].held else 1
            nodes, weights = self._lobatto
            cell = length / cells
            self._known_points[body] = [
                (
                    float((k + 0.5 + 0.5 * node) * cell - 0.5 * length),
                    float(0.5 * weight * cell),
                    float((0.5 if abs(node) == 1.0 else 0.25) * weight * cell),
                )
                for k in range(cells)
                for node, weight in zip(nodes, weights, strict=True)
            ]
        return self._known_points[body]

    def _largest_cell(self, bodies: np.ndarray, opposite: np.ndarray) -> tuple[float, float]:
        """Length of the largest cell of a panel, m, and what it has to be narrowed by to be tapered at the ends of another.

        A taper has the half segment at an end for itself.
        """
        largest = max(2.0 * half for b in bodies for _, _, half in self._points(b))
        room = min(self._plate(b).length for b in (opposite[0], opposite[-1])) / 2.0
        return min(1.0, room / (end_taper.TAPER * largest)), largest

    def _lanes(self, body: int) -> list[tuple[float, float]]:
        """Positions across the width and their shares: one line in the plane, two Gauss lines in space."""
        if not self.spatial:
            return [(0.0, 1.0)]
        half = self._plate(body).width / 2
        return [(-half / math.sqrt(3), 0.5), (half / math.sqrt(3), 0.5)]

    def _axis(self, body: int, component: int) -> np.ndarray:
        return np.asarray(rotation_matrix(np.array(self.all_bodies[body].orientation))[:, component])

    def _side(self, bodies: np.ndarray, opposite: np.ndarray) -> float:
        """Side of the opposite surface that the middle of this one is on: +1 along its z axis."""
        middle = np.mean([self.all_bodies[b].position for b in bodies], axis=0)
        facing = np.mean([self.all_bodies[b].position for b in opposite], axis=0)
        return 1.0 if (middle - facing) @ self._axis(opposite[len(opposite) // 2], 2) >= 0 else -1.0

    def _opening(self, bodies: np.ndarray, opposite: np.ndarray) -> float:
        """Sine of the angle between two panels that share a crease."""
        cross = np.cross(self._axis(bodies[0], 0), self._axis(opposite[0], 0))
        return float(np.linalg.norm(cross))

    def _deepest(self, opposite: np.ndarray) -> float:
        """Deeper than this a probe has gone through the surface."""
        return max(_DEEPEST * sum(self._plate(b).length for b in opposite), self._plate(opposite[0]).thickness)
