"""Memory of contacts between accepted steps, stored by the keys of the few slots concerned."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class ContactMemory(NamedTuple):
    """Memory of some slots; the memory of all other slots is zero.

    Attributes
    ----------
    key : (k,) int array
        Keys of the slots, `ContactTable.keys`, ascending.
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

    def flat(self) -> np.ndarray:
        """Flat array that starts with the number of slots; keys are exact up to 2^53."""
        return np.concatenate([[float(len(self.key))], *(values.ravel() for values in self)])

    @classmethod
    def from_flat(cls, flat: np.ndarray, slips: int) -> tuple[ContactMemory, np.ndarray]:
        """Memory from an array that `flat` made, and the remaining values of the array."""
        count = int(flat[0])
        key, onset, began, depth, deflection, rest = np.split(flat[1:].copy(), np.cumsum([count] * 4 + [count * slips]))
        return cls(key.astype(np.int64), onset, began, depth, deflection.reshape(count, slips)), rest


class ContactDepths(NamedTuple):
    """Depths at which statics linearises the normal law, see `fsm.interactions.contact.contact_depths`.

    Attributes
    ----------
    key : (k,) int array
        Keys of the contacts with a depth. A depth is kept, and the contact stays closed, until the linearised force would be
        tensile.
    depth : (k,) array, m
    most : N
        Limit of the normal force; it limits the depth of linearisation of contacts without a stored depth.
    """

    key: np.ndarray
    depth: np.ndarray
    most: float
