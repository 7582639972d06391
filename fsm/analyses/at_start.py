"""Equilibrium at the start of a solve."""

from __future__ import annotations

import numpy as np

from fsm.errors import NotConverged
from fsm.solve.equations.equilibrium_step import Ending, EquilibriumStep
from fsm.solve.equations.newton import at_rest, equilibrium, held_still, negative_pivots
from fsm.solve.interface.system import System
from fsm.solve.stepping.quasi_static import BEFORE

_RESTING = 1e-12
"""Distance to the equilibrium, relative to the size of an element or a radian, below which a configuration counts as the
equilibrium."""
_NEAR = 1.0
"""Largest such distance for which the result of Newton's method alone is accepted."""
_ITERATIONS = 3000


def equilibrium_at_start(system: System, q: np.ndarray, t: float = 0.0) -> np.ndarray:
    """Stable equilibrium at a time near a configuration, or the configuration itself if it is one.

    The result of Newton's method is accepted if it is near and stable and no body has passed through a face. Otherwise the
    energy is minimised without passing through faces (`fsm.solve.equations.relax`), which ends in a stable state. If the
    minimisation takes too many iterations, for example for heavy panels with large displacements, a damped motion is
    integrated until it comes to rest. The minimisation then starts again from that state.

    Parameters
    ----------
    system : System
    q : (nq,) array
    t : s

    Raises
    ------
    NotConverged
        No stable equilibrium is found.
    """
    q = held_still(system, t, q)
    size, memory = system.scales().increment, system.memory()
    try:
        found = equilibrium(system, q, np.array([t]))
        way = float(np.abs(system.difference(q, found) / size).max(initial=0.0))
        if way <= _RESTING:
            return _closed(system, t, q) if system.hold_still(True) else q
        if way <= _NEAR and not negative_pivots(system, t, found) and _reached(system, q, found, t, memory):
            return _closed(system, t, found)
    except NotConverged:
        pass
    where = "at the start" if t == 0.0 else f"at t = {t:.6g} s"
    advice = 'start = "as-folded" begins the motion with inertia' if t == 0.0 else "use a dynamic step"
    try:
        return _downhill(system, q, t, memory)
    except NotConverged:
        pass
    try:
        _reset(system, q, t, memory)
        from fsm.solve.time.artificial_damping import come_to_rest

        with at_rest(system, still=False):
            rested = come_to_rest(system, t, q)
        return _downhill(system, rested, t, memory)
    except NotConverged as error:
        raise NotConverged(f"{where}: {error}; {advice}") from None


def _downhill(system: System, q: np.ndarray, t: float, memory: np.ndarray) -> np.ndarray:
    from fsm.solve.equations.relax import relaxed

    _reset(system, q, t, memory)
    return _closed(system, t, relaxed(system, t, q, max_iterations=_ITERATIONS, watched=True).q)


def _closed(system: System, t: float, q: np.ndarray) -> np.ndarray:
    """Equilibrium with closed locked directions, whose multipliers are kept, near one in which penalties hold them.

    Locked springs keep their deformation if they do not close, as those of a sheet that is nearly flat.
    """
    if system.hold_still(True):
        q = equilibrium(system, q, np.array([t]))
        system.commit(t, q, np.zeros(system.nu))
        return q
    newton = EquilibriumStep(system)
    if not system.take_up(newton.efforts(t, q), BEFORE):
        return q
    newton.largest_reaction = system.observe(t, q, None).reaction
    found = newton.solve(t, q, (t, q))
    if found.ending is not Ending.CONVERGED:
        system.lock(0.0)
        return q
    system.commit(t, found.q, np.zeros(system.nu))
    return found.q


def _reset(system: System, q: np.ndarray, t: float, memory: np.ndarray) -> None:
    """Reset to a configuration, with the internal variables at the start of the step."""
    system.clear_caches(np.zeros(0))
    system.restore(memory)
    system.commit(t, q, np.zeros(system.nu))


def _reached(system: System, q: np.ndarray, found: np.ndarray, t: float, memory: np.ndarray) -> bool:
    """Whether no body passes through a face between two configurations; False if one does."""
    _reset(system, q, t, memory)
    return system.rejection(t, found, None, 1.0) is None
