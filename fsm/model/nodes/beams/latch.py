"""Latches of hinges: a hinge that has reached its stop is held there in both directions.

A hinge latches at the end of a step if it is at its stop or beyond it, and the stop pushes it back. In this state the latch
and the stop have equal moments and energies. Moment and energy do not jump, so latching does not change the energy. A
latched hinge does not open again.

The law of a hinge is a function of time. Up to and including the time of latching it is the law of the stop, and after that
time the law of the latch. Earlier states are thus evaluated with the law that was valid at their time.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.model.nodes.beams.hinge import HingeGroup, latch


class Latches:
    """Latches of all hinges with an end stop.

    Parameters
    ----------
    hinges : HingeGroup
        Hinges; their `times` are updated.
    names : names of the hinges

    Attributes
    ----------
    times : (m,) array, s
        Time at which each hinge latched; inf if it has not.
    """

    def __init__(self, hinges: HingeGroup, names: tuple[str, ...]) -> None:
        self.hinges, self.names, self.times = hinges, names, hinges.times

    def commit(self, t: float, q: np.ndarray, u: np.ndarray) -> None:
        """Latch the hinges that are at their stops after an accepted step."""
        latch(self.hinges.arrays, t, q, u)

    def restore(self, times: np.ndarray) -> None:
        """Restore the times of latching; an empty array means that no hinge has latched."""
        self.times[:] = times if len(times) else math.inf

    def events(self) -> list[tuple[str, float]]:
        """Name and time (s) of every latched hinge, in order of time."""
        latched = np.flatnonzero(np.isfinite(self.times))
        return [(self.names[k], float(self.times[k])) for k in latched[np.argsort(self.times[latched], kind="stable")]]

    def open(self) -> list[str]:
        """Names of the hinges that have a stop and have not latched."""
        waiting = self.hinges.stopped & np.isinf(self.times)
        return [self.names[k] for k in np.flatnonzero(waiting)]
