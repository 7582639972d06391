"""Cases and patterns that several tests use."""

from __future__ import annotations

import json
from typing import Any

SQUARE: dict[str, Any] = {
    "file_spec": 1.2,
    "frame_unit": "cm",
    "vertices_coords": [[0, 0], [2, 0], [2, 2], [0, 2]],
    "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]],
    "edges_assignment": ["B", "B", "B", "B", "M"],
}
"""Pattern in the FOLD format: a square with a mountain in its diagonal."""
FOLDED: dict[str, Any] = {
    "frame_classes": ["foldedForm"],
    "vertices_coords": [[0, 0, 0], [0, 1, 0], [-0.8, 0, 0.6], [0.8, 0, 0.6]],
    "edges_vertices": [[0, 1], [1, 2], [2, 0], [0, 3], [3, 1]],
    "edges_assignment": ["V", "B", "B", "B", "B"],
    "faces_vertices": [[0, 1, 2], [0, 3, 1]],
}
"""Folded form in the FOLD format: two triangles that meet in a valley."""


STRIP_ON_A_FLOOR = """
[strip]
length = "440 mm"
width = "36 mm"
thickness = "0.35 mm"
panels = 4
fold_angle = "64 deg"
segments_per_panel = 4
held = [1]
[material]
young = "3.6 GPa"
density = "1280 kg/m^3"
damping = "4 ms"
[crease]
law = "linear"
stiffness = "11 N mm/rad"
[contact]
[friction]
FRICTION
[[obstacle]]
name = "floor"
shape = "plane"
position = [0, 0, "-1 mm"]
[[drive]]
crease = 3
direction = [1, 0, 0]
speed = "1.5 mm/s"
travel = "16 mm"
"""
"""Strip whose free end is dragged over a plane; FRICTION stands for the keys of its friction."""


def fold(base: dict[str, Any], **changes: Any) -> str:
    """Text of a FOLD file with other entries; None leaves an entry out."""
    return json.dumps({key: value for key, value in (base | changes).items() if value is not None})


def strip(more: str = "", of_material: str = "") -> str:
    """Strip of 480 mm with six panels and linear creases, with further lines of its sections."""
    return f"""[strip]
length = 0.48
width = 0.04
thickness = 3e-4
panels = 6
fold_angle = "80 deg"
{more}
[material]
young = 3e9
density = 800
{of_material}
[crease]
law = "linear"
stiffness = 9.0e-3
"""


def kresling_of_bars(load: str, end: str, interval: str) -> str:
    """Kresling cylinder of bars whose top edge is pushed by a load that grows for 0.2 s, until an end time."""
    return f"""
[sheet]
kind = "kresling"
sides = 6
rows = 1
radius = "40 mm"
height = "40 mm"
twist = "45 deg"
facets = "bars"
thickness = "0.3 mm"
[[sheet.support]]
at = "edge bottom"
[material]
young = "3 GPa"
density = 1000
damping = "1 ms"
[crease]
stiffness_per_length = 0.05
[[load]]
at = "edge top"
force = [0, 0, "{load}"]
time = {{ kind = "ramp", end = "0.2 s" }}
[solve]
end_time = "{end}"
[save]
interval = "{interval}"
"""
