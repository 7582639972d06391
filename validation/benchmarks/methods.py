"""The solvers that are compared. A new solver is one line in `METHODS`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fsm.kernels import jit
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, SavedState, Statistics
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.simulate import simulate
from fsm.solve.statics.static import follow
from validation.benchmarks.problem import Problem

__all__ = ["METHODS", "QUICK_TOLERANCES", "Method", "Run", "TooSlow", "follower", "integrator"]

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
QUICK_TOLERANCES = (1e-3, 3e-4, 3e-5, 1e-5)

OnSave = Callable[[SavedState], None]
OnStep = Callable[[AcceptedStep], None]
Solve = Callable[[SegmentSystem, Problem, float, OnSave, OnStep], tuple[Statistics, EnergyBalance]]


class TooSlow(Exception):
    """The time limit of a run has passed before its end."""


@dataclass(frozen=True)
class Run:
    """Result of a run: processor and wall time (s), samples (one row for each saved time), and effort."""

    seconds: float
    wall: float
    values: np.ndarray
    steps: int = 0
    iterations: int = 0
    energy_error: float = math.nan


@dataclass(frozen=True)
class Method:
    """A solver.

    Attributes
    ----------
    name : name of the method in figures and for `--methods`
    solve : function that integrates or follows a system to the end of the problem at a given tolerance, and passes on saved
    states and steps
    applies : function that tells whether the method can solve a problem
    tolerances : from large to small; tolerances below the problem's `tightest` are skipped
    """

    name: str
    solve: Solve
    applies: Callable[[Problem], bool] = lambda problem: True
    tolerances: tuple[float, ...] = TOLERANCES

    def run(self, problem: Problem, tolerance: float, limit: float = math.inf) -> Run:
        """One run, which is repeated if a kernel had to be compiled during it.

        Raises
        ------
        TooSlow
            The limit of `limit` seconds of processor time has passed; the limit is checked at the end of each step.
        """
        while True:
            compiled = jit.compile_time()
            run = self._once(problem, tolerance, limit)
            if jit.compile_time() == compiled:
                return run

    def warm_up(self, problem: Problem) -> None:
        """Run the first steps, so that kernels are loaded; their result is not used."""
        short = replace(problem, times=(1e-3 * problem.end_time,))
        try:
            self._once(short, self.tolerances[0], limit=10.0)
        except Exception:  # if this fails, the measured run reports the failure
            return

    def _once(self, problem: Problem, tolerance: float, limit: float) -> Run:
        system = problem.system()
        values: list[np.ndarray] = []
        begun, begun_wall = time.process_time(), time.perf_counter()

        def check(_: object) -> None:
            if time.process_time() - begun > limit:
                raise TooSlow(f"not at the end after {limit:g} s")

        def save(saved: SavedState) -> None:
            values.append(problem.sample(saved))
            check(saved)

        statistics, energy_balance = self.solve(system, problem, tolerance, save, check)
        seconds, wall = time.process_time() - begun, time.perf_counter() - begun_wall
        if len(values) != len(problem.times):
            raise RuntimeError(f"{len(values)} states saved, {len(problem.times)} asked for")
        return Run(
            seconds, wall, np.array(values), statistics.steps, statistics.newton_iterations, energy_balance.relative_error
        )


def integrator(name: str, tolerances: tuple[float, ...] = TOLERANCES) -> Method:
    """A time integrator by its name in `Settings.method`, for any scene."""

    def solve(
        system: SegmentSystem, problem: Problem, tolerance: float, on_save: OnSave, on_step: OnStep
    ) -> tuple[Statistics, EnergyBalance]:
        return simulate(system, Settings(name, tolerance, problem.end_time), list(problem.times), on_save, on_step)

    return Method(name, solve, tolerances=tolerances)


def follower(tolerances: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)) -> Method:
    """The quasi-static path follower; the follower applies to static problems."""

    def solve(
        system: SegmentSystem, problem: Problem, tolerance: float, on_save: OnSave, on_step: OnStep
    ) -> tuple[Statistics, EnergyBalance]:
        settings = PathSettings(problem.end_time, first_step=1e-3 * problem.end_time, rtol=tolerance)
        return follow(system, settings, list(problem.times), on_save, on_step)

    return Method("static", solve, lambda problem: problem.static, tolerances)


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        integrator("Radau"),
        integrator("BDF"),
        integrator("LSODA"),
        integrator("generalized-alpha"),
        follower(),
        # new solvers are added here, for example integrator("Radau (structured)")
    )
}
"""All methods by name, in the order of the colours."""
