"""Weights of the faces of pairs of shapes, and the relative poses at which they were computed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.face_overlap import COLUMNS, weigh_units
from fsm.kernels.keys import find_keys
from fsm.segments.shape_tables import Kit, Units

__all__ = ["Overlaps"]

_ROW = 1 + 9 + 3 + 2 * COLUMNS


class Overlaps(NamedTuple):
    """Weights of units; see `fsm.interactions.face_overlap.weigh_units`.

    Attributes
    ----------
    key : (u,) int array, ascending
    known : (u,) bool array
        Whether the next three fields are valid; if not, the weights are those of tilted faces.
    turns, shifts, shares : (u, 3, 3), (u, 3), (u, 5) arrays
    in_force : (u, 5) array
        Weights in use; the last accepted state replaces them when a body moves.
    """

    key: np.ndarray
    known: np.ndarray
    turns: np.ndarray
    shifts: np.ndarray
    shares: np.ndarray
    in_force: np.ndarray

    @classmethod
    def nothing(cls) -> Overlaps:
        """Empty set of weights."""
        none = np.zeros(0, dtype=np.int64)
        shares = np.zeros((2, 0, COLUMNS))
        return cls(none, np.zeros(0, dtype=np.bool_), np.zeros((0, 3, 3)), np.zeros((0, 3)), *shares)

    def of(self, units: Units) -> Overlaps:
        """Weights of other units; unknown weights are marked for computation."""
        place = find_keys(self.key, units.key)
        kept = np.flatnonzero(place >= 0)
        place, count = place[kept], len(units.key)
        new = Overlaps(
            units.key, np.zeros(count, dtype=np.bool_), np.zeros((count, 3, 3)), np.zeros((count, 3)), units.share.copy(),
            units.share.copy(),
        )  # fmt: skip
        for own, of_all in zip(new[1:], self[1:], strict=True):
            own[kept] = of_all[place]
        for shares in (new.shares, new.in_force):
            shares[~new.known] = units.share[~new.known]
        return new

    def look(self, poses: np.ndarray, kit: Kit, units: Units, near: np.ndarray) -> bool:
        """Update the weights of units that have moved; return whether any weight has changed."""
        shapes, solids = kit.shapes, kit.solids
        return bool(
            weigh_units(
                poses, near, units.shapes, shapes.body, shapes.kind, solids.size, shapes.radius, solids.offset, solids.axes,
                kit.point_start, kit.local, kit.weight, kit.on_axis, units.whole, units.share, *self[1:5],
            )
        )  # fmt: skip

    def flat(self) -> np.ndarray:
        """Weights as one flat array."""
        rows = np.flatnonzero(self.known)
        count = len(rows)
        turns = self.turns[rows].reshape(count, 9)
        columns = (self.key[rows, None], turns, self.shifts[rows], self.shares[rows], self.in_force[rows])
        return np.concatenate(columns, axis=1).ravel()

    @classmethod
    def from_flat(cls, flat: np.ndarray) -> Overlaps:
        """Weights from the array of `flat`."""
        rows = flat.reshape(-1, _ROW)
        count = len(rows)
        return cls(
            rows[:, 0].astype(np.int64), np.ones(count, dtype=np.bool_), rows[:, 1:10].reshape(count, 3, 3).copy(),
            rows[:, 10:13].copy(), rows[:, 13 : 13 + COLUMNS].copy(), rows[:, 13 + COLUMNS :].copy(),
        )  # fmt: skip
