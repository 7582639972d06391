"""Gas in chambers of sheets: pressure, volume, mass, temperature and energy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from fsm.channels.offer import Model, Offer, State, offers
from fsm.model.joined.gas import GasState
from fsm.model.joined.panel_gas import PanelGas
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
    for number, name in enumerate(getattr(_chambers(model.system), "names", ())):
        for quantity, (unit, text) in _QUANTITIES.items():
            yield Offer(f"gas.{name}.{quantity}", unit, text, _of_state(quantity, number))
        text = "energy of the gas and of the surroundings that it displaces"
        yield Offer(f"gas.{name}.energy", "J", text, _energy(number))


def _panels(system: Any) -> PanelGas | None:
    """Gas of rigid panels."""
    return next((group for group in getattr(system, "groups", ()) if isinstance(group, PanelGas)), None)


def _chambers(system: Any) -> Any:
    """Chambers of a system, or None."""
    return system.chambers if isinstance(system, JoinedSystem) else getattr(_panels(system), "chambers", None)


def _nodes(state: State) -> np.ndarray:
    """Coordinates of the nodes of the chambers, flat."""
    system, panels = state.system, _panels(state.system)
    if panels is None:
        return np.asarray(system.chamber_nodes(state.time, state.q))
    return panels.nodes(system.place(state.time, state.q, None)[0])


def _gas(state: State) -> GasState:
    found: GasState = _chambers(state.system).state(state.time, _nodes(state))
    return found


def _energies(state: State) -> np.ndarray:
    return np.asarray(_chambers(state.system).energies(state.time, _nodes(state)))


def _of_state(quantity: str, number: int) -> Callable[[State], float]:
    return lambda state: float(getattr(state.once(_gas), quantity)[number])


def _energy(number: int) -> Callable[[State], float]:
    return lambda state: float(state.once(_energies)[number])
