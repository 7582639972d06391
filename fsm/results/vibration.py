"""The numbers of a vibration: frequency with its resolution, decay, amplitudes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fsm.results.solution import Floats, Solution
from fsm.results.spectrum import amplitude, fit_damped_sinusoid, spectrum

__all__ = ["doubts", "free_history", "summarise_vibration"]

_FEWEST = 8
"""Samples of the free motion, from which on a frequency is looked for."""
_PERIODS = 3.0
"""Periods in the free motion, from which on other modes and the offset can be told from the frequency that is fitted."""
_GROWTH = 0.1
"""Growth of the fitted motion over its history up to which it is none: undamped modes beat, and fits round."""


def free_history(solution: Solution, probe: str, pulse_end: float) -> tuple[Floats, Floats]:
    """Times (s) and normal displacements (m) of a probe after the impact."""
    assert solution.layout.film is not None
    column = solution.layout.film.probe_names.index(probe)
    after = solution.samples.time >= pulse_end
    return solution.samples.time[after], solution.samples.displacement[after, column, 2]


def summarise_vibration(solution: Solution, pulse_end: float) -> dict[str, Any]:
    """Frequency and decay at the center, amplitudes at center and patch.

    * `frequency_hz`, `decay_rate`, `damping_ratio`: of the damped sinusoid fitted to the free motion of the center, after
      the pulse; `fit_residual`: what the fit leaves, other modes for example
    * `frequency_fft_hz`: highest line of the spectrum of the same motion; `frequency_resolution_hz`: distance of its lines
    * `amplitude_center`, `amplitude_patch`, m: largest normal displacement from rest; None without such a probe

    * `free_from`, s: end of the pulse

    None where nothing moves, or too short to say.
    """
    film = solution.layout.film
    assert film is not None
    summary: dict[str, Any] = dict.fromkeys(
        ("frequency_hz", "frequency_fft_hz", "frequency_resolution_hz", "decay_rate", "damping_ratio", "fit_residual")
    )
    summary["free_from"] = pulse_end
    for name in ("center", "patch"):
        found = None
        if name in film.probe_names and len(solution.samples.time) > 1:
            found = amplitude(solution.samples.displacement[:, film.probe_names.index(name), 2])
        summary[f"amplitude_{name}"] = found
    time, moved = free_history(solution, "center", pulse_end)
    if len(time) >= _FEWEST and np.any(moved != moved[0]):
        lines, fit = spectrum(time, moved), fit_damped_sinusoid(time, moved)
        summary |= {
            "frequency_hz": fit.frequency,
            "frequency_fft_hz": lines.peak,
            "frequency_resolution_hz": lines.resolution,
            "decay_rate": fit.decay,
            "damping_ratio": fit.damping_ratio,
            "fit_residual": fit.residual,
        }
    return summary


def doubts(time: Floats, summary: Mapping[str, Any]) -> list[str]:
    """Why frequency and decay in the summary may not be those of the film, in a line; none for a history that tells them.

    The free motion is too short for a fit, or holds fewer than three periods of it; the fit is off the highest line of the
    spectrum by more than the distance of two lines and the width that the decay gives a line, decay/(2 pi) (a damped
    sinusoid alone is off by half of that at most); or the motion that was fitted grows.

    Parameters
    ----------
    time : (n,) array, s
        Of all samples.
    summary : what `summarise_vibration` says of them
    """
    if not summary["free_from"]:  # nothing struck it
        return []
    count = int(np.sum(time >= summary["free_from"]))
    longer = "give a longer vibration.duration"
    if count < _FEWEST:
        return [f"no frequency: {count} samples after the pulse, {_FEWEST} are wanted; {longer}"]
    if summary["frequency_hz"] is None:
        return []
    frequency, decay, between = (summary[key] for key in ("frequency_hz", "decay_rate", "frequency_resolution_hz"))
    found = []
    if frequency < _PERIODS * between:
        periods = f"{frequency / between:.2g} periods of {frequency:.4g} Hz"
        found.append(f"the free motion of {1e3 / between:.3g} ms holds {periods}")
    apart = abs(frequency - summary["frequency_fft_hz"])
    if apart > between + max(decay, 0.0) / (2.0 * math.pi):
        found.append(f"fit and FFT are {apart:.3g} Hz apart, lines {between:.3g} Hz")
    if -decay > _GROWTH * between:
        found.append(f"the motion fitted grows, by {-decay:.3g} 1/s")
    return [f"frequency and decay are doubtful: {', '.join(found)}; {longer}"] if found else []
