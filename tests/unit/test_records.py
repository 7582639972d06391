"""Records and elements of arrays in kernels, against NumPy and Python."""

import sys
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.records import record, replaced


class Pair(NamedTuple):
    first: np.ndarray
    second: float


@record
class Inner(NamedTuple):
    rows: np.ndarray
    on: bool


@record
class Model(NamedTuple):
    values: np.ndarray
    table: np.ndarray
    number: int
    pair: Pair
    inner: Inner
    absent: Any
    size: float


@kernel
def total(model: Model) -> float:
    found: float = model.values.sum() + model.number * model.size + model.pair.first[-1] * model.pair.second
    if model.inner.on:
        found += model.inner.rows[1, 2] + model.table[2]
    return found


@kernel
def changed(model: Model, values: np.ndarray, rows: np.ndarray) -> tuple[float, float]:
    """Total with other fields, and of the model itself, which stays as it is."""
    other = replaced(replaced(model, "values", values), "inner", replaced(model.inner, "rows", rows))
    return total(other), total(model)


@kernel
def write(model: Model) -> None:
    model.values[-2] = 7.0
    model.inner.rows[0][1] = 8.0


def test_kernels_read_and_write_the_fields_of_records() -> None:
    pair, inner = Pair(np.array([1.0, 2.0]), 0.5), Inner(np.arange(6.0).reshape(2, 3), True)
    model = Model(np.arange(4.0), np.array([5, 6, 7]), 3, pair, inner, None, 1.5)
    whole = 6.0 + 4.5 + 1.0 + 5.0 + 7.0
    assert total(model) == whole
    values, rows = np.full(2, 10.0), np.full((4, 3), 20.0)
    assert changed(model, values, rows) == (whole - 6.0 + 20.0 - 5.0 + 20.0, whole)
    write(model)
    assert model.values[2] == 7.0 and model.inner.rows[0, 1] == 8.0


def test_a_call_with_a_record_keeps_no_array() -> None:
    """A worker that solves thousands of cases would keep all their arrays."""
    pair, inner = Pair(np.ones(2), 0.5), Inner(np.ones((2, 3)), True)
    model = Model(np.ones(4), np.arange(3), 3, pair, inner, None, 1.5)
    arrays = [model.values, model.table, pair.first, inner.rows]
    before = [sys.getrefcount(array) for array in arrays]
    for _ in range(5):
        total(model)
    assert [sys.getrefcount(array) for array in arrays] == before


@kernel
def elements(a: np.ndarray, b: np.ndarray, c: np.ndarray, i: int, j: int, k: int, found: np.ndarray) -> None:
    found[0], found[1], found[2] = a[i], b[i, j], c[i, j, k]
    found[3], found[4], found[5] = b[i][j], c[i, j][k], c[i][j, k]
    found[6], found[7], found[8] = a[-1], b[0, -2], c[:, j, k][i]
    b[i, j] += 1.0
    c[j] = 2.0
    c[i, k, :2] = 3.0


def test_elements_and_rows_are_those_of_numpy() -> None:
    generator = np.random.default_rng(5)
    for order in ("C", "F"):
        for _ in range(20):
            a, b, c = generator.random(3), generator.random((3, 3)), generator.random((3, 3, 3))
            b, c = np.asarray(b, order=order), np.asarray(c, order=order)
            i, j, k = (int(one) for one in generator.integers(-3, 3, 3))
            found, expected = np.zeros(9), np.zeros(9)
            own = a.copy(), b.copy(order="K"), c.copy(order="K")
            elements(a, b, c, i, j, k, found)
            getattr(elements, "py_func", elements)(*own, i, j, k, expected)
            assert np.array_equal(found, expected)
            assert np.array_equal(b, own[1])
            assert np.array_equal(c, own[2])
