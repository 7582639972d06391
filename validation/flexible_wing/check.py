"""Wings of flexible panels: against rigid panels as E grows, frequencies of the deployed wing, and energy balances.

python -m validation.flexible_wing.check [--parts rigid modes balance] [--out out/validation/flexible_wing] [--full]
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

import fsm
from fsm.api.case import Result
from validation.gallery.command import command
from validation.gallery.drawing import beside
from validation.gallery.record import Check, NotCompared, Part, Place, against, below

TITLE = "Wing of flexible panels"
PANEL = {"panels": 2, "length": 0.8, "width": 1.6, "thickness": 0.01, "mass": 3.5, "gap": 0.04}
HINGE = {
    "spring": {"stiffness": 0.1, "rest": "-90 deg"}, "damper": {"coefficient": 0.4},
    "stop": {"lower": 0.0, "stiffness": 1e3, "damping": 10.0}, "latch": {"at": 0.0, "stiffness": 1e3, "damping": 10.0},
}  # fmt: skip
MODULI = 5e8, 5e9, 5e10, 5e11
"""Young's moduli, Pa."""
DRAWN = 12
"""Number of random wings."""
SPRING = 1e3
"""Stiffness of the springs of the deployed wing, N m/rad."""


def unfolded(folder: Path, young: float) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """Times, angles of both hinges until the first latch, and summary; E = 0 is a rigid panel.

    Panels of beams have no inertia of their thickness; the rigid ones are thin, with the same mass.
    """
    keys = {"flexible": {"young": young}} if young else {"thickness": 1e-4}
    case = {
        "units": "SI", "wing": PANEL | {"hinge": HINGE} | keys,
        "solve": {"end_time": 7.3, "error_estimates": "off"} | ({"rtol": 1e-7} if young else {}),
        "save": {"interval": 0.05, "channels": ["joint.*"]},
    }  # fmt: skip
    result = fsm.load(case).run(folder / f"{young:g}", figures=False)
    angles = np.array([result[f"joint.hinge {number}.angle"].values for number in (1, 2)])
    return result.solution.time, angles, result.summary | {"residual": residual(result)}


def residual(result: Result) -> float:
    """Largest energy balance residual of all saved states, over the reference energy. `energy_error` would also contain the
    round-off of stiff panels.
    """
    energy = result.solution.energy
    return float(np.abs(energy["error"]).max() / max(np.abs(energy[name]).max() for name in ("dissipated", "kinetic")))


def rigid(place: Place) -> Iterator[Check | NotCompared]:
    """Differences from rigid panels as E grows: angles, times and moments of both latches."""
    runs = {young: unfolded(place.out, young) for young in (0.0, *MODULI)}
    time, known, _ = runs[0.0]
    before = time < 4.5
    latches = {young: _latches(run[2]) for young, run in runs.items()}
    largest = {young: float(np.abs(run[1] - known)[:, before].max()) for young, run in runs.items() if young}
    points = {"rigid": (time[::4], np.degrees(known[1][::4]))}
    curves = {f"E = {young:.0e} Pa": (runs[young][0], np.degrees(runs[young][1][1])) for young in MODULI[:2]}
    picture = beside(place.out / "angles.png", curves, points, "time (s)", "angle of hinge 2 (deg)")
    text = ", ".join(f"{young:.0e} Pa: {largest[young]:.2e} rad" for young in MODULI)
    order = math.log10(largest[MODULI[0]] / largest[MODULI[1]])
    yield against("order of angles in 1/E", text, order, 1.0, "static bending", picture, rtol=0.15)
    yield below("largest difference of angles, rad", f"E = {MODULI[3]:.0e} Pa", largest[MODULI[3]], 5e-5, "rigid", picture)
    for number, name in enumerate(("hinge 2", "hinge 1")):
        later = [latches[young][number]["time"] - latches[0.0][number]["time"] for young in MODULI]
        text = ", ".join(f"{young:.0e} Pa: {each:.1e} s" for young, each in zip(MODULI, later, strict=True))
        yield below(f"difference of the latch time of {name}, s", text, abs(later[-1]), 5e-5, "rigid panels", picture)
    moments = {young: latches[young][1]["largest"] for young in MODULI}
    text = ", ".join(f"{young:.0e} Pa: {moment:.2f} N m" for young, moment in moments.items())
    wanted = latches[0.0][1]["largest"]
    yield against(
        "largest moment at the root", text, moments[MODULI[3]], wanted, "rigid panels", picture, rtol=0.01, unit="N m"
    )
    energy = max(run[2]["residual"] for run in runs.values())
    yield below("energy balance residual with latches and stops", "largest of all runs", energy, 1e-6, "exact", picture)


def _latches(summary: dict[str, Any]) -> list[dict[str, Any]]:
    return [event for event in summary["joint_events"] if event["what"] == "latch closes"]


