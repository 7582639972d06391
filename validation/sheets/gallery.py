"""Folded sheets and flexible facets compared with published shells, plates, closed forms and bar-and-hinge models.

python -m validation.sheets.gallery [--parts slit_annulus plates ...] [--out out/validation/sheets] [--full]
"""

from __future__ import annotations

import sys

from validation.gallery.command import command
from validation.gallery.record import Part
from validation.sheets.flat_facets import curved_shells
from validation.sheets.origami import kresling, miura_bending, miura_pop_through, miura_push
from validation.sheets.plates import plates
from validation.sheets.shells import cantilever, hinged_roof, open_cylinder, pinched_cylinder, roll_up, slit_annulus
from validation.sheets.strip import anticlastic, pulled_strip, strip_forms

TITLE = "Folded sheets and flexible facets"

PARTS: dict[str, Part] = {
    "slit_annulus": slit_annulus,
    "cantilever": cantilever,
    "roll_up": roll_up,
    "open_cylinder": open_cylinder,
    "pinched_cylinder": pinched_cylinder,
    "hinged_roof": hinged_roof,
    "curved_shells": curved_shells,
    "miura_push": miura_push,
    "miura_bending": miura_bending,
    "miura_pop_through": miura_pop_through,
    "kresling": kresling,
    "plates": plates,
    "pulled_strip": pulled_strip,
    "strip_forms": strip_forms,
    "anticlastic": anticlastic,
}

if __name__ == "__main__":
    sys.exit(command(PARTS, "sheets", __doc__))
