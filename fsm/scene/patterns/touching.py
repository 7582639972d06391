"""Surface of a sheet whose nodes and edges touch the sheet itself and obstacles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.scene.flexible import SceneFrame

__all__ = ["TouchingSheet"]


@dataclass(frozen=True, eq=False)
class TouchingSheet:
    """Triangles of a sheet of flexible facets or of bars, for contact.

    Attributes
    ----------
    frames : (n,) frames at the nodes
    areas : (n,) array, m^2
        Area that each node represents.
    triangles : (m, 3) int array of nodes
    facet : (m,) int array
        Facet of each triangle.
    plane : (m, 3, 2) array, m
        Corners in the flat facet.
    mean_facet : m^2
        Area of a mean facet of the pattern, which has the whole contact stiffness.
    thickness, areal_density : m, kg/m^2
    """

    frames: tuple[SceneFrame, ...]
    areas: np.ndarray
    triangles: np.ndarray
    facet: np.ndarray
    plane: np.ndarray
    mean_facet: float
    thickness: float
    areal_density: float
