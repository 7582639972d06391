"""Gas in chambers of given volumes: pressure, supply, flow through orifices, and energy.

The state of a chamber is the mass m of its gas and, if it is adiabatic, s = p V^gamma. Without supply and flow both are
constant. With flows m'_k, positive into the chamber, of gas of temperature T_k,

    m' = sum m'_k,    s' = (gamma - 1) V^(gamma - 1) sum m'_k c_p T_k

which is the energy equation (m c_v T)' = sum m'_k c_p T_k - p V'. A step from the last accepted state integrates both.
Without orifices the mass follows from the program; the factor V^(gamma - 1) is the mean of its values at both ends. With
orifices the step has two implicit stages of second order (SDIRK, L-stable: Alexander, 1977), between which the volume
changes linearly. The flows between two chambers cancel, so the mass is conserved to round-off.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fsm.case.models.gas import OUTSIDE, Gas, Orifice
from fsm.kernels.addresses import floats_1d, floats_2d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at, program_at
from fsm.kernels.programs import Pieces, Program, table_of
from fsm.kernels.small_blocks import solve_dense
from fsm.model.bodies.drive import time_function

_STAGE = 1.0 - math.sqrt(0.5)
_LAMINAR = 0.999
"""Ratio of pressures above which the flow is proportional to their difference."""
_PIECES = 4.0
"""Parts of a step for each relative change of a mass or energy by 1."""
_MOST_PIECES = 1000
_NO_TIME = 1e-12
"""Length of a step in which nothing flows, s."""
_NEWTON = 30
_TOLERANCE = 1e-13
_ISOTHERMAL, _ADIABATIC, HELD = 0.0, 1.0, 2.0
"""Kinds of a gas: the supply of the last kind holds the pressure."""
KIND, _CONSTANT, _RATIO, _WARMTH, ABOVE, _FIRST_VOLUME = range(6)
"""Columns of `GasArrays.laws`."""


class GasArrays(NamedTuple):
    """Arrays of the gases of k chambers with n orifices.

    Attributes
    ----------
    laws : (k, 6) array
        Kind, gas constant (J/(kg K)), heat ratio, temperature of the supply (K), pressure outside (Pa), and volume at the
        start (m^3).
    ends : (n, 2) int array
        Chambers at both ends of each orifice; k is the outside.
    discharge : (n,) array
    supplies : one program for each gas
        Pressure that the supply holds (Pa), or mass of gas given since time zero (kg).
    last : (1 + 3 k + n,) array
        Time, volumes, masses, p V^gamma and areas of orifices of the last accepted state.
    """

    laws: np.ndarray
    ends: np.ndarray
    discharge: np.ndarray
    supplies: Pieces
    last: np.ndarray


GAS_ROWS = 4 + len(Pieces._fields)
"""Number of rows of `GasArrays` in a table."""


@kernel
def gases_of(t: np.ndarray, k: int) -> GasArrays:
    """Gases in a table of `fsm.kernels.addresses`, from row k on."""
    return GasArrays(
        floats_2d(t, k), integers_2d(t, k + 1), floats_1d(t, k + 2), pieces_at(t, k + 3), floats_1d(t, k + GAS_ROWS - 1)
    )


class GasState(NamedTuple):
    """State of all chambers at a time, (k,) arrays.

    Attributes
    ----------
    volume, mass, entropy : m^3, kg, Pa m^(3 gamma)
        Volume of each chamber, mass of its gas, and p V^gamma as a measure of the entropy.
    pressure, temperature : Pa, K
    by_volume : (k, k) array, Pa/m^3
        Derivatives of the pressures with respect to the volumes.
    by_area : (k, n) array, Pa/m^2
        Derivatives with respect to the areas of the orifices.
    area : (n,) array, m^2
        Areas of the orifices.
    by_time : Pa/s
        Derivatives of the pressures with respect to the time, at given volumes.
    """

    volume: np.ndarray
    mass: np.ndarray
    entropy: np.ndarray
    pressure: np.ndarray
    temperature: np.ndarray
    by_volume: np.ndarray
    by_area: np.ndarray
    area: np.ndarray
    by_time: np.ndarray


@kernel
def nozzle(before: float, behind: float, warmth: float, ratio: float) -> tuple[float, float, float, float]:
    """Mass flow per area through a nozzle, kg/(m^2 s), and its derivatives.

    Parameters
    ----------
    before, behind : pressures on both sides of the nozzle, Pa; `before` is the larger pressure
    warmth : R T before the nozzle, J/kg
    ratio : heat ratio gamma

    Returns
    -------
    flow, and its derivatives with respect to the three parameters
    """
    if not before > 0.0:
        return 0.0, 0.0, 0.0, 0.0
    critical = (2.0 / (ratio + 1.0)) ** (ratio / (ratio - 1.0))
    pi = behind / before
    if pi > _LAMINAR:
        psi, _ = _nozzle_factor(_LAMINAR, ratio)
        by_pi = -psi / (1.0 - _LAMINAR)
        psi = by_pi * (pi - 1.0)
    elif pi > critical:
        psi, by_pi = _nozzle_factor(pi, ratio)
    else:
        psi, by_pi = _nozzle_factor(critical, ratio)[0], 0.0
    scale = 1.0 / math.sqrt(warmth)
    flow = before * scale * psi
    return flow, scale * (psi - pi * by_pi), scale * by_pi, -0.5 * flow / warmth


@kernel
def _nozzle_factor(pi: float, ratio: float) -> tuple[float, float]:
    """sqrt(2 g/(g - 1) (pi^(2/g) - pi^((g + 1)/g))) and its slope."""
    one, two = 2.0 / ratio, (ratio + 1.0) / ratio
    scale = 2.0 * ratio / (ratio - 1.0)
    psi = math.sqrt(scale * (pi**one - pi**two))
    return psi, 0.5 * scale * (one * pi ** (one - 1.0) - two * pi ** (two - 1.0)) / psi


@kernel
def _given(g: GasArrays, i: int, t: float) -> tuple[float, float]:
    """Mass of gas that the supply has given since time zero, kg, and its rate."""
    if g.laws[i, KIND] == HELD:
        return 0.0, 0.0
    mass, flow, _ = program_at(g.supplies, i, t)
    return mass, flow


@kernel
def _heat(law: np.ndarray) -> float:
    """(gamma - 1) c_p T of the supply, J/kg."""
    return float(law[_RATIO] * law[_CONSTANT] * law[_WARMTH])


@kernel
def _pressure(law: np.ndarray, volume: float, mass: float, entropy: float, partial: np.ndarray) -> float:
    """Pressure of a gas whose supply does not hold it; writes its derivatives (3,) by mass, p V^gamma and volume."""
    if law[KIND] == _ADIABATIC:
        power = volume ** -law[_RATIO]
        pressure = entropy * power
        partial[0], partial[1], partial[2] = 0.0, power, -law[_RATIO] * pressure / volume
        return float(pressure)
    warmth = law[_CONSTANT] * law[_WARMTH]
    pressure = mass * warmth / volume
    partial[0], partial[1], partial[2] = warmth / volume, 0.0, -pressure / volume
    return float(pressure)


@kernel
def _temperature(law: np.ndarray, volume: float, mass: float, pressure: float) -> float:
    """Temperature of a gas, K."""
    if law[KIND] == _ADIABATIC and mass > 0.0:
        return float(pressure * volume / (mass * law[_CONSTANT]))
    return float(law[_WARMTH])


GAS_STATE = len(GasState._fields)


@kernel
def gas_state_of(t: np.ndarray, k: int) -> GasState:
    """State in a table of `fsm.kernels.addresses`, from row k on."""
    return GasState(
        floats_1d(t, k), floats_1d(t, k + 1), floats_1d(t, k + 2), floats_1d(t, k + 3), floats_1d(t, k + 4),
        floats_2d(t, k + 5), floats_2d(t, k + 6), floats_1d(t, k + 7), floats_1d(t, k + 8),
    )  # fmt: skip


def empty_state(chambers: int, orifices: int) -> GasState:
    """Arrays of a state, filled with zeros."""
    one, area = (chambers,), (orifices,)
    shapes = one, one, one, one, one, (chambers, chambers), (chambers, orifices), area, one
    return GasState(*map(np.zeros, shapes))


@kernel
def set_state(g: GasArrays, t: float, s: GasState) -> None:
    """Write the state at a time (s), with given volumes and areas of orifices."""
    volume, area = s.volume, s.area
    count, many = volume.shape[0], volume.shape[0] + area.shape[0]
    s.by_volume[:], s.by_area[:] = 0.0, 0.0
    drivers, y, by_drivers, rates = np.empty(many), np.empty(2 * count), np.zeros((2 * count, many)), np.zeros(2 * count)
    for i in range(count):
        drivers[i] = volume[i] if volume[i] > 0.0 else np.nan
    drivers[count:] = area
    if area.shape[0] > 0:
        _with_flow(g, t, drivers, y, by_drivers, rates)
    else:
        for i in range(count):
            less, size, (mass, flow) = g.laws[i, _RATIO] - 1.0, drivers[i], _given(g, i, t)
            given, heat = mass - _given(g, i, g.last[0])[0], _heat(g.laws[i])
            mean = 0.5 * (g.last[1 + i] ** less + size**less)
            y[i], y[count + i] = g.last[1 + count + i] + given, g.last[1 + 2 * count + i] + heat * given * mean
            by_drivers[count + i, i] = heat * given * (0.5 * less * size ** (less - 1.0))
            rates[i], rates[count + i] = flow, heat * flow * mean
    partial = np.empty(3)
    for i in range(count):
        s.mass[i], s.entropy[i] = y[i], y[count + i]
        if g.laws[i, KIND] == HELD:
            s.pressure[i], s.by_time[i], _ = program_at(g.supplies, i, t)
            warmth = g.laws[i, _CONSTANT] * g.laws[i, _WARMTH]
            s.mass[i] = s.pressure[i] * max(volume[i], 0.0) / warmth
        else:
            s.pressure[i] = _pressure(g.laws[i], drivers[i], y[i], y[count + i], partial)
            s.by_time[i] = partial[0] * rates[i] + partial[1] * rates[count + i]
            for j in range(many):
                slope = partial[0] * by_drivers[i, j] + partial[1] * by_drivers[count + i, j]
                if j < count:
                    s.by_volume[i, j] = slope + partial[2] if i == j else slope
                else:
                    s.by_area[i, j - count] = slope
        s.temperature[i] = _temperature(g.laws[i], drivers[i], s.mass[i], s.pressure[i])


# flow -------------------------------------------------------------------------------------------------------------------


@kernel
def _with_flow(
    g: GasArrays, t: float, drivers: np.ndarray, y: np.ndarray, dy: np.ndarray, rates: np.ndarray
) -> None:
    """Write mass and p V^gamma (2 k,) after a step, with derivatives (2 k, k + n), zero before, and (2 k,) by time.

    `drivers` (k + n,) are the volumes and the areas of the orifices at the end; the first derivatives refer to these.
    """
    many, size = drivers.shape[0], y.shape[0]
    count, begin = size // 2, g.last[0]
    start, before, step = g.last[1 + count : 1 + 3 * count], np.empty(many), t - begin
    before[:count], before[count:] = g.last[1 : 1 + count], g.last[1 + 3 * count :]
    by_y, by_v, supply = np.empty((size, size)), np.empty((size, many)), np.empty(count)
    for i in range(count):
        supply[i] = _given(g, i, t)[1]
    y[:] = start
    if abs(step) <= _NO_TIME:
        _rates(g, t, drivers, start, supply, rates, by_y, by_v)
        return
    pieces, right, first = _pieces(g, t, before, supply, step), np.empty(size), np.empty(count)
    matrix, now, done = np.empty((size, size)), np.empty(many), np.empty((size, many))
    for piece in range(pieces):
        h, at = step / pieces, begin + piece / pieces * step
        part, rest = _STAGE * h, (1.0 - _STAGE) * h
        right[:] = y
        for stage in range(2):
            way = (piece + (_STAGE if stage == 0 else 1.0)) / pieces
            now[:] = before + way * (drivers - before)
            for i in range(count):
                mass = _given(g, i, at)[0]
                if stage == 0:
                    first[i] = supply[i] = (_given(g, i, at + part)[0] - mass) / part
                else:
                    supply[i] = (_given(g, i, at + h)[0] - mass - rest * first[i]) / part
            _stage(g, at + (part if stage == 0 else h), now, right, part, supply, y, rates, by_y, by_v)
            done[:] = dy + part * way * by_v
            for i in range(size):
                for j in range(size):
                    matrix[i, j] = (1.0 if i == j else 0.0) - part * by_y[i, j]
            solve_dense(matrix, done)
            if stage == 0:
                for i in range(size):
                    right[i] += rest * rates[i]
                    for j in range(many):
                        for k in range(size):
                            dy[i, j] += rest * by_y[i, k] * done[k, j]
                        dy[i, j] += rest * way * by_v[i, j]
            else:
                dy[:] = done


@kernel
def _pieces(g: GasArrays, t: float, drivers: np.ndarray, supply: np.ndarray, step: float) -> int:
    """Number of parts of a step in which masses and energies change by a moderate factor."""
    count = supply.shape[0]
    start, rates = g.last[1 + count : 1 + 3 * count], np.empty(2 * count)
    _rates(g, t, drivers, start, supply, rates, np.empty((2 * count, 2 * count)), np.empty((2 * count, drivers.shape[0])))
    change = 0.0
    for half in range(2):
        mean = start[half * count : (half + 1) * count].mean()
        for i in range(half * count, (half + 1) * count):
            scale = max(start[i], 0.1 * mean)
            part = abs(step) * abs(rates[i] / (scale if scale > 0.0 else 1.0))
            if not math.isfinite(part):
                return 1
            change = max(change, part)
    return int(min(max(math.ceil(_PIECES * change), 1), _MOST_PIECES))


@kernel
def _stage(
    g: GasArrays, t: float, drivers: np.ndarray, start: np.ndarray, part: float, supply: np.ndarray, y: np.ndarray,
    rates: np.ndarray, by_y: np.ndarray, by_v: np.ndarray,
) -> None:  # fmt: skip
    """Write the solution of y = start + part f(y) by Newton's method, with f, df/dy and derivatives by the drivers."""
    size = start.shape[0]
    matrix, change = np.empty((size, size)), np.empty((size, 1))
    y[:] = start
    for _ in range(_NEWTON):
        _rates(g, t, drivers, y, supply, rates, by_y, by_v)
        for i in range(size):
            change[i, 0] = start[i] + part * rates[i] - y[i]
            for j in range(size):
                matrix[i, j] = (1.0 if i == j else 0.0) - part * by_y[i, j]
        solve_dense(matrix, change)
        largest = 0.0
        for i in range(size):
            # a chamber loses at most nine tenths of its gas in an iteration
            by = max(change[i, 0], -0.9 * max(y[i], 0.0))
            y[i] += by
            largest = max(largest, abs(by) / max(abs(start[i]), 1e-30))
        if not largest > _TOLERANCE:
            break
    _rates(g, t, drivers, y, supply, rates, by_y, by_v)
    for i in range(size):
        y[i] = start[i] + part * rates[i]


