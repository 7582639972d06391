"""Selection and drawing of the figures of a result, after a run and by `fsm plot`.

Matplotlib and the modules of figures are imported when one is drawn.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Set
from contextlib import contextmanager
from functools import cache, partial
from importlib import import_module
from pathlib import Path

from fsm.errors import CaseError
from fsm.io.gc_startup import imports_outside_gc, plain_matplotlib
from fsm.results.quantities import touching_pairs
from fsm.results.solution import Solution
from fsm.views.plots.beside import ask_copy, can_copy, draw_all, waiting_copy
from fsm.views.plots.drawing import FORMATS, file_format, in_two_processes

Plot = Callable[[Solution, Path], None]


def _later(module: str, name: str) -> Plot:
    """Figure whose module is imported when one is drawn."""

    def plot(solution: Solution, path: Path) -> None:
        getattr(import_module(f"fsm.views.plots.{module}"), name)(solution, path)

    return plot


_ALL: dict[str, tuple[Plot, Callable[[Solution], bool]]] = {
    "report.png": (
        _later("channels", "plot_report"),
        lambda run: len(run) > 1 and bool(run.summary.get("report") or run.summary.get("reactions")),
    ),
    "margin.png": (_later("channels", "plot_margin"), lambda run: bool(run.summary.get("margins"))),
    "force.png": (_later("force", "plot_force"), lambda run: bool(run.travel.shape[1])),
    "load.png": (_later("load", "plot_load"), lambda run: run.load_path is not None and bool(run.load_path.names)),
    "motion.png": (_later("motion", "plot_motion"), lambda run: not _is_film(run) and run.shape.size > 0),
    "energy.png": (_later("energy", "plot_energy"), lambda run: len(run) > 1),
    "contact.png": (_later("contact_map", "plot_contact_map"), lambda run: bool(touching_pairs(run.pair_force))),
    "history.png": (_later("vibration", "plot_history"), lambda run: _is_film(run) and len(run.samples.time) > 1),
    "spectrum.png": (_later("vibration", "plot_spectrum"), lambda run: _is_film(run) and len(run.samples.time) > 1),
    "modes.png": (_later("vibration", "plot_modes"), lambda run: _is_film(run)),
    "tension.png": (_later("vibration", "plot_tension"), lambda run: _is_film(run)),
    "points.png": (_later("scissor", "plot_points"), lambda run: run.array is not None),
    "rigid.png": (_later("scissor", "plot_rigid"), lambda run: run.array is not None and run.array.rigid is not None),
    "synchronism.png": (
        _later("scissor", "plot_synchronism"), lambda run: run.array is not None and len(run.array.upper) > 2
    ),
    "stress.png": (_later("scissor", "plot_stress"), lambda run: run.array is not None and run.array.stress.shape[1] > 0),
    "motion.gif": (_later("movie", "write_gif"), lambda run: run.array is not None),
}
"""Figures by the names of their files, with the results that have them."""
_SLOWEST = {"motion": 0, "energy": 1, "contact": 2}
"""Order of the figures that take the longest."""


def _is_film(run: Solution) -> bool:
    return run.layout.film is not None


def figures_of(solution: Solution) -> dict[str, Plot]:
    """File names of the figures of a result, with the functions that draw them."""
    return {name: plot for name, (plot, applies) in _ALL.items() if applies(solution)}


def draw(solution: Solution, folder: Path, alone: bool = False) -> list[Path]:
    """Draw all figures of a result into a folder, in the style and format of `fsm.views.plots.drawing`.

    Within `drawn_beside`, its copy of this process draws them. Figures that the result does not have are deleted; with
    `alone`, also figures in other formats of an earlier run.

    Returns
    -------
    list of Path
        Paths of the figures.
    """
    return begin_drawing(solution, folder, alone)()


def begin_drawing(solution: Solution, folder: Path, alone: bool = False) -> Callable[[], list[Path]]:
    """As `draw`, but return a function that waits for the copy, or draws the figures if there is none."""
    figures = {_named(name, file_format()): plot for name, plot in figures_of(solution).items()}
    kept = {Path(name).stem for name in figures} if not alone else set()
    remove_figures(folder, {*figures, *(_named(f"{stem}.png", suffix) for stem in kept for suffix in FORMATS)})
    drawn = ask_copy((solution, folder))

    def end() -> list[Path]:
        if not drawn():
            _draw_all(solution, folder)
        return [folder / name for name in figures]

    return end


def _draw_all(solution: Solution, folder: Path) -> None:
    """Draw all figures of a result, on two processors if the command allows it."""
    figures = figures_of(solution)
    slowest_first = sorted(figures.items(), key=lambda item: _SLOWEST.get(Path(item[0]).stem, len(_SLOWEST)))
    plots = [partial(plot, solution, folder / _named(name, file_format())) for name, plot in slowest_first]
    draw_all(plots, in_two_processes())


@contextmanager
def drawn_beside() -> Iterator[None]:
    """Import Matplotlib in a copy of this process, which then draws the figures of results that the block computes.

    For the command line, see `fsm.views.plots.beside`. On one processor, Matplotlib is imported here.
    """
    if not in_two_processes() or not can_copy():
        _import_plots()
        yield
        return
    with waiting_copy(_ready):
        yield


def _ready() -> Callable[[tuple[Solution, Path]], None]:
    _import_plots()
    from fsm.views.plots import energy, motion, style

    style.prepare(motion.GRID, energy.GRID, style.Grid(), style.Grid())  # also for force and contact
    return lambda request: _draw_all(*request)


def _import_plots() -> None:
    """Import Matplotlib and the figures of a deployment."""
    with imports_outside_gc(), plain_matplotlib():
        for module in ("motion", "force", "energy", "contact_map"):
            import_module(f"fsm.views.plots.{module}")


def draw_one(solution: Solution, path: Path) -> str:
    """Draw one figure of a result into a file (.png, .svg or .pdf): the one with this name, else the first one.

    Returns
    -------
    str
        Name of the figure that was drawn: "force", "load", "motion", ...
    """
    figures = {Path(name).stem: plot for name, plot in figures_of(solution).items() if name.endswith(".png")}
    if not figures:
        raise CaseError("no figure can be drawn, because the result has only one record; give --channel", str(path))
    name = path.stem if path.stem in figures else next(iter(figures))
    figures[name](solution, path)
    return name


def remove_figures(folder: Path, kept: Set[str] = frozenset()) -> None:
    """Delete the figures of a result in a folder, in all formats, except files with these names."""
    found = set(os.listdir(folder)) if folder.is_dir() else set()
    for name in _files() & found - kept:
        (folder / name).unlink(missing_ok=True)


@cache
def _files() -> Set[str]:
    """Names of all figures in all formats."""
    return {_named(name, suffix) for name in _ALL for suffix in FORMATS}


def _named(name: str, suffix: str) -> str:
    """Name of a figure in another format; an animation has one format only."""
    return Path(name).stem + suffix if name.endswith(".png") else name
