"""Memory of contacts between accepted steps, stored by the keys of the few slots concerned."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.keys import find_keys


class ContactMemory(NamedTuple):
    """Memory of some slots; the memory of all other slots is zero.

    Attributes
    ----------
    key : (k,) int array
        Keys of the slots, `ContactGeometry.keys`.
    onset : (k,) array, m/s
        Closing speed at which each contact began.
    began : (k,) array, s
    depth : (k,) array, m
        Depth in the last accepted state.
    deflection : (k, slips) array, m
        Deflection of the bristles.
    """

    key: np.ndarray
    onset: np.ndarray
    began: np.ndarray
    depth: np.ndarray
    deflection: np.ndarray

    @classmethod
    def nothing(cls, slips: int) -> ContactMemory:
        """Empty memory."""
        return cls(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros((0, slips)))

    def ordered(self) -> ContactMemory:
        """Copy with ascending keys, as `of` requires."""
        order = np.argsort(self.key, kind="stable")
        return ContactMemory(*(values[order] for values in self))

    def of(self, keys: np.ndarray) -> ContactMemory:
        """Memory of these slots, in their order; read-only."""
        place = find_keys(self.key, keys)
        if (place >= 0).all():  # usually the slots are the contacts of the last step
            return ContactMemory(keys, *(values[place] for values in self[1:]))
        beyond = (np.concatenate([values, np.zeros((1, *values.shape[1:]))]) for values in self[1:])
        return ContactMemory(keys, *(values[place] for values in beyond))  # the index -1 selects the row of zeros

    def flat(self) -> np.ndarray:
        """Flat array that starts with the number of slots; keys are exact up to 2^53."""
        return np.concatenate([[float(len(self.key))], *(values.ravel() for values in self)])

    @classmethod
    def from_flat(cls, flat: np.ndarray, slips: int) -> tuple[ContactMemory, np.ndarray]:
        """Memory from an array that `flat` made, and the remaining values of the array."""
        count = int(flat[0])
        key, onset, began, depth, deflection, rest = np.split(
            flat[1:].copy(), np.cumsum([count] * 4 + [count * slips])
        )
        return cls(key.astype(np.int64), onset, began, depth, deflection.reshape(count, slips)), rest
