"""Restart points: steps at which a solve resets its internal data, so that a restart gives equal results.

A solve stores more than its state: tangents of earlier steps, contact search lists, matrix patterns. These data change
results only within round-off and tolerances, but a solve that continues from a file does not have them. Every solve
therefore drops these data at fixed step numbers. A restart from such a step gives the results of an uninterrupted solve
to the last bit.
"""

from __future__ import annotations

import numpy as np

from fsm.solve.interface.records import DriveState, Energy, Observation, PairState

State = dict[str, np.ndarray]
"""Restart data besides time, q and u, by name."""

_MOST, _FEWEST = 64, 8
"""Smallest number of steps between restart points: a new tangent costs one to two steps of an array of 300 units."""
_WORK = 60_000
"""Steps between restart points times number of velocities: one or two seconds (a film of 5600: 0.2 s per step)."""
MOST_OF_PATHS = 512
"""Largest number of steps of a quasi-static path between restart points; one of them takes as long as some ten steps."""


def steps_between(nu: int, most: int = _MOST) -> int:
    """Steps between restart points of a system with nu velocities."""
    return min(most, max(_FEWEST, _WORK // max(nu, 1)))


def observation_state(observed: Observation) -> State:
    """An observation as arrays."""
    energy, pairs = observed.energy, observed.pairs
    powers = energy.kinetic, energy.dissipated_power, energy.input_power, energy.sliding_power, energy.driven
    return {
        "seen_travel": observed.drive.travel,
        "seen_force": observed.drive.force,
        "seen_potential": np.array(list(energy.potential.values())),
        "seen_powers": np.array([*powers, observed.reaction]),
        "seen_pair_power": energy.pair_power,
        "seen_pairs": np.array(list(vars(pairs).values())),
    }


def observation_from(state: State, stored_by: list[str]) -> Observation:
    """Observation from arrays; `stored_by` names the kinds of potential energy."""
    kinetic, dissipated, power, sliding, driven, reaction = state["seen_powers"].tolist()
    potential = dict(zip(stored_by, state["seen_potential"].tolist(), strict=True))
    energy = Energy(kinetic, potential, dissipated, power, state["seen_pair_power"], sliding, driven)
    drive = DriveState(state["seen_travel"], state["seen_force"])
    return Observation(drive, energy, reaction, PairState(*state["seen_pairs"]))
