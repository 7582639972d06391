"""Arrays of bodies and ANCF elements for compiled steps, in time or in statics, if all their elements, loads and contacts
have arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import address_table
from fsm.kernels.block_equations import NO_LOW_RANK
from fsm.model.bodies.arrays import Arrays, flat_arrays
from fsm.model.bodies.group import BodyPattern
from fsm.model.elements.element_group import ElementArrays
from fsm.model.joined.configuration import JoinedConfiguration
from fsm.model.nodes.arrays import FACTORS, MATRIX
from fsm.model.nodes.facets.facet_group import FacetGroup
from fsm.model.nodes.system.arrays_of import Matrices, coordinates_of
from fsm.model.system.arrays import Joined, JoinedArrays
from fsm.model.system.arrays_of import ContactModel, segments_of
from fsm.solve.interface.records import Ready


class JoinedModel(NamedTuple):
    """Compiled model, and the arrays whose addresses it has: of bodies in motion and at rest, of their elements, and all
    others.
    """

    model: Joined
    bodies: tuple[Arrays, Arrays]
    elements: list[ElementArrays]
    others: list[np.ndarray]


def joined_of(
    system: JoinedConfiguration, pattern: BodyPattern, near: np.ndarray, ready: Ready, contacts: ContactModel,
    statics: bool = False,
) -> JoinedModel:
    """Compiled model of a system that has no part in Python; the caller must keep the arrays as long as the model.

    Parameters
    ----------
    system : JoinedConfiguration
    pattern : pattern between bodies and frames
    near : quaternions of the frames
    ready, contacts : Ready, ContactModel
    statics : whether the model is for statics
    """
    elements, frames, free = system.elements, system.frames, system.n_free
    joined, slots, fixed = system.joined_matrix(pattern)
    known, factors = ready(joined.pattern)
    inertia = system.inertia(system.initial()[0], joined.pattern)
    matrices = Matrices(joined.pattern, known, factors, fixed, inertia, inertia, slots)
    nodes, held = coordinates_of(elements, matrices, system.low_rank_table())
    # the symbolic factorisation of the pattern between bodies is not used
    bodies, of_bodies, of_elements = segments_of(system, pattern, known, factors, contacts, statics)
    first, rows, maps = system.members()
    count, turned = len(frames.bodies), np.zeros((joined.pattern.order, 3, 3))
    turned[:, range(3), range(3)] = 1.0
    arrays = JoinedArrays(
        frames, near, np.zeros((count, 6)), np.zeros((count, 3)), np.zeros((count, 6, 6)), maps, np.zeros(maps.shape),
        frames.vectors // 3, rows[2 * free :].copy(), first, joined.starts, joined.slots, turned,
        3 * np.flatnonzero(elements.mesh.is_position[::3]), np.array([system.wave_factor]),
    )  # fmt: skip
    of_facets = (group.mixed for group in elements.mesh.groups if isinstance(group, FacetGroup))
    flat = [*flat_arrays(arrays), *(array for pair in of_facets for array in pair)]
    own = [joined.pattern.zeros(), np.zeros(factors.shape)]
    plain = nodes.equations._replace(low_rank=NO_LOW_RANK)
    projection = nodes._replace(table=nodes.table.copy(), flags=np.zeros(3, dtype=np.int64), equations=plain)
    projection.table[[MATRIX, FACTORS]] = address_table(own)
    model = Joined(bodies, nodes, address_table(flat), nodes.flags, nodes.equations, projection)
    return JoinedModel(model, of_bodies, of_elements, [*held, *flat, *own])
