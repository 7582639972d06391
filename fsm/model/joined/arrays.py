"""Bodies and ANCF elements with their frames as a compiled model (`ArrayModel`) for steps (see `fsm.solve.stepping.model`).

The model consists of the model of bodies (`fsm.model.bodies.arrays`) and the model of coordinates
(`fsm.model.nodes.arrays`). The block data of the coordinates, with blocks of three rows, are the data of the joined matrix,
which also contains the rows of bodies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d
from fsm.kernels.jit import kernel
from fsm.kernels.records import record
from fsm.model.bodies.arrays import Segments
from fsm.model.nodes.arrays import Coordinates


class FrameArrays(NamedTuple):
    """Arrays of `fsm.model.joined.frames.Frames`."""

    bodies: np.ndarray
    first: np.ndarray
    vectors: np.ndarray
    weights: np.ndarray
    along: np.ndarray
    across: np.ndarray
    fixed: np.ndarray
    oriented: np.ndarray


class JoinedArrays(NamedTuple):
    """Arrays of frames, and of the places of bodies and frames in the joined matrix.

    Attributes
    ----------
    frames : FrameArrays
    near : (n, 4) array
        Quaternion of each frame in the previous state; the sign of the new quaternion is chosen near it.
    rates : (n, 6) array
        Rates of the frames at the present state, and arrays for the computation of their wrenches.
    moments : (n, 3) array
    curvatures : (n, 6, 6) array
        See `fsm.model.joined.frames.frame_maps`.
    members, turning : (m, 6, 3) arrays
        Maps of the members of free bodies and frames, and their derivatives; see `fsm.model.joined.condense.members_of`.
    node_rows, rows : int arrays
        Block row of each vector of a frame, among the coordinates and in the joined matrix.
    of_members : int array, see `fsm.model.joined.condense.members_of`
    starts, slots : see `fsm.model.joined.condense.JoinedPattern`
    turned : (n_rows, 3, 3) array
        Derivatives of the increment of the last factors.
    places : int array
        First coordinate of each nodal vector that is a position.
    waves : (1,) array, 1/s^2
        Least factor on the inertia of locked directions in their penalties; see `JoinedConfiguration.wave_factor`.
    """

    frames: FrameArrays
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
    """Model of bodies and of coordinates, with the table of `JoinedArrays`; the coordinates give `flags`.

    `projection` are the coordinates with a matrix of their own, for projections to locked directions.
    """

    bodies: Segments
    nodes: Coordinates
    table: np.ndarray
    flags: np.ndarray
    projection: Coordinates


AT, _FRAMES = 0, len(FrameArrays._fields)
NEAR, OWN_RATES, MOMENTS, CURVATURES, MEMBERS, TURNING, NODE_ROWS = range(_FRAMES, _FRAMES + 7)
ROWS, OF_MEMBERS, STARTS, SLOTS, TURNED, PLACES, WAVES = range(_FRAMES + 7, _FRAMES + 14)
"""Rows of `Joined.table`; the bodies of the frames are in row `AT`."""
FACETS = WAVES + 1
"""First row of pairs for each group of flexible facets: membrane efforts, flat, and 1 if they are unknowns, else 0."""


@kernel
def frames_of(t: np.ndarray) -> FrameArrays:
    """Frames of the table."""
    return FrameArrays(
        integers_1d(t, 0), integers_1d(t, 1), integers_1d(t, 2), floats_1d(t, 3), floats_1d(t, 4), floats_1d(t, 5),
        floats_2d(t, 6), integers_1d(t, 7),
    )  # fmt: skip
