"""Units in which results are shown, by the size of the values."""

from __future__ import annotations

import math
from typing import Any

import pytest

from fsm.results.summary_file import heading
from fsm.text.shown_units import shown, shown_points, shown_range, shown_size, travel_text, turns
from fsm.views.plots.style import figure_unit


@pytest.mark.parametrize(
    ("si", "value", "text"),
    [
        ("m", 12.0, "12 m"), ("m", 1.999, "1999 mm"), ("m", 2e3, "2000 m"), ("m", 3e-6, "3 um"), ("m", 0.0, "0 mm"),
        ("m", 1e-4 - 1e-19, "0.1 mm"),
        ("m", -0.5e-8, "-5 nm"), ("rad", math.pi, "180 deg"), ("rad", 20.0 * math.pi, "10 turns"), ("rad", 0.0, "0 deg"),
        ("N", 4.36e-4, "0.436 mN"), ("N", 2.0, "2 N"), ("N m", 5e-4, "0.5 N mm"), ("J", 2.5e6, "2.5 MJ"),
        ("m^3", 2.7e-5, "0.027 litre"), ("Pa", 7578.0, "7.578 kPa"), ("K", 300.0, "300 K"), ("m", 2e4, "20 km"),
        ("m/s", 2e-6, "2 um/s"), ("N m/rad", 2e-3, "2 N mm/rad"), ("N/m", 1e-4, "0.0001 N/m"), ("kg", 4e-6, "4 mg"),
        ("s", 2e-4, "200 us"), ("m^2", 1e-14, "0.01 um^2"), ("N", math.inf, "inf N"),
    ],
)  # fmt: skip
def test_a_quantity_has_a_unit_of_its_size(si: str, value: float, text: str) -> None:
    """An axis had 12000 mrad, another one 1e4 mm."""
    assert shown(value, si) == text


def test_several_values_have_one_unit() -> None:
    assert shown_points([(1e-6, 2e-7, 1e-20), (0.0, -3e-6, 0.0)], between=" and ") == "(1, 0.2, 0) and (0, -3, 0) um"
    assert shown_range(1e-3, 2.5, "m") == "0.001 to 2.5 m" and shown_range(0.02, 0.02, "N") == "0.02 N"
    assert shown_size(2.0, 1.0, 1e-4) == "2 m x 1 m x 0.1 mm"


def test_units_of_figures_have_the_letters_of_print() -> None:
    assert figure_unit("N", [2e-6, float("nan")]).name == "µN"
    assert figure_unit("rad", 100.0).name == "turns"
    assert figure_unit("m^3", 2.0).name == "m³"


@pytest.mark.parametrize(
    ("summary", "turning"),
    [
        ({"drive": "arm (turn)"}, True), ({"drive": "arm"}, False), ({}, False),
        ({"step": [{"name": "start"}, {"drive": "arm (turn)"}, {"drive": "rope"}]}, True),
    ],
)  # fmt: skip
def test_the_kind_of_the_first_drive(summary: dict[str, Any], turning: bool) -> None:
    assert turns(summary) == turning
    assert travel_text(turning, 1.0) == ("57.3 deg" if turning else "1000 mm")


@pytest.mark.parametrize(
    ("key", "turning", "text"),
    [
        ("peak_force", False, "peak_force (N)"), ("peak_force", True, "peak_moment (N m)"),
        ("stage_contact_travel", True, "stage_contact_turn (rad)"), ("frequency_hz", False, "frequency (Hz)"),
        ("wall_time_s", False, "wall_time (s)"), ("steps", False, "steps"), ("mesh_error", False, "mesh_error"),
        ("amplitude_center", False, "amplitude_center (m)"), ("unheard_of", False, "unheard_of"),
        ("tension_state_largest_stress", False, "tension_state_largest_stress (Pa)"),
        ("folded_strain_energy_unassigned", False, "folded_strain_energy_unassigned (J)"), ("units", False, "units"),
        ("joint_opening", True, "joint_opening (m)"),
    ],
)  # fmt: skip
def test_headings_of_tables_have_units(key: str, turning: bool, text: str) -> None:
    assert heading(key, turning) == text
