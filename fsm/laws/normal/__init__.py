"""Laws of the normal force of a contact, by their names in case files.

A new law needs one file here, one line below, and its keys in `fsm.case.models.contact`.
"""

from __future__ import annotations

from typing import Final

from fsm.laws.normal.flores import FLORES
from fsm.laws.normal.hertz import HERTZ
from fsm.laws.normal.hunt_crossley import HUNT_CROSSLEY
from fsm.laws.normal.impact import IMPACT
from fsm.laws.normal.lankarani_nikravesh import LANKARANI_NIKRAVESH
from fsm.laws.normal.law import ContactDescription, NormalLaw
from fsm.laws.normal.linear import LINEAR
from fsm.laws.normal.restitution import RESTITUTION

__all__ = ["NORMAL_LAWS", "ContactDescription", "NormalLaw"]

NORMAL_LAWS: Final[dict[str, NormalLaw]] = {
    "hertz": HERTZ,
    "impact": IMPACT,
    "linear": LINEAR,
    "hunt-crossley": HUNT_CROSSLEY,
    "lankarani-nikravesh": LANKARANI_NIKRAVESH,
    "flores": FLORES,
    "restitution": RESTITUTION,
}
