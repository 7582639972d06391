"""Names of the numbers of a summary, which are the keys of `[expect]`."""

from __future__ import annotations

from collections.abc import Iterable

from fsm.case.schema.units import did_you_mean
from fsm.errors import Fault

SUMMARY_NUMBERS = (
    "peak_force", "peak_travel", "dynamic_peak_force", "dynamic_peak_travel", "largest_magnitude",
    "largest_magnitude_travel", "final_travel", "final_force", "contact_travel", "contact_force", "bending_travel",
    "bending_force", "dof", "steps", "newton_iterations", "energy_error", "unstable_equilibria", "wall_time_s",
    "frequency_hz", "frequency_fft_hz", "frequency_resolution_hz", "decay_rate", "damping_ratio", "amplitude_center",
    "amplitude_patch",
)  # fmt: skip
_MOST_FAULTS = 10


def expectation_faults(names: Iterable[str]) -> list[Fault]:
    """Faults of names in `[expect]` that no summary has."""
    unknown = [name for name in names if name not in SUMMARY_NUMBERS]
    there = f"; the summary has {', '.join(SUMMARY_NUMBERS)}"
    return [
        Fault(f"expect.{name[:60]}", f"is not a number of the summary{did_you_mean(name[:60], SUMMARY_NUMBERS) or there}")
        for name in unknown[:_MOST_FAULTS]
    ]
