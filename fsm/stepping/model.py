"""What a step asks of a model.

In Python these functions call the methods of the model. A kernel calls the kernels that `compiled_as` gives for a model of
arrays instead. Shapes are those of `fsm.system.System`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = [
    "accept", "damping_times", "factorise", "factorise_mass", "force", "longest_step", "mapped", "mass_times", "part_of_step", "parted",
    "renewed_force", "retract", "solve", "stiffness_times",
]  # fmt: skip


def force(model: Any, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Force h (nu,)."""
    return np.asarray(model.force(t, q, u))


def renewed_force(model: Any, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Force h (nu,); K and D at this state are those of all later calls."""
    return np.asarray(model.renewed_force(t, q, u))


def factorise(model: Any, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
    """Factorise S = K + (by_rate D + by_acceleration M) T, with T of the increment x (nu,) if `maps`, else the identity.

    False if S is singular.
    """
    return bool(model.factorise(by_rate, by_acceleration, x, maps))


def factorise_mass(model: Any) -> bool:
    """Factorise M. False if it is singular."""
    return bool(model.factorise_mass())


def solve(model: Any, right: np.ndarray) -> np.ndarray:
    """Solution (nu,) with the last factors."""
    return np.asarray(model.solve(right))


def mapped(model: Any, change: np.ndarray) -> np.ndarray:
    """The change (nu,) of x by an increment after x, with T of the last factors."""
    return np.asarray(model.mapped(change))


def retract(model: Any, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Configuration (nq,) after an increment."""
    return np.asarray(model.retract(q, x))


def mass_times(model: Any, vector: np.ndarray) -> np.ndarray:
    """M v."""
    return np.asarray(model.mass_times(vector))


def stiffness_times(model: Any, vector: np.ndarray) -> np.ndarray:
    """K v."""
    return np.asarray(model.stiffness_times(vector))


def damping_times(model: Any, vector: np.ndarray) -> np.ndarray:
    """D v."""
    return np.asarray(model.damping_times(vector))


def parted(model: Any) -> bool:
    """Whether contacts of the last tangent have opened; see `System.parted`."""
    return bool(model.parted())


def part_of_step(model: Any, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
    """1 if the model accepts the step, else the part of it that should be tried; see `System.objection`."""
    return float(model.part_of_step(t, q, u, step))


def longest_step(model: Any, t: float, q: np.ndarray, u: np.ndarray) -> float:
    """Longest step from an accepted state, s; see `System.longest_step`."""
    return float(model.longest_step(t, q, u))


def accept(model: Any, t: float, q: np.ndarray, u: np.ndarray) -> float:
    """Accept a state, and give the longest step from it, s; see `System.commit`."""
    return float(model.accept(t, q, u))