@kernel
def _at(g: GasArrays, pressure: np.ndarray, end: int, other: int) -> float:
    """Pressure at an end of an orifice, Pa."""
    return float(pressure[end] if end < pressure.shape[0] else g.laws[other, ABOVE])


@kernel
def _ends(g: GasArrays, k: int, pressure: np.ndarray) -> tuple[int, int, int]:
    """Ends of an orifice with the larger and the smaller pressure, and the chamber whose gas flows."""
    a, b = g.ends[k, 0], g.ends[k, 1]
    up, down = (a, b) if _at(g, pressure, a, b) >= _at(g, pressure, b, a) else (b, a)
    return up, down, up if up < pressure.shape[0] else down


@kernel
def _rates(
    g: GasArrays, t: float, drivers: np.ndarray, y: np.ndarray, supply: np.ndarray, rates: np.ndarray, by_y: np.ndarray,
    by_v: np.ndarray,
) -> None:  # fmt: skip
    """Write the rates f (2 k,) of masses and p V^gamma, and derivatives by these and by the drivers (2 k, k + n)."""
    count = supply.shape[0]
    pressure, by_state, grown = np.empty(count), np.zeros((count, 3)), np.empty(count)
    warmth, by_warmth = np.empty(count), np.zeros((count, 3))  # R T
    by_y[:], by_v[:] = 0.0, 0.0
    for i in range(count):
        law, volume, mass = g.laws[i], drivers[i], y[i]
        if law[KIND] == HELD:
            pressure[i] = program_at(g.supplies, i, t)[0]
            warmth[i] = law[_CONSTANT] * law[_WARMTH]
        else:
            pressure[i] = _pressure(law, volume, mass, y[count + i], by_state[i])
            warmth[i] = law[_CONSTANT] * _temperature(law, volume, mass, pressure[i])
        if law[KIND] == _ADIABATIC and mass > 0.0:
            by_warmth[i, 0] = (by_state[i, 0] * volume - warmth[i]) / mass
            by_warmth[i, 1] = by_state[i, 1] * volume / mass
            by_warmth[i, 2] = (by_state[i, 2] * volume + pressure[i]) / mass
        less = law[_RATIO] - 1.0
        grown[i] = less * volume**less * law[_RATIO] / less if law[KIND] == _ADIABATIC else 0.0
        heat = grown[i] * law[_CONSTANT] * law[_WARMTH] * supply[i]
        rates[i], rates[count + i] = supply[i], heat
        by_v[count + i, i] = less / volume * heat
    for k in range(g.discharge.shape[0]):
        _add_flow(g, k, drivers, pressure, by_state, warmth, by_warmth, grown, rates, by_y, by_v)


