"""Folded strips: pulled, released from the stowed state, and pulled taut to vibrate."""

from __future__ import annotations

import math

import numpy as np

from validation.strangers.drawn import Drawn
from validation.strangers.sheets import Sheet, contact_tables, crease_tables, gravity, sheet, strip_tables
from validation.strangers.typed import deg, digits, mm, newton, nice
from validation.stress.dice import Dice, Tables
from validation.stress.reach import reach

__all__ = ["draw_deployed", "draw_released", "draw_strip", "drive_of"]

UP, DOWN, OUT = np.array([0.0, 1.0]), np.array([0.0, -1.0]), np.array([1.0, 0.0])
OBLIQUE = np.array([1.0, 1.0]) / math.sqrt(2.0)
TYPED = {(0.0, 1.0): [0, 0, 1], (0.0, -1.0): [0, 0, -1], (1.0, 0.0): [1, 0, 0]}


def draw_strip(dice: Dice) -> Drawn:
    """A strip of 2 to 12 panels, pulled at a crease line or its tip by a motion, or by a force.

    The case has a solution. The panels are 150 to 2000 times as long as thick, so that they buckle before they yield. Every
    motion ends before any panel is taut (95 % of the length in between, 88 % at a clamped tip). If a single panel holds the
    crease line, this panel is always shortened and never stretched. With contact, no motion leads through a held panel. A
    load is at most three times the load that opens a crease.
    """
    of = sheet(dice, (2, 12), (60.0, 88.0), (150.0, 2000.0))
    ratio = dice.decades(0.1, 10.0)
    crease, files, stiffness = crease_tables(dice, of, ratio, ("linear", "linear", "spline", "family"))
    damping = dice.one_of((None, "1 ms", "2 ms", "5 ms", "10 ms"))
    extra: Tables = {"crease": crease}
    if dice.chance(0.5):
        extra |= contact_tables(dice)
    if dice.chance(0.5):
        extra |= gravity(dice)
    if dice.chance(0.1):
        extra["crease"] |= (
            {"rest_angle": deg(2.0 * of.angle * dice.between(0.5, 1.0), 3)} if crease.get("law") == "linear" else {}
        )
    if dice.chance(0.2) or of.panels == 2:
        held, pull = _loaded(dice, of, stiffness)
    else:
        held, pull = drive_of(dice, of, "contact" in extra)
    return Drawn(strip_tables(of, held, damping) | extra | pull, files)


def drive_of(dice: Dice, of: Sheet, touches: bool) -> tuple[list[int] | None, Tables]:
    """Held panels (None: the default) and [[drive]]; if `touches` is true, the drive does not lead through a held panel."""
    while True:
        way = dice.one_of((UP, UP, UP, DOWN, OUT, OBLIQUE))
        both = of.panels >= 4 and dice.chance(0.6)
        tip = not both and of.panels >= 4 and dice.chance(0.4)
        drive: Tables = {"direction": TYPED.get((float(way[0]), float(way[1])), [1, 0, 1])}
        if tip:
            part = (of.segments - 0.5) / of.segments
            last, end = of.crease_at(of.panels - 1), of.crease_at(of.panels)
            start = last + part * (end - last)
            anchors = [(of.crease_at(1), 0.88 / 0.95 * (of.panels - 2 + part) * of.panel)]
            drive["body"] = f"panel {of.panels} segment {of.segments}"
        else:
            creases = range(2, of.panels - 1 if both else of.panels)
            if not creases:
                continue
            crease = dice.one_of(creases)
            start = of.crease_at(crease)
            anchors = [(of.crease_at(1), (crease - 1) * of.panel)]
            if both:
                anchors.append((of.crease_at(of.panels - 1), (of.panels - 1 - crease) * of.panel))
            drive["crease"] = crease
            if dice.chance(0.12):
                drive["guide"] = False
        most = reach(of.panel, 2.0 * of.panels * of.panel, start, way, anchors)
        if most < 0.1 * of.panel:
            continue
        travel = 1e-3 * max(1.0, round(1e3 * most * dice.between(0.25, 0.97), 1))
        if touches and any(_crosses(of, start, travel * way, panel) for panel in ((1, of.panels) if both else (1,))):
            continue
        speed = dice.one_of((0.5e-3, 1e-3, 2e-3, 2e-3, 2e-3, 5e-3, 10e-3))
        drive |= {"speed": mm(speed), "travel": mm(min(travel, 0.99 * most))}
        drive["speed"] += "/s"
        return (None if both else [1]), {"drive": [drive]}


def _crosses(of: Sheet, start: np.ndarray, way: np.ndarray, panel: int) -> bool:
    """Whether a straight path crosses a panel in the folded state."""
    one, other = of.crease_at(panel - 1), of.crease_at(panel)
    matrix = np.column_stack([way, one - other])
    if abs(np.linalg.det(matrix)) < 1e-12 * float(np.linalg.norm(way)) * of.panel:
        return False
    part, place = np.linalg.solve(matrix, one - start)
    return bool(1e-9 < part <= 1.0 and 0.0 <= place <= 1.0)


