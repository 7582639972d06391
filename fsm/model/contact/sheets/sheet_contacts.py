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

from fsm.interactions.contact.shapes import ContactForces
from fsm.interactions.triangles.closest_features import Found
from fsm.interactions.triangles.feature_contact import SIZE
from fsm.kernels.tables import Table, empty_arrays
from fsm.model.bodies.contact_arrays import FRICTION, REFERRED, STARTED, STATES, ContactArrays
from fsm.model.bodies.pattern import BodyPattern
from fsm.model.contact.contact_geometry import ActiveContacts, ContactKinematics, Tapered
from fsm.model.contact.sheets.array_sheet_tables import FACETS, POINTS, RENEWALS, SLOTS, SheetArrays
from fsm.model.contact.sheets.array_sheets import SHEETS
from fsm.model.contact.sheets.sheet_tables import (
    SheetSurface,
    arrays_of_mesh,
    bodies_of_slots,
    is_full,
    left_out,
    own_memory,
    roomier,
    set_sides,
)

_MARGIN = 0.25
"""Margin over the mean length of an edge."""


class SheetContacts:
    """Contacts of flexible facets with each other; see the module docstring and `ContactGeometry`.

    The methods call the kernels of `fsm.model.contact.sheets.array_sheets` with a table of their own. The broad phase is
    renewed when a node has moved by 0.4 of the margin. Contacts do not depend on the time of the renewal. Every accepted
    step is checked for nodes that passed through triangles, and edges through edges.

    Parameters
    ----------
    surface : SheetSurface
    reference : (n_bodies, 7) array
        Poses at the start.

    Attributes
    ----------
    mesh : SheetArrays
        Arrays without slots, for the table of a compiled model.
    """

    slips = 3

    def __init__(self, surface: SheetSurface, reference: np.ndarray) -> None:
        along = np.roll(surface.plane, -1, axis=1) - surface.plane
        self.surface, self.margin = surface, _MARGIN * float(np.linalg.norm(along, axis=2).mean())
        self.mesh = arrays_of_mesh(surface, self.slips)
        state, body, bodies = np.zeros(STATES, dtype=np.int64), self.mesh.body, len(reference)
        self._common = empty_arrays(ContactArrays)._replace(
            state=state, numbers=np.array([self.margin, 0.0, 0.0, 0.0]), committed=np.zeros((bodies, 7)),
            reference=np.zeros((bodies, 7)), moving=body, radii=np.zeros(len(body)), deflection=np.zeros((0, 3)),
            bodies=np.zeros((0, 4), dtype=np.int64), rate=np.zeros((0, 4)), gradient=np.zeros((0, 4, SIZE)),
            effort=np.zeros((0, 3)), by_slip=np.zeros((0, 3, 3)), by_normal=np.zeros((0, 3)),
        )  # fmt: skip
        self._own = self.mesh._replace(counts=self.mesh.counts.copy())
        self._table = Table(self._common, self._own)
        self._coupled: tuple[int, np.ndarray] = -1, np.zeros((0, 2), dtype=np.int64)
        self._refresh(reference)
        touching = self.find(reference, 0.0).slot
        self.mesh = self.mesh._replace(closed=left_out(surface, self._own, touching, reference[body, :3]))
        self._set(self._common, self._own._replace(closed=self.mesh.closed))
        state[REFERRED] = 0

    def _set(self, common: ContactArrays, own: SheetArrays) -> None:
        self._common, self._own = common, own
        self._table.replace(common, own)

    # slots ----------------------------------------------------------------------------------------------------------

    @property
    def points(self) -> int:
        """Number of slots of nodes, which come before those of edges."""
        return int(self._own.counts[POINTS])

    @property
    def share(self) -> np.ndarray:
        """See `ContactGeometry`."""
        return self._common.share[: self._own.counts[SLOTS]]

    @property
    def area(self) -> np.ndarray:
        """See `ContactGeometry`."""
        return self._common.area[: self._own.counts[SLOTS]]

    @property
    def pair(self) -> np.ndarray:
        """See `ContactGeometry`."""
        return self._common.pair[: self._own.counts[SLOTS]]

    @property
    def refreshes(self) -> int:
        """See `ContactGeometry`."""
        return int(self._own.counts[RENEWALS])

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """See `ContactGeometry`."""
        return self._own.key[slots]

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `ContactGeometry`."""
        self._refresh(poses)
        if self._coupled[0] != self.refreshes:
            self._coupled = self.refreshes, bodies_of_slots(self._own)
        return self._coupled[1], self.refreshes

    def _refresh(self, poses: np.ndarray) -> None:
        SHEETS.renew(self._table, poses)
        if is_full(self._own):
            self._set(*roomier(self._common, self._own))
            SHEETS.renew(self._table, poses)

    # contacts -------------------------------------------------------------------------------------------------------

    def find(self, poses: np.ndarray, below: float) -> ActiveContacts:
        """See `ContactGeometry`; `at` holds the closest points, `Found`."""
        self._refresh(poses)
        count, common = SHEETS.find(self._table, poses, float(below)), self._common
        found = tuple(values[:count].copy() for values in self._found)
        return ActiveContacts(common.slot[:count].copy(), common.gap[:count].copy(), found)

    @property
    def _found(self) -> Found:
        own = self._own
        return Found(
            own.found_nodes, own.found_free, own.found_coefficients, own.found_directions, own.found_normal,
            own.found_distance,
        )  # fmt: skip

    def _write(self, touching: ActiveContacts) -> int:
        """Write contacts to the table, and return their number."""
        count = len(touching.slot)
        self._common.slot[:count] = touching.slot
        for row, values in zip(self._found, touching.at, strict=True):
            row[:count] = values
        return count

    def measure(self, poses: np.ndarray, rates: np.ndarray, touching: ActiveContacts) -> ContactKinematics:
        """See `ContactGeometry`."""
        count, common = self._write(touching), self._common
        SHEETS.measure(self._table, poses, rates, count)
        bodies, rate, gradient = (values[:count].copy() for values in (common.bodies, common.rate, common.gradient))
        measured = ContactKinematics(bodies, rate, gradient)
        rows, part, gradient, hessian = SHEETS.tapered(self._table, poses, count)
        return measured._replace(tapered=Tapered(rows, part, gradient, hessian, False)) if len(rows) else measured

    def add_tangent(
        self,
        poses: np.ndarray,
        rates: np.ndarray,
        touching: ActiveContacts,
        measured: ContactKinematics,
        forces: ContactForces,
        pattern: BodyPattern,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """See `ContactGeometry`."""
        if self._common.indices is not pattern.indices:
            dof, indptr, indices = pattern.index
            self._set(self._common._replace(dof=dof, indptr=indptr, indices=indices), self._own)
        count, common = self._write(touching), self._common
        common.state[FRICTION] = int(forces.friction)
        written = (
            (common.bodies, measured.bodies), (common.gradient, measured.gradient), (common.normal_force, forces.normal),
            (common.by_depth, forces.by_depth), (common.by_closing, forces.by_closing), (common.effort, forces.effort),
            (common.by_slip, forces.by_slip), (common.by_normal, forces.by_normal),
        )  # fmt: skip
        for row, values in written:
            row[:count] = values
        SHEETS.tangent(self._table, poses, rates, count, stiffness, damping)

    def facet_forces(self, slots: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Normal force on each facet, (n_facets,), N, from the forces (n,) of slots.

        Both sides of a contact count. A node or an edge of several facets gives each of them an equal part.
        """
        own, points, facets = self._own, slots < self.points, int(self._own.counts[FACETS])
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

    def commit(self, poses: np.ndarray, young: np.ndarray | None = None) -> None:
        """See `ContactGeometry`; the memory consists of positions, and the sides of nodes near facets."""
        self._refresh(poses)
        SHEETS.find(self._table, poses, 0.0)  # selects triangles in the last accepted state, if this is not yet done
        self._common.committed[:], self._common.state[STARTED] = poses, 1
        SHEETS.settle(self._table, poses, np.zeros(0, dtype=np.int64), False)

    def memory(self) -> np.ndarray:
        """See `ContactGeometry`; the array contains positions, then keys and values of the sides."""
        return own_memory(self._common, self._own) if self._common.state[STARTED] else np.zeros(0)

    def restore(self, memory: np.ndarray) -> None:
        """See `ContactGeometry`."""
        size, self._common.state[STARTED] = 3 * len(self.mesh.body), int(len(memory) > 0)
        if len(memory):
            self._common.committed[self.mesh.body, :3] = memory[:size].reshape(-1, 3)
        self._set(*set_sides(self._common, self._own, memory[size:]))

    def clear_caches(self) -> None:
        """See `ContactGeometry`."""
        self._common.state[REFERRED] = 0

    def crossed(self, poses: np.ndarray) -> tuple[int, ...]:
        """See `ContactGeometry`. Without clearance, a node that has a side may be behind the facet, because the contact is
        soft.
        """
        self._refresh(poses)
        return (self.surface.number,) if SHEETS.passed(self._table, poses) else ()
