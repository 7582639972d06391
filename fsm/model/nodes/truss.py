"""Bars with axial laws between points, for bar-and-hinge models of folded sheets; `fsm.model.nodes.facets.folds` contains
their rotational springs.

A bar of unstressed length L and stiffness E A has the stretch s = l/L and the energy E A L W(s). The laws are as follows;
the last law is that of Liu and Paulino (2017):

    linear   W = (s - 1)^2/2
    green    W = (s^2 - 1)^2/8
    ogden    W = [(s^a - 1)/a - (s^b - 1)/b]/(a - b)

The axial force is E A (W' + tau s') with the Kelvin-Voigt time tau.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_2d
from fsm.kernels.jit import kernel
from fsm.model.nodes.arrays import DAMPERS, DAMPING, FORCE, IN_MOTION, LAST, MEAN_OVER, NUMBERS, STIFFNESS, Q, U
from fsm.model.nodes.group import ElementGroup

_LAWS = ("linear", "green", "ogden")
_LINEAR, _GREEN = 0.0, 1.0
_VISCOSITY = 3
"""Index of tau in `BarArrays.law`."""
_SLOTS = 3
"""Row of a group's table after those of `BarArrays`."""


class BarArrays(NamedTuple):
    """Arrays of m bars for the kernels.

    Attributes
    ----------
    vectors : (m, 2) int array
    sizes : (m, 2) array
        Unstressed length (m) and E A (N).
    law : (4,) array
        Number of the law in the order above, a and b of the last law, and the Kelvin-Voigt time tau (s).
    """

    vectors: np.ndarray
    sizes: np.ndarray
    law: np.ndarray


@kernel
def _power_integral(s: float, a: float) -> float:
    """Integral of s^(a - 1) from 1: (s^a - 1)/a, or log(s) for a = 0."""
    return math.log(s) if a == 0.0 else (s**a - 1.0) / a


@kernel
def _energies(law: np.ndarray, s: float) -> tuple[float, float, float]:
    """W of a stretch, and its first and second derivatives."""
    if law[0] == _LINEAR:
        return 0.5 * (s - 1.0) ** 2, s - 1.0, 1.0
    if law[0] == _GREEN:
        strain = 0.5 * (s * s - 1.0)
        return 0.5 * strain**2, strain * s, strain + s * s
    a, b = law[1], law[2]
    value = (_power_integral(s, a) - _power_integral(s, b)) / (a - b)
    first = (s ** (a - 1.0) - s ** (b - 1.0)) / (a - b)
    return value, first, ((a - 1.0) * s ** (a - 2.0) - (b - 1.0) * s ** (b - 2.0)) / (a - b)


@kernel(inline=True)
def _length(vectors: np.ndarray, q: np.ndarray, along: np.ndarray) -> float:
    """Length of a bar, and its direction (3,)."""
    total = 0.0
    for a in range(3):
        along[a] = q[vectors[1] + a] - q[vectors[0] + a]
        total += along[a] * along[a]
    total = math.sqrt(total)
    for a in range(3):
        along[a] /= total
    return total


@kernel
def _stretches(bars: BarArrays, q: np.ndarray) -> np.ndarray:
    along, out = np.empty(3), np.empty(bars.vectors.shape[0])
    for k in range(out.shape[0]):
        out[k] = _length(bars.vectors[k], q, along) / bars.sizes[k, 0]
    return out


@kernel
def _forces(bars: BarArrays, q: np.ndarray) -> np.ndarray:
    out = _stretches(bars, q)
    for k in range(out.shape[0]):
        out[k] = bars.sizes[k, 1] * _energies(bars.law, out[k])[1]
    return out


