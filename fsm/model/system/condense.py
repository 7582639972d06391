"""One block matrix for bodies and ANCF nodes: frames are replaced by the nodal vectors that carry them.

Bodies have blocks of six rows, and ANCF nodes have vectors of three rows. In the joined matrix all blocks have three
rows. A body has two blocks (translation, rotation), and a vector has one block. A frame has no rows; the frame's forces and
tangents go to its vectors by the maps of `fsm.model.system.frames`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.kernels.blocks import BlockPattern
from fsm.kernels.jit import kernel
from fsm.kernels.scatter import find_slot
from fsm.model.system.frames import Frames


@dataclass(frozen=True, eq=False)
class JoinedPattern:
    """Pattern of the joined matrix, and the places in it of the blocks between bodies.

    Attributes
    ----------
    pattern : BlockPattern
        Blocks of three rows.
    starts : (n + 1,) int array
        The blocks of block k between bodies (or frames) are at `slots[starts[k] : starts[k + 1]]`, ordered by members of its
        row, then of its column.
    slots : int array
    """

    pattern: BlockPattern
    starts: np.ndarray
    slots: np.ndarray


def members_of(n_free: int, frames: Frames) -> tuple[np.ndarray, np.ndarray]:
    """Block rows of the joined matrix that free bodies and frames have.

    Returns
    -------
    first : (n_free + n_frames + 1,) int array
        The members of body or frame i are `rows[first[i] : first[i + 1]]`.
    rows : int array
    """
    counts = np.concatenate([np.full(n_free, 2), np.diff(frames.first)])
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    rows = np.concatenate([np.arange(2 * n_free), 2 * n_free + frames.vectors // 3]).astype(np.int64)
    return first, rows


def joined_pattern(
    count: int, bodies: BlockPattern, first: np.ndarray, rows: np.ndarray, elements: list[np.ndarray]
) -> JoinedPattern:
    """Pattern of the joined matrix.

    Parameters
    ----------
    count : int
        Block rows.
    bodies : BlockPattern
        Pattern between free bodies and frames.
    first, rows : see `members_of`
    elements : list of (m, v) int arrays
        Block rows that each ANCF element joins.
    """
    diagonal = np.arange(count)
    keys = [diagonal * count + diagonal]
    for joined in elements:
        keys.append(np.unique(joined[:, :, None] * count + joined[:, None, :]))
    i, j, members = bodies.rows, bodies.indices, np.diff(first)
    sizes = members[i] * members[j]
    starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    block = np.repeat(np.arange(len(j)), sizes)
    row, column = np.divmod(np.arange(starts[-1]) - starts[block], members[j][block])
    own = rows[first[i][block] + row] * count + rows[first[j][block] + column]
    unique = np.unique(np.concatenate([*keys, own]))
    row, column = np.divmod(unique, max(count, 1))
    indptr = np.searchsorted(row, np.arange(count + 1)).astype(np.int64)
    pattern = BlockPattern(indptr, column.astype(np.int64), 3)
    return JoinedPattern(pattern, starts, np.searchsorted(unique, own).astype(np.int64))


@kernel
def _is_empty(data: np.ndarray, k: int, size: int) -> bool:
    """Whether the entries of a block in its first rows and columns are zero."""
    for a in range(size):
        for b in range(size):
            if data[k, a, b] != 0.0:
                return False
    return True


@kernel
def _single_points(first: np.ndarray, maps: np.ndarray) -> np.ndarray:
    """Whether each body or frame (n,) has one member whose map (6, 3) is that of a point, the unit matrix over zeros."""
    out = np.zeros(first.shape[0] - 1, dtype=np.bool_)
    for i in range(out.shape[0]):
        point = first[i + 1] == first[i] + 1
        for a in range(6):
            for b in range(3):
                point = point and maps[first[i], a, b] == (1.0 if a == b else 0.0)
        out[i] = point
    return out


@kernel
def add_condensed(
    indptr: np.ndarray,
    indices: np.ndarray,
    data: np.ndarray,
    first: np.ndarray,
    left: np.ndarray,
    right: np.ndarray,
    starts: np.ndarray,
    slots: np.ndarray,
    out: np.ndarray,
) -> None:
    """Add L_p^T B R_q of all blocks B between bodies or frames, for all members p of the row and q of the column.

    Parameters
    ----------
    indptr, indices, data : block matrix between bodies and frames, blocks (6, 6)
    first : (n + 1,) int array
        See `members_of`.
    left, right : (m, 6, 3) arrays
        L and R of every member.
    starts, slots : see `JoinedPattern`
    out : (n_blocks, 3, 3) array, changed in place
    """
    work = np.empty((3, 6))
    lone_left, lone_right = _single_points(first, left), _single_points(first, right)
    for i in range(indptr.shape[0] - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            at = starts[k]
            points = lone_left[i] and lone_right[j]
            if _is_empty(data, k, 3 if points else 6):
                continue  # this is true for most blocks, because most points of films have no contact
            if points:
                block = out[slots[at]]
                for a in range(3):
                    for b in range(3):
                        block[a, b] += data[k, a, b]
                continue
            for p in range(first[i], first[i + 1]):
                for a in range(3):
                    for c in range(6):
                        total = 0.0
                        for b in range(6):
                            total += left[p, b, a] * data[k, b, c]
                        work[a, c] = total
                for q in range(first[j], first[j + 1]):
                    block = out[slots[at]]
                    at += 1
                    for a in range(3):
                        for b in range(3):
                            total = 0.0
                            for c in range(6):
                                total += work[a, c] * right[q, c, b]
                            block[a, b] += total


@kernel
def add_curvatures(
    indptr: np.ndarray, indices: np.ndarray, frames: Frames, rows: np.ndarray, curvatures: np.ndarray, out: np.ndarray
) -> None:
    """Subtract the derivatives of T^T (0, m) with respect to the vectors of each frame, at constant m, from the stiffness.

    Parameters
    ----------
    indptr, indices : joined pattern
    frames : Frames
    rows : (m,) int array
        Block row of every vector.
    curvatures : see `fsm.model.system.frames.frame_maps`
    out : (n_blocks, 3, 3) array, changed in place
    """
    first, along, across = frames.first, frames.along, frames.across
    for i in range(first.shape[0] - 1):
        h = curvatures[i]
        if not np.any(h):
            continue  # these are frames without moment, for example contact points of films
        for p in range(first[i], first[i + 1]):
            for q in range(first[i], first[i + 1]):
                block = out[find_slot(indptr, indices, rows[p], rows[q])]
                aa, ab = along[p] * along[q], along[p] * across[q]
                ba, bb = across[p] * along[q], across[p] * across[q]
                for c in range(3):
                    for d in range(3):
                        block[c, d] -= aa * h[c, d] + ab * h[c, 3 + d] + ba * h[3 + c, d] + bb * h[3 + c, 3 + d]


@kernel
def fold_forces(wrenches: np.ndarray, first: np.ndarray, rows: np.ndarray, maps: np.ndarray, out: np.ndarray) -> None:
    """Add T^T (f, m) of all bodies and frames to the generalised forces.

    Parameters
    ----------
    wrenches : (n, 6) array
        Force and moment of every free body, and then of every frame.
    first, rows : see `members_of`
    maps : (m, 6, 3) array
    out : (3 n_rows,) array, changed in place
    """
    for i in range(wrenches.shape[0]):
        if not np.any(wrenches[i]):
            continue
        for p in range(first[i], first[i + 1]):
            for c in range(3):
                total = 0.0
                for k in range(6):
                    total += maps[p, k, c] * wrenches[i, k]
                out[3 * rows[p] + c] += total
