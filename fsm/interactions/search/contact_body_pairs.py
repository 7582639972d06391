"""Pairs of bodies that contacts may couple until the next renewal of the broad phase."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def coupled_bodies(probe_body: np.ndarray, window: np.ndarray, owners: np.ndarray, count: int) -> np.ndarray:
    """Pairs of bodies: each probe's body with the bodies of the pieces in its window, and both bodies of each piece.

    Parameters
    ----------
    probe_body : (n,) int array
    window : (n, 2) int array
        First and one past the last piece of each probe. Probes of one body follow each other, and so do their windows.
    owners : (m, 2) int array
        Bodies of the pieces.
    count : number of all bodies

    Returns
    -------
    (k, 2) int array
        A pair occurs once for each series of consecutive probes of one body.
    """
    seen, known = np.full(count, -1, dtype=np.int64), np.zeros(owners.shape[0], dtype=np.bool_)
    out, found, run = np.empty((256, 2), dtype=np.int64), 0, 0
    for i in range(probe_body.shape[0]):
        first, last, body = window[i, 0], window[i, 1], probe_body[i]
        same_body = i > 0 and body == probe_body[i - 1]
        if not same_body:
            run += 1
        if first >= last or (same_body and first == window[i - 1, 0] and last == window[i - 1, 1]):
            continue
        while found + 3 * (last - first) > out.shape[0]:
            more = np.empty((2 * out.shape[0], 2), dtype=np.int64)
            for j in range(found):
                more[j, 0], more[j, 1] = out[j, 0], out[j, 1]
            out = more
        for j in range(first, last):
            for k in range(2):
                owner = owners[j, k]
                if seen[owner] != run:
                    seen[owner] = run
                    out[found, 0], out[found, 1] = body, owner
                    found += 1
            if not known[j]:
                known[j] = True
                out[found, 0], out[found, 1] = owners[j, 0], owners[j, 1]
                found += 1
    return out[:found].copy()
