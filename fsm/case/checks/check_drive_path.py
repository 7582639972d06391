"""Check that no drive moves a crease line through a held panel, if contact prevents this."""

from __future__ import annotations

import math
from collections.abc import Iterable

from fsm.case.checks.sections import Sections
from fsm.errors import Fault
from fsm.text.shown_units import shown


def drives_through_held_panels(sections: Sections, held: frozenset[int]) -> Iterable[Fault]:
    """Faults of guided crease lines whose straight path crosses a held panel, which contact makes impossible.

    Parameters
    ----------
    sections : Sections
    held : numbers of the held panels
    """
    strip, contact = sections.strip, sections.contact
    if strip is None or contact is None or contact.pairs is not None:
        return
    for path, drive in sections.all_drives:
        line = drive.line(strip.panels)
        if line is None or drive.travel is None or not drive.guide or not 0 <= line <= strip.panels:
            continue
        size = math.sqrt(sum(x * x for x in drive.direction))
        way = tuple(drive.travel * x / size for x in drive.direction[::2])
        start, what = strip.crease_point(line), f"crease {line}" if drive.end is None else drive.part
        for panel in sorted(held - {line, line + 1}):
            if not 1 <= panel <= strip.panels:
                continue
            part = _crossing(start, way, strip.crease_point(panel - 1), strip.crease_point(panel))
            if part is not None:
                travel = part * drive.travel
                yield Fault(
                    f"{path}.travel",
                    f"{shown(drive.travel, 'm')} lead {what} through panel {panel}, which is held; they "
                    f"meet at {shown(travel, 'm')}. Reduce the travel, or hold other panels",
                )


def _crossing(
    start: tuple[float, float], way: tuple[float, ...], one: tuple[float, float], other: tuple[float, float]
) -> float | None:
    """Fraction of a path at which the path crosses the line between two points; None if they do not cross."""
    along = other[0] - one[0], other[1] - one[1]
    apart = one[0] - start[0], one[1] - start[1]
    both = way[0] * along[1] - way[1] * along[0]
    if abs(both) <= 1e-12 * math.hypot(*way) * math.hypot(*along):
        return None
    part = (apart[0] * along[1] - apart[1] * along[0]) / both
    at = (apart[0] * way[1] - apart[1] * way[0]) / both
    return part if 0.0 < part <= 1.0 and 0.0 <= at <= 1.0 else None
