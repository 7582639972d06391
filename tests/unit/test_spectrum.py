"""Spectrum, frequency and decay of known histories."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fsm.results.spectrum import amplitude, fit_damped_sinusoid, high_lines, spectrum
from fsm.results.vibration import frequency_warnings


def signal(t: np.ndarray, f: float, decay: float = 0.0, size: float = 1.0, phase: float = 0.3) -> np.ndarray:
    return size * np.exp(-decay * t) * np.cos(2 * np.pi * f * t + phase)


def test_a_sine_on_a_bin_has_its_amplitude() -> None:
    t = np.arange(1000) * 1e-3
    found = spectrum(t, 0.7 + signal(t, 41.0, size=0.25))
    assert found.resolution == pytest.approx(1.0)
    assert found.peak == pytest.approx(41.0)
    assert found.amplitude.max() == pytest.approx(0.25, rel=1e-12)
    assert found.amplitude[0] == pytest.approx(0.0, abs=1e-12)
    assert np.sort(found.amplitude)[-2] < 1e-12


def test_parseval() -> None:
    rng = np.random.default_rng(1)
    for n in (500, 501):
        t = np.arange(n) * 2e-3
        y = rng.standard_normal(n)
        lines = spectrum(t, y).amplitude
        power = 0.5 * np.sum(lines[1:] ** 2)
        if n % 2 == 0:  # the line at half the sampling rate has no partner
            power += 0.5 * lines[-1] ** 2
        assert power == pytest.approx(np.var(y), rel=1e-12)


def test_the_resolution_is_one_over_the_length() -> None:
    t = np.arange(250) * 2e-3
    found = spectrum(t, signal(t, 43.1))
    assert found.resolution == pytest.approx(2.0)
    assert abs(found.peak - 43.1) <= 0.5 * found.resolution


@settings(max_examples=40, deadline=None)
@given(
    f=st.floats(8.0, 180.0), decay=st.floats(0.0, 30.0), phase=st.floats(-3.1, 3.1), size=st.floats(1e-6, 10.0),
    offset=st.floats(-1.0, 1.0),
)  # fmt: skip
def test_the_fit_is_exact(f: float, decay: float, phase: float, size: float, offset: float) -> None:
    t = 0.02 + np.arange(500) * 2e-3
    y = offset * size + signal(t - t[0], f, decay, size, phase)
    found = fit_damped_sinusoid(t, y)
    assert found.frequency == pytest.approx(f, rel=1e-6)
    assert found.decay == pytest.approx(decay, abs=1e-4)
    assert found.amplitude == pytest.approx(size, rel=1e-4)
    assert np.cos(found.phase - phase) == pytest.approx(1.0, abs=1e-6)
    assert found.offset == pytest.approx(offset * size, abs=1e-5 * size)
    assert found.residual < 1e-4


def test_noise_and_another_mode() -> None:
    rng = np.random.default_rng(3)
    t = np.arange(1000) * 1e-3
    y = signal(t, 41.37, 4.0) + signal(t, 95.2, 6.0, 0.3, 1.0) + 0.02 * rng.standard_normal(1000)
    found = fit_damped_sinusoid(t, y)
    assert found.frequency == pytest.approx(41.37, abs=0.05)
    assert found.decay == pytest.approx(4.0, abs=0.2)
    assert 0.1 < found.residual < 0.4
    assert found.damping_ratio == pytest.approx(4.0 / (2 * np.pi * 41.37), rel=0.06)


def test_a_film_at_rest() -> None:
    found = fit_damped_sinusoid(np.arange(100) * 1e-3, np.full(100, 0.2))
    assert found.amplitude == 0.0 and found.residual == 0.0


def test_histories_that_are_none() -> None:
    with pytest.raises(ValueError, match="at least 4"):
        spectrum([0, 1, 2], [1, 2, 3])
    with pytest.raises(ValueError, match="not equally spaced"):
        spectrum([0, 1, 2, 3.5], [1, 2, 3, 4])


def test_amplitude() -> None:
    assert amplitude([0.1, -0.4, 0.3]) == 0.4
    assert amplitude([0.1, -0.4, 0.3], rest=0.1) == 0.5


def said_of(t: np.ndarray, y: np.ndarray, pulse_end: float = 1e-3) -> list[str]:
    """Warnings for a history whose times are counted from the end of the pulse."""
    lines, fit = spectrum(t, y), fit_damped_sinusoid(t, y)
    return frequency_warnings(t + pulse_end, {
        "free_from": pulse_end, "frequency_hz": fit.frequency, "decay_rate": fit.decay, "frequency_fft_hz": lines.peak,
        "frequency_resolution_hz": lines.resolution,
    })  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(
    f=st.floats(8.0, 100.0), periods=st.floats(3.2, 60.0), decay=st.floats(0.0, 0.5), phase=st.floats(-3.1, 3.1),
)  # fmt: skip
def test_a_damped_sinusoid_of_some_periods_raises_no_doubt(f: float, periods: float, decay: float, phase: float) -> None:
    """Also with strong damping, which broadens the line in the spectrum."""
    t = np.arange(int(20 * periods)) / (20 * f)
    assert said_of(t, signal(t, f, decay * f, 1.0, phase)) == []


def test_doubts_say_what_is_wrong_and_what_to_do() -> None:
    t = np.arange(36) * 5e-4
    (short,) = said_of(t, signal(t, 20.0))
    assert "the free motion of 18 ms holds 0.36 periods of 20 Hz" in short
    assert short.endswith("give a longer vibration.duration")
    t = np.arange(500) * 2e-3
    (growing,) = said_of(t, signal(t, 20.0, decay=-0.5))
    assert "the fitted motion grows at 0.5 1/s" in growing and "periods" not in growing
    told = {"free_from": 0.1, "frequency_hz": 23.0, "decay_rate": 0.1, "frequency_fft_hz": 20.0}
    told["frequency_resolution_hz"] = 1.0
    (apart,) = frequency_warnings(t, told)
    assert "fit and FFT differ by 3 Hz (resolution 1 Hz)" in apart and "grows" not in apart
    assert frequency_warnings(t, told | {"decay_rate": 20.0}) == []
    (none,) = frequency_warnings(t, told | {"free_from": 0.99})
    assert none == "no frequency: 5 samples after the pulse, 8 are needed; give a longer vibration.duration"
    assert frequency_warnings(t, told | {"free_from": 0.0}) == []


def test_all_high_lines_are_found_the_highest_first() -> None:
    """Three sines, one of them a quarter as high; 162 Hz lies between two bins."""
    time = np.linspace(0.0, 0.14, 700)
    sines = ((1.0, 233.0, 0.2), (0.8, 162.0, 1.0), (0.2, 55.0, 0.0))
    values = sum(a * np.sin(2.0 * np.pi * f * time + phase) for a, f, phase in sines)
    assert high_lines(time, values) == pytest.approx([233.0, 162.0], rel=5e-3)
    assert high_lines(time, np.sin(2.0 * np.pi * 162.0 * time)) == pytest.approx([162.0], rel=1e-6)
