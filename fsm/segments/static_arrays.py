"""Arrays of a system of bodies for quasi-static steps in one kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fsm.blocks import BlockMatrix
from fsm.kernels.addresses import address_table
from fsm.kernels.block_equations import SYMMETRIC, TRUSTED
from fsm.segments.array_statics import STATICS
from fsm.segments.arrays import FACTORS
from fsm.segments.arrays_of import segments_of
from fsm.segments.contact_arrays_of import ContactModel
from fsm.segments.element_cache import TwoBodyGroup
from fsm.segments.elements import BushingGroup
from fsm.segments.pattern import BodyPattern
from fsm.stepping.quasi_static import StaticModel
from fsm.system_records import PreviousState, Ready

if TYPE_CHECKING:
    from fsm.segments.force_system import SegmentForces

__all__ = ["StaticSegments"]


class StaticSegments:
    """Arrays of a system without parts in Python; see `fsm.system.StaticArrays`.

    Attributes
    ----------
    model : StaticModel
    """

    def __init__(self, system: SegmentForces, pattern: BodyPattern, ready: Ready) -> None:
        contacts = ContactModel((), pattern, system.bodies.rate.shape, system.spatial, 0)
        segments, (arrays, _), elements = segments_of(system, pattern, *ready(pattern), contacts, True)
        self.model = StaticModel.of(STATICS, segments, system.initial()[0])
        self._system, self._pattern, self._arrays = system, pattern, arrays
        self._ready = ready
        own = iter(elements)
        joints = [group for group in system.groups if isinstance(group, TwoBodyGroup)]
        places = [arrays.springs.last if isinstance(group, BushingGroup) else next(own).last for group in joints]
        self._damped = [(group, last) for group, last in zip(joints, places, strict=True) if group.rate_dependent]
        self._elements = elements  # the model has their addresses

    def use(self, ready: Ready) -> None:
        """Write factors to the block data of a linear solver."""
        self._ready = ready

    def begin(self, t: float, q: np.ndarray, before: PreviousState, efforts: np.ndarray) -> None:
        """See `fsm.system.StaticArrays`."""
        system = self._system
        since = before if system.rate_dependent and t > before[0] else None
        poses, rates = system.place(t, q, None if since is None else np.zeros(system.nu), since)
        _, factors = self._ready(self._pattern)
        if factors is not self._arrays.factors:
            self._arrays = self._arrays._replace(factors=factors)
            self.model.arrays.table[FACTORS] = address_table([factors])[0]
        arrays = self._arrays
        arrays.poses[:], arrays.rates[:], arrays.interval[:] = poses, rates, (t, 0.0 if since is None else t - since[0])
        arrays.springs.efforts.ravel()[:] = efforts
        if since is not None:
            arrays.last_q[:] = since[1]
            for group, place in self._damped:
                place[:] = group.deformations_before(rates, system.past(t, since))

    def end(self) -> tuple[np.ndarray, BlockMatrix, bool, bool]:
        """See `fsm.system.StaticArrays`."""
        arrays, flags = self._arrays, self.model.arrays.flags
        matrix = BlockMatrix(self._pattern, arrays.matrix.copy())
        return arrays.springs.efforts.ravel().copy(), matrix, bool(flags[SYMMETRIC]), bool(flags[TRUSTED])
