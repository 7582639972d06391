"""Tape springs: steady moments against theory, peak moment and snap beside CalculiX, convergence and energy.

python -m validation.boom.gallery [--parts steady equal release coil peak] [--out out/validation/boom] [--full]
"""

from __future__ import annotations

import csv
import math
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import fsm
from validation.boom.calculix import moments
from validation.boom.tape import RADIUS, STEEL, arm_turns, middle_line, opening, tape_spring
from validation.gallery.command import command
from validation.gallery.drawing import beside, convergence
from validation.gallery.record import Check, NotCompared, Part, Place, Reason, against, below

TITLE = "Tape springs"
THEORY = "Wuest 1954; Seffen and Pellegrino 1999, Proc. R. Soc. A 455, 1003"
TURN, FROM = 1.05, 0.6
"""Turn of the end (rad), and the turn from which the moment is steady."""
CASES = Path(__file__).parents[2] / "folding_cases" / "tape_spring"
HUB, COILING = 18e-3, (0.3, 1.9)
"""Radius of the hub in `coil.toml` (m), and the turns of its end between which the moment is averaged (rad)."""


def bent(folder: Path, data: dict[str, Any] | str) -> tuple[np.ndarray, np.ndarray, dict[str, Any], str]:
    """Turn (rad) and moment (N m) of a run of a case (tables, or text of its file), its summary, and a text on it."""
    begun = time.process_time()
    result = fsm.load(data, folder=folder).run(folder / "run", figures=False)
    turn, moment = turn_and_moment(folder, 0)
    summary = result.summary
    text = f"{summary['dof']} unknowns, {summary['steps']} steps, {time.process_time() - begun:.0f} s"
    return turn, moment, summary, text


def turn_and_moment(folder: Path, drive: int) -> tuple[np.ndarray, np.ndarray]:
    """Turn (rad) and moment (N m) of a drive (counted from 0) of the run in a folder."""
    with (folder / "run" / "force.csv").open(encoding="utf-8") as file:
        rows = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
    return rows[:, 2 * drive], rows[:, 2 * drive + 1]


def mean_moment(turn: np.ndarray, moment: np.ndarray, start: float = FROM) -> float:
    """Work over turn from `start` to the end, N m."""
    at = np.linspace(start, float(turn[-1]), 400)
    return float(np.trapezoid(np.interp(at, turn, moment), at) / (at[-1] - at[0]))


def fold_radius(folder: Path) -> float:
    """Radius of curvature of the middle line of the fold at the end of a run, m: arc over change of direction."""
    x, line = middle_line(fsm.open(folder / "run" / "result.h5").solution.shape[[0, -1]])
    along = np.diff(line, axis=0)
    angle = np.unwrap(np.arctan2(along[:, 2], along[:, 0]))
    middle = 0.5 * (x[1:] + x[:-1])
    inner = middle < 0.5 * RADIUS * TURN
    return float(1.0 / abs(np.polyfit(middle[inner], angle[inner], 1)[0]))


def steady(place: Place) -> Iterator[Check | NotCompared]:
    """Moment of a growing fold in opposite sense: work divided by turn, for turns of each end from 34 to 60 degrees."""
    folder = place.out / "opposite"
    turn, moment, summary, text = bent(folder, tape_spring(TURN, (60, 14), 1.0, 0.12))
    simple, layers = STEEL.steady(1.0), STEEL.steady(1.0) * (1.0 - STEEL.edge_layer(1.0))
    points = {"theory": ([FROM, TURN], [simple] * 2), "theory with edge layers": ([FROM, TURN], [layers] * 2)}
    after = turn > 0.2
    curves = {"growing fold": (turn[after], moment[after])}
    picture = beside(place.out / "steady.png", curves, points, "turn of the end (rad)", "moment (N m)")
    value, what = mean_moment(turn, moment), "moment of a growing fold"
    why = Reason("layers at the free edges, which the theory neglects, reduce the moment by 4.3 %", 0.04584, 0.01)
    yield against(what, "(1 + nu) D a", value, simple, THEORY, picture, rtol=0.03, unit="N m", detail=text, reason=why)
    source = "the same with layers at free edges (docs/booms.md)"
    yield against(what, "with edge layers", value, layers, source, picture, rtol=0.03, unit="N m", detail=text)
    radius, source = fold_radius(folder), "J. Appl. Mech. 87, 011009: up to 15 % above that of the section"
    yield against("radius of the fold", text, 1e3 * radius, 1e3 * RADIUS, source, picture, rtol=0.15, unit="mm")
    yield below("energy balance residual", text, summary["energy_error"], 5e-3, "zero", picture)


def equal(place: Place) -> Iterator[Check | NotCompared]:
    """Moment of a growing fold in equal sense: work over turn from 40 to 72 degrees of each end."""
    last, begun = 1.25, 0.7
    turn, moment, summary, text = bent(place.out / "equal", tape_spring(last, (36, 12), -1.0, damping=1e-2))
    simple, layers = STEEL.steady(-1.0), STEEL.steady(-1.0) * (1.0 - STEEL.edge_layer(-1.0))
    points = {"theory": ([begun, last], [simple] * 2), "theory with edge layers": ([begun, last], [layers] * 2)}
    after = turn > 0.28
    curves = {"equal sense": (turn[after], moment[after])}
    picture = beside(place.out / "equal.png", curves, points, "turn of the end (rad)", "moment (N m)")
    value, what = mean_moment(turn, moment, begun), "moment of a growing fold, equal sense"
    yield against(what, "(1 - nu) D a", value, simple, THEORY, picture, rtol=0.03, unit="N m", detail=text)
    source = "the same with layers at free edges (docs/booms.md)"
    yield against(what, "with edge layers", value, layers, source, picture, rtol=0.03, unit="N m", detail=text)
    yield below("energy balance residual, equal sense", text, summary["energy_error"], 5e-3, "zero", picture)


