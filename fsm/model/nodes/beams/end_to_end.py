"""Numbering of an array end to end: the specification matrix method of Peng et al. (2019), section 3, as a permutation.

Each unit lists first the coordinates of its left boundary, then its inner coordinates, and last the coordinates of its right
boundary. The right boundary of a unit is the left boundary of the next unit. B has a single 1 in each row and column, and
maps the new order to the original one. The inverse is its transpose. In the new order the matrices of an array are
block-banded with the width of one unit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def end_to_end(units: Sequence[Sequence[int]]) -> np.ndarray:
    """Order of the numbers used by units, from the first unit to the last, each number once.

    Numbers that a unit shares with the next unit come last; the other numbers keep the order of the lists.
    """
    order: list[int] = []
    done: set[int] = set()
    for k, unit in enumerate(units):
        later = set(units[k + 1]) if k + 1 < len(units) else set()
        first = [i for i in unit if i not in done and i not in later]
        last = [i for i in unit if i not in done and i in later]
        for i in dict.fromkeys([*first, *last]):
            order.append(i)
            done.add(i)
    return np.array(order, dtype=np.int64)
