"""Pressure of a case on triangles of a sheet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.builders.patterns.places import facets_named
from fsm.case.models.loads import Load
from fsm.kernels.programs import Program
from fsm.model.bodies.time_function import time_function
from fsm.model.nodes.facets.pressure import PressedFaces


@dataclass(frozen=True, eq=False)
class Pressure:
    """Pressure (Pa) on faces, times a function of time."""

    name: str
    faces: PressedFaces
    pressure: float
    time: Program

    @classmethod
    def of(cls, load: Load, faces: PressedFaces) -> Pressure:
        """Pressure of a load on some of the faces of a sheet."""
        assert load.pressure is not None and isinstance(load.at, str)
        facets = facets_named(load.at, int(faces.facet.max()) + 1)
        return cls(load.called, faces.of(np.array(facets)), load.pressure, time_function(load.time))

    def size(self, t: float) -> float:
        """Pressure at a time, Pa."""
        return self.pressure * self.time.at(t)[0]

    def add_force(self, t: float, nodes: np.ndarray, force: np.ndarray) -> None:
        """Add the forces on the coordinates (n,) of the nodes."""
        if size := self.size(t):
            self.faces.add_force(nodes, size, force)

    def add_force_rate(self, t: float, nodes: np.ndarray, force: np.ndarray) -> None:
        """Add the change of the forces with time at fixed nodes."""
        if rate := self.pressure * self.time.at(t)[1]:
            self.faces.add_force(nodes, rate, force)

    def add_linearised(
        self, t: float, nodes: np.ndarray, slots: np.ndarray, force: np.ndarray, stiffness: np.ndarray
    ) -> None:
        """Add the forces, and their negative derivatives to block data; see `PressedFaces.add_stiffness`."""
        if size := self.size(t):
            self.faces.add_force(nodes, size, force)
            self.faces.add_stiffness(nodes, size, slots, stiffness)
