"""Arrays of bodies and ANCF elements for quasi-static steps in kernels."""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import address_table
from fsm.kernels.blocks import BlockPattern
from fsm.model.bodies.arrays import Arrays
from fsm.model.bodies.group import BodyPattern
from fsm.model.elements.element_group import ElementArrays
from fsm.model.joined.arrays_of import joined_of
from fsm.model.joined.configuration import JoinedConfiguration
from fsm.model.nodes.arrays import FACTORS, KINDS_OF_ENERGY, MATRIX
from fsm.model.nodes.facets.facet_group import FacetGroup
from fsm.model.system.array_path import PATH
from fsm.model.system.static_arrays import StaticSegments
from fsm.solve.interface.records import PreviousState, Ready
from fsm.solve.stepping.path_state import BARS
from fsm.solve.stepping.quasi_static import StaticModel


class JoinedStatics(StaticSegments):
    """Arrays of a joined system without parts in Python; see `StaticSegments`."""

    energies = StaticSegments.energies | {name: BARS + k for k, name in enumerate(KINDS_OF_ENERGY[2:])}

    def __init__(self, system: JoinedConfiguration, pattern: BodyPattern, ready: Ready) -> None:
        self._joined, self._near = system, system.frames_near.copy()
        super().__init__(system, pattern, ready)
        self._stored_by.append([*system.elements.energies(0.0, system.elements.start)])

    def _create(self, pattern: BodyPattern) -> tuple[tuple[Arrays, Arrays], list[ElementArrays]]:
        """See `StaticSegments`; a new pattern has a new model."""
        found = joined_of(self._joined, pattern, self._near, self._ready, self._contacts, True)
        self._equations = self._joined.joined_matrix(pattern)[0].pattern
        self.model = StaticModel.of(PATH, found.model, self._joined.initial()[0])
        self._others = found.others
        _, self._factors = self._ready(self._equations)
        return found.bodies, found.elements

    _renew = _create

    def prepare(self, before: PreviousState) -> None:
        """See `fsm.solve.interface.system.StaticArrays`."""
        super().prepare(before)
        self._near[:] = self._joined.frames_near

    def _use_factors(self) -> None:
        """See `StaticSegments`."""
        _, factors = self._ready(self._equations)
        if factors is not self._factors:
            self._factors = factors
            self.model.arrays.nodes.table[FACTORS] = address_table([factors])[0]

    def _matrix(self) -> tuple[BlockPattern, np.ndarray]:
        """See `StaticSegments`."""
        return self._equations, self._others[MATRIX]

    def _efforts(self) -> np.ndarray:
        """See `StaticSegments`; membrane efforts of flexible facets follow those of springs."""
        facets = (group for group in self._joined.elements.mesh.groups if isinstance(group, FacetGroup))
        return np.concatenate([super()._efforts(), *(group.mixed[0] for group in facets)])

    def followed(self, q: np.ndarray) -> None:
        """See `fsm.solve.interface.system.StaticArrays`."""
        super().followed(q)
        self._joined.frames_near = self._near.copy()
