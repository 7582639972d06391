"""Moment of a crease as a function of its opening, from a table.

A curve is M(o). The opening o = rest - s psi is the rotation of the crease from its rest angle towards flat. The sign s is
the side to which the crease is folded. The table includes the series flexibility of half cells (`add_flexibility`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d
from fsm.kernels.interpolation import PiecewiseCubic, hermite_cubic, interpolate
from fsm.kernels.jit import kernel
from fsm.kernels.spline import evaluate_curve


@dataclass(frozen=True)
class MomentCurve:
    """Piecewise cubic M(o): `knots` (n,) rad, `coefficients` (n, 4), `energies` (n,) J; see `evaluate_curve`."""

    knots: np.ndarray
    coefficients: np.ndarray
    energies: np.ndarray

    def __call__(self, opening: float) -> tuple[float, float, float]:
        """Energy (J), moment (N m) and slope (N m/rad) at an opening (rad)."""
        energy, moment, slope = evaluate_curve(
            float(opening), 0, len(self.knots), self.knots, self.coefficients, self.energies
        )
        return energy, moment, slope


def curve_from_data(angle: np.ndarray, moment: np.ndarray, interpolation: str = "cubic") -> MomentCurve:
    """Interpolation of measured moments with linear extrapolation and exact integral.

    Parameters
    ----------
    angle : (n,) array, rad, increasing
    moment : (n,) array, N m
    interpolation : "cubic" (not-a-knot, C2) or "pchip" (C1, monotone where the data are monotone)

    Notes
    -----
    The energy is zero at zero opening, even if the data begin elsewhere.
    """
    return curve_from_cubic(interpolate(angle, moment, interpolation))


def curve_from_cubic(cubic: PiecewiseCubic) -> MomentCurve:
    """Curve from cubic pieces, with linear extrapolation."""
    knots = np.ascontiguousarray(cubic.knots)
    last = [0.0, 0.0, float(cubic(knots[-1], 1)), float(cubic(knots[-1]))]
    coefficients = np.vstack([cubic.coefficients.T, last])
    energies = np.concatenate([[0.0], np.cumsum(cubic.integrals())])
    curve = MomentCurve(knots, np.ascontiguousarray(coefficients), energies)
    return MomentCurve(knots, curve.coefficients, energies - curve(0.0)[0])


def add_flexibility(curve: MomentCurve, flexibility: float, subdivisions: int = 32) -> MomentCurve:
    """Curve of a crease in series with a linear flexibility (half-cell correction).

    o_total = o + M(o) f                                               docs/theory.md

    Parameters
    ----------
    curve : Curve
        Curve of the crease alone.
    flexibility : f, rad/(N m)
    subdivisions : int
        New intervals per old interval. Values and slopes are exact at the knots; cubic Hermite interpolation between
        them has an error of O(h^4).

    Raises
    ------
    ValueError
        1 + M' f <= 0: the crease softens so fast that the half segments snap.
    """
    if flexibility == 0.0:
        return curve
    fractions = np.arange(subdivisions) / subdivisions
    widths = np.diff(curve.knots)
    opening = np.append((curve.knots[:-1, None] + widths[:, None] * fractions).ravel(), curve.knots[-1])
    values = np.array([curve(o) for o in opening])
    moment, slope = values[:, 1], values[:, 2]
    stretch = 1.0 + slope * flexibility
    if stretch.min() <= 0.0:
        worst = int(np.argmin(stretch))
        raise ValueError(
            f"at an opening of {np.degrees(opening[worst]):.4g} deg the tangent stiffness of the crease is "
            f"{slope[worst]:.4g} N m/rad; in series with its half segments it must be above {-1.0 / flexibility:.4g}; use "
            "shorter segments or half_cell = false"
        )
    total = opening + moment * flexibility
    return _hermite(total, moment, slope / stretch)


def _hermite(x: np.ndarray, y: np.ndarray, dydx: np.ndarray) -> MomentCurve:
    return curve_from_cubic(hermite_cubic(x, y, dydx))


@dataclass(frozen=True)
class CurveTable:
    """Several curves in common arrays: curve i has the knots ``bounds[i]:bounds[i + 1]``."""

    bounds: np.ndarray
    knots: np.ndarray
    coefficients: np.ndarray
    energies: np.ndarray


def join_curves(curves: list[MomentCurve]) -> CurveTable:
    """Common table of several curves, for the kernels."""
    bounds = np.concatenate([[0], np.cumsum([len(c.knots) for c in curves])]).astype(np.int64)
    return CurveTable(
        bounds,
        np.concatenate([c.knots for c in curves]),
        np.concatenate([c.coefficients for c in curves]),
        np.concatenate([c.energies for c in curves]),
    )


class CreaseLaws(NamedTuple):
    """Laws of (m,) creases, as argument of kernels.

    Attributes
    ----------
    rest, side : (m,) arrays
        Opening o = rest - side psi; side is +1 or -1.
    damping : (m,) array, N m s/rad
    curve : (m,) int array
        Number of each crease's curve in the table.
    bounds, knots, coefficients, energies : arrays of the `CurveTable`
    """

    rest: np.ndarray
    side: np.ndarray
    damping: np.ndarray
    curve: np.ndarray
    bounds: np.ndarray
    knots: np.ndarray
    coefficients: np.ndarray
    energies: np.ndarray


@kernel
def crease_laws_of(t: np.ndarray, k: int) -> CreaseLaws:
    """Laws in a table of `fsm.kernels.addresses`, from row k on."""
    return CreaseLaws(
        floats_1d(t, k), floats_1d(t, k + 1), floats_1d(t, k + 2), integers_1d(t, k + 3), integers_1d(t, k + 4),
        floats_1d(t, k + 5), floats_2d(t, k + 6), floats_1d(t, k + 7),
    )  # fmt: skip


@kernel(inline=True)
def opening_of(law: CreaseLaws, i: int, angle: float) -> float:
    """Opening of crease i at a hinge angle, rad."""
    return float(law.rest[i] - law.side[i] * angle)


@kernel
def openings_of(law: CreaseLaws, chosen: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Openings (n,) of chosen creases from the hinge angles (m,) of all, rad."""
    opening = np.empty(chosen.shape[0])
    for i in range(chosen.shape[0]):
        opening[i] = opening_of(law, chosen[i], angle[chosen[i]])
    return opening


