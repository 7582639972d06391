"""Functions of time as pieces: values against formulas and SciPy, derivatives, integrals, and travels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from fsm.case.models.time_program import Constant, Cycle, Ramp, Table, TimeFunction, steepest
from fsm.kernels.programs import half_sine, program_at, ramp, rectangle, sampled, table_of
from fsm.model.bodies.drive import Travel, parts, run_up, time_function

TABLE = Table(kind="table", time=(1.0, 2.0, 4.0, 5.0), value=(0.0, 1.0, -1.0, 0.5), interpolation="smooth")
FUNCTIONS = (
    Constant(),
    Ramp(kind="ramp", start=1.0, end=3.0),
    Ramp(kind="ramp", start=1.0, end=3.0, shape="linear"),
    Ramp(kind="ramp", start=1.0, end=3.0, shape="unbounded"),
    TABLE,
    TABLE.model_copy(update={"interpolation": "linear"}),
    Cycle(kind="cycle", period=2.0, start=0.5, cycles=2.3),
    Cycle(kind="cycle", period=2.0, start=0.5, cycles=2.3, form="alternating"),
    Cycle(kind="cycle", period=2.0, form="alternating"),
)
PROGRAMS = {
    **{f"{f.kind} {number}": time_function(f) for number, f in enumerate(FUNCTIONS)},
    "pulse": half_sine(1.5, 0.7), "linear": ramp(2.5, 0.7), "samples": sampled((0.7, 1.5, 3.0), (0.0, 2.0, 0.0)),
    "pull": run_up(0.5, 1.2, 0.3),
    "there and back": parts([(0.2, 1.0, run_up(0.5, 1.2, 0.3)), (3.4, -1.0, run_up(0.4, 0.6, 0.1))]),
}  # fmt: skip
QUARTIC = "pull", "there and back"


def formula(function: TimeFunction, t: np.ndarray) -> np.ndarray:
    """Values of a function of time, without pieces."""
    if isinstance(function, Constant):
        return np.ones(len(t))
    if isinstance(function, Ramp):
        x = (t - function.start) / (function.end - function.start)
        x = x if function.shape == "unbounded" else np.clip(x, 0.0, 1.0)
        return x * x * (3.0 - 2.0 * x) if function.shape == "smooth" else x
    if isinstance(function, Cycle):
        turns = np.clip((t - function.start) / function.period, 0.0, function.cycles)
        wave = 2.0 * np.pi * turns
        return 0.5 * (1.0 - np.cos(wave)) if function.form == "pulsating" else np.sin(wave)
    if function.interpolation != "smooth":
        return np.interp(t, function.time, function.value)
    rates = PchipInterpolator(function.time, function.value).derivative()(function.time)
    rates[[0, -1]] = 0.0
    return CubicHermiteSpline(function.time, function.value, rates)(np.clip(t, function.time[0], function.time[-1]))


@pytest.mark.parametrize("function", FUNCTIONS, ids=range(len(FUNCTIONS)))
def test_values(function: TimeFunction) -> None:
    """Values between the breaks, at them and next to them; compiled steps get the same ones."""
    program = time_function(function)
    near = [np.nextafter(t, way) for t in program.breaks() for way in (-np.inf, np.inf)]
    times = np.array([*np.linspace(-1.0, 6.0, 141), *program.breaks(), *near])
    found = np.array([program.at(t)[0] for t in times])
    np.testing.assert_allclose(found, formula(function, times), rtol=0.0, atol=1e-13)
    table = table_of([run_up(1.0, 1.0, 0.1), program])
    assert [program_at(table, 1, float(t)) for t in times] == [program.at(t) for t in times]
    if function.kind != "constant":
        assert max(abs(program.at(t)[1]) for t in times) <= steepest(function) * (1 + 1e-12)


@pytest.mark.parametrize("name", PROGRAMS)
def test_derivatives(name: str) -> None:
    """Slope and curvature are derivatives of the value."""
    program, h = PROGRAMS[name], 1e-5
    for t in np.arange(-0.4863, 6.0, 0.05):
        (_, slope, curvature), ahead, behind = program.at(t), program.at(t + h), program.at(t - h)
        assert slope == pytest.approx((ahead[0] - behind[0]) / (2 * h), abs=1e-7)
        assert curvature == pytest.approx((ahead[1] - behind[1]) / (2 * h), abs=1e-4)


@pytest.mark.parametrize("name", [name for name in PROGRAMS if name not in QUARTIC])
def test_integral(name: str) -> None:
    """The function is the slope of its integral, also backwards in time; the integral is zero at zero, and continuous."""
    program, h = PROGRAMS[name], 1e-5
    whole = program.integral()
    assert whole.at(0.0)[0] == 0.0
    for t in np.arange(-0.4863, 6.0, 0.05):
        assert whole.at(t)[1] == pytest.approx(program.at(t)[0], abs=1e-13)
        assert whole.at(t)[1] == pytest.approx((whole.at(t + h)[0] - whole.at(t - h)[0]) / (2 * h), abs=1e-8)
    for t in program.breaks():
        assert whole.at(np.nextafter(t, 9.0))[0] == pytest.approx(whole.at(np.nextafter(t, -9.0))[0], abs=1e-13)
    assert whole.at(2.0)[0] == pytest.approx(quad(lambda t: program.at(t)[0], 0.0, 2.0, points=program.breaks())[0])


@pytest.mark.parametrize("name", QUARTIC)
def test_a_run_up_has_no_integral_in_pieces(name: str) -> None:
    with pytest.raises(ValueError, match="more than 5 powers"):
        PROGRAMS[name].integral()


def test_ramp_is_zero_then_smooth_then_one() -> None:
    program = time_function(Ramp(kind="ramp", start=1.0, end=3.0))
    assert [program.at(t)[0] for t in (-1.0, 1.0, 2.0, 3.0, 9.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]
    assert program.at(1.0)[1] == program.at(3.0)[1] == 0.0
    assert program.at(2.0)[1] == pytest.approx(1.5 / 2.0)


def test_peaks() -> None:
    """The largest magnitude is at one of the peaks; of a line without end it is the time at which it is one."""
    for function in FUNCTIONS[1:]:
        program = time_function(function)
        largest = max(abs(program.at(t)[0]) for t in program.peaks())
        bounded = getattr(function, "shape", "") != "unbounded"
        assert largest == pytest.approx(np.abs(formula(function, np.linspace(0.0, 6.0, 60_001))).max() if bounded else 1.0)
    assert rectangle(2.0, 1.0).peaks() == (1.0, 3.0)


def test_parts_go_on_from_where_the_one_before_came_to() -> None:
    there, back = run_up(2.0, 0.5, 0.1), run_up(1.0, 0.3, 0.05)
    both = parts([(1.0, 1.0, there), (3.0, -1.0, back)])
    assert both.at(0.5)[0] == 0.0
    assert both.at(2.9) == (0.5, 0.0, 0.0)
    assert both.at(3.0 + back.end_time)[0] == pytest.approx(0.2)
    assert both.at(3.2)[1] < 0.0
    assert both.travel == pytest.approx(0.8)
    assert both.time_of(0.5 + 0.15) == pytest.approx(3.0 + back.time_of(0.15), rel=1e-14)
    cut = parts([(0.0, 1.0, there), (0.2, -1.0, back)])  # the second begins before the first ends
    assert cut.at(0.2 + back.end_time)[0] == pytest.approx(there.at(0.2)[0] - 0.3)
    assert parts([]).time_of(1.0) == parts([]).travel == 0.0


@pytest.mark.parametrize("function", FUNCTIONS[4:8], ids=range(4))
def test_times_of_travels_are_exact(function: TimeFunction) -> None:
    """Travelled distances, their times, reversals and largest speed of a motion that goes back and forth."""
    motion = Travel(time_function(function).scaled(0.3).pieces)
    times = np.linspace(0.0, motion.end_time, 200_001)
    values = 0.3 * formula(function, times)
    assert motion.travel == pytest.approx(np.abs(np.diff(values)).sum(), rel=1e-7)
    assert motion.speed == pytest.approx(np.abs(np.diff(values) / np.diff(times)).max(), rel=1e-5)
    way = np.diff(values)
    turns = times[1:-1][way[1:] * way[:-1] < 0.0]
    np.testing.assert_allclose(motion.reversals(), turns, atol=5e-5)
    for share in (0.0, 1e-9, 0.1, 0.37, 0.5, 0.93, 1.0 - 1e-9, 1.0):
        assert motion.gone(motion.time_of(share * motion.travel)) == pytest.approx(share * motion.travel, abs=1e-12)
    quarter = math.sqrt(0.5) if function.kind == "cycle" and function.form == "alternating" else None
    if quarter is not None:
        assert motion.time_of(0.3 * quarter) == pytest.approx(0.5 + 0.25, rel=1e-14)
