"""The problems, and the settings with which fsm and Exudyn are swept over each; without Exudyn, fsm's runs only."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from fsm.ancf.loading import Forcing, Loading, point_force
from fsm.ancf.pulse import Ramp
from fsm.ancf.system import AncfSystem
from fsm.prepare import prepare
from fsm.solve.modal import modes
from fsm.solve.newton import equilibrium
from fsm.solve.simulate import Saved, Settings, simulate
from validation.closed_forms.absolute import CABLE, PENDULUM
from validation.closed_forms.ancf import INERTIA, LENGTH, YOUNG, clamped_beam, pendulum_cable
from validation.membrane.film import exact_frequencies, plucked_film, pulled_film, tensioned_film
from validation.peers import rigid
from validation.peers.strip import FSM_METHODS, distance, strip_case
from validation.peers.sweep import FSM, PEER, PeerCase, Run, timed

__all__ = ["ALL", "THERE"]

THERE = importlib.util.find_spec("exudyn") is not None
"""Exudyn is installed."""
SEGMENTS = 10
EXUDYN = "build without range checks, one thread, no files, only the sensor that is compared, compared times only"


def _rms(path: np.ndarray, reference: np.ndarray, size: float) -> float:
    """Of the distance of two paths, over a size."""
    return float(np.sqrt(((path - reference) ** 2).sum(axis=1).mean()) / size)


# pulled strip -----------------------------------------------------------------------------------------------------------


def _strip(contact: bool) -> list[Run]:
    overrides = ("material.damping=0",)
    _, system = prepare(strip_case(SEGMENTS, contact, overrides=overrides))
    reference: list[Any] = []

    def converged() -> Any:
        if not reference:
            if contact and THERE:
                from validation.peers.exudyn_strip import Bench, exudyn_converged

                reference.append(exudyn_converged(Bench(SEGMENTS, 1, True), contact=True))
            else:
                reference.append(FSM_METHODS["static"].run(system, 1e-6))
        return reference[0]

    def fsm(rtol: float) -> tuple[float, float]:
        taken, curve = timed(lambda: FSM_METHODS["static"].run(system, rtol))
        return taken, distance(curve, converged())  # type: ignore[arg-type]

    rtols = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 1e-4)
    runs = [Run(FSM, "static", f"rtol {rtol:g}", lambda r=rtol: fsm(r)) for rtol in rtols]  # type: ignore[misc]
    if THERE:
        runs += _exudyn_strip(contact, converged)
    return runs


def _exudyn_strip(contact: bool, converged: Callable[[], Any]) -> Iterator[Run]:
    from validation.peers.exudyn_model import ExudynSettings
    from validation.peers.exudyn_strip import exudyn_strip

    kinds: list[tuple[str, str, ExudynSettings]] = []
    for steps in (20, 28, 40, 56, 80, 160) if contact else (5, 7, 10, 14, 20, 40):
        for modified in (False, True):
            static = ExudynSettings(
                steps, planar=True, relative=1e-4 if contact else 1e-3, exact=contact, modified=modified
            )
            kinds.append(("static, modified Newton" if modified else "static", f"{steps} steps", static))
    end = prepare(strip_case(SEGMENTS))[1].motions[0].end_time
    for step in (0.5, 0.2, 0.1, 0.05) if contact else (2.0, 1.0, 0.5):
        dynamic = ExudynSettings(round(end / step), True, dynamic=True, relative=1e-4, radius=0.0, exact=contact)
        kinds.append(("generalised alpha", f"h = {step:g} s", dynamic))
    for method, name, settings in kinds:
        model: list[Any] = []

        def solve(model: list[Any] = model, settings: ExudynSettings = settings) -> tuple[float, float]:
            if not model:
                model.append(exudyn_strip(SEGMENTS, settings, contact))
            taken, curve = model[0].solve(time.process_time)
            return taken, distance(curve, converged())

        yield Run(PEER, method, name, solve)


def free_strip() -> PeerCase:
    """(a)."""
    return PeerCase(
        "strip", "pulled strip, no contact, 10 segments a panel, plane",
        "force against travel, RMS over the peak; fsm's path at rtol 1e-6, from which Exudyn's at 320 steps is 2e-6 off.",
        {FSM: "static path, no dampers", PEER: f"planar bodies; {EXUDYN}; EigenSparse, full and modified Newton to 1e-3, "
         "Jacobian without the springs' geometric stiffness; dynamics at the speed of the case, spectral radius 0"},
        lambda: _strip(False),
    )  # fmt: skip


def pressed_strip() -> PeerCase:
    """(b)."""
    return PeerCase(
        "strip_contact", "pulled strip, panels 3 and 4 touch, 10 segments a panel, plane",
        "as before; Exudyn's half strip at 1280 steps, for both.",
        {FSM: "static path, no dampers, the whole strip", PEER: "half the strip against its mirror plane, Hertz springs at "
         "fsm's points in Exudyn's symbols (Exudyn has no contact of faces); full and modified Newton to 1e-4, whole "
         "Jacobian; otherwise as before"},
        lambda: _strip(True),
    )  # fmt: skip


# rigid mechanisms -------------------------------------------------------------------------------------------------------


def _fsm_rigid(
    model: Callable, reference: np.ndarray, times: np.ndarray, stiffnesses: tuple[float, ...], steps: tuple[float, ...],
    rtols: tuple[float, ...] = (1e-2, 1e-3, 1e-4), size: float = 1.0,
) -> list[Run]:  # fmt: skip
    runs = []
    end = float(times[-1])
    for stiffness in stiffnesses:
        system, shown = model(stiffness)
        settings = [("generalized-alpha", f"h = {1e3 * h:g} ms", Settings("generalized-alpha", 1e-3, end, step=h)) for h in steps]
        settings += [("generalized-alpha, error control", f"rtol {r:g}", Settings("generalized-alpha", r, end)) for r in rtols]
        settings += [("Radau-blocks", f"rtol {r:g}", Settings("Radau-blocks", r, end)) for r in rtols]

        for method, name, setting in settings:

            def solve(system: Any = system, shown: Any = shown, setting: Settings = setting) -> tuple[float, float]:
                taken, path = timed(lambda: rigid.run_model(system, setting, times, shown))
                return taken, _rms(path, reference, size)  # type: ignore[arg-type]

            runs.append(Run(FSM, method, f"{name}, k = {stiffness:g} N/m", solve))
    return runs


def _exudyn_rigid(method: str, make: Callable, reference: np.ndarray, times: np.ndarray, **sweep: Any) -> list[Run]:
    """`sweep`: `steps`, and what else a `Stepping` has."""
    from validation.peers.exudyn_rigid import Stepping, solve

    runs = []
    steps = sweep.pop("steps")
    for step in steps:
        made: list[Any] = []

        def run(made: list[Any] = made, step: float = step) -> tuple[float, float]:
            if not made:
                made.extend(make())
            mbs, sensor, shown = made
            taken, seen = solve(mbs, sensor, Stepping(step, **sweep), times)
            return taken, _rms(shown(seen), reference, 1.0)

        runs.append(Run(PEER, method, f"h = {1e3 * step:g} ms", run))
    return runs


_FINE = (0.025, 0.0125, 0.01, 0.005, 0.0025)
_SPRINGS = "joints are springs of k N/m, damped to a fifth of critical"


def pendulum() -> PeerCase:
    """(e) A01."""

    def runs() -> list[Run]:
        path = rigid.pendulum_path()
        found = _fsm_rigid(rigid.pendulum_model, path, rigid.TIMES, (1e5, 1e6), (0.025, 0.01, 0.005))
        if THERE:
            from validation.peers import exudyn_rigid as peer

            for radius in (0.9, 1.0):
                name = f"constraint, generalised alpha {radius:g}"
                found += _exudyn_rigid(
                    name, peer.pendulum, path, rigid.TIMES, steps=_FINE, modified=False, radius=radius
                )
            found += _exudyn_rigid(
                "constraint, trapezoidal", peer.pendulum, path, rigid.TIMES, steps=_FINE, modified=False,
                solver="TrapezoidalIndex2",
            )  # fmt: skip
            found += _exudyn_rigid(
                "angle, RK44", peer.pendulum_tree, path, rigid.TIMES, steps=(0.25, 0.125, 0.1, 0.05), solver="RK44"
            )
        return found

    return PeerCase(
        "A01", "IFToMM A01, simple pendulum, 10 s",
        "place of the mass at 20 times, RMS over its length; equation of the angle by DOP853 at 1e-11.",
        {FSM: f"a body of the same equation of motion (centre at 0.75 m, 0.1875 kg m²); {_SPRINGS}",
         PEER: f"{EXUDYN}; dense, full Newton (modified is slower here); mass point and distance, or one link of a kinematic tree"},
        runs,
    )  # fmt: skip


def four_bars() -> PeerCase:
    """(e) A02."""

    def runs() -> list[Run]:
        path = rigid.four_bars_path()
        found = _fsm_rigid(rigid.four_bars_model, path, rigid.TIMES, (1e7,), (0.005, 0.0025), (1e-3, 1e-4, 1e-5))
        if THERE:
            from validation.peers import exudyn_rigid as peer

            for modified in (False, True):
                name = f"constraints, generalised alpha, {'modified' if modified else 'full'} Newton"
                found += _exudyn_rigid(name, peer.four_bars, path, rigid.TIMES, steps=_FINE, modified=modified)
        return found

    return PeerCase(
        "A02", f"IFToMM A02, {rigid.WINDOWS} four-bar linkages in a row, 10 s",
        "place of the first top at 20 times, RMS over the bar; equation of the angle by DOP853 at 1e-11. The linkage "
        "passes configurations where it could branch.",
        {FSM: _SPRINGS, PEER: f"{EXUDYN}; dense, planar bodies, revolute joints"},
        runs,
    )  # fmt: skip


def bricard() -> PeerCase:
    """(e) A04."""

    def runs() -> list[Run]:
        path = rigid.bricard_path()
        found = _fsm_rigid(rigid.bricard_model, path, rigid.TIMES, (1e5, 1e6), (0.025, 0.01, 0.005))
        if THERE:
            from validation.peers import exudyn_rigid as peer

            for dense in (False, True):
                name = f"constraints, generalised alpha, {'dense' if dense else 'sparse'}"
                found += _exudyn_rigid(
                    name, peer.bricard, path, rigid.TIMES, steps=(0.05, 0.025, 0.0125, 0.01, 0.005), dense=dense
                )
            found += _exudyn_rigid(
                "constraints, trapezoidal", peer.bricard, path, rigid.TIMES, steps=(0.05, 0.025, 0.0125, 0.01), dense=False,
                solver="TrapezoidalIndex2",
            )  # fmt: skip
        return found

    return PeerCase(
        "A04", "IFToMM A04, Bricard's linkage, 10 s",
        "place of the third corner at 20 times, RMS over the bar; the linkage's one motion by continuation, its equation by "
        "DOP853 at 1e-11.",
        {FSM: f"{_SPRINGS}; hinges 0.1 k N m/rad across their axes",
         PEER: f"{EXUDYN}; Euler parameters, modified Newton (full takes three times as long), the redundant constraint left out"},
        runs,
    )  # fmt: skip


def heavy_top() -> PeerCase:
    """(d)."""

    def runs() -> list[Run]:
        path, times = rigid.top_path(), rigid.TOP_TIMES
        found = _fsm_rigid(
            rigid.top_model, path, times, (1e6, 1e7), (2.5e-3, 1e-3, 5e-4), (1e-2, 1e-3, 1e-4, 1e-5)
        )
        if THERE:
            from validation.peers import exudyn_rigid as peer

            fine = (2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4)
            found += _exudyn_rigid("constraints, generalised alpha", peer.top, path, times, steps=fine)
            found += _exudyn_rigid("about the point, generalised alpha", peer.top_free, path, times, steps=fine)
            found += _exudyn_rigid(
                "about the point, RK44", peer.top_free, path, times, steps=(1e-2, 5e-3, 2.5e-3, 2e-3, 1e-3), solver="RK44"
            )
        return found

    return PeerCase(
        "heavy_top", "heavy top, 1 s, 24 turns",
        "place of the centre at 20 times, RMS over 1 m; Euler's equations about the point by DOP853 at 1e-11.",
        {FSM: _SPRINGS, PEER: f"{EXUDYN}; dense, modified Newton; Euler parameters and a spherical joint, or a Lie group and "
         "the inertia about the fixed point"},
        runs,
    )  # fmt: skip


# cables and plates ------------------------------------------------------------------------------------------------------


def flexible_pendulum() -> PeerCase:
    """(c)."""
    times = np.array(list(PENDULUM))
    path = np.array(list(PENDULUM.values()))

    def fsm(elements: int, settings: Settings) -> Callable[[], tuple[float, float]]:
        system, tip = pendulum_cable(elements)

        def solve() -> tuple[float, float]:
            saved: list[Saved] = []
            taken, _ = timed(lambda: simulate(system, settings, list(times), saved.append))
            return taken, _rms(np.array([s.q[[tip, tip + 2]] for s in saved]), path, 1.2)

        return solve

    def runs() -> list[Run]:
        found = []
        for elements in (4, 8, 16):
            for h in (5e-3, 2e-3, 1e-3, 5e-4):
                setting = Settings("generalized-alpha", 1e-3, 0.5, rho_inf=0.6, step=h)
                name = f"{elements} elements, h = {1e3 * h:g} ms"
                found.append(Run(FSM, "generalized-alpha", name, fsm(elements, setting)))
            for rtol in (1e-2, 1e-3):
                name = f"{elements} elements, rtol {rtol:g}"
                found.append(Run(FSM, "Radau-blocks", name, fsm(elements, Settings("Radau-blocks", rtol, 0.5))))
        if THERE:
            from validation.peers import exudyn_cables
            from validation.peers.exudyn_rigid import Stepping

            for modified, elements, h in (
                (m, n, h) for m in (True, False) for n in (4, 8, 16) for h in (5e-3, 2e-3, 1e-3, 5e-4)
            ):
                stepping = Stepping(h, modified=modified, radius=0.6, relative=1e-4, dense=elements < 8)
                name = f"generalised alpha, {'modified' if modified else 'full'} Newton"
                made = exudyn_cables.pendulum(elements)
                found.append(Run(PEER, name, f"{elements} elements, h = {1e3 * h:g} ms", _swing(made, stepping, times, path)))
        return found

    return PeerCase(
        "flexible_pendulum", "flexible pendulum, ANCF cable, 0.5 s",
        "place of the tip at 5 times, RMS over the length; 64 ANCF elements, computed independently, to 1e-6 m.",
        {FSM: "spatial cable element held in the plane, engineering strain",
         PEER: f"{EXUDYN}; ObjectANCFCable2D; dense below 8 elements, Newton to 1e-4, spectral radius 0.6 as fsm's"},
        runs,
    )  # fmt: skip


def _swing(made: tuple, stepping: Any, times: np.ndarray, path: np.ndarray) -> Callable[[], tuple[float, float]]:
    from validation.peers.exudyn_rigid import solve

    def run() -> tuple[float, float]:
        taken, seen = solve(*made, stepping, times)
        return taken, _rms(seen[:, :2], path, 1.2)

    return run


def cantilever() -> PeerCase:
    """(f)."""

    def fsm(elements: int, steps: int, tolerance: float) -> Callable[[], tuple[float, float]]:
        mesh, tip = clamped_beam(elements)
        force = point_force(len(mesh.coordinates), tip, np.array([0.0, 0.0, -3.0 * YOUNG * INERTIA / LENGTH**2]))
        system = AncfSystem(mesh, Loading((Forcing(force, Ramp()),)))

        def solve() -> tuple[float, float]:
            start = system.initial()[0]
            times = np.linspace(0.0, 1.0, steps + 1)
            taken, q = timed(lambda: equilibrium(system, start, times, tolerance))
            moved = np.asarray(q)[[tip, tip + 2]] - mesh.coordinates[[tip, tip + 2]]
            return taken, float(np.linalg.norm(moved - CABLE)) / LENGTH

        return solve

    def exudyn(elements: int, steps: int, modified: bool) -> tuple[float, float]:
        from validation.peers.exudyn_cables import static

        taken, moved = static(elements, steps, 1e-5, modified)
        return taken, float(np.linalg.norm(moved - CABLE)) / LENGTH

    def runs() -> list[Run]:
        found = []
        for n in (1, 2, 3, 4, 6, 8, 16):
            for steps in (1, 2, 4):
                name = f"{n} element{'s' * (n > 1)}, {steps} load step{'s' * (steps > 1)}"
                found.append(Run(FSM, "Newton", name, fsm(n, steps, 1e-5)))
                if THERE:
                    for modified in (False, True):
                        method = f"static, {'modified' if modified else 'full'} Newton"
                        found.append(Run(PEER, method, name, lambda n=n, s=steps, m=modified: exudyn(n, s, m)))  # type: ignore[misc]
        return found

    return PeerCase(
        "cantilever", "ANCF cable, cantilever under 3EI/L²",
        "place of the tip over the length; converged value of another program.",
        {FSM: "spatial cable element, engineering strain, Newton's last step at most 1e-5",
         PEER: f"{EXUDYN}; ObjectANCFCable2D; dense below 8 elements, Newton to 1e-5"},
        runs,
    )  # fmt: skip


def film_modes() -> PeerCase:
    """(g), prestress and modes."""
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
            found.append(Run(FSM, "Newton and Lanczos", f"{n} x {n} cells", lambda n=n: fsm(n)))  # type: ignore[misc]
            if THERE:
                for i, name in enumerate(("full integration", "reduced integration")):
                    found.append(Run(PEER, name, f"{n} x {n} cells", lambda n=n, i=i: exudyn(n, i)))  # type: ignore[misc]
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
    """(g), vibration."""

    def runs() -> list[Run]:
        from validation.peers.exudyn_membrane import ExudynFilm, fsm_vibration

        system, height = plucked_film(CELLS)
        true = fsm_vibration(system, height, 0.0, VIBRATION, "Radau-blocks")

        def fsm(step: float) -> tuple[float, float]:
            taken, found = timed(lambda: fsm_vibration(system, height, step, VIBRATION))
            return taken, abs(found / true - 1.0)  # type: ignore[operator]

        def exudyn(step: float, integration: int) -> tuple[float, float]:
            film = ExudynFilm(CELLS, integration, system.rate, system.start)
            taken, found = timed(lambda: film.vibrate(step, VIBRATION))
            return taken, abs(found / true - 1.0)  # type: ignore[operator]

        found = []
        for h in (1e-3, 5e-4, 2.5e-4, 1.25e-4, 1e-4):
            name = f"h = {1e3 * h:g} ms"
            found.append(Run(FSM, "generalized-alpha", name, lambda h=h: fsm(h)))  # type: ignore[misc]
            if THERE and h > 1.1e-4:
                found.append(Run(PEER, "reduced integration", name, lambda h=h: exudyn(h, 1)))  # type: ignore[misc]
        return found

    return PeerCase(
        "film_vibration", f"tensioned film, ANCF thin plate, {CELLS} x {CELLS} cells: {VIBRATION:g} s of vibration",
        "frequency of the free vibration, relative; same mesh with fsm's Radau-blocks at 1e-4.",
        {FSM: "generalized-alpha, spectral radius 0.9",
         PEER: f"{EXUDYN}; ObjectANCFThinPlate, reduced integration, modified Newton, spectral radius 0.9"},
        runs,
    )  # fmt: skip


ALL: dict[str, Callable[[], PeerCase]] = {
    "strip": free_strip, "strip_contact": pressed_strip, "flexible_pendulum": flexible_pendulum, "heavy_top": heavy_top,
    "A01": pendulum, "A02": four_bars, "A04": bricard, "cantilever": cantilever, "film_modes": film_modes,
    "film_vibration": film_vibration,
}  # fmt: skip
