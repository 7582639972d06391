"""Figures of a scissor array: motion of its points, comparison with rigid bars, synchronism, stresses."""

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
"""Line styles for curves of the same colour."""
_MOTIONS = (("displacement", "m"), ("velocity", "m/s"), ("acceleration", "m/s²"))


def plot_points(solution: Solution, path: str | Path) -> None:
    """Draw displacement, velocity and acceleration along y of the upper points over time."""
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
    """Draw the motion of the first and the last upper point with flexible and with rigid bars."""
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
                    _set_limits(ax, rigid, getattr(motion.points, name)[:, k, axis])
                ax.set_ylabel(f"{name} of {point} along {along} ({unit})")
        axes[0, 0].legend()
        for ax in axes[-1]:
            ax.set_xlabel("time (s)")


def plot_synchronism(solution: Solution, path: str | Path) -> None:
    """Draw the difference in deployment of neighbouring units over time; it is zero with rigid bars."""
    motion = _motion(solution)
    with figure(path) as fig:
        ax = fig.subplots()
        for name, difference in asynchronism(motion).items():
            ax.plot(solution.time, 1e3 * difference, label=name.replace("-", " \N{MINUS SIGN} "), lw=1.0)
        ax.axhline(0.0, color=GREY, lw=0.5)
        ax.set_xlabel("time (s)")
        ax.set_ylabel("difference across the units (mm)")
        if ax.lines[:-1]:
            ax.legend()


def plot_stress(solution: Solution, path: str | Path) -> None:
    """Draw the largest normal stress of every bar over time."""
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


def _set_limits(ax: Axes, rigid: Floats, flexible: Floats) -> None:
    """Set limits that show the rigid curve well, even if vibrations of flexible bars are many times larger."""
    shown = np.concatenate([rigid, np.percentile(flexible, [2.0, 98.0])])
    low, high = float(shown.min()), float(shown.max())
    margin = 0.08 * (high - low or 1.0)
    ax.set_ylim(low - margin, high + margin)
