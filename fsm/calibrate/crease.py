"""Family of crease curves M(o) over press time and opening number, from tests of creases.

The data have the columns `angle` and `moment`, or `angle`, `force` and `lever_arm`. In the second case one side is clamped,
and a force normal to the other side turns it: M = F L (Li and Huang 2025).
Optional columns are `press_time`, `opening`, `repeat`, `branch` and `width`.
The angle is the opening o: the rotation of the crease from its rest angle towards flat.
The data are one CSV file or a folder of CSV files. One of the files may contain `angle` against `time`, which is the
relaxation of the rest angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from fsm.calibrate.branches import Sweep, split_sweeps
from fsm.calibrate.crease_fit import fit_family_curve
from fsm.calibrate.crease_report import FAMILY, curve_plot, lines, numbers, quantities, warnings
from fsm.calibrate.data import MeasuredTable, read_table
from fsm.calibrate.relaxation import calibrate_relaxation
from fsm.calibrate.report import Calibration, Options
from fsm.case.loading.crease_family import CreaseFamily, Relaxation, write_family
from fsm.errors import CaseError, Fault
from fsm.run.progress import Progress
from fsm.views.plots.calibration import CurvePlot, plot_curves, plot_loops, plot_residuals

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
_MIN_MOMENT = 1e-100
"""Smallest admissible largest moment, N m; squares of smaller moments underflow."""
_KINDS = {"smooth": "cubic", "interpolate": "cubic", "monotone": "pchip"}


def calibrate_crease(data: Path, options: Options) -> Calibration:
    """Fit a family of crease curves to a CSV file or a folder of CSV files.

    Raises
    ------
    CaseError
        A file has faults (all faults of the first such file are listed), or the tests do not belong to one family.
    """
    files = _files(data)
    tests, relaxation_file = _separate_relaxation([read_table(file, QUANTITIES, ["angle"]) for file in files], data)
    sweeps = [sweep for table in tests for sweep in _sweeps(table)]
    flags = [flag for sweep in sweeps for flag in sweep.flags]
    excluded = {(flag.source, flag.index) for flag in flags} if options.without_flagged else set()
    groups = _by_curve(sweeps)
    curves = []
    with Progress(options.progress, len(groups), "crease curves") as progress:
        for key in sorted(groups, key=_order):
            curves.append(fit_family_curve(*key, groups[key], excluded, options))
            progress.step(len(curves), len(curves))
    relaxation = None if relaxation_file is None else calibrate_relaxation(relaxation_file, options)
    law = None if relaxation is None else _relaxation_law(relaxation)
    family = CreaseFamily(tuple(curve.family for curve in curves), _KINDS[options.fit], _width(sweeps), law)
    found = Calibration(
        kind="crease",
        sources=tuple(files),
        quantities=[quantity for curve in curves for quantity in quantities(curve, options)],
        numbers=numbers(curves, family, flags, options),
        lines=lines(curves, flags, options),
        warnings=warnings(sweeps, curves, flags, options),
        plots=_plots([curve_plot(curve, options) for curve in curves]),
        files=[(FAMILY, partial(write_family, family))],
    )
    if relaxation is not None:
        found.quantities += relaxation.quantities
        found.numbers["relaxation"] = relaxation.numbers
        found.warnings += relaxation.warnings
        found.plots += relaxation.plots
    return found


def _plots(curves: list[CurvePlot]) -> list[tuple[str, Callable[[Path], None]]]:
    plots: list[tuple[str, Callable[[Path], None]]] = [
        ("curves.png", partial(plot_curves, curves)),
        ("residuals.png", partial(plot_residuals, curves)),
    ]
    if any(curve.unloading is not None for curve in curves):
        plots.append(("loops.png", partial(plot_loops, curves)))
    return plots


def _separate_relaxation(tables: Sequence[MeasuredTable], data: Path) -> tuple[list[MeasuredTable], Path | None]:
    """Tests of moments, and the file with angles over time, if there is one."""
    tests = [table for table in tables if not _is_relaxation(table)]
    files = [Path(table.source) for table in tables if _is_relaxation(table)]
    if not tests:
        what = "holds angles against time only; a family needs moments; for angles alone use fsm calibrate relaxation"
        raise CaseError(Fault("", what), str(data))
    if len(files) > 1:
        what = f"holds angles against time, as {files[0].name} does; put both into one file with a column `repeat`"
        raise CaseError(Fault("", what), str(files[1]))
    return tests, files[0] if files else None


def _is_relaxation(table: MeasuredTable) -> bool:
    """Whether a table contains angles over time and no moments."""
    return "time" in table.columns and not {"moment", "force"} & set(table.columns)


def _relaxation_law(found: Calibration) -> Relaxation:
    start, slope, log_tau = found.numbers["parameters"].values()
    return Relaxation(start, slope, math.exp(log_tau), found.numbers["longest_time_s"])


# reading -------------------------------------------------------------------------------------------------------------


def _files(data: Path) -> list[Path]:
    if not data.is_dir():
        return [data]
    files = sorted(data.glob("*.csv"))
    if not files:
        raise CaseError(Fault("", "holds no CSV file; give a CSV file, or a folder of CSV files"), str(data))
    return files


def _sweeps(table: MeasuredTable) -> list[Sweep]:
    """Tests of one file; moments are computed from forces if needed."""
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
        faults.append(Fault("", "has both moment and force, which may disagree; delete one of these columns"))
    if "moment" in columns and len(table) and np.max(np.abs(columns["moment"])) < _MIN_MOMENT:
        faults.append(Fault("", "the moment is 0 in all rows; check the column and its unit"))
    if faults:
        raise CaseError(faults, table.source)
    units = {"moment": "N mm", **table.units}
    return split_sweeps(replace(table, columns=columns, units=units))


def _range_faults(table: MeasuredTable) -> list[Fault]:
    """Faults of values outside their physical range: one per column, with the number of rows."""
    checks = {
        "angle": (lambda a: np.abs(a) > 2 * math.pi * (1 + 1e-9), ", more than a turn; if in degrees, write angle [deg]"),
        "lever_arm": (lambda a: a <= 0.0, "; it must be greater than 0; give the sign to the force"),
        "press_time": (lambda a: a < 0.0, "; it must be at least 0"),
        "opening": (lambda a: (a < 1.0) | (a != np.round(a)), "; it must be a whole number of at least 1"),
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
            raise CaseError(Fault("", f"has no column `{name}`, but other files have it; add the column"), source)
    return groups


def _order(key: _Key) -> tuple[float, ...]:
    return tuple(-1.0 if value is None else value for value in key)


def _width(sweeps: Sequence[Sweep]) -> float | None:
    widths = np.concatenate([sweep.table.columns.get("width", np.zeros(0)) for sweep in sweeps])
    if not len(widths):
        return None
    if np.ptp(widths) > 1e-9:
        raise CaseError(
            Fault("", f"the widths of the creases differ ({1e3 * widths.min():g} to {1e3 * widths.max():g} mm); "
                  "calibrate each width separately"),
            sweeps[0].table.source,
        )
    return float(widths[0])
