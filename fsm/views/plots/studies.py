"""Figures of studies: band of the force over the travel, tornado, Sobol indices, scatter matrix, history of a search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from fsm.views.plots.drawing import line_width, points
from fsm.views.plots.style import COLOURS, GREY, SINGLE, WIDE, figure, figure_unit, rounded, shortened

_PAIRS = 7
"""Largest number of quantities in a scatter matrix."""
_BAR = 0.36


@dataclass(frozen=True)
class Column:
    """Quantity of a study: name, SI unit, and value in every run (n,), NaN for runs that failed."""

    name: str
    unit: str
    values: np.ndarray

    def shown(self) -> tuple[np.ndarray, str]:
        """Values in the unit of figures, and label with this unit."""
        unit = figure_unit(self.unit, self.values)
        return unit.factor * self.values, f"{shortened(self.name)} ({unit.name})" if unit.name else shortened(self.name)


def plot_fan(
    path: Path, travel: np.ndarray, forces: np.ndarray, nominal: tuple[np.ndarray, np.ndarray] | None, level: float | None
) -> None:
    """Draw quantiles of the force over the travel.

    Parameters
    ----------
    path : path of the figure
    travel : (m,) array, m
    forces : (n, m) array, N
        Forces of all runs.
    nominal : travel (m) and force (N) of the nominal run, or None
    level : part of the runs in the widest band; None for a design without probabilities, whose band is the range of all runs
    """
    x, y = figure_unit("m", travel), figure_unit("N", forces)
    with figure(path, SINGLE) as fig:
        ax = fig.subplots()
        bands = (
            ((level, f"{100 * level:g} % of the runs"), (0.5, "half of the runs"))
            if level
            else ((1.0, "range of the runs"),)
        )
        for number, (part, label) in enumerate(bands):
            low, high = np.quantile(forces, [0.5 - 0.5 * part, 0.5 + 0.5 * part], axis=0)
            ax.fill_between(
                x.factor * travel,
                y.factor * low,
                y.factor * high,
                color=COLOURS[0],
                alpha=0.22 + 0.2 * number,
                linewidth=0,
                label=label,
            )
        ax.plot(x.factor * travel, y.factor * np.median(forces, axis=0), color=COLOURS[0], label="median")
        if nominal is not None:
            inside = nominal[0] <= travel[-1] * (1.0 + 1e-9)
            shown = (x.factor * nominal[0][inside], y.factor * nominal[1][inside])
            ax.plot(*shown, color=COLOURS[1], linestyle="--", label="nominal")
        ax.set_xlabel(f"travel ({x.name})")
        ax.set_ylabel(f"force ({y.name})")
        ax.margins(x=0)
        fig.legend(loc="outside upper center", ncols=2)


def plot_tornado(path: Path, names: Sequence[str], charts: Sequence[tuple[str, str, float, np.ndarray]], note: str) -> None:
    """Draw the response at the low and the high end of each parameter, the largest effect above.

    Parameters
    ----------
    path : path of the figure
    names : names of the p parameters, each with its ends
    charts : name, SI unit, middle, and ends (p, 2) of each response
    note : how the ends were found
    """
    with figure(path, (WIDE[0], len(charts) * (1.1 + 0.34 * len(names)) + 0.5)) as fig:
        axes = fig.subplots(len(charts), 1, squeeze=False)[:, 0]
        for ax, (name, si, middle, ends) in zip(axes, charts, strict=True):
            unit = figure_unit(si, np.append(ends, middle))
            order = np.argsort(np.nan_to_num(np.abs(ends[:, 1] - ends[:, 0])), kind="stable")
            for row, k in enumerate(order):
                for side, colour in ((0, COLOURS[5]), (1, COLOURS[1])):
                    width = unit.factor * (ends[k, side] - middle)
                    label = ("low end", "high end")[side] if row == 0 and ax is axes[0] else None
                    ax.barh(row, width, left=unit.factor * middle, height=0.6, color=colour, label=label)
            ax.axvline(unit.factor * middle, color=GREY, linewidth=line_width(0.8))
            ax.set_yticks(range(len(order)), [names[k] for k in order])
            ax.set_xlabel(f"{shortened(name)} ({unit.name})" if unit.name else shortened(name))
            ax.margins(x=0.08)
        axes[0].set_title(note, color=GREY)
        fig.legend(loc="outside upper right", ncols=2)


def plot_indices(
    path: Path,
    groups: Sequence[str],
    charts: Sequence[tuple[str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]],
    level: float,
) -> None:
    """Draw first and total Sobol indices with their intervals.

    Parameters
    ----------
    path : path of the figure
    groups : names of the g groups of parameters
    charts : response, first (g,), total (g,), and their intervals (g, 2) each
    level : level of the intervals
    """
    with figure(path, (WIDE[0], len(charts) * (1.0 + 0.42 * len(groups)) + 0.4)) as fig:
        axes = fig.subplots(len(charts), 1, squeeze=False, sharex=True)[:, 0]
        for ax, (name, first, total, of_first, of_total) in zip(axes, charts, strict=True):
            order = np.argsort(total, kind="stable")
            place = np.arange(len(order))
            bars = (
                (first, of_first, COLOURS[0], _BAR / 2, "first: alone"),
                (total, of_total, COLOURS[4], -_BAR / 2, "total: with interactions"),
            )
            for values, interval, colour, shift, label in bars:
                error = np.abs(interval[order].T - values[order])
                ax.barh(
                    place + shift, values[order], _BAR, color=colour, xerr=error, label=label if ax is axes[0] else None,
                    error_kw={"elinewidth": line_width(0.9), "ecolor": "black", "capsize": 2},
                )  # fmt: skip
            ax.set_yticks(place, [shortened(groups[k]) for k in order])
            ax.set_title(f"part of the variance of {shortened(name)}, with {100 * level:g} % intervals")
            ax.axvline(0.0, color=GREY, linewidth=line_width(0.6))
        fig.legend(loc="outside upper right", ncols=2)


def plot_scatter_matrix(path: Path, parameters: Sequence[Column], responses: Sequence[Column]) -> None:
    """Draw all pairs of parameters and responses, with histograms on the diagonal."""
    columns = [*parameters, *responses]
    count = len(columns)
    side = min(1.9 + 1.15 * count, 11.0)
    with figure(path, (side, side)) as fig:
        axes = fig.subplots(count, count, squeeze=False)
        for i, row in enumerate(columns):
            for j, column in enumerate(columns):
                _draw_pair(axes[i, j], row, column, i, j, i >= len(parameters))
                if i == count - 1:
                    axes[i, j].set_xlabel(_broken(column.shown()[1]))
                if j == 0:
                    axes[i, j].set_ylabel(_broken(row.shown()[1]) if i else "")
        fig.align_labels()


def chosen_pairs(
    parameters: Sequence[Column], responses: Sequence[Column], effect: np.ndarray
) -> tuple[list[Column], list[Column]]:
    """Parameters with the largest effects (p,), and responses, for a scatter matrix that can be read."""
    responses = list(responses[: max(_PAIRS - 2, 1)])
    most = max(_PAIRS - len(responses), 2)
    order = sorted(range(len(parameters)), key=lambda k: -np.nan_to_num(abs(effect[k])))[:most]
    return [parameters[k] for k in sorted(order)], responses


def _draw_pair(ax: Axes, row: Column, column: Column, i: int, j: int, of_response: bool) -> None:
    if j > i:
        ax.set_visible(False)
        return
    colour = COLOURS[1] if of_response else COLOURS[0]
    x, y = column.shown()[0], row.shown()[0]
    if i == j:
        ax.hist(x[np.isfinite(x)], bins=20, color=colour)
        ax.set_yticks([])
    else:
        ax.plot(x, y, ".", color=colour, markersize=points(2.0 if len(x) > 200 else 5.0), markeredgewidth=0, rasterized=True)
    ax.tick_params(labelsize=points(6.5))
    ax.locator_params(nbins=3)
    if j or (i == j):
        ax.set_yticklabels([])


def _broken(label: str) -> str:
    """Label in two lines: name, unit."""
    name, bracket, unit = label.partition(" (")
    return f"{name.rpartition('.')[2] if len(name) > 14 else name}{chr(10) + '(' + unit if bracket else ''}"


def plot_search(
    path: Path,
    name: str,
    unit: str,
    values: np.ndarray,
    feasible: np.ndarray,
    target: float | None,
    variables: Sequence[Column],
) -> None:
    """Draw the history of a search: the response and the varied numbers over the number of the run.

    Parameters
    ----------
    path : path of the figure
    name, unit : response and its SI unit
    values : (n,) array
        Response of every run.
    feasible : (n,) array of bool
        Whether a run keeps all constraints, or is within the tolerance of the target.
    target : value that is searched for, or None
    variables : varied numbers of all runs
    """
    with figure(path, (SINGLE[0], 1.6 + 1.3 * len(variables) + 1.2)) as fig:
        axes = fig.subplots(1 + len(variables), 1, sharex=True, height_ratios=[1.6, *[1.0] * len(variables)])
        axes = np.atleast_1d(axes)
        shown = figure_unit(unit, values)
        number = np.arange(1, len(values) + 1)
        axes[0].plot(number, shown.factor * values, color=GREY, linewidth=line_width(0.8))
        good, other = ("all bounds kept", "a bound is missed") if target is None else ("within the tolerance", "outside")
        for mask, colour, label in ((feasible, COLOURS[0], good), (~feasible, COLOURS[1], other)):
            if mask.any():
                axes[0].plot(number[mask], shown.factor * values[mask], "o", color=colour, markersize=points(4), label=label)
        if target is not None:
            axes[0].axhline(
                shown.factor * target,
                color=COLOURS[2],
                linestyle="--",
                label=f"target {rounded(shown.factor * target)} {shown.name}",
            )
        axes[0].set_ylabel(f"{shortened(name)} ({shown.name})" if shown.name else shortened(name))
        for ax, column in zip(axes[1:], variables, strict=True):
            scaled, label = column.shown()
            ax.plot(number, scaled, "o-", color=COLOURS[0], markersize=points(3), linewidth=line_width(0.8))
            ax.set_ylabel(_broken(label))
        axes[-1].set_xlabel("run")
        axes[-1].locator_params(axis="x", integer=True)
        fig.legend(loc="outside upper center", ncols=2)
