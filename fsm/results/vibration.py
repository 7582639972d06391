"""The numbers of a vibration: frequency with its resolution, decay, amplitudes."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.results.solution import Floats, Solution
from fsm.results.spectrum import amplitude, fit_damped_sinusoid, spectrum

__all__ = ["free_history", "summarise_vibration"]


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
    if len(time) >= 8 and np.any(moved != moved[0]):
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
