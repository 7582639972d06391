"""What a geometry of contact owes the contact group: where things touch, and how that changes.

A geometry has *slots*, places that may carry a contact: a probe point on a surface, a corner on a plate, an edge on an edge.
It may number them anew whenever its broad phase is renewed, but each has a key that stays. What contacts remember is kept
by key, and changes only when a step is accepted.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from fsm.segments.pattern import BodyPattern

__all__ = ["ContactForces", "ContactGeometry", "Measured", "Tapered", "Touching"]


class Touching(NamedTuple):
    """Slots whose gap is below a bound.

    Attributes
    ----------
    slot : (count,) int array
    gap : (count,) array, m
        Negative when they touch.
    at : tuple of arrays
        The geometry's own: where on its faces.
    """

    slot: np.ndarray
    gap: np.ndarray
    at: tuple[np.ndarray, ...]


class Tapered(NamedTuple):
    """Contacts of points that come in over the end of a face, `fsm.interactions.end_taper`.

    Attributes
    ----------
    rows : (m,) int array
        Which of the contacts.
    part : (m,) array
        What of its share each has there.
    gradient, hessian : (m, k size) and (m, k size, k size) arrays
        Derivatives of the part by the coordinates of the contact's bodies.
    """

    rows: np.ndarray
    part: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray


class Measured(NamedTuple):
    """Rates of contacts and how they hang on the bodies.

    Attributes
    ----------
    bodies : (count, k) int array
        Bodies of each contact, the one that carries the point first.
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


class ContactForces(NamedTuple):
    """Forces of contacts and their slopes: h = N grad(gap) - f_c grad(slip_c) on the bodies.

    Attributes
    ----------
    normal : (count,) array, N
    by_depth, by_closing : (count,) arrays, N/m and N s/m
        dN by depth (minus the gap) and by closing speed (minus its rate).
    effort : (count, c) array, N
        Friction f.
    by_slip : (count, c, c) array, N s/m
        df by slip velocity.
    by_normal : (count, c) array
        df by N.
    friction : bool
        False: effort and its slopes are zero, and nothing need be done for them.
    """

    normal: np.ndarray
    by_depth: np.ndarray
    by_closing: np.ndarray
    effort: np.ndarray
    by_slip: np.ndarray
    by_normal: np.ndarray
    friction: bool


class ContactGeometry(Protocol):
    """Contacts of one kind. Poses and rates are of all bodies, (n_bodies, 3 or 7) and (n_bodies, 3 or 6)."""

    slips: int
    """Components of a slip: 1 in the plane, 3 in space."""
    margin: float
    """How far away others are still seen, m."""

    @property
    def share(self) -> np.ndarray:
        """Part of its face that each slot stands for, (n_slots,)."""
        ...

    @property
    def area(self) -> np.ndarray:
        """Area that each slot stands for, m^2, (n_slots,).

        Where both faces of a pair watch each other, each has half its weight, so that faces in full contact add up to one.
        """
        ...

    @property
    def pair(self) -> np.ndarray:
        """Number of the contact pair of each slot, (n_slots,)."""
        ...

    @property
    def refreshes(self) -> int:
        """How often the broad phase was renewed; slots have the same numbers as long as this does not change."""
        ...

    def keys(self, slots: np.ndarray) -> np.ndarray:
        """Names of slots, whole numbers that outlive all renewals."""
        ...

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """Pairs of bodies that a contact could couple until the broad phase is renewed, and a number that changes then."""
        ...

    def find(self, poses: np.ndarray, below: float) -> Touching:
        """Slots whose gap is below a bound, m; at most the margin."""
        ...

    def measure(self, poses: np.ndarray, rates: np.ndarray, touching: Touching) -> Measured:
        """Rates and gradients of what `find` found at the same poses."""
        ...

    def add_tangent(
        self,
        poses: np.ndarray,
        rates: np.ndarray,
        touching: Touching,
        measured: Measured,
        forces: ContactForces,
        pattern: BodyPattern,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """Add -dh/dx and -dh/du to the block data."""
        ...

    def commit(self, poses: np.ndarray, young: np.ndarray | None = None) -> None:
        """A step was accepted: remember what has to be, such as the side that a point is on.

        `young` are the slots of contacts that may be impacts that go on; absent: all that touch.
        """
        ...

    def memory(self) -> np.ndarray:
        """All that is remembered, as one flat array."""
        ...

    def restore(self, memory: np.ndarray) -> None:
        """Remember that again; nothing: what there is at the start."""
        ...

    def forget(self) -> None:
        """Drop what the broad phase has found: it is renewed at the next poses."""
        ...

    def crossed(self, poses: np.ndarray) -> tuple[int, ...]:
        """Numbers of the pairs of which one has passed through the other since the last commit."""
        ...
