"""Contact in piles: comparisons with bounds, balances, planar results and rigid bodies; README.md states the purpose of each
part.

    python -m validation.contact [--parts stack,box,friction,range,peer] [--quick] [--out out/contact]

Exit code 1 means that an error exceeds its tolerance.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from validation.contact import box_of_plates, plots, pulled_strip, rigid_peer, stack

Check = tuple[str, float, float]
"""Quantity, its value, and the largest allowed value."""


def check_stack(quick: bool, out: Path) -> list[Check]:
    """Twenty panels are pressed flat and released."""
    panels = 8 if quick else 20
    pressed = stack.press(stack.stack_scene(panels))
    plots.draw_stack(out / "stack.png", pressed)
    crossed = sum(len(stack.crossings(pressed.system, state)) for state in pressed.saved)
    flat = min(state.q[-3] for state in pressed.saved)
    say(f"stack: {panels} panels, press at {1e3 * flat:.2f} mm, deepest {1e6 * pressed.deepest.max():.1f} um")
    statistics = pressed.statistics
    say(f"       {statistics.steps} steps, {len(statistics.events)} snaps, {statistics.wall_time:.0f} s")
    touched = pressed.allowed > 0.0
    return [
        ("stack: layers that cross, all records", crossed, 0),
        ("stack: depth over its static bound", float((pressed.deepest[touched] / pressed.allowed[touched]).max()), 1.001),
        ("stack: energy error", pressed.energy_balance.relative_error, 1e-2),
        ("stack: not come back, mm or mrad", 1e3 * pressed.not_back, 1e3 * stack.LENGTH * stack.RTOL),
    ]


def check_box(quick: bool, out: Path) -> list[Check]:
    """Two hundred plates dropped into a box."""
    count, columns, end = (12, 2, 0.1) if quick else (200, 10, 0.11)
    fall = box_of_plates.drop(box_of_plates.box_scene(count, columns), end, 1e-4)
    plots.draw_box(out / "box.png", fall, box_of_plates.half_width(columns))
    weight = count * box_of_plates.MASS * box_of_plates.GRAVITY
    allowed = box_of_plates.deepest_allowed(box_of_plates.CONTACT, 2.0 * fall.fastest, weight)
    out_by = max(box_of_plates.outside(fall.system, state, box_of_plates.half_width(columns)) for state in fall.saved)
    say(f"box: {count} plates, {end:g} s, deepest {1e3 * fall.deepest:.3f} mm, bound {1e3 * allowed:.3f} mm")
    say(f"     {fall.statistics.steps} steps, {fall.statistics.rejected} repeated, {fall.time:.0f} s")
    return [
        ("box: a middle plane beyond a wall, mm", 1e3 * out_by, 0.0),
        ("box: depth over its bound", fall.deepest / allowed, 1.0),
        ("box: energy error", fall.energy_balance.relative_error, 1e-4),
        ("box: gain of energy", fall.rise / fall.energy_balance.turnover, 1e-5),
    ]


def check_friction(quick: bool, out: Path) -> list[Check]:
    """The pulled strip in space, and with friction."""
    plane = pulled_strip.pull()
    space = pulled_strip.pull("solve.spatial=true")
    frictions = np.array([0.0, 0.3, 0.6]) if quick else np.linspace(0.0, 0.6, 13)
    pulls = [
        pulled_strip.pull('friction.law="tanh"', f"friction.mu_dynamic={mu}", 'friction.v_static="1 um/s"') if mu else plane
        for mu in frictions
    ]
    plots.draw_friction(out / "friction.png", frictions, pulls)
    say("| friction | peak, N | at, mm | slid, mm | friction, uJ | of all, % |")
    for mu, one in zip(frictions, pulls, strict=True):
        share = 100.0 * one.friction_energy / one.turnover
        say(
            f"| {mu:.2f} | {one.peak_force:.6f} | {1e3 * one.peak_travel:.3f} | {1e3 * one.slid:.3f} "
            f"| {1e6 * one.friction_energy:.2f} | {share:.4f} |"
        )
    peaks = np.array([one.peak_force for one in pulls])
    bend = np.abs(np.diff(peaks, 2)).max() / np.ptp(peaks)
    return [
        ("space: force curve", pulled_strip.curve_difference(plane, space), 1e-3),
        ("friction: bend of the peak's curve over its range", float(bend), 0.1),
    ]


def check_range(quick: bool, out: Path) -> list[Check]:
    """Stiffness and thickness of contact over decades."""
    stiffness = [f"{base:g}" for base in (2e5, 1e7, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15)]
    thickness = (5e-3, 1e-3, 3e-4, 1e-4, 3e-5, 5e-6)
    runs = [(f"K = {text} N/m^1.5", [f"contact.stiffness={text}"]) for text in stiffness]
    runs += [(f"thickness {1e3 * t:g} mm", pulled_strip.as_thick(t)) for t in thickness]
    if quick:
        runs = [runs[0], runs[4], runs[8], runs[9], runs[14]]
    pulled_strip.pull()
    say("| contact | peak, N | at, mm | deepest, mm | energy error | steps | time, s |")
    times = []
    for name, changes in runs:
        one = pulled_strip.pull(*changes)
        times.append(one.time)
        say(
            f"| {name} | {one.peak_force:.5f} | {1e3 * one.peak_travel:.2f} | {1e3 * one.deepest:.5f} "
            f"| {one.energy_error:.0e} | {one.steps} | {one.time:.2f} |"
        )
    return [("range: slowest over fastest", max(times) / min(times), 10.0)]


def check_peer(quick: bool, out: Path) -> list[Check]:
    """Closed forms of rigid bodies; results of pymunk are printed for comparison."""
    found: list[Check] = []
    names = {"collision": "momentum, energy, speeds", "corner": "speed, spin, energy", "slide": "way, height, heat"}
    cases = [("collision", e, rigid_peer.collision(e)) for e in (1.0, 0.5, 0.1)]
    cases += [("corner", e, rigid_peer.corner(e)) for e in (1.0, 0.5, 0.1)]
    cases += [("slide", mu, rigid_peer.slide(mu)) for mu in (0.1, 0.3, 0.6)]
    for kind, value, case in cases:
        say(f"{kind} {value:g} ({names[kind]})\n  fsm    {case.fsm}\n  pymunk {case.pymunk}\n  exact  {case.exact}")
        off = np.abs(case.fsm - case.exact) / np.where(case.exact == 0.0, rigid_peer.LENGTH, np.abs(case.exact))
        found.append((f"{kind} {value:g}: off the closed form", float(off.max()), 5e-3))
    return found


PARTS: dict[str, Callable[[bool, Path], list[Check]]] = {
    "stack": check_stack,
    "box": check_box,
    "friction": check_friction,
    "range": check_range,
    "peer": check_peer,
}


def say(text: str) -> None:
    print(text, flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the parts, and print values and bounds."""
    parser = argparse.ArgumentParser(prog="python -m validation.contact", description=__doc__.splitlines()[0])
    parser.add_argument("--parts", default=",".join(PARTS), help="%(default)s")
    parser.add_argument("--quick", action="store_true", help="fewer panels and plates")
    parser.add_argument("--out", type=Path, default=Path("out/contact"))
    options = parser.parse_args(arguments)
    checks = [check for part in options.parts.split(",") for check in PARTS[part](options.quick, options.out)]
    say("\n| what | found | allowed |\n|---|---|---|")
    for what, value, allowed in checks:
        say(f"| {what} | {value:.3g}{'' if value <= allowed else ' MISSED'} | {allowed:g} |")
    return int(any(value > allowed for _, value, allowed in checks))


if __name__ == "__main__":
    sys.exit(main())
