"""Scissor arrays with flexible bars: the paper of docs/scissor.md, whose table of sizes and materials is not available."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fsm.case.loading.load_case import load_case
from fsm.run.run_case import run_case
from fsm.views.plots.style import COLOURS, WIDE, figure
from validation.gallery.record import Check, NotCompared, Place, Reason, against, said
from validation.scissor.arrays import move, rigid_angle, steel_array

__all__ = ["deployment"]

CASE = Path(__file__).parents[2] / "folding_cases" / "scissor_array" / "case.toml"
PAPER = "paper on scissor arrays in absolute nodal coordinates, "
LOST = "its table 1 (lengths, section, material, angle) is lost; here bars of 1 m, 20 x 12 mm, steel, 75 deg"
NEAR = 0.05
"""Relative band about our numbers of 23 November 2026, with these sizes, in which `LOST` is why they are not the paper's."""


def deployment(place: Place) -> Iterator[Check | NotCompared]:
    """Three units deployed by 50 N at a1: comparison of flexible and rigid bars, synchronism, more units."""
    summary = run_case(load_case(CASE), place.out / "run", progress=False)
    units, end, step = 3, 1.5, 5e-4
    run = move(steel_array(units, 0.02), end, step, 300)
    times = run.times
    angle = rigid_angle(units, times, 0.02)
    rate = np.gradient(angle, times)
    rigid_height, rigid_speed = np.sin(angle), np.cos(angle) * rate
    height = {k: run.place(f"a{k}", 1) for k in (1, 2, 3, 4)}
    speed = {k: run.u[:, run.system.points[f"a{k}"] + 1] for k in (1, 2, 3, 4)}
    off, off_speed = np.abs(height[1] - rigid_height), np.abs(speed[1] - rigid_speed)
    apart = {f"a{k}-a{k + 1}": np.abs(height[k] - height[k + 1]) for k in (2, 3)}
    with figure(place.out / "deployment.png", (WIDE[0], 6.0)) as fig:
        axes = fig.subplots(2, 2, sharex=True).ravel()
        axes[0].plot(times, height[1], label="flexible")
        axes[0].plot(times, rigid_height, "--", label="rigid")
        axes[0].set(ylabel="height of a1 (m)")
        axes[1].plot(times, speed[1], label="flexible")
        axes[1].plot(times, rigid_speed, "--", label="rigid")
        axes[1].set(ylabel="speed of a1 (m/s)")
        axes[2].plot(times, 1e3 * off, color=COLOURS[2])
        axes[2].set(ylabel="a1 off rigid (mm)", xlabel="time (s)")
        for (name, gap), colour in zip(apart.items(), COLOURS[3:], strict=False):
            axes[3].plot(times, 1e3 * gap, color=colour, label=name)
        axes[3].set(ylabel="out of step in height (mm)", xlabel="time (s)")
        for ax in (axes[0], axes[1], axes[3]):
            ax.legend()
    picture = place.out / "deployment.png"
    late, early = times > 1.2, times <= 1.2
    yield said(
        "accelerated motion",
        "under a constant force the deployment is a motion of varying acceleration, flexible or rigid",
        PAPER + "section 5, figure 7",
        f"speed of a1 {abs(speed[1][times <= 0.5]).max():.2f} m/s until 0.5 s, {abs(speed[1]).max():.2f} m/s in all",
        bool(abs(speed[1]).max() > 2 * abs(speed[1][times <= 0.5]).max()),
        picture,
    )
    falls = rigid_height[0] - rigid_height
    share = float((falls[-1] - falls[times <= 1.2][-1]) / falls[-1])
    yield said(
        "quick at the end",
        "displacement, velocity and acceleration change very quickly within the last 0.3 s",
        PAPER + "section 5, figure 7",
        f"{share:.0%} of the way of a1 in the last 0.3 s of 1.5 s",
        share > 0.3,
        picture,
    )
    yield said(
        "flexible bars part from rigid ones late",
        "another key difference is in the displacements of flexible and rigid arrays, largest at the end",
        PAPER + "section 5, figure 7",
        f"{1e3 * off[early].max():.1f} mm until 1.2 s, {1e3 * off[late].max():.1f} mm after",
        bool(off[late].max() > 2 * off[early].max()),
        picture,
    )
    relative = float((off_speed / np.abs(rigid_speed).max()).max()), float((off / np.ptp(rigid_height)).max())
    yield said(
        "vibration is seen in velocity and acceleration, not in displacement",
        "apparent vibration on velocity and acceleration; in displacement too small to observe",
        PAPER + "section 5, figure 7",
        f"largest difference {relative[0]:.1%} of the largest speed, {relative[1]:.1%} of the way",
        relative[0] > 2 * relative[1],
        picture,
        detail="differences in speed are mostly those of a late array",
    )
    for name, gap in apart.items():
        yield said(
            f"asynchronism of {name}",
            "heights are obviously not synchronous after 1.20 s",
            PAPER + "section 5, figure 8",
            f"{1e3 * gap[early].max():.2f} mm until 1.2 s, {1e3 * gap[late].max():.2f} mm after",
            bool(gap[late].max() > 2 * gap[early].max()),
            picture,
        )
    rate = {k: run.acceleration(f"a{k}", 1) for k in (2, 3, 4)}
    pairs = ((2, 3), (3, 4), (2, 4))
    parted = {
        "velocity": np.abs([speed[i] - speed[k] for i, k in pairs]).max(axis=0),
        "acceleration": np.abs([rate[i] - rate[k] for i, k in pairs]).max(axis=0),
    }
    gap = parted["velocity"]
    yield said(
        "asynchronism of the velocity",
        "y-velocity is not synchronous anymore",
        PAPER + "section 5, figure 9",
        f"{gap[early].max():.3g} m/s until 1.2 s, {gap[late].max():.3g} m/s after",
        bool(gap[late].max() > 2 * gap[early].max()),
        picture,
    )
    differs, apart_by = summary["max_difference_rigid"], summary["max_asynchronism"]
    numbers = {  # columns: value of the paper, present value, value of 23 November 2026, unit, figure
        "difference from rigid bars, displacement x": (0.01498, differs["displacement_x"], 0.02177, "m", 7),
        "difference from rigid bars, displacement y": (0.02503, differs["displacement_y"], 0.01676, "m", 7),
        "difference from rigid bars, velocity": (0.3889, differs["velocity"], 0.2139, "m/s", 7),
        "difference from rigid bars, acceleration": (18.60, differs["acceleration"], 15.66, "m/s²", 7),
        "asynchronism of displacement, a2-a3": (0.01863, apart_by["a2-a3"], 0.009832, "m", 8),
        "asynchronism of displacement, a3-a4": (0.02203, apart_by["a3-a4"], 0.01032, "m", 8),
        "asynchronism of velocity": (0.7749, float(parted["velocity"].max()), 0.2912, "m/s", 9),
        "asynchronism of acceleration": (27.20, float(parted["acceleration"].max()), 13.99, "m/s²", 10),
    }
    for name, (paper, ours, known, unit, number) in numbers.items():
        yield against(
            f"largest {name}",
            "three units deployed by 50 N",
            ours,
            paper,
            PAPER + f"section 5, figure {number}",
            picture,
            rtol=0.1,
            unit=unit,
            reason=Reason(LOST, known, NEAR),
        )
    # six units are heavier, so the motion continues until their bars have rotated as far
    long = np.linspace(0.0, 8.0, 1601)
    same = float(np.interp(-angle[-1], -rigid_angle(6, long, 0.02), long))
    more = move(steel_array(6, 0.02), same, step, 300)
    wide = max(float(np.abs(more.place(f"a{k}", 1) - more.place(f"a{k + 1}", 1)).max()) for k in range(2, 7))
    few = max(float(gap.max()) for gap in apart.values())
    yield said(
        "more units, more deformation",
        "as the number of units increases, vibration and deformation are more obvious",
        PAPER + "section 5",
        f"out of step by {1e3 * few:.1f} mm with 3 units, {1e3 * wide:.1f} mm with 6 that have turned as far ({same:.2f} s)",
        wide > few,
        picture,
    )
    yield NotCompared(
        "B of the specification matrix method",
        PAPER + "eqs. 15 to 20",
        "a permutation, inverse its transpose: tests/physics/test_scissor.py",
    )
