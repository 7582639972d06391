"""Energies of the model and of its energy balance."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fsm.channels.offer import Model, Offer, State, offers
from fsm.model.bodies.loads import GravityGroup
from fsm.model.contact.contacts import ContactGroup
from fsm.model.elements.element_group import ElementGroup
from fsm.model.elements.elements import BushingGroup
from fsm.model.elements.law_elements import LawGroup
from fsm.results.solution import ENERGIES


@offers
def energies(model: Model) -> Iterator[Offer]:
    """energy.kinetic, .potential, .dissipated, .numerical, .work, .error, and the potential energy by its kinds."""
    yield Offer("energy.kinetic", "J", ENERGIES["kinetic"], lambda state: state.saved.observation.energy.kinetic)
    yield Offer(
        "energy.potential", "J", "sum of all potential energies", lambda state: state.saved.observation.energy.stored_at_rest
    )
    yield Offer("energy.dissipated", "J", ENERGIES["dissipated"], lambda state: state.saved.dissipated)
    yield Offer("energy.numerical", "J", ENERGIES["numerical"], lambda state: state.saved.numerical)
    yield Offer("energy.work", "J", ENERGIES["work"], lambda state: state.saved.work)
    yield Offer("energy.error", "J", ENERGIES["error"], lambda state: state.saved.error)
    for name in _kinds(model):
        yield Offer(f"energy.{name}", "J", ENERGIES.get(name, f"energy of {name}"), _potential(name))


def _kinds(model: Model) -> list[str]:
    """Kinds of potential energy of a model, in the order of `ENERGIES`."""
    found = {"gravity"} if any(model.case.gravity) else set()
    system = model.system
    for group in getattr(system, "groups", ()):
        if isinstance(group, ElementGroup):
            found |= set(group.categories)
        elif isinstance(group, BushingGroup):
            found |= {"panels", "creases"}
        elif isinstance(group, LawGroup):
            found.add("panels")
        elif isinstance(group, ContactGroup):
            found.add("contact")
        elif isinstance(group, GravityGroup):
            found.add("gravity")
    mesh = getattr(getattr(system, "elements", system), "mesh", None) or (model.film and model.film.mesh)
    found |= {group.name for group in mesh.groups} if mesh else set()
    return [name for name in ENERGIES if name in found] + sorted(found - ENERGIES.keys())


def _potential(name: str) -> Callable[[State], float]:
    def at(state: State) -> float:
        return state.saved.observation.energy.potential.get(name, 0.0)

    return at
