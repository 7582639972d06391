"""The pulled strip in Exudyn and in fsm: the same bodies and springs, time against error of the force curve.

    python -m validation.peers.exudyn_strip [--segments 4 10 20] [--repeat 5] [--quick]

Prints a table and writes out/peers/exudyn_strip.csv and .png; exit code 2 without Exudyn.
"""

from __future__ import annotations

import argparse
import csv
import importlib.metadata
import importlib.util
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fsm.errors import FsmError
from fsm.model.compile.compile_case import compile_case
from fsm.views.plots.style import COLOURS, WIDE, figure
from validation.benchmarks.demo import machine
from validation.peers.strip import FSM_METHODS, Curve, Times, distance, fsm_curve, strip_case, timed_runs

if TYPE_CHECKING:
    from validation.peers.exudyn_model import ExudynSettings, ExudynStrip

OUT = Path(__file__).parents[2] / "out" / "peers"
STEPS = (5, 7, 10, 14, 20, 40, 80)
TOLERANCES = (1e-3, 1e-5)
TIME_STEPS = (2.0, 1.0, 0.5, 0.1, 0.02, 0.005)
CONTACT_STEPS = (40, 56, 80, 112, 160, 320)
CONTACT_TIME_STEPS = (0.5, 0.1, 0.05, 0.02)
PLAIN_STEPS = 20
PLAIN_TIME_STEPS = (0.2, 0.02, 0.005)
PLAIN_SOLVERS = ("EXUdense", "EigenSparse")
"""Exudyn's default, and what its users take for many bodies."""
FINE = 320
GOOD = 1e-3
"""Error that counts as solved, in the short table."""
CONVERGED = 1e-6
"""Errors below this are drawn there: the converged curves themselves are so far apart."""


@dataclass(frozen=True)
class Row:
    """One measurement: median and shortest time, s; error relative to the peak, compared with the curve named in
    `reference`."""

    segments: int
    contact: bool
    tool: str
    model: str
    method: str
    setting: str
    seconds: float = np.nan
    shortest: float = np.nan
    runs: int = 0
    error: float = np.nan
    reference: str = "converged"


@dataclass(frozen=True)
class Bench:
    """Data that all rows of one number of segments have in common."""

    segments: int
    repeat: int
    quick: bool


# Exudyn -----------------------------------------------------------------------------------------------------------------


def exudyn_strip(segments: int, settings: ExudynSettings, contact: bool) -> ExudynStrip:
    """Strip of fsm in Exudyn; with contact, half of the strip with the mirror plane."""
    from validation.peers.exudyn_model import Contact, ExudynStrip

    case = strip_case(segments, contact)
    scene, system = compile_case(case)
    points = None
    if contact:
        assert case.contact is not None
        line = next(body for body in scene.bodies if body.name == scene.drives[0].body)
        # two faces that approach each other by 2 d have the force K (2 d)^1.5, and the plane sees the depth d
        points = Contact(case.contact.stiffness * 2.0**1.5, line.position[0], case.contact.points_per_segment)
    return ExudynStrip(scene, system.motions[0], settings, points)


def exudyn_curve(bench: Bench, settings: ExudynSettings, contact: bool = False, repeat: int = 0) -> tuple[Times, Curve]:
    """Times of Exudyn's solver, without building the model, and the curve."""
    return timed_runs(exudyn_strip(bench.segments, settings, contact).solve, repeat or bench.repeat)


def static_settings(planar: bool) -> Iterator[tuple[str, ExudynSettings]]:
    """Load steps without contact: Newton's method whose Jacobian omits the geometric stiffness of the springs."""
    from validation.peers.exudyn_model import ExudynSettings

    for tolerance in TOLERANCES:
        for steps in STEPS:
            yield f"{steps} steps, {tolerance:g}", ExudynSettings(steps, planar=planar, relative=tolerance)


def dynamic_settings(bench: Bench, planar: bool, contact: bool = False) -> Iterator[tuple[str, ExudynSettings]]:
    """Generalised alpha at the speed of the case, with the largest numerical damping."""
    from validation.peers.exudyn_model import ExudynSettings

    end = compile_case(strip_case(bench.segments))[1].motions[0].end_time
    for step in CONTACT_TIME_STEPS if contact else TIME_STEPS[: 4 if bench.quick else None]:
        settings = ExudynSettings(round(end / step), planar=planar, dynamic=True, relative=1e-4, radius=0.0, exact=contact)
        yield f"h = {step:g} s", settings


