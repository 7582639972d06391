"""Couplings of joints: `[[scene.couplings]]`."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fsm.channels.offer import Model, Offer, State, offers, placed
from fsm.model.elements.couplings import CouplingGroup
from fsm.results.channel import Dim

Values = dict[str, tuple[np.ndarray, np.ndarray]]
_UNITS = {"gear": ("rad", "moment", "N m"), "rack": ("m", "force", "N")}
"""Unit of the opening, and quantity on it with its unit, of the kinds of the package."""


@offers
def couplings(model: Model) -> Iterator[Offer]:
    """coupling.<name>.angle and .moment of the joints of every coupling; .opening and .effort of gears and racks."""
    sliding = {joint.name for joint in (() if model.scene is None else model.scene.joints) if joint.kind == "prismatic"}
    for coupling in () if model.scene is None else model.scene.couplings:
        joints, name = (Dim("joint", coupling.joints, "1", "coupled joint"),), coupling.name
        if sliding.isdisjoint(coupling.joints):
            yield Offer(f"coupling.{name}.angle", "rad", "angle of the joint from the start", _part(name, 0), joints)
            text = "moment of the coupling against the angle of the joint"
            yield Offer(f"coupling.{name}.moment", "N m", text, _part(name, 1), joints)
        if coupling.kind in _UNITS:
            unit, quantity, of_effort = _UNITS[coupling.kind]
            yield Offer(
                f"coupling.{name}.opening", unit, "opening x1 - n x2 from the start", _opening(name, *coupling.ratios)
            )
            text = f"{quantity} of the coupling against the coordinate of its first joint"
            yield Offer(f"coupling.{name}.effort", of_effort, text, _effort(name))


def _states(state: State) -> Values:
    poses, rates = placed(state)
    found: Values = {}
    for group in state.system.groups:
        if isinstance(group, CouplingGroup):
            angles, efforts = group.states(state.time, poses, rates)
            found |= {name: (angles[i], efforts[i]) for i, name in enumerate(group.names)}
    return found


def _part(name: str, part: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(_states)[name][part]


def _opening(name: str, first: float, second: float) -> Callable[[State], float]:
    def at(state: State) -> float:
        x, y = state.once(_states)[name][0]
        return float(first * x + second * y)

    return at


def _effort(name: str) -> Callable[[State], float]:
    return lambda state: float(state.once(_states)[name][1][0])
