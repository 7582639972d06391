"""Motorisation margins of joints: `[[margin]]`."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fsm.case.derived.joint_margin import margins_of
from fsm.channels.joints import ideal_joints
from fsm.channels.offer import Model, Offer, State, offers


@offers
def motorisation(model: Model) -> Iterator[Offer]:
    """joint.<name>.available, .required, .margin."""
    found = margins_of(model.case.margin, () if model.scene is None else model.scene.joints)
    angles = {offer.name: offer.at for offer in ideal_joints(model)} if found else {}
    for one in found:
        name = f"joint.{one.joint.name}"
        angle, text = angles[f"{name}.angle"], "moment at the present angle by ECSS-E-ST-33-01C"
        yield Offer(f"{name}.available", "N m", f"available {text}", _at(angle, one.available))
        yield Offer(f"{name}.required", "N m", f"required {text}", _at(angle, one.required))
        yield Offer(f"{name}.margin", "1", "available over required moment, less 1", _at(angle, one.margin))


def _at(angle: Callable[[State], float], of: Callable[[np.ndarray], np.ndarray]) -> Callable[[State], float]:
    return lambda state: float(of(np.array([angle(state)]))[0])
