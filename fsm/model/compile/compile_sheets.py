"""Compile contact of flexible facets and bars of a sheet with each other."""

from __future__ import annotations

import numpy as np

from fsm.model.contact.sheets.sheet_contacts import SheetContacts
from fsm.model.contact.sheets.sheet_tables import SheetSurface
from fsm.model.contact.touching import Touching


def compile_sheets(touching: Touching) -> tuple[SheetContacts, ...]:
    """Compile the geometry of a sheet in contact with itself; empty without flexible facets."""
    scene, sheet = touching.scene, touching.scene.built.touching
    if sheet is None or scene.contact is None:
        return ()
    index = {body.name: i for i, body in enumerate(touching.bodies)}
    surface = SheetSurface(
        np.array([index[frame.name] for frame in sheet.frames]), sheet.areas, sheet.triangles, sheet.facet,
        sheet.plane, sheet.mean_facet, sheet.thickness if scene.contact.thickness_in_gap else 0.0,
        int(touching.numbers[-1]), scene.built.across_cuts,
    )  # fmt: skip
    return (SheetContacts(surface, touching.poses),)
