"""Work and speed of the forces of a system at rest, for the scales of its variables."""

from __future__ import annotations

import math

import numpy as np

from fsm.solve.interface.scales import AtRest
from fsm.solve.interface.system import System

_OF_FORCES = 0.1
"""Scale of the speed relative to the speed that forces at rest can cause; with 1, errors are three times as large."""
_ROUND_OFF = 1e-14
"""Work of forces at rest relative to the stiffness times the square of the span, below which the forces are round-off."""


def scales_at_rest(system: System, free: np.ndarray, in_u: np.ndarray, extent: float) -> AtRest:
    """Scales of a system in its initial state.

    Parameters
    ----------
    system : System
        `peak_times` gives the times at which forces are largest.
    free, in_u : (nu,) bool arrays
        Whether each component is free to move, and whether it is a position.
    extent : m
    """
    q, _ = system.initial()
    memory, places = system.memory(), free & in_u
    system.restore(np.zeros(0))
    times = sorted({0.0, *system.peak_times()})
    span = np.where(in_u, extent, 1.0)[free]
    work = max(float(np.abs(system.force(t, q, None)[free]) @ span) for t in times)
    direction = places / math.sqrt(3.0)
    mass = float(direction @ system.momentum(q, direction))
    stiffness = system.linearise(0.0, q, None).stiffness.bsr().diagonal()
    system.restore(memory)
    if work > _ROUND_OFF * float(np.abs(stiffness[free]) @ span**2) and mass > 0.0:
        return AtRest(work, _OF_FORCES * math.sqrt(2.0 * work / mass))
    ratio = (stiffness / system.mass(q).diagonal())[places]
    ratio = ratio[ratio > 0.0]
    return AtRest(0.0, extent * math.sqrt(float(ratio.min())) if len(ratio) else extent)
