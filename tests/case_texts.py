"""Cases that several tests run."""

from __future__ import annotations


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
