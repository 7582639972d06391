"""Arrays of bodies and ANCF elements for compiled steps, if all their elements, loads and contacts have arrays."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import address_table
from fsm.model.bodies.arrays import flat_arrays
from fsm.model.bodies.pattern import BodyPattern
from fsm.model.joined.array_kernels import KERNELS
from fsm.model.joined.arrays import FrameArrays, Joined, JoinedArrays
from fsm.model.joined.condense import JoinedPattern
from fsm.model.joined.configuration import JoinedConfiguration
from fsm.model.nodes.system.arrays_of import Matrices, coordinates_of
from fsm.model.system.arrays_of import segments_of
from fsm.model.system.contact_arrays_of import ContactModel
from fsm.solve.interface.records import Ready
from fsm.solve.stepping.model import ArrayModel


def joined_arrays_of(
    system: JoinedConfiguration, pattern: BodyPattern, joined: JoinedPattern, slots: list[np.ndarray], fixed: np.ndarray,
    members: tuple[np.ndarray, np.ndarray, np.ndarray], near: np.ndarray, ready: Ready, contacts: ContactModel,
) -> tuple[ArrayModel, tuple[object, ...]]:  # fmt: skip
    """Compiled model of a system that has no part in Python, and its arrays; the caller must keep the arrays as long as the
    model.

    Parameters
    ----------
    system : JoinedConfiguration
    pattern, joined : patterns between bodies, and of the joined matrix
    slots : of every group of elements in the joined matrix
    fixed : (n_rows, 3) array
        Held coordinates.
    members : of free bodies and frames (`fsm.model.joined.condense.members_of`), and their maps
    near : quaternions of the frames
    ready : see `ArraySystem`
    contacts : ContactModel
    """
    elements, frames, free = system.elements, system.frames, system.n_free
    known, factors = ready(joined.pattern)
    start = system.initial()
    inertia = system.inertia(start[0], joined.pattern)
    matrices = Matrices(joined.pattern, known, factors, fixed, inertia, inertia, slots)
    nodes, held = coordinates_of(elements, matrices)
    # the symbolic factorisation of the pattern between bodies is not used
    bodies, *of_bodies = segments_of(system, pattern, known, factors, contacts)
    first, rows, maps = members
    count, turned = len(frames.bodies), np.zeros((joined.pattern.order, 3, 3))
    turned[:, range(3), range(3)] = 1.0
    arrays = JoinedArrays(
        FrameArrays(
            frames.bodies, frames.first, frames.vectors, frames.weights, frames.along, frames.across,
            np.ascontiguousarray(frames.fixed), frames.oriented.astype(np.int64),
        ),
        near, np.zeros((count, 6)), np.zeros((count, 3)), np.zeros((count, 6, 6)), maps, np.zeros(maps.shape),
        frames.vectors // 3, rows[2 * free :].copy(), first, joined.starts, joined.slots, turned,
    )  # fmt: skip
    table = address_table(list(flat_arrays(arrays)))
    model = Joined(bodies, nodes, table, nodes.flags)
    return ArrayModel.of(KERNELS, model, *start), (held, of_bodies, arrays)
