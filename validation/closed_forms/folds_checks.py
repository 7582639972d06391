"""Checks of folds: zig-zag, z-fold, Miura vertex, conditions under which a panel is practically rigid; laws of creases
compared with data."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fsm.calibrate.crease import calibrate_crease
from fsm.calibrate.report import Options
from fsm.case.loading.crease_family import read_family, rest_angle
from fsm.case.loading.load_case import load_case
from fsm.case.models.materials import SplineCrease
from fsm.views.plots.style import COLOURS, figure
from validation.closed_forms.folds import (
    CREASE,
    PANEL,
    THICKNESS,
    TRAVELS,
    WIDTH,
    YOUNG,
    miura,
    miura_closed,
    rigid_strip,
    static_curve,
    strip_force,
    zfold,
    zfold_closed,
    zigzag,
)
from validation.gallery.drawing import beside, convergence
from validation.gallery.record import Check, NotCompared, Place, against, below, said

__all__ = ["hinge", "miura_vertex", "relaxation", "rigid_limit", "zfolds", "zigzag_strip"]

CASES = Path(__file__).parents[2] / "folding_cases"


def zigzag_strip(place: Place) -> Iterator[Check]:
    """The pulled strip with rigid panels, against its closed form."""
    value = float(zigzag(0.06, a=0.08, D=0.02, k=(1e-3, 2e-3, 1.5e-3), phi=(-0.3, 0.2, 2.0)))
    travel = np.linspace(1e-3, 0.1, 60)
    exact = strip_force(TRAVELS)
    errors = {}
    factors = (1.0, 10.0, 100.0, 1000.0)
    for factor in factors:
        found = static_curve(rigid_strip(stiffen=factor))
        errors[factor] = float(np.abs(found - exact).max() / np.abs(exact).max())
    ours = {"fsm, rigid panels": (1e3 * travel, static_curve(rigid_strip(), travel))}
    points = {"closed form": (1e3 * TRAVELS, exact)}
    picture = beside(place.out / "zigzag.png", ours, points, "travel (mm)", "pull force (N)")
    order = convergence(
        place.out / "order.png",
        factors,
        {"largest error / peak": list(errors.values())},
        1,
        x="springs, times the strip's own",
    )
    source = "closed form of the rigid zig-zag (validation/references.md)"
    yield against(
        "check value of the closed form",
        "a = .08, D = .02, h = .06",
        value,
        0.028115041423768604,
        source,
        picture,
        rtol=1e-14,
        unit="N",
    )
    yield below(
        "force of the trial strip, 5 to 100 mm",
        "with the strip's own shear and stretch; over the peak",
        errors[1.0],
        1.2e-4,
        source,
        picture,
    )
    yield below("the same, springs 1000 times stiffer", "over the peak", errors[1000.0], 2e-7, source, order)


def zfolds(place: Place) -> Iterator[Check]:
    """A z-fold that is pulled along its line."""
    n, a, k, rest = 6, 0.08, CREASE, math.radians(10.0)
    forces = np.array([0.02, 0.05, 0.1, 0.2, 0.4])
    half = zfold(n, a, k, rest, forces)
    line = np.linspace(rest, half[-1], 50)
    curve = {"closed form": (np.degrees(line), zfold_closed(line, rest, n, a, k))}
    picture = beside(place.out / "zfold.png", curve, {"fsm": (np.degrees(half), forces)}, "half angle (deg)", "force (N)")
    for angle, force in zip(half, forces, strict=True):
        yield against(
            f"force at {math.degrees(angle):.2f} deg",
            "six rigid panels, centres on a line",
            float(force),
            float(zfold_closed(np.array(angle), rest, n, a, k)),
            "closed form F = (n-1) 2k(2θ-2θ0)/(n a cos θ)",
            picture,
            rtol=1e-5,
            unit="N",
        )


def miura_vertex(place: Place) -> Iterator[Check]:
    """One vertex of a Miura sheet: four rigid plates in a closed loop, unfolded by a couple."""
    from scipy.interpolate import CubicSpline

    a, b, gamma = 1.0, 1.2, math.radians(60.0)
    angles, sizes = miura(a, b, gamma, math.radians(50.0), -3e-3)
    order = np.argsort(angles)
    at_thirty = CubicSpline(angles[order], sizes[order])(math.radians(30.0))
    line = np.linspace(angles.min(), angles.max(), 60)
    exact = np.array([miura_closed(a, b, gamma, t) for t in line])
    few = slice(None, None, 6)
    ours = {f"{n}, closed form": (np.degrees(line), exact[:, i]) for i, n in enumerate("HSLV")}
    points = {f"{n}, fsm": (np.degrees(angles[few]), sizes[few, i]) for i, n in enumerate("HSLV")}
    picture = beside(place.out / "miura.png", ours, points, "fold angle θ (deg)", "size (m)", size=(6.0, 4.0))
    source = "Schenk and Guest 2013, PNAS 110, 3276, eqs. 1 to 4"
    for name, value, number in zip("HSLV", at_thirty, (0.433013, 0.998460, 0.901388, 0.665640), strict=True):
        yield against(
            f"{name} at θ = 30 deg",
            "a = 1, b = 1.2, γ = 60 deg; between corners of the plates",
            float(value),
            number,
            source,
            picture,
            atol=1e-5,
            unit="m",
        )
    closed = np.array([miura_closed(a, b, gamma, t) for t in angles])
    yield below(
        "H, S, L, V from 50 to 18 deg",
        "largest difference of 61 equilibria",
        float(np.abs(sizes - closed).max()),
        1e-5,
        source,
        picture,
        unit="m",
        detail="what is left is the stretch of the springs at the hinges",
    )


def rigid_limit(place: Place) -> Iterator[Check]:
    """Condition under which a panel is practically rigid: it is short compared with L* = B/kappa."""
    bending = YOUNG * WIDTH * THICKNESS**3 / 12
    ratios = np.geomspace(0.01, 2.0, 9)  # panel length over L*
    travel = np.linspace(0.0005, 0.01, 20)
    off = []
    for ratio in ratios:
        crease = float(ratio * bending / PANEL)
        force = static_curve(rigid_strip(crease=crease, segments=10), travel)
        exact = strip_force(travel, crease)
        off.append(float(np.abs(force - exact).max() / np.abs(exact).max()))
    with figure(place.out / "rigid.png") as fig:
        ax = fig.subplots()
        ax.loglog(ratios, off, "o-")
        ax.loglog(ratios, off[0] * ratios / ratios[0], "--", color="#666666", label="in proportion")
        ax.axvline(1.0, color=COLOURS[1], lw=1, label="a = L*")
        ax.set(xlabel="panel length / L*", ylabel="difference from rigid panels / peak")
        ax.legend()
    picture = place.out / "rigid.png"
    yield said(
        "a panel much shorter than L* acts rigid",
        "a panel much shorter than L* = B/κ acts as a rigid one",
        "mechanics of creased sheets (validation/references.md)",
        f"a/L* = {ratios[0]:g}: {off[0]:.1%} from rigid panels; a/L* = {ratios[-1]:g}: {off[-1]:.0%}",
        off[0] < 0.02 < 0.2 < off[-1],
        picture,
    )


def relaxation(place: Place) -> Iterator[Check | NotCompared]:
    """Creep of the rest angle of a crease: from measured angles over time to the rest angle of a case."""
    start, slope, tau = math.radians(60.0), 0.04, 5.0

    def law(time: np.ndarray) -> np.ndarray:
        return np.asarray(start + slope * np.log(1.0 + time / tau))

    data = place.out / "data"
    data.mkdir(parents=True, exist_ok=True)
    measured = np.geomspace(0.1, 1e6, 24)
    scatter = 1e-3 * np.random.default_rng(0).normal(size=len(measured))
    rows = "".join(f"{t:.10g}, {a:.10g}\n" for t, a in zip(measured, law(measured) + scatter, strict=True))
    (data / "creep.csv").write_text("time [s], angle [rad]\n" + rows, encoding="utf-8")
    pressed = "".join(f"{a}, {0.02 * a}\n" for a in np.linspace(0.0, 1.5, 16))
    (data / "moment.csv").write_text("angle [rad], moment [N m]\n" + pressed, encoding="utf-8")
    ((_, write_file),) = calibrate_crease(data, Options()).files
    write_file(place.out / "crease.h5")
    family = read_family(place.out / "crease.h5")
    asked = np.geomspace(1.0, 1e6, 40)
    found = np.array([rest_angle(family, float(time)) for time in asked])
    picture = place.out / "relaxation.png"
    with figure(picture) as fig:
        ax = fig.subplots()
        ax.semilogx(asked, np.degrees(found), label="rest angle of the case")
        ax.semilogx(measured, np.degrees(law(measured) + scatter), "o", mfc="white", mec="black", label="test")
        ax.set(xlabel="time since release (s)", ylabel="rest angle (deg)")
        ax.legend()
    yield below(
        "rest angle a time after release",
        "1 s to 1e6 s; test of 24 angles with a scatter of 1 mrad about θ0 + A ln(1 + t/τ), calibrated, read by a case",
        float(np.abs(found - law(asked)).max()),
        1e-3,
        "θ0 + A ln(1 + t/τ) that the test was drawn from; the fit is nearer than a single angle",
        picture,
        unit="rad",
    )
    late = asked > 100 * tau
    slopes = np.diff(found[late]) / np.diff(np.log(asked[late]))
    yield below(
        "a crease's angle relaxes logarithmically: slope off A",
        "relaxation of a crease angle is logarithmic in time; from 100 τ on",
        float(np.abs(slopes / slope - 1.0).max()),
        0.02,
        "Farain 2020, abstract",
        picture,
    )
    yield NotCompared(
        "slope independent of load, thickness and holding time",
        "Farain 2020, abstract",
        "the slope A is a number of the case or of a calibration; nothing in the law could make it depend on these",
    )
    yield NotCompared(
        "residual angle of Kapton creases falls with press force and time",
        "Dharmadasa 2020, abstract",
        "no open moment-angle data of Kapton or paper creases was found; a family of curves over press "
        "time is interpolated, not predicted",
    )
    yield NotCompared(
        "a crease has a finite length and differs in tension and compression",
        "Jules 2019, abstract",
        "creases are lines here; a law may differ in opening and closing as its data do",
    )


def hinge(place: Place) -> Iterator[Check]:
    """A measured origami hinge: the crease law of a case, compared with the points of the test."""
    rows = np.genfromtxt(CASES / "strip_hinge" / "hinge.csv", delimiter=",", comments="#", skip_header=4)
    crease = load_case(CASES / "strip_hinge" / "case.toml").case.crease
    assert isinstance(crease, SplineCrease)
    measured_angle, measured = rows[:, 0], rows[:, 1]
    angle, moment = np.degrees(np.array(crease.angle)), 1e3 * np.array(crease.moment)
    value = np.interp(measured_angle, angle, moment)
    picture = beside(
        place.out / "hinge.png",
        {"crease of the case": (angle, moment)},
        {"rheometer": (measured_angle, measured)},
        "angle (deg)",
        "moment (mN m)",
    )
    off = float(np.abs(value - measured).max() / np.ptp(measured))
    yield below(
        "crease law off the measured points",
        "29 points, largest difference over the range; a smoothing spline",
        off,
        0.01,
        "vishaal-krishnan/hinge_origami, data/unit075_torque.txt, Apache-2.0; unit inferred, mN m",
        picture,
    )
