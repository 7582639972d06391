"""Gas in chambers of sheets: pressure, volume, mass, temperature and energy."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fsm.channels.offer import Model, Offer, State, offers
from fsm.model.joined.gas import GasState
from fsm.model.joined.panel_gas import PanelGasSystem
from fsm.model.joined.system import JoinedSystem

_QUANTITIES = {
    "pressure": ("Pa", "absolute pressure of the gas"),
    "volume": ("m^3", "volume of the chamber"),
    "mass": ("kg", "mass of the gas"),
    "temperature": ("K", "temperature of the gas"),
}


@offers
def gases(model: Model) -> Iterator[Offer]:
    """gas.<name>.pressure, .volume, .mass, .temperature and .energy of every chamber."""
    system = model.system
    if not isinstance(system, JoinedSystem | PanelGasSystem) or system.chambers is None:
        return
    for number, name in enumerate(system.chambers.names):
        for quantity, (unit, text) in _QUANTITIES.items():
            yield Offer(f"gas.{name}.{quantity}", unit, text, _of_state(quantity, number))
        text = "energy of the gas and of the surroundings that it displaces"
        yield Offer(f"gas.{name}.energy", "J", text, _energy(number))


def _gas(state: State) -> GasState:
    system = state.system
    found: GasState = system.chambers.state(state.time, system.chamber_nodes(state.time, state.q))
    return found


def _energies(state: State) -> np.ndarray:
    system = state.system
    return np.asarray(system.chambers.energies(state.time, system.chamber_nodes(state.time, state.q)))


def _of_state(quantity: str, number: int) -> Callable[[State], float]:
    return lambda state: float(getattr(state.once(_gas), quantity)[number])


def _energy(number: int) -> Callable[[State], float]:
    return lambda state: float(state.once(_energies)[number])
