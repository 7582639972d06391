"""Friction laws of a contact, by their names in case files.

A new law needs one file here, one line below, and its keys in `fsm.case.models.contact`.
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
