"""Supernodes of an elimination, for `fsm.kernels.fronts`."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from fsm.kernels.blocks import BlockPattern, Elimination
from fsm.kernels.fronts import Supernodes

_PANEL = 36
"""Rows of a panel. Products are slower with shorter panels; the inverse of the pivot is slower with longer panels."""
_ZEROS = ((1, 1.0), (2, 0.3), (5, 0.1))
_MOST_ZEROS = 0.05
"""A supernode merges with its parent if the fraction of zeros in their columns is below a bound. There is no bound up
to one panel of rows; the bound is 0.3 up to two panels, 0.1 up to five, and 0.05 above (as in CHOLMOD; Chen, Davis,
Hager and Rajamanickam, 2008)."""


class _Tree:
    """Supernodes by the last step that they eliminate, with their parents and children."""

    def __init__(self, known: Elimination) -> None:
        starts, ends = known.diagonal + 1, known.indptr[1:]
        count, later = len(starts), ends - starts
        parent = np.full(count, -1)
        parent[later > 0] = known.indices[starts[later > 0]]
        # a step joins its parent if both couple the same later steps
        last, joined = np.arange(count), np.zeros(count, dtype=bool)
        for i in range(count - 1, -1, -1):
            p = parent[i]
            if p >= 0 and later[i] == later[p] + 1 and not joined[p]:
                joined[p] = True
                last[i] = last[p]
        self.steps: dict[int, list[int]] = defaultdict(list)
        for i in range(count):
            self.steps[int(last[i])].append(i)
        self.rows = {s: known.indices[starts[s] : ends[s]] for s in self.steps}
        self.children: dict[int, list[int]] = {s: [] for s in self.steps}
        self.roots: list[int] = []
        for s in sorted(self.steps):
            (self.children[int(last[parent[s]])] if parent[s] >= 0 else self.roots).append(s)
        self._zeros = dict.fromkeys(self.steps, 0)

    def merge(self, panel: int) -> None:
        """Merge supernodes with their parents where this adds few zeros; `panel` is the number of steps of a panel."""
        for s in sorted(self.steps):
            for child in sorted(self.children[s], key=lambda c: -len(self.rows[c])):
                own, both = len(self.steps[child]), len(self.steps[child]) + len(self.steps[s])
                added = own * (len(self.steps[s]) + len(self.rows[s]) - len(self.rows[child]))
                zeros = self._zeros[child] + self._zeros[s] + added
                bound = next((part for panels, part in _ZEROS if both <= panels * panel), _MOST_ZEROS)
                if added and zeros > bound * (both * (both + 1) // 2 + both * len(self.rows[s])):
                    continue
                self.steps[s] = self.steps.pop(child) + self.steps[s]
                self.children[s].remove(child)
                self.children[s] += self.children.pop(child)
                self._zeros[s] = zeros

    def ordered(self) -> list[int]:
        """Supernodes with children before parents; among siblings the largest front comes first, which keeps the stack
        small.
        """
        found, todo = [], list(reversed(self.roots))
        while todo:  # parents come before children here; the result is reversed
            s = todo.pop()
            found.append(s)
            todo += sorted(self.children[s], key=lambda c: (-len(self.steps[c]) - len(self.rows[c]), c))
        return found[::-1]


def supernodes(pattern: BlockPattern, known: Elimination) -> Supernodes:
    """Supernodes of an elimination. The order keeps the fill of the elimination. Merged supernodes add zeros where this
    saves time.
    """
    size, width = pattern.size, max(1, _PANEL // pattern.size)
    tree = _Tree(known)
    tree.merge(width)
    nodes = tree.ordered()
    steps = np.concatenate([tree.steps[s] for s in nodes])
    position = np.empty(len(steps), dtype=np.int64)
    position[steps] = np.arange(len(steps))
    rows = [np.sort(position[tree.rows[s]]) for s in nodes]
    own, later = np.array([len(tree.steps[s]) for s in nodes]), np.array([len(part) for part in rows])
    children = np.array([len(tree.children[s]) for s in nodes])
    held: list[int] = []
    most = 0
    for below, count in zip((later * size) ** 2, children, strict=True):
        del held[len(held) - count :]
        held.append(int(below))
        most = max(most, sum(held))
    panels = (own + width - 1) // width
    # a panel stores its own rows and all later rows: w (f - begin) numbers
    begun = [np.arange(p) * width for p in panels]
    stored = [int(np.sum(np.minimum(width, k - at) * (k + m - at))) for at, k, m in zip(begun, own, later, strict=True)]
    return Supernodes(
        known.order[steps], _offsets(own), _offsets(later), np.concatenate(rows).astype(np.int64), children,
        _offsets(np.array(stored) * size**2 + own * size), size, width, int((own + later).max()) * size, most,
    )  # fmt: skip


def _offsets(lengths: np.ndarray) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
