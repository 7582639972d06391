"""Gas in chambers of given volumes: derivatives, supply, and flow through orifices against closed forms."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from fsm.case.models.gas import Gas, Orifice
from fsm.case.models.time_program import Ramp
from fsm.model.joined.gas import Gases, GasState, accept_gas, empty_state, gas_energies, gas_power, nozzle, set_state

R, T0, G = 287.06, 293.15, 1.4
CHOKED = math.sqrt(G) * (2.0 / (G + 1.0)) ** ((G + 1.0) / (2.0 * (G - 1.0)))


def gas(name: str, pressure: float | None = None, law: str = "isothermal", **more: Any) -> Gas:
    return Gas.model_validate({"name": name, "pressure": pressure, "law": law} | more)


def orifice(*between: str, area: float = 1e-6, discharge: float = 1.0) -> Orifice:
    return Orifice.model_validate({"between": between, "area": area, "discharge": discharge})


class Alone(Gases):
    """Gases in given volumes, by their kernels."""

    def state(self, t: float, volume: np.ndarray, area: np.ndarray) -> GasState:
        found = empty_state(len(volume), len(area))
        found.volume[:], found.area[:] = volume, area
        set_state(self.arrays, float(t), found)
        return found

    def commit(self, t: float, volume: np.ndarray, area: np.ndarray) -> None:
        accept_gas(self.arrays, t, self.state(t, volume, area))

    def energies(self, state: GasState) -> np.ndarray:
        return np.asarray(gas_energies(self.arrays, state))

    def power(self, t: float, state: GasState) -> float:
        return float(gas_power(self.arrays, float(t), state, 0.0))


def chambers(gases: tuple[Gas, ...], orifices: tuple[Orifice, ...], volume: np.ndarray) -> tuple[Alone, np.ndarray]:
    """Gases with constant areas of orifices, and these areas."""
    area = np.array([one.area for one in orifices], dtype=float)
    return Alone(gases, orifices, volume, area), area


def after(gases: Alone, volume: np.ndarray, area: np.ndarray, times: np.ndarray) -> Any:
    """State at the last of the times, with a step to each."""
    for t in times:
        state = gases.state(float(t), volume, area)
        gases.commit(float(t), volume, area)
    return state


@pytest.mark.parametrize("law", ["isothermal", "adiabatic"])
@pytest.mark.parametrize("flow", ["none", "to the other", "to both"])
def test_derivatives(law: str, flow: str) -> None:
    """Derivatives of the pressures by volumes, and by time without flow, against central differences."""
    orifices = {"none": (), "to the other": (orifice("a", "b"),), "to both": (orifice("a", "b"), orifice("b", "outside"))}
    ramp = Ramp(kind="ramp", end=1.0)
    both = (
        gas("a", 3e5, law, outside_pressure=1e5, supply_mass=2e-3, time=ramp),
        gas("b", 2.5e5, law, outside_pressure=1e5, supply_flow=1e-3),
    )
    gases, area = chambers(both, orifices[flow], np.array([1e-3, 2e-3]))
    gases.commit(0.3, np.array([1.1e-3, 1.9e-3]), area)
    t, volume, area = 0.35, np.array([1.05e-3, 2.1e-3]), 1.2 * area
    found = gases.state(t, volume, area)
    for k in range(2):
        more, less = (gases.state(t, volume + sign * 1e-9 * np.eye(2)[k], area).pressure for sign in (1.0, -1.0))
        np.testing.assert_allclose(found.by_volume[:, k], (more - less) / 2e-9, rtol=1e-6, atol=1e-2)
    for k in range(len(area)):
        more, less = (gases.state(t, volume, area + sign * 1e-12 * np.eye(len(area))[k]).pressure for sign in (1.0, -1.0))
        np.testing.assert_allclose(found.by_area[:, k], (more - less) / 2e-12, rtol=1e-5, atol=1e5)
    if flow == "none":
        more, less = (gases.state(t + step, volume, area).pressure for step in (1e-6, -1e-6))
        np.testing.assert_allclose(found.by_time, (more - less) / 2e-6, rtol=1e-6)


def test_nozzle() -> None:
    """Derivatives, continuity where the flow chokes and where it is laminar, and no flow without a difference."""
    for behind in (0.1e5, 0.5e5, 0.6e5, 0.9e5, 0.9995e5):
        found = nozzle(1e5, behind, R * T0, G)
        for k, step in enumerate((1.0, 1.0, 10.0)):
            ends = []
            for sign in (1.0, -1.0):
                arguments = [1e5, behind, R * T0]
                arguments[k] += sign * step
                ends.append(nozzle(*arguments, G)[0])
            assert found[1 + k] == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-5, abs=1e-12)
    assert nozzle(1e5, 0.5e5, R * T0, G)[0] == pytest.approx(1e5 / math.sqrt(R * T0) * CHOKED, rel=1e-12)
    critical = (2.0 / (G + 1.0)) ** (G / (G - 1.0))
    for place in (critical, 0.999):
        below, above = (nozzle(1e5, 1e5 * (place + shift), R * T0, G)[0] for shift in (-1e-9, 1e-9))
        assert above == pytest.approx(below, rel=1e-5)
    assert nozzle(1e5, 1e5, R * T0, G)[0] == 0.0


def test_choked_flow_into_vacuum() -> None:
    """The mass decays as exp(-t/tau), or adiabatic as (1 + (g - 1)/2 t/tau)^(-2/(g - 1)); order 2 in the step."""
    volume = np.array([1e-3])
    tau = 1e-3 / (1e-6 * math.sqrt(R * T0) * CHOKED)
    for law, mass in (("isothermal", math.exp(-1.0)), ("adiabatic", (1.0 + 0.5 * (G - 1.0)) ** (-2.0 / (G - 1.0)))):
        errors = []
        for steps in (10, 20, 40):
            gases, area = chambers((gas("a", 1e5, law),), (orifice("a", "outside"),), volume)
            start = gases.state(0.0, volume, area)
            end = after(gases, volume, area, np.linspace(0.0, tau, steps + 1)[1:])
            errors.append(abs(end.mass[0] / start.mass[0] - mass))
            if law == "adiabatic":
                assert end.temperature[0] / T0 == pytest.approx((1.0 + 0.5 * (G - 1.0)) ** -2.0, rel=2e-3)
        assert errors[-1] < 1e-4 * mass
        for one, two in pairwise(errors):
            assert math.log2(one / two) == pytest.approx(2.0, abs=0.1)


def test_choked_flow_between_two_chambers() -> None:
    """While the flow is choked the first mass decays exponentially, and the second chamber has all the rest."""
    volume, start = np.array([1e-3, 1e-2]), (4e5, 1e4)
    gases, area = chambers((gas("a", start[0]), gas("b", start[1])), (orifice("a", "b", discharge=0.8),), volume)
    tau = 1e-3 / (0.8e-6 * math.sqrt(R * T0) * CHOKED)
    whole = gases.state(0.0, volume, area).mass.sum()
    end = after(gases, volume, area, np.linspace(0.0, tau, 201)[1:])
    left = start[0] * math.exp(-1.0)
    assert end.pressure[0] == pytest.approx(left, rel=1e-5)
    assert end.pressure[1] == pytest.approx(start[1] + 0.1 * (start[0] - left), rel=1e-5)
    assert end.mass.sum() == pytest.approx(whole, rel=1e-15)


def test_chambers_come_to_one_pressure() -> None:
    """Two adiabatic chambers end with the mean energy density; mass is conserved to round-off in long steps, too."""
    volume = np.array([1e-3, 3e-3])
    opening = (orifice("a", "b", area=1e-4),)
    for steps, accuracy in ((3, 0.2), (400, 1e-4)):
        gases, area = chambers((gas("a", 5e5, "adiabatic"), gas("b", 1e5, "adiabatic")), opening, volume)
        whole = gases.state(0.0, volume, area).mass.sum()
        end = after(gases, volume, area, np.linspace(0.0, 1.0, steps + 1)[1:] ** 2)
        assert end.pressure[0] == pytest.approx(end.pressure[1], rel=1e-3)
        assert end.pressure[1] == pytest.approx((5e5 * 1e-3 + 1e5 * 3e-3) / 4e-3, rel=accuracy)
        assert end.mass.sum() == pytest.approx(whole, rel=1e-14)


def test_filling_of_a_rigid_chamber() -> None:
    """The energy of an adiabatic gas grows by c_p T for each mass: the gas arrives warmer than its supply."""
    volume = np.array([1e-3])
    gases, area = chambers((gas("a", 1e5, "adiabatic", supply_flow=1e-3),), (), volume)
    end = after(gases, volume, area, np.array([0.5, 2.0]))
    grown = (end.pressure[0] - 1e5) * 1e-3 / (G - 1.0)
    assert grown == pytest.approx(2e-3 * G * R / (G - 1.0) * T0, rel=1e-12)
    assert T0 < end.temperature[0] < G * T0
    given, area = chambers((gas("a", supply_pressure=2e5),), (), volume)
    assert given.state(1.0, volume, area).pressure[0] == 2e5
    assert given.state(1.0, volume, area).by_volume[0, 0] == 0.0


def test_mass_that_is_supplied_at_the_start() -> None:
    """A constant mass of supply is in the chamber from the start on, in addition to the gas of the given pressure."""
    volume = np.array([1e-3])
    for law in ("isothermal", "adiabatic"):
        gases, area = chambers((gas("a", 1e5, law, supply_mass=2e-3),), (), volume)
        state = gases.state(0.0, volume, area)
        assert state.mass[0] == pytest.approx(1e5 * 1e-3 / (R * T0) + 2e-3, rel=1e-14)
        assert state.pressure[0] == pytest.approx(1e5 + 2e-3 * R * T0 / 1e-3, rel=1e-14)
        assert state.temperature[0] == pytest.approx(T0, rel=1e-14)


def test_energy_of_an_empty_chamber() -> None:
    """The change of the energy is the work of a slow supply, from an empty chamber on: m R T ln(V0/V), or m c_p T."""
    volume, steps = np.array([1e-3]), np.linspace(0.0, 1.0, 201)
    for law in ("isothermal", "adiabatic"):
        gases, area = chambers((gas("a", 0.0, law, supply_flow=2e-3),), (), volume)
        first, rates = gases.energies(gases.state(0.0, volume, area))[0], []
        for t in steps:
            grown = volume * (1.0 + t)
            state = gases.state(t, grown, area)
            rates.append(gases.power(t, state))
            gases.commit(t, grown, area)
        pressures = 2e-3 * R * T0 * steps / (1e-3 * (1.0 + steps))
        if law == "isothermal":
            assert state.pressure[0] == pytest.approx(pressures[-1], rel=1e-12)
            work = np.trapezoid(rates, steps) - np.trapezoid(pressures, 1e-3 * steps)
            assert gases.energies(state)[0] - first == pytest.approx(work, rel=1e-4)
            assert gases.energies(state)[0] == pytest.approx(2e-3 * R * T0 * math.log(0.5), rel=1e-12)
        else:
            assert np.trapezoid(rates, steps) == pytest.approx(2e-3 * 3.5 * R * T0, rel=1e-12)


def test_memory() -> None:
    """A gas continues from its memory, and an empty one resets it."""
    volume = np.array([1e-3, 2e-3])
    make = (gas("a", 3e5), gas("b", 1e5)), (orifice("a", "b"),), volume
    (gases, area), (other, _) = chambers(*make), chambers(*make)
    first = gases.state(0.1, volume, area).mass
    after(gases, volume, area, np.array([0.2]))
    other.arrays.last[:] = gases.arrays.last
    np.testing.assert_array_equal(other.state(0.3, volume, area).mass, gases.state(0.3, volume, area).mass)
    gases.arrays.last[:] = gases.start
    np.testing.assert_array_equal(gases.state(0.1, volume, area).mass, first)
