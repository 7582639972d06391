"""Pictures of piles."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

from fsm.views.plots.style import COLOURS, GREY, SINGLE, figure
from validation.contact.box_of_plates import Fall
from validation.contact.pulled_strip import Pull
from validation.contact.stack import PressedStack

__all__ = ["draw_box", "draw_friction", "draw_stack"]


def draw_stack(path: Path, pressed: PressedStack) -> None:
    """The strip when free, half pressed, pressed, and released."""
    count = len(pressed.saved)
    chosen = [pressed.saved[round(part * (count - 1))] for part in (0.0, 0.12, 0.35, 1.0)]
    with figure(path, (8.0, 2.4)) as fig:
        axes = fig.subplots(1, len(chosen), sharey=True)
        for one, state in zip(axes, chosen, strict=True):
            lines = 1e3 * pressed.system.shape(state.time, state.q)[:, :2][:, :, [0, 2]]
            one.add_collection(LineCollection(list(lines), colors=COLOURS[0], linewidths=0.8))
            one.axvline(1e3 * state.q[-3], color=COLOURS[1])
            one.set(aspect="equal", ylim=(-5, 85), xlabel="x (mm)", title=f"t = {state.time:.1f} s")
            one.set_xlim(-5, 1e3 * pressed.saved[0].q[-3] + 5)
        axes[0].set_ylabel("z (mm)")


def draw_box(path: Path, fall: Fall, half: float) -> None:
    """Plates at the start and at the end, from the side, and the energies."""
    with figure(path, (7.2, 5.2)) as fig:
        above, below = fig.subplots(2, 1)
        shift = 0.0
        for state in (fall.saved[0], fall.saved[-1]):
            corners = 1e3 * fall.system.shape(state.time, state.q)[:, :, [0, 2]] + np.array([shift, 0.0])
            order = np.argsort(fall.system.shape(state.time, state.q)[:, :, 1].mean(axis=1))
            above.add_collection(
                PolyCollection(list(corners[order]), facecolors=COLOURS[5], edgecolors=GREY, linewidths=0.3, alpha=0.6)
            )
            above.plot(shift + 1e3 * half * np.array([-1, -1, 1, 1]), [60, 0, 0, 60], color=COLOURS[6])
            shift += 2.4e3 * half
        above.set(aspect="equal", xlabel="x (mm)", ylabel="z (mm)")
        time = [1e3 * state.time for state in fall.saved]
        energies = [state.observation.energy for state in fall.saved]
        below.plot(time, [1e3 * energy.kinetic for energy in energies], label="kinetic")
        below.plot(time, [1e3 * energy.potential["contact"] for energy in energies], label="contact")
        below.plot(time, [1e3 * state.dissipated for state in fall.saved], label="dissipated")
        below.plot(time, [1e6 * state.error for state in fall.saved], color=GREY, label="balance error (µJ)")
        below.set(xlabel="time (ms)", ylabel="energy (mJ)")
        below.legend()


def draw_friction(path: Path, frictions: np.ndarray, pulls: Sequence[Pull]) -> None:
    """Increase of the peak, and energy that friction dissipates relative to the total energy, over the friction
    coefficient."""
    with figure(path, SINGLE) as fig:
        axes = fig.add_subplot()
        first = pulls[0].peak_force
        axes.plot(frictions, [100 * (one.peak_force / first - 1) for one in pulls], marker="o", label="rise of the peak")
        shares = [100 * one.friction_energy / one.turnover for one in pulls]
        axes.plot(frictions, shares, marker="s", label="taken by friction, of all energy")
        axes.set(xlabel="coefficient of friction", ylabel="%")
        axes.legend()
