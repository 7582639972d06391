"""Chains of segments in space converge at second order: lateral buckling, the 45 degree bend, the Princeton beam."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from validation.closed_forms.beams import ARC, LATERAL, PRINCETON
from validation.closed_forms.chains import Section, lateral_buckling, space_tip


def order(errors: np.ndarray) -> np.ndarray:
    return np.asarray(np.log2(errors[:-1] / errors[1:]))


def test_lateral_buckling_of_a_straight_strip() -> None:
    """4.0126 sqrt(EI GJ)/L^2 (Prandtl 1899, Michell 1899)."""
    counts = np.array([10, 20, 40])
    errors = np.array([lateral_buckling(n) for n in counts]) / LATERAL - 1.0
    assert np.all(np.abs(errors) < 0.5 / counts**2)
    assert order(errors)[-1] == pytest.approx(2.0, abs=0.1)


def test_joints_may_be_turned_round() -> None:
    """Inner and outer body of every second joint are swapped: the result is the same, except for the shear strain of the
    joints."""
    assert lateral_buckling(10, True) == pytest.approx(lateral_buckling(10), rel=1e-7)
    section = Section(stretch=1e6, shear=1e6, torsion=0.3, about_y=1.0, about_z=2.0)
    ends = [space_tip(10, 1.0, 0.8, section, (0.0, 0.5, 1.0), 20, swapped)[0] for swapped in (False, True)]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-5)


@pytest.mark.parametrize("load", [300.0, 600.0])
def test_45_degree_bend(load: float) -> None:
    """The 45 degree bend of the literature."""
    section = Section.rectangle(1.0, 1.0, 1e7, 5e6, 1.0 / 6.0)
    found = np.array([space_tip(n, 100.0 * math.pi / 4, math.pi / 4, section, (0.0, 0.0, load))[0] for n in (10, 20, 40)])
    np.testing.assert_allclose(order(np.linalg.norm(found - ARC[load], axis=1)), 2.0, atol=0.1)


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_45_degree_bend_whose_stiffnesses_differ(ratio: float) -> None:
    """Softer or stiffer torsion, and bending about z in the opposite sense, compared with their own limits."""
    section = Section.rectangle(1.0, 1.0, 1e7, 5e6, 1.0 / 6.0)
    section = replace(section, torsion=section.torsion * ratio, about_z=section.about_z / ratio)
    arc = 100.0 * math.pi / 4, math.pi / 4
    found = np.array([space_tip(n, *arc, section, (0.0, 0.0, 600.0), steps=20)[0] for n in (10, 20, 40, 80)])
    np.testing.assert_allclose(order(np.linalg.norm(np.diff(found, axis=0), axis=1)), 2.0, atol=0.1)


@pytest.mark.parametrize(("load", "angle"), [(4.448, 30), (4.448, 60), (13.345, 30), (13.345, 60)])
def test_princeton_beam(load: float, angle: int) -> None:
    section = Section.rectangle(12.377e-3, 3.2024e-3, 71.7e9, 71.7e9 / 2.62, 1.13399530e-10)
    turned = math.radians(angle)
    force = (0.0, -load * math.cos(turned), load * math.sin(turned))
    counts = (10, 20, 40)
    found = np.array([space_tip(n, 0.508, 0.0, section, force)[0] for n in counts])
    exact = np.array(PRINCETON[load, angle][:3]) + [0.508, 0.0, 0.0]
    errors = np.linalg.norm(found - exact, axis=1)
    assert errors[2] < 1.5e-4 * 0.508
    np.testing.assert_allclose(order(errors), 2.0, atol=0.1)
