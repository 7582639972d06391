"""The pulled strip: runs of both programs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from fsm.model.compile.compile_case import compile_case
from validation.peers.common import EXUDYN, THERE
from validation.peers.strip import distance, static_path, strip_case
from validation.peers.sweep import FSM, PEER, PLAIN, PeerCase, Run, timed

__all__ = ["pressed_strip", "strip"]

DEFAULT = (
    "build without range checks, all else as it is by default: residual to 1e-8, Jacobian with the springs' geometric "
    "stiffness, a file of the solution; linear solver EXUdense (the default) or EigenSparse"
)


def _strip(segments: int, spatial: bool, contact: bool) -> list[Run]:
    overrides = ("material.damping=0",)
    _, system = compile_case(strip_case(segments, contact, spatial, overrides))
    reference: list[Any] = []

    def converged() -> Any:
        if not reference:
            if contact and THERE:
                from validation.peers.exudyn_strip import Bench, exudyn_converged

                reference.append(exudyn_converged(Bench(segments, 1, True), contact=True))
            else:
                reference.append(static_path(system, 1e-6))
        return reference[0]

    def fsm(rtol: float, first: float) -> tuple[float, float]:
        taken, curve = timed(lambda: static_path(system, rtol, first))
        return taken, distance(curve, converged())  # type: ignore[arg-type]

    runs = [
        Run(FSM, "static path", f"rtol {rtol:g}, first step {1e3 * first:g} mm", partial(fsm, rtol, first))
        for rtol in (1e-1, 1e-2, 5e-3, 1e-3, 1e-4)
        for first in (2e-3, 5e-3, 8e-3)
    ]
    if THERE:
        runs += _exudyn_strip(segments, spatial, contact, converged)
    return runs


def _exudyn_strip(segments: int, spatial: bool, contact: bool, converged: Callable[[], Any]) -> Iterator[Run]:
    from validation.peers.exudyn_model import ExudynSettings
    from validation.peers.exudyn_strip import exudyn_strip, plain_settings

    kinds: list[tuple[str, str, str, ExudynSettings]] = []
    newton = {"exact": contact, "relative": 1e-4 if contact else 1e-3, "planar": not spatial}
    for steps in (20, 28, 40, 56, 80, 112, 160) if contact else (5, 6, 7, 8, 9, 10, 14, 20):
        for modified in (False, True):
            static = ExudynSettings(steps, modified=modified, **newton)  # type: ignore[arg-type]
            kinds.append((PEER, "static, modified Newton" if modified else "static, full Newton", f"{steps} steps", static))
    end = compile_case(strip_case(segments))[1].motions[0].end_time
    for step in (0.5, 0.2, 0.1, 0.05) if contact else (2.0, 1.0):
        dynamic = ExudynSettings(round(end / step), not spatial, dynamic=True, relative=1e-4, radius=0.0, exact=contact)
        kinds.append((PEER, "generalised alpha", f"h = {step:g} s", dynamic))
    for name, plain in plain_settings(not spatial, end if contact else 0.0):
        kinds.append((PLAIN, f"{'generalised alpha' if contact else 'static'}, {plain.solver}", name.split(",")[0], plain))
    for tool, method, name, settings in kinds:
        model: list[Any] = []

        def solve(model: list[Any] = model, settings: ExudynSettings = settings) -> tuple[float, float]:
            if not model:
                model.append(exudyn_strip(segments, settings, contact))
            taken, curve = model[0].solve(time.process_time)
            return taken, distance(curve, converged())

        yield Run(tool, method, name, solve)


def strip(segments: int, spatial: bool) -> PeerCase:
    """The pulled strip without contact."""
    where = "space" if spatial else "plane"
    return PeerCase(
        f"strip_{segments}_{where}", f"pulled strip, no contact, {segments} segments per panel, {where}",
        "force against travel, RMS over the peak; fsm's path at rtol 1e-6, from which Exudyn's at 320 steps is 2e-6 off.",
        {FSM: "static path, no dampers", PEER: f"{'Rxyz angles' if spatial else 'planar bodies'}; {EXUDYN}; EigenSparse, "
         "full and modified Newton to 1e-3, Jacobian without the springs' geometric stiffness; dynamics at the speed of the "
         "case, spectral radius 0", PLAIN: f"20 load steps; {DEFAULT}"},
        partial(_strip, segments, spatial, False),
    )  # fmt: skip


def pressed_strip(segments: int) -> PeerCase:
    """The pulled strip with contact."""
    return PeerCase(
        f"strip_{segments}_contact", f"pulled strip, panels 3 and 4 touch, {segments} segments per panel, plane",
        "as without contact; Exudyn's half strip at 1280 steps, for both.",
        {FSM: "static path, no dampers, the whole strip", PEER: "half the strip against its mirror plane, Hertz springs at "
         "fsm's points in Exudyn's symbols (Exudyn has no contact of faces); full and modified Newton to 1e-4, whole "
         "Jacobian; otherwise as without contact", PLAIN: "the same half strip, springs whose force is a function in "
         f"Python, generalised alpha at the speed of the case, spectral radius 0.9, modified Newton; {DEFAULT}"},
        partial(_strip, segments, False, True),
    )  # fmt: skip
