"""Beginnings of the stages of a pull, against shapes and energies of the saved states.

`python -m validation.quasi_static.check --parts stages`: 20 pulled strips drawn at random. First touch and energies are
computed anew, out of the shapes in result.h5 and the stiffness in the case.
"""

from __future__ import annotations

import json
import tempfile
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fsm.plots.style import WIDE
from fsm.results.solution import Floats, Solution
from fsm.results.store import read_solution
from validation.gallery.drawing import beside
from validation.gallery.record import Check, Place, below
from validation.quasi_static.drawn_strips import draw_strips, solve

__all__ = ["Begin", "begin_of", "shares", "stages"]

COUNT = 20
BENT = 2.0 / 3.0


def shares(solution: Solution, case: dict[str, Any]) -> Floats:
    """Share of the panels in the elastic energy of panels and creases at every record, out of the turns of segments.

    A joint of a panel has the stiffness EI/h, a crease its own and that of half a segment on both sides, none in a held
    panel, in series. NaN at the start, where nothing is deformed.
    """
    first, last = (solution.shape[:, :, list(ends)].mean(axis=2) for ends in ((0, 3), (1, 2)))
    along = (last - first)[..., [0, 2]]
    segment = float(np.linalg.norm(along[0], axis=1).min())
    angle = np.unwrap(np.arctan2(along[..., 1], along[..., 0]), axis=0)
    turns = np.diff(angle - angle[0], axis=1)
    panel = np.asarray(solution.layout.panel)
    inside = np.diff(panel) == 0
    strip, modulus = case["strip"], case["material"]["young"]
    bending = modulus * strip["width"] * strip["thickness"] ** 3 / 12.0
    own, held = case["crease"]["stiffness"], strip.get("held", [1, strip["panels"]])
    beside = np.column_stack([panel[:-1][~inside], panel[1:][~inside]])
    free = np.sum(~np.isin(beside, held), axis=1)
    crease = own / (1.0 + own * free * 0.5 * segment / bending)
    panels = 0.5 * bending / segment * np.sum(turns[:, inside] ** 2, axis=1)
    creases = np.sum(0.5 * crease * turns[:, ~inside] ** 2, axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(panels / (panels + creases))


@dataclass(frozen=True)
class Begin:
    """How a strip begins to bend.

    Attributes
    ----------
    travel : of the stage, over that of the drive; NaN if it never bends
    off : by how much the shapes' share of the panels is too small at the first record of the stage, or too large before it
    sag : largest deflection of a panel from its chord before the stage, over its length
    ordered : whether stages come in the order of their travels, and contact where a pair first has a force
    """

    travel: float
    off: float
    sag: float
    ordered: bool


def begin_of(folder: Path) -> Begin:
    """What a folder of results says of a strip, held against its shapes."""
    with (folder / "case.resolved.toml").open("rb") as file:
        case = tomllib.load(file)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    solution = read_solution(folder / "result.h5")
    travel, share = solution.travel[1:, 0], shares(solution, case)[1:]  # nothing is deformed at the start
    begins = {stage["name"]: stage["travel"] for stage in summary["stages"]}
    begin = begins.get("bending", np.inf)
    within, earlier = share[travel >= begin], share[travel < begin]
    sustained = np.minimum(earlier[:-1], earlier[1:])  # one record alone is no beginning
    off = max(BENT - within[0] if len(within) else 0.0, float(sustained.max(initial=0.0)) - BENT, 0.0)
    sag = _sag(solution, solution.travel[:, 0] <= begin)
    return Begin(float(begin / travel[-1]) if np.isfinite(begin) else np.nan, float(off), sag, _ordered(solution, begins))


def _ordered(solution: Solution, begins: dict[str, float]) -> bool:
    touching = solution.pair_force.max(axis=1, initial=0.0)
    touched = np.flatnonzero(touching > 1e-4 * touching.max(initial=0.0))
    places = list(begins.values())
    in_order = places == sorted(places)
    if "contact" not in begins:
        return in_order and len(touched) == 0
    spacing = float(np.diff(solution.travel[:, 0]).max())
    return in_order and len(touched) > 0 and bool(abs(solution.travel[touched[0], 0] - begins["contact"]) <= 2.0 * spacing)


def _sag(solution: Solution, records: np.ndarray) -> float:
    middle = solution.shape[records][:, :, [0, 1]].mean(axis=2)[..., [0, 2]]
    worst = 0.0
    for number in np.unique(solution.layout.panel):
        line = middle[:, solution.layout.panel == number]
        chord = line[:, -1] - line[:, 0]
        length = np.linalg.norm(chord, axis=1)
        if length.min() == 0.0:  # a crease line, which has no length
            continue
        away = line - line[:, :1]
        across = np.abs(away[..., 0] * chord[:, None, 1] - away[..., 1] * chord[:, None, 0]) / length[:, None]
        worst = max(worst, float((across / length[:, None]).max(initial=0.0)))
    return worst


def stages(place: Place) -> Iterator[Check]:
    """Stages of random strips against first touches and energies computed out of shapes."""
    strips = draw_strips(COUNT + 6, plain=True)
    with tempfile.TemporaryDirectory() as folder:
        found, lines = [], {}
        for _, out, row in solve(strips, Path(folder)):
            found.append(begin_of(out))
            begin = found[-1].travel
            if begin > 0.01 or len(lines) < 5:
                with (out / "case.resolved.toml").open("rb") as file:
                    share = shares(read_solution(out / "result.h5"), tomllib.load(file))
                name = "never bends" if np.isnan(begin) else f"bends from {100 * begin:.0f} %"
                lines[f"{row['case']} {name}"] = np.linspace(0.0, 100.0, len(share)), share
    ends = {"two thirds": ([0.0, 100.0], [BENT, BENT])}
    picture = beside(
        place.out / "stages.png", lines, ends, "travel (%)", "share of the panels in the elastic energy", size=WIDE
    )
    bending = [one for one in found if np.isfinite(one.travel)]
    later = sum(one.travel > 0.0 for one in bending)
    what = f"{len(found)} strips drawn at random, {len(bending)} bend, {later} of them not from the start"
    source = "energies of joints and creases, out of the shapes and EI/h"
    off = max(one.off for one in found)
    yield below("share of the panels at the stage, off two thirds", what, off, 0.03, source, picture)
    sag = max(one.sag for one in found)
    yield below("sag of a panel before bending, over its length", what, sag, 0.1, "panels look straight", picture)
    wrong = sum(not one.ordered for one in found)
    yield below("strips with stages out of order or touch elsewhere", what, wrong, 0, "first force of a pair", picture)
    yield below("strips too few", what, max(0, COUNT - len(found)), 0, "at least 20 are solved", picture)
