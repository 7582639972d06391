"""Beginnings of the stages of a pull, against shapes and energies of the saved states.

`python -m validation.quasi_static.check --parts stages`: 20 strips drawn at random. First touch and energies are computed
independently from the shapes in result.h5 and the stiffness in the case.
"""

from __future__ import annotations

import json
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imread

from fsm.results.film import Floats
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.views.plots.style import figure
from validation.gallery.record import Check, Place, below
from validation.quasi_static.drawn_strips import draw_geometries, solve

__all__ = ["Begin", "begin_of", "bends", "gaps", "sags", "stages"]

COUNT = 20
BENT = 0.5
"""Angle of one panel whose energy begins the stage "bending", rad (docs/theory.md)."""
LEVEL = 0.01
"""Error of the angle at the records beside the stage, over this angle."""
SAG = 0.1
"""Sag of a panel over its length that is plainly visible."""
TIP = 0.03
"""Rounded tip of a panel in contact, over its length: a face ends 1.25 % later, for other ends 2.5 %."""
SUNK = 0.002
"""Penetration of panels, over their length, that counts as a touch between records."""


def bends(solution: Solution, case: dict[str, Any]) -> Floats:
    """Angle (rad) of one panel bent to an arc with the energy of all panels, at every record, from the rotations of the
    segments.

    A joint of a panel has the stiffness EI/h. Beside a crease, the half segment of each panel is bent by the moment of the
    crease; a held panel is rigid.
    """
    line = _lines(solution)
    along = line[:, :, 1] - line[:, :, 0]
    length, panel = np.linalg.norm(along[0], axis=1), np.asarray(solution.layout.panel)
    real = length > 1e-6 * length.max()  # a crease line is a body without length
    segment = float(length[real].min())  # a held panel may be one body
    angle = np.unwrap(np.arctan2(along[:, real, 1], along[:, real, 0]), axis=0)
    turns, panel = np.diff(angle - angle[0], axis=1), panel[real]
    inside = np.diff(panel) == 0
    strip, modulus = case["strip"], case["material"]["young"]
    bending = modulus * strip["width"] * strip["thickness"] ** 3 / 12.0
    own, held = case["crease"]["stiffness"], strip.get("held", [1, strip["panels"]])
    free = np.sum(~np.isin(np.column_stack([panel[:-1][~inside], panel[1:][~inside]]), held), axis=1)
    half = 0.5 * free * segment / bending * strip.get("half_cell", True)
    moment = turns[:, ~inside] / (1.0 / own + half)
    panels = 0.5 * bending / segment * np.sum(turns[:, inside] ** 2, axis=1) + 0.5 * moment**2 @ half
    return np.asarray(np.sqrt(2.0 * panels * strip["length"] / strip["panels"] / bending))


def sags(solution: Solution) -> Floats:
    """Largest sag of a panel over its length at every record, from its chord to the middles of its segments."""
    middle, panel = _lines(solution).mean(axis=2), np.asarray(solution.layout.panel)
    found = np.zeros(len(middle))
    for number in np.unique(panel):
        line = middle[:, panel == number]
        chord, away = line[:, -1] - line[:, 0], line - line[:, :1]
        length = np.linalg.norm(chord, axis=1)
        if length.min() == 0.0:  # a crease line is a body without length
            continue
        across = np.abs(away[..., 0] * chord[:, None, 1] - away[..., 1] * chord[:, None, 0]) / length[:, None]
        found = np.maximum(found, across.max(axis=1) / length)
    return found


def gaps(solution: Solution, case: dict[str, Any]) -> Floats:
    """Smallest distance of two panels at every record, m, minus their thickness; infinite without contact.

    Panels beside a common crease touch where they have closed by half of their opening as folded, or by their thickness.
    """
    found = np.full(len(solution.time), np.inf)
    if "contact" not in case:
        return found
    line, panel = _lines(solution), np.asarray(solution.layout.panel)
    numbers = np.unique(panel)
    thickness = case["strip"]["thickness"] if case["contact"].get("thickness_in_gap", True) else 0.0
    wedge = 0.5 * np.sin(np.pi - 2.0 * case["strip"]["fold_angle"])
    for record, shape in enumerate(line):
        faces = [shape[panel == number] for number in numbers]
        for i, face in enumerate(faces):
            points = np.concatenate([face[:, 0], face.mean(axis=1), face[-1:, 1]])
            for j, other in enumerate(faces):
                if i == j:
                    continue
                away = _distances(points, other)
                clearance = np.full(len(points), thickness)
                if abs(i - j) == 1:
                    from_crease = np.linalg.norm(points - (face[-1, 1] if j > i else face[0, 0]), axis=1)
                    far = from_crease > TIP * from_crease.max()
                    away, clearance = away[far], np.minimum(thickness, wedge * from_crease[far])
                found[record] = min(found[record], float((away - clearance).min()))
    return found


def _distances(points: Floats, pieces: Floats) -> Floats:
    """Distance of every point from the nearest of the pieces (m, 2, 2)."""
    start, along = pieces[:, 0], pieces[:, 1] - pieces[:, 0]
    offset = points[:, None] - start
    square = np.maximum(np.sum(along**2, axis=1), 1e-30)
    part = np.clip(np.sum(offset * along, axis=2) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - part[..., None] * along, axis=2).min(axis=1))


