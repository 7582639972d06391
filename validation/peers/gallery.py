"""Times to an error compared with Exudyn, for the gallery; without Exudyn nothing is compared.

python -m validation.peers.gallery [--parts strip ...] [--out out/validation/peers]
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from validation.gallery.command import command
from validation.gallery.record import Check, NotCompared, Part, Place, Reason, below
from validation.peers.cases import ALL, PRESSED, STRIPS
from validation.peers.common import THERE, quiet
from validation.peers.sweep import FSM, PEER, PLAIN, PeerCase, measure, plot, ratio, verdict

TITLE = "Beside Exudyn"
SOURCE = "Exudyn in the same run, run by run in turn; shortest processor time of the solvers (validation/peers)"
SPATIAL_RATIO, PLANAR_RATIO, PRESSED_RATIO = 3.0, 10.0, 50.0
REPEAT = 3
SLOWER = {
    "strip_4_plane": 0.377,
    "strip_10_plane": 0.214,
    "strip_20_plane": 0.131,
    "strip_4_space": 0.355,
    "strip_10_contact": 0.498,
    "strip_20_contact": 0.347,
}
"""Time of fsm over the time of tuned Exudyn, where the ratio is above its goal (23 November 2026, README.md)."""
MACHINES = 0.5
"""Relative difference of such ratios between machines and between runs."""
MISSING = NotCompared("Exudyn beside fsm", "Exudyn", "Exudyn is not installed: pip install 'fsm[peers]'")


def strip(place: Place) -> Iterator[Check | NotCompared]:
    """Pulled strip without contact: time to 0.1 % of error."""
    if not THERE:
        yield MISSING
        return
    for segments, spatial in STRIPS:
        name = f"strip_{segments}_{'space' if spatial else 'plane'}"
        why = "Exudyn's static solver takes only a few milliseconds here, and half of fsm's time in small models is Python"
        yield from _faster(name, place, 1e-3, SPATIAL_RATIO if spatial else PLANAR_RATIO, why)


def strip_contact(place: Place) -> Iterator[Check | NotCompared]:
    """Pulled strip with contact of panels 3 and 4: time to 1 % of error."""
    if not THERE:
        yield MISSING
        return
    for segments in PRESSED:
        why = (
            "Exudyn is given half the strip against its mirror plane, as it has no contact between faces; its static solver "
            "takes as long for that as fsm's path for the whole"
        )
        yield from _faster(f"strip_{segments}_contact", place, 1e-2, PRESSED_RATIO, why)


def others(place: Place) -> Iterator[Check | NotCompared]:
    """Pendulums, top, linkages, cables and films: the error of fsm is within 0.1 %; times have no target."""
    if not THERE:
        yield MISSING
        return
    for name in list(ALL)[len(STRIPS) + len(PRESSED) :]:
        case, picture = _measured(name, place)
        least = min((point.error for point in case.points if point.tool == FSM), default=float("inf"))
        yield below(
            case.title,
            "smallest error of fsm's sweep",
            least,
            1e-3,
            case.reference,
            picture,
            reason=Reason("its springs ring where the linkage could branch", 2.3e-3, 0.2) if name == "A02" else None,
            detail=", ".join(f"to {100 * e:g} %: {verdict(case.points, e)}" for e in (1e-2, 1e-3)).replace("*", ""),
        )


def _measured(name: str, place: Place) -> tuple[PeerCase, Path]:
    quiet()
    case = ALL[name]()
    case.points.extend(measure(case.runs(), REPEAT, say=lambda line: None))
    return case, plot(case, place.out / f"{name}.png")


def _faster(name: str, place: Place, target: float, least: float, why: str) -> Iterator[Check]:
    """Time of fsm relative to the time of Exudyn."""
    case, picture = _measured(name, place)
    for peer, which in ((PLAIN, "default"), (PEER, "tuned")):
        yield below(
            f"{case.title}: fsm's time over Exudyn's, {which} settings",
            f"to {100 * target:g} % of error; at least {least:g} times faster is wanted",
            1.0 / ratio(case.points, target, peer),
            1.0 / least,
            SOURCE,
            picture,
            reason=Reason(why, SLOWER[name], MACHINES) if peer == PEER and name in SLOWER else None,
            detail=f"{verdict(case.points, target, peer)}; {case.settings[peer]}".replace("*", ""),
        )


PARTS: dict[str, Part] = {"strip": strip, "strip_contact": strip_contact, "others": others}

if __name__ == "__main__":
    sys.exit(command(PARTS, "peers", __doc__))
