"""Shape functions of the ANCF elements: values at the nodes, sums, the printed formulas."""

from __future__ import annotations

import numpy as np

from fsm.model.nodes.shape import CORNERS, cable_shape, gauss, membrane_shape


def printed(x: np.ndarray, y: np.ndarray, b: float, c: float) -> np.ndarray:
    """The 12 published functions of nodes A, B, D, C, sorted as A, B, C, D."""
    a_ = [
        -(x - 1) * (y - 1) * (2 * x**2 + 2 * y**2 - x - y - 1), -b * x * (x - 1) ** 2 * (y - 1),
        -c * y * (x - 1) * (y - 1) ** 2,
    ]  # fmt: skip
    b_ = [x * (y - 1) * (2 * x**2 + 2 * y**2 - 3 * x - y), -b * x**2 * (x - 1) * (y - 1), c * x * y * (y - 1) ** 2]
    d_ = [y * (x - 1) * (2 * x**2 + 2 * y**2 - x - 3 * y), b * x * y * (x - 1) ** 2, -c * y**2 * (x - 1) * (y - 1)]
    c_ = [-x * y * (1 - 3 * x - 3 * y + 2 * x**2 + 2 * y**2), b * x**2 * y * (x - 1), c * x * y**2 * (y - 1)]
    return np.stack([*a_, *b_, *c_, *d_], axis=-1)


def test_membrane_functions_are_the_printed_ones() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.random(20), rng.random(20)
    np.testing.assert_allclose(membrane_shape(x, y, 0.3, 0.7), printed(x, y, 0.3, 0.7), atol=1e-14)


def test_membrane_functions_at_the_nodes() -> None:
    b, c = 0.3, 0.7
    rows = [membrane_shape(*corner, b, c, d) for corner in CORNERS for d in ((0, 0), (1, 0), (0, 1))]
    np.testing.assert_allclose(np.array(rows), np.eye(12), atol=1e-14)


def test_membrane_reproduces_its_twelve_terms() -> None:
    b, c = 0.4, 0.25
    powers = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (3, 1), (1, 3)]
    rng = np.random.default_rng(1)
    x, y = rng.random(10), rng.random(10)
    for i, j in powers:
        nodal = []
        for u, v in CORNERS * [b, c]:
            nodal += [u**i * v**j, i * u ** max(i - 1, 0) * v**j, j * u**i * v ** max(j - 1, 0)]
        np.testing.assert_allclose(membrane_shape(x, y, b, c) @ nodal, (b * x) ** i * (c * y) ** j, atol=1e-14)


def test_positions_sum_to_one_and_derivatives_to_zero() -> None:
    x, y = np.random.default_rng(2).random((2, 10))
    np.testing.assert_allclose(membrane_shape(x, y)[:, ::3].sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(membrane_shape(x, y, derivative=(1, 1))[:, ::3].sum(axis=1), 0.0, atol=1e-13)
    np.testing.assert_allclose(cable_shape(x)[:, ::2].sum(axis=1), 1.0, atol=1e-14)


def test_derivatives_are_those_of_the_functions() -> None:
    h = 1e-6
    x, y, b, c = 0.3, 0.6, 0.4, 0.5
    for d, ahead, behind in (((1, 0), (x + h, y), (x - h, y)), ((0, 1), (x, y + h), (x, y - h))):
        side = b if d == (1, 0) else c
        slope = (membrane_shape(*ahead, b, c) - membrane_shape(*behind, b, c)) / (2 * h * side)
        np.testing.assert_allclose(membrane_shape(x, y, b, c, d), slope, atol=1e-8)
    second = (membrane_shape(x + h, y, b, c, (1, 0)) - membrane_shape(x - h, y, b, c, (1, 0))) / (2 * h * b)
    np.testing.assert_allclose(membrane_shape(x, y, b, c, (2, 0)), second, atol=1e-7)
    bend = (cable_shape(x + h, 0.7, 1) - cable_shape(x - h, 0.7, 1)) / (2 * h * 0.7)
    np.testing.assert_allclose(cable_shape(x, 0.7, 2), bend, atol=1e-7)


def test_cable_functions_are_the_printed_ones() -> None:
    x, length = np.linspace(0, 1, 7), 0.8
    wanted = [1 - 3 * x**2 + 2 * x**3, length * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, length * (x**3 - x**2)]
    np.testing.assert_allclose(cable_shape(x, length), np.stack(wanted, axis=-1), atol=1e-14)


def test_gauss_points_integrate_what_they_promise() -> None:
    points, weights = gauss(4)
    np.testing.assert_allclose(weights @ points**7, 1 / 8, rtol=1e-13)
    assert abs(weights @ points**8 - 1 / 9) > 1e-6
