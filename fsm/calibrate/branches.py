"""Division of a table of angles and moments into tests with a loading and an unloading branch, and search for outliers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fsm.calibrate.data import MeasuredTable
from fsm.case.loading.csv_columns import first_row_faults
from fsm.errors import CaseError, Fault

FLAG_EXCLUDED = "excluded"
FLAG_USED = "used; --without-flagged excludes it"
"""Treatment of a flagged row, as the warnings name it."""
_MIN_REVERSAL = 0.05
"""Smallest decrease of the angle that counts as a reversal of the test, as a fraction of the range of angles."""
_JITTER = 0.005
"""Smallest decrease of the angle in a single row that is flagged, as a fraction of the range of angles."""
_OUTLIER = 6.0
"""Distance of an outlier from the line through its neighbours, in robust standard deviations."""
_MIN_OUTLIER = 0.01
"""Smallest distance of an outlier, as a fraction of the range of values."""
_MIN_ROWS = 8
"""Fewest rows of a branch that is searched for outliers."""
_NEAR_REVERSAL = 3
"""Largest distance, in rows, of a reversal spike from the reversal."""
_PASSES = 5
"""Passes of the search for outliers."""


@dataclass(frozen=True)
class Flag:
    """Flagged row: its index in the table, its line in the file, and the reason."""

    index: int
    row: int
    source: str
    kind: str
    text: str

    @property
    def message(self) -> str:
        """Flag as one line of text."""
        return f"{self.source}: row {self.row}: {self.kind}: {self.text}"


@dataclass(frozen=True)
class Sweep:
    """One test of a crease, with a loading branch, an unloading branch, or both.

    Attributes
    ----------
    table : Table
    press_time : s, or None if not given
    opening, repeat : numbers, or None if not given
    loading, unloading : int arrays
        Row indices of each branch in the order of measurement; empty if the branch was not measured.
    flags : flagged rows
    """

    table: MeasuredTable
    press_time: float | None
    opening: float | None
    repeat: float | None
    loading: np.ndarray
    unloading: np.ndarray
    flags: tuple[Flag, ...]


def split_sweeps(table: MeasuredTable) -> list[Sweep]:
    """Divide a table into tests.

    Parameters
    ----------
    table : Table
        Table with the columns `angle` and `moment`, and optionally `press_time`, `opening`, `repeat` and `branch`.

    Raises
    ------
    CaseError
        The angle reverses more than once within one test, and no column identifies the cycles.
    """
    sweeps: list[Sweep] = []
    faults: list[Fault] = []
    for key, rows in _groups(table):
        try:
            loading, unloading = _split_branches(table, rows)
        except CaseError as error:
            faults += error.faults
            continue
        found = [*_reversed_rows(table, loading, unloading), *_outliers(table, loading, unloading)]
        flags = {flag.index: flag for flag in reversed(found)}  # each row keeps only its first flag
        sweeps.append(Sweep(table, *key, loading, unloading, tuple(flags[index] for index in sorted(flags))))
    if faults:
        raise CaseError(first_row_faults(faults, ""), table.source)
    return sweeps


_Key = tuple[float | None, float | None, float | None]


def _groups(table: MeasuredTable) -> Iterator[tuple[_Key, np.ndarray]]:
    """Rows of each (press time, opening, repeat), in the order of measurement."""
    names = ("press_time", "opening", "repeat")
    given = [name for name in names if name in table.columns]
    if not given:
        yield (None, None, None), np.arange(len(table))
        return
    keys = np.column_stack([table.columns[name] for name in given])
    values, which = np.unique(keys, axis=0, return_inverse=True)
    for number, row in enumerate(values):
        found = dict(zip(given, row.tolist(), strict=True))
        yield (found.get("press_time"), found.get("opening"), found.get("repeat")), np.flatnonzero(which.ravel() == number)


# loading and unloading branches --------------------------------------------------------------------------------------


def _split_branches(table: MeasuredTable, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the loading and of the unloading branch, from the column `branch` or from the reversal of the angle."""
    branch = table.columns.get("branch")
    if branch is not None:
        return rows[branch[rows] > 0], rows[branch[rows] < 0]
    angle = table.columns["angle"][rows]
    reversals = _reversals(angle)
    none = rows[:0]
    if not reversals:
        return rows, none  # a single branch, which may be measured in either direction
    if len(reversals) > 1:
        where = ", ".join(str(table.rows[rows[k]]) for k in reversals[:6]) + (" ..." if len(reversals) > 6 else "")
        given = [name for name in ("opening", "repeat") if name in table.columns]
        what = (
            f"the angle reverses {len(reversals)} times (at rows {where})"
            + (f" within one {given[0]}" if given else ", and no column identifies the cycles")
            + "; number the cycles in a column `opening` (same crease opened again) or `repeat` (another crease)"
        )
        raise CaseError(table.fault(int(rows[reversals[1]]), what))
    turn = reversals[0]
    first, second = rows[: turn + 1], rows[turn:]  # the row of the reversal belongs to both branches
    return (first, second) if angle[turn] > angle[0] else (second, first)


