"""The law of a tension field with rounded kinks: slopes, its limits, and how far it is from the law with kinks."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.model.nodes.tension_field import film_energy, film_stress, film_tangent

NU, HALF = 0.34, np.array([1.0, 1.0, 0.5])


def energy(e: np.ndarray, remainder: float, width: float) -> float:
    return film_energy(e[0], e[1], e[2], 1.0, NU, remainder, width)


def stress(e: np.ndarray, remainder: float, width: float) -> np.ndarray:
    return np.array(film_stress(e[0], e[1], e[2], 1.0, NU, remainder, width))


@pytest.mark.parametrize("remainder", [0.0, 1e-2])
@pytest.mark.parametrize("width", [0.0, 0.05, 0.4])
def test_slopes_in_all_states(remainder: float, width: float) -> None:
    """Stress and tangent against central differences, taut, wrinkled and slack, on kinks and where e1 = e2."""
    rng, step = np.random.default_rng(1), 1e-6
    strains = list(rng.normal(size=(300, 3)) * rng.choice([0.1, 1.0], size=(300, 1)))
    if width:
        near = [np.array(e) * width for e in ([0.1, 0.1, 0.0], [0.5, -NU, 1e-9])]
        strains += [np.zeros(3), np.array([1.0, -NU, 0.0]), *near]
    for e in strains:
        ways = step * np.eye(3)
        of_energy = [(energy(e + d, remainder, width) - energy(e - d, remainder, width)) / (2 * step) for d in ways]
        of_stress = [(stress(e + d, remainder, width) - stress(e - d, remainder, width)) / (2 * step) for d in ways]
        c = film_tangent(e[0], e[1], e[2], 1.0, NU, remainder, width)
        tangent = np.array([[c[0], c[1], c[2]], [c[1], c[3], c[4]], [c[2], c[4], c[5]]])
        assert stress(e, remainder, width) == pytest.approx(np.array(of_energy) * HALF, abs=1e-8)
        assert tangent == pytest.approx(np.array(of_stress) * HALF[:, None], abs=2e-4)


def test_rounding_changes_the_stress_by_a_quarter_of_the_width() -> None:
    rng, width = np.random.default_rng(2), 0.05
    off = [np.abs(stress(e, 0.0, width) - stress(e, 0.0, 0.0)).max() for e in rng.normal(size=(3000, 3)) * 0.1]
    assert 0.1 * width < max(off) < 0.3 * (1.0 + NU) * width
    for far in ([1.0, 0.5, 0.1], [1.0, -1.0, 0.2], [-1.0, -0.5, 0.1]):
        assert stress(np.array(far), 0.0, width) == pytest.approx(stress(np.array(far), 0.0, 0.0), abs=1e-15)
