"""Pressure of a case on triangles of a sheet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.ancf.pressure import PressedFaces
from fsm.scene.loads import Constant, Load, TimeFunction
from fsm.scene.patterns.places import facets_named
from fsm.segments.time_function import factor, slope

__all__ = ["Pressure"]


@dataclass(frozen=True, eq=False)
class Pressure:
    """Pressure (Pa) on faces, times a function of time."""

    name: str
    faces: PressedFaces
    pressure: float
    time: TimeFunction

    @classmethod
    def of(cls, load: Load, faces: PressedFaces) -> Pressure:
        """Pressure of a load on some of the faces of a sheet."""
        assert load.pressure is not None and isinstance(load.at, str)
        facets = facets_named(load.at, int(faces.facet.max()) + 1)
        return cls(load.called, faces.of(np.array(facets)), load.pressure, load.time or Constant())

    def size(self, t: float) -> float:
        """Pressure at a time, Pa."""
        return self.pressure * factor(self.time, t)

    def add_force(self, t: float, nodes: np.ndarray, force: np.ndarray) -> None:
        """Add the forces on the coordinates (n,) of the nodes."""
        if size := self.size(t):
            self.faces.add_force(nodes, size, force)

    def add_force_rate(self, t: float, nodes: np.ndarray, force: np.ndarray) -> None:
        """Add the change of the forces with time at fixed nodes."""
        if rate := self.pressure * slope(self.time, t):
            self.faces.add_force(nodes, rate, force)

    def add_linearised(
        self, t: float, nodes: np.ndarray, slots: np.ndarray, force: np.ndarray, stiffness: np.ndarray
    ) -> None:
        """Add the forces, and their negative derivatives to block data; see `PressedFaces.add_stiffness`."""
        if size := self.size(t):
            self.faces.add_force(nodes, size, force)
            self.faces.add_stiffness(nodes, size, slots, stiffness)
