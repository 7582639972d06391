"""Shortcuts through numba's compiler give the results of the functions that they replace."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from llvmlite import ir as llvm_ir
from numba.core import compiler, cpu, registry, types

from fsm.kernels.shortcuts import shortcuts

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="without the compiler there are no shortcuts")


def _several(x: np.ndarray, n: int) -> float:
    total, pair = 0.0, (n, 2 * n)
    for i in range(n):
        x[i : i + 1, 0] += max(total, x[i, 0], *pair)
        if x[i, 0] < n:
            raise ValueError("small")
        total = -x[i, 0] if total else x.sum(axis=0)[0]
    return total


def test_variables_of_statements() -> None:
    with shortcuts():
        pass
    code = compiler.run_frontend(_several)
    statements = [one for block in code.blocks.values() for one in block.body]
    assert len(statements) > 50
    for one in statements:
        assert one.list_vars() == one._rec_list_vars(one.__dict__)
        if (value := getattr(one, "value", None)).__class__.__name__ == "Expr":
            assert value.list_vars() == value._rec_list_vars(value._kws)


def test_options_and_sizes() -> None:
    with shortcuts():
        pass
    one, other = compiler.Flags(), compiler.Flags()
    assert one == other and hash(one) == hash(other)
    other.nrt = not one.nrt
    assert one != other
    other.nrt = one.nrt  # now set, to the default
    assert one == other and hash(one) == hash(other)
    context: cpu.CPUContext = registry.cpu_target.target_context
    for bits, kind in ((8, np.int8), (32, np.int32), (64, np.int64), (8, np.int8)):
        assert context.get_abi_sizeof(llvm_ir.IntType(bits)) == np.dtype(kind).itemsize
    array = context.get_value_type(types.Array(types.float64, 2, "C"))
    assert context.get_abi_sizeof(array) == context.get_abi_sizeof(array) == 9 * 8


def test_operators_and_parts_of_arrays() -> None:
    with shortcuts():
        sums = numba.njit(lambda a, b: a + b)
        np.testing.assert_array_equal(sums(np.ones(3), 2), np.full(3, 3.0))
        assert sums(1, 2.5) == 3.5

        @numba.njit
        def fill(x: np.ndarray, rows: np.ndarray, part: np.ndarray) -> None:
            x[rows] = part

        x = np.zeros(4)
        fill(x, np.array([1, 3]), np.array([5.0, 6.0]))
        np.testing.assert_array_equal(x, [0.0, 5.0, 0.0, 6.0])
        with pytest.raises(ValueError, match="does not fit"):
            fill(x, np.array([1, 3]), np.ones(3))
