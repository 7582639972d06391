"""A family of crease curves M(psi) over press time and opening number, from tests of creases.

Columns: `angle` and `moment`, or `angle`, `force` and `lever_arm` (one side clamped, the other turned by a force always
normal to it, M = F L; seed 003, section 4.1); and, as there are, `press_time`, `opening`, `repeat`, `branch`, `width`.
Angles are opening angles: how far the crease is turned from its rest angle towards flat. DATA is a CSV file, or a folder of
them; one of these may hold `angle` against `time`, which is how the rest angle relaxes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from fsm.calibrate.branches import Sweep, sweeps_of
from fsm.calibrate.crease_fit import fit_family_curve
from fsm.calibrate.crease_report import FAMILY, lines, numbers, plotted, quantities, warnings
from fsm.calibrate.data import Table, read_table
from fsm.calibrate.relaxation import calibrate_relaxation
from fsm.calibrate.report import Calibration, Options
from fsm.errors import CaseError, Fault
from fsm.plots.calibration import CurvePlot, plot_curves, plot_loops, plot_residuals
from fsm.progress import Progress
from fsm.scene.crease_family import CreaseFamily, Relaxation, write_family

__all__ = ["calibrate_crease"]

QUANTITIES = {
    "angle": "angle",
    "moment": "moment",
    "force": "force",
    "lever_arm": "length",
    "press_time": "time",
    "opening": "number",
    "repeat": "number",
    "branch": "branch",
    "width": "length",
    "time": "time",
}
_NO_MOMENT = 1e-100
"""Moments below this are none: their squares are not numbers, N m."""
_KINDS = {"smooth": "cubic", "interpolate": "cubic", "monotone": "pchip"}


def calibrate_crease(data: Path, options: Options) -> Calibration:
    """Fit a family of crease curves to a CSV file or a folder of them.

    Raises
    ------
    CaseError
        All faults of the first file that has any, with rows; or tests that make no family.
    """
    files = _files(data)
    tests, relaxed = _sorted_out([read_table(file, QUANTITIES, ["angle"]) for file in files], data)
    sweeps = [sweep for table in tests for sweep in _sweeps(table)]
    flags = [flag for sweep in sweeps for flag in sweep.flags]
    left_out = {(flag.source, flag.index) for flag in flags} if options.without_flagged else set()
    groups = _by_curve(sweeps)
    curves = []
    with Progress(options.progress, len(groups), "crease curves") as progress:
        for key in sorted(groups, key=_order):
            curves.append(fit_family_curve(*key, groups[key], left_out, options))
            progress.step(len(curves), len(curves))
    creep = None if relaxed is None else calibrate_relaxation(relaxed, options)
    law = None if creep is None else _relaxation(creep)
    family = CreaseFamily(tuple(curve.family for curve in curves), _KINDS[options.fit], _width(sweeps), law)
    found = Calibration(
        kind="crease",
        sources=tuple(files),
        quantities=[quantity for curve in curves for quantity in quantities(curve, options)],
        numbers=numbers(curves, family, flags, options),
        lines=lines(curves, flags, options),
        warnings=warnings(sweeps, curves, flags, options),
        plots=_plots([plotted(curve, options) for curve in curves]),
        files=[(FAMILY, partial(write_family, family))],
    )
    if creep is not None:
        found.quantities += creep.quantities
        found.numbers["relaxation"] = creep.numbers
        found.warnings += creep.warnings
        found.plots += creep.plots
    return found


def _plots(curves: list[CurvePlot]) -> list[tuple[str, Callable[[Path], None]]]:
    drawn: list[tuple[str, Callable[[Path], None]]] = [
        ("curves.png", partial(plot_curves, curves)),
        ("residuals.png", partial(plot_residuals, curves)),
    ]
    if any(curve.unloading is not None for curve in curves):
        drawn.append(("loops.png", partial(plot_loops, curves)))
    return drawn


def _sorted_out(tables: Sequence[Table], data: Path) -> tuple[list[Table], Path | None]:
    """Tests of moments, and the file of angles against time, if there is one."""
    tests = [table for table in tables if not _is_relaxation(table)]
    relaxed = [Path(table.source) for table in tables if _is_relaxation(table)]
    if not tests:
        what = "holds angles against time only; a family needs moments. For these alone: fsm calibrate relaxation"
        raise CaseError(Fault("", what), str(data))
    if len(relaxed) > 1:
        what = f"holds angles against time, and {relaxed[0].name} does so too; put them into one, with a column repeat"
        raise CaseError(Fault("", what), str(relaxed[1]))
    return tests, relaxed[0] if relaxed else None


def _is_relaxation(table: Table) -> bool:
    """Whether a table holds angles against time, and no moments."""
    return "time" in table.columns and not {"moment", "force"} & set(table.columns)


def _relaxation(found: Calibration) -> Relaxation:
    start, slope, log_tau = found.numbers["parameters"].values()
    return Relaxation(start, slope, math.exp(log_tau), found.numbers["longest_time_s"])


# reading -------------------------------------------------------------------------------------------------------------


def _files(data: Path) -> list[Path]:
    if not data.is_dir():
        return [data]
    files = sorted(data.glob("*.csv"))
    if not files:
        raise CaseError(Fault("", "holds no CSV file; name a file, or a folder of them"), str(data))
    return files


def _sweeps(table: Table) -> list[Sweep]:
    """The tests of one file, moments made of forces."""
    columns = dict(table.columns)
    faults = list(_range_faults(table))
    if "moment" not in columns:
        missing = [name for name in ("force", "lever_arm") if name not in columns]
        if missing:
            what = f"no column moment, and no {' and no '.join(missing)} either; give `moment [N mm]`, or `force [N]` and "
            faults.append(Fault("", what + "`lever_arm [mm]`"))
        else:
            columns["moment"] = columns["force"] * columns["lever_arm"]
    elif "force" in columns:
        faults.append(Fault("", "has both moment and force; leave one out, they may disagree"))
    if "moment" in columns and len(table) and np.max(np.abs(columns["moment"])) < _NO_MOMENT:
        faults.append(Fault("", "the moment is 0 in all rows; check the column and its unit"))
    if faults:
        raise CaseError(faults, table.source)
    units = {"moment": "N mm", **table.units}
    return sweeps_of(replace(table, columns=columns, units=units))


def _range_faults(table: Table) -> list[Fault]:
    """Values that no test can have, the first of each kind, and how many more."""
    checks = {
        "angle": (lambda a: np.abs(a) > 2 * math.pi * (1 + 1e-9), ", more than a turn; if in degrees, write angle [deg]"),
        "lever_arm": (lambda a: a <= 0.0, "; it must be greater than 0; give the sign to the force"),
        "press_time": (lambda a: a < 0.0, "; it must be at least 0"),
        "opening": (lambda a: (a < 1.0) | (a != np.round(a)), "; it must be a whole number from 1 on"),
        "width": (lambda a: a <= 0.0, "; it must be greater than 0"),
    }
    faults = []
    for name, (bad, what) in checks.items():
        if name not in table.columns:
            continue
        rows = np.flatnonzero(bad(table.columns[name]))
        if len(rows):
            more = f" (and {len(rows) - 1} more rows like this)" if len(rows) > 1 else ""
            faults.append(table.fault(int(rows[0]), f"{name} is {table.shown(name, int(rows[0]))}{what}{more}"))
    return faults


_Key = tuple[float | None, float | None]


def _by_curve(sweeps: Sequence[Sweep]) -> dict[_Key, list[Sweep]]:
    groups: dict[_Key, list[Sweep]] = {}
    for sweep in sweeps:
        groups.setdefault((sweep.press_time, sweep.opening), []).append(sweep)
    for place in range(2):
        name = ("press_time", "opening")[place]
        if len({key[place] is None for key in groups}) > 1:
            source = next(s.table.source for s in sweeps if getattr(s, name) is None)
            raise CaseError(Fault("", f"does not state `{name}`, which the other files do; add the column"), source)
    return groups


def _order(key: _Key) -> tuple[float, ...]:
    return tuple(-1.0 if value is None else value for value in key)


def _width(sweeps: Sequence[Sweep]) -> float | None:
    widths = np.concatenate([sweep.table.columns.get("width", np.zeros(0)) for sweep in sweeps])
    if not len(widths):
        return None
    if np.ptp(widths) > 1e-9:
        raise CaseError(
            Fault("", f"creases of {1e3 * widths.min():g} to {1e3 * widths.max():g} mm width make no family; one of each"),
            sweeps[0].table.source,
        )
    return float(widths[0])
