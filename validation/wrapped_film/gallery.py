"""Film on a hub: moment of the wrap, unrolling against a brake, modes under tension, and despin of a free hub.

python -m validation.wrapped_film.gallery [--parts unroll despin] [--out out/validation/wrapped_film] [--full]
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import fsm
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from validation.gallery.command import command
from validation.gallery.drawing import beside
from validation.gallery.record import Check, NotCompared, Part, Place, Reason, against, below
from validation.wrapped_film.closed_forms import Despin, Strip

TITLE = "Film on a hub"
CASES = Path(__file__).parents[2] / "folding_cases" / "wrapped_film"
THICK = Strip(0.16, 0.02, 1e-4, 3e9, 1400.0, 0.02)
TENSION, MORE, BRAKE, HUB, RATE = 0.02, 1.0, 3e-5, 2e-6, 20.0
"""Forces (N), brake (N m s/rad), inertia of the hub (kg m^2) and its rate (rad/s) in `case.toml`."""
UNTIL = 0.34
"""Time after the release until which the film is on the drum, s."""
SPUN = Despin(Strip(0.12, 0.02, 25e-6, 3e9, 1400.0, 0.02), 4.4e-6, 1e-3, 40.0)
"""Hub of `spin.toml`."""


def run(folder: Path, name: str) -> tuple[Solution, str]:
    """Result of a case, and a text on the run."""
    fsm.load(CASES / name).run(folder, figures=False)
    solution = read_solution(folder / "result.h5")
    summary = solution.summary
    return solution, f"{summary['dof']} unknowns, {summary['steps']} steps, {summary['solve_time_s']:.0f} s"


def turn_of_hub(solution: Solution) -> np.ndarray:
    """Turn of the hub about -y in all records, rad."""
    return np.unwrap(2.0 * np.arctan2(-solution.q[:, 5], solution.q[:, 3]))


def unroll(place: Place) -> Iterator[Check | NotCompared]:
    """A strip is wrapped under tension, unrolls the braked hub, and is tensioned."""
    solution, text = run(place.out / "unroll", "case.toml")
    time, turn = solution.time, turn_of_hub(solution)
    curve = np.genfromtxt(place.out / "unroll" / "dynamic_force.csv", delimiter=",", skip_header=1)
    at = (curve[:, 0] > 1.0) & (curve[:, 0] < 4.8)
    mean = np.trapezoid(curve[at, 1], curve[at, 0]) / np.ptp(curve[at, 0])
    known = THICK.moment(TENSION)
    wrapped = {"wrap": (curve[at, 0], 1e3 * curve[at, 1])}
    points = {"T R + E I/(2 R)": ([1.0, 4.8], [1e3 * known] * 2)}
    picture = beside(place.out / "moment.png", wrapped, points, "turn of the hub (rad)", "moment (mN m)")
    source = "work of the tension and bending energy of a strip on a drum"
    yield against("mean moment of the wrap", text, float(mean), known, source, picture, rtol=0.02, unit="N m")

    step = solution.summary["step"][1]
    since = time - step["start_time"]
    on = (since >= 0.0) & (since <= UNTIL)
    first = int(np.argmax(on))
    theory = turn[first] + THICK.unrolled(since[on], known, BRAKE, HUB, RATE)
    points = {"constant moment": (since[on][::6], theory[::6])}
    picture = beside(place.out / "unroll.png", {"fsm": (since[on], turn[on])}, points, "time (s)", "turn of the hub (rad)")
    off, whole = float(np.abs(turn[on] - theory).max()), float(np.ptp(theory))
    source = "J w' = -T R - E I/(2 R) - c w"
    yield below("largest error of the turn over the whole turn", text, off / whole, 0.02, source, picture)

    found = np.array(solution.summary["step"][-1]["frequencies_hz"])
    source = "string with bending stiffness, hinge and free end under a dead load"
    for number in (1, 2):
        known = THICK.frequency(TENSION + MORE, number)
        nearest = float(found[np.argmin(np.abs(found - known))])
        what = f"frequency of transverse mode {number}"
        yield against(what, text, nearest, known, source, picture, rtol=0.01, unit="Hz")


def despin(place: Place) -> Iterator[Check | NotCompared]:
    """A spinning hub is free, and the strip with a mass at its end unwinds and stops it."""
    solution, text = run(place.out / "despin", "spin.toml")
    since, turn = solution.time - solution.summary["step"][1]["start_time"], turn_of_hub(solution)
    on, strip = since >= -1e-9, SPUN.strip
    since, turn = since[on] - since[on][0], turn[on]
    start = strip.length - turn[0] * strip.radius
    tip = solution.q[on, 7:10] - solution.q[on, :3]
    length = np.sqrt(np.maximum(tip[:, 0] ** 2 + tip[:, 2] ** 2 - strip.radius**2, 0.0))
    known, theory = SPUN.lengths(since, start), SPUN.turn(since, start)
    ours = {"turn (rad)": (1e3 * since, turn - turn[0]), "unwound length (0.1 m)": (1e3 * since, 10.0 * length)}
    points = {"closed form": (1e3 * since[::5], theory[::5]), "closed form ": (1e3 * since[::5], 10.0 * known[::5])}
    picture = beside(place.out / "despin.png", ours, points, "time (ms)", "turn of the hub, unwound length")
    source = "Fedor (1961), with the mass of the film"
    top, most = float(theory.max()), float((turn - turn[0]).max())
    yield against("turn at which the hub stops", text, most, top, source, picture, rtol=0.01, unit="rad")
    off = float(np.abs(turn - turn[0] - theory).max()) / top
    cause = "contact points on flat triangles hold the film 0.09 mm off the drum, about the sag h^2/(8 R) of a cell"
    why = Reason(cause, 0.01156, 0.05)
    yield below("largest error of the turn over this turn", text, off, 0.01, source, picture, reason=why)
    late = known > 0.03
    off = float(np.abs(length - known)[late].max()) / strip.length
    yield below("largest error of the unwound length over the length", text, off, 0.01, source, picture)


PARTS: dict[str, Part] = {"unroll": unroll, "despin": despin}

if __name__ == "__main__":
    sys.exit(command(PARTS, "wrapped_film", __doc__))
