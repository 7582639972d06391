"""Friction sliders of creases with their memory: the law of `fsm.laws.crease_hysteresis` along a path of accepted states.

The memory of (m,) sliders is one array (1 + 3 m,) that is changed in place: the time of the last accepted state (s, NaN
before the first), openings and sliders there (rad), and the energies dissipated in the last step (J), which may be asked for
after the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d
from fsm.kernels.jit import kernel
from fsm.laws.crease import CurveTable
from fsm.laws.crease_hysteresis import slip_energy, slip_moment, slip_power

_SAME = 1e-9
"""Tolerance of equal times, relative to a step."""


class Sliders(NamedTuple):
    """Sliders of (m,) creases.

    Attributes
    ----------
    stiffness : (m,) array, N m/rad
    curve : (m,) int array
        Strength of each slider in the table of curves.
    bounds, knots, coefficients, energies : arrays of the `CurveTable` of strengths
    memory : (1 + 3 m,) array, changed in place
    first : (1 + 3 m,) array
        Memory at the start.
    """

    stiffness: np.ndarray
    curve: np.ndarray
    bounds: np.ndarray
    knots: np.ndarray
    coefficients: np.ndarray
    energies: np.ndarray
    memory: np.ndarray
    first: np.ndarray


def new_sliders(start: np.ndarray, stiffness: np.ndarray, curve: np.ndarray, table: CurveTable) -> Sliders:
    """Sliders that start on the loading curve at the openings `start` (m,), rad; other arguments as in `Sliders`."""
    law = stiffness, curve, table.bounds, table.knots, table.coefficients, table.energies
    # a slider that is stretched beyond its strength lies on the loading curve
    _, _, slider = slip_moment(start, np.full(len(start), -np.inf), law)
    first = np.concatenate([[np.nan], start, slider, np.zeros(len(start))])
    return Sliders(*law, first.copy(), first)


def no_sliders() -> Sliders:
    """Empty arrays."""
    none, table = np.zeros(0), CurveTable(np.zeros(1, dtype=np.int64), np.zeros(0), np.zeros((0, 4)), np.zeros(0))
    return Sliders(
        none, np.zeros(0, dtype=np.int64), table.bounds, table.knots, table.coefficients, table.energies, np.full(1, np.nan),
        np.full(1, np.nan),
    )  # fmt: skip


@kernel
def sliders_of(t: np.ndarray, k: int) -> Sliders:
    """Sliders in a table of `fsm.kernels.addresses`, from row k on."""
    return Sliders(
        floats_1d(t, k), integers_1d(t, k + 1), integers_1d(t, k + 2), floats_1d(t, k + 3), floats_2d(t, k + 4),
        floats_1d(t, k + 5), floats_1d(t, k + 6), floats_1d(t, k + 7),
    )  # fmt: skip


@kernel(inline=True)
def _part(s: Sliders, number: int) -> np.ndarray:
    """Openings (0), sliders (1) or dissipated energies (2) in the memory."""
    count = s.stiffness.shape[0]
    return s.memory[1 + number * count : 1 + (number + 1) * count]


@kernel
def slider_moments(s: Sliders, opening: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Moments (m,) against the opening, N m, and their slopes, N m/rad."""
    law = s.stiffness, s.curve, s.bounds, s.knots, s.coefficients, s.energies
    moment, slope, _ = slip_moment(opening, _part(s, 1), law)
    return moment, slope


@kernel
def slider_energy(
    s: Sliders, t: float, opening: np.ndarray, rate: np.ndarray, per_second: float, other: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Stored energy (J) and dissipated power (W), (m,) arrays.

    Parameters
    ----------
    s : Sliders
    t : s
    opening, rate : (m,) arrays, rad and rad/s
    per_second : 1/s
        Inverse of the time since the other end of a step, negative at its begin: the power is the exact mean of the step. If
        zero, the power is that of these rates.
    other : (m,) array, rad
        Openings at the other end of the step.
    """
    law = s.stiffness, s.curve, s.bounds, s.knots, s.coefficients, s.energies
    begin, slider, time = _part(s, 0), _part(s, 1), s.memory[0]
    stored, lost = slip_energy(begin, opening, slider, law)
    if per_second == 0.0:
        return stored, slip_power(opening, rate, slider, law)
    # a step may be evaluated before or after its acceptance
    end = t if per_second > 0.0 else t - 1.0 / per_second
    if abs(time - end) * abs(per_second) <= _SAME:
        lost = _part(s, 2)
    elif time > t and per_second > 0.0:  # within an accepted step
        return stored, _part(s, 2) / (time - t + 1.0 / per_second)
    elif per_second < 0.0:
        lost = slip_energy(begin, other, slider, law)[1]
    return stored, lost * abs(per_second)


@kernel
def accept_sliders(s: Sliders, t: float, opening: np.ndarray) -> None:
    """Store the positions of the sliders in an accepted state."""
    law = s.stiffness, s.curve, s.bounds, s.knots, s.coefficients, s.energies
    slider = _part(s, 1)
    _, lost = slip_energy(_part(s, 0), opening, slider, law)
    _, _, moved = slip_moment(opening, slider, law)
    s.memory[0] = t
    _part(s, 0)[:] = opening
    slider[:] = moved
    _part(s, 2)[:] = lost
