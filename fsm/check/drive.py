"""Report of `fsm check` on the drives of a strip: the driven part, and the travel at which the strip is taut."""

from __future__ import annotations

import math
from collections.abc import Iterator

from fsm.case.models.case import Strip
from fsm.case.models.loads import Drive
from fsm.check.view import CheckContext
from fsm.text.shown_units import shown

_ENDS = ("first end", "last end")
_LOCKED = 1e-9
"""Travel relative to the length of a panel, below which panels are taut at the start."""


def drives_line(drive: Drive) -> bool:
    """Whether a drive of the scene of a strip moves a crease line or an end line."""
    return len(drive.moved) == 1 and (drive.moved[0] in _ENDS or drive.moved[0].startswith("crease "))


def drive_of_strip_lines(view: CheckContext, drive: Drive) -> Iterator[str]:
    """Lines on a drive of a strip: motions that it prevents, and the travel at which panels between held and driven parts
    are straight.
    """
    if view.case.strip is None or drive.turn is not None:
        return
    if not drives_line(drive):
        yield "the driven segments translate and keep their angles"
    elif drive.guide:
        yield "guided: the line moves along its direction only and stays parallel to y; panels can rotate about it"
    else:
        yield "not guided: the line can also move in other directions, and rotate"
    found = taut_travel(view.case.strip, view.case.held_panels, drive)
    if found is not None:
        travel, between = found
        taut = f"taut at {shown(travel, 'm')} of travel: {between} straight there, and more travel stretches the panels"
        yield taut if travel > 0.0 else f"locked: {between} straight at the start, and the travel stretches the panels"


def pulled_beyond_length(view: CheckContext) -> Iterator[str]:
    """Warnings on drives that move beyond the full length of the panels between the driven part and a held panel."""
    strip = view.case.strip
    if strip is None or view.plan.written:
        return
    for drive in view.scene.drives:
        found = None if drive.turn is not None else taut_travel(strip, view.case.held_panels, drive)
        if found is None or drive.size <= found[0]:
            continue
        travel, between = found
        if travel > 0.0:
            yield (
                f"drive of {drive.part}: the travel of {shown(drive.size, 'm')} is longer than {shown(travel, 'm')}, "
                f"where {between} straight; give a shorter travel"
            )
        else:
            yield (
                f"drive of {drive.part}: held panels and the driven line lock, because {between} straight at the start; "
                "hold fewer panels, drive another part, or change the direction"
            )


def taut_travel(strip: Strip, held: frozenset[int], drive: Drive) -> tuple[float, str] | None:
    """Travel (m) at which the panels between a driven part and the nearest held panel are straight, and these panels.

    The result is 0 if they are straight at the start and the drive stretches them at once, and None if the drive has no
    such travel: no panel is held, or the driven part passes them on its way. The panels count as rigid and the creases as
    free.

    Parameters
    ----------
    strip : Strip
    held : numbers of the held panels
    drive : drive of a line, of a panel or of segments, along `direction`
    """
    size = math.hypot(*drive.direction)
    along = drive.direction[0] / size, drive.direction[2] / size
    found = []
    for place, (x, z), side in _driven_ends(strip, drive):
        others = [panel for panel in held if (panel <= place if side < 0 else panel > place)]
        if not others:
            continue
        nearest = max(others) if side < 0 else min(others) - 1  # number of the crease at the edge of the held panel
        reach = abs(place - nearest) * strip.length / strip.panels
        cx, cz = strip.crease_point(nearest)
        travel = _leaves(x - cx, z - cz, along, reach)
        if travel is not None:
            first, last = sorted((math.floor(min(place, nearest)) + 1, math.ceil(max(place, nearest))))
            panels = f"panel {first} is" if first == last else f"panels {first} to {last} are"
            locked = travel <= _LOCKED * strip.length / strip.panels
            found.append((0.0 if locked else travel, panels))
    return min(found, default=None)


def _driven_ends(strip: Strip, drive: Drive) -> Iterator[tuple[float, tuple[float, float], int]]:
    """Both ends of a driven part: place along the strip in panels, position (x, z) in m, and side (-1: towards the first
    panel).
    """
    if drives_line(drive):
        name = drive.moved[0]
        line = strip.panels * _ENDS.index(name) if name in _ENDS else int(name.removeprefix("crease "))
        for side in (-1, 1):
            yield line, strip.crease_point(line), side
        return
    segments = [place for place in (_segment(strip, name) for name in drive.moved) if place is not None]
    if segments:
        for side, place in ((-1, min(begin for begin, _ in segments)), (1, max(end for _, end in segments))):
            panel = min(int(place), strip.panels - 1)
            (x, z), (x2, z2) = strip.crease_point(panel), strip.crease_point(panel + 1)
            part = place - panel
            yield place, (x + part * (x2 - x), z + part * (z2 - z)), side


def _segment(strip: Strip, name: str) -> tuple[float, float] | None:
    """Begin and end of a segment along the strip, in panels; None for another body."""
    words = name.split()
    if len(words) != 4 or words[0] != "panel" or words[2] != "segment":
        return None
    from fsm.builders.strip import segment_lengths

    lengths = segment_lengths(strip)
    number, panel = int(words[3]), int(words[1]) - 1
    whole = lengths.sum()
    return panel + float(lengths[: number - 1].sum() / whole), panel + float(lengths[:number].sum() / whole)


def _leaves(x: float, z: float, along: tuple[float, float], reach: float) -> float | None:
    """Distance along a direction after which a point at (x, z) leaves the circle of a radius about the origin; None if the
    direction has no component in the plane.

    |p + s d| = r:  s = -p.d + sqrt((p.d)^2 + |d|^2 (r^2 - |p|^2)), divided by |d|^2
    """
    square = along[0] ** 2 + along[1] ** 2
    if square == 0.0:
        return None
    forth = x * along[0] + z * along[1]
    inside = max(reach**2 - x**2 - z**2, 0.0)
    return (-forth + math.sqrt(forth**2 + square * inside)) / square
