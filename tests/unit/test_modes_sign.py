"""Signs of modes."""

from __future__ import annotations

import numpy as np

from fsm.solve.equations.linear import first_of_largest


def test_equal_entries_give_the_first() -> None:
    """Round-off of a symmetric mode does not choose between its two ends."""
    assert first_of_largest(np.array([0.3, 1.0 - 1e-12, 0.5, 1.0])) == 1
    assert first_of_largest(np.array([[1.0, 1.0 + 1e-12], [0.9, 1.0]])).tolist() == [0, 1]
