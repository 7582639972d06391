"""Deployment of a scissor array with flexible or rigid bars."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from fsm.analyses.analysis import OneStep, StatedErrors, Watch
from fsm.analyses.array import compile_array
from fsm.analyses.comparison import Statement
from fsm.builders.scissor_bodies import build_bodies
from fsm.case.checks.check_scissor import default_holds
from fsm.case.derived.scissor import Array, array_at
from fsm.case.models.case import Case
from fsm.case.plan.record_count import record_count
from fsm.errors import FsmError
from fsm.model.compile.compile import compile_scene
from fsm.model.nodes.system.scissor_system import ScissorSystem
from fsm.model.system.system import SegmentSystem
from fsm.results.array import ArrayMotion, PointMotion, asynchronism, largest_differences
from fsm.results.solution import Layout, Solution
from fsm.solve.outcome.run_io import SavedState, Statistics
from fsm.solve.settings import RHO_INF, PathSettings, Settings
from fsm.solve.simulate import simulate

_RIGID_RTOL = 1e-6
"""Settings of the comparison with rigid bars."""
_UNSURE = 0.1
"""Error of the largest stress above which there is a warning."""


class ScissorArray(OneStep):
    """Compiled scissor array; see `Analysis`.

    Parameters
    ----------
    case : Case
    source : name of the file in messages

    Attributes
    ----------
    system : AncfSystem, or with rigid bars SegmentSystem
    array : Array
    """

    step_name = "deploy"
    system: ScissorSystem | SegmentSystem

    def __init__(self, case: Case, source: str) -> None:
        assert case.scissor is not None and case.bar is not None and case.material is not None
        self.case, self.source = case, source
        self.scissor = case.scissor
        self.array: Array = array_at(case.scissor, case.scissor.initial_angle)
        self.holds = case.hold or default_holds(case.scissor)
        self.system = (
            self._rigid() if case.scissor.rigid else self._flexible(case.scissor.elements_per_bar)
        )

    @property
    def kernels(self) -> tuple[str, ...]:
        """See `Analysis`; flexible bars are compared with rigid ones."""
        return ("rigid bars",) if self.scissor.rigid else ("bars", "rigid bars")

    def method(self) -> tuple[str, str]:
        """Radau for rigid bars with stiff hinges, else generalized-alpha."""
        chosen = self.case.solve.method
        if chosen != "auto":
            return chosen, "requested"
        if self.scissor.rigid:
            return "Radau-blocks", "rigid bars on stiff hinges: few long steps without numerical vibration"
        return "generalized-alpha", "bars that vibrate: second order, high frequencies damped by rho_inf"

    def settings(self, method: str) -> Settings | PathSettings:
        """See `Analysis`."""
        solve = self.case.solve
        assert solve.end_time is not None
        stepwise = method in ("generalized-alpha", "newmark")
        return Settings(
            method, solve.rtol, solve.end_time, solve.max_step or math.inf, solve.max_steps, solve.energy_abort,
            rho_inf=RHO_INF if solve.rho_inf is None else solve.rho_inf, step=solve.step if stepwise else None,
            # the method damps waves that the mesh does not resolve; only the end of the run checks this loss
            judge_losses=method != "generalized-alpha" or solve.step is not None,
        )  # fmt: skip

    def record_times(self, end: float) -> list[float]:
        """See `Analysis`."""
        interval = self.case.save.interval or end / self.case.save.number
        record_count(end, interval, "save.interval")
        count = max(1, round(end / interval))
        return [float(t) for t in np.linspace(0.0, end, count + 1)]

    def sample_times(self, end: float) -> list[float]:
        """See `Analysis`; the points are computed at the records."""
        return []

    def layout(self) -> Layout:
        """See `Analysis`."""
        quads = len(self.system.shape(0.0, self.system.initial()[0]))
        if isinstance(self.system, ScissorSystem):
            names = self.system.mesh.names
            bars = zip(self.array.bars, self.system.bars, strict=True)
            drawn = tuple(bar.name for bar, nodes in bars for _ in nodes.positions[1:])
        else:
            names = tuple(self.system.bodies.names[i] for i in self.system.bodies.free)
            drawn = self.system.quad_names
        assert self.case.bar is not None
        return Layout(
            dimension="planar", body_names=names, panel=np.zeros(quads, dtype=np.int64), thickness=self.case.bar.height,
            quad_names=drawn,
        )  # fmt: skip

    def array_motion(self, solution: Solution, warnings: list[str], watch: Watch | None = None) -> ArrayMotion:
        """Points and stresses at the records, compared with the same array with rigid bars."""
        names = tuple(sorted(self.array.points, key=lambda name: (name[0], int(name[1:]))))
        start = np.array([self.array.points[name] for name in names])
        bars = tuple(bar.name for bar in self.array.bars)
        if isinstance(self.system, ScissorSystem):
            system = self.system
            points = _flexible_motion(system, names, start, solution)
            stress = np.array([system.stress(q) for q in solution.q])
            error = self.stress_error(solution.time, stress, warnings, watch)
            rigid = self._comparison(names, start, solution.time, warnings, watch)
            return ArrayMotion(names, start, points, rigid, bars, stress, error)
        points = self._rigid_motion(self.system, names, start, solution.time, solution.q, solution.u)
        return ArrayMotion(names, start, points, None, bars, np.zeros((len(solution), 0)))

    def summarise(self, solution: Solution, statistics: Statistics) -> dict[str, Any]:
        """Differences from the array with rigid bars, loss of synchronism, and sizes."""
        motion = solution.array
        assert motion is not None
        apart = {name: float(np.abs(values).max()) for name, values in asynchronism(motion).items()}
        latches = self.system.latches if isinstance(self.system, ScissorSystem) else None
        latched = {} if latches is None else {"latched": [{"hinge": name, "time": t} for name, t in latches.events()]}
        return {
            "max_difference_rigid": largest_differences(motion),
            "max_asynchronism": apart,
            "max_stress": self._max_stress(motion.stress),
            "max_stress_error": motion.stress_error,
            "units": self.scissor.units,
            "elements_per_bar": 0 if self.scissor.rigid else self.scissor.elements_per_bar,
            **latched,
        }

    def stated_errors(self, solution: Solution, statistics: Statistics, summary: dict[str, Any]) -> StatedErrors:
        """See `Analysis`; the error of the stress is due to elements and steps together."""
        other = "; compare with another scissor.elements_per_bar"
        if self.scissor.rigid:
            mesh: Statement = {"by": "none: rigid bars have no mesh"}
        elif summary["max_stress_error"] is None:
            mesh = {"by": f"not estimated{other}"}
        else:
            by = "another mesh with larger steps; of positions not estimated"
            mesh = {"by": f"{by}{other}", "largest_stress": summary["max_stress_error"]}
        return {"mesh": mesh, "steps": {"by": "not estimated; compare with another solve.rtol or solve.step"}}

    def warnings(self, solution: Solution, summary: dict[str, Any]) -> list[str]:
        """Warnings on strains beyond the linear range, errors of the stress, and latches that have not closed."""
        found = []
        assert self.case.material is not None
        strain = summary["max_stress"] / self.case.material.young
        if strain > 0.05:
            found.append(
                f"largest strain of the bars {100.0 * strain:.2g} %, above 5 %: outside the linear range of most materials; "
                "reduce the load"
            )
        error = summary["max_stress_error"]
        if error is not None and error > _UNSURE:
            found.append(
                f"max_stress: error {100.0 * error:.2g} %, from a comparison of two meshes; raise scissor.elements_per_bar, "
                "or give [material] damping if waves cause it"
            )
        latches = self.system.latches if isinstance(self.system, ScissorSystem) else None
        if latches is not None and latches.open():
            found.append(f"not latched at the end: {', '.join(latches.open())}")
        return found

    def stress_error(
        self, times: np.ndarray, stress: np.ndarray, warnings: list[str], watch: Watch | None = None
    ) -> float | None:
        """Relative error of the largest stress, from the same array on another mesh with longer steps.

        The mesh has half as many elements per bar, or four in place of two. The tolerance rtol is ten times as large, and a
        fixed step is twice as large. The error is the larger of two numbers: the difference of the largest stresses, and a
        third of the largest difference in any bar at any time.
        """
        settings = self.settings(self.method()[0])
        assert isinstance(settings, Settings)
        if len(times) < 2:
            return None
        count = self.scissor.elements_per_bar
        other = self._flexible(max(2, count // 2) if count > 2 else 4)
        kept: list[np.ndarray] = []
        settings = replace(
            settings, end_time=float(times[-1]), energy_abort=math.inf, rtol=min(10.0 * settings.rtol, 1e-2),
            step=None if settings.step is None else 2.0 * settings.step,
        )  # fmt: skip
        try:
            simulate(
                other, settings, [float(t) for t in times], lambda saved: kept.append(other.stress(saved.q)),
                watch and watch("error of the stress", settings.end_time),
            )  # fmt: skip
        except FsmError as error:
            warnings.append(f"no error of max_stress: the solution with another mesh failed before the end: {error}")
            return None
        largest = self._max_stress(stress)
        if largest == 0.0:
            return None
        apart = np.abs(np.array(kept) - stress).max()
        return float(max(abs(other.largest.max() - largest), apart / 3.0) / largest)

    # inside ---------------------------------------------------------------------------------------------------------

    def _flexible(self, elements: int) -> ScissorSystem:
        case = self.case
        assert case.bar is not None and case.material is not None
        gravity = (case.gravity[0], case.gravity[1])
        return compile_array(
            self.scissor.model_copy(update={"elements_per_bar": elements}), case.bar, case.material, self.holds, case.force,
            case.hinge, case.stop, gravity,
        )  # fmt: skip

    def _rigid(self) -> SegmentSystem:
        case = self.case
        assert case.bar is not None and case.material is not None
        gravity = (case.gravity[0], case.gravity[1])
        return compile_scene(
            build_bodies(self.scissor, case.bar, case.material, self.holds, case.force, case.hinge, gravity)
        )

    def _max_stress(self, stress: np.ndarray) -> float:
        """Largest normal stress at the steps and at the records, Pa."""
        steps = self.system.largest.max(initial=0.0) if isinstance(self.system, ScissorSystem) else 0.0
        return float(max(steps, stress.max(initial=0.0)))

    def _comparison(
        self, names: tuple[str, ...], start: np.ndarray, times: np.ndarray, warnings: list[str], watch: Watch | None
    ) -> PointMotion | None:
        """Motion of the same array with rigid bars; None if rigid bars lack a property of the array, or if they
        lock.
        """
        hinge = self.case.hinge
        if self.case.stop is not None or (hinge is not None and hinge.friction_moment > 0.0):
            return None
        system = self._rigid()
        kept: list[tuple[np.ndarray, np.ndarray]] = []

        def keep(saved: SavedState) -> None:
            kept.append((saved.q, saved.u))

        settings = Settings("Radau-blocks", _RIGID_RTOL, float(times[-1]), max_steps=self.case.solve.max_steps)
        try:
            simulate(system, settings, [float(t) for t in times], keep, watch and watch("rigid bars", settings.end_time))
        except FsmError as error:
            warnings.append(f"no comparison with rigid bars, whose solution failed before the end: {error}")
            return None
        return self._rigid_motion(system, names, start, times, *(np.array(part) for part in zip(*kept, strict=True)))

    def _rigid_motion(
        self,
        system: SegmentSystem,
        names: tuple[str, ...],
        start: np.ndarray,
        times: np.ndarray,
        q: np.ndarray,
        u: np.ndarray,
    ) -> PointMotion:
        """Points of rigid bars; accelerations are the slopes of a spline through the velocities."""
        free = [system.bodies.names[i] for i in system.bodies.free]
        poses, rates = q.reshape(len(q), -1, 3), u.reshape(len(u), -1, 3)
        displacement, velocity = np.empty((len(q), len(names), 2)), np.empty((len(q), len(names), 2))
        for k, name in enumerate(names):
            bar = free.index(next(bar.name for bar in self.array.bars if name in bar.points))
            x, z, angle = poses[:, bar].T
            arm = start[k] - poses[0, bar, :2]
            turn = angle - angle[0]  # rotation about y, from z to x
            cosine, sine = np.cos(turn), np.sin(turn)
            across = np.stack([cosine * arm[0] + sine * arm[1], cosine * arm[1] - sine * arm[0]], axis=1)
            displacement[:, k] = np.stack([x, z], axis=1) + across - start[k]
            spin = rates[:, bar, 2:]
            velocity[:, k] = rates[:, bar, :2] + spin * np.stack([across[:, 1], -across[:, 0]], axis=1)
        acceleration = np.asarray(CubicSpline(times, velocity, axis=0).derivative()(times))
        return PointMotion(displacement, velocity, acceleration)


def _flexible_motion(system: ScissorSystem, names: tuple[str, ...], start: np.ndarray, solution: Solution) -> PointMotion:
    first = np.array([system.points[name] for name in names])
    where = first[:, None] + np.arange(2)
    accelerations = [system.acceleration(t, q, u) for t, q, u in zip(solution.time, solution.q, solution.u, strict=True)]
    return PointMotion(solution.q[:, where] - start, solution.u[:, where], np.array(accelerations)[:, where])
