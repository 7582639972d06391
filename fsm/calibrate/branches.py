"""What a table of angles and moments is made of: curves, repeats, ways up and down, and rows that stand out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fsm.calibrate.data import Table
from fsm.errors import CaseError, Fault
from fsm.scene.csv_columns import shorten

__all__ = ["Flag", "Sweep", "standing_out", "sweeps_of"]

_TURN = 0.05
"""Part of the range of angles that the angle must go back by to have turned round; less is jitter."""
_JITTER = 0.005
"""Part of the range that single rows may go back by unnoticed."""
_OUT = 6.0
"""Distance of a row from the line through its neighbours, in robust standard deviations, from which on it stands out."""
_OUT_AT_LEAST = 0.01
"""The same in parts of the range of moments: below it nothing is flagged, however quiet the rest."""
_FEWEST = 8
"""Rows that a branch must have for one of them to stand out."""
_NEAR_TURN = 3
"""Rows from where the angle turns round within which an outlier is a reversal spike."""
_PASSES = 5


@dataclass(frozen=True)
class Flag:
    """A row that stands out: its place in the table, its line in the file, and why."""

    index: int
    row: int
    source: str
    kind: str
    text: str

    @property
    def message(self) -> str:
        """One line."""
        return f"{self.source}: row {self.row}: {self.kind}: {self.text}"


@dataclass(frozen=True)
class Sweep:
    """One test of a crease: opened, and closed again or not.

    Attributes
    ----------
    table : Table
    press_time : s, or None where the table does not state it
    opening, repeat : numbers, or None
    loading, unloading : int arrays
        Rows of the table on the way up and back, in the order they were measured; empty where there is no such way.
    flags : rows that stand out
    """

    table: Table
    press_time: float | None
    opening: float | None
    repeat: float | None
    loading: np.ndarray
    unloading: np.ndarray
    flags: tuple[Flag, ...]


def sweeps_of(table: Table, value: str = "moment") -> list[Sweep]:
    """Take a table apart into tests.

    Parameters
    ----------
    table : Table
        With `angle`, the column `value`, and, as they may be there, `press_time`, `opening`, `repeat`, `branch`.
    value : str
        The measured column, which is searched for outliers.

    Raises
    ------
    CaseError
        The angle turns round more than once and nothing says what the cycles are.
    """
    sweeps: list[Sweep] = []
    faults: list[Fault] = []
    for key, rows in _groups(table):
        try:
            loading, unloading = _ways(table, rows)
        except CaseError as error:
            faults += error.faults
            continue
        found = [*_backward(table, loading, unloading), *_outliers(table, value, loading, unloading)]
        flags = {flag.index: flag for flag in reversed(found)}  # one a row, the first that was found
        sweeps.append(Sweep(table, *key, loading, unloading, tuple(flags[index] for index in sorted(flags))))
    if faults:
        raise CaseError(shorten(faults, ""), table.source)
    return sweeps


_Key = tuple[float | None, float | None, float | None]


def _groups(table: Table) -> Iterator[tuple[_Key, np.ndarray]]:
    """Rows of each (press time, opening, repeat), in the order measured."""
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


# ways up and back ----------------------------------------------------------------------------------------------------


def _ways(table: Table, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the way up and of the way back: as the table says, or as the angle turns."""
    branch = table.columns.get("branch")
    if branch is not None:
        return rows[branch[rows] > 0], rows[branch[rows] < 0]
    angle = table.columns["angle"][rows]
    turns = _turning_points(angle)
    none = rows[:0]
    if not turns:
        return rows, none  # one curve, whichever way it was measured
    if len(turns) > 1:
        where = ", ".join(str(table.rows[rows[k]]) for k in turns[:6]) + (" ..." if len(turns) > 6 else "")
        said = [name for name in ("opening", "repeat") if name in table.columns]
        what = (
            f"the angle turns round {len(turns)} times (at rows {where})"
            + (f" within one {said[0]}" if said else ", and no column says what the cycles are")
            + "; number them in a column `opening` if one crease was opened again and again, or `repeat` if each is another"
            " crease"
        )
        raise CaseError(table.fault(int(rows[turns[1]]), what))
    turn = turns[0]
    first, second = rows[: turn + 1], rows[turn:]  # both ways meet where they turn
    return (first, second) if angle[turn] > angle[0] else (second, first)


