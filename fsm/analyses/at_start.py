"""Equilibrium that a solve starts from."""

from __future__ import annotations

import numpy as np

from fsm.errors import NotConverged
from fsm.solve.newton import equilibrium, negative_pivots
from fsm.solve.relax import relaxed
from fsm.system import System

__all__ = ["equilibrium_at_start"]

_RESTING = 1e-12
"""Way to the equilibrium, over the size of an element or a radian, below which a configuration is one."""
_NEAR = 1.0
"""Way to an equilibrium, likewise, within which Newton's method alone is believed."""
_ITERATIONS = 1000


def equilibrium_at_start(system: System, q: np.ndarray) -> np.ndarray:
    """Stable equilibrium at time zero near a configuration, or the configuration itself if it is one.

    Newton's method is believed nearby, where it ends in a stable state and nothing passed through a face on the way.
    Otherwise the energy is followed downhill (`fsm.solve.relax`), through no face, which ends in a stable state.

    Parameters
    ----------
    system : System
    q : (nq,) array

    Raises
    ------
    NotConverged
        No stable equilibrium is found.
    """
    size = system.scales().increment
    try:
        found = equilibrium(system, q, np.array([0.0]))
        way = float(np.abs(system.difference(q, found) / size).max(initial=0.0))
        if way <= _RESTING:
            return q
        if way <= _NEAR and not negative_pivots(system, 0.0, found) and _reached(system, q, found):
            return found
    except NotConverged:
        pass
    advice = 'start = "as-folded" lets the motion begin with inertia'
    system.forget(np.zeros(0))
    system.commit(0.0, q, np.zeros(system.nu))
    try:
        return relaxed(system, 0.0, q, max_iterations=_ITERATIONS, watched=True).q
    except NotConverged as error:
        raise NotConverged(f"at the start: {error}; {advice}") from None


def _reached(system: System, q: np.ndarray, found: np.ndarray) -> bool:
    """Whether nothing passed through a face between two configurations."""
    rest = np.zeros(system.nu)
    system.forget(np.zeros(0))
    system.commit(0.0, q, rest)
    return system.objection(0.0, found, None, 1.0) is None
