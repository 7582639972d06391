"""Analysis of a sampled history: amplitude spectrum, fit of a damped sinusoid, amplitude."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from fsm.results.film import Floats
from fsm.text.short_repr import ShortRepr

_BINS = 4.0
"""Half width, in bins, of the frequency range of the fit about the highest bin of the spectrum."""


@dataclass(frozen=True, repr=False)
class Spectrum(ShortRepr):
    """Single-sided amplitude spectrum of a history without its mean.

    Attributes
    ----------
    frequency : (n,) array, Hz        from 0 to half the sampling rate
    amplitude : (n,) array            unit of the history; exact for a sine whose frequency is that of a bin
    resolution : Hz
        Distance of two bins: 1 over the length of the history. The frequency of the highest bin has an error of at most
        half this distance.
    """

    frequency: Floats
    amplitude: Floats
    resolution: float

    @property
    def peak(self) -> float:
        """Frequency of the highest bin, Hz."""
        return float(self.frequency[1 + int(np.argmax(self.amplitude[1:]))])


@dataclass(frozen=True)
class DampedSinusoid:
    """Damped sinusoid A exp(-decay (t - t0)) cos(2 pi f (t - t0) + phase) + offset, with t0 the first sample.

    Attributes
    ----------
    frequency : Hz
    decay : 1/s
    amplitude, offset : unit of the history
    phase : rad
    residual : -
        Root mean square of the residual, relative to the root mean square of the history about the offset; 0 is a
        perfect fit. Other modes and harmonics remain in the residual.
    """

    frequency: float
    decay: float
    amplitude: float
    phase: float
    offset: float
    residual: float

    @property
    def damping_ratio(self) -> float:
        """Decay rate over the undamped circular frequency."""
        return self.decay / math.hypot(self.decay, 2.0 * math.pi * self.frequency)


def spectrum(time: ArrayLike, values: ArrayLike) -> Spectrum:
    """Spectrum by FFT, without window or padding.

    Parameters
    ----------
    time : (n,) array, s          equally spaced to 1e-6 of a step
    values : (n,) array

    Raises
    ------
    ValueError
        There are fewer than 4 samples, or their times are not equally spaced.
    """
    t, y = _history(time, values)
    step = (t[-1] - t[0]) / (len(t) - 1)
    lines = np.abs(np.fft.rfft(y - y.mean())) / len(t)
    lines[1:] *= 2.0
    if len(t) % 2 == 0:
        lines[-1] *= 0.5
    return Spectrum(np.fft.rfftfreq(len(t), step), lines, 1.0 / (len(t) * step))


def high_lines(time: ArrayLike, values: ArrayLike) -> list[float]:
    """Frequencies (Hz) of the lines of the spectrum of at least half the highest, the highest first, each from a separate
    fit.

    Parameters
    ----------
    time : (n,) array, s          equally spaced
    values : (n,) array
    """
    lines = spectrum(time, values)
    height = np.concatenate([[0.0], lines.amplitude[1:], [0.0]])
    bins = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])) + 1
    bins = bins[(height[bins] >= 0.5 * height.max()) & (bins < len(lines.frequency))]
    bins = bins[np.argsort(-height[bins], kind="stable")]
    found: list[float] = []
    for k in bins:
        frequency = fit_damped_sinusoid(time, values, float(lines.frequency[k])).frequency
        if all(abs(frequency - other) > lines.resolution for other in found):  # these are two maxima of one line
            found.append(frequency)
    return found


def fit_damped_sinusoid(time: ArrayLike, values: ArrayLike, near: float | None = None) -> DampedSinusoid:
    """Least-squares fit of one damped sinusoid near the highest bin of the spectrum, or near another frequency.

    Frequency and decay are the unknowns; cosine, sine and offset follow from them linearly (variable projection).
    The fit of a single damped sinusoid is exact to round-off for any length of the history.

    Parameters
    ----------
    time : (n,) array, s          equally spaced
    values : (n,) array
    near : Hz

    Raises
    ------
    ValueError
        There are fewer than 4 samples, or their times are not equally spaced.
    """
    t, y = _history(time, values)
    lines = spectrum(t, y)
    start = lines.peak if near is None else near
    if not np.any(y != y[0]):
        return DampedSinusoid(start, 0.0, 0.0, 0.0, float(y[0]), 0.0)
    duration, t = t[-1] - t[0], t - t[0]
    unit = float(np.std(y))
    y = y / unit  # this scaling makes the tolerances of the solver relative
    low = max(start - _BINS * lines.resolution, 0.05 * lines.resolution)
    high = min(start + _BINS * lines.resolution, float(lines.frequency[-1]))
    scale = np.array([lines.resolution, 1.0 / duration])

    def residual(unknown: np.ndarray) -> np.ndarray:
        basis = _basis(t, *(unknown * scale))
        return y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]

    best = None
    for frequency in _start_frequencies(t, y, low, high):
        found = least_squares(
            residual, [frequency / scale[0], 1.0], bounds=([low / scale[0], -5.0], [high / scale[0], 200.0]),
            xtol=1e-14, ftol=1e-14, gtol=1e-14,
        )  # fmt: skip
        best = found if best is None or found.cost < best.cost else best
    assert best is not None
    frequency, decay = best.x * scale
    cosine, sine, offset = np.linalg.lstsq(_basis(t, frequency, decay), y, rcond=None)[0]
    total_rms = math.sqrt(float(np.mean((y - offset) ** 2)))
    residual_rms = math.sqrt(float(np.mean(best.fun**2)))
    return DampedSinusoid(
        float(frequency), float(decay), unit * math.hypot(cosine, sine), math.atan2(-sine, cosine), unit * float(offset),
        residual_rms / total_rms if total_rms > 0.0 else 0.0,
    )  # fmt: skip


def amplitude(values: ArrayLike, rest: float = 0.0) -> float:
    """Largest distance from the rest position."""
    return float(np.max(np.abs(np.asarray(values, dtype=float) - rest), initial=0.0))


def _history(time: ArrayLike, values: ArrayLike) -> tuple[Floats, Floats]:
    t, y = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    if len(t) != len(y) or len(t) < 4:
        raise ValueError(f"a history needs at least 4 samples, each with a time; it has {len(t)} times, {len(y)} values")
    steps = np.diff(t)
    if np.ptp(steps) > 1e-6 * steps.mean() or not steps.min() > 0.0:
        raise ValueError(f"samples are not equally spaced: steps from {steps.min():g} to {steps.max():g} s")
    return t, y


def _basis(t: Floats, frequency: float, decay: float) -> Floats:
    envelope = np.exp(-decay * t)
    turn = 2.0 * math.pi * frequency * t
    return np.column_stack([envelope * np.cos(turn), envelope * np.sin(turn), np.ones_like(t)])


def _start_frequencies(t: Floats, y: Floats, low: float, high: float) -> list[float]:
    """Three best frequencies on a grid of a quarter bin; a minimum of the squared residual is about one bin wide."""
    grid = np.linspace(low, high, 33)
    squares = []
    for frequency in grid:
        basis = _basis(t, float(frequency), 1.0 / float(t[-1]))
        squares.append(float(np.sum((y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]) ** 2)))
    return [float(grid[k]) for k in np.argsort(squares)[:3]]