@kernel(inline=True)
def elastic_effort(law: CreaseLaws, i: int, angle: float) -> tuple[float, float, float]:
    """Energy U of crease i at a hinge angle (J), dU/dpsi (N m) and d2U/dpsi2 (N m/rad), without dampers."""
    first, last = law.bounds[law.curve[i]], law.bounds[law.curve[i] + 1]
    opening = opening_of(law, i, angle)
    energy, moment, slope = evaluate_curve(opening, first, last, law.knots, law.coefficients, law.energies)
    return energy, -law.side[i] * moment, slope


@kernel(inline=True)
def crease_effort(law: CreaseLaws, i: int, angle: float, rate: float) -> tuple[float, float]:
    """Moment dU/dpsi + c psi' of crease i (N m), and d2U/dpsi2 (N m/rad)."""
    _, effort, slope = elastic_effort(law, i, angle)
    return effort + law.damping[i] * rate, slope


@kernel
def crease_moment(angle: np.ndarray, rate: np.ndarray, law: CreaseLaws) -> tuple[np.ndarray, np.ndarray]:
    """Moment and stiffness of every crease (`crease_effort`).

    Parameters
    ----------
    angle, rate : (m,) arrays
        Hinge angle psi, rad, and its rate, rad/s.
    law : CreaseLaws

    Returns
    -------
    effort, stiffness : (m, 1) arrays, N m and N m/rad
    """
    effort, stiffness = np.empty((angle.shape[0], 1)), np.empty((angle.shape[0], 1))
    for i in range(angle.shape[0]):
        effort[i, 0], stiffness[i, 0] = crease_effort(law, i, angle[i], rate[i])
    return effort, stiffness
