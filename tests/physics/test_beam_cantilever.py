"""Planar beams against converged references: large bending with shear, slender bars, deep bars."""

import numpy as np
import pytest

from validation.closed_forms.absolute import DEEP as TIP
from validation.closed_forms.absolute import TIMOSHENKO
from validation.closed_forms.ancf import deep_cantilever as cantilever


def test_large_bending_with_shear():
    """The error is within 1e-4 of the exact beam with four elements, and the order is four or more."""
    errors = [np.linalg.norm(cantilever("section", n, 2.0, 0.5, 62.5e6, TIMOSHENKO) - TIP) for n in (1, 2, 4, 8)]
    assert errors[2] < 1e-4 * np.linalg.norm(TIP)
    assert errors[3] < 2e-6
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(order > 4.0)


@pytest.mark.parametrize("slenderness", [5.0, 10.0, 100.0, 1000.0])
@pytest.mark.parametrize("element", ["section", "green"])
def test_no_locking(element, slenderness):
    """Small bending of one element is exact at any slenderness, with nu = 0.3: neither shear nor Poisson locking."""
    length, height = 2.0, 2.0 / slenderness
    young, second_moment = 2.07e11, 0.1 * height**3 / 12.0
    force = 1e-6 * 3.0 * young * second_moment / length**2
    shear = young / 2.6 * 5.0 / 6.0 * 0.1 * height
    exact = -force * (length**3 / (3.0 * young * second_moment) + length / shear)
    assert cantilever(element, 1, length, height, force, steps=1)[1] == pytest.approx(exact, rel=2e-6)


@pytest.mark.parametrize("element", ["section", "green", "cable"])
def test_thin_beam_bends_far(element):
    """The tip moves by half the length at L/h = 200: the error is 1e-4 of the elastica (a = 2) with 16 elements, and the
    order is four or more."""
    force = 2.0 * 2.07e11 * 0.1 * 0.01**3 / 12.0 / 4.0
    elastica = -2.0 * np.array([0.1606417208, 0.4934574804])
    errors = [np.linalg.norm(cantilever(element, n, 2.0, 0.01, force) - elastica) for n in (4, 8, 16)]
    assert errors[2] < 1e-4
    assert np.log2(errors[1] / errors[2]) > 4.0


def test_green_strain_is_another_law():
    """In the deep cantilever strains reach 14 %: the law of St Venant and Kirchhoff is softer there, but not at small
    strains."""
    deep = cantilever("green", 8, 2.0, 0.5, 62.5e6, TIMOSHENKO)
    assert 1.002 < deep[1] / TIP[1] < 1.02
    small, exact = (cantilever(element, 8, 2.0, 0.5, 62.5e4, TIMOSHENKO)[1] for element in ("green", "section"))
    assert small == pytest.approx(exact, rel=2e-4)
