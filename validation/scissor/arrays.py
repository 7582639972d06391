"""Arrays of the checks: three steel units under a force at a1, as in folding_cases/scissor_array."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from fsm.analyses.array import compile_array
from fsm.case.checks.check_scissor import default_holds
from fsm.case.models.materials import Material
from fsm.case.models.scissor import BarSection, PointForce, Scissor
from fsm.case.models.time_program import Ramp
from fsm.model.nodes.system.scissor_system import ScissorSystem
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

__all__ = ["BAR", "START", "STEEL", "History", "move", "rigid_angle", "steel_array"]

BAR = BarSection(width=0.02, height=0.012)
STEEL = Material(young=2.07e11, poisson=0.0, density=7850.0, damping=0.0)
START = math.radians(75.0)
PUSH = -50.0


@dataclass(frozen=True, eq=False)
class History:
    """A motion: times (s), states, energy balance, duration of the solve (s), steps."""

    system: ScissorSystem
    times: np.ndarray
    q: np.ndarray
    u: np.ndarray
    energy_balance: EnergyBalance
    wall: float
    steps: int

    def place(self, point: str, axis: int) -> np.ndarray:
        """Coordinate of a point over time, m."""
        return np.asarray(self.q[:, self.system.points[point] + axis])

    def acceleration(self, point: str, axis: int) -> np.ndarray:
        """Acceleration of a point over time, m/s^2."""
        at = self.system.points[point] + axis
        return np.array(
            [self.system.acceleration(t, q, u)[at] for t, q, u in zip(self.times, self.q, self.u, strict=True)]
        )


def steel_array(units: int, ramp: float, elements: int = 4, element: str = "section", stiffer: float = 1.0) -> ScissorSystem:
    """Units with bars of 1 m at 75 degrees; the force grows over `ramp` s (0: suddenly)."""
    scissor = Scissor(
        units=units, bar_length=1.0, initial_angle=START, elements_per_bar=elements, element=element
    )  # type: ignore[arg-type]
    loading = {"time": Ramp(kind="ramp", end=ramp)} if ramp else {}
    force = PointForce(point="a1", force=(0.0, PUSH), **loading)  # type: ignore[arg-type]
    material = STEEL.model_copy(update={"young": stiffer * STEEL.young})
    return compile_array(scissor, BAR, material, default_holds(scissor), (force,))


def move(system: ScissorSystem, end: float, step: float, count: int = 150, rho_inf: float = 0.6) -> History:
    """The motion until `end`, at `count` equally spaced times."""
    times = np.linspace(0.0, end, count + 1)
    kept: list[tuple[np.ndarray, np.ndarray]] = []
    settings = Settings("generalized-alpha", 1e-4, end, rho_inf=rho_inf, step=step)
    begin = time.perf_counter()
    statistics, energy_balance = simulate(system, settings, list(times), lambda saved: kept.append((saved.q, saved.u)))
    wall = time.perf_counter() - begin
    q, u = (np.array(part) for part in zip(*kept, strict=True))
    return History(system, times, q, u, energy_balance, wall, statistics.steps)


def rigid_angle(units: int, times: np.ndarray, ramp: float) -> np.ndarray:
    """Angle of rigid bars by Lagrange's equation of the straight array, rad."""
    from scipy.integrate import solve_ivp

    mass = STEEL.density * BAR.width * BAR.height
    inertia = mass / 12.0 * (1.0 + BAR.height**2)
    k = np.arange(units) + 0.5

    def rates(t: float, y: np.ndarray) -> tuple[float, float]:
        x = min(t / ramp, 1.0) if ramp else 1.0
        inertias = 2.0 * mass * np.sum((k * math.sin(y[0])) ** 2 + (0.5 * math.cos(y[0])) ** 2) + 2.0 * units * inertia
        slope = 4.0 * mass * math.sin(y[0]) * math.cos(y[0]) * np.sum(k**2 - 0.25)
        return y[1], (PUSH * x * x * (3.0 - 2.0 * x) * math.cos(y[0]) - 0.5 * slope * y[1] ** 2) / inertias

    found = solve_ivp(rates, (0.0, times[-1]), [START, 0.0], method="DOP853", rtol=1e-11, atol=1e-12, t_eval=times)
    return np.asarray(found.y[0])
