"""Strip of rigid panels against the closed form of the zig-zag (validation/references.md; exact).

With rigid panels, crease 2 is the joint of two bars of length a between crease 1 (fixed) and crease 3 (pulled, at the height
h above crease 1 and the distance D beside it). In the closed form's own angles the strip as folded, h = 0, has gamma = 0,
beta = theta and chi = pi - 2 theta, so creases at rest as folded have

    phi1 = gamma - beta = -theta,   phi2 = chi = pi - 2 theta,   phi3 = 2 (gamma + beta) = 2 theta.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from validation.closed_forms.folds import CREASE, FOLD, PANEL, TRAVELS, rigid_strip, static_curve, strip_force
from validation.closed_forms.folds import zigzag as closed_form


def static_error(stiffen: float, crease: float = CREASE) -> float:
    """Largest error of the static force at the 20 travels, over the largest force."""
    return relative_error(static_curve(rigid_strip(stiffen=stiffen, crease=crease)), strip_force(TRAVELS, crease))


def relative_error(force: np.ndarray, exact: np.ndarray) -> float:
    return float(np.abs(force - exact).max() / np.abs(exact).max())


def test_closed_form_gives_the_check_value() -> None:
    # validation/references.md
    force = closed_form(0.06, a=0.08, D=0.02, k=(1e-3, 2e-3, 1.5e-3), phi=(-0.3, 0.2, 2.0))
    assert force == pytest.approx(0.028115041423768604, rel=1e-14)


def test_closed_form_is_the_derivative_of_the_creases_energy() -> None:
    D, h, step = 2 * PANEL * math.cos(FOLD), 0.05, 1e-6

    def energy(h: float) -> float:
        R = math.hypot(D, h)
        gamma, beta, chi = math.atan2(h, D), math.acos(R / 2 / PANEL), 2 * math.asin(R / 2 / PANEL)
        turns = (gamma - beta + FOLD, chi - math.pi + 2 * FOLD, 2 * (gamma + beta) - 2 * FOLD)
        # creases 1, 5 and 2, 4 twice each, crease 3 once
        return CREASE * (turns[0] ** 2 + turns[1] ** 2 + 0.5 * turns[2] ** 2)

    slope = (energy(h + step) - energy(h - step)) / (2 * step)
    assert float(strip_force(np.array(h))) == pytest.approx(slope, rel=1e-8)


@pytest.mark.parametrize(("crease", "bound"), [(1e-3, 1e-4), (2e-3, 1e-4), (CREASE, 1.2e-4)])
def test_static_pull_with_the_strips_own_springs(crease: float, bound: float) -> None:
    """Creases as stiff as those of the check value, and those of the trial strip, four times stiffer.

    The remaining error is the shear and stretch of the strip, which rigid panels do not have; it is proportional to the
    force: 1.10e-4 of the peak for the creases of the trial strip (8.6e-5 N), 1.2e-5 and 2.4e-5 for the others.
    """
    assert static_error(1.0, crease) < bound
    assert static_error(1.0, crease) == pytest.approx(1.10e-4 * crease / CREASE, rel=0.05)


def test_error_is_that_of_the_springs() -> None:
    errors = [static_error(factor) for factor in (1.0, 10.0, 100.0, 1000.0)]
    orders = np.log10(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(1.0, abs=0.1)
    assert static_error(2000.0) < 1e-7  # with much stiffer springs, round-off in the springs dominates


def test_saved_forces_are_those_of_step_ends() -> None:
    # with interpolation between steps, forces of stiff springs had an error of 2.7e-4 here
    system = rigid_strip()
    forces: list[float] = []
    times = [system.motions[0].time_of(x) for x in TRAVELS]
    settings = Settings("Radau", 1e-6, times[-1])
    simulate(system, settings, times, lambda saved: forces.append(saved.observation.drive.force[0]))
    assert relative_error(np.array(forces), strip_force(TRAVELS)) < 1.2e-4


def test_slow_pull_through_time() -> None:
    # 2 mm/s: inertia and damping remain below the error of the springs of the strip
    system = rigid_strip(speed=2e-3, damping=1e-3)
    forces: list[float] = []
    times = [system.motions[0].time_of(x) for x in TRAVELS]
    # the reaction is the force of stiff springs, so its error is their stiffness times the error of the positions
    settings = Settings("Radau", 1e-9, times[-1])
    simulate(system, settings, times, lambda saved: forces.append(saved.observation.drive.force[0]))
    assert relative_error(np.array(forces), strip_force(TRAVELS)) < 1.2e-4