@kernel
def _add_flow(
    g: GasArrays, k: int, drivers: np.ndarray, pressure: np.ndarray, by_state: np.ndarray, warmth: np.ndarray,
    by_warmth: np.ndarray, grown: np.ndarray, rates: np.ndarray, by_y: np.ndarray, by_v: np.ndarray,
) -> None:  # fmt: skip
    """Add the flow through an orifice; `grown` (k,) are the factors gamma V^(gamma - 1) of adiabatic gases, else 0."""
    count, size = pressure.shape[0], by_v.shape[1]
    up, down, gas = _ends(g, k, pressure)
    out = g.laws[gas, _CONSTANT] * g.laws[gas, _WARMTH] if up == count else warmth[up]
    ends = _at(g, pressure, up, down), _at(g, pressure, down, up)
    one, by_up, by_down, by_out = nozzle(ends[0], ends[1], out, g.laws[gas, _RATIO])
    open_ = g.discharge[k] * drivers[count + k]
    flow, of_y, of_v = open_ * one, np.zeros(2 * count), np.zeros(size)
    heat_y, heat_v = np.zeros(2 * count), np.zeros(size)  # of R T of the gas that flows
    of_v[count + k] = g.discharge[k] * one
    for end, slope in ((up, open_ * by_up), (down, open_ * by_down)):
        if end < count:
            of_y[end] += slope * by_state[end, 0]
            of_y[count + end] += slope * by_state[end, 1]
            of_v[end] += slope * by_state[end, 2]
    if up < count:
        heat_y[up], heat_y[count + up], heat_v[up] = by_warmth[up, 0], by_warmth[up, 1], by_warmth[up, 2]
        of_y += open_ * by_out * heat_y
        of_v += open_ * by_out * heat_v
    for end, sense in ((up, -1.0), (down, 1.0)):
        if end == count:
            continue
        factor = sense * grown[end]
        rates[end] += sense * flow
        by_y[end] += sense * of_y
        by_v[end] += sense * of_v
        rates[count + end] += factor * out * flow
        by_y[count + end] += factor * (out * of_y + flow * heat_y)
        by_v[count + end] += factor * (out * of_v + flow * heat_v)
        by_v[count + end, end] += factor * (g.laws[end, _RATIO] - 1.0) / drivers[end] * out * flow


