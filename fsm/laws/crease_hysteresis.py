"""What a crease keeps back on its way: dry friction beside its elastic curve, so that opening and closing differ.

Of two measured branches, loading L(o) and unloading U(o), the crease itself follows (L + U)/2 as an elastic curve, and a
spring of stiffness k in series with a slider of strength h(o) = (L - U)/2 acts beside it:

    M = k z,   z = o - p,   |k z| <= h(o),   the slider gives way only at |k z| = h(o)

p is where the slider stands, the only thing remembered: plasticity in one dimension with a yield moment that depends on
the opening. Opened steadily the crease is on L, closed steadily on U; where it turns round, the moment goes from one to the
other over about 2 h/k of opening. Its energy is k z^2/2, and the slider dissipates k z p' >= 0, since while it slips forward

    p' = o' (1 - h'/k),   k > |h'| as `hysteresis_stiffness` makes it.

The law knows no time. Over an opening from o_1 to o_2 without turning, the part from o_y on slipping, what is dissipated is

    |int_{o_y}^{o_2} h do| - (h(o_2)^2 - h(o_y)^2)/(2k)

exactly, so that stored + dissipated = work done, however long the steps.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from fsm.kernels.jit import kernel
from fsm.kernels.spline import evaluate_curve
from fsm.laws.crease import Curve, curve_from_polynomial

__all__ = ["hysteresis_stiffness", "slip_energy", "slip_moment", "slip_power", "strength_curve"]

_STEEPER = 1.25
"""Least stiffness of the spring over the steepest slope of the strength."""
_BISECTIONS = 60


def strength_curve(opening: np.ndarray, strength: np.ndarray) -> Curve:
    """The strength h(o) of the slider: monotone between the points, and constant outside them.

    Parameters
    ----------
    opening : (n,) array, rad, increasing
    strength : (n,) array, N m, >= 0
    """
    slope = PchipInterpolator(opening, strength).derivative()(opening)
    slope[[0, -1]] = 0.0  # nothing grows, or falls below zero, where nothing was measured
    return curve_from_polynomial(CubicHermiteSpline(opening, strength, slope))


def hysteresis_stiffness(strength: Curve, reversal: float) -> float:
    """Stiffness k, N m/rad, of the spring: half of `reversal` (rad) stretches it to the largest strength.

    At least 1.25 times the steepest slope of the strength, without which the law would not be dissipative.
    """
    steps = np.linspace(0.0, 1.0, 9)
    openings = (strength.knots[:-1, None] + np.diff(strength.knots)[:, None] * steps).ravel()
    steepest = max(abs(strength(opening)[2]) for opening in openings)
    largest = max(strength(opening)[1] for opening in strength.knots)
    return max(2.0 * largest / reversal, _STEEPER * steepest)


@kernel
def slip_moment(
    opening: np.ndarray,
    slider: np.ndarray,
    stiffness: np.ndarray,
    curve: np.ndarray,
    bounds: np.ndarray,
    knots: np.ndarray,
    coefficients: np.ndarray,
    energies: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Moment, its slope dM/do and where the slider stands then.

    Parameters
    ----------
    opening : (m,) array, rad
    slider : (m,) array, rad
        Where the sliders stood when a step was accepted last.
    stiffness : (m,) array, N m/rad
    curve : (m,) int array
        Number of each crease's strength in the table.
    bounds, knots, coefficients, energies : the `CurveTable` of strengths

    Returns
    -------
    moment, slope, slider : (m,) arrays, N m, N m/rad, rad
    """
    moment, slope = np.empty(opening.shape[0]), np.empty(opening.shape[0])
    moved = np.empty(opening.shape[0])
    for i in range(opening.shape[0]):
        _, strength, steepness = evaluate_curve(
            opening[i], bounds[curve[i]], bounds[curve[i] + 1], knots, coefficients, energies
        )
        spring = stiffness[i] * (opening[i] - slider[i])
        if spring > strength:
            moment[i], slope[i] = strength, steepness
            moved[i] = opening[i] - strength / stiffness[i]
        elif spring < -strength:
            moment[i], slope[i] = -strength, -steepness
            moved[i] = opening[i] + strength / stiffness[i]
        else:
            moment[i], slope[i], moved[i] = spring, stiffness[i], slider[i]
    return moment, slope, moved


@kernel
def slip_energy(
    begin: np.ndarray,
    opening: np.ndarray,
    slider: np.ndarray,
    stiffness: np.ndarray,
    curve: np.ndarray,
    bounds: np.ndarray,
    knots: np.ndarray,
    coefficients: np.ndarray,
    energies: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Energy stored at an opening, and dissipated on the straight way to it, (m,) arrays, J.

    Parameters
    ----------
    begin : (m,) array, rad
        Openings where the sliders stood at `slider`.
    opening, slider, ... : as in `slip_moment`
    """
    stored, lost = np.empty(opening.shape[0]), np.zeros(opening.shape[0])
    for i in range(opening.shape[0]):
        first, last = bounds[curve[i]], bounds[curve[i] + 1]
        end_area, strength, _ = evaluate_curve(opening[i], first, last, knots, coefficients, energies)
        spring = stiffness[i] * (opening[i] - slider[i])
        if abs(spring) <= strength:
            stored[i] = 0.5 * spring * spring / stiffness[i]
            continue
        stored[i] = 0.5 * strength * strength / stiffness[i]
        sign = 1.0 if spring > 0.0 else -1.0
        # the slider begins to slip where k (o - p) = +-h(o), once on the way since k > |h'|
        inside, outside = begin[i], opening[i]
        for _ in range(_BISECTIONS):
            middle = 0.5 * (inside + outside)
            _, there, _ = evaluate_curve(middle, first, last, knots, coefficients, energies)
            if sign * stiffness[i] * (middle - slider[i]) > there:
                outside = middle
            else:
                inside = middle
        area, there, _ = evaluate_curve(inside, first, last, knots, coefficients, energies)
        lost[i] = sign * (end_area - area) - 0.5 * (strength * strength - there * there) / stiffness[i]
    return stored, lost


@kernel
def slip_power(
    opening: np.ndarray,
    rate: np.ndarray,
    slider: np.ndarray,
    stiffness: np.ndarray,
    curve: np.ndarray,
    bounds: np.ndarray,
    knots: np.ndarray,
    coefficients: np.ndarray,
    energies: np.ndarray,
) -> np.ndarray:
    """Power that every slider dissipates, (m,), W, at a rate of opening (m,), rad/s; the rest as in `slip_moment`."""
    power = np.zeros(opening.shape[0])
    for i in range(opening.shape[0]):
        _, strength, steepness = evaluate_curve(
            opening[i], bounds[curve[i]], bounds[curve[i] + 1], knots, coefficients, energies
        )
        spring = stiffness[i] * (opening[i] - slider[i])
        sign = 1.0 if spring > 0.0 else -1.0
        if abs(spring) > strength and sign * rate[i] > 0.0:
            power[i] = strength * abs(rate[i]) * (1.0 - sign * steepness / stiffness[i])
    return power
