"""Linear equations with a small dense matrix."""

from __future__ import annotations

import numpy as np

from fsm.kernels.jit import kernel


@kernel
def solve_dense(matrix: np.ndarray, right: np.ndarray) -> bool:
    """Overwrite right sides (n, m) by the solutions, and the matrix (n, n); false, with NaN, if it is singular."""
    size, many = right.shape
    for k in range(size):
        row = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[row, k]):
                row = i
        if not abs(matrix[row, k]) > 0.0:
            right[:] = np.nan
            return False
        if row != k:
            for j in range(size):
                matrix[k, j], matrix[row, j] = matrix[row, j], matrix[k, j]
            for j in range(many):
                right[k, j], right[row, j] = right[row, j], right[k, j]
        for i in range(k + 1, size):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, size):
                    matrix[i, j] -= factor * matrix[k, j]
                for j in range(many):
                    right[i, j] -= factor * right[k, j]
    for k in range(size - 1, -1, -1):
        for j in range(many):
            total = right[k, j]
            for i in range(k + 1, size):
                total -= matrix[k, i] * right[i, j]
            right[k, j] = total / matrix[k, k]
    return True
