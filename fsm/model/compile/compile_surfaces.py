"""Compile contact pairs of segmented panels to probe points on pieces of surfaces (docs/theory.md)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fsm.case.models.scene import ContactPair, Plate
from fsm.interactions.quadrature import gauss_lobatto
from fsm.interactions.surfaces import end_taper
from fsm.interactions.surfaces.surface import BARE, CAP, STRAIGHT, TIP, pieces_of
from fsm.model.contact.surfaces.panel_points import Corners, PanelPoints, find_corners
from fsm.model.contact.surfaces.surface_contacts import Probes, SurfaceContacts, Surfaces
from fsm.model.contact.touching import Touching

_DEEPEST = 0.05
"""Depth above which a point counts as passed through a panel, relative to the panel's length."""
_SEGMENTS_DEEP = 4.0
"""Depth above which a point counts as passed through a panel, relative to the length of a segment. The smaller of both
bounds is used, also to limit the search."""

_EDGE = TIP / 4.0
"""Taper length at the ends of two panels of one chain, relative to the length of the other panel."""

_TIPS = {"end-start": (0.0, STRAIGHT), "chain": (BARE, BARE), "none": (BARE, CAP)}
"""Tips of a surface for the points of another surface and for its ends; they depend on the connection of the two surfaces.
Ends touch a body in frontal contact. Points beyond the end of the surface have a tapered weight there."""


def compile_surfaces(touching: Touching) -> tuple[SurfaceContacts, ...]:
    """Compile the geometry of all pairs of surfaces that can move; empty if there are none."""
    compiler = _SurfaceCompiler(touching)
    return (compiler.geometry(),) if compiler.pairs else ()


class _Face(NamedTuple):
    """Panel whose probe points touch another panel.

    Attributes
    ----------
    panel : name
    number, second : number of the contact pair; `second` is 1 for the second panel of the pair, else 0
    side : +1 or -1, side of the other surface on which the panel is
    elsewhere, at_ends : tips of the other surface, for points inside the panel and for points at its ends (`_TIPS`)
    thickness, deepest : half thickness of the other panel, m; depth limit of a point, m
    smaller : length of the smaller face of both panels, m
    edge, narrow : taper length at ends over `end_taper.TAPER`, m; factor that reduces the other cells
    crease : +1 if the end of the panel lies on a crease that both panels share, -1 if the start does, 0 without such a
    crease
    opening : sine of the angle between both panels
    first, last : pieces of the other surface
    """

    panel: str
    number: int
    second: int
    side: float
    elsewhere: float
    at_ends: float
    thickness: float
    deepest: float
    smaller: float
    edge: float
    narrow: float
    crease: float
    opening: float
    first: int
    last: int


