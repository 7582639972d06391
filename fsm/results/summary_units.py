"""Units of the numbers of a summary, for the headings of tables."""

from __future__ import annotations

from functools import lru_cache

_EXACT = {
    "joint_opening": "m", "decay_rate": "1/s", "largest_magnitude": "N", "free_from": "s", "max_stress": "Pa",
    "folded_strain_energy": "J",
}  # fmt: skip
_ENDINGS = {
    "_force": "N", "_travel": "m", "_hz": "Hz", "_s": "s", "_time": "s", "_stress": "Pa", "_opening": "m",
    "_displacement": "m", "_energy": "J", "_velocity": "m/s", "_acceleration": "m/s^2", "_moment": "N m",
}  # fmt: skip
"""Unit by the end of a key; a unit in the key itself is replaced by the one in brackets."""
_BEGINNINGS = {
    "amplitude_": "m", "probe_displacement_": "m", "max_difference_rigid_displacement": "m", "max_asynchronism_": "m",
    "folded_strain_energy_": "J",
}  # fmt: skip
_TURNED = {"m": "rad", "N": "N m"}
_OF_DRIVE = ("peak_", "final_", "dynamic_peak_", "start_up_", "largest_magnitude", "contact_", "bending_", "stage_")
"""Beginnings of the numbers of the first drive, which are a moment and a turn if this drive turns."""


@lru_cache(maxsize=10_000)
def heading(key: str, turns: bool = False) -> str:
    """Heading of a number of a summary, with its unit in brackets: "peak_force (N)", "wall_time (s)".

    Parameters
    ----------
    key : key of the number; keys of nested tables are joined by "_"
    turns : whether the first drive turns bodies, so that its numbers are in N m and rad
    """
    unit = _EXACT.get(key) or next((unit for end, unit in _ENDINGS.items() if key.endswith(end)), "")
    unit = unit or next((unit for begin, unit in _BEGINNINGS.items() if key.startswith(begin)), "")
    if not unit:
        return key
    if turns and key.startswith(_OF_DRIVE) and unit in _TURNED:
        return f"{key.replace('force', 'moment').replace('travel', 'turn')} ({_TURNED[unit]})"
    return f"{key.removesuffix('_hz').removesuffix('_s')} ({unit})"
