"""One case from description to files: the glue between scene, compiler, solver, results and plots."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fsm.errors import ExpectationFailed
from fsm.kernels import jit
from fsm.plots.contact_map import plot_contact_map
from fsm.plots.energy import plot_energy
from fsm.plots.force import plot_force
from fsm.plots.motion import plot_motion
from fsm.prepare import prepare
from fsm.recorder import RecordedSolve
from fsm.results.export import write_contact_csv, write_force_csv
from fsm.results.quantities import touching_pairs
from fsm.results.solution import Solution
from fsm.scene.builders.warm_up import warm_up_lattice, warm_up_plates, warm_up_strip
from fsm.scene.load_case import LoadedCase
from fsm.solve.newton import negative_pivots
from fsm.solve.simulate import Settings, simulate
from fsm.solve.static import PathSettings, follow
from fsm.summary import check_expectations, missed_expectations

__all__ = ["run_case", "warm_up"]

def run_case(
    loaded: LoadedCase, out: Path, *, progress: bool | Callable[[float], None] = True, resume: bool = False
) -> dict[str, Any]:
    """Run a case and write result.h5, summary.json, force.csv, force.png, motion.png and energy.png into `out`.

    With a contact that carries force in a record, contact.csv and contact.png as well.

    Parameters
    ----------
    loaded : LoadedCase
    out : folder for the results, made if needed
    progress : bool or callable
        A bar on standard error, or called with the fraction done.
    resume : bool
        Go on from the last checkpoint in `out` if there is one of this very case; steps and times in the
        summary are then those of the last part.

    Returns
    -------
    dict
        What summary.json holds.

    Raises
    ------
    CaseError
        Nothing has been written.
    NotConverged, EnergyAbort
        What was solved until then is in result.part.h5.
    ExpectationFailed
        Everything has been written.
    KeyboardInterrupt
        A checkpoint has been written.
    """
    begun = time.perf_counter()
    compiled = jit.compile_time()
    warnings: list[str] = []
    scene, system = prepare(loaded.case, str(loaded.path), warnings)
    check_expectations(loaded)
    out.mkdir(parents=True, exist_ok=True)
    solution = RecordedSolve(loaded, scene, system, out, resume, warnings).run(progress, begun, compiled)
    _write(solution, out)
    summary = solution.summary
    failed = missed_expectations(loaded.case, summary)
    if failed:
        raise ExpectationFailed("\n".join(failed))
    return summary


def warm_up(spatial: bool = False, plates: bool = True) -> None:
    """Compile (or load) every kernel a run needs, by solving the first instants of a small strip, and of rigid plates.

    Parameters
    ----------
    spatial : bool
    plates : bool
        False leaves out contact of rigid plates and obstacles.
    """
    cases = [warm_up_strip(spatial), *([warm_up_plates(spatial)] if plates else [])]
    for warm in [*cases, *([] if spatial else [warm_up_lattice()])]:
        _, system = prepare(warm.case)
        q, u = system.initial()
        end = 1e-3 * (system.end_time() or 1.0)
        for method in ("Radau", "Radau-blocks", "generalized-alpha"):
            simulate(system, Settings(method, 1e-3, end), [0.0, end], lambda saved: None)
        if system.motions:
            follow(system, PathSettings(end, end / 2.0), [0.0, end], lambda saved: None)
            negative_pivots(system, 0.0, q)
        pushed = np.zeros((system.n_free, system.size))
        moved = [system.bodies.names[i].startswith(warm.moved) for i in system.bodies.free]
        pushed[moved, 0], pushed[moved, 2 if system.size == 6 else 1] = warm.shift
        touching = system.retract(q, pushed.ravel())
        system.tangent(0.0, touching, u)
        system.observe(0.0, touching, u)


def _write(solution: Solution, out: Path) -> None:
    """Curve, plots, and summary.json last and whole, so that its presence means the case is done."""
    write_force_csv(solution, out / "force.csv")
    if solution.travel.shape[1]:
        plot_force(solution, out / "force.png")
    plot_motion(solution, out / "motion.png")
    plot_energy(solution, out / "energy.png")
    contact = out / "contact.csv", out / "contact.png"
    if touching_pairs(solution.pair_force):
        write_contact_csv(solution, contact[0])
        plot_contact_map(solution, contact[1])
    else:  # those of another run in this folder
        for path in contact:
            path.unlink(missing_ok=True)
    partial = out / "summary.json.part"
    partial.write_text(json.dumps(solution.summary, indent=2) + "\n", encoding="utf-8")
    os.replace(partial, out / "summary.json")
