"""Friction laws of a contact, by the names that case files use.

A new law is one file here and one line below; the scene's table of names is `fsm.scene.contact`.
`fsm.laws.friction.coefficient` is what the contact group of surfaces still calls.
"""

from __future__ import annotations

from typing import Final

from fsm.laws.friction.law import FrictionDescription, FrictionLaw
from fsm.laws.friction.lugre import LUGRE
from fsm.laws.friction.stribeck import STRIBECK
from fsm.laws.friction.tanh import TANH
from fsm.laws.friction.two_step import TWO_STEP

__all__ = ["FRICTION_LAWS", "FrictionDescription", "FrictionLaw"]

FRICTION_LAWS: Final[dict[str, FrictionLaw]] = {
    "step": TWO_STEP,
    "tanh": TANH,
    "stribeck": STRIBECK,
    "lugre": LUGRE,
}
