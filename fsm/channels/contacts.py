"""Quantities of every contact pair."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fsm.channels.offer import Model, Offer, State, offers
from fsm.results.all_channels import CONTACT_QUANTITIES


@offers
def contacts(model: Model) -> Iterator[Offer]:
    """contact.<first> - <second>.gap, .normal_force, .friction_force, .slip_speed, .area."""
    for k, pair in enumerate(getattr(model.system, "pair_names", ())):
        for name, (of, unit, text) in CONTACT_QUANTITIES.items():
            yield Offer(f"contact.{pair}.{name}", unit, text, _of(of.removeprefix("pair_"), k))


def _of(quantity: str, k: int) -> Callable[[State], float]:
    return lambda state: float(getattr(state.saved.observation.pairs, quantity)[k])
