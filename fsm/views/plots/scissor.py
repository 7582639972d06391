"""Figures of a scissor array: motion of its points, comparison with rigid bars, synchronism, stresses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from fsm.results.array import ArrayMotion, Floats, asynchronism
from fsm.results.solution import Solution
from fsm.views.plots.drawing import line_width
from fsm.views.plots.style import COLOURS, DASHES, GREY, WIDE, add_legend, figure, figure_unit

_CUT = 8.0
"""Range of a flexible curve, relative to the range of the rigid curve, above which the flexible curve is cut off."""
_MOTIONS = (("displacement", ""), ("velocity", "/s"), ("acceleration", "/s²"))
"""Quantity, and its unit behind that of a length."""


def plot_points(solution: Solution, path: str | Path) -> None:
    """Draw displacement, velocity and acceleration along y of the upper points over time."""
    motion = _motion(solution)
    with figure(path, (WIDE[0], 6.4)) as fig:
        axes = fig.subplots(3, 1, sharex=True)
        for ax, (name, rate) in zip(axes, _MOTIONS, strict=True):
            values = getattr(motion.points, name)[..., 1]
            unit = figure_unit("m", values)
            for k, point in enumerate(motion.upper):
                history, colour = values[:, motion.point_index(point)], COLOURS[k % len(COLOURS)]
                ax.plot(solution.time, unit.factor * history, color=colour, label=point, lw=line_width(1.0))
            ax.set_ylabel(f"{name} along y ({unit.name}{rate})")
            ax.margins(x=0)
        fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=min(len(motion.upper), 8))
        axes[-1].set_xlabel("time (s)")


def plot_rigid(solution: Solution, path: str | Path) -> None:
    """Draw the motion of the first and the last upper point with flexible and with rigid bars."""
    motion = _motion(solution)
    first, last = motion.upper[0], motion.upper[-1]
    shown = ((first, 1, "y"), (last, 0, "x"))
    cut = False
    with figure(path, (WIDE[0], 6.4)) as fig:
        axes = fig.subplots(3, 2, sharex=True)
        for row, (name, rate) in zip(axes, _MOTIONS, strict=True):
            unit = figure_unit("m", [getattr(motion.points, name)[:, motion.point_index(p), i] for p, i, _ in shown])
            for ax, (point, axis, _) in zip(row, shown, strict=True):
                k = motion.point_index(point)
                flexible = unit.factor * getattr(motion.points, name)[:, k, axis]
                ax.plot(solution.time, flexible, label="flexible bars", lw=line_width(1.0))
                if motion.rigid is not None:
                    rigid = unit.factor * getattr(motion.rigid, name)[:, k, axis]
                    ax.plot(solution.time, rigid, "--", color=COLOURS[1], label="rigid bars", lw=line_width(1.2))
                    cut |= _set_limits(ax, rigid, flexible)
                ax.margins(x=0)
            row[0].set_ylabel(f"{name} ({unit.name}{rate})")
        for ax, (point, _, along) in zip(axes[0], shown, strict=True):
            ax.set_title(f"point {point}, along {along}")
        for ax in axes[-1]:
            ax.set_xlabel("time (s)")
        handles = axes[0, 0].get_legend_handles_labels()[0]
        handles += [Line2D([], [], linestyle="none", label="vibration beyond the axes is cut off")] if cut else []
        fig.legend(handles=handles, loc="outside upper center", ncols=3)


def plot_synchronism(solution: Solution, path: str | Path) -> None:
    """Draw the difference in deployment of neighbouring units over time; the difference is zero with rigid bars."""
    motion = _motion(solution)
    with figure(path) as fig:
        ax = fig.subplots()
        apart = asynchronism(motion)
        unit = figure_unit("m", [*apart.values()])
        for name, difference in apart.items():
            ax.plot(solution.time, unit.factor * difference, label=name.replace("-", " \N{MINUS SIGN} "), lw=line_width(1.0))
        ax.axhline(0.0, color=GREY, lw=line_width(0.5))
        ax.margins(x=0)
        ax.set_xlabel("time (s)")
        ax.set_ylabel(f"difference across the units ({unit.name})")
        if ax.lines[:-1]:
            ax.legend()


def plot_stress(solution: Solution, path: str | Path) -> None:
    """Draw the largest normal stress of every bar over time."""
    motion = _motion(solution)
    with figure(path) as fig:
        ax, unit = fig.subplots(), figure_unit("Pa", motion.stress)
        for k, name in enumerate(motion.bar_names):
            style = DASHES[k // len(COLOURS) % len(DASHES)]
            colour = COLOURS[k % len(COLOURS)]
            ax.plot(solution.time, unit.factor * motion.stress[:, k], style, label=name, lw=line_width(0.8), color=colour)
        ax.margins(x=0)
        ax.set_xlabel("time (s)")
        ax.set_ylabel(f"largest normal stress ({unit.name})")
        if motion.bar_names:
            add_legend(fig, ax)


def _motion(solution: Solution) -> ArrayMotion:
    if solution.array is None:
        raise ValueError("the result is not a finished run of a scissor array; give the result of a finished run")
    return solution.array


def _set_limits(ax: Axes, rigid: Floats, flexible: Floats) -> bool:
    """Set limits that show the rigid curve well; return whether they cut off vibrations of flexible bars.

    Vibrations are cut off if they are more than `_CUT` times as large as the range of the rigid curve.
    """
    low, high = float(rigid.min()), float(rigid.max())
    lowest, highest = min(low, float(flexible.min())), max(high, float(flexible.max()))
    cut = highest - lowest > _CUT * (high - low or np.inf)
    if cut:
        shown = np.concatenate([rigid, np.percentile(flexible, [2.0, 98.0])])
        lowest, highest = float(shown.min()), float(shown.max())
    margin = 0.05 * (highest - lowest or 1.0)
    ax.set_ylim(lowest - margin, highest + margin)
    return cut
