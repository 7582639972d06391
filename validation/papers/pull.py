"""The pulled strip: Li and Huang, Missiles and Space Vehicles 2025, 48(2), 22-30."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fsm.calibrate.response import force_response, peak_of
from fsm.case.loading.load_case import load_case
from fsm.case.loading.table import load_table
from fsm.run.run_case import run_case
from fsm.views.plots.style import COLOURS, WIDE, figure
from validation.gallery.record import Check, NotCompared, Place, said

__all__ = ["conditions", "factors"]

FOLDER = Path(__file__).parents[2] / "folding_cases" / "strip_pull"
PAPER = "Li and Huang 2025, "
ORDER = ("80 deg low", "80 deg high", "83 deg low", "83 deg high")


def conditions(place: Place) -> Iterator[Check | NotCompared]:
    """Four conditions of the pulled strip: stages, contacts, peaks."""
    curves: dict[str, np.ndarray] = {}
    found: dict[str, dict[str, Any]] = {}
    for case in load_table(FOLDER / "table.csv"):
        out = place.out / case.name.replace(" ", "_")
        found[case.name] = run_case(case.loaded, out, progress=False)
        curves[case.name] = np.genfromtxt(out / "force.csv", delimiter=",", skip_header=1)
    with figure(place.out / "curves.png", WIDE) as fig:
        ax = fig.subplots()
        for colour, name in zip(COLOURS, ORDER, strict=False):
            ax.plot(1e3 * curves[name][:, 0] * _scale(place, name), curves[name][:, 1], color=colour, label=name)
            for key, marker in (("contact_travel", "^"), ("bending_travel", "s"), ("peak_travel", "o")):
                at = found[name][key]
                ax.plot(
                    1e3 * at,
                    np.interp(at, curves[name][:, 0] * _scale(place, name), curves[name][:, 1]),
                    marker,
                    color=colour,
                )
        ax.set(xlabel="travel (mm)", ylabel="pull force (N)", title="triangle: contact, square: bending, circle: peak")
        ax.legend()
    picture = place.out / "curves.png"
    for name in ORDER:
        one = found[name]
        names = [stage["name"] for stage in one["stages"]]
        starts = ", ".join(f"{stage['name']} from {1e3 * stage['travel']:.2f} mm" for stage in one["stages"])
        yield said(
            f"three stages, {name}",
            "initial deformation, contact and collision, bending: in this order",
            PAPER + "section 4.2, figure 20",
            starts,
            names == ["initial deformation", "contact", "bending"],
            picture,
        )
    peaks = {name: found[name]["peak_force"] for name in ORDER}
    told = ", ".join(f"{name} {peaks[name]:.2f} N" for name in ORDER)
    yield said(
        "the force has its largest value in the bending stage",
        "the pull force rises to a largest value, for which the pull is to be sized, in the test with "
        "all three stages behind it",
        PAPER + "sections 4.2 and 5, figure 23",
        "; ".join(f"{n}: {1e3 * found[n]['peak_travel']:.1f} mm" for n in ORDER),
        all(found[n]["peak_travel"] > found[n]["bending_travel"] and peaks[n] > curves[n][-1, 1] for n in ORDER),
        picture,
    )
    touched = {row["pair"] for one in found.values() for row in one["contact"]}
    first = {one["touches"][0]["pair"] for one in found.values()}
    yield said(
        "neighbouring panels touch",
        "contact is possible between panels 1-2, 2-3, 3-4, 4-5 and 5-6, and only these are watched",
        PAPER + "section 2.3, figure 11",
        f"first {', '.join(sorted(first))}; in all {', '.join(sorted(touched))}; all pairs watched",
        touched <= {f"panel {i} - panel {i + 1}" for i in range(1, 6)},
        picture,
    )
    yield said(
        "condition with the highest peak",
        "of the four conditions the steeper and stiffer one (83 deg, high) needs the largest force",
        PAPER
        + "table 1 names the conditions; its curves are in a picture that the text at hand lacks, "
        "so this is the order of mechanics",
        told,
        max(peaks, key=lambda n: peaks[n]) == "83 deg high",
        picture,
    )
    yield said(
        "order of the conditions",
        "stiffer panels raise the peak at either angle, a steeper fold raises it at either stiffness",
        PAPER + "section 4.2: fold angle and bending stiffness are the factors",
        told,
        all(peaks[f"{a} deg high"] > peaks[f"{a} deg low"] for a in (80, 83))
        and all(peaks[f"83 deg {s}"] > peaks[f"80 deg {s}"] for s in ("low", "high")),
        picture,
    )
    yield NotCompared(
        "errors at the peak of 5.66, 1.65, 3.52 and 3.47 %",
        PAPER + "section 4.3, figure 23",
        "the measured curves, the stiffness of the paper and the contact constants are only in pictures "
        "that the text at hand lacks; no match is claimed",
    )
    yield NotCompared(
        "stiffness of a crease grows with press time; first opening softens, later ones stiffen and tend to a line",
        PAPER + "section 3.3, figure 17",
        "the curves are only in a picture; the program interpolates a measured family over press time "
        "and opening number, it does not predict one",
    )
    yield NotCompared(
        "stiffness of the crease K' = F L/Δθ, interpolated by cubic splines",
        PAPER + "eqs. 17 and 22",
        "a secant stiffness is not a tangent; here M(ψ) is the spline (docs/theory.md)",
    )
    yield NotCompared(
        "couples replaced by forces F = M x c/|c|²",
        PAPER + "eqs. 10 to 12",
        "such forces are not equivalent to a couple and break the balance of momentum; couples are "
        "applied as couples (docs/theory.md)",
    )


@cache
def _scale(place: Place, name: str) -> float:
    """Factor from the unit of the first column of force.csv to m, by its heading."""
    heading = (place.out / name.replace(" ", "_") / "force.csv").read_text(encoding="utf-8").splitlines()[0]
    return 1e-3 if "(mm)" in heading.split(",")[0] else 1.0


def factors(place: Place) -> Iterator[Check]:
    """Effects of fold angle, stiffness and thickness on the force, one at a time."""
    travel = np.linspace(0.0, 0.04, 81)

    def pulled(*changes: str) -> tuple[np.ndarray, float]:
        response = force_response(load_case(FOLDER / "case.toml", ["drive.0.travel=40 mm", *changes]).case, travel)
        return response.force, peak_of(response).force

    studies = {
        "fold angle": [(f"{a} deg", [f"strip.fold_angle={a} deg"]) for a in (76, 78, 80, 82, 84)],
        "Young's modulus": [(f"{e:g} GPa", [f"material.young={e} GPa"]) for e in (1.5, 3.0, 4.5, 6.0)],
        "thickness": [(f"{t:g} mm", [f"strip.thickness={t} mm"]) for t in (0.2, 0.25, 0.3, 0.35)],
    }
    peaks: dict[str, list[float]] = {}
    with figure(place.out / "factors.png", (9.0, 4.4)) as fig:
        for ax, (name, rows) in zip(fig.subplots(1, 3), studies.items(), strict=True):
            peaks[name] = []
            for colour, (label, changes) in zip(COLOURS, rows, strict=False):
                force, top = pulled(*changes)
                peaks[name].append(top)
                ax.plot(1e3 * travel, force, color=colour, lw=1, label=f"{label}: {top:.2f} N")
            ax.set(xlabel="travel (mm)", title=name)
            ax.legend(loc="upper left", bbox_to_anchor=(0.0, -0.2))
        fig.axes[0].set_ylabel("pull force (N)")
    picture = place.out / "factors.png"
    statements = {
        "fold angle": ("a larger fold angle needs a larger force", PAPER + "section 4.2: simulated for two fold angles"),
        "Young's modulus": (
            "panels of higher bending stiffness need a larger force",
            PAPER + "section 4.2: simulated for two stiffnesses",
        ),
        "thickness": (
            "a thicker sheet needs a larger force",
            "mechanics: bending stiffness goes as t³; " + PAPER + "stiffens its strip by tape",
        ),
    }
    for name, (statement, source) in statements.items():
        shown = ", ".join(f"{label} {top:.2f} N" for (label, _), top in zip(studies[name], peaks[name], strict=True))
        yield said(f"effect of {name}", statement, source, shown, bool(np.all(np.diff(peaks[name]) > 0.0)), picture)
