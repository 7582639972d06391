"""Natural modes of a film, without the oscillators that stand in for what is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fsm.ancf.system import AncfSystem
from fsm.solve.modal import Modes, modes

__all__ = ["natural_modes"]


def natural_modes(system: AncfSystem, q: np.ndarray, count: int) -> Modes:
    """The lowest modes at rest; no more than there are free coordinates.

    Held coordinates are oscillators beside the film, as fast as its fastest coordinate and therefore among its own modes
    where nearly all of those are asked for. A mode belongs to them if nothing free moves.

    Parameters
    ----------
    system : AncfSystem
    q : (n,) array
        An equilibrium.
    count : modes wanted
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
    """Whether something free moves in each mode, (count,)."""
    moved = np.abs(found.shapes)
    return np.asarray(moved[:, free].max(axis=1, initial=0.0) > 1e-6 * moved.max(axis=1, initial=0.0))
