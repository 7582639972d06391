"""Swing and twist against SciPy's rotations, and their derivatives against differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fsm.interactions import swing_twist
from fsm.interactions.hinge_spatial import measure_hinge_spatial
from fsm.interactions.swing_twist import (
    increments,
    product,
    relative_quaternion,
    second_increment,
    swing_slopes,
    twist_measure,
)
from fsm.kernels.rotation import exponential, multiply

ANGLE = st.floats(-3.0, 3.0)
HALF_WAY = pytest.mark.parametrize("half_way", [False, True], ids=["outer", "half-way"])


def scalar_first(rotation: Rotation) -> np.ndarray:
    return np.roll(rotation.as_quat(), 1)


def measures(q: np.ndarray, half_way: bool = False) -> np.ndarray:
    """(s1, psi, s3)."""
    s1, s3, _, _ = swing_slopes(tuple(q), half_way)
    return np.array([s1, twist_measure(q, np.empty(4), np.empty((4, 4))), s3])


def derivatives(q: np.ndarray, half_way: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Gradients (3, 4) and Hessians (3, 4, 4) of (s1, psi, s3)."""
    first, second = np.empty((3, 4)), np.empty((3, 4, 4))
    twist_measure(q, first[1], second[1])
    _, _, *slopes = swing_slopes(tuple(q), half_way)
    for k in range(2):
        swing_twist._fill(slopes[k], first[2 * k], second[2 * k])
    return first, second


def differences(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, h: float = 1e-3) -> np.ndarray:
    """Sixth-order differences; the last axis is that of `at`."""
    columns = []
    for move in h * np.eye(len(at)):
        d1, d2, d3 = (function(at + k * move) - function(at - k * move) for k in (1, 2, 3))
        columns.append((45 * d1 - 9 * d2 + d3) / (60 * h))
    return np.stack(columns, axis=-1)


@HALF_WAY
@settings(deadline=None)  # the first call compiles
@given(psi=st.floats(-3.1, 3.1), s1=st.floats(-1.5, 1.5), s3=st.floats(-1.5, 1.5))
def test_measures_are_what_scipy_composes(half_way: bool, psi: float, s1: float, s3: float) -> None:
    """With axes of the outer body the rotation is swing, twist; with half-way axes it is half twist, swing, half twist."""
    swing, twist = Rotation.from_rotvec([s1, 0, s3]), Rotation.from_rotvec([0, psi, 0])
    half = Rotation.from_rotvec([0, psi / 2, 0])
    q = scalar_first(half * swing * half if half_way else swing * twist)
    if q @ [np.cos(psi / 2), 0, np.sin(psi / 2), 0] < 0:  # the two quaternions of one rotation differ by a full turn
        q = -q
    np.testing.assert_allclose(measures(q, half_way), [s1, psi, s3], atol=1e-12)


@settings(deadline=None)
@given(psi=st.floats(-3.1, 3.1), s1=st.floats(-1.5, 1.5), s3=st.floats(-1.5, 1.5))
def test_half_way_measures_change_sign_where_the_bodies_change_places(psi: float, s1: float, s3: float) -> None:
    swing, half = Rotation.from_rotvec([s1, 0, s3]), Rotation.from_rotvec([0, psi / 2, 0])
    q = scalar_first(half * swing * half)
    np.testing.assert_allclose(measures(q * [1, -1, -1, -1], True), -measures(q, True), atol=1e-13)


def test_twist_goes_on_past_half_a_turn() -> None:
    """A quaternion that changes continuously extends the angle to a full turn in both directions."""
    angles = np.radians(np.linspace(-350, 350, 71))
    tilt = np.array([np.cos(0.05), np.sin(0.05), 0.0, 0.0])
    for angle in angles:
        half = angle / 2
        q = multiply(tilt, np.array([np.cos(half), 0.0, np.sin(half), 0.0]))
        assert measures(q)[1] == pytest.approx(angle, abs=1e-13)


@pytest.mark.parametrize("start", [160.0, -160.0, 0.0])
def test_hinge_angle_past_180_degrees(start: float) -> None:
    """A hinge anchored at +-160 degrees is followed to 340 without a jump; SciPy gives the same angle modulo 360."""
    half = np.radians(start) / 2
    anchored = np.array([[np.cos(half), 0.0, -np.sin(half), 0.0]])
    axes, bodies, offset = np.array([[1.0, 0, 0, 0]]), np.array([[1, 0]]), np.array([2 * half])
    turn = np.radians(-20 if start > 0 else 20)  # the other body is turned too
    for angle in np.radians(start + np.linspace(-180, 180, 37)[1:-1]):
        poses = np.zeros((2, 7))
        poses[0, 3:] = exponential(np.array([0.0, turn, 0.0]))
        # as the integrator leaves it: continuous from the start
        poses[1, 3:] = multiply(poses[0, 3:], exponential(np.array([0.0, angle, 0.0])))
        value, _, gradient = measure_hinge_spatial(poses, np.zeros((2, 6)), bodies, anchored, axes, offset)
        assert value[0] == pytest.approx(angle, abs=1e-12)
        np.testing.assert_allclose(gradient[0, 0], [0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -1, 0], atol=1e-12)


