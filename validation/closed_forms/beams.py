"""Checks of chains of rigid segments against beams: elastica, circle, columns past buckling, beams bent in space."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from fsm.views.plots.style import COLOURS, WIDE, figure
from validation.closed_forms.chains import Section, buckled, cantilever, column, lateral_buckling, space_tip, tip
from validation.gallery.drawing import beside, convergence
from validation.gallery.record import Check, Place, against, below

__all__ = ["ELASTICA", "LATERAL", "POST_BUCKLING", "arc", "buckling", "elastica", "lateral", "princeton", "rolled"]

ELASTICA = {
    1.0: (0.3017207738, 0.0564332363, 0.4613519497),
    2.0: (0.4934574804, 0.1606417208, 0.7817498316),
    5.0: (0.7137915236, 0.3876283607, 1.2153681176),
    10.0: (0.8106090249, 0.5549955978, 1.4302855388),
}
"""a = P L^2/EI: (w/L, u/L, tip angle), by elliptic functions; agrees with Mattiasson 1981."""
MATTIASSON = "elliptic functions; agrees with Mattiasson 1981, Int. J. Numer. Meth. Eng. 17, 145, table 1"

POST_BUCKLING = {
    20: (1.015396866, 0.030269093, 0.109706521),
    60: (1.151719620, 0.258980394, 0.296603823),
    90: (1.393203930, 0.543053419, 0.381379882),
}
"""Pinned column, inextensible: largest slope (deg): P/Pcr, shortening/L, deflection of the middle/L; elliptic functions."""

LATERAL = 4.012599
"""Load P L^2/sqrt(EI GJ) at the tip of a straight strip, along its width, at which it gives way sideways."""

ARC = {300.0: (58.778897, 22.244679, 40.192392), 600.0: (47.150096, 15.684689, 53.475478)}
"""Tip of the 45 degree bend, R = 100, 1 x 1, E = 1e7, nu = 0, J = 1/6, shear 5/6, on a true arc."""

PRINCETON = {
    (4.448, 30): (-0.0019168, -0.0047511, 0.0399494, 0.0066712),
    (4.448, 60): (-0.0055271, -0.0028622, 0.0681291, 0.0065107),
    (4.448, 90): (-0.0072599, 0.0, 0.0780819, 0.0),
    (13.345, 30): (-0.0171634, -0.0167780, 0.1179023, 0.0581054),
    (13.345, 60): (-0.0412064, -0.0117164, 0.1819212, 0.0484608),
    (13.345, 90): (-0.0504057, 0.0, 0.2006929, 0.0),
}
"""Load (N) and its angle from edgewise (deg): tip along, edgewise, flapwise (m), twist (rad)."""
BVP = "geometrically exact beam, boundary value problem, computed independently (validation/references.md)"


def elastica(place: Place) -> Iterator[Check]:
    """Cantilever of finite segments under a tip force, against the elastica."""
    counts = (10, 20, 40, 80)
    found = {}
    for load in ELASTICA:
        rows = []
        for count in counts:
            x, z, angle = tip(cantilever(count, force=load), False)
            rows.append((z, 1.0 - x, angle))
        found[load] = np.array(rows)
    errors = {f"PL²/EI = {load:g}": np.abs(rows[:, 0] / ELASTICA[load][0] - 1) for load, rows in found.items()}
    slopes = convergence(place.out / "order.png", counts, errors, 2, y="relative error of w")
    curve = np.linspace(0.0, 12.0, 25)
    swept = [tip(cantilever(40, force=a), False) for a in curve]
    ours = {"w/L": (curve, [s[1] for s in swept]), "u/L": (curve, [1 - s[0] for s in swept])}
    known = {f"{n} elastica": (list(ELASTICA), [r[i] for r in ELASTICA.values()]) for i, n in enumerate(("w/L", "u/L"))}
    picture = beside(place.out / "tip.png", ours, known, "PL²/EI", "displacement of the tip / L", title="40 segments")
    for load, exact in ELASTICA.items():
        for i, name in enumerate(("w/L", "u/L", "tip angle")):
            coarse, fine = found[load][-2:, i]
            yield against(
                f"{name} at PL²/EI = {load:g}",
                "extrapolated from 40 and 80 segments",
                fine + (fine - coarse) / 3,
                exact[i],
                MATTIASSON,
                picture,
                atol=3e-7,
                detail=f"80 segments: {fine / exact[i] - 1:+.1e}",
            )
    orders = np.log2(
        [
            abs(r[-2, i] - e[i]) / abs(r[-1, i] - e[i])
            for r, e in zip(found.values(), ELASTICA.values(), strict=True)
            for i in range(3)
        ]
    )
    yield below(
        "order of convergence, off 2 by",
        "10 to 80 segments, with half a cell at the clamp",
        float(np.abs(orders - 2).max()),
        0.1,
        "second order by construction (docs/theory.md)",
        slopes,
    )
    space = max(
        float(np.abs(tip(cantilever(20, force=a), True) - tip(cantilever(20, force=a), False)).max()) for a in ELASTICA
    )
    yield below(
        "plane against space",
        "20 segments, all loads, largest difference of the tip / L",
        space,
        1e-8,
        "same equations",
        picture,
    )


def rolled(place: Place) -> Iterator[Check]:
    """An end moment of 2 pi EI/L rolls a cantilever up into a circle."""
    count = 20
    moments = np.linspace(0.0, 1.0, 5)
    with figure(place.out / "circle.png") as fig:
        ax = fig.subplots()
        for part, colour in zip(moments, COLOURS, strict=False):
            angle = 2 * math.pi * part / count
            turned = angle * (np.arange(count) + 0.5)
            x, z = (np.concatenate([[0.0], np.cumsum(f(turned) / count)]) for f in (np.cos, np.sin))
            ends = tip(cantilever(count, moment=2 * math.pi * part), False, steps=40)
            ax.plot(x, z, "-", color=colour, lw=1, label=f"{part:g} x 2πEI/L")
            ax.plot(ends[0], ends[1], "o", color=colour, mfc="white")
        ax.set(xlabel="x/L", ylabel="z/L", aspect="equal", title="lines: exact polygons; circles: computed tip")
        ax.legend(loc="upper right")
    picture = place.out / "circle.png"
    for spatial in (False, True):
        for n in (5, 20):
            x, z, angle = tip(cantilever(n, moment=2 * math.pi), spatial, steps=40)
            where = "space" if spatial else "plane"
            yield below(
                f"tip off the root, {n} segments, {where}",
                "in lengths of the beam",
                math.hypot(x, z),
                1e-9,
                "closed form: a closed polygon for any number of segments",
                picture,
            )
            turn = math.remainder(angle - 2 * math.pi + math.pi / n, 2 * math.pi)
            yield below(
                f"angle of the last segment, {n} segments, {where}",
                "off 2π (1 - 1/2N), rad",
                abs(turn),
                1e-9,
                "closed form",
                picture,
            )


def buckling(place: Place) -> Iterator[Check]:
    """Columns past buckling, pinned and clamped: load and deflection at given shortening."""
    shortenings = tuple(row[1] for row in POST_BUCKLING.values())
    many = tuple(np.linspace(0.01, 0.545, 40))
    ours, rows = {}, []
    for clamped, critical in ((False, math.pi**2), (True, 4 * math.pi**2)):
        name = "clamped" if clamped else "pinned"
        for count in (100, 200):
            system = column(count, clamped=clamped)
            states, statistics = buckled(system, shortenings)
            rows.append(
                [
                    (
                        s.observation.drive.force[0] / critical,
                        abs(float(s.q.reshape(system.n_free, -1)[system.n_free // 2, 1])),
                    )
                    for s in states
                ]
            )
            kinds = [event.kind for event in statistics.events]
        system = column(40, clamped=clamped)
        states, _ = buckled(system, many)
        ours[name] = (many, [s.observation.drive.force[0] / critical for s in states])
        picture = place.out / "column.png"
        fine, coarse = np.array(rows[-1]), np.array(rows[-2])
        for (slope, (load, shortening, sideways)), row, less in zip(POST_BUCKLING.items(), fine, coarse, strict=True):
            detail = f"100 segments: {less[0] / load - 1:+.1e}; events: {', '.join(kinds)}"
            yield against(
                f"{name}: P/Pcr at {shortening:.4f} L of shortening",
                f"200 segments, largest slope {slope} deg",
                row[0],
                load,
                "elliptic functions (validation/references.md)",
                picture,
                rtol=1.5e-4 if not clamped else 6e-4,
                detail=detail,
            )
            yield against(
                f"{name}: deflection of the middle / L there",
                "200 segments",
                row[1],
                sideways,
                "elliptic functions (validation/references.md)",
                picture,
                rtol=1.5e-4 if not clamped else 6e-4,
            )
    known = {"elastica": (shortenings, [r[0] for r in POST_BUCKLING.values()])}
    beside(place.out / "column.png", ours, known, "shortening / L", "P/Pcr", title="40 segments")


def lateral(place: Place) -> Iterator[Check]:
    """Lateral buckling of a straight strip that is loaded at its tip along its width; bending and torsion are coupled."""
    counts = (10, 20, 40, 80)
    errors = np.array([lateral_buckling(n) for n in counts]) / LATERAL - 1
    picture = convergence(place.out / "order.png", counts, {"critical load": errors}, 2)
    source = "Prandtl 1899, Michell 1899: first root of a Bessel function"
    for count, error in zip(counts, errors, strict=True):
        yield against(
            f"critical load with {count} segments",
            "over sqrt(EI GJ)/L^2",
            LATERAL * (1 + error),
            LATERAL,
            source,
            picture,
            rtol=0.5 / count**2,
        )
    yield below(
        "order of convergence, off 2 by",
        "40 to 80 segments",
        abs(float(np.log2(errors[-2] / errors[-1])) - 2),
        0.1,
        source,
        picture,
    )


def arc(place: Place) -> Iterator[Check]:
    """The 45 degree bend in space: a circular arc with bending about two axes and torsion."""
    section = Section.rectangle(1.0, 1.0, 1e7, 5e6, 1.0 / 6.0)
    length, turn = 100.0 * math.pi / 4, math.pi / 4
    counts = (10, 20, 40, 80)
    found = {p: np.array([space_tip(n, length, turn, section, (0.0, 0.0, p))[0] for n in counts]) for p in ARC}
    errors = {f"P = {p:g}": np.linalg.norm(found[p] - ARC[p], axis=1) / length for p in ARC}
    slopes = convergence(place.out / "order.png", counts, errors, 2, y="error of the tip / length")
    for load, exact in ARC.items():
        ends = found[load][-1] + (found[load][-1] - found[load][-2]) / 3
        for axis, value, wanted in zip("xyz", ends, exact, strict=True):
            yield against(
                f"tip {axis} at P = {load:g}",
                "extrapolated from 40 and 80 segments",
                float(value),
                wanted,
                BVP,
                slopes,
                atol=1e-3,
                detail=f"80 segments: {found[load][-1]['xyz'.index(axis)] - wanted:+.1e}",
            )
    for ratio in (0.5, 2.0):
        other = replace(section, torsion=section.torsion * ratio, about_z=section.about_z / ratio)
        ends = np.array([space_tip(n, length, turn, other, (0.0, 0.0, 600.0), 20)[0] for n in counts])
        apart = np.linalg.norm(np.diff(ends, axis=0), axis=1)
        yield below(
            f"order of convergence, torsion times {ratio:g}, bending about z over {ratio:g}: off 2 by",
            "20 to 80 segments, P = 600",
            abs(float(np.log2(apart[-2] / apart[-1])) - 2),
            0.1,
            "second order, against its own limit",
            slopes,
        )


def princeton(place: Place) -> Iterator[Check]:
    """The Princeton beam: a thin blade under a tip load between the edgewise and the flapwise direction, which twists it."""
    thick, high, length, young = 3.2024e-3, 12.377e-3, 0.508, 71.7e9
    section = Section.rectangle(high, thick, young, young / 2.62, 1.13399530e-10)
    counts = (10, 20, 40, 80)

    def ends(load: float, angle: float, n: int, alternate: bool) -> np.ndarray:
        turned = math.radians(angle)
        at, p = space_tip(
            n, length, 0.0, section, (0.0, -load * math.cos(turned), load * math.sin(turned)), alternate=alternate
        )
        w, a, b, c = p
        edge_y, edge_z = 1 - 2 * (a * a + c * c), 2 * (b * c + w * a)
        return np.array([at[0] - length, at[1], at[2], math.atan2(edge_z, edge_y)])

    found = {case: np.array([ends(*case, n, True) for n in counts]) for case in PRINCETON}
    one_way = np.array([ends(13.345, 30, n, False) for n in counts])
    exact = np.array(PRINCETON[13.345, 30])
    off = {"joints alternate": found[13.345, 30], "joints all one way": one_way}
    errors = {name: np.linalg.norm((rows - exact)[:, :3], axis=1) / length for name, rows in off.items()}
    slopes = convergence(
        place.out / "order.png", counts, errors, 2, y="error of the tip / length", title="13.345 N at 30 deg"
    )
    picture = _draw_princeton(place.out / "tip.png", ends)
    for (load, angle), wanted in PRINCETON.items():
        rows = found[load, angle]
        values = rows[-1] + (rows[-1] - rows[-2]) / 3
        for name, value, number in zip(("along", "edgewise", "flapwise", "twist"), values, wanted, strict=True):
            atol, unit = (1e-5, "m") if name != "twist" else (1e-5, "rad")
            yield against(
                f"{name}, {load:g} N at {angle} deg",
                "extrapolated from 40 and 80 segments",
                float(value),
                number,
                BVP,
                picture,
                atol=atol,
                unit=unit,
            )
    for name, what in (
        ("joints alternate", "inner and outer body of every other joint swapped"),
        ("joints all one way", "outer body always the later one, as strips are built"),
    ):
        row = errors[name]
        yield below(
            f"order of convergence, {name}: off 2 by",
            what,
            abs(float(np.log2(row[-2] / row[-1])) - 2),
            0.15,
            "second order, as in the plane",
            slopes,
        )


def _draw_princeton(path: Path, ends: object) -> Path:
    with figure(path, WIDE) as fig:
        left, right = fig.subplots(1, 2)
        angles = np.linspace(0.0, 90.0, 10)
        for load, colour in ((4.448, COLOURS[0]), (13.345, COLOURS[1])):
            rows = np.array([ends(load, a, 20, True) for a in angles])  # type: ignore[operator]
            for ax, column_, sign in ((left, 2, 1.0), (right, 3, 1.0)):
                ax.plot(angles, sign * rows[:, column_], color=colour, label=f"{load:g} N, 20 segments")
                known = [(a, r[column_]) for (p, a), r in PRINCETON.items() if p == load]
                ax.plot(*zip(*known, strict=True), "o", mfc="white", mec=colour, label="reference")
        left.set(xlabel="load angle from edgewise (deg)", ylabel="flapwise displacement (m)")
        right.set(xlabel="load angle from edgewise (deg)", ylabel="twist (rad)")
        left.legend()
    return path
