"""Pendulum, linkages and top, of rigid bodies: runs of both programs; without Exudyn, of fsm only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fsm.solve.settings import Settings
from validation.peers import bounce, rigid
from validation.peers.common import EXUDYN, THERE, rms
from validation.peers.sweep import FSM, PEER, PeerCase, Run, timed

__all__ = ["bouncing_stack", "bricard", "four_bars", "heavy_top", "pendulum", "wing"]


def _fsm_rigid(
    model: Callable, reference: np.ndarray, times: np.ndarray, steps: tuple[float, ...], rtols: tuple[float, ...],
    size: float = 1.0, joints: bool = True,
) -> list[Run]:  # fmt: skip
    runs: list[Run] = []
    end = float(times[-1])
    system, shown = model()
    alpha = "generalized-alpha"
    settings = [(alpha, f"h = {1e3 * h:g} ms", Settings(alpha, 1e-3, end, step=h)) for h in steps]
    controlled = (alpha, "explicit") if joints else (alpha, "Radau-blocks")
    settings += [
        (f"{method}, error control", f"rtol {r:g}", Settings(method, r, end)) for method in controlled for r in rtols
    ]
    for method, name, setting in settings:

        def solve(setting: Settings = setting) -> tuple[float, float]:
            taken, path = timed(lambda: rigid.run_model(system, setting, times, shown))
            return taken, rms(path, reference, size)  # type: ignore[arg-type]

        runs.append(Run(FSM, method, name, solve))
    return runs


def _exudyn_rigid(method: str, make: Callable, reference: np.ndarray, times: np.ndarray, **sweep: Any) -> list[Run]:
    """`sweep` contains `steps`, the `size` of errors, and further settings of a `Stepping`."""
    from validation.peers.exudyn_rigid import Stepping, solve

    runs = []
    steps, size = sweep.pop("steps"), sweep.pop("size", 1.0)
    for step in steps:
        made: list[Any] = []

        def run(made: list[Any] = made, step: float = step) -> tuple[float, float]:
            if not made:
                made.extend(make())
            mbs, sensor, shown = made
            taken, seen = solve(mbs, sensor, Stepping(step, **sweep), times)
            return taken, rms(shown(seen), reference, size)

        runs.append(Run(PEER, method, f"h = {1e3 * step:g} ms", run))
    return runs


_FINE = (0.025, 0.0125, 0.01, 0.005, 0.0025)
_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)


def pendulum() -> PeerCase:
    """IFToMM A01."""

    def runs() -> list[Run]:
        path = rigid.pendulum_path()
        found = _fsm_rigid(rigid.pendulum_model, path, rigid.TIMES, (0.025, 0.01, 0.005), _TOLERANCES)
        if THERE:
            from validation.peers import exudyn_rigid as peer

            found += _exudyn_rigid(
                "constraint, generalised alpha", peer.pendulum, path, rigid.TIMES, steps=_FINE, modified=False
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
        {FSM: "a body of the same equation of motion (centre at 0.75 m, 0.1875 kg m²), a revolute joint",
         PEER: f"{EXUDYN}; dense, full Newton (modified is slower here); mass point and distance, or one link of a "
         "kinematic tree"},
        runs,
    )  # fmt: skip


def four_bars() -> PeerCase:
    """IFToMM A02."""

    def runs() -> list[Run]:
        path = rigid.four_bars_path()
        found = _fsm_rigid(rigid.four_bars_model, path, rigid.TIMES, (0.01, 0.0025), _TOLERANCES)
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
        {FSM: "revolute joints in space", PEER: f"{EXUDYN}; dense, planar bodies, revolute joints"},
        runs,
    )  # fmt: skip


def bricard() -> PeerCase:
    """IFToMM A04."""

    def runs() -> list[Run]:
        path = rigid.bricard_path()
        found = _fsm_rigid(rigid.bricard_model, path, rigid.TIMES, (0.025, 0.01, 0.005), _TOLERANCES)
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
        {FSM: "revolute joints",
         PEER: f"{EXUDYN}; Euler parameters, modified Newton (full takes three times as long), the redundant "
         "constraint left out"},
        runs,
    )  # fmt: skip


def heavy_top() -> PeerCase:
    """The heavy top."""

    def runs() -> list[Run]:
        path, times = rigid.top_path(), rigid.TOP_TIMES
        found = _fsm_rigid(rigid.top_model, path, times, (2.5e-3, 1e-3, 5e-4), _TOLERANCES)
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
        {FSM: "a spherical joint",
         PEER: f"{EXUDYN}; dense, modified Newton; Euler parameters and a spherical joint, or a Lie group and the inertia "
         "about the fixed point"},
        runs,
    )  # fmt: skip


def wing() -> PeerCase:
    """A wing of six panels."""

    def runs() -> list[Run]:
        path, size = rigid.wing_path(), rigid.WING.length
        found = _fsm_rigid(rigid.wing_model, path, rigid.TIMES, (0.025, 0.01, 0.005), _TOLERANCES, size)
        if THERE:
            from validation.peers import exudyn_rigid as peer

            for modified in (False, True):
                name = f"constraints, generalised alpha, {'modified' if modified else 'full'} Newton"
                found += _exudyn_rigid(name, peer.wing, path, rigid.TIMES, steps=_FINE, modified=modified, size=size)
        return found

    return PeerCase(
        "wing", f"wing of {rigid.WING.panels} panels on hinges with springs and dampers, which unfold, 10 s",
        "centre of the last panel at 20 times, RMS over a panel; equations of the panels' directions by DOP853 at 1e-11.",
        {FSM: "revolute joints in space", PEER: f"{EXUDYN}; dense, planar bodies, revolute joints"},
        runs,
    )  # fmt: skip


def bouncing_stack() -> PeerCase:
    """Balls that fall on a fixed ball and on each other, with contact by Hertz's law."""

    def runs() -> list[Run]:
        path, steps = bounce.bounce_path(), (1e-4, 5e-5)
        found = _fsm_rigid(
            bounce.bounce_model, path, bounce.BOUNCE_TIMES, steps, (1e-3,), size=bounce.RADIUS, joints=False,
        )  # fmt: skip
        if THERE:
            from validation.peers import exudyn_bounce as peer

            for modified in (False, True):
                name = f"generalised alpha, {'modified' if modified else 'full'} Newton"
                found += _exudyn_rigid(
                    name, peer.bounce, path, bounce.BOUNCE_TIMES, steps=steps, modified=modified, smooth=True,
                    size=bounce.RADIUS,
                )  # fmt: skip
        return found

    return PeerCase(
        "bouncing_stack", f"{bounce.BALLS} balls that bounce on a fixed ball and on each other, in space, 0.1 s",
        "height of the highest ball at 5 times, RMS over the radius; equations of the heights by DOP853 at 1e-11.",
        {FSM: "rigid bodies with spheres, N = K d^1.5 without damping",
         PEER: f"{EXUDYN}; dense, rigid bodies with Rxyz angles, sphere-sphere contacts of the same law, without iterations "
         "for discontinuous forces, which fail at the first contact"},
        runs,
    )  # fmt: skip