# energy -----------------------------------------------------------------------------------------------------------------


@kernel
def _compressed(law: np.ndarray, volume: float) -> float:
    """ln(V0/V) of a chamber."""
    return math.log(law[_FIRST_VOLUME] / volume) if law[_FIRST_VOLUME] > 0.0 and volume > 0.0 else np.nan


@kernel
def gas_energies(g: GasArrays, s: GasState) -> np.ndarray:
    """Energy of every gas and of the surroundings that it displaces, J.

    Isothermal: m R T ln(V0/V), the work that compresses the gas from the volume V0 of the chamber at the start. It is
    the free energy without a function of the mass alone, and is finite for an empty chamber. Adiabatic: m c_v T.
    """
    out = np.zeros(s.volume.shape[0])
    for i in range(out.shape[0]):
        law = g.laws[i]
        if law[KIND] != HELD:
            adiabatic = law[KIND] == _ADIABATIC
            factor = 1.0 / (law[_RATIO] - 1.0) if adiabatic else _compressed(law, s.volume[i])
            out[i] = s.pressure[i] * s.volume[i] * factor + law[ABOVE] * s.volume[i]
    return out


@kernel
def gas_power(g: GasArrays, t: float, s: GasState, span: float) -> float:
    """Power of the supply and of flow through orifices, W.

    A mass that enters an isothermal chamber brings the energy R T ln(V0/V) for each kg, and takes it along through an
    orifice. The supply is the mean of the `span` (s) between another time and t, or its value at t if `span` is zero.
    """
    count, total, level, at = s.volume.shape[0], 0.0, np.zeros(s.volume.shape[0]), t
    if t > 0.0:  # the rate before a break
        at = t - math.ldexp(1.0, math.frexp(t)[1] - 53)
    for i in range(count):
        law = g.laws[i]
        if law[KIND] == HELD:
            continue
        flow = (_given(g, i, t)[0] - _given(g, i, t - span)[0]) / span if span != 0.0 else _given(g, i, at)[1]
        level[i] = law[_CONSTANT] * law[_WARMTH] * _compressed(law, s.volume[i])
        if flow != 0.0:
            heat = _heat(law) / (law[_RATIO] - 1.0)
            total += flow * (heat if law[KIND] == _ADIABATIC else level[i])
    for k in range(g.discharge.shape[0]):
        up, down, gas = _ends(g, k, s.pressure)
        out = g.laws[gas, _CONSTANT] * (g.laws[gas, _WARMTH] if up == count else s.temperature[up])
        ends = _at(g, s.pressure, up, down), _at(g, s.pressure, down, up)
        through = g.discharge[k] * s.area[k] * nozzle(ends[0], ends[1], out, g.laws[gas, _RATIO])[0]
        for end, sense in ((up, -1.0), (down, 1.0)):
            if end < count and g.laws[end, KIND] != HELD:
                capacity = g.laws[end, _RATIO] / (g.laws[end, _RATIO] - 1.0)
                total += sense * through * (capacity * out if g.laws[end, KIND] == _ADIABATIC else level[end])
    return total


