"""All closed forms, for the gallery and for the command line.

python -m validation.closed_forms.gallery [--parts elastica arc ...] [--out out/validation/closed_forms]
"""

from __future__ import annotations

import sys

from validation.closed_forms import absolute, beams, contact, folds_checks, rigid
from validation.gallery.command import command
from validation.gallery.record import Part

TITLE = "Closed forms and converged solutions"
PARTS: dict[str, Part] = {
    "zigzag": folds_checks.zigzag_strip,
    "zfold": folds_checks.zfolds,
    "miura": folds_checks.miura_vertex,
    "rigid_limit": folds_checks.rigid_limit,
    "elastica": beams.elastica,
    "rolled": beams.rolled,
    "buckling": beams.buckling,
    "lateral": beams.lateral,
    "arc": beams.arc,
    "princeton": beams.princeton,
    "heavy_top": rigid.heavy,
    "spring_pendulum": rigid.spring_pendulum,
    "restitution": contact.restitution,
    "impact_law": contact.impact_law,
    "bouncing": contact.bouncing,
    "sliding": contact.sliding,
    "static_friction": contact.static_friction,
    "cable": absolute.cable,
    "deep_beam": absolute.deep,
    "flexible_pendulum": absolute.pendulum,
    "string": absolute.string,
    "plates": absolute.plates,
    "relaxation": folds_checks.relaxation,
    "hinge": folds_checks.hinge,
}

if __name__ == "__main__":
    sys.exit(command(PARTS, "closed_forms", __doc__))