@kernel
def stretch_rates(bars: BarArrays, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Rates of the stretches, (m,), 1/s."""
    along, out = np.empty(3), np.empty(bars.vectors.shape[0])
    for k in range(out.shape[0]):
        _length(bars.vectors[k], q, along)
        total = 0.0
        for a in range(3):
            total += along[a] * (u[bars.vectors[k, 1] + a] - u[bars.vectors[k, 0] + a])
        out[k] = total / bars.sizes[k, 0]
    return out


@kernel
def mean_rates(bars: BarArrays, q: np.ndarray, last: np.ndarray, duration: float) -> np.ndarray:
    """Mean rates of the stretches since the coordinates `last`, (m,), 1/s; `duration` in s."""
    now, before = _stretches(bars, q), _stretches(bars, last)
    for k in range(now.shape[0]):
        now[k] = (now[k] - before[k]) / duration
    return now


# on tables --------------------------------------------------------------------------------------------------------------

@kernel
def _bars_of(t: np.ndarray) -> BarArrays:
    return BarArrays(integers_2d(t, 0), floats_2d(t, 1), floats_1d(t, 2))


@kernel
def _rates(table: np.ndarray, bars: BarArrays, moving: float) -> np.ndarray:
    """Rates of the stretches; they are zero at rest, and means over a quasi-static step."""
    if moving < IN_MOTION:
        return np.zeros(bars.vectors.shape[0])
    mean_over = floats_1d(table, NUMBERS)[MEAN_OVER]
    if mean_over > 0.0:
        return mean_rates(bars, floats_1d(table, Q), floats_1d(table, LAST), mean_over)
    return stretch_rates(bars, floats_1d(table, Q), floats_1d(table, U))


@kernel
def _add_forces(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    bars, q, force = _bars_of(own), floats_1d(table, Q), floats_1d(table, FORCE)
    rates, along, elastic = _rates(table, bars, moving), np.empty(3), 0.0 if moving == DAMPERS else 1.0
    for k in range(bars.vectors.shape[0]):
        first, last = bars.vectors[k, 0], bars.vectors[k, 1]
        stretch = _length(bars.vectors[k], q, along) / bars.sizes[k, 0]
        axial = bars.sizes[k, 1] * (elastic * _energies(bars.law, stretch)[1] + bars.law[_VISCOSITY] * rates[k])
        for a in range(3):
            force[first + a] += axial * along[a]
            force[last + a] -= axial * along[a]
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _add_forces(table, own, moving)
    bars, stiffness, damping = _bars_of(own), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    q, u, rates, size = floats_1d(table, Q), floats_1d(table, U), _rates(table, bars, moving), stiffness.shape[1]
    damped, elastic = moving >= IN_MOTION, 0.0 if moving == DAMPERS else 1.0
    turning = damped and floats_1d(table, NUMBERS)[MEAN_OVER] == 0.0  # else the rates do not depend on q by u
    slots = integers_2d(own, _SLOTS).reshape(bars.vectors.shape[0], 2, 2)
    into_stiffness, into_damping = stiffness.reshape(-1), damping.reshape(-1)
    along, across = np.empty(3), np.zeros(3)
    viscosity = bars.law[_VISCOSITY]
    for k in range(bars.vectors.shape[0]):
        length, stiff = bars.sizes[k, 0], bars.sizes[k, 1]
        stretch = _length(bars.vectors[k], q, along) / length
        _, first, second = _energies(bars.law, stretch)
        axial = elastic * stiff * second / length
        aside = stiff * (elastic * first + viscosity * rates[k]) / (stretch * length)
        damper = viscosity * stiff / length
        if turning:
            for a in range(3):
                across[a] = u[bars.vectors[k, 1] + a] - u[bars.vectors[k, 0] + a] - rates[k] * length * along[a]
        for a in range(3):
            for b in range(3):
                dyad = along[a] * along[b]
                value = (axial - aside) * dyad + (aside if a == b else 0.0)
                if turning:
                    value += damper / (stretch * length) * along[a] * across[b]
                for i in range(2):
                    for j in range(2):
                        sign = 1.0 if i == j else -1.0
                        into_stiffness[slots[k, i, j] + a * size + b] += sign * value
                        if damper != 0.0 and damped:
                            into_damping[slots[k, i, j] + a * size + b] += sign * damper * dyad
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    bars, q, along, total = _bars_of(own), floats_1d(table, Q), np.empty(3), 0.0
    for k in range(bars.vectors.shape[0]):
        length, stiff = bars.sizes[k, 0], bars.sizes[k, 1]
        total += stiff * length * _energies(bars.law, _length(bars.vectors[k], q, along) / length)[0]
    return total


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    bars, total = _bars_of(own), 0.0
    rates = _rates(table, bars, moving)
    for k in range(rates.shape[0]):
        total += bars.law[_VISCOSITY] * bars.sizes[k, 0] * bars.sizes[k, 1] * rates[k] * rates[k]
    return total


BARS = (_add_forces, _tangent, _stored, _lost)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""


@dataclass(eq=False)
class BarGroup(ElementGroup):
    """Straight bars between two points each; see the module docstring.

    Attributes
    ----------
    vectors : (m, 2) int array
        First coordinates of the positions.
    length : (m,) array, m
        Unstressed lengths.
    stiffness : (m,) array, N
        E A.
    law : "linear", "green" or "ogden"
    exponents : a and b of "ogden"
    viscosity : s
        Kelvin-Voigt time tau.
    """

    vectors: np.ndarray
    length: np.ndarray
    stiffness: np.ndarray
    law: str = "linear"
    exponents: tuple[float, float] = (5.0, 1.0)
    viscosity: float = 0.0
    name: str = "bars"
    kernels = BARS

    def forces(self, q: np.ndarray) -> np.ndarray:
        """Axial force of every bar at rest, (m,), N; tension is positive."""
        return np.asarray(_forces(self.arrays, q))

    @cached_property
    def arrays(self) -> BarArrays:
        """Arrays of the kernels."""
        sizes = np.ascontiguousarray(np.column_stack([self.length, self.stiffness]))
        law = np.array([float(_LAWS.index(self.law)), *self.exponents, self.viscosity])
        return BarArrays(np.ascontiguousarray(self.vectors), sizes, law)
