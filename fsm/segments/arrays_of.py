"""Arrays of a system for compiled steps, if all its force elements have arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fsm.segments.arrays import KERNELS, Creases, Ligaments, Pattern, Segments, Springs
from fsm.segments.elements import BushingGroup, CreaseGroup
from fsm.segments.ligaments import LigamentGroup
from fsm.segments.loads import GravityGroup
from fsm.segments.pattern import BodyPattern
from fsm.stepping.model import ArrayModel
from fsm.system import Ready

if TYPE_CHECKING:
    from fsm.segments.system import SegmentSystem

__all__ = ["arrays_of", "has_arrays"]

_KINDS = {BushingGroup, CreaseGroup, LigamentGroup, GravityGroup}


def has_arrays(system: SegmentSystem) -> bool:
    """Whether all force elements of a system have arrays, and no body is driven."""
    kinds = [type(group) for group in system.groups]
    return _KINDS.issuperset(kinds) and len(set(kinds)) == len(kinds) and not system.motions and system.nu > 0


def arrays_of(system: SegmentSystem, pattern: BodyPattern, ready: Ready) -> ArrayModel | None:
    """Model of arrays of a system; None if `has_arrays` is false."""
    if not has_arrays(system):
        return None
    known_pattern, factors = ready(pattern)
    bodies, spatial = system.bodies, system.spatial
    weight, creases = np.zeros((len(bodies.pose), 3 if spatial else 2)), None
    springs: Springs | None = None
    ligaments: Ligaments | None = None
    for group in system.groups:
        if isinstance(group, GravityGroup):
            weight = group.mass[:, None] * group.acceleration
        elif isinstance(group, BushingGroup):
            springs = Springs(*group.arrays(pattern), np.zeros(group.rest.shape))
        elif isinstance(group, CreaseGroup):
            creases = Creases._make((*group.arrays(pattern), np.zeros(len(group.bodies))))
        elif isinstance(group, LigamentGroup):
            ligaments = Ligaments(group.bodies, group.constants, np.zeros(group.rest.shape))
    model = Segments(
        bodies.free, bodies.inertia[bodies.free].ravel(), bodies.inertia if spatial else None, bodies.inertia, weight,
        bodies.pose.copy(), np.zeros(bodies.rate.shape), np.zeros(bodies.rate.shape),
        Pattern(
            pattern.dof, pattern.indptr, pattern.indices, pattern.transposed, pattern.diagonal, known_pattern.order,
            known_pattern.indptr, known_pattern.indices, known_pattern.diagonal, known_pattern.place,
        ),
        springs, creases, ligaments, pattern.zeros(), pattern.zeros(), pattern.zeros(), factors,
        np.zeros((system.n_free, 6, 6)) if spatial else None, np.zeros(3, dtype=np.int64),
    )  # fmt: skip
    return ArrayModel.of(KERNELS, model, *system.initial())
