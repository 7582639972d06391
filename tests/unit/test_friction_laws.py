"""Every friction law: derivatives against central differences, direction, bounds, dissipation; bristles that hold."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fsm.case.models.contact import FRICTION_KEYS, Friction
from fsm.laws.friction import FRICTION_LAWS
from fsm.laws.friction.lugre import _mean_decay

MU_S, MU_D, V_S, V_D, V_STRIBECK, PRESLIDING = 0.3, 0.2, 1e-3, 1e-2, 5e-3, 1e-5
CASES = {
    "step": Friction(law="step", mu_static=MU_S, mu_dynamic=MU_D, v_static=V_S, v_dynamic=V_D),
    "tanh": Friction(law="tanh", mu_dynamic=MU_D, v_static=V_S),
    "stribeck": Friction(law="stribeck", mu_static=MU_S, mu_dynamic=MU_D, v_static=V_S, v_stribeck=V_STRIBECK),
    "viscous": Friction(
        law="stribeck", mu_static=MU_S, mu_dynamic=MU_D, v_static=V_S, v_stribeck=V_STRIBECK, viscous=0.5
    ),
}
LUGRE = Friction(law="lugre", mu_static=MU_S, mu_dynamic=MU_D, v_stribeck=V_STRIBECK, presliding=PRESLIDING)
SIGMA_0 = MU_S / PRESLIDING
instantaneous = pytest.mark.parametrize("friction", CASES.values(), ids=CASES.keys())
components = pytest.mark.parametrize("c", [1, 3], ids=["plane", "space"])


def evaluate(friction: Friction, slip: np.ndarray, normal: np.ndarray | float = 1.0) -> tuple[np.ndarray, ...]:
    law = FRICTION_LAWS[friction.law]
    normal = np.broadcast_to(np.asarray(normal, float), len(slip)).copy()
    return law.effort(np.ascontiguousarray(slip, float), normal, law.params(friction))


def bristles(
    slip: Any,
    before: Any,
    deflection: Any,
    duration: float,
    normal: Any = 1.0,
    friction: Friction = LUGRE,
    weight: float = 0.5,
) -> tuple[np.ndarray, ...]:
    arrays = [np.atleast_2d(np.asarray(a, float)) for a in (slip, before, deflection)]
    normals = np.broadcast_to(np.asarray(normal, float), len(arrays[0])).copy()
    law = FRICTION_LAWS["lugre"]
    mean = weight * arrays[0] + (1.0 - weight) * arrays[1]
    effort, by_slip, by_mean, by_normal, bent = law.effort(
        arrays[0], mean, normals, arrays[2], duration, law.params(friction)
    )
    return effort, by_slip + weight * by_mean, by_normal, bent


def coefficient(friction: Friction, speed: float) -> float:
    return float(evaluate(friction, np.array([[speed]]))[0][0, 0])


def sliding(speed: float) -> float:
    return MU_D + (MU_S - MU_D) * float(np.exp(-((speed / V_STRIBECK) ** 2)))


def slips(seed: int, c: int, count: int = 500) -> np.ndarray:
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(count, c))
    return 10 ** rng.uniform(-6, -0.5, (count, 1)) * direction / np.linalg.norm(direction, axis=1, keepdims=True)


def differences(function: Any, at: np.ndarray, step: np.ndarray) -> np.ndarray:
    """d f_c/d x_k of every row, (m, c, k), by a fourth-order difference."""
    columns = []
    for k in range(at.shape[1]):
        h = np.zeros(at.shape)
        h[:, k] = step
        f = [function(at + n * h) for n in (-2, -1, 1, 2)]
        columns.append((8 * (f[2] - f[1]) - (f[3] - f[0])) / (12 * step[:, None]))
    return np.stack(columns, axis=2)


def test_the_scene_knows_the_same_laws() -> None:
    assert list(FRICTION_LAWS) == list(FRICTION_KEYS)
    assert [name for name, law in FRICTION_LAWS.items() if law.bristle] == ["lugre"]


# laws of the speed alone --------------------------------------------------------------------------------------


@instantaneous
@components
def test_derivatives(friction: Friction, c: int) -> None:
    """On both sides of v_static and v_dynamic."""
    slip = slips(1, c)
    speed = np.linalg.norm(slip, axis=1)
    for edge in (V_S, V_D):
        slip = slip[np.abs(speed / edge - 1) > 5e-3]
        speed = np.linalg.norm(slip, axis=1)
    assert min(np.sum(speed < V_S), np.sum((speed > V_S) & (speed < V_D)), np.sum(speed > V_D)) > 50
    normal = np.random.default_rng(2).uniform(0.1, 10, len(slip))
    effort, by_slip, by_normal = evaluate(friction, slip, normal)
    found = differences(lambda s: evaluate(friction, s, normal)[0], slip, 1e-3 * speed)
    allowed = 1e-9 * np.abs(by_slip).max(axis=(1, 2)) + 1e-13 * np.linalg.norm(effort, axis=1) / (1e-3 * speed)
    assert np.all(np.abs(found - by_slip) <= allowed[:, None, None])
    np.testing.assert_allclose(by_normal, effort / normal[:, None], rtol=1e-13)


@instantaneous
@components
def test_effort_has_the_direction_of_the_slip_and_its_size_is_that_of_the_plane(friction: Friction, c: int) -> None:
    slip = slips(3, c)
    speed = np.linalg.norm(slip, axis=1)
    effort, _, _ = evaluate(friction, slip, 5.0)
    mu = np.array([coefficient(friction, v) for v in speed])
    assert np.all(mu > 0)
    np.testing.assert_allclose(effort, 5.0 * (mu / speed)[:, None] * slip, rtol=1e-12)
    most = (MU_D if friction.law == "tanh" else MU_S) * (1 + 1e-15)
    assert np.all(mu - friction.viscous * speed <= most)


@instantaneous
@components
def test_smooth_through_rest(friction: Friction, c: int) -> None:
    """At rest the effort vanishes, and the derivative is that of the coefficient in all directions, as at small speeds."""
    effort, by_slip, by_normal = evaluate(friction, np.zeros((1, c)), 5.0)
    assert not effort.any() and not by_normal.any()
    steepness = coefficient(friction, 1e-5 * V_S) / (1e-5 * V_S)
    np.testing.assert_allclose(by_slip[0], 5.0 * steepness * np.eye(c), rtol=1e-8)
    for speed in (1e-300, 1e-15, 1e-9):
        _, near, _ = evaluate(friction, np.full((1, c), speed), 5.0)
        np.testing.assert_allclose(near, by_slip, rtol=1e-8, atol=1e-8 * 5 * steepness)


@pytest.mark.parametrize("edge", [V_S, V_D])
def test_steps_join_smoothly(edge: float) -> None:
    below, above = (evaluate(CASES["step"], np.array([[edge * (1 + side * 1e-9)]])) for side in (-1, 1))
    assert below[0][0, 0] == pytest.approx(above[0][0, 0], rel=1e-8)
    assert max(abs(below[1][0, 0, 0]), abs(above[1][0, 0, 0])) < 1e-8 * MU_S / V_S


def test_values() -> None:
    for speed, mu in ((0.5 * V_S, MU_S * 0.6875), (V_S, MU_S), (5.5 * V_S, 0.25), (V_D, MU_D), (1.0, MU_D)):
        assert coefficient(CASES["step"], speed) == pytest.approx(mu, rel=1e-12)
    assert coefficient(CASES["tanh"], 0.5 * V_S) == pytest.approx(MU_D * np.tanh(0.5), rel=1e-13)
    for speed in (1e-4, 2e-3, 2e-2):
        mu = sliding(speed) * np.tanh(speed / V_S)
        assert coefficient(CASES["stribeck"], speed) == pytest.approx(mu, rel=1e-13)
        assert coefficient(CASES["viscous"], speed) == pytest.approx(mu + 0.5 * speed, rel=1e-13)


# bristles -----------------------------------------------------------------------------------------------------


@components
@pytest.mark.parametrize("duration", [0.0, 1e-5, 1e-3, 1e-1])
@pytest.mark.parametrize("weight", [0.5, 1.0])
def test_derivatives_of_bristles(c: int, duration: float, weight: float) -> None:
    """Steps much shorter and much longer than bristles need to yield; the bristles are partly bent in any direction
    before."""
    rng = np.random.default_rng(4)
    friction = LUGRE.model_copy(update={"viscous": 0.3})
    slip, before = slips(5, c), slips(6, c)
    mean = weight * slip + (1.0 - weight) * before
    speed = np.minimum(np.linalg.norm(slip, axis=1), 2.0 * np.linalg.norm(mean, axis=1))
    deflection = PRESLIDING * rng.uniform(-0.5, 0.5, slip.shape)
    normal = rng.uniform(0.1, 10, len(slip))

    def effort(s: np.ndarray) -> np.ndarray:
        return bristles(s, before, deflection, duration, normal, friction, weight)[0]

    value, by_slip, by_normal, _ = bristles(slip, before, deflection, duration, normal, friction, weight)
    # short, since the law is C1 only where bristles begin to give way
    found = differences(effort, slip, 1e-4 * speed)
    allowed = 1e-7 * np.abs(by_slip).max(axis=(1, 2)) + 1e-12 * np.linalg.norm(value, axis=1) / (1e-4 * speed)
    assert np.all(np.abs(found - by_slip) <= allowed[:, None, None])
    np.testing.assert_allclose(by_normal, value / normal[:, None], rtol=1e-13)


@pytest.mark.parametrize("bent", [0.0, 0.6, 1.0])
def test_derivative_at_rest_is_that_of_springs(bent: float) -> None:
    h, z = 1e-4, bent * PRESLIDING
    effort = [bristles([v], [0.0], [z], h)[0][0, 0] for v in (-1e-9, 0.0, 1e-9)]
    ahead, back = (effort[2] - effort[1]) / 1e-9, (effort[1] - effort[0]) / 1e-9
    assert bristles([0.0], [0.0], [z], h)[1][0, 0, 0] == pytest.approx(back, rel=1e-4)
    assert bent == 1.0 or ahead == pytest.approx(back, rel=1e-4)
    if bent == 1.0:  # at mu_s the bristles yield forwards; backwards they keep their stiffness, except for their damping
        assert back == pytest.approx(0.5 * SIGMA_0 * h + MU_D / V_STRIBECK, rel=1e-4)
        assert abs(ahead) < 1e-4 * back


def test_bristles_are_springs_first() -> None:
    z = 1e-4 * PRESLIDING
    for duration in (1e-6, 1e-3, 1.0):
        mean = z / duration
        effort, _, _, bent = bristles([0.0], [2 * mean], [0.0], duration, 7.0)
        assert bent[0, 0] == pytest.approx(z, rel=1e-4, abs=0.0)
        # back at rest, only the springs act
        assert effort[0, 0] == pytest.approx(7.0 * SIGMA_0 * z, rel=1e-4)


@pytest.mark.parametrize("speed", [1e-4, 3e-3, 1e-1])
def test_bristles_slide_on_the_curve_of_stribeck(speed: float) -> None:
    friction = LUGRE.model_copy(update={"viscous": 0.5})
    slip = speed * np.array([[0.6, 0.0, -0.8]])
    effort, _, _, bent = bristles(slip, slip, np.zeros((1, 3)), 100 * PRESLIDING / speed, 7.0, friction)
    np.testing.assert_allclose(effort, 7.0 * (sliding(speed) + 0.5 * speed) * slip / speed, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(bent, sliding(speed) / SIGMA_0 * slip / speed, rtol=1e-9, atol=1e-20)


def test_one_step_of_constant_slip_is_exact() -> None:
    """Springs and yielding bristles: one step equals many short steps, and the rate equation."""
    slip = np.array([[2e-3, 0.0, -1e-3]])
    speed = float(np.linalg.norm(slip))
    held = sliding(speed) / SIGMA_0
    for start, duration in ((PRESLIDING * np.array([[-0.2, 0.1, 0.1]]), 2e-3), (held * slip / speed, 5e-3)):
        whole = bristles(slip, slip, start, duration)[3]
        parts = start
        for _ in range(50):
            parts = bristles(slip, slip, parts, duration / 50)[3]
        np.testing.assert_allclose(parts, whole, rtol=1e-12)
        gives_way = 1.0 if np.linalg.norm(start) > 0.9 * held else 0.0

        def rate(t: float, z: np.ndarray, gives_way: float = gives_way) -> np.ndarray:
            return slip[0] - gives_way * SIGMA_0 * speed / sliding(speed) * z

        wanted = solve_ivp(rate, (0, duration), start[0], method="DOP853", rtol=1e-12, atol=1e-20).y[:, -1]
        np.testing.assert_allclose(whole[0], wanted, rtol=1e-9, atol=1e-14 * PRESLIDING)


def test_mean_decay_on_both_sides_of_its_series() -> None:
    """(1 - exp(-x))/x and its slope, the latter by the sum of -(-x)^(k-1) k/(k+1)!."""
    for x in (0.0, 1e-8, 9.99e-4, 1.001e-3, 0.3):
        value, slope = _mean_decay(x)
        assert value == pytest.approx(math.fsum((-x) ** k / math.factorial(k + 1) for k in range(25)), rel=1e-13)
        wanted = math.fsum(-((-x) ** (k - 1)) * k / math.factorial(k + 1) for k in range(1, 25))
        assert slope == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(("part", "order", "slack"), [(0.15, 2.0, 0.1), (0.8, 1.0, 0.15)], ids=["springs", "give way"])
def test_order_of_steps(part: float, order: float, slack: float) -> None:
    """Slip 5 mm/s sin(200 t), error against SciPy: of second order for springs, of first order for yielding bristles."""

    def slip(t: float) -> float:
        return 5e-3 * float(np.sin(200 * t))

    def rate(t: float, z: np.ndarray) -> np.ndarray:
        reach = np.where(slip(t) * z > 0.0, np.clip((SIGMA_0 * abs(z) / sliding(slip(t)) - 0.8) / 0.2, 0.0, 1.0), 0.0)
        return slip(t) - reach * reach * (3.0 - 2.0 * reach) * SIGMA_0 * abs(slip(t)) / sliding(slip(t)) * z

    end = part * np.pi / 200
    wanted = solve_ivp(rate, (0, end), [0.0], method="DOP853", rtol=1e-12, atol=1e-20).y[0, -1]
    errors = []
    for steps in (400, 800, 1600):
        z, h = np.zeros((1, 1)), end / steps
        for i in range(steps):
            z = bristles([slip((i + 1) * h)], [slip(i * h)], z, h)[3]
        errors.append(abs(z[0, 0] - wanted))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, order, atol=slack)


@components
def test_bristles_bend_no_further_than_presliding(c: int) -> None:
    rng = np.random.default_rng(7)
    z, before = np.zeros((200, c)), np.zeros((200, c))
    for i in range(300):
        slip = slips(8 + i, c, 200)
        z = bristles(slip, before, z, 10 ** rng.uniform(-6, 0))[3]
        before = slip
        assert np.linalg.norm(z, axis=1).max() <= PRESLIDING * (1 + 1e-12)
    assert np.linalg.norm(z, axis=1).max() > 0.3 * PRESLIDING


def test_without_time_nothing_bends() -> None:
    z = PRESLIDING * np.array([[0.3, -0.2, 0.1]])
    assert np.array_equal(bristles([[1.0, 2.0, 3.0]], [[0.0, 0.0, 0.0]], z, 0.0)[3], z)


@pytest.mark.parametrize("part", [0.0, 0.5, 1.0])
def test_bristles_take_energy_out(part: float) -> None:
    """f v is never less than the rate of the springs' energy, up to the largest damping that the scene allows."""
    most = 9.3 * MU_D / V_STRIBECK
    friction = LUGRE.model_copy(update={"bristle_damping": part * most})
    slip = slips(9, 3, 20000)
    z = PRESLIDING * np.random.default_rng(10).uniform(-1, 1, slip.shape) / np.sqrt(3)
    speed = np.linalg.norm(slip, axis=1)
    effort = bristles(slip, slip, z, 0.0, 1.0, friction)[0]
    g = MU_D + (MU_S - MU_D) * np.exp(-((speed / V_STRIBECK) ** 2))
    stored = SIGMA_0 * np.sum(z * (slip - (SIGMA_0 * speed / g)[:, None] * z), axis=1)
    taken = np.sum(effort * slip, axis=1)
    assert np.all(taken - stored >= -1e-12 * (np.abs(taken) + np.abs(stored)))
    if part == 1.0:  # ten times this damping would violate the bound
        effort = bristles(slip, slip, z, 0.0, 1.0, friction.model_copy(update={"bristle_damping": 10 * most}))[0]
        assert np.any(np.sum(effort * slip, axis=1) < stored - 1e-6 * np.abs(stored))


def test_default_damping_of_bristles() -> None:
    law = FRICTION_LAWS["lugre"]
    assert law.params(LUGRE)[4] == pytest.approx(MU_D / V_STRIBECK)
    assert law.params(LUGRE)[3] == pytest.approx(MU_S / PRESLIDING)
