"""Contact of the nodes of a sheet with the sheet itself and with every obstacle."""

from __future__ import annotations

from typing import Any

from fsm.case.models.case import Case
from fsm.case.models.flexible_facets import SHEET
from fsm.case.models.scene import ContactPair
from fsm.errors import CaseError, Fault


def contact_of_nodes(case: Case) -> dict[str, Any]:
    """Contact keys of the scene of a sheet of flexible facets or bars.

    Raises
    ------
    CaseError
        The friction depends on directions in a facet.
    """
    if case.contact is None:
        return {}
    if case.friction is not None and case.friction.across != 1.0:
        text = f"{case.friction.across:g} is not available with the nodes of a sheet, which have no axes; give 1"
        raise CaseError(Fault("friction.across", text))
    pairs = [ContactPair(first=SHEET, second=name) for name in (SHEET, *(obstacle.name for obstacle in case.obstacle))]
    return {"pairs": tuple(pairs), "contact": case.contact, "friction": case.friction, "obstacles": case.obstacle}
