"""Quantities of every contact pair, and normal forces on the facets of a sheet with nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fsm.channels.offer import Model, Offer, State, offers
from fsm.model.contact.contacts import ContactGroup
from fsm.model.contact.sheets.sheet_contacts import SheetContacts
from fsm.results.all_channels import CONTACT_QUANTITIES
from fsm.results.channel import Dim
from fsm.results.quantities import FACET_FORCES


@offers
def contacts(model: Model) -> Iterator[Offer]:
    """contact.<first> - <second>.gap, .normal_force, .friction_force, .slip_speed, .area."""
    for k, pair in enumerate(getattr(model.system, "pair_names", ())):
        for name, (of, unit, text) in CONTACT_QUANTITIES.items():
            yield Offer(f"contact.{pair}.{name}", unit, text, _of(of.removeprefix("pair_"), k))


@offers
def facets_in_contact(model: Model) -> Iterator[Offer]:
    """contact.facets.force of flexible facets and of bars that touch each other."""
    for group in getattr(model.system, "contacts", ()):
        if isinstance(group, ContactGroup) and isinstance(group.geometry, SheetContacts):
            names = tuple(f"facet {k + 1}" for k in range(int(group.geometry.surface.facet.max()) + 1))
            text = "sum of the normal forces on each facet from other facets"
            yield Offer(FACET_FORCES, "N", text, _facet_forces, (Dim("facet", names, "1", "facet of the sheet"),))


def _facet_forces(state: State) -> np.ndarray:
    system = state.system
    at = system.state(state.time, state.q, state.u, state.before)
    total = np.zeros(0)
    for group in system.contacts:
        if isinstance(group.geometry, SheetContacts):
            total = group.geometry.facet_forces(*group.normal_forces(at))
    return total


def _of(quantity: str, k: int) -> Callable[[State], float]:
    return lambda state: float(getattr(state.saved.observation.pairs, quantity)[k])