def contact_settings(planar: bool) -> Iterator[tuple[str, ExudynSettings]]:
    """Load steps with contact: Newton's method with the complete Jacobian."""
    from validation.peers.exudyn_model import ExudynSettings

    for steps in CONTACT_STEPS:
        yield f"{steps} steps", ExudynSettings(steps, planar=planar, relative=1e-6, exact=True)


def plain_settings(planar: bool, end: float = 0.0) -> Iterator[tuple[str, ExudynSettings]]:
    """Default settings except the number of steps and the linear solver; dynamic up to `end` (s), if it is given."""
    from validation.peers.exudyn_model import ExudynSettings

    for solver in PLAIN_SOLVERS:
        if not end:
            yield f"{PLAIN_STEPS} steps, {solver}", ExudynSettings(PLAIN_STEPS, planar, solver=solver, plain=True)
        for step in PLAIN_TIME_STEPS if end else ():
            settings = ExudynSettings(round(end / step), planar, dynamic=True, solver=solver, plain=True)
            yield f"h = {step:g} s, {solver}", settings


def exudyn_converged(bench: Bench, contact: bool = False) -> Curve:
    """Curve of Exudyn with very small load steps."""
    from validation.peers.exudyn_model import ExudynSettings

    fine = ExudynSettings(FINE * (4 if contact else 1), planar=True, relative=1e-8, absolute=1e-9, exact=True)
    return exudyn_curve(bench, fine, contact, repeat=1)[1]


def exudyn_rows(bench: Bench, reference: Curve, pressed: Curve) -> Iterator[Row]:
    """All rows of Exudyn for one number of segments."""
    end = compile_case(strip_case(bench.segments))[1].motions[0].end_time
    for planar in (True, False):
        model = "plane" if planar else "space"
        kinds = (
            ("static", False, static_settings(planar)),
            ("generalised alpha", False, dynamic_settings(bench, planar)),
            ("static, half strip at a mirror", True, contact_settings(planar)),
            ("generalised alpha, half strip at a mirror", True, dynamic_settings(bench, planar, contact=True)),
            ("static, default settings", False, plain_settings(planar)),
            ("generalised alpha, half strip at a mirror, default settings", True, plain_settings(planar, end)),
        )
        for method, contact, settings in kinds:
            for name, setting in settings:
                row = Row(bench.segments, contact, "Exudyn", model, method, name)
                yield _measured(row, pressed if contact else reference, _Exudyn(bench, setting, contact))


@dataclass(frozen=True)
class _Exudyn:
    bench: Bench
    settings: ExudynSettings
    contact: bool

    def __call__(self) -> tuple[Times, Curve]:
        return exudyn_curve(self.bench, self.settings, self.contact)


# fsm --------------------------------------------------------------------------------------------------------------------


def fsm_converged(bench: Bench) -> Curve:
    """Curve of fsm at very small increments of the travel."""
    return fsm_curve(strip_case(bench.segments), "Newton at even travels", FINE)[1:]


def fsm_rows(bench: Bench, reference: Curve, pressed: Curve) -> Iterator[Row]:
    """All rows of fsm for one number of segments; with contact, the path of the whole strip is compared with the half strip
    of Exudyn."""
    for name, method in FSM_METHODS.items():
        if bench.quick and name == "Radau":
            continue
        for spatial in (False, True):
            if bench.segments > (method.most_in_space if spatial else method.most):
                continue
            for contact in (False, True):
                if contact and (not method.contact or spatial):
                    continue
                for setting in method.settings:
                    label = f"{setting:g} {method.unit}" if method.unit == "steps" else f"{method.unit} {setting:g}"
                    row = Row(bench.segments, contact, "fsm", "space" if spatial else "plane", name, label)
                    if contact:
                        row = replace(row, reference="Exudyn's half strip")
                    yield _measured(row, pressed if contact else reference, _Fsm(bench, name, setting, contact, spatial))


@dataclass(frozen=True)
class _Fsm:
    bench: Bench
    method: str
    setting: float
    contact: bool
    spatial: bool

    def __call__(self) -> tuple[Times, Curve]:
        case = strip_case(self.bench.segments, self.contact, self.spatial, FSM_METHODS[self.method].overrides)
        times, travel, force = fsm_curve(case, self.method, self.setting, self.bench.repeat)
        return times, (travel, force)


# table ------------------------------------------------------------------------------------------------------------------


def _measured(row: Row, reference: Curve, run: Callable[[], tuple[Times, Curve]]) -> Row:
    """The row with its time and error; both are empty if the solver failed."""
    try:
        times, curve = run()
    except (RuntimeError, FsmError):
        return row
    error = distance(curve, reference)
    return replace(row, seconds=times.median, shortest=times.shortest, runs=times.runs, error=error)


