"""Natural modes of a film, without the artificial modes of held coordinates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.modal import Modes, modes


def natural_modes(system: AncfSystem, q: np.ndarray, count: int) -> Modes:
    """Lowest modes at rest, at most as many as free coordinates.

    Held coordinates are separate oscillators with the frequency of the fastest coordinate of the film. These oscillators
    appear among the modes if nearly all modes are requested. A mode without motion of free coordinates belongs to them.

    Parameters
    ----------
    system : AncfSystem
    q : (n,) array
        Equilibrium.
    count : number of modes
    """
    free = ~system.fixed
    count = min(count, int(np.count_nonzero(free)))
    found = modes(system, 0.0, q, count)
    own = _moves(found, free)
    if not own.all():
        found = modes(system, 0.0, q, system.nu)
        own = _moves(found, free)
    kept = np.flatnonzero(own)[:count]
    return replace(
        found, squared=found.squared[kept], shapes=found.shapes[kept], residuals=found.residuals[kept]
    )


def _moves(found: Modes, free: np.ndarray) -> np.ndarray:
    """Whether free coordinates move in each mode, (count,)."""
    moved = np.abs(found.shapes)
    return np.asarray(moved[:, free].max(axis=1, initial=0.0) > 1e-6 * moved.max(axis=1, initial=0.0))