def _loaded(dice: Dice, of: Sheet, stiffness: float) -> tuple[list[int] | None, Tables]:
    """Held panels and a [[load]] that increases slowly and is then constant for some time."""
    both = of.panels >= 4 and dice.chance(0.5)
    panel = dice.count(2, of.panels - 1 if both else of.panels)
    lever = of.panel * (1.0 if both else max(1.0, panel - 1.0))
    force = digits(stiffness / lever * dice.decades(0.1, 3.0))
    way = dice.one_of((UP, UP, DOWN, OUT))
    ramp = nice(min(2.0, max(0.1, 10.0 * of.period)))
    load: Tables = {
        "body": f"panel {panel} segment {max(1, of.segments // 2)}",
        "force": [newton(force * float(way[0])) if way[0] else 0, 0, newton(force * float(way[1])) if way[1] else 0],
        "time": {"kind": "ramp", "end": f"{ramp:g} s"},
    }
    return (None if both else [1]), {"load": [load], "solve": {"end_time": f"{nice(ramp * dice.between(1.1, 2.0)):g} s"}}


def draw_released(dice: Dice) -> Drawn:
    """A stowed strip that its creases deploy; their rest angles belong to a more open state.

    The case has a solution: the strip starts at rest as folded and moves under bounded moments (strain of the panels below 2
    % at the start), with damping, for two to ten times the deployment time; no motion is prescribed.
    """
    of = sheet(dice, (2, 12), (60.0, 88.0), (150.0, 1500.0))
    rest = math.radians(round(2.0 * math.degrees(of.angle) * dice.between(0.0, 0.95)))
    turn = max(2.0 * of.angle - rest, 0.1)
    ratio = min(dice.decades(0.1, 4.0), 4.0 / turn)
    stiffness = digits(ratio * of.bending / of.panel)
    crease: Tables = {"law": "linear", "stiffness": f"{1e3 * stiffness:.3g} N mm/rad", "rest_angle": deg(rest)}
    mass = of.density * of.width * of.thickness * of.panels * of.panel
    length = of.panels * of.panel
    deploys = math.sqrt(mass * length**2 / (stiffness * turn) / of.panels)
    end = nice(min(5.0, max(0.02, deploys * dice.between(2.0, 10.0) / 3.0)))
    tables = strip_tables(of, [1], dice.one_of((None, "1 ms", "2 ms", "5 ms", "10 ms"))) | {"crease": crease}
    if dice.chance(0.5):
        tables |= contact_tables(dice)
    if dice.chance(0.3):
        tables |= gravity(dice)
    return Drawn(tables | {"solve": {"end_time": f"{end:g} s"}}, {})


def draw_deployed(dice: Dice) -> Drawn:
    """A strip that is pulled taut along its length and then struck.

    The case has a solution: the drive ends where the panels between the held panel and the driven crease are straight, and
    stretched by 10 to 300 millionths at 20 MPa at most; the impact moves the taut strip by 2 % of its length at most.
    """
    of = sheet(dice, (4, 8), (50.0, 80.0), (150.0, 1500.0))
    last = of.panels - 1 if of.panels % 2 == 0 else of.panels - 2
    crease = dice.one_of((last, last, max(3, last - 2)))  # at the height of crease 1, so that the pull is along the strip
    ratio = dice.decades(0.1, 2.0)
    of_crease, files, _ = crease_tables(dice, of, ratio, ("linear", "linear", "spline"))
    span = (crease - 1) * of.panel
    strain = min(dice.decades(2e-5, 3e-4), 20e6 / of.young)
    travel = span * (1.0 - math.cos(of.angle)) + span * strain
    tables = strip_tables(of, [1], dice.one_of((None, "5 ms", "10 ms"))) | {"crease": of_crease}
    tables["stages"] = ["deploy", "vibrate"]
    tables["drive"] = [
        {"crease": crease, "direction": [1, 0, 0], "speed": dice.one_of(("2 mm/s", "5 mm/s")), "travel": mm(travel)}
    ]
    pull = of.young * strain * of.width * of.thickness
    force = digits(pull * dice.decades(0.002, 0.05), 2)
    wave = math.sqrt(of.young * strain / of.density)
    frequency = max(wave / (2.0 * span), 0.1)
    middle = 0.5 * of.panels * of.panel
    struck = of.panel * dice.one_of((1.5, 2.0, 2.5)) - middle
    probe = mm(struck)
    tables |= {
        "damping": {"air": dice.one_of(("2 1/s", "4 1/s", "8 1/s"))},
        "impact": {
            "pulse": "half-sine", "force": newton(force), "point": [probe, 0],
            "duration": f"{nice(1e3 * min(0.05, dice.between(0.1, 0.6) / frequency)):g} ms",
        },
        "vibration": {
            "duration": f"{nice(min(2.0, max(0.05, dice.between(5.0, 20.0) / frequency))):g} s",
            "modes": dice.one_of((10, 20, 20, 30)), "probes": {"struck": [probe, 0]},
        },
    }  # fmt: skip
    if dice.chance(0.4):
        tables["deployed"] = {"elements_per_panel": dice.one_of((4, 6, 8)), "elements_across": dice.one_of((2, 3, 4))}
    if dice.chance(0.2):
        tables["air"] = {"density": "1.2 kg/m^3", "length": mm(min(span, 5.0 * of.width))}
    return Drawn(tables, files)