def table_line(row: Row) -> str:
    """A row as text."""
    numbers = f"{row.seconds:.4f} | {row.shortest:.4f} | {100 * row.error:.4f}" if row.runs else "failed | |"
    contact = "yes" if row.contact else "no"
    return f"| {row.segments} | {contact} | {row.tool} | {row.model} | {row.method} | {row.setting} | {numbers} |"


COLUMNS = ("segments", "contact", "tool", "model", "method", "setting", "time (s)", "shortest (s)", "error (% of peak)")
HEADER = "| " + " | ".join(COLUMNS) + " |\n" + "|---" * len(COLUMNS) + "|"


def fastest(rows: list[Row]) -> list[Row]:
    """For every tool, model and method: the row with the shortest run within `GOOD`, or else the most accurate row."""
    groups: dict[tuple, list[Row]] = {}
    for row in rows:
        if row.runs:
            groups.setdefault((row.segments, row.contact, row.tool, row.model, row.method), []).append(row)
    chosen = []
    for group in groups.values():
        good = [row for row in group if row.error <= GOOD]
        chosen.append(min(good, key=lambda row: row.shortest) if good else min(group, key=lambda row: row.error))
    return sorted(chosen, key=lambda row: (row.segments, row.contact, row.shortest))


def write_csv(rows: list[Row], about: dict[str, str], path: Path) -> None:
    """All rows, each with the machine of the measurement."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*about, *(field.name for field in fields(Row))])
        writer.writerows([*about.values(), *asdict(row).values()] for row in rows)


def plot(rows: list[Row], path: Path) -> None:
    """Time against error without contact, one picture a number of segments; filled in the plane, open in space."""
    drawn = [row for row in rows if row.runs and not row.contact]
    methods = list(dict.fromkeys((row.tool, row.method) for row in drawn))
    segments = sorted({row.segments for row in rows})
    with figure(path, (WIDE[0] * max(1.0, len(segments) / 3), WIDE[1])) as fig:
        axes = fig.subplots(1, len(segments), sharex=True, sharey=True, squeeze=False)[0]
        for ax, count in zip(axes, segments, strict=True):
            for (tool, method), colour in zip(methods, COLOURS, strict=False):
                for model, fill in (("plane", colour), ("space", "none")):
                    own = [r for r in drawn if (r.segments, r.tool, r.method, r.model) == (count, tool, method, model)]
                    ax.loglog(
                        [100 * max(r.error, CONVERGED) for r in own],
                        [r.shortest for r in own],
                        "o" if tool == "fsm" else "s",
                        color=colour,
                        markerfacecolor=fill,
                        markersize=4,
                        label=f"{tool}, {method}, {model}",
                    )
            ax.set_title(f"{count} segments per panel")
            ax.set_xlabel("error (% of the peak force)")
        axes[0].set_ylabel("shortest solver time (s)")
        handles, labels = axes[0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside lower center", ncols=2)


def measure(bench: Bench) -> list[Row]:
    """All rows of one number of segments, printed as they are measured."""
    reference, own = fsm_converged(bench), exudyn_converged(bench)
    pressed = exudyn_converged(bench, contact=True)
    rows = []
    for source in (exudyn_rows, fsm_rows):
        for row in source(bench, reference, pressed):
            print(table_line(row), flush=True)
            rows.append(row)
    apart = distance(own, reference)
    print(f"\nconverged curves of Exudyn and fsm are {100 * apart:.1e} % of the peak ({reference[1].max():.5f} N) apart\n")
    return rows


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--segments", type=int, nargs="+", help="segments per panel: 4 10 20, with --quick 4")
    parser.add_argument("--repeat", type=int, default=5, help="runs that a median is taken of")
    parser.add_argument("--quick", action="store_true", help="without the slow methods")
    options = parser.parse_args()
    if importlib.util.find_spec("exudyn") is None:
        print("Exudyn is not installed: pip install 'fsm[peers]'", file=sys.stderr)
        return 2
    about = machine() | {"exudyn": importlib.metadata.version("exudyn")}
    print(", ".join(f"{name} {value}" for name, value in about.items()) + f"\n\n{HEADER}")
    rows: list[Row] = []
    for segments in options.segments or ([4] if options.quick else [4, 10, 20]):
        rows += measure(Bench(segments, options.repeat, options.quick))
    print(f"fastest within {100 * GOOD:g} % of the peak, or the most accurate:\n\n{HEADER}")
    print("\n".join(table_line(row) for row in fastest(rows)))
    write_csv(rows, about, OUT / "exudyn_strip.csv")
    plot(rows, OUT / "exudyn_strip.png")
    print("\nwritten to out/peers/exudyn_strip.csv and .png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
