"""Figure of a film study: frequency and amplitudes over the varied quantity of a table, with reference values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fsm.text.shown_units import shown_unit
from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.style import COLOURS, GREY, WIDE, figure

STUDY_RESULTS: dict[str, tuple[float, str]] = {
    "frequency_hz": (1.0, "frequency (Hz)"),
    "amplitude_center": (1e3, "largest amplitude, center (mm)"),
    "amplitude_patch": (1e3, "largest amplitude, patch (mm)"),
}
"""Quantities of a summary that a study shows, with factor and label."""


def varied_column(rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> tuple[str, list[float | None]]:
    """Label and numbers of the first input with different numbers; None in rows without a number.

    If there is no such input, the label is empty and the numbers are the row numbers.
    """
    return (varied_inputs(rows, units) or [("", [float(k) for k in range(len(rows))])])[0]


def varied_inputs(rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> list[tuple[str, list[float | None]]]:
    """Label with unit, and numbers, of all inputs with different numbers.

    Parameters
    ----------
    rows : rows of a table
    units : SI units of the inputs by their paths
    """
    found = []
    for path, unit in units.items():
        cells = [row.get(path) for row in rows]
        numbers = [float(cell) if isinstance(cell, int | float) else None for cell in cells]
        known = [number for number in numbers if number is not None]
        if len(set(known)) > 1:
            shown = shown_unit(unit, max(map(abs, known)))
            label = f"{path} ({shown.name})" if shown.name else path
            found.append((label, [None if number is None else shown.factor * number for number in numbers]))
    return found


def relative_changes(
    rows: Sequence[Mapping[str, Any]], reference: Mapping[str, Mapping[str, float]], name: str
) -> list[tuple[float, float, float] | None]:
    """For each row, in %: change of the computed quantity, change of the reference value, and uncertainty of the reference.

    Changes are relative to the first row with a reference. Rows without result or reference have None.
    """
    known = [k for k, row in enumerate(rows) if name in reference.get(row["case"], {}) and row.get(name) is not None]
    found: list[tuple[float, float, float] | None] = [None] * len(rows)
    if not known:
        return found
    first = rows[known[0]][name]
    origin = 1.0 + 0.01 * reference[rows[known[0]]["case"]][name]
    for k in known:
        values = reference[rows[k]["case"]]
        reference_change = 100.0 * ((1.0 + 0.01 * values[name]) / origin - 1.0)
        found[k] = (100.0 * (rows[k][name] / first - 1.0), reference_change, values.get(f"{name} band", 0.0))
    return found


def plot_study(
    rows: Sequence[Mapping[str, Any]],
    units: Mapping[str, str],
    reference: Mapping[str, Mapping[str, float]],
    path: str | Path,
) -> None:
    """Draw frequency and amplitudes over the varied quantity; below, draw their changes and the reference changes in %.

    Parameters
    ----------
    rows : rows of a table that have results
    units : SI units of the inputs of the table by their paths
    reference : see `fsm.case.loading.table.load_reference`
    path : path of the figure
    """
    names = [name for name in STUDY_RESULTS if any(row.get(name) is not None for row in rows)]
    label, x = varied_column(rows, units)
    compared = any(any(relative_changes(rows, reference, name)) for name in names)
    with figure(path, (WIDE[0], 4.8 if compared else 2.8)) as fig:
        axes = fig.subplots(2 if compared else 1, len(names), squeeze=False, sharex=True)
        for column, name in enumerate(names):
            factor, text = STUDY_RESULTS[name]
            values = [row[name] * factor if row.get(name) is not None else np.nan for row in rows]
            _draw_values(axes[0, column], rows, x, values)
            axes[0, column].set_title(text)
            if compared:
                _draw_changes(axes[1, column], rows, x, relative_changes(rows, reference, name))
        for ax in axes[-1]:
            ax.set_xlabel(label or "row")
        if compared:
            axes[1, 0].set_ylabel("change (%)")
            handles, labels = axes[1, 0].get_legend_handles_labels()
            fig.legend(handles, labels, loc="outside upper center", ncols=2)


def _draw_values(ax: Axes, rows: Sequence[Mapping[str, Any]], x: Sequence[float | None], values: Sequence[float]) -> None:
    """Draw the rows with a value of the varied quantity as a curve, and the others as horizontal lines."""
    placed = [(a, b) for a, b in zip(x, values, strict=True) if a is not None]
    if placed:
        ax.plot(*zip(*sorted(placed), strict=True), "o-", color=COLOURS[0], markersize=points(4))
    for row, a, b in zip(rows, x, values, strict=True):
        if a is None:
            ax.axhline(b, color=GREY, linestyle="--", linewidth=line_width(0.9))
            ax.annotate(row["case"], (1.0, b), xycoords=("axes fraction", "data"), ha="right", va="bottom", color=GREY)
    ax.margins(y=0.12)


def _draw_changes(
    ax: Axes,
    rows: Sequence[Mapping[str, Any]],
    x: Sequence[float | None],
    found: Sequence[tuple[float, float, float] | None],
) -> None:
    """Draw the computed changes, and the reference changes with their band."""
    places = [a for a in x if a is not None]
    right = max(places, default=1.0) + 0.15 * (float(np.ptp(places)) if places else 1.0)
    placed = [(right if a is None else a, *one) for a, one in zip(x, found, strict=True) if one is not None]
    ax.axhline(0, color=GREY, linewidth=line_width(0.6))
    if not placed:
        ax.text(0.5, 0.5, "no reference", transform=ax.transAxes, ha="center", va="center", color=GREY)
        return
    at, computed, expected, band = (np.array(part) for part in zip(*placed, strict=True))
    half_width = band * (1.0 + 0.01 * expected)
    style = {"fmt": "s", "color": COLOURS[1], "markersize": points(4), "capsize": 3}
    ax.errorbar(at, expected, yerr=half_width, **style, label="reference, with its band")
    ax.plot(at, computed, "o", color=COLOURS[0], markersize=points(4), label="this run")
    for a, one, row in zip(x, found, rows, strict=True):
        if a is None and one is not None:
            offset = {"xytext": (0, -9), "textcoords": "offset points"}
            ax.annotate(row["case"], (right, min(one[:2])), **offset, ha="center", va="top", color=GREY, fontsize=points(7))
    ax.margins(x=0.12, y=0.2)
