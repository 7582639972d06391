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
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fsm.case.models.gas import OUTSIDE, Gas, Orifice
from fsm.kernels.programs import Program
from fsm.model.bodies.time_function import time_function

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


@dataclass(frozen=True)
class Supply:
    """Program of a supply: mass (kg) and its rate (kg/s), or pressure (Pa) and its rate."""

    gas: Gas

    @cached_property
    def program(self) -> Program:
        """Pressure that the supply holds (Pa), or mass of gas given since time zero (kg), over time."""
        gas, time = self.gas, time_function(self.gas.time)
        if gas.supply_flow is not None:
            return time.integral().scaled(gas.supply_flow)
        return time.scaled(gas.supply_pressure or gas.supply_mass or 0.0)

    def pressure(self, t: float) -> float | None:
        """Absolute pressure that the supply holds, Pa; None if it gives gas."""
        return None if self.gas.supply_pressure is None else self.program.at(t)[0]

    def pressure_rate(self, t: float) -> float:
        """Rate of this pressure, Pa/s."""
        return 0.0 if self.gas.supply_pressure is None else self.program.at(t)[1]

    def mass(self, t: float) -> float:
        """Mass of gas given since time zero, kg."""
        return self.program.at(t)[0] if self.gas.supply_pressure is None else 0.0

    def flow(self, t: float) -> float:
        """Mass flow, kg/s."""
        return self.program.at(t)[1] if self.gas.supply_pressure is None else 0.0


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
    if before <= 0.0:
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


def _nozzle_factor(pi: float, ratio: float) -> tuple[float, float]:
    """sqrt(2 g/(g - 1) (pi^(2/g) - pi^((g + 1)/g))) and its slope."""
    one, two = 2.0 / ratio, (ratio + 1.0) / ratio
    scale = 2.0 * ratio / (ratio - 1.0)
    psi = math.sqrt(scale * (pi**one - pi**two))
    return psi, 0.5 * scale * (one * pi ** (one - 1.0) - two * pi ** (two - 1.0)) / psi


@dataclass(frozen=True, eq=False)
class GasState:
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


