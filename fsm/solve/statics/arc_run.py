"""Path of equilibria by arc length as a step of a run: records, work, force curve, and loads over displacements.

Loads and drives are functions of the program time, which may decrease on such a path. Records have a different time.
This time increases with the length of the path and ends with the step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fsm.errors import NotConverged
from fsm.solve.equations.newton import equilibrium, held_still
from fsm.solve.interface.records import Observation
from fsm.solve.outcome.energy_balance import EnergyBalance, load_work
from fsm.solve.outcome.run_io import CurvePoint, SavedState, Statistics
from fsm.solve.statics.arc_length import ArcSettings, PathPoint, trace


class ArcRun:
    """Path of equilibria by arc length.

    Parameters
    ----------
    system : system with the method `load_displacements`
    settings : ArcSettings
    energy_balance, points : energy balance and curve, to which all points are added

    Attributes
    ----------
    saved : all points as states to be saved
    loads : at each point the length, program time, number of negative modes, and size and displacement of every load, as
    lists by name
    warnings : list of str
    """

    def __init__(self, system: Any, settings: ArcSettings, energy_balance: EnergyBalance, points: list[CurvePoint]) -> None:
        self.system, self.settings, self.energy_balance = system, settings, energy_balance
        self.statistics = Statistics("arc-length", points=points)
        self.saved: list[SavedState] = []
        self.loads: dict[str, Any] = {}
        self.warnings: list[str] = []

    def go(self, start: float, q: np.ndarray, on_point: Callable[[float, int], None]) -> np.ndarray:
        """Follow the path from an equilibrium at a time (s), and return the configuration at its end."""
        settings, system = self.settings, self.system
        at_rest = np.zeros(system.nu)
        system.clear_caches(np.zeros(0))
        q = self._settled(start, held_still(system, start, q))
        points: list[PathPoint] = []
        memories: list[np.ndarray] = []
        lowest = 2.0 * start - settings.end_time  # loads may change their sign and grow to their full size
        for point in trace(
            system, q, start, settings.end_time, settings.first, settings.longest, settings.max_steps, lowest=lowest,
            side=settings.side,
        ):
            system.commit(point.time, point.q, at_rest)
            points.append(point)
            memories.append(system.memory())
            on_point(min(max(point.time, start), settings.end_time), len(points))
        self._account(start, points, memories)
        self.statistics.steps = len(points) - 1
        self.statistics.newton_iterations = sum(point.iterations for point in points)
        last = points[-1]
        unstable = [point.time for point in points if point.negative_pivots]
        if unstable:
            self.warnings.append(
                f"arc-length: {len(unstable)} of {len(points)} equilibria are unstable, the first at a program time of "
                f"{unstable[0]:.4g} s; under prescribed loads the structure snaps from there (load.csv, load.png)"
            )
        if last.time < settings.end_time:
            self.warnings.append(
                f"arc-length: the path ended before the program time {settings.end_time:.4g} s of its step: the loads "
                f"decreased after a program time of {max(p.time for p in points):.4g} s, then changed sign and reached "
                "their full size"
            )
        return last.q

    def _settled(self, t: float, q: np.ndarray) -> np.ndarray:
        """Equilibrium near the start, stable or not. A loss of stored energy is dissipated, and a gain is external work."""
        try:
            found = equilibrium(self.system, q, np.array([t]))
        except NotConverged as error:
            text = f"arc-length: the start is not in equilibrium, and no equilibrium is found near it: {error}"
            raise NotConverged(f'{text}; add a step with kind = "relax" before') from None
        before, after = (self.system.energy(t, state, None).stored_at_rest for state in (q, found))
        self.energy_balance.dissipated += max(before - after, 0.0)
        self.energy_balance.work += max(after - before, 0.0)
        return found

    def _account(self, start: float, points: list[PathPoint], memories: list[np.ndarray]) -> None:
        """Compute the records, work and loads of all points."""
        system, energy_balance = self.system, self.energy_balance
        at_rest = np.zeros(system.nu)
        whole = points[-1].length or 1.0
        before: tuple[PathPoint, Observation] | None = None
        ways: dict[str, list[list[float]]] = {}
        for point, memory in zip(points, memories, strict=True):
            system.restore(memory)
            observed = system.observe(point.time, point.q, None)
            if before is not None:
                energy_balance.add(self._work(before, (point, observed)), 0.0, np.zeros_like(observed.energy.pair_power))
            energy_balance.balance(observed.energy.stored_at_rest, 0.0)
            time = start + (self.settings.end_time - start) * point.length / whole
            curve = self.statistics.points
            curve.append(CurvePoint.after(curve, time, observed, dynamic=False))
            self.saved.append(
                SavedState(
                    time, point.q, at_rest, observed, energy_balance.dissipated, energy_balance.work, energy_balance.error,
                    energy_balance.pair_energy,
                    program_time=point.time, at_rest=True, negative_pivots=point.negative_pivots, memory=memory,
                    numerical=energy_balance.numerical,
                )
            )  # fmt: skip
            loads = system.load_displacements((points[0].time, points[0].q), (point.time, point.q))
            for name, (size, way) in loads.items():
                ways.setdefault(name, []).append([size, way])
            before = point, observed
        self.loads = {
            "length": [point.length for point in points],
            "time": [point.time for point in points],
            "negative_modes": [point.negative_pivots for point in points],
            "loads": ways,
        }

    def _work(self, before: tuple[PathPoint, Observation], after: tuple[PathPoint, Observation]) -> float:
        """Work of loads and drives between two points by the trapezoidal rule, J."""
        (one, observed), (two, observed_next) = before, after
        loads = load_work(self.system, (one.time, one.q), (two.time, two.q))
        forces = 0.5 * (observed.drive.force + observed_next.drive.force)
        return loads + float(forces @ (observed_next.drive.travel - observed.drive.travel))
