"""Contacts of two bodies each, one or a few for every pair: the base of geometries with a closed form of the gap.

Such a geometry has three kernels of its own; the pattern, the slots and the memory are the same for all. See
docs/extend/contact_geometry.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.tables import as_declared, empty_arrays
from fsm.model.bodies.contact_arrays import MEANS, REFERRED, ContactArrays, GeometryKernels
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
    """Contacts of pairs of bodies in space, in the order of `touching`: one slot each, or as many as `share` has columns.

    Parameters
    ----------
    touching : Touching
    own : NamedTuple of arrays
        Arrays of the geometry, after `ContactArrays` in the table.
    margin : largest gap that `find` has to return, m
    find, measure, tangent, passed : kernels, see `GeometryKernels`
        Without `passed`, steps do not detect that bodies have passed through each other.
    share, area : (n, slots of a pair) arrays, - and m^2
        See `ContactTable`; without them, each pair has one slot with the share 1 and the area 0.
    means : whether depths are means, so that `measure` writes `ContactArrays.pull`, and `tangent` calls `add_pull_tangent`
    """

    coupled_bodies = 2

    def __init__(
        self, touching: Touching, own: Any, margin: float, find: Any, measure: Any, tangent: Any,
        passed: Any = _never_passed, share: np.ndarray | None = None, area: np.ndarray | None = None,
        means: bool = False,
    ) -> None:  # fmt: skip
        self.ends, none = touching.ends, np.zeros(0)
        share = np.ones((len(self.ends), 1)) if share is None else share
        area = np.zeros(share.shape) if area is None else area
        kernels = GeometryKernels(_renew, find, measure, _keep_rows, _tapered, tangent, passed, _settle)
        super().__init__(kernels, 3, margin, none.astype(np.int64), none, empty_arrays(type(own)))
        self.common.state[MEANS] = means
        number = np.repeat(np.arange(len(self.ends)), share.shape[1])
        self.with_slots(as_declared(own), share.size, share.ravel(), area.ravel(), touching.numbers[number])
        self.common.bodies[:] = self.ends[number]

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