def release(place: Place) -> Iterator[Check | NotCompared]:
    """A folded tape spring is let go: its arm turns, and its fold becomes shorter, as the energy of the fold determines."""
    layers = STEEL.steady(1.0) * (1.0 - STEEL.edge_layer(1.0))
    source = "Seffen and Pellegrino 1999, energy of the fold, with edge layers"
    yield from _opened(place, "release", "let go", Fold(80e-3, 0.9, layers, RADIUS), 0.5, source)


def coil(place: Place) -> Iterator[Check | NotCompared]:
    """A tape spring is coiled on a hub by half a turn and let go: moment of the coil, and motion as in `release`."""
    radius = HUB + 0.5 * STEEL.thickness
    moment = radius * STEEL.coiled(radius)
    source = "energy of the coil on the hub, with edge layers"
    yield from _opened(place, "coil", "let go from the hub", Fold(100e-3, math.pi, moment, radius), 0.25, source)
    turn, measured = turn_and_moment(place.out / "coil", 1)
    within = (turn > COILING[0]) & (turn < COILING[1])
    value = float(np.trapezoid(measured[within], turn[within]) / np.ptp(turn[within]))
    points = {"theory with edge layers": (list(COILING), [moment] * 2)}
    picture = beside(place.out / "coiling.png", {"coil": (turn, measured)}, points, "turn of the end (rad)", "moment (N m)")
    yield against("moment of coiling", source, value, moment, source, picture, rtol=0.03, unit="N m")


class Fold(NamedTuple):
    """Fold of a tape that is let go: length of the tape, m; first turn, rad; moment, N m; radius, m."""

    length: float
    turn: float
    moment: float
    radius: float


def _opened(
    place: Place, name: str, what: str, fold: Fold, outer: float, source: str
) -> Iterator[Check | NotCompared]:
    """Checks of a case of `folding_cases/tape_spring` whose fourth step lets a fold go; `outer` is the straight part."""
    _, _, summary, text = bent(place.out / name, (CASES / f"{name}.toml").read_text(encoding="utf-8"))
    time_of, turn = arm_turns(place.out / name / "run" / "result.h5", 4, outer)
    fine = np.linspace(0.0, float(time_of[-1]), 2000)
    theory, rate = opening(fold.length, fold.turn, fold.moment, fine, fold.radius)
    points = {"fold of constant moment": (1e3 * fine[::100], theory[::100])}
    picture = beside(place.out / f"{name}.png", {"fsm": (1e3 * time_of, turn)}, points, "time (ms)", "turn of the arm (rad)")
    half = 0.5 * fold.turn
    found, known = np.interp(half, turn[0] - turn, time_of), float(np.interp(half, fold.turn - theory, fine))
    part = "time until half of the fold is gone"
    yield against(part, what, 1e3 * found, 1e3 * known, source, picture, rtol=0.05, unit="ms", detail=text)
    near = np.abs(time_of - found) < 1e-3
    speed = fold.radius * abs(float(np.polyfit(time_of[near], turn[near], 1)[0]))
    moving = fold.radius * abs(float(np.interp(known, fine, rate)))
    part = "speed of the edge of the fold then"
    yield against(part, what, speed, moving, source, picture, rtol=0.05, unit="m/s", detail=text)
    yield below(f"energy balance residual, {what}", text, summary["energy_error"], 5e-3, "zero", picture)


def peak(place: Place) -> Iterator[Check | NotCompared]:
    """Moment before the snap in opposite sense, its peak, and the turn at the snap, compared with S8R shells of CalculiX."""
    source = "CalculiX, S8R shells, the same run"
    if shutil.which("ccx") is None:
        yield NotCompared("peak moment and snap", source, "CalculiX (`ccx`) is not installed")
        return
    meshes = [(20, 8), (30, 12), (40, 16)]
    other = moments(place.out / "ccx", (20, 8), 0.07)
    curves, texts, tops = {}, [], []
    for mesh in meshes:
        turn, moment, summary, text = bent(place.out / f"{mesh[0]}", tape_spring(0.07, mesh))
        curves[f"{mesh[0]} x {mesh[1]}"] = turn, moment
        texts.append(text)
        tops.append((summary["peak_force"], float(turn[np.argmax(np.diff(moment) < -0.1)])))
    points = {"CalculiX": (other[:, 0], other[:, 1])}
    picture = beside(place.out / "peak.png", curves, points, "turn of the end (rad)", "moment (N m)")
    top, snap = float(other[:, 1].max()), float(other[-1, 0])
    for what, value, reference, unit, rtol in (
        ("peak moment", tops[-1][0], top, "N m", 0.02), ("turn at the snap", tops[-1][1], snap, "rad", 0.05),
    ):  # fmt: skip
        yield against(what, "40 x 16 cells", value, reference, source, picture, rtol=rtol, unit=unit, detail=texts[-1])
    off = [abs(value / top - 1.0) for value, _ in tops]
    cells = [n for n, _ in meshes]
    picture = convergence(place.out / "peak_error.png", cells, {"peak moment": off}, 2, x="cells along the tape")
    what = "error with 40 x 16 cells over that with 20 x 8 cells"
    yield below("convergence of the peak moment", what, off[-1] / off[0], 0.5, source, picture)


PARTS: dict[str, Part] = {"steady": steady, "equal": equal, "release": release, "coil": coil, "peak": peak}

if __name__ == "__main__":
    sys.exit(command(PARTS, "boom", __doc__))
