"""Checks of the supply of gas over the time of a run. `fsm check` and `fsm run` use the same checks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.errors import Fault
from fsm.model.bodies.drive import time_function
from fsm.model.plan.planned import Plan
from fsm.text.shown_units import shown

_TIMES = 1001
"""Number of times at which the mass of a gas is computed, besides the points of its function of time."""
_NO_GAS = 1e-9
"""Round-off of this mass, relative to its maximum."""


def gas_faults(case: Case, scene: Scene, plan: Plan | None) -> Iterator[Fault]:
    """Faults of supplies that take out more gas than their chambers have.

    Chambers with orifices, and paths by arc length, are not checked: there the mass depends on the solution.
    """
    methods = {case.solve.method} if plan is None else {step.method for step in plan.steps}
    end = case.solve.end_time if plan is None else plan.steps[-1].end
    if scene.orifices or "arc-length" in methods or end is None:
        return
    for number, chamber in enumerate(scene.chambers):
        gas = chamber.gas
        key, size, program = "supply_mass", gas.supply_mass, time_function(gas.time)
        if gas.supply_flow is not None:
            key, size, program = "supply_flow", gas.supply_flow, program.integral()
        if size is None:
            continue
        first = gas.at_start * chamber.volume / (gas.gas_constant * gas.temperature)
        times = np.union1d(np.linspace(0.0, end, _TIMES), [t for t in program.breaks() if 0.0 < t < end])
        mass = first + size * np.array([program.at(t)[0] for t in times.tolist()])
        below = np.flatnonzero(mass < -_NO_GAS * np.abs(mass).max())
        if len(below):
            text = f"the chamber has {shown(first, 'kg')} at the start, and is empty before t = {times[below[0]]:.4g} s"
            yield Fault(f"gas.{number}.{key}", f"{text}; take out less gas, or give a larger `pressure` at the start")
