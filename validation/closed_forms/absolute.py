"""Checks of absolute nodal coordinates: cables, deep beams, a pendulum, strings, plates."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from validation.closed_forms.ancf import (
    LENGTH,
    cable_cantilever,
    cable_pendulum,
    deep_cantilever,
    plate_modes,
    rolled_up,
    string_ratio,
)
from validation.closed_forms.beams import ELASTICA, MATTIASSON
from validation.gallery.drawing import beside, convergence
from validation.gallery.record import Check, Place, against, below

__all__ = ["cable", "deep", "pendulum", "plates", "string"]

CABLE = (-0.508537304, -1.207239855)
ONE_ELEMENT = (-0.362245, -0.994145)
DEEP = np.array([-0.15097114, -0.7105686])
TIMOSHENKO = 10.0 * 1.3 / (12.0 + 11.0 * 0.3)
"""Shear factor of a rectangle with nu = 0.3 (Cowper 1966)."""
PENDULUM = {
    0.1: (1.200000, -0.049049),
    0.2: (1.179924, -0.196180),
    0.3: (1.078738, -0.441262),
    0.4: (0.852851, -0.784469),
    0.5: (0.394834, -1.215096),
}
PLATES = {False: (19.739209, 49.348022, 49.348022, 78.956835), True: (35.985191, 73.393845, 73.393846, 108.216502)}
STRING = {0.0: 1.0, 0.5: 0.6855592720, 1.0: 0.5477053736}
CONVERGED = "converged, computed independently (validation/references.md)"


def cable(place: Place) -> Iterator[Check]:
    """ANCF cable as a cantilever, compared with the elastica and with a published value of one element, and rolled up by a
    moment."""
    counts = (2, 4, 8, 16, 32)
    errors = [float(np.linalg.norm(cable_cantilever(n) - CABLE)) / LENGTH for n in counts]
    slopes = convergence(place.out / "order.png", counts, {"tip": errors}, 4, x="elements", y="error of the tip / length")
    for name, value, exact in zip(("along", "down"), cable_cantilever(64), CABLE, strict=True):
        yield against(
            f"tip {name}, 64 elements",
            "E = 207 GPa, 0.1 x 0.1 m, L = 2 m, F = 3EI/L²",
            float(value),
            exact,
            "converged value of another program (validation/references.md)",
            slopes,
            atol=2e-8,
            unit="m",
        )
    for name, value, exact in zip(("along", "down"), cable_cantilever(1), ONE_ELEMENT, strict=True):
        yield against(
            f"tip {name}, one element",
            "the same",
            float(value),
            exact,
            "published value of one element (validation/references.md)",
            slopes,
            atol=1e-6,
            unit="m",
        )
    order = math.log2(errors[2] / errors[3])
    yield below(
        "order of convergence: below 4 by",
        "8 to 16 elements",
        max(0.0, 4.0 - order),
        0.0,
        "cubic elements",
        slopes,
        detail=f"order {order:.2f}",
    )
    curve = np.linspace(0.25, 10.0, 14)
    swept = np.array([-cable_cantilever(16, True, a, 0.01) / LENGTH for a in curve])
    ours = {"w/L": (curve, swept[:, 1]), "u/L": (curve, swept[:, 0])}
    known = {f"{n} elastica": (list(ELASTICA), [r[i] for r in ELASTICA.values()]) for i, n in enumerate(("w/L", "u/L"))}
    picture = beside(place.out / "elastica.png", ours, known, "PL²/EI", "displacement of the tip / L", title="16 elements")
    for load, exact in ELASTICA.items():
        along, down = -cable_cantilever(32, True, load, 0.01) / LENGTH
        yield against(
            f"w/L at PL²/EI = {load:g}", "32 elements, L/h = 200", float(down), exact[0], MATTIASSON, picture, rtol=1e-4
        )
        yield against(
            f"u/L at PL²/EI = {load:g}", "32 elements, L/h = 200", float(along), exact[1], MATTIASSON, picture, rtol=1e-4
        )
    nodes = rolled_up()
    angle = np.linspace(0.0, 2 * math.pi, 100)
    radius = LENGTH / (2 * math.pi)
    ring = {"circle": (radius * np.sin(angle), radius * (1 - np.cos(angle)))}
    circle = beside(
        place.out / "circle.png",
        ring,
        {"nodes": (nodes[:, 0], nodes[:, 2])},
        "x (m)",
        "z (m)",
        title="M = 2πEI/L",
        equal=True,
    )
    yield below(
        "tip off the root, M = 2πEI/L",
        "16 elements, in lengths",
        float(np.linalg.norm(nodes[-1, :3])) / LENGTH,
        1e-4,
        "closed form: a circle",
        circle,
    )
    yield against(
        "height of the middle, M = 2πEI/L",
        "16 elements",
        float(nodes[8, 2]),
        LENGTH / math.pi,
        "closed form: L/π",
        circle,
        atol=1e-4 * LENGTH,
        unit="m",
    )


def deep(place: Place) -> Iterator[Check]:
    """Shear-deformable beam elements of scissor arrays: a deep cantilever under large bending."""
    counts = (1, 2, 4, 8)
    ends = {n: deep_cantilever("section", n, 2.0, 0.5, 62.5e6, TIMOSHENKO) for n in counts}
    errors = [float(np.linalg.norm(ends[n] - DEEP) / np.linalg.norm(DEEP)) for n in counts]
    slopes = convergence(place.out / "order.png", counts, {"section": errors}, 4, x="elements")
    source = (
        "boundary value problem to 1e-10; published by Gerstmayr, Matikainen and Mikkola 2008, Multibody Syst. Dyn. 20, 359"
    )
    for name, value, exact in zip(("along", "across"), ends[8], DEEP, strict=True):
        yield against(
            f"tip {name}, 8 elements",
            "L = 2 m, 0.1 x 0.5 m, 62.5 MN",
            float(value),
            float(exact),
            source,
            slopes,
            atol=2e-6,
            unit="m",
        )
    yield below("error with four elements", "of the tip, relative", errors[2], 1e-4, source, slopes)
    for slenderness in (5.0, 1000.0):
        height = 2.0 / slenderness
        second = 0.1 * height**3 / 12.0
        force = 1e-6 * 3.0 * 2.07e11 * second / 4.0
        exact = -force * (8.0 / (3.0 * 2.07e11 * second) + 2.0 / (2.07e11 / 2.6 * 5.0 / 6.0 * 0.1 * height))
        value = float(deep_cantilever("section", 1, 2.0, height, force)[1])
        yield against(
            f"small bending, L/h = {slenderness:g}, one element",
            "neither shear nor Poisson locking",
            value,
            exact,
            "closed form, Timoshenko",
            slopes,
            rtol=2e-6,
            unit="m",
        )


def pendulum(place: Place) -> Iterator[Check]:
    """Flexible pendulum: a soft cable released from horizontal."""
    fine = [round(0.02 * k, 10) for k in range(1, 26)]
    tips, energy = cable_pendulum(32, fine)
    ours = {"fsm, 32 elements": (tips[:, 0], tips[:, 1])}
    known = {"reference": tuple(zip(*PENDULUM.values(), strict=True))}
    picture = beside(place.out / "tip.png", ours, known, "x of the tip (m)", "y of the tip (m)")  # type: ignore[arg-type]
    for time, exact in PENDULUM.items():
        at = tips[fine.index(round(time, 10))]
        for name, value, number in zip(("x", "y"), at, exact, strict=True):
            yield against(
                f"tip {name} at {time:g} s",
                "L = 1.2 m, E = 0.7 MPa, strains to 9 %",
                float(value),
                number,
                "ANCF with 64 elements, computed independently (validation/references.md)",
                picture,
                atol=1e-3,
                unit="m",
            )
    yield below("energy error", "of the reference energy", energy, 1e-6, "conservation of energy", picture)


def string(place: Place) -> Iterator[Check]:
    """A tensioned string with a mass in its middle."""
    found = {ratio: string_ratio(ratio) for ratio in STRING}
    curve = np.linspace(0.0, 1.5, 13)
    ours = {"16 cable elements": (curve, [string_ratio(float(r)) for r in curve])}
    picture = beside(place.out / "string.png", ours, {"exact": (list(STRING), list(STRING.values()))}, "m/(μL)", "f/f0")
    for ratio, exact in STRING.items():
        yield against(
            f"f/f0 at m/(μL) = {ratio:g}",
            "16 elements",
            found[ratio],
            exact,
            "root of the frequency equation (validation/references.md)",
            picture,
            rtol=1e-4,
        )


def plates(place: Place) -> Iterator[Check]:
    """Free vibration of square plates without tension, hinged and clamped."""
    counts = (8, 16, 32)
    for clamped, exact in PLATES.items():
        name = "clamped" if clamped else "hinged"
        found = np.array([plate_modes(n, clamped) for n in counts])
        errors = {f"mode {i + 1}": np.abs(found[:, i] / exact[i] - 1) for i in (0, 1, 3)}
        slopes = convergence(place.out / f"{name}.png", counts, errors, 2, x="cells along a side", title=name)
        for i, number in enumerate(exact):
            value = float(found[-1, i])
            yield against(
                f"{name}, mode {i + 1}: ωa²√(ρh/D)", "32 x 32 cells, ν = 0.3", value, number, CONVERGED, slopes, rtol=5e-3
            )
        orders = np.log2((found[1] / exact - 1) / (found[2] / exact - 1))
        yield below(
            f"{name}: order of convergence, off 2 by",
            "16 to 32 cells; the element does not conform and comes from below",
            float(np.abs(orders - 2).max()),
            0.1,
            "second order of this element",
            slopes,
        )