@HALF_WAY
@pytest.mark.parametrize("seed", range(20))
def test_gradients_and_hessians(seed: int, half_way: bool) -> None:
    rng = np.random.default_rng(seed)
    swing = rng.uniform(0.4, 2.0) * np.array([np.cos(seed), 0.0, np.sin(seed)])
    q = scalar_first(Rotation.from_rotvec(swing) * Rotation.from_rotvec([0, rng.uniform(-3, 3), 0]))
    first, second = derivatives(q, half_way)
    np.testing.assert_allclose(first, differences(lambda p: measures(p, half_way), q), rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(second, differences(lambda p: derivatives(p, half_way)[0], q), rtol=1e-8, atol=1e-8)


@HALF_WAY
@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 0.05, 0.28, 0.29])
def test_derivatives_near_zero_swing(size: float, half_way: bool) -> None:
    """At rotations only, because the functions are used only there; swings from none to beyond the switch of the series
    (0.283 rad)."""
    q = scalar_first(Rotation.from_rotvec([0.6 * size, 0, 0.8 * size]) * Rotation.from_rotvec([0, 2.0, 0]))

    def moved(step: np.ndarray) -> np.ndarray:
        return multiply(q, exponential(step))

    along = np.empty((6, 4))
    increments(q, along)
    first, second = derivatives(q, half_way)
    np.testing.assert_allclose(
        first @ along[:3].T, differences(lambda step: measures(moved(step), half_way), np.zeros(3)), atol=1e-9
    )

    def rates(step: np.ndarray) -> np.ndarray:
        table = np.empty((6, 4))
        increments(moved(step), table)
        return derivatives(moved(step), half_way)[0] @ table[:3].T

    exact = np.einsum("kmn,im,jn->kij", second, along[:3], along[:3])
    change = np.empty(4)
    for i in range(3):
        for j in range(3):
            second_increment(i, j, along, change)
            exact[:, i, j] += first @ change
    np.testing.assert_allclose(exact, differences(rates, np.zeros(3)), atol=1e-8)


def test_both_sides_of_the_series_switch_agree() -> None:
    below, above = swing_twist._stretch(1 - 0.02 + 1e-12), swing_twist._stretch(1 - 0.02 - 1e-12)
    np.testing.assert_allclose(below, above, rtol=2e-11)
    # f = 2 acos(n)/sqrt(1 - n^2) = 2 a/sin(a) with n = cos(a): 2 (1 + a^2/6 + 7 a^4/360 + 31 a^6/15120) next to 1
    for a in (1e-3, 1e-2, 5e-2):
        value, first, _ = swing_twist._stretch(np.cos(a))
        assert value == pytest.approx(2 * (1 + a**2 / 6 + 7 * a**4 / 360 + 31 * a**6 / 15120), rel=1e-11)
        assert first == pytest.approx(2 * (np.sin(a) - a * np.cos(a)) / np.sin(a) ** 2 / -np.sin(a), rel=1e-6)


@given(st.lists(st.floats(-1, 1), min_size=12, max_size=12))
def test_increments_are_the_derivatives_of_the_relative_quaternion(numbers: list[float]) -> None:
    a, b, c = (exponential(2 * np.array(numbers[i : i + 3])) for i in (0, 3, 6))
    d = exponential(np.array(numbers[9:]))
    pose_a, pose_b = np.concatenate([np.zeros(3), a]), np.concatenate([np.zeros(3), b])

    def relative(step: np.ndarray) -> np.ndarray:
        """Increments in joint axes: body increments turned by the axes."""
        moved_a = np.concatenate([np.zeros(3), multiply(multiply(a, c), exponential(step[:3]))])
        moved_b = np.concatenate([np.zeros(3), multiply(multiply(b, d), exponential(step[3:]))])
        out = np.empty(4)
        one = np.array([1.0, 0, 0, 0])
        relative_quaternion(moved_a, moved_b, one, one, np.empty((2, 4)), out)
        return out

    q, with_axes = relative(np.zeros(6)), np.empty(4)
    relative_quaternion(pose_a, pose_b, c, d, np.empty((2, 4)), with_axes)
    np.testing.assert_allclose(with_axes, q, atol=1e-14)
    table = np.empty((6, 4))
    increments(q, table)
    np.testing.assert_allclose(table.T, differences(relative, np.zeros(6)), atol=1e-10)


@given(st.lists(st.floats(-3, 3), min_size=6, max_size=6))
def test_product_is_scipys(numbers: list[float]) -> None:
    p, r = (Rotation.from_rotvec(numbers[i : i + 3]) for i in (0, 3))
    out = np.empty(4)
    product(scalar_first(p), scalar_first(r), out)
    wanted = scalar_first(p * r)
    np.testing.assert_allclose(out * np.sign(out @ wanted), wanted, atol=1e-14)
