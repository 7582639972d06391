"""Renewal points: steps after which a solve is what one would be that goes on from a few arrays.

A solve keeps more than its state: tangents of earlier steps, lists of what is near, patterns of matrices. They change no
result by more than round-off and tolerances, but a solve that goes on from a file has none of them. So a solve drops them
at steps whose numbers are fixed, and only from there can another go on: to the bit as the one that never stopped.
"""

from __future__ import annotations

import numpy as np

from fsm.system import DriveState, Energy, Observation, PairState

__all__ = ["State", "observation_from", "observation_state", "steps_between"]

State = dict[str, np.ndarray]
"""What a solve goes on with besides time, q and u, by name."""

_MOST, _FEWEST = 64, 8
"""Fewer would cost: a tangent and its factors are what one to two steps of an array of 300 units take."""
_WORK = 60_000
"""Steps between renewal points times velocities: a second or two of work (a film of 5600 takes 0.2 s a step)."""


def steps_between(nu: int) -> int:
    """Steps from one renewal point to the next, of a system with so many velocities."""
    return min(_MOST, max(_FEWEST, _WORK // max(nu, 1)))


def observation_state(seen: Observation) -> State:
    """An observation as arrays."""
    energy, pairs = seen.energy, seen.pairs
    powers = energy.kinetic, energy.dissipated_power, energy.input_power, energy.sliding_power, energy.driven
    return {
        "seen_travel": seen.drive.travel,
        "seen_force": seen.drive.force,
        "seen_potential": np.array(list(energy.potential.values())),
        "seen_powers": np.array([*powers, seen.reaction]),
        "seen_pair_power": energy.pair_power,
        "seen_pairs": np.array(list(vars(pairs).values())),
    }


def observation_from(state: State, stored_by: list[str]) -> Observation:
    """The observation again; `stored_by` names what stores potential energy."""
    kinetic, dissipated, power, sliding, driven, reaction = state["seen_powers"].tolist()
    potential = dict(zip(stored_by, state["seen_potential"].tolist(), strict=True))
    energy = Energy(kinetic, potential, dissipated, power, state["seen_pair_power"], sliding, driven)
    drive = DriveState(state["seen_travel"], state["seen_force"])
    return Observation(drive, energy, reaction, PairState(*state["seen_pairs"]))