@kernel
def accept_gas(g: GasArrays, t: float, s: GasState) -> None:
    """Accept a state."""
    count = s.volume.shape[0]
    g.last[0] = t
    for i in range(count):
        g.last[1 + i], g.last[1 + count + i], g.last[1 + 2 * count + i] = s.volume[i], s.mass[i], s.entropy[i]
    g.last[1 + 3 * count :] = s.area


class Gases:
    """Gases of all chambers, with their state at the last accepted time.

    Parameters
    ----------
    gases : tuple of Gas
    orifices : tuple of Orifice
    volume, area : (k,) and (n,) arrays, m^3 and m^2
        Volumes of the chambers and areas of the orifices at the start.

    Attributes
    ----------
    arrays : GasArrays
    start : the array `GasArrays.last` at the start
    """

    def __init__(self, gases: tuple[Gas, ...], orifices: tuple[Orifice, ...], volume: np.ndarray, area: np.ndarray) -> None:
        names = [gas.name for gas in gases] + [OUTSIDE]
        ends = [[names.index(name) for name in orifice.between] for orifice in orifices]
        kinds = [HELD if gas.supply_pressure is not None else float(gas.law == "adiabatic") for gas in gases]
        own = [[gas.gas_constant, gas.heat_ratio, gas.temperature, gas.outside_pressure] for gas in gases]
        laws = np.column_stack([kinds, np.reshape(own, (-1, 4)), volume])
        self.programs = tuple(_supply(gas) for gas in gases)
        held, given = laws[:, KIND] == HELD, np.array([program.at(0.0)[0] for program in self.programs])
        pressure = np.where(held & (given != 0.0), given, [gas.at_start for gas in gases])
        warmth = laws[:, _CONSTANT] * laws[:, _WARMTH]
        mass = pressure * volume / warmth + np.where(held, 0.0, given)
        pressure = np.where(volume > 0.0, mass * warmth / np.where(volume > 0.0, volume, 1.0), pressure)
        self.start = np.concatenate([[0.0], volume, mass, pressure * volume ** laws[:, _RATIO], area])
        self.arrays = GasArrays(
            laws, np.array(ends, dtype=np.int64).reshape(-1, 2), np.array([one.discharge for one in orifices], dtype=float),
            table_of(self.programs), self.start.copy(),
        )  # fmt: skip

    @property
    def table(self) -> list[np.ndarray]:
        """Arrays in the order of the rows of `gases_of`."""
        laws, ends, discharge, supplies, last = self.arrays
        return [laws, ends, discharge, *supplies, last]

    def break_times(self) -> list[float]:
        """Times at which a supply is not smooth, s."""
        return sorted({time for program in self.programs for time in program.breaks()})


def _supply(gas: Gas) -> Program:
    """Pressure that the supply holds (Pa), or mass of gas given since time zero (kg), over time."""
    time = time_function(gas.time)
    if gas.supply_flow is not None:
        return time.integral().scaled(gas.supply_flow)
    return time.scaled(gas.supply_pressure or gas.supply_mass or 0.0)
