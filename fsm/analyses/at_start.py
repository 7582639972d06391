"""Equilibrium that a solve starts from."""

from __future__ import annotations

import numpy as np

from fsm.errors import NotConverged
from fsm.solve.in_air import come_to_rest
from fsm.solve.newton import equilibrium, negative_pivots
from fsm.solve.relax import relaxed
from fsm.system import System

__all__ = ["equilibrium_at_start"]

_RESTING = 1e-12
"""Way to the equilibrium, over the size of an element or a radian, below which a configuration is one."""
_NEAR = 1.0
"""Way to an equilibrium, likewise, within which Newton's method alone is believed."""
_ITERATIONS = 300


def equilibrium_at_start(system: System, q: np.ndarray) -> np.ndarray:
    """Stable equilibrium at time zero near a configuration, or the configuration itself if it is one.

    Newton's method is believed nearby, where it ends in a stable state and nothing passed through a face on the way.
    Otherwise the energy is followed downhill (`fsm.solve.relax`), through no face, which ends in a stable state. Where that
    takes too long, as on heavy panels that swing far, a motion in air is followed until it has died, and then the energy.

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
    try:
        return _downhill(system, q)
    except NotConverged:
        pass
    try:
        _reset(system, q)
        return _downhill(system, come_to_rest(system, 0.0, q))
    except NotConverged as error:
        raise NotConverged(f"at the start: {error}; {advice}") from None


def _downhill(system: System, q: np.ndarray) -> np.ndarray:
    _reset(system, q)
    return relaxed(system, 0.0, q, max_iterations=_ITERATIONS, watched=True).q


def _reset(system: System, q: np.ndarray) -> None:
    """Begin anew at a configuration: nothing has touched, and bristles are not bent."""
    system.forget(np.zeros(0))
    system.restore(np.zeros(0))
    system.commit(0.0, q, np.zeros(system.nu))


def _reached(system: System, q: np.ndarray, found: np.ndarray) -> bool:
    """Whether nothing passed through a face between two configurations."""
    _reset(system, q)
    return system.objection(0.0, found, None, 1.0) is None