def _lines(solution: Solution) -> Floats:
    """Both ends of every segment, (n, segments, 2, 2), in the plane of the strip."""
    ends = [solution.shape[:, :, list(corners)].mean(axis=2)[..., [0, 2]] for corners in ((0, 3), (1, 2))]
    return np.stack(ends, axis=2)


@dataclass(frozen=True)
class Begin:
    """Difference between the stages of a strip in the summary and those computed from its shapes.

    Attributes
    ----------
    name : name of the strip, with its stages
    bending, contact : travel at the beginning of the stage over the travel of the drive; NaN if the stage is never reached
    bend : difference of the angle from its limit: too small at the first records of bending, or too large before it, over
    the limit
    sag : largest sag of a panel before bending, over its length
    sunk : deepest penetration of panels before "contact", over the length of a panel
    apart : smallest gap when "contact" has begun, over the length of a panel
    ordered : whether stages come in the order of their travels
    """

    name: str
    bending: float
    contact: float
    bend: float
    sag: float
    sunk: float
    apart: float
    ordered: bool


def begin_of(folder: Path) -> Begin:
    """Compare the stages in a folder of results with its shapes."""
    with (folder / "case.resolved.toml").open("rb") as file:
        case = tomllib.load(file)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    solution = read_solution(folder / "result.h5")
    travel, bend, gap = solution.travel[:, 0], bends(solution, case) / BENT, gaps(solution, case)
    begins = {stage["name"]: stage["travel"] for stage in summary["stages"]}
    panel = case["strip"]["length"] / case["strip"]["panels"]
    spacing = float(np.diff(travel).max())
    bending, contact = (begins.get(name, np.nan) for name in ("bending", "contact"))
    before = gap[travel < (contact if np.isfinite(contact) else np.inf)]
    after = gap[(travel >= contact) & (travel <= contact + 2.0 * spacing)]
    named = ", ".join(f"{name} {1e3 * place:.1f} mm" for name, place in begins.items())
    return Begin(
        f"{case['strip']['panels']} panels, {named}", float(bending / travel[-1]), float(contact / travel[-1]),
        _off(travel, bend, bending, spacing), float(sags(solution)[~(travel > bending)].max()),
        max(0.0, -float(before.min(initial=0.0)) / panel),
        max(0.0, float(after.min()) / panel) if len(after) else 0.0, list(begins.values()) == sorted(begins.values()),
    )  # fmt: skip


def _off(travel: Floats, bend: Floats, begin: float, spacing: float) -> float:
    """Amount by which `bend` is below 1 within two records after the beginning, or above 1 in two records before it."""
    earlier = bend[~(travel >= begin)]
    large = float(np.minimum(earlier[:-1], earlier[1:]).max(initial=0.0)) - 1.0
    here = bend[(travel >= begin) & (travel <= begin + 2.0 * spacing)]
    return max(0.0, large, 1.0 - float(here.max()) if len(here) else 0.0)


def stages(place: Place) -> Iterator[Check]:
    """Stages of random strips against first touches and energies computed out of shapes."""
    with tempfile.TemporaryDirectory() as folder:
        solved = [(row["case"], out) for _, out, row in solve(draw_geometries(COUNT), Path(folder))]
        found = [begin_of(out) for _, out in solved]
        named = [(f"{case}: {one.name}", out) for (case, out), one in zip(solved, found, strict=True)]
        picture = _sheet(place.out / "stages.png", named)
    bending, touching = (sum(np.isfinite(getattr(one, name)) for one in found) for name in ("bending", "contact"))
    later = sum(one.bending > 0.0 for one in found)
    what = f"{len(found)} strips drawn at random, {bending} bend, {later} of them not from the start, {touching} touch"
    source = "energies of joints and creases, out of the shapes and EI/h"
    off, sag = (max(getattr(one, name) for one in found) for name in ("bend", "sag"))
    yield below("energy of the panels at bending, as an angle over 0.5 rad, off by", what, off, LEVEL, source, picture)
    yield below("sag of a panel before bending, over its length", what, sag, SAG, "panels look straight", picture)
    sunk, apart = (max(getattr(one, name) for one in found) for name in ("sunk", "apart"))
    source = "distances of the panels, out of the shapes"
    yield below("penetration before contact, over the length of a panel", what, sunk, SUNK, source, picture)
    yield below("gap at contact, over the length of a panel", what, apart, TIP, source, picture)
    wrong = sum(not one.ordered for one in found)
    yield below("strips with stages out of order", what, wrong, 0, "order of travels", picture)
    yield below("strips without an answer", what, COUNT - len(found), 0, "they are feasible", picture)


def _sheet(path: Path, folders: Sequence[tuple[str, Path]]) -> Path:
    """Force and motion of all strips, with their stages, on one sheet."""
    columns = 4
    rows = -(-len(folders) // columns)
    with figure(path, (7.0 * columns, 2.6 * rows)) as fig:
        axes = np.ravel(fig.subplots(rows, 2 * columns, squeeze=False))
        for ax in axes:
            ax.axis("off")
        for k, (name, folder) in enumerate(folders):
            for ax, picture in zip(axes[2 * k : 2 * k + 2], ("force.png", "motion.png"), strict=True):
                ax.imshow(imread(folder / picture))
            axes[2 * k].set_title(name, loc="left", fontsize=8)
    return path
