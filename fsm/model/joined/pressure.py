"""Pressure of a case on triangles of a sheet."""

from __future__ import annotations

import numpy as np

from fsm.builders.patterns.places import facets_named
from fsm.case.models.loads import Load
from fsm.model.bodies.time_function import time_function
from fsm.model.nodes.facets.pressure import PressedFaces, PressureGroup


def pressure_of(load: Load, faces: PressedFaces) -> PressureGroup:
    """Pressure of a load on some of the faces of a sheet."""
    assert load.pressure is not None and isinstance(load.at, str)
    facets = facets_named(load.at, int(faces.facet.max()) + 1)
    return PressureGroup(load.called, faces.of(np.array(facets)), load.pressure, time_function(load.time))
