"""Protocol of a contact geometry: contact points, gaps, slip, and their derivatives.

A geometry has *slots*: possible contacts of a probe point with a surface, a corner with a plate, or two edges.
Slots may be renumbered at each renewal of the broad phase, but each slot has a constant key. The memory of contacts is
stored by key and changes only when a step is accepted.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from fsm.interactions.contact.shapes import ContactForces
from fsm.model.bodies.pattern import BodyPattern


class ActiveContacts(NamedTuple):
    """Slots whose gap is below a bound.

    Attributes
    ----------
    slot : (count,) int array
    gap : (count,) array, m
        Negative when they touch.
    at : tuple of arrays
        Positions on the faces; their form depends on the geometry.
    """

    slot: np.ndarray
    gap: np.ndarray
    at: tuple[np.ndarray, ...]


class Tapered(NamedTuple):
    """Contacts whose weights change with the poses: `fsm.interactions.surfaces.end_taper` and
    `fsm.interactions.shapes.face_weights`.

    Attributes
    ----------
    rows : (m,) int array
        Rows of the contacts.
    part : (m,) array
        Factor of each contact's weight.
    gradient, hessian : (m, k size) and (m, k size, k size) arrays
        Derivatives of the factor with respect to the coordinates of the contact's bodies.
    fades : bool
        Whether the factors are zero at the end of a face; the reported depth of contacts fades with them.
    """

    rows: np.ndarray
    part: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray
    fades: bool = True


class ContactKinematics(NamedTuple):
    """Rates of contacts, and their gradients with respect to the bodies' coordinates.

    Attributes
    ----------
    bodies : (count, k) int array
        Bodies of each contact; the first body carries the point.
    rate : (count, 1 + c) array, m/s
        Rate of the gap; slip velocity, along the face in the plane (c = 1), in inertial axes in space (c = 3).
    gradient : (count, 1 + c, k size) array
        rate = gradient . rates of the bodies.
    tapered : Tapered or None
    """

    bodies: np.ndarray
    rate: np.ndarray
    gradient: np.ndarray
    tapered: Tapered | None = None


class ContactGeometry(Protocol):
    """Protocol of the contacts of one kind. Poses (n_bodies, 3 or 7) and rates (n_bodies, 3 or 6) include all bodies."""

    slips: int
    """Number of slip components: 1 in the plane, 3 in space."""
    margin: float
    """Largest gap that `find` returns, m."""

    @property
    def share(self) -> np.ndarray:
        """Fraction of the face that each slot represents, (n_slots,)."""
        ...

    @property
    def area(self) -> np.ndarray:
        """Area that each slot represents, (n_slots,), m^2.

        If both faces of a pair probe each other, each probe point has half its weight. The areas then sum to the contact
        area.
        """
        ...

    @property
    def pair(self) -> np.ndarray:
        """Number of the contact pair of each slot, (n_slots,)."""
        ...

    @property
    def refreshes(self) -> int:
        """Number of renewals of the broad phase; slots keep their numbers until it changes."""
        ...

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """Keys of slots: integers that do not change at a renewal."""
        ...

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """Pairs of bodies that contacts may couple until the next renewal, and a version number that changes when the pairs
        change.
        """
        ...

    def find(self, poses: np.ndarray, below: float) -> ActiveContacts:
        """Find the slots whose gap is below a bound, m; the bound is at most the margin."""
        ...

    def measure(self, poses: np.ndarray, rates: np.ndarray, touching: ActiveContacts) -> ContactKinematics:
        """Compute rates and gradients of the contacts that `find` returned at the same poses."""
        ...

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
        """Add -dh/dx and -dh/du to the block data."""
        ...

    def commit(self, poses: np.ndarray, young: np.ndarray | None = None) -> None:
        """Update the memory after an accepted step, for example the side on which a point lies.

        `young` lists the slots of contacts that may be continuing impacts; None means all contacts.
        """
        ...

    def memory(self) -> np.ndarray:
        """Memory as one flat array."""
        ...

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory; an empty array gives the initial memory."""
        ...

    def clear_caches(self) -> None:
        """Discard the results of the broad phase; it is renewed at the next poses."""
        ...

    def crossed(self, poses: np.ndarray) -> tuple[int, ...]:
        """Numbers of the pairs whose sides have passed through each other since the last commit."""
        ...
