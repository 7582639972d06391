"""Latches of hinges: what has reached its stop is held there from both sides.

A hinge latches at the end of the first step at which it is at its stop or past it and the stop pushes it back. There
moment and energy of the latch are those of the stop, so that neither jumps: latching neither takes nor gives energy. It is
for good.

The law of a hinge is a function of time: that of the stop up to the time at which it latched, that time with it, and that of
the latch after. So states of before are looked at with the law that they were stepped with.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.ancf.hinge import HingeGroup

__all__ = ["Latches"]


class Latches:
    """Latches of the hinges that have an end stop.

    Parameters
    ----------
    hinges : HingeGroup
        Whose `latched` is kept up to date.
    names : names of the hinges

    Attributes
    ----------
    times : (m,) array, s
        When each hinge latched; inf before.
    """

    def __init__(self, hinges: HingeGroup, names: tuple[str, ...]) -> None:
        self.hinges, self.names = hinges, names
        self.times = np.full(len(names), math.inf)

    def at(self, t: float) -> None:
        """Let the hinges resist as they do at a time (s)."""
        np.less(self.times, t, out=self.hinges.latched)

    def commit(self, t: float, q: np.ndarray, u: np.ndarray) -> None:
        """A step was accepted: hinges that it brought to their stops latch."""
        self.times[np.isinf(self.times) & self.hinges.pushed(q, u)] = t

    def restore(self, times: np.ndarray) -> None:
        """Take the times again; none: nothing has latched."""
        self.times[:] = times if len(times) else math.inf

    def events(self) -> list[tuple[str, float]]:
        """Name and time (s) of what has latched, in the order in which it did."""
        latched = np.flatnonzero(np.isfinite(self.times))
        return [(self.names[k], float(self.times[k])) for k in latched[np.argsort(self.times[latched], kind="stable")]]

    def open(self) -> list[str]:
        """Names of the hinges that have a stop and have not latched."""
        waiting = self.hinges.stopped & np.isinf(self.times)
        return [self.names[k] for k in np.flatnonzero(waiting)]
