"""Numbers of flexible facets in the summary."""

from __future__ import annotations

import numpy as np

from fsm.case.models.facet_mesh import MeshPoint
from fsm.case.models.flexible_facets import FlexibleFacets
from fsm.model.joined.system import JoinedSystem
from fsm.model.system.system import SegmentSystem
from fsm.results.solution import Solution


def mesh_point(system: SegmentSystem, point: MeshPoint, q: np.ndarray) -> np.ndarray:
    """Position of a point of flexible facets in a configuration q of the system, (3,), m."""
    assert isinstance(system, JoinedSystem)
    nodes = q[len(q) - system.elements.nq :]
    return np.asarray(point.weights @ nodes[(system.first_facet + 3 * point.vectors)[:, None] + np.arange(3)])


def probe_displacements(system: SegmentSystem, facets: FlexibleFacets, solution: Solution) -> dict[str, list[float]]:
    """Displacement (x, y, z) of each probe between the first and the last record, m."""
    first, last = solution.q[0], solution.q[-1]
    return {
        name: (mesh_point(system, point, last) - mesh_point(system, point, first)).tolist()
        for name, point in facets.probes.items()
    }