class _SurfaceCompiler:
    """Compiler of pairs of panels: it makes one panel's points into probes on the surface of the other."""

    def __init__(self, touching: Touching) -> None:
        scene, bodies, _, spatial, pairs = touching
        assert scene.contact is not None
        self.contact, self.all_bodies, self.spatial = scene.contact, bodies, spatial
        self.index = {body.name: i for i, body in enumerate(bodies)}
        self.members_of = {surface.name: surface.bodies for surface in scene.surfaces}
        # pairs of surfaces with a moving body, and their numbers
        self.pairs = [(number, pair) for number, pair in pairs if not self._fixed(pair)]
        moving = [plate.length for body in bodies if (plate := body.plate) and not body.held]
        self._longest = max(moving, default=1.0)
        self._shallowest = _SEGMENTS_DEEP * self._longest
        rule, mean_length = gauss_lobatto(self.contact.points_per_segment + 1), float(np.mean(moving or [1.0]))
        self.members = {
            name: np.array([self.index[body] for body in names], dtype=np.int64) for name, names in self.members_of.items()
        }
        probing = dict.fromkeys(name for _, pair in self.pairs for name in (pair.first, pair.second))
        self.panels = {
            name: PanelPoints.of(numbers, [bodies[b] for b in numbers], mean_length, rule, spatial)
            for name, numbers in ((name, self.members[name]) for name in probing)
        }

    def geometry(self) -> SurfaceContacts:
        """Contact geometry of all pairs."""
        first_piece, owners, stations = {}, [], []
        total = 0
        for name, bodies in self.members.items():
            half = np.array([self._plate(b).length / 2 for b in bodies])
            own, stat = pieces_of(bodies, half)
            first_piece[name] = (total, total + len(own))
            owners.append(own)
            stations.append(stat)
            total += len(own)
        probes, corners = self._probes([face for one in self.pairs for face in self._faces(*one, first_piece)])
        owner_table = np.vstack(owners)
        extra: tuple[np.ndarray, ...] = ()
        if self.spatial:
            extra = (np.array([self._plate(a).width / 2 for a, _ in owner_table]),)
        surface_bodies = np.unique(np.concatenate(list(self.members.values())))
        radii = np.array([math.hypot(self._plate(b).length, self._plate(b).width) / 2 for b in surface_bodies])
        return SurfaceContacts(
            probes,
            corners,
            Surfaces(owner_table, np.vstack(stations), extra, surface_bodies, radii),
            2.0 * self._longest,
        )

    def _fixed(self, pair: ContactPair) -> bool:
        """Whether no body of the pair can move."""
        names = (*self.members_of[pair.first], *self.members_of[pair.second])
        return all(self.all_bodies[self.index[name]].held for name in names)

    def _plate(self, body: int) -> Plate:
        plate = self.all_bodies[body].plate
        assert plate is not None
        return plate

    def _faces(self, number: int, pair: ContactPair, first_piece: dict[str, tuple[int, int]]) -> Iterator[_Face]:
        """Both panels of a pair as probes on each other; each panel has half the weight."""
        elsewhere, at_ends = _TIPS[pair.shared]
        for second, (own, other) in enumerate(((pair.first, pair.second), (pair.second, pair.first))):
            panel, facing = self.panels[own], self.panels[other]
            yield _Face(
                own, number, second, _side(panel, facing), elsewhere, at_ends, facing.thickness / 2,
                max(_DEEPEST * facing.length, facing.thickness),
                min(panel.length, facing.length),  # the contact stiffness belongs to the smaller face
                _EDGE * facing.length / end_taper.TAPER,
                min(1.0, min(facing.ends) / 2.0 / (end_taper.TAPER * panel.largest_cell)),
                (1.0, -1.0)[second] if pair.shared == "end-start" else 0.0,
                _sine(panel.direction, facing.direction) if pair.shared == "end-start" else 0.0,
                *first_piece[other],
            )  # fmt: skip

    def _probes(self, faces: list[_Face]) -> tuple[Probes, Corners]:
        """Probe points of all faces, and the relations of sides between them."""
        own = [self.panels[face.panel] for face in faces]
        body, place, along, inset, weight, area, half_cell, at_end = (
            np.concatenate(columns) for columns in zip(*(panel.columns for panel in own), strict=True)
        )
        count = [len(panel.along) for panel in own]
        length, largest = np.repeat([(panel.length, panel.largest_cell) for panel in own], count, axis=0).T
        table = np.repeat(np.array([face[1:] for face in faces]), count, axis=0).T
        side, elsewhere, at_ends, thickness, deepest, smaller, edge, narrow, crease, opening = table[2:-2]
        number, second, first, last = table[[0, 1, -2, -1]].astype(np.int64)
        straight = np.where(at_end, at_ends, elsewhere)
        if not self.contact.thickness_in_gap:
            inset = thickness = np.zeros_like(inset)
        clearance = inset + thickness
        # the thickness grows from zero with the distance from a common crease
        from_crease = np.where(crease > 0.0, length - along, along)
        reduced = np.where(crease == 0.0, clearance, np.minimum(clearance, 0.5 * from_crease * opening))
        inset = inset * np.divide(reduced, clearance, out=np.ones_like(clearance), where=clearance > 0.0)
        # cells are reduced for the taper at the ends of the other panel, so that it fits in the end half segment
        cell = np.where(at_end, np.array([0.5 * edge, edge]), np.array([narrow * half_cell, narrow * largest]))
        probes = Probes(
            body, place if self.spatial else place[:, 0], side, straight, inset, reduced,
            np.minimum(deepest, self._shallowest + reduced), 0.5 * weight / smaller, 0.5 * area, number,
            np.where(straight == BARE, cell, 0.0).T, first, last,
        )  # fmt: skip
        # the crease itself has no probe, because the layers are joined there and the gap is round-off
        apart = (crease == 0.0) | (from_crease >= 1e-9 * length)
        probes = Probes._make(np.ascontiguousarray(column[apart]) for column in probes)
        point = np.concatenate([np.arange(points) for points in count])
        end = (at_end * np.sign(along - 0.5 * length)).astype(np.int64)
        corners = find_corners(self.pairs, probes.pair, second[apart], point[apart], end[apart], probes.side)
        return probes._replace(side=probes.side[corners.twin]), corners


def _sine(a: np.ndarray, b: np.ndarray) -> float:
    """Sine of the angle between two directions; this function is ten times faster than `numpy.cross`."""
    return math.hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _side(panel: PanelPoints, facing: PanelPoints) -> float:
    """Side of the opposite surface on which the middle of this panel lies; +1 along the surface's z axis."""
    return 1.0 if (panel.middle - facing.middle) @ facing.normal >= 0 else -1.0
