"""Figures of a scissor array: its points beside those of rigid bars, how far neighbours part, stresses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from fsm.plots.legend import add_legend
from fsm.plots.style import COLOURS, GREY, WIDE, figure
from fsm.results.array import ArrayMotion, Floats, asynchronism
from fsm.results.solution import Solution

__all__ = ["plot_points", "plot_rigid", "plot_stress", "plot_synchronism"]

_DASHES = ("-", "--", ":", "-.")
"""Styles of lines of one colour."""
_MOTIONS = (("displacement", "m"), ("velocity", "m/s"), ("acceleration", "m/s²"))


def plot_points(solution: Solution, path: str | Path) -> None:
    """Displacement, velocity and acceleration along y of the upper points over time (figures 8 to 10 of seed 004)."""
    motion = _motion(solution)
    with figure(path, (WIDE[0], 6.4)) as fig:
        axes = fig.subplots(3, 1, sharex=True)
        for ax, (name, unit) in zip(axes, _MOTIONS, strict=True):
            values = getattr(motion.points, name)[..., 1]
            for k, point in enumerate(motion.upper):
                history, colour = values[:, motion.point_index(point)], COLOURS[k % len(COLOURS)]
                ax.plot(solution.time, history, color=colour, label=point, lw=1.0)
            ax.set_ylabel(f"{name} along y ({unit})")
        axes[0].legend(ncols=min(len(motion.upper), 6))
        axes[-1].set_xlabel("time (s)")


def plot_rigid(solution: Solution, path: str | Path) -> None:
    """The first and the last upper point with bars that deform and with rigid ones (figure 7 of seed 004)."""
    motion = _motion(solution)
    first, last = motion.upper[0], motion.upper[-1]
    shown = ((first, 1, "y"), (last, 0, "x"))
    with figure(path, (WIDE[0], 6.4)) as fig:
        axes = fig.subplots(3, 2, sharex=True)
        for row, (name, unit) in zip(axes, _MOTIONS, strict=True):
            for ax, (point, axis, along) in zip(row, shown, strict=True):
                k = motion.point_index(point)
                ax.plot(solution.time, getattr(motion.points, name)[:, k, axis], label="flexible", lw=1.0)
                if motion.rigid is not None:
                    rigid = getattr(motion.rigid, name)[:, k, axis]
                    ax.plot(solution.time, rigid, "--", color=COLOURS[1], label="rigid", lw=1.0)
                    _within(ax, rigid, getattr(motion.points, name)[:, k, axis])
                ax.set_ylabel(f"{name} of {point} along {along} ({unit})")
        axes[0, 0].legend()
        for ax in axes[-1]:
            ax.set_xlabel("time (s)")


def plot_synchronism(solution: Solution, path: str | Path) -> None:
    """How far neighbours are apart that rigid bars would keep together, each across its own unit."""
    motion = _motion(solution)
    with figure(path) as fig:
        ax = fig.subplots()
        for name, apart in asynchronism(motion).items():
            ax.plot(solution.time, 1e3 * apart, label=name.replace("-", " \N{MINUS SIGN} "), lw=1.0)
        ax.axhline(0.0, color=GREY, lw=0.5)
        ax.set_xlabel("time (s)")
        ax.set_ylabel("difference across the units (mm)")
        if ax.lines[:-1]:
            ax.legend()


def plot_stress(solution: Solution, path: str | Path) -> None:
    """Largest normal stress of every bar over time."""
    motion = _motion(solution)
    with figure(path) as fig:
        ax = fig.subplots()
        for k, name in enumerate(motion.bar_names):
            style = _DASHES[k // len(COLOURS) % len(_DASHES)]
            ax.plot(solution.time, 1e-6 * motion.stress[:, k], style, label=name, lw=0.8, color=COLOURS[k % len(COLOURS)])
        ax.set_xlabel("time (s)")
        ax.set_ylabel("largest normal stress (MPa)")
        if motion.bar_names:
            add_legend(fig, ax)


def _motion(solution: Solution) -> ArrayMotion:
    if solution.array is None:
        raise ValueError("the result is not a finished run of a scissor array")
    return solution.array


def _within(ax: Axes, rigid: Floats, flexible: Floats) -> None:
    """Limits that show the rigid curve well: vibration of bars may be many times as large as what it is about."""
    middle = np.concatenate([rigid, np.percentile(flexible, [2.0, 98.0])])
    low, high = float(middle.min()), float(middle.max())
    margin = 0.08 * (high - low or 1.0)
    ax.set_ylim(low - margin, high + margin)
