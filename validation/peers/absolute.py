"""Cables and films in absolute nodal coordinates: runs of both programs; without Exudyn, of fsm only."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from fsm.kernels.programs import ramp
from fsm.model.nodes.loading import Forcing, Loading, point_force
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.equations.newton import equilibrium
from fsm.solve.modal import modes
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from validation.closed_forms.absolute import CABLE, PENDULUM
from validation.closed_forms.ancf import INERTIA, LENGTH, YOUNG, clamped_beam, pendulum_cable
from validation.membrane.film import exact_frequencies, plucked_film, pulled_film, tensioned_film
from validation.peers.common import EXUDYN, THERE, rms
from validation.peers.sweep import FSM, PEER, PeerCase, Run, timed

__all__ = ["cantilever", "film_modes", "film_vibration", "flexible_pendulum"]

_NEWTON = 1e-6
"""Tolerance of Newton's method of Exudyn. Both programs then solve the equations of a step equally well: the tip differs by
less than 1e-6 of the length from a solution with converged iterations (4 and 8 elements, steps of 1 to 10 ms)."""


def flexible_pendulum() -> PeerCase:
    """A soft cable that swings as a pendulum."""
    times = np.array(list(PENDULUM))
    path = np.array(list(PENDULUM.values()))

    def fsm(elements: int, settings: Settings) -> Callable[[], tuple[float, float]]:
        system, tip = pendulum_cable(elements)

        def solve() -> tuple[float, float]:
            saved: list[SavedState] = []
            taken, _ = timed(lambda: simulate(system, settings, list(times), saved.append))
            return taken, rms(np.array([s.q[[tip, tip + 2]] for s in saved]), path, 1.2)

        return solve

    def runs() -> list[Run]:
        found = []
        for elements in (4, 8, 16, 24):
            for h in (1e-2, 5e-3, 2e-3, 1e-3):
                name, method = f"{elements} elements, h = {1e3 * h:g} ms", "generalized-alpha"
                found.append(Run(FSM, method, name, fsm(elements, Settings(method, 1e-3, 0.5, rho_inf=0.6, step=h))))
            for rtol in (1e-2, 1e-3):
                name = f"{elements} elements, rtol {rtol:g}"
                found.append(Run(FSM, "Radau-blocks", name, fsm(elements, Settings("Radau-blocks", rtol, 0.5))))
        if THERE:
            from validation.peers import exudyn_cables
            from validation.peers.exudyn_rigid import Stepping

            for modified, elements, h in (
                (m, n, h) for m in (True, False) for n in (4, 8, 16, 24) for h in (1e-2, 5e-3, 2e-3, 1e-3)
            ):
                stepping = Stepping(h, modified=modified, radius=0.6, relative=_NEWTON, dense=elements < 8)
                name = f"generalised alpha, {'modified' if modified else 'full'} Newton"
                made = exudyn_cables.pendulum(elements)
                setting = f"{elements} elements, h = {1e3 * h:g} ms"
                found.append(Run(PEER, name, setting, _swing(made, stepping, times, path)))
        return found

    return PeerCase(
        "flexible_pendulum", "flexible pendulum, ANCF cable, 0.5 s",
        "place of the tip at 5 times, RMS over the length; 64 ANCF elements, computed independently.",
        {FSM: "spatial cable element held in the plane, engineering strain",
         PEER: f"{EXUDYN}; ObjectANCFCable2D; dense below 8 elements, Newton to 1e-6, spectral radius 0.6 as fsm's"},
        runs,
    )  # fmt: skip


def _swing(made: tuple, stepping: Any, times: np.ndarray, path: np.ndarray) -> Callable[[], tuple[float, float]]:
    from validation.peers.exudyn_rigid import solve

    def run() -> tuple[float, float]:
        taken, seen = solve(*made, stepping, times)
        return taken, rms(seen[:, :2], path, 1.2)

    return run


def cantilever() -> PeerCase:
    """A cable cantilever with large deflection."""

    def error(moved: np.ndarray) -> float:
        return float(np.linalg.norm(moved - CABLE)) / LENGTH

    def fsm(elements: int, steps: int, tolerance: float) -> Callable[[], tuple[float, float]]:
        mesh, tip = clamped_beam(elements)
        force = point_force(len(mesh.coordinates), tip, np.array([0.0, 0.0, -3.0 * YOUNG * INERTIA / LENGTH**2]))
        system = AncfSystem(mesh, Loading((Forcing(force, ramp()),)))

        def solve() -> tuple[float, float]:
            start = system.initial()[0]
            times = np.linspace(0.0, 1.0, steps + 1)
            taken, q = timed(lambda: equilibrium(system, start, times, tolerance))
            return taken, error(np.asarray(q)[[tip, tip + 2]] - mesh.coordinates[[tip, tip + 2]])

        return solve

    def exudyn(elements: int, steps: int, modified: bool) -> tuple[float, float]:
        from validation.peers.exudyn_cables import static

        taken, moved = static(elements, steps, 1e-5, modified)
        return taken, error(moved)

    def runs() -> list[Run]:
        found = []
        for n in (1, 2, 3, 4, 6, 8, 16):
            for steps in (1, 2, 4):
                name = f"{n} element{'s' * (n > 1)}, {steps} load step{'s' * (steps > 1)}"
                found.append(Run(FSM, "Newton", name, fsm(n, steps, 1e-3)))
                if THERE:
                    for modified in (False, True):
                        method = f"static, {'modified' if modified else 'full'} Newton"
                        found.append(Run(PEER, method, name, partial(exudyn, n, steps, modified)))
        return found

    return PeerCase(
        "cantilever", "ANCF cable, cantilever under 3EI/L²",
        "place of the tip over the length; converged value of another program.",
        {FSM: "spatial cable element, engineering strain, Newton's last step at most 1e-3",
         PEER: f"{EXUDYN}; ObjectANCFCable2D; dense below 8 elements, Newton to 1e-5"},
        runs,
    )  # fmt: skip


def film_modes() -> PeerCase:
    """Prestress and modes of a film."""
    exact = exact_frequencies(6)

    def fsm(cells: int) -> tuple[float, float]:
        pulled, _, _ = pulled_film(cells)
        first, _ = timed(lambda: equilibrium(pulled, pulled.initial()[0], np.array([0.0, 1.0])))
        system, _ = tensioned_film(cells)
        second, found = timed(lambda: modes(system, 0.0, system.start, 6))
        return first + second, float(np.abs(found.frequencies / exact - 1.0).max())  # type: ignore[attr-defined]

    def exudyn(cells: int, integration: int) -> tuple[float, float]:
        from validation.peers.exudyn_membrane import ExudynFilm

        film = ExudynFilm(cells, integration)
        first, _ = timed(film.prestress)
        second, found = timed(lambda: film.frequencies(6))
        return first + second, float(np.abs(found / exact - 1.0).max())  # type: ignore[operator]

    def runs() -> list[Run]:
        found = []
        for n in (4, 6, 8, 10, 12):
            found.append(Run(FSM, "Newton and Lanczos", f"{n} x {n} cells", partial(fsm, n)))
            if THERE:
                for i, name in enumerate(("full integration", "reduced integration")):
                    found.append(Run(PEER, name, f"{n} x {n} cells", partial(exudyn, n, i)))
        return found

    return PeerCase(
        "film_modes", "tensioned film, ANCF thin plate: prestress and six modes",
        "six lowest frequencies, largest relative error; closed form of the stretched plate.",
        {FSM: "film element, one load step, Lanczos", PEER: f"{EXUDYN}; ObjectANCFThinPlate, EigenSparse, one load step, "
         "sparse eigenvalues"},
        runs,
    )  # fmt: skip


CELLS, VIBRATION = 6, 0.1


def film_vibration() -> PeerCase:
    """A film's free vibration."""

    def runs() -> list[Run]:
        from validation.peers.exudyn_membrane import ExudynFilm, fsm_vibration

        system, height = plucked_film(CELLS)
        true = fsm_vibration(system, height, 0.0, VIBRATION, "Radau-blocks")

        def measured(vibrate: Callable[[], float]) -> tuple[float, float]:
            taken, found = timed(vibrate)
            return taken, abs(found / true - 1.0)  # type: ignore[operator]

        def fsm(step: float) -> tuple[float, float]:
            return measured(lambda: fsm_vibration(system, height, step, VIBRATION))

        def exudyn(step: float, integration: int) -> tuple[float, float]:
            film = ExudynFilm(CELLS, integration, system.rate, system.start)
            return measured(lambda: film.vibrate(step, VIBRATION))

        found = []
        for h in (1e-3, 5e-4, 2.5e-4, 1.25e-4, 1e-4):
            name = f"h = {1e3 * h:g} ms"
            found.append(Run(FSM, "generalized-alpha", name, partial(fsm, h)))
            if THERE and h > 1.1e-4:
                found.append(Run(PEER, "reduced integration", name, partial(exudyn, h, 1)))
                if h < 1e-3:
                    found.append(Run(PEER, "full integration", name, partial(exudyn, h, 0)))
        return found

    return PeerCase(
        "film_vibration", f"tensioned film, ANCF thin plate, {CELLS} x {CELLS} cells: {VIBRATION:g} s of vibration",
        "frequency of the free vibration, relative; same mesh with fsm's Radau-blocks at 1e-4.",
        {FSM: "generalized-alpha, spectral radius 0.9",
         PEER: f"{EXUDYN}; ObjectANCFThinPlate, modified Newton, spectral radius 0.9"},
        runs,
    )  # fmt: skip
