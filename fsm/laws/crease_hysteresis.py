"""Hysteresis of a crease: dry friction in parallel with the elastic curve, for a moment that differs in opening and closing.

A test gives a loading branch L(o) and an unloading branch U(o). The elastic curve is (L + U)/2. A spring of stiffness
k, in series with a slider of strength h(o) = (L - U)/2, acts in parallel:

    M = k z,   z = o - p,   |k z| <= h(o),   the slider moves only at |k z| = h(o)

The slider position p is the only memory. This is plasticity in one dimension with a yield moment that depends on the
opening. In monotonic opening the crease follows L, in monotonic closing U. After a reversal the moment changes from one
branch to the other over about 2 h/k of opening. The stored energy is k z^2/2. The slider dissipates k z p' >= 0, because
during forward slip

    p' = o' (1 - h'/k),   with k > |h'| from `hysteresis_stiffness`.

The law is independent of rates. In a monotonic step from o_1 to o_2 with slip from o_y on, the dissipated energy is exactly

    |int_{o_y}^{o_2} h do| - (h(o_2)^2 - h(o_y)^2)/(2k) .

The sum of stored and dissipated energy therefore equals the work for any step size.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.interpolation import hermite_cubic, monotone_slopes
from fsm.kernels.jit import kernel
from fsm.kernels.spline import evaluate_curve
from fsm.laws.crease import MomentCurve, curve_from_cubic

_MIN_STIFFNESS = 1.25
"""Smallest stiffness of the spring relative to the steepest slope of the strength."""
_BISECTIONS = 60
"""Bisection steps for the opening at which slip begins."""

SliderLaw = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Stiffnesses (m,), N m/rad; numbers (m,) of the strengths in the `CurveTable` of strengths; and arrays of this table."""


def strength_curve(opening: np.ndarray, strength: np.ndarray) -> MomentCurve:
    """Strength h(o) of the slider: monotone between the points, and constant outside them.

    Parameters
    ----------
    opening : (n,) array, rad, increasing
    strength : (n,) array, N m, >= 0
    """
    slope = monotone_slopes(opening, strength)
    slope[[0, -1]] = 0.0  # the strength is constant outside the measured range, so that it never becomes negative
    return curve_from_cubic(hermite_cubic(opening, strength, slope))


def hysteresis_stiffness(strength: MomentCurve, reversal: float) -> float:
    """Stiffness k of the spring, N m/rad: half of `reversal` (rad) loads it to the largest strength.

    It is at least 1.25 times the steepest slope of the strength, because a softer spring would generate energy.
    """
    steps = np.linspace(0.0, 1.0, 9)
    openings = (strength.knots[:-1, None] + np.diff(strength.knots)[:, None] * steps).ravel()
    steepest = max(abs(strength(opening)[2]) for opening in openings)
    largest = max(strength(opening)[1] for opening in strength.knots)
    return max(2.0 * largest / reversal, _MIN_STIFFNESS * steepest)


@kernel
def slip_moment(
    opening: np.ndarray, slider: np.ndarray, law: SliderLaw
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Moment of the slider, its slope dM/do, and the new slider position.

    Parameters
    ----------
    opening : (m,) array, rad
    slider : (m,) array, rad
        Slider positions in the last accepted state.
    law : SliderLaw

    Returns
    -------
    moment, slope, slider : (m,) arrays, N m, N m/rad, rad
    """
    stiffness, curve, bounds, knots, coefficients, energies = law
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
    begin: np.ndarray, opening: np.ndarray, slider: np.ndarray, law: SliderLaw
) -> tuple[np.ndarray, np.ndarray]:
    """Energy stored at an opening, and energy dissipated in the monotonic step to it, (m,) arrays, J.

    Parameters
    ----------
    begin : (m,) array, rad
        Openings in the last accepted state.
    opening, slider, law : as in `slip_moment`
    """
    stiffness, curve, bounds, knots, coefficients, energies = law
    stored, dissipated = np.empty(opening.shape[0]), np.zeros(opening.shape[0])
    for i in range(opening.shape[0]):
        first, last = bounds[curve[i]], bounds[curve[i] + 1]
        end_area, strength, _ = evaluate_curve(opening[i], first, last, knots, coefficients, energies)
        spring = stiffness[i] * (opening[i] - slider[i])
        if abs(spring) <= strength:
            stored[i] = 0.5 * spring * spring / stiffness[i]
            continue
        stored[i] = 0.5 * strength * strength / stiffness[i]
        sign = 1.0 if spring > 0.0 else -1.0
        # slip begins where k (o - p) = +-h(o); this opening is unique because k > |h'|
        inside, outside = begin[i], opening[i]
        for _ in range(_BISECTIONS):
            middle = 0.5 * (inside + outside)
            _, there, _ = evaluate_curve(middle, first, last, knots, coefficients, energies)
            if sign * stiffness[i] * (middle - slider[i]) > there:
                outside = middle
            else:
                inside = middle
        area, there, _ = evaluate_curve(inside, first, last, knots, coefficients, energies)
        dissipated[i] = sign * (end_area - area) - 0.5 * (strength * strength - there * there) / stiffness[i]
    return stored, dissipated


@kernel
def slip_power(opening: np.ndarray, rate: np.ndarray, slider: np.ndarray, law: SliderLaw) -> np.ndarray:
    """Power that every slider dissipates, (m,), W; `rate` of the opening (m,), rad/s, other arguments: `slip_moment`."""
    stiffness, curve, bounds, knots, coefficients, energies = law
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
