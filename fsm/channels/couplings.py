"""Couplings of joints: `[[scene.couplings]]`."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fsm.channels.offer import Model, Offer, State, offers
from fsm.channels.rigid import placed
from fsm.model.elements.couplings import CouplingGroup
from fsm.results.channel import Dim

Values = dict[str, tuple[np.ndarray, np.ndarray]]


@offers
def couplings(model: Model) -> Iterator[Offer]:
    """coupling.<name>.angle and .moment of the joints of every coupling."""
    for coupling in () if model.scene is None else model.scene.couplings:
        joints, name = (Dim("joint", coupling.joints, "1", "coupled force element"),), coupling.name
        text = "twist of the joint from the start"
        yield Offer(f"coupling.{name}.angle", "rad", text, _part(name, 0), joints)
        text = "moment of the coupling against the twist of the joint"
        yield Offer(f"coupling.{name}.moment", "N m", text, _part(name, 1), joints)


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