def _reversals(angle: np.ndarray) -> list[int]:
    """Indices at which the angle reverses by more than `_MIN_REVERSAL` of its range."""
    smallest = _MIN_REVERSAL * float(np.ptp(angle)) if len(angle) else 0.0
    reversals: list[int] = []
    extreme, direction = 0, 0.0
    for index, value in enumerate(angle.tolist()):
        step = value - angle[extreme]
        if direction == 0.0:
            if abs(step) > smallest:
                direction, extreme = np.sign(step), index
        elif step * direction > 0.0:
            extreme = index
        elif abs(step) > smallest:
            reversals.append(extreme)
            direction, extreme = -direction, index
    return reversals


# flagged rows --------------------------------------------------------------------------------------------------------


def _reversed_rows(table: MeasuredTable, loading: np.ndarray, unloading: np.ndarray) -> Iterator[Flag]:
    """Flags of single rows at which the angle reverses."""
    for rows in (loading, unloading):
        angle = table.columns["angle"][rows]
        if len(angle) < _MIN_ROWS:
            continue
        direction = 1.0 if angle[-1] >= angle[0] else -1.0
        decrease = np.maximum.accumulate(direction * angle) - direction * angle
        reversed_rows = np.flatnonzero(decrease > _JITTER * np.ptp(angle))
        if len(reversed_rows) > 0.1 * len(rows):
            continue  # all angles are noisy, and the fit of the curve takes this into account
        for index in reversed_rows.tolist():
            text = f"angle returns to {table.shown('angle', int(rows[index]))}"
            yield Flag(int(rows[index]), int(table.rows[rows[index]]), table.source, "reversal", text)


def _outliers(table: MeasuredTable, loading: np.ndarray, unloading: np.ndarray) -> Iterator[Flag]:
    """Flags of outliers; near a reversal, the jerk of the drive may cause an outlier."""
    both = len(loading) > 0 and len(unloading) > 0
    for rows in (loading, unloading):
        if len(rows) < _MIN_ROWS:
            continue
        angle = table.columns["angle"][rows]
        order = np.argsort(angle, kind="stable")
        peak = int(np.argmax(angle))
        for place in find_outliers(angle[order], table.columns["moment"][rows[order]]):
            index = int(rows[order[place]])
            near = both and abs(int(order[place]) - peak) <= _NEAR_REVERSAL
            kind = "reversal spike" if near else "outlier"
            at = f"moment {table.shown('moment', index)} at {table.shown('angle', index)} is far from its neighbours"
            yield Flag(index, int(table.rows[index]), table.source, kind, at)


def find_outliers(x: np.ndarray, y: np.ndarray) -> Sequence[int]:
    """Indices whose y is far from the line through its neighbours; the largest deviations are removed first."""
    remaining = np.arange(len(x))
    outliers: list[int] = []
    smallest = _MIN_OUTLIER * float(np.ptp(y))
    for _ in range(_PASSES):
        if len(remaining) < _MIN_ROWS:
            break
        deviation = np.abs(_deviation_from_neighbours(x[remaining], y[remaining]))
        limit = max(_OUTLIER * 1.4826 * float(np.median(deviation)), smallest)
        padded = np.concatenate([[0.0], deviation, [0.0]])
        worst = (deviation > limit) & (deviation >= padded[:-2]) & (deviation >= padded[2:])
        if not worst.any():
            break
        outliers += remaining[worst].tolist()
        remaining = remaining[~worst]
    return sorted(outliers)


def _deviation_from_neighbours(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Deviation of y from the line through its two neighbours; at the ends, half the second difference of y."""
    span = x[2:] - x[:-2]
    part = np.divide(x[1:-1] - x[:-2], span, out=np.full(len(span), 0.5), where=span > 0.0)
    deviation = np.empty(len(y))
    deviation[1:-1] = y[1:-1] - (1.0 - part) * y[:-2] - part * y[2:]
    deviation[0] = 0.5 * (y[0] - 2.0 * y[1] + y[2])
    deviation[-1] = 0.5 * (y[-1] - 2.0 * y[-2] + y[-3])
    return deviation