class Gases:
    """Gases of all chambers, with their state at the last accepted time.

    Parameters
    ----------
    gases : tuple of Gas
    orifices : tuple of Orifice
    volume, area : (k,) and (n,) arrays, m^3 and m^2
        Volumes of the chambers and areas of the orifices at the start.
    """

    def __init__(self, gases: tuple[Gas, ...], orifices: tuple[Orifice, ...], volume: np.ndarray, area: np.ndarray) -> None:
        self.gases, self.orifices = gases, orifices
        self.supplies = tuple(Supply(gas) for gas in gases)
        names = [gas.name for gas in gases] + [OUTSIDE]
        self._ends = [tuple(names.index(name) for name in orifice.between) for orifice in orifices]
        self._adiabatic = np.array([gas.law == "adiabatic" for gas in gases])
        self._constant = np.array([gas.gas_constant for gas in gases])
        self._ratio = np.array([gas.heat_ratio for gas in gases])
        self._warmth = np.array([gas.temperature for gas in gases])
        self.holds_pressure = np.array([gas.supply_pressure is not None for gas in gases])
        self.outside = np.array([gas.outside_pressure for gas in gases])
        pressure = np.array([supply.pressure(0.0) or supply.gas.at_start for supply in self.supplies])
        warmth = self._constant * self._warmth
        mass = pressure * volume / warmth + [supply.mass(0.0) for supply in self.supplies]
        pressure = np.where(volume > 0.0, mass * warmth / np.where(volume > 0.0, volume, 1.0), pressure)
        self._start = np.concatenate([[0.0], volume, mass, pressure * volume**self._ratio, area])
        self.last = self._start.copy()

    # memory -----------------------------------------------------------------------------------------------------------

    @property
    def remembered(self) -> int:
        """Size of the memory."""
        return len(self._start)

    def memory(self) -> np.ndarray:
        """Time, volumes, masses, p V^gamma and areas of orifices of the last accepted state."""
        return self.last.copy()

    def restore(self, memory: np.ndarray) -> None:
        """Set the memory; an empty array resets it."""
        self.last = memory.copy() if len(memory) else self._start.copy()

    def commit(self, t: float, volume: np.ndarray, area: np.ndarray) -> None:
        """Accept a state."""
        state = self.state(t, volume, area)
        self.last = np.concatenate([[t], volume, state.mass, state.entropy, area])

    def break_times(self) -> list[float]:
        """Times at which a supply is not smooth, s."""
        return sorted({time for supply in self.supplies for time in supply.program.breaks()})

    # state ------------------------------------------------------------------------------------------------------------

    def state(self, t: float, volume: np.ndarray, area: np.ndarray) -> GasState:
        """State at a time (s), with given volumes (k,), m^3, and areas of orifices (n,), m^2."""
        begin, count = float(self.last[0]), len(self.gases)
        given = np.array([supply.mass(t) - supply.mass(begin) for supply in self.supplies])
        flow = np.array([supply.flow(t) for supply in self.supplies])
        before, mass, entropy = (self.last[1 + k * count : 1 + (k + 1) * count] for k in range(3))
        less = self._ratio - 1.0
        heat = less * self._heat_capacity * self._warmth  # (gamma - 1) c_p T of the supply
        with np.errstate(invalid="ignore", divide="ignore"):
            held = volume > 0.0
            size = np.where(held, volume, np.nan)
            mean, slope_of_mean = 0.5 * (before**less + size**less), 0.5 * less * size ** (less - 1.0)
            if self.orifices:
                mass, entropy, by_drivers, by_time = self._with_flow(t, np.concatenate([size, area]))
            else:
                mass = mass + given
                entropy = entropy + heat * given * mean
                by_drivers = np.stack([np.zeros((count, count)), np.diag(heat * given * slope_of_mean)])
                by_time = np.stack([flow, heat * flow * mean])
            pressure, partial = self._pressure(t, size, mass, entropy)
        total = partial[0, :, None] * by_drivers[0] + partial[1, :, None] * by_drivers[1]
        total[:, :count] += np.diag(partial[2])
        rate = partial[0] * by_time[0] + partial[1] * by_time[1]
        rate = np.where(self.holds_pressure, [supply.pressure_rate(t) for supply in self.supplies], rate)
        total[self.holds_pressure] = 0.0
        mass = np.where(self.holds_pressure, pressure * np.maximum(volume, 0.0) / (self._constant * self._warmth), mass)
        return GasState(
            volume, mass, entropy, pressure, self._temperature(size, mass, pressure)[0], total[:, :count],
            total[:, count:], area, rate,
        )  # fmt: skip

    @property
    def _heat_capacity(self) -> np.ndarray:
        """c_p, J/(kg K)."""
        return self._ratio * self._constant / (self._ratio - 1.0)

    def _pressure(
        self, t: float, volume: np.ndarray, mass: np.ndarray, entropy: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pressures, and their derivatives (3, k) with respect to mass, p V^gamma and volume."""
        warmth = self._constant * self._warmth
        power = volume**-self._ratio
        pressure = np.where(self._adiabatic, entropy * power, mass * warmth / volume)
        none = np.zeros(len(volume))
        partial = np.array([
            np.where(self._adiabatic, none, warmth / volume), np.where(self._adiabatic, power, none),
            np.where(self._adiabatic, -self._ratio, -1.0) * pressure / volume,
        ])  # fmt: skip
        given = np.array([supply.pressure(t) or 0.0 for supply in self.supplies])
        partial[:, self.holds_pressure] = 0.0
        return np.where(self.holds_pressure, given, pressure), partial

    def _temperature(self, volume: np.ndarray, mass: np.ndarray, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Temperatures, and whether they follow from the state."""
        follows = self._adiabatic & ~self.holds_pressure & (mass > 0.0)
        safe = np.where(follows, mass, 1.0)
        return np.where(follows, pressure * volume / (safe * self._constant), self._warmth), follows

    # flow -------------------------------------------------------------------------------------------------------------

    def _with_flow(self, t: float, drivers: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Mass and p V^gamma (k,) after a step, with derivatives (2, k, k + n) and (2, k) by time.

        `drivers` (k + n,) are the volumes and the areas of the orifices at the end; the first derivatives refer to these.
        """
        count, begin = len(self.gases), float(self.last[0])
        start = self.last[1 + count : 1 + 3 * count]
        before = np.concatenate([self.last[1 : 1 + count], self.last[1 + 3 * count :]])
        step = t - begin
        if abs(step) <= _NO_TIME:
            now = self._rates(t, drivers, start, [supply.flow(t) for supply in self.supplies])[0]
            return start[:count], start[count:], np.zeros((2, count, len(drivers))), now.reshape(2, count)
        y, dy, pieces = start, np.zeros((2 * count, len(drivers))), self._pieces(t, before, step)
        for piece in range(pieces):
            h, at = step / pieces, begin + piece / pieces * step
            part, rest = _STAGE * h, (1.0 - _STAGE) * h
            given = [np.array([supply.mass(time) for supply in self.supplies]) for time in (at, at + part, at + h)]
            first = (given[1] - given[0]) / part
            second = (given[2] - given[0] - rest * first) / part
            ways = (piece + _STAGE) / pieces, (piece + 1.0) / pieces
            _, rates, by_y, by_v = self._stage(at + part, before + ways[0] * (drivers - before), y, part, first)
            done = np.linalg.solve(np.eye(2 * count) - part * by_y, dy + part * ways[0] * by_v)
            dy = dy + rest * (by_y @ done + ways[0] * by_v)
            y, rates, by_y, by_v = self._stage(at + h, before + ways[1] * (drivers - before), y + rest * rates, part, second)
            dy = np.linalg.solve(np.eye(2 * count) - part * by_y, dy + part * ways[1] * by_v)
        return y[:count], y[count:], dy.reshape(2, count, -1), rates.reshape(2, count)

    def _pieces(self, t: float, drivers: np.ndarray, step: float) -> int:
        """Number of parts of a step in which masses and energies change by a moderate factor."""
        count = len(self.gases)
        start = self.last[1 + count : 1 + 3 * count]
        rates = self._rates(t, drivers, start, [supply.flow(t) for supply in self.supplies])[0]
        sizes = start.reshape(2, -1)
        scale = np.maximum(sizes, 0.1 * sizes.mean(axis=1)[:, None]).ravel()
        change = abs(step) * np.abs(rates / np.where(scale > 0.0, scale, 1.0)).max(initial=0.0)
        return int(min(max(math.ceil(_PIECES * change), 1), _MOST_PIECES)) if math.isfinite(change) else 1

    def _stage(
        self, t: float, drivers: np.ndarray, start: np.ndarray, part: float, supply: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Solution y of y = start + part f(y) by Newton's method, with df/dy and derivatives with respect to the drivers."""
        y, eye = start.copy(), np.eye(len(start))
        scale = np.maximum(np.abs(start), 1e-30)
        for _ in range(_NEWTON):
            rates, by_y, by_v = self._rates(t, drivers, y, supply)
            change = np.linalg.solve(eye - part * by_y, start + part * rates - y)
            # a chamber loses at most nine tenths of its gas in an iteration
            change = np.maximum(change, -0.9 * np.maximum(y, 0.0))
            y = y + change
            if not np.abs(change / scale).max() > _TOLERANCE:
                break
        rates, by_y, by_v = self._rates(t, drivers, y, supply)
        return start + part * rates, rates, by_y, by_v

    def _rates(
        self, t: float, drivers: np.ndarray, y: np.ndarray, supply: np.ndarray | list[float]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rates f (2 k,) of masses and p V^gamma, and derivatives with respect to these and to the drivers (2 k, k + n)."""
        count = len(self.gases)
        volume, area = drivers[:count], drivers[count:]
        mass, entropy = y[:count], y[count:]
        pressure, by_state = self._pressure(t, volume, mass, entropy)
        warmth, by_warmth = self._warmths(volume, mass, pressure, by_state)
        less, capacity = self._ratio - 1.0, self._heat_capacity / self._constant  # of R T
        grown = np.where(self._adiabatic, less * volume**less, 0.0)
        rates, by_y, by_v = np.zeros(2 * count), np.zeros((2 * count, 2 * count)), np.zeros((2 * count, len(drivers)))
        for i, flow in enumerate(supply):
            heat = grown[i] * capacity[i] * self._constant[i] * self._warmth[i] * flow
            rates[i] += flow
            rates[count + i] += heat
            by_v[count + i, i] += less[i] / volume[i] * heat
        for k, (orifice, (a, b)) in enumerate(zip(self.orifices, self._ends, strict=True)):
            up, down = (a, b) if self._at(pressure, a, b) >= self._at(pressure, b, a) else (b, a)
            gas = up if up < count else down
            out = self._constant[gas] * self._warmth[gas] if up == count else warmth[up]
            one = nozzle(self._at(pressure, up, down), self._at(pressure, down, up), float(out), float(self._ratio[gas]))
            flow, by_up, by_down, by_out = (orifice.discharge * float(area[k]) * x for x in one)
            of_y, of_v = np.zeros(2 * count), np.zeros(len(drivers))
            heat_y, heat_v = np.zeros(2 * count), np.zeros(len(drivers))  # R T of the gas that flows
            of_v[count + k] = orifice.discharge * one[0]
            for end, slope_of in ((up, by_up), (down, by_down)):
                if end < count:
                    of_y[end] += slope_of * by_state[0, end]
                    of_y[count + end] += slope_of * by_state[1, end]
                    of_v[end] += slope_of * by_state[2, end]
            if up < count:
                heat_y[up], heat_y[count + up], heat_v[up] = by_warmth[:, up]
                of_y += by_out * heat_y
                of_v += by_out * heat_v
            for end, sense in ((up, -1.0), (down, 1.0)):
                if end == count:
                    continue
                rates[end] += sense * flow
                by_y[end] += sense * of_y
                by_v[end] += sense * of_v
                factor_of = sense * grown[end] * capacity[end]
                rates[count + end] += factor_of * out * flow
                by_y[count + end] += factor_of * (out * of_y + flow * heat_y)
                by_v[count + end] += factor_of * (out * of_v + flow * heat_v)
                by_v[count + end, end] += factor_of * less[end] / volume[end] * out * flow
        return rates, by_y, by_v

    def _at(self, pressure: np.ndarray, end: int, other: int) -> float:
        """Pressure at an end of an orifice, Pa."""
        return float(pressure[end] if end < len(pressure) else self.outside[other])

    def _warmths(
        self, volume: np.ndarray, mass: np.ndarray, pressure: np.ndarray, by_state: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """R T of every chamber, J/kg, and its derivatives (3, k) with respect to mass, p V^gamma and volume."""
        temperature, follows = self._temperature(volume, mass, pressure)
        warmth, safe = self._constant * temperature, np.where(follows, mass, 1.0)
        partial = np.array([
            by_state[0] * volume / safe - warmth / safe, by_state[1] * volume / safe,
            (by_state[2] * volume + pressure) / safe,
        ])  # fmt: skip
        return warmth, np.where(follows, partial, 0.0)

    # energy -----------------------------------------------------------------------------------------------------------

    def energies(self, state: GasState) -> np.ndarray:
        """Energy of every gas and of the surroundings that it displaces, J.

        Isothermal: m R T ln(V0/V), the work that compresses the gas from the volume V0 of the chamber at the start. It is
        the free energy without a function of the mass alone, and is finite for an empty chamber. Adiabatic: m c_v T.
        """
        of_gas = state.pressure * state.volume
        with np.errstate(invalid="ignore", divide="ignore"):
            stored = of_gas * np.where(self._adiabatic, 1.0 / (self._ratio - 1.0), self._compressed(state.volume))
        return np.where(self.holds_pressure, 0.0, stored + self.outside * state.volume)

    def _compressed(self, volume: np.ndarray) -> np.ndarray:
        """ln(V0/V) of every chamber; 0 at a given pressure."""
        return np.where(self.holds_pressure, 0.0, np.log(self._start[1 : 1 + len(volume)] / volume))

    def power(self, t: float, state: GasState, before: float | None) -> float:
        """Power of the supply and of flow through orifices, W.

        A mass that enters an isothermal chamber brings the energy R T ln(V0/V) for each kg, and takes it along through an
        orifice. The supply is the mean between `before` (s) and t, or its value at t if `before` is None.
        """
        if before is not None and before != t:
            flow = np.array([(supply.mass(t) - supply.mass(before)) / (t - before) for supply in self.supplies])
        else:
            flow = np.array([supply.flow(math.nextafter(t, 0.0) if t > 0.0 else t) for supply in self.supplies])
        with np.errstate(invalid="ignore", divide="ignore"):
            level = self._constant * self._warmth * self._compressed(state.volume)
        warm = np.where(self._adiabatic, self._heat_capacity * self._warmth, level)
        total = float(np.where(self.holds_pressure, 0.0, flow * warm).sum())
        count = len(self.gases)
        for orifice, area, (a, b) in zip(self.orifices, state.area.tolist(), self._ends, strict=True):
            up, down = (a, b) if self._at(state.pressure, a, b) >= self._at(state.pressure, b, a) else (b, a)
            gas = up if up < count else down
            out = self._constant[gas] * (self._warmth[gas] if up == count else state.temperature[up])
            ends = self._at(state.pressure, up, down), self._at(state.pressure, down, up)
            through = orifice.discharge * area * nozzle(*ends, float(out), float(self._ratio[gas]))[0]
            for end, sense in ((up, -1.0), (down, 1.0)):
                if end < count and not self.holds_pressure[end]:
                    capacity = self._heat_capacity[end] / self._constant[end]
                    total += sense * through * float(capacity * out if self._adiabatic[end] else level[end])
        return total
