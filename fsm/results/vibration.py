"""Results of a vibration: frequency with its resolution, decay rate, amplitudes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fsm.results.film import Floats
from fsm.results.solution import Solution
from fsm.results.spectrum import amplitude, fit_damped_sinusoid, high_lines, spectrum

_MIN_SAMPLES = 8
"""Fewest samples of the free motion for the fit of a frequency."""
_MIN_PERIODS = 3.0
"""Fewest periods of the free motion with which the fit separates the frequency from other modes and the offset."""
_MOST_LINES = 5
"""Lines of the spectrum that a warning names at most."""
_MAX_GROWTH = 0.1
"""Growth exponent over the history below which no warning is given: beats of undamped modes cause such growth."""


def free_history(solution: Solution, probe: str, pulse_end: float) -> tuple[Floats, Floats]:
    """Times (s) and normal displacements (m) of a probe after the pulse."""
    assert solution.layout.film is not None
    column = solution.layout.film.probe_names.index(probe)
    after = solution.samples.time >= pulse_end
    return solution.samples.time[after], solution.samples.displacement[after, column, 2]


def summarise_vibration(solution: Solution, pulse_end: float) -> dict[str, Any]:
    """Frequency and decay rate at the center of the film, amplitudes at center and patch.

    * `frequency_hz`, `decay_rate`, `damping_ratio`: damped sinusoid fitted to the free motion of the center after the pulse
    * `fit_residual`: relative residual of this fit, for example from other modes
    * `frequency_fft_hz`: highest bin of the spectrum of the same motion; `frequency_resolution_hz`: distance of its bins
    * `lines_hz`: frequencies of all lines at least half as high as the highest one, which comes first
    * `amplitude_center`, `amplitude_patch`, m: largest normal displacement from rest; None without such a probe
    * `free_from`, s: end of the pulse

    Frequency and decay are None if the center does not move or the free motion is too short.
    """
    film = solution.layout.film
    assert film is not None
    summary: dict[str, Any] = dict.fromkeys(
        (
            "frequency_hz", "frequency_fft_hz", "frequency_resolution_hz", "decay_rate", "damping_ratio", "fit_residual",
            "lines_hz",
        )
    )
    summary["free_from"] = pulse_end
    for name in ("center", "patch"):
        found = None
        if name in film.probe_names and len(solution.samples.time) > 1:
            found = amplitude(solution.samples.displacement[:, film.probe_names.index(name), 2])
        summary[f"amplitude_{name}"] = found
    time, moved = free_history(solution, "center", pulse_end)
    if len(time) >= _MIN_SAMPLES and np.any(moved != moved[0]):
        lines, fit = spectrum(time, moved), fit_damped_sinusoid(time, moved)
        summary |= {
            "frequency_hz": fit.frequency,
            "frequency_fft_hz": lines.peak,
            "frequency_resolution_hz": lines.resolution,
            "decay_rate": fit.decay,
            "damping_ratio": fit.damping_ratio,
            "fit_residual": fit.residual,
            "lines_hz": [fit.frequency, *high_lines(time, moved)[1:]],
        }
    return summary


def frequency_warnings(time: Floats, summary: Mapping[str, Any]) -> list[str]:
    """Warning, if any, that frequency and decay rate in the summary may be wrong.

    A warning is given in five cases:

    * The free motion has too few samples for a fit.
    * The free motion holds fewer than three periods.
    * Fit and FFT differ by more than the distance of two bins plus decay/(2 pi), the width of a damped line.
      For a single damped sinusoid, fit and FFT differ by at most half of this width.
    * The fitted motion grows.
    * The spectrum has other lines that are nearly as high.

    Parameters
    ----------
    time : (n,) array, s
        Times of all samples.
    summary : result of `summarise_vibration` for these samples
    """
    if not summary["free_from"]:  # no pulse
        return []
    count = int(np.sum(time >= summary["free_from"]))
    remedy = "give a longer vibration.duration"
    if count < _MIN_SAMPLES:
        return [f"no frequency: {count} samples after the pulse, {_MIN_SAMPLES} are needed; {remedy}"]
    if summary["frequency_hz"] is None:
        return []
    frequency, decay, resolution = (summary[key] for key in ("frequency_hz", "decay_rate", "frequency_resolution_hz"))
    found = []
    if frequency < _MIN_PERIODS * resolution:
        periods = f"{frequency / resolution:.2g} periods of {frequency:.4g} Hz ({_MIN_PERIODS:g} are needed)"
        found.append(f"the free motion of {1e3 / resolution:.3g} ms holds {periods}")
    difference = abs(frequency - summary["frequency_fft_hz"])
    if difference > resolution + max(decay, 0.0) / (2.0 * math.pi):
        found.append(f"fit and FFT differ by {difference:.3g} Hz (resolution {resolution:.3g} Hz)")
    if -decay > _MAX_GROWTH * resolution:
        found.append(f"the fitted motion grows at {-decay:.3g} 1/s")
    doubt = [f"frequency and decay are doubtful: {', '.join(found)}; {remedy}"] if found else []
    if len(lines := summary.get("lines_hz") or []) > 1:
        others = ", ".join(f"{line:.4g}" for line in lines[1:_MOST_LINES])
        doubt.append(
            f"frequency_hz belongs to the highest line of the spectrum, {frequency:.4g} Hz; other lines at least half as "
            f"high are at {others} Hz"
        )
    return doubt
