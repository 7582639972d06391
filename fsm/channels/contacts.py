"""Quantities of every contact pair."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fsm.channels.offer import Model, Offer, State, offers

_QUANTITIES = {
    "gap": ("gap", "m", "smallest gap of the pair, negative where the faces penetrate"),
    "normal_force": ("force", "N", "sum of the normal forces of the pair"),
    "friction_force": ("friction", "N", "sum of the magnitudes of the friction forces of the pair"),
    "slip_speed": ("slip", "m/s", "mean slip speed of the pair, weighted by the normal forces"),
    "area": ("area", "m^2", "contact area of the pair"),
}
"""Quantity: field of `PairState`, unit and description."""


@offers
def contacts(model: Model) -> Iterator[Offer]:
    """contact.<first> - <second>.gap, .normal_force, .friction_force, .slip_speed, .area."""
    for k, pair in enumerate(getattr(model.system, "pair_names", ())):
        for name, (of, unit, text) in _QUANTITIES.items():
            yield Offer(f"contact.{pair}.{name}", unit, text, _of(of, k))


def _of(quantity: str, k: int) -> Callable[[State], float]:
    return lambda state: float(getattr(state.saved.observation.pairs, quantity)[k])
