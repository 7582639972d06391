"""Checks of contact and friction laws: actual restitution, durations, bouncing and sliding."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from fsm.case.models.contact import Contact, Friction
from fsm.laws.normal.flores import damping_factor as flores
from fsm.laws.normal.hunt_crossley import damping_factor as hunt_crossley
from fsm.laws.normal.lankarani_nikravesh import damping_factor as lankarani_nikravesh
from validation.closed_forms.impacts import G, bounces, delivered, impact, kelvin_voigt, slide
from validation.gallery.drawing import beside
from validation.gallery.record import Check, Place, against, below

__all__ = ["bouncing", "impact_law", "restitution", "sliding", "static_friction"]

FACTORS = {"hunt-crossley": hunt_crossley, "lankarani-nikravesh": lankarani_nikravesh, "flores": flores}
HALF = {"hunt-crossley": 0.663, "lankarani-nikravesh": 0.725, "flores": 0.470, "restitution": 0.500}
FACTOR = {0.1: 9.998159, 0.3: 3.087082, 0.5: 1.432751, 0.7: 0.634828, 0.9: 0.166482}
STEP = {
    (0.1, 0.1): 0.5544,
    (0.1, 1.0): 0.1103,
    (1.0, 0.1): 0.5184,
    (1.0, 1.0): 0.4166,
    (10.0, 0.1): 0.7057,
    (10.0, 1.0): 0.7736,
}
EXACT = "closed form: h(1 + e) = ln[(1 + h)/(1 - he)]"


def restitution(place: Place) -> Iterator[Check]:
    """Restitution of the damped contact laws, for different masses, speeds and exponents."""
    asked = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9])
    curves, points = {}, {}
    for law in ("restitution", *FACTORS):
        curves[law] = (
            asked,
            [impact(Contact(law=law, stiffness=1e6, restitution=c, speed_floor=1e-6), 0.1, 1.0)[0] for c in asked],
        )  # type: ignore[arg-type]
        points[f"{law}, closed form"] = (
            asked,
            asked if law == "restitution" else [delivered(FACTORS[law](c)) for c in asked],
        )
    picture = beside(
        place.out / "delivered.png", curves, points, "restitution asked for", "restitution delivered", size=(5.6, 4.0)
    )
    for c, h in FACTOR.items():
        yield against(
            f"h of the exact law, e = {c:g}",
            "solved from the closed form",
            float(_law_factor(c)),
            h,
            f"{EXACT} (validation/references.md)",
            picture,
            atol=6e-7,
        )
        worst = max(
            (
                impact(Contact(stiffness=1e6, restitution=c, exponent=n, speed_floor=1e-6), m, v)[0]
                for m, v, n in ((0.1, 1.0, 1.5), (2.0, 0.3, 1.0), (0.05, 5.0, 2.2))
            ),
            key=lambda e: abs(e - c),
        )
        yield against(
            f"delivered, e = {c:g} asked for",
            "exact law; worst of three masses, speeds and exponents",
            worst,
            c,
            EXACT,
            picture,
            rtol=1e-7,
        )
    for law, e in HALF.items():
        value = impact(Contact(law=law, stiffness=1e8, restitution=0.5), 1.0, 1.0)[0]  # type: ignore[arg-type]
        yield against(
            f"delivered by {law}, 0.5 asked for",
            "1 kg, 1 m/s",
            value,
            e,
            "table of three digits (validation/references.md)",
            picture,
            atol=5.1e-4,
        )


def _law_factor(c: float) -> float:
    from fsm.laws.normal import NORMAL_LAWS

    return float(NORMAL_LAWS["restitution"].params(Contact(stiffness=1e6, restitution=c))[2])


def impact_law(place: Place) -> Iterator[Check]:
    """Impact (ADAMS), Kelvin-Voigt and Hertz: restitution, depth and duration."""
    speeds = np.geomspace(0.02, 5.0, 13)

    def back(mass: float, speed: float) -> float:
        return impact(Contact(law="impact", stiffness=1e8, damping=1e3, ramp=1e-4), mass, float(speed))[0]

    curves = {f"{m:g} kg": (speeds, [back(m, v) for v in speeds]) for m in (0.1, 1.0, 10.0)}
    points = {f"{m:g} kg, reference": ([0.1, 1.0], [STEP[m, 0.1], STEP[m, 1.0]]) for m in (0.1, 1.0, 10.0)}
    picture = beside(place.out / "impact.png", curves, points, "speed (m/s)", "restitution delivered", title='law "impact"')
    for (mass, speed), e in STEP.items():
        yield against(
            f'restitution of law "impact", {mass:g} kg, {speed:g} m/s',
            "K = 1e8 N/m^1.5, C = 1e3 N s/m, ramp 0.1 mm",
            back(mass, speed),
            e,
            "computed independently (validation/references.md)",
            picture,
            atol=6e-5,
        )
    stiffness = 1e6
    damped = Contact(law="linear", stiffness=stiffness, damping=0.2 * math.sqrt(stiffness), ramp=1e-9)
    let_go, held_on = kelvin_voigt(0.1)
    yield against(
        "restitution of a spring and damper, ζ = 0.1",
        "never pulls: let go where the force is zero",
        impact(damped, 1.0, 1.0)[0],
        let_go,
        "closed form",
        picture,
        rtol=1e-5,
        detail=f"a damper that pulls until the depth is zero: {held_on:.6f}, reference .729248",
    )
    for mass, speed in ((0.1, 1.0), (3.0, 0.02)):
        _, duration, deepest = impact(Contact(stiffness=2e5), mass, speed)
        yield against(
            f"Hertz impact: duration v0/d_max, {mass:g} kg, {speed:g} m/s",
            "undamped",
            duration * speed / deepest,
            2.943275,
            "closed form, 2∫ds/√(1 - s^2.5)",
            picture,
            rtol=1e-6,
        )
        yield against(
            f"Hertz impact: d_max, {mass:g} kg, {speed:g} m/s",
            "undamped",
            deepest,
            (1.25 * mass * speed**2 / 2e5) ** 0.4,
            "closed form, energy",
            picture,
            rtol=1e-8,
            unit="m",
        )


def bouncing(place: Place) -> Iterator[Check]:
    """A plate that bounces until it has lost its energy: duration of all bounces, computed by the complete program."""
    curves = {}
    for e in (0.5, 0.8):
        times, heights, speeds = bounces(e, 15)
        between = np.linspace(0.0, times[-1], 2001)  # flights are parabolas, so they take few steps
        curves[f"e = {e:g}"] = (between, np.maximum(CubicHermiteSpline(times, heights, speeds)(between), 0.0))
        exact = math.sqrt(20.0 / G) * (1 + 2 * sum(e**k for k in range(1, 15)))
        limit = math.sqrt(20.0 / G) * (1 + e) / (1 - e)
        yield against(
            f"time of 15 bounces from 10 m, e = {e:g}",
            "a plate that lands flat",
            float(times[-1]),
            exact,
            "closed form √(2H/g)(1 + 2Σe^k); all bounces √(2H/g)(1 + e)/(1 - e)",
            place.out / "bounces.png",
            rtol=2e-3,
            unit="s",
            detail=f"limit of all bounces {limit:.4f} s",
        )
    ends = {f"all bounces, e = {e:g}": ([math.sqrt(20.0 / G) * (1 + e) / (1 - e)], [0.0]) for e in (0.5, 0.8)}
    beside(place.out / "bounces.png", curves, ends, "time (s)", "height (m)", size=(5.6, 3.4))


def sliding(place: Place) -> Iterator[Check]:
    """A block that slides to rest on a plane under each friction law."""
    mu, speed = 0.3, 0.3
    way, stop = speed**2 / (2 * mu * G), speed / (mu * G)
    laws = {
        "tanh": Friction(law="tanh", mu_dynamic=mu, v_static=1e-4),
        "step": Friction(law="step", mu_static=mu, mu_dynamic=mu, v_static=1e-4, v_dynamic=1e-3),
        "stribeck": Friction(law="stribeck", mu_static=mu, mu_dynamic=mu, v_static=1e-4, v_stribeck=1e-2),
        "lugre": Friction(law="lugre", mu_static=mu, mu_dynamic=mu, v_stribeck=1e-2, presliding=1e-6),
    }
    curves = {}
    for law, friction in laws.items():
        times, x, u = slide(friction, speed, mu)
        curves[law] = (times, 1e3 * u)
        half = int(np.argmax(u < 0.5 * speed))
        yield against(
            f"way to rest, {law}",
            "0.3 m/s, μ = 0.3",
            float(x[-1] - x[0]),
            way,
            "closed form v²/(2μg)",
            place.out / "slide.png",
            rtol=1e-3,
            unit="m",
        )
        yield against(
            f"time to rest, {law}",
            "by the speed half way",
            float(times[half] + u[half] / (mu * G)),
            stop,
            "closed form v/(μg)",
            place.out / "slide.png",
            rtol=5e-3,
            unit="s",
        )
    line = np.linspace(0.0, 1.5 * stop, 16)
    beside(
        place.out / "slide.png",
        curves,
        {"closed form": (line, 1e3 * np.maximum(speed - mu * G * line, 0.0))},
        "time (s)",
        "speed (mm/s)",
    )


def static_friction(place: Place) -> Iterator[Check]:
    """A block on an incline whose slope is between the dynamic and the static friction coefficient."""
    static, dynamic, slope, end, creep = 0.3, 0.2, 0.25, 0.1, 1e-4
    angle = math.atan(slope)
    laws = {
        "step": Friction(law="step", mu_static=static, mu_dynamic=dynamic, v_static=creep, v_dynamic=1e-2),
        "stribeck": Friction(law="stribeck", mu_static=static, mu_dynamic=dynamic, v_static=creep, v_stribeck=1e-2),
    }
    found = {law: slide(friction, 0.0, dynamic, slope, end) for law, friction in laws.items()}
    falls = G * (math.sin(angle) - dynamic * math.cos(angle))
    line = np.linspace(0.0, end, 16)
    picture = beside(
        place.out / "static.png",
        {law: (times, 1e3 * speed) for law, (times, _, speed) in found.items()},
        {"with the dynamic coefficient": (line, 1e3 * falls * line)},
        "time (s)",
        "speed (mm/s)",
    )
    for law, (_, _, speed) in found.items():
        yield below(
            f"static friction holds, {law}",
            f"slope {slope:g}, static {static:g}, dynamic {dynamic:g}: speed after {end:g} s over the law's creep speed",
            float(speed[-1]) / creep,
            2.0,
            "Coulomb: a slope below the static coefficient holds; laws without bristles creep at v_static",
            picture,
            detail=f"with the dynamic coefficient alone it would be {falls * end / creep:.0f}",
        )
