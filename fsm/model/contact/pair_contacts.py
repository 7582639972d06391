"""Contacts of two bodies each, one for every pair: the base of geometries with a closed form of the gap, in one file.

Such a geometry has three kernels of its own; the pattern, the slots and the memory are the same for all. See
docs/extend/contact_geometry.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.tables import as_declared, empty_arrays
from fsm.model.bodies.contact_arrays import REFERRED, ContactArrays, GeometryKernels
from fsm.model.contact.contact_table import ContactTable
from fsm.model.contact.touching import Touching
from fsm.solve.stepping.vectors import copy_into


@kernel
def _renew(g: ContactArrays, poses: np.ndarray) -> int:
    if g.state[REFERRED] == 1:
        return 0
    copy_into(poses, g.reference)
    g.state[REFERRED] = 1
    return 1


@kernel
def _keep_rows(g: ContactArrays, rows: np.ndarray) -> None:
    """Nothing: the contacts have only the slots and gaps that all geometries have."""


@kernel
def _tapered(g: ContactArrays, poses: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    return g.slot[:0], g.at[:0], g.rate[:0], g.gradient[:0]


@kernel
def _never_passed(g: ContactArrays, poses: np.ndarray) -> int:
    return -1


@kernel
def _settle(g: ContactArrays, poses: np.ndarray, young: np.ndarray, new: bool) -> None:
    """Nothing: the gap is a function of the poses."""


class PairContacts(ContactTable):
    """Contacts of pairs of bodies in space, one slot each; its number is that of the pair in `touching`.

    Parameters
    ----------
    touching : Touching
    own : NamedTuple of arrays
        Arrays of the geometry, after `ContactArrays` in the table.
    margin : largest gap that `find` has to return, m
    find, measure, tangent, passed : kernels, see `GeometryKernels`
        Without `passed`, steps do not detect that bodies have passed through each other.
    """

    coupled_bodies = 2

    def __init__(
        self, touching: Touching, own: Any, margin: float, find: Any, measure: Any, tangent: Any,
        passed: Any = _never_passed,
    ) -> None:  # fmt: skip
        self.ends, count, none = touching.ends, len(touching.pairs), np.zeros(0)
        kernels = GeometryKernels(_renew, find, measure, _keep_rows, _tapered, tangent, passed, _settle)
        super().__init__(kernels, 3, margin, none.astype(np.int64), none, empty_arrays(type(own)))
        self.with_slots(as_declared(own), count, np.ones(count), np.zeros(count), touching.numbers)
        self.common.bodies[:] = self.ends

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """See `ContactTable`."""
        return slots

    def coupled(self) -> np.ndarray:
        """See `ContactTable`."""
        return self.ends

    def coupled_ahead(self) -> np.ndarray:
        """See `ContactTable`."""
        return self.ends

    def own_memory(self) -> np.ndarray:
        """See `ContactTable`."""
        return np.zeros(0)

    def load_own(self, memory: np.ndarray) -> None:
        """See `ContactTable`."""
