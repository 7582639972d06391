"""Elements and parts of arrays in kernels, compared with NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fsm.kernels.jit import kernel


@kernel
def set_parts(a: np.ndarray, b: np.ndarray, c: np.ndarray, k: int, i: int, j: int) -> None:
    """Assignments of arrays and numbers, also of overlapping parts."""
    b[k] = a
    b[0, i:j] = a[i:j]
    c[1] = b
    c[k, 0] = a
    b[i:j] = c[1, i:j]
    a[1:] = a[:-1]
    b[-1, :] = 3.0
    c[0, 1:] = 4
    a[0:1] = b[1, 1:2]
    a[:-1] = a[1:]
    c[:, 1, 2] = a


@kernel
def set_part(a: np.ndarray, b: np.ndarray, i: int, j: int) -> None:
    """Set a part of a."""
    a[i:j] = b


@pytest.mark.parametrize(("k", "i", "j"), [(1, 0, 2), (2, 1, 3), (0, -2, 9), (-1, 2, 1)])
def test_parts_are_those_of_numpy(k: int, i: int, j: int) -> None:
    rng = np.random.default_rng(3)
    ours = [rng.random((3,) * axes) for axes in (1, 2, 3)]
    theirs = [array.copy() for array in ours]
    a, b, c = ours
    set_parts(a, b, c, k, i, j)
    python: Any = getattr(set_parts, "py_func", set_parts)
    python(*theirs, k, i, j)
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("i", "j"), [(0, 3), (1, 3), (-9, 2), (2, 1), (0, 9)])
@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_parts_of_other_lengths_are_refused_as_by_numpy(i: int, j: int, n: int) -> None:
    ours, given = np.arange(5.0), -np.arange(1.0, n + 1.0)
    theirs = ours.copy()
    try:
        theirs[i:j] = given
    except ValueError:
        with pytest.raises(ValueError, match=r"shape|broadcast"):
            set_part(ours, given, i, j)
    else:
        set_part(ours, given, i, j)
    np.testing.assert_array_equal(ours, theirs)
