"""Contacts of flexible facets with each other: nodes with facets, and edges with edges of a mesh of triangles.

A node is a probe on every facet to which it does not belong. The nodes of two facets that lie on each other represent the
area of contact; each facet contributes half. A node keeps its side of a facet. After each accepted step a node selects the
nearest triangle of the facet; in the next step it touches the plane of this triangle. A node beyond the outline of the facet
selects a part of the rounded outline. The normal therefore does not jump within a step. Edges touch where they cross, at
half of the distance at which faces touch. Contact of edges keeps facets apart where the mesh is too coarse for contact of
nodes; edges carry no load where nodes touch.

Beside a common crease or vertex, faces touch at a smaller distance (`fsm.model.contact.crease_clearance`).

Facets with a common vertex, and facets across a cut, have no contact where they touch at the start. Parts of one facet can
touch if their distance along the facet exceeds a bound.
"""

from __future__ import annotations

import numpy as np

from fsm.model.bodies.contact_arrays import FOUND, REFERRED, ContactArrays
from fsm.model.bodies.group import BodyPattern
from fsm.model.contact.contact_memory import ContactMemory
from fsm.model.contact.contact_table import ContactTable
from fsm.model.contact.sheets import sheet_tables
from fsm.model.contact.sheets.array_sheet_tables import FACETS, KEPT, POINTS, SIDES, SLOTS, SheetArrays
from fsm.model.contact.sheets.array_sheets import RESTORED, SHEETS
from fsm.model.contact.sheets.sheet_tables import SheetSurface

_MARGIN = 0.25
"""Margin over the mean length of an edge."""


class SheetContacts(ContactTable):
    """Contacts of flexible facets with each other; see the module docstring and `ContactTable`.

    The broad phase is renewed when a node has moved by 0.4 of the margin. Contacts do not depend on the time of the renewal.
    Every accepted step is checked for nodes that passed through triangles, and edges through edges. Without clearance, a
    node that has a side may be behind the facet, because the contact is soft.

    Parameters
    ----------
    surface : SheetSurface
    reference : (n_bodies, 7) array
        Poses at the start.
    """

    coupled_bodies, renumbers = 4, True

    def __init__(self, surface: SheetSurface, reference: np.ndarray) -> None:
        along = np.roll(surface.plane, -1, axis=1) - surface.plane
        self.surface, mesh = surface, sheet_tables.arrays_of_mesh(surface, 3)
        margin, body = _MARGIN * float(np.linalg.norm(along, axis=2).mean()), mesh.body
        super().__init__(SHEETS, 3, margin, body, np.zeros(len(body)), mesh)
        self._ahead = np.zeros((0, 2), dtype=np.int64)
        touching = self.find(reference, 0.0).slot
        closed = sheet_tables.left_out(surface, self.own, touching, reference[body, :3])
        self._set(self.common, self.own._replace(closed=closed))
        self.clear_caches()

    def _set(self, common: ContactArrays, own: SheetArrays) -> None:
        self.table.replace(common, own)

    # slots ----------------------------------------------------------------------------------------------------------

    @property
    def points(self) -> int:
        """Number of slots of nodes, which come before those of edges."""
        return int(self.own.counts[POINTS])

    @property
    def slots(self) -> int:
        """See `ContactTable`."""
        return int(self.own.counts[SLOTS])

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """See `ContactTable`."""
        return np.asarray(self.own.key[slots])

    def coupled(self) -> np.ndarray:
        """See `ContactTable`."""
        return sheet_tables.bodies_of_slots(self.own)

    def coupled_ahead(self) -> np.ndarray:
        """See `ContactTable`: the pairs of the present slots, and those of the last call."""
        now = sheet_tables.bodies_of_slots(self.own)
        found, self._ahead = np.concatenate([now, self._ahead]), now
        return found

    def index(self, pattern: BodyPattern) -> None:
        """See `ContactTable`; makes room for all slots, which the next renewal of the broad phase finds again."""
        self.grow()
        super().index(pattern)
        self.common.state[REFERRED], self.common.state[FOUND] = 0, -1

    def refresh(self, poses: np.ndarray) -> None:
        """See `ContactTable`."""
        super().refresh(poses)
        if self.grow():
            super().refresh(poses)

    def grow(self) -> bool:
        """Make room for all slots of the last renewal of the broad phase; return whether there was too little."""
        full = sheet_tables.is_full(self.own)
        if full:
            self._set(*sheet_tables.roomier(self.common, self.own))
            self.common.state[REFERRED] = 0
        return full

    def facet_forces(self, slots: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Normal force on each facet, (n_facets,), N, from the forces (n,) of slots.

        Both sides of a contact count. A node or an edge of several facets gives each of them an equal part.
        """
        own, points, facets = self.own, slots < self.points, int(self.own.counts[FACETS])
        total = np.zeros(facets)
        number, size = slots[points], forces[points]
        np.add.at(total, own.second_of[number], size)
        node, facet = np.divmod(own.on, facets)
        start = np.searchsorted(node, np.arange(len(own.body) + 1))
        for one, force in zip(own.first_of[number].tolist(), size.tolist(), strict=True):
            total[facet[start[one] : start[one + 1]]] += force / (start[one + 1] - start[one])
        for of in (own.first_of, own.second_of):
            np.add.at(total, own.edge_facets[of[slots[~points]]], 0.5 * forces[~points, None])
        return total

    # memory ---------------------------------------------------------------------------------------------------------

    def contacts(self) -> ContactMemory:
        """See `ContactTable`."""
        count = self.own.counts[KEPT]
        onset, began, depth = self.own.kept[:count, :3].T
        return ContactMemory(self.own.kept_key[:count], onset, began, depth, self.own.kept[:count, 3:])

    def restore(self, memory: np.ndarray) -> None:
        """See `ContactTable`; the slots of the last renewal of the broad phase do not depend on the memory."""
        referred, slots = self.common.state[REFERRED], self.own.key
        super().restore(memory)
        if referred and self.own.key is slots:
            self.common.state[REFERRED] = RESTORED

    def load_contacts(self, kept: ContactMemory) -> None:
        """See `ContactTable`; the next use of the slots copies the memory to them."""
        if len(kept.key) > len(self.own.key):
            self._set(*sheet_tables.roomier(self.common, self.own, len(kept.key)))
        own, count = self.own, len(kept.key)
        own.counts[KEPT], own.kept_key[:count] = count, kept.key
        own.kept[:count] = np.column_stack([kept.onset, kept.began, kept.depth, kept.deflection])
        self.common.state[REFERRED] = 0

    def own_memory(self) -> np.ndarray:
        """See `ContactTable`: keys and values of the sides."""
        sides = self.own.counts[SIDES]
        return np.concatenate([self.own.side_key[:sides], self.own.side_of[:sides]])

    def load_own(self, memory: np.ndarray) -> None:
        """See `ContactTable`."""
        self._set(*sheet_tables.set_sides(self.common, self.own, memory))