def modes(place: Place) -> Iterator[Check | NotCompared]:
    """First two bending frequencies of the deployed wing with springs as stiff as its latches."""
    known = bending_frequencies(5e9)
    found = {}
    for kind, mesh in (("beam", [4, 1]), ("film", [4, 2]), ("film", [4, 4]), ("film", [4, 8])):
        flexible = {"kind": kind, "young": 5e9, "poisson": 0.0, "mesh": mesh}
        keys = {
            "gap": 1e-3,
            "stowed": [0.0, 0.0],
            "hinge": {"spring": {"stiffness": SPRING, "rest": 0.0}},
            "flexible": flexible,
        }
        case = {"units": "SI", "wing": PANEL | keys, "step": [{"kind": "modes", "modes": 4}]}
        result = fsm.load(case).run(place.out / f"{kind}{mesh[1]}", figures=False)
        found[kind, mesh[1]] = np.array(result.summary["step"][0]["frequencies_hz"])
    numbers = [1, 2]
    curves = {
        f"{kind}, {across} across": (numbers, [_nearest(each, f) for f in known]) for (kind, across), each in found.items()
    }
    picture = beside(place.out / "modes.png", curves, {"beams": (numbers, known)}, "bending mode", "frequency (Hz)")
    for (kind, across), within in zip(found, (1e-4, 0.05, 0.01, 2e-3), strict=True):
        for number, wanted in zip(numbers, known, strict=True):
            what = f"bending mode {number}, {kind}s" + (f", {across} elements across" if kind == "film" else "")
            value = _nearest(found[kind, across], wanted)
            yield against(
                what, "E = 5 GPa", value, wanted, "Euler-Bernoulli beams on springs", picture, rtol=within, unit="Hz"
            )


def _nearest(found: np.ndarray, wanted: float) -> float:
    return float(found[np.argmin(np.abs(found - wanted))])


def bending_frequencies(young: float) -> list[float]:
    """First two frequencies of two Euler-Bernoulli beams in a row on torsion springs, at the base and between them, Hz."""
    length, line_mass = PANEL["length"], PANEL["mass"] / PANEL["length"]
    bending = young * PANEL["width"] * PANEL["thickness"] ** 3 / 12.0

    def determinant(frequency: float) -> float:
        b, none = ((2.0 * math.pi * frequency) ** 2 * line_mass / bending) ** 0.25, np.zeros(4)

        def at(x: float, order: int) -> np.ndarray:
            c, s, ch, sh = math.cos(b * x), math.sin(b * x), math.cosh(b * x), math.sinh(b * x)
            return b**order * np.array([[c, s, ch, sh], [-s, c, sh, ch], [-c, -s, ch, sh], [s, -c, sh, ch]][order])

        rows = np.array([
            [*at(0.0, 0), *none], [*(bending * at(0.0, 2) - SPRING * at(0.0, 1)), *none],
            [*at(length, 0), *-at(0.0, 0)], [*(bending * at(length, 2) + SPRING * at(length, 1)), *-SPRING * at(0.0, 1)],
            [*at(length, 2), *-at(0.0, 2)], [*at(length, 3), *-at(0.0, 3)], [*none, *at(length, 2)], [*none, *at(length, 3)],
        ])  # fmt: skip
        return float(np.linalg.det(rows / np.abs(rows).max(axis=1, keepdims=True)))

    tried = np.linspace(0.1, 30.0, 300)
    signs = [math.copysign(1.0, determinant(f)) for f in tried]
    ends = [(a, b) for a, b, x, y in zip(tried, tried[1:], signs, signs[1:], strict=False) if x != y]
    return [brentq(determinant, a, b) for a, b in ends[:2]]


def drawn(number: int) -> dict[str, Any]:
    """Case of a random wing of two or three flexible panels, with latches, at rtol = 1e-7; some have a play."""
    rng = np.random.default_rng([8, number])
    panel = {"panels": int(rng.integers(2, 4)), "thickness": float(rng.uniform(0.008, 0.015)), "gap": 0.04}
    panel |= {"length": float(rng.uniform(0.5, 1.0)), "width": float(rng.uniform(0.8, 1.6))}
    panel["mass"] = float(rng.uniform(2.0, 5.0))
    stiffness, damping = float(10 ** rng.uniform(2.5, 3.5)), float(rng.uniform(0.0, 20.0))
    stop = {"stiffness": stiffness, "damping": damping}
    hinge = {
        "spring": {"stiffness": float(rng.uniform(0.1, 0.3)), "rest": "-90 deg"},
        "damper": {"coefficient": float(rng.uniform(0.1, 0.5))},
        "stop": {"lower": 0.0} | stop, "latch": {"at": 0.0} | stop,
    }  # fmt: skip
    if number % 3 == 0:
        hinge["latch"]["play"] = 2e-3
    flexible = {"young": float(10 ** rng.uniform(9.0, 11.0)), "mesh": [int(rng.integers(2, 5)), 1]}
    return {
        "units": "SI", "wing": panel | {"hinge": hinge, "flexible": flexible},
        "solve": {"end_time": 6.0, "rtol": 1e-7, "error_estimates": "off"},
        "save": {"interval": 0.05, "channels": ["joint.*"]},
    }  # fmt: skip


def balance(place: Place) -> Iterator[Check | NotCompared]:
    """Energy balances of random wings: residual, and numerical dissipation, which is an entry of the balance."""
    found = []
    for number in range(DRAWN):
        result = fsm.load(drawn(number)).run(place.out / f"drawn {number}", figures=False)
        found.append((residual(result), result.summary["energy_drift"], len(_latches(result.summary))))
    errors, drifts, latches = zip(*found, strict=True)
    numbers = np.arange(DRAWN)
    curves = {"with numerical dissipation": (numbers, np.array(errors)), "without": (numbers, np.array(drifts))}
    picture = beside(place.out / "balance.png", curves, {}, "random wing", "residual over the turnover", log=True)
    text = f"{sum(latches)} latches; largest residual without numerical dissipation {max(drifts):.1e}"
    yield below("energy balance residual of random wings", text, max(errors), 1e-6, "exact", picture)


PARTS: dict[str, Part] = {"rigid": rigid, "modes": modes, "balance": balance}

if __name__ == "__main__":
    sys.exit(command(PARTS, "flexible_wing", __doc__))
