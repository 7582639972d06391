"""Names of symbols in compiled kernels."""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np
from numba import typeof
from numba.core.registry import cpu_target

from fsm.kernels.rotation import multiply

Wide: Any = namedtuple("Wide", ["first", "second"])
_ONE = (np.ones(1), np.ones(1, int))


def test_names_of_symbols_do_not_grow_with_the_arguments() -> None:
    """numba makes several kB of a table of arrays, and a kernel has hundreds of such names."""
    multiply(np.eye(4)[0], np.eye(4)[0])  # the first kernel of a process sets the names
    mangled = cpu_target.target_context.mangler
    wide, other = typeof(Wide(_ONE * 100, 1.0)), typeof(Wide(_ONE[::-1] * 100, 1.0))
    names = {mangled("kernels.march", kinds, uid=uid) for kinds in ((wide,), (other,), (wide, other)) for uid in (1, 2)}
    assert len(names) == 6 and max(map(len, names)) < 200
    assert mangled("kernels.march", (wide,), uid=1) in names
