"""Deployment of a strip, or the motion of a scene, by finite segments."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from fsm.analyses.beyond_data import beyond_data
from fsm.crossing import first_crossings, squares_meeting
from fsm.errors import FsmError
from fsm.prepare import path_settings, prepare
from fsm.results.array import ArrayMotion
from fsm.results.quantities import Curve, summarise, summarise_contacts
from fsm.results.solution import Layout, Solution
from fsm.scene.case import Case
from fsm.scene.choice import automatic_method
from fsm.segments.save_times import save_times
from fsm.solve.handed_over import Statistics
from fsm.solve.linear import LinearSolver
from fsm.solve.newton import equilibrium, negative_pivots
from fsm.solve.settings import Settings
from fsm.solve.static import PathSettings

__all__ = ["Deployment"]


_HOLD = 0.01
"""Part of the time of the pull for which its drives hold what is to vibrate: forces of dampers die away."""


class Deployment:
    """A strip or a scene, compiled; see `Analysis`.

    Parameters
    ----------
    case : Case
    source : file that faults are told of
    warnings : what was changed is added to it

    Attributes
    ----------
    scene : Scene
    system : SegmentSystem
    """

    def __init__(self, case: Case, source: str, warnings: list[str] | None) -> None:
        self.case = case
        self.scene, self.system = prepare(case, source, warnings)
        self._pivots = LinearSolver()

    @property
    def kernels(self) -> tuple[str, ...]:
        """See `Analysis`."""
        space, method = "spatial" if self.system.spatial else "planar", self.method()[0]
        if method == "Radau-blocks":
            return space, f"structured Radau, {space}"
        alone = method == "static" and self.system.settles() is not None
        return (space, f"springs alone, {space}") if alone else (space,)

    def make_ready(self, warnings: list[str]) -> None:
        """See `Analysis`; the scene has been checked whole."""

    def method(self) -> tuple[str, str]:
        """See `Analysis`."""
        chosen = self.case.solve.method
        return automatic_method(self.scene, bool(self.case.stages)) if chosen == "auto" else (chosen, "asked for")

    def settings(self, method: str) -> Settings | PathSettings:
        """See `Analysis`."""
        solve = self.case.solve
        end = self.system.end_time() if solve.end_time is None else solve.end_time
        assert end is not None
        if self.case.stages and solve.end_time is None:
            end *= 1.0 + _HOLD
        max_step = solve.max_step or math.inf
        if method != "static":
            settings = Settings(method, solve.rtol, end, max_step, solve.max_steps, solve.energy_abort, step=solve.step)
            return settings if solve.rho_inf is None else replace(settings, rho_inf=solve.rho_inf)
        return path_settings(self.case, self.system, end)

    def record_times(self, end: float) -> list[float]:
        """See `Analysis`."""
        return save_times(self.case, self.system.motions[0] if self.system.motions else None, end)

    def sample_times(self, end: float) -> list[float]:
        """See `Analysis`: no probes."""
        return []

    def start(self, warnings: list[str]) -> tuple[float, np.ndarray, np.ndarray]:
        """A strip whose creases are not at rest as folded starts from its equilibrium; other scenes start as given."""
        q, u = self.system.initial()
        residual = float(np.abs(self.system.force(0.0, q, u)).max(initial=0.0))
        if self.case.strip is not None and residual >= 1e-9:
            try:
                q = equilibrium(self.system, q, np.array([0.0]))
            except FsmError as error:
                warnings.append(f"not in equilibrium at the start, and none was found: {error}")
        return 0.0, q, u

    def layout(self) -> Layout:
        """See `Analysis`."""
        bodies = self.system.bodies
        return Layout(
            dimension="spatial" if self.system.spatial else "planar",
            body_names=tuple(bodies.names[i] for i in bodies.free),
            panel=np.array([panel for _, _, panel in bodies.plates], dtype=np.int64),
            pair_names=self.system.pair_names,
            drive_names=tuple(" + ".join(bodies.names[body] for body in motion.bodies) for motion in self.system.motions),
            thickness=max((plate.thickness for _, plate, _ in bodies.plates), default=0.0),
        )

    def probes(self, q: np.ndarray) -> np.ndarray:
        """See `Analysis`."""
        return np.zeros((0, 3))

    def unstable_ways(self, t: float, q: np.ndarray) -> int:
        """None without a drive, since a free motion passes no equilibria."""
        return negative_pivots(self.system, t, q, self._pivots) if self.system.motions else 0

    def array_motion(self, solution: Solution, warnings: list[str]) -> ArrayMotion | None:
        """See `Analysis`."""
        return None

    def own_solver(self) -> None:
        """See `Analysis`."""
        return None

    def summarise(self, solution: Solution, statistics: Statistics) -> dict[str, Any]:
        """Peak, stages and contacts."""
        summary: dict[str, Any] = {}
        if solution.travel.shape[1]:
            summary |= summarise(_fine_curve(solution, statistics), solution.layout.pair_names)
        looked_at = np.array([forces for _, forces in statistics.seen])
        summary["contact"] = summarise_contacts(solution, looked_at, summary.get("touches", ()))
        summary["contact_stats"] = self.system.contacts.stats()
        return summary

    def warnings(self, solution: Solution, summary: dict[str, Any]) -> list[str]:
        """Snaps, deep contacts, panels that cross, creases beyond their data, a pull that is not slow, a peak at the end."""
        found = []
        if summary["unstable_equilibria"]:
            first = float(solution.travel[np.argmax(solution.negative_pivots > 0), 0]) if solution.travel.size else 0.0
            found.append(
                f"{summary['unstable_equilibria']} saved states have an unstable tangent, the first at {1e3 * first:.4g} "
                "mm: the strip snaps there, and its path depends on inertia and damping"
            )
        thickness = solution.layout.thickness
        if solution.pair_gap.size and -solution.pair_gap.min() > 0.2 * thickness > 0.0:
            pair = solution.layout.pair_names[int(np.argmin(solution.pair_gap.min(axis=0)))]
            found.append(
                f"faces of {pair} penetrate by {-1e3 * solution.pair_gap.min():.3g} mm, more than a fifth of the thickness; "
                "raise contact.stiffness"
            )
        for first_panel, second_panel, travel in first_crossings(solution, self.scene):
            found.append(
                f"panels {first_panel} and {second_panel} pass through each other from {1e3 * travel:.4g} mm of travel on: "
                "they are not a contact pair, and the result beyond is not physical"
            )
        meeting = squares_meeting(solution, self.scene)
        if meeting:
            found.append(meeting)
        return found + beyond_data(solution, self.scene, self.system) + _of_the_pull(solution, summary)


def _fine_curve(solution: Solution, statistics: Statistics) -> Curve:
    """Records and every point looked at on the way, so that peak and stages do not depend on what is saved."""
    looked_at = Curve(
        np.array([drive.travel[0] for drive, _ in statistics.seen]),
        np.array([drive.force[0] for drive, _ in statistics.seen]),
        np.array([pairs for _, pairs in statistics.seen]).reshape(len(statistics.seen), solution.pair_force.shape[1]),
    )
    return Curve.of(solution).merged(looked_at)


def _of_the_pull(solution: Solution, summary: dict[str, Any]) -> list[str]:
    """Whether the pull was slow, and its peak passed."""
    found: list[str] = []
    if not solution.travel.size:
        return found
    elastic = np.maximum.accumulate(solution.energy["panels"] + solution.energy["creases"])
    moving = solution.energy["kinetic"] > 0.01 * elastic
    moving &= solution.travel[:, 0] > 0.02 * solution.travel[-1, 0]
    if moving.any():
        at = float(solution.travel[np.argmax(moving), 0])
        found.append(f"not quasi-static at {1e3 * at:.4g} mm: the kinetic energy is over 1 % of the elastic; pull slower")
    if summary["peak_travel"] > 0.999 * solution.travel[-1, 0]:
        found.append("the force is still rising at the end of the travel; the peak may lie beyond it")
    return found
