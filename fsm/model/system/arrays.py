"""Bodies, and ANCF elements with their frames if there are any, as a compiled model (`ArrayModel`) for steps (see
`fsm.solve.stepping.model`).

The model consists of the model of bodies (`fsm.model.bodies.arrays`) and the model of coordinates
(`fsm.model.nodes.arrays`). The block data of the coordinates, with blocks of three rows, are the data of the joined matrix,
which also contains the rows of bodies. A model of bodies alone has None in place of the coordinates. The kernels of nodes
have the coordinates as their first argument; of a kernel for None, numba compiles only what precedes the coordinates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d
from fsm.kernels.block_equations import EquationKernels, Pattern
from fsm.kernels.jit import kernel
from fsm.kernels.records import record
from fsm.model.bodies import arrays as of_bodies
from fsm.model.bodies.arrays import Segments
from fsm.model.nodes import arrays as of_nodes
from fsm.model.nodes.arrays import Coordinates
from fsm.model.system.frames import Frames


class JoinedArrays(NamedTuple):
    """Arrays of frames, and of the places of bodies and frames in the joined matrix.

    Attributes
    ----------
    frames : Frames
    near : (n, 4) array
        Quaternion of each frame in the previous state; the sign of the new quaternion is chosen near it.
    rates : (n, 6) array
        Rates of the frames at the present state, and arrays for the computation of their wrenches.
    moments : (n, 3) array
    curvatures : (n, 6, 6) array
        See `fsm.model.system.frames.frame_maps`.
    members, turning : (m, 6, 3) arrays
        Maps of the members of free bodies and frames, and their derivatives; see `fsm.model.system.condense.members_of`.
    node_rows, rows : int arrays
        Block row of each vector of a frame, among the coordinates and in the joined matrix.
    of_members : int array, see `fsm.model.system.condense.members_of`
    starts, slots : see `fsm.model.system.condense.JoinedPattern`
    turned : (n_rows, 3, 3) array
        Derivatives of the increment of the last factors.
    places : int array
        First coordinate of each nodal vector that is a position.
    waves : (1,) array, 1/s^2
        Least factor on the inertia of locked directions in their penalties; see `JoinedConfiguration.wave_factor`.
    """

    frames: Frames
    near: np.ndarray
    rates: np.ndarray
    moments: np.ndarray
    curvatures: np.ndarray
    members: np.ndarray
    turning: np.ndarray
    node_rows: np.ndarray
    rows: np.ndarray
    of_members: np.ndarray
    starts: np.ndarray
    slots: np.ndarray
    turned: np.ndarray
    places: np.ndarray
    waves: np.ndarray


@record
class Joined(NamedTuple):
    """Model of bodies and, unless they are None, of coordinates, with the table of `JoinedArrays`.

    `flags` and `equations` are those of the coordinates, else of the bodies. `projection` are the coordinates with a matrix
    of their own, for projections to locked directions.
    """

    bodies: Segments
    nodes: Coordinates | None
    table: np.ndarray
    flags: np.ndarray
    equations: EquationKernels
    projection: Coordinates | None


class Matrices(NamedTuple):
    """Pattern and block data of the equations of a model."""

    pattern: Pattern
    stiffness: np.ndarray
    damping: np.ndarray
    matrix: np.ndarray
    factors: np.ndarray
    kept_stiffness: np.ndarray
    kept_damping: np.ndarray


def of_bodies_alone(bodies: Segments) -> Joined:
    """Model of bodies without nodes."""
    return Joined(bodies, None, np.zeros((0, 4), dtype=np.int64), bodies.flags, bodies.equations, None)


@kernel(inline=True)
def matrices_of(model: Joined) -> Matrices:
    """Matrices of the model."""
    return _matrices(model.nodes, model.bodies.table)


@kernel(inline=True)
def _matrices(nodes: Coordinates | None, table: np.ndarray) -> Matrices:
    if nodes is None:
        return Matrices(
            of_bodies.pattern_of(table), floats_3d(table, of_bodies.STIFFNESS), floats_3d(table, of_bodies.DAMPING),
            floats_3d(table, of_bodies.MATRIX), floats_3d(table, of_bodies.FACTORS),
            floats_3d(table, of_bodies.KEPT_STIFFNESS), floats_3d(table, of_bodies.KEPT_DAMPING),
        )  # fmt: skip
    own = nodes.table
    return Matrices(
        of_nodes.pattern_of(own), floats_3d(own, of_nodes.STIFFNESS), floats_3d(own, of_nodes.DAMPING),
        floats_3d(own, of_nodes.MATRIX), floats_3d(own, of_nodes.FACTORS), floats_3d(own, of_nodes.KEPT_STIFFNESS),
        floats_3d(own, of_nodes.KEPT_DAMPING),
    )  # fmt: skip


@kernel(inline=True)
def sizes(model: Joined) -> tuple[int, int]:
    """Numbers of coordinates and of rates of the free bodies."""
    table = model.bodies.table
    free = integers_1d(table, of_bodies.FREE).shape[0]
    return free * floats_2d(table, of_bodies.POSES).shape[1], free * floats_2d(table, of_bodies.RATES).shape[1]


AT, _FRAMES = 0, len(Frames._fields)
NEAR, OWN_RATES, MOMENTS, CURVATURES, MEMBERS, TURNING, NODE_ROWS = range(_FRAMES, _FRAMES + 7)
ROWS, OF_MEMBERS, STARTS, SLOTS, TURNED, PLACES, WAVES = range(_FRAMES + 7, _FRAMES + 14)
"""Rows of `Joined.table`; the bodies of the frames are in row `AT`."""
FACETS = WAVES + 1
"""First row of pairs for each group of flexible facets: membrane efforts, flat, and 1 if they are unknowns, else 0."""


@kernel
def frames_of(t: np.ndarray) -> Frames:
    """Frames of the table."""
    return Frames(
        integers_1d(t, 0), integers_1d(t, 1), integers_1d(t, 2), floats_1d(t, 3), floats_1d(t, 4), floats_1d(t, 5),
        floats_2d(t, 6), integers_1d(t, 7),
    )  # fmt: skip
