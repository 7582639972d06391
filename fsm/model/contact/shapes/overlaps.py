"""Weights of the faces of pairs of shapes, and the relative poses at which they were computed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.contact.shapes import Shapes
from fsm.interactions.shapes.face_overlap import COLUMNS
from fsm.interactions.shapes.face_weights import ROW, SHARE, ShapePoints, UnitTable, changed_weights, weigh_units
from fsm.kernels.keys import find_keys
from fsm.model.contact.shapes.shape_tables import Kit, Units

_SHARES, _SLOPES = slice(SHARE, SHARE + COLUMNS), slice(SHARE + COLUMNS, ROW)


class Overlaps(NamedTuple):
    """Weights of units; see `fsm.interactions.shapes.face_weights.weigh_units`.

    Attributes
    ----------
    key : (u,) int array, ascending
    known : (u,) bool array
        Whether the next two fields are valid; if not, the weights are those of tilted faces.
    latest, in_force : (u, ROW) arrays
        Relative poses, weights and slopes: `latest` of the last accepted state, `in_force` at present. `latest` replaces
        `in_force` when a body moves.
    """

    key: np.ndarray
    known: np.ndarray
    latest: np.ndarray
    in_force: np.ndarray

    @property
    def shares(self) -> np.ndarray:
        """Weights in use, (u, 5)."""
        return self.in_force[:, _SHARES]

    def sloped(self, units: np.ndarray) -> np.ndarray:
        """Mask of the units whose weights change within a step."""
        return np.asarray(self.in_force[units, _SLOPES].any(axis=1))

    @classmethod
    def nothing(cls) -> Overlaps:
        """Empty set of weights."""
        none = np.zeros(0, dtype=np.int64)
        return cls(none, np.zeros(0, dtype=np.bool_), np.zeros((0, ROW)), np.zeros((0, ROW)))

    def of(self, units: Units) -> Overlaps:
        """Weights of other units; unknown weights are marked for computation."""
        place = find_keys(self.key, units.key)
        kept = np.flatnonzero(place >= 0)
        place, count = place[kept], len(units.key)
        known = np.zeros(count, dtype=np.bool_)
        known[kept] = self.known[place]
        new = Overlaps(units.key, known, np.zeros((count, ROW)), np.zeros((count, ROW)))
        for own, of_all in zip(new[2:], self[2:], strict=True):
            own[kept] = of_all[place]
            own[~known] = 0.0
            own[~known, _SHARES] = units.share[~known]
        return new

    def look(self, poses: np.ndarray, kit: Kit, units: Units, near: np.ndarray, held: np.ndarray) -> bool:
        """Update the weights of units that have moved; return whether any has changed. The weights of `held` units do not
        jump.
        """
        solids = Shapes(kit.shapes.body, kit.shapes.kind, *kit.solids, kit.shapes.radius)
        points = ShapePoints(kit.point_start, kit.local, kit.weight, kit.on_axis)
        table = UnitTable(units.shapes, units.whole, units.share)
        return bool(weigh_units(poses, near, held, table, solids, points, self.known, self.latest))

    def changed(self, poses: np.ndarray, kit: Kit, units: Units, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Factors of the weights of units in these poses, and their gradients; see `changed_weights`."""
        solids = kit.solids
        part, gradient = changed_weights(
            poses, rows, units.shapes, kit.shapes.body, solids.offset, solids.axes, self.in_force
        )
        return part, gradient

    def flat(self) -> np.ndarray:
        """Weights as one flat array."""
        rows = np.flatnonzero(self.known)
        return np.concatenate((self.key[rows, None], self.latest[rows], self.in_force[rows]), axis=1).ravel()

    @classmethod
    def from_flat(cls, flat: np.ndarray) -> Overlaps:
        """Weights from an array that `flat` made."""
        rows = flat.reshape(-1, 1 + 2 * ROW)
        known = np.ones(len(rows), dtype=np.bool_)
        return cls(rows[:, 0].astype(np.int64), known, rows[:, 1 : 1 + ROW].copy(), rows[:, 1 + ROW :].copy())
