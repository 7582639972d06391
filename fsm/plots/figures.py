"""Selection and drawing of the figures of a result, after a run and by `fsm plot`."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from fsm.plots.contact_map import plot_contact_map
from fsm.plots.energy import plot_energy
from fsm.plots.force import plot_force
from fsm.plots.motion import plot_motion
from fsm.results.quantities import touching_pairs
from fsm.results.solution import Solution

__all__ = ["draw", "figures_of"]

Plot = Callable[[Solution, Path], None]


def _later(module: str, name: str) -> Plot:
    """Figure of films and arrays, whose module is imported when one is drawn."""

    def plot(solution: Solution, path: Path) -> None:
        getattr(import_module(f"fsm.plots.{module}"), name)(solution, path)

    return plot


_ALL: dict[str, Plot] = {
    "force.png": plot_force,
    "motion.png": plot_motion,
    "energy.png": plot_energy,
    "contact.png": plot_contact_map,
    "history.png": _later("vibration", "plot_history"),
    "spectrum.png": _later("vibration", "plot_spectrum"),
    "modes.png": _later("vibration", "plot_modes"),
    "tension.png": _later("vibration", "plot_tension"),
    "points.png": _later("scissor", "plot_points"),
    "rigid.png": _later("scissor", "plot_rigid"),
    "synchronism.png": _later("scissor", "plot_synchronism"),
    "stress.png": _later("scissor", "plot_stress"),
    "motion.gif": _later("animation", "animate"),
}


def figures_of(solution: Solution) -> dict[str, Plot]:
    """File names of the figures of a result, with the functions that draw them."""
    film = solution.layout.film is not None
    array = solution.array
    moves = len(solution) > 1
    applies = {
        "force.png": bool(solution.travel.shape[1]),
        "motion.png": not film,
        "energy.png": moves,
        "contact.png": bool(touching_pairs(solution.pair_force)),
        "history.png": film and len(solution.samples.time) > 1,
        "spectrum.png": film and len(solution.samples.time) > 1,
        "modes.png": film,
        "tension.png": film,
        "points.png": array is not None,
        "rigid.png": array is not None and array.rigid is not None,
        "synchronism.png": array is not None and len(array.upper) > 2,
        "stress.png": array is not None and array.stress.shape[1] > 0,
        "motion.gif": array is not None,
    }
    return {name: _ALL[name] for name, drawn in applies.items() if drawn}


def draw(solution: Solution, folder: Path) -> list[Path]:
    """Draw all figures of a result into a folder, and delete other figures of an earlier run.

    Returns
    -------
    list of Path
        Paths of the figures.
    """
    figures = figures_of(solution)
    for name in _ALL:
        if name not in figures:
            (folder / name).unlink(missing_ok=True)
    for name, plot in figures.items():
        plot(solution, folder / name)
    return [folder / name for name in figures]