def _turning_points(angle: np.ndarray) -> list[int]:
    """Places where the angle turns round for good: it goes back by more than a 20th of its range."""
    enough = _TURN * float(np.ptp(angle)) if len(angle) else 0.0
    turns: list[int] = []
    extreme, way = 0, 0.0
    for place, value in enumerate(angle.tolist()):
        step = value - angle[extreme]
        if way == 0.0:
            if abs(step) > enough:
                way, extreme = np.sign(step), place
        elif step * way > 0.0:
            extreme = place
        elif abs(step) > enough:
            turns.append(extreme)
            way, extreme = -way, place
    return turns


# rows that stand out -------------------------------------------------------------------------------------------------


def _backward(table: Table, loading: np.ndarray, unloading: np.ndarray) -> Iterator[Flag]:
    """Rows at which the angle goes back for a moment."""
    for rows in (loading, unloading):
        angle = table.columns["angle"][rows]
        if len(angle) < _FEWEST:
            continue
        way = 1.0 if angle[-1] >= angle[0] else -1.0
        back = np.maximum.accumulate(way * angle) - way * angle
        rows_back = np.flatnonzero(back > _JITTER * np.ptp(angle))
        if len(rows_back) > 0.1 * len(rows):
            continue  # angles are noisy all along, which their fit can bear
        for place in rows_back.tolist():
            text = f"angle goes back to {table.shown('angle', int(rows[place]))}"
            yield Flag(int(rows[place]), int(table.rows[rows[place]]), table.source, "reversal", text)


def _outliers(table: Table, value: str, loading: np.ndarray, unloading: np.ndarray) -> Iterator[Flag]:
    """Rows whose value is far from the line through its neighbours; near a turn it is the drive that kicked."""
    both = len(loading) > 0 and len(unloading) > 0
    for rows in (loading, unloading):
        if len(rows) < _FEWEST:
            continue
        angle = table.columns["angle"][rows]
        order = np.argsort(angle, kind="stable")
        peak = int(np.argmax(angle))
        for place in standing_out(angle[order], table.columns[value][rows[order]]):
            index = int(rows[order[place]])
            near = both and abs(int(order[place]) - peak) <= _NEAR_TURN
            kind = "reversal spike" if near else "outlier"
            at = f"{value} {table.shown(value, index)} at {table.shown('angle', index)} is far from its neighbours"
            yield Flag(index, int(table.rows[index]), table.source, kind, at)


def standing_out(x: np.ndarray, y: np.ndarray) -> Sequence[int]:
    """Places whose y is far from the line through its neighbours, the farthest first taken out."""
    kept = np.arange(len(x))
    out: list[int] = []
    at_least = _OUT_AT_LEAST * float(np.ptp(y))
    for _ in range(_PASSES):
        if len(kept) < _FEWEST:
            break
        off = np.abs(_off_the_line(x[kept], y[kept]))
        limit = max(_OUT * 1.4826 * float(np.median(off)), at_least)
        padded = np.concatenate([[0.0], off, [0.0]])
        worst = (off > limit) & (off >= padded[:-2]) & (off >= padded[2:])
        if not worst.any():
            break
        out += kept[worst].tolist()
        kept = kept[~worst]
    return sorted(out)


def _off_the_line(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """y less the line through its two neighbours; half of that through the two next at the ends."""
    span = x[2:] - x[:-2]
    part = np.divide(x[1:-1] - x[:-2], span, out=np.full(len(span), 0.5), where=span > 0.0)
    off = np.empty(len(y))
    off[1:-1] = y[1:-1] - (1.0 - part) * y[:-2] - part * y[2:]
    off[0] = 0.5 * (y[0] - 2.0 * y[1] + y[2])
    off[-1] = 0.5 * (y[-1] - 2.0 * y[-2] + y[-3])
    return off
