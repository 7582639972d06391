"""Depths of contacts as additional unknowns of Newton's method in statics; see `fsm.interactions.contact.contact_depths`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.contact.contact_depths import advance_depths
from fsm.interactions.contact.shapes import ContactForces
from fsm.kernels.keys import find_keys
from fsm.model.contact.contact_geometry import ContactKinematics
from fsm.model.contact.normal_force import NormalForce


class ContactDepths(NamedTuple):
    """Depths at which the normal law of contacts is linearised.

    Attributes
    ----------
    key : (k,) int array
        Keys of the contacts with a depth, ascending. A depth is kept, and the contact stays closed, until the linearised
        force would be tensile.
    depth : (k,) array, m
    most : N
        Limit of the normal force; it limits the depth of linearisation of contacts without a stored depth.
    """

    key: np.ndarray
    depth: np.ndarray
    most: float

    def at(
        self,
        key: np.ndarray,
        depth: np.ndarray,
        closing: np.ndarray,
        onset: np.ndarray,
        share: np.ndarray,
        normal: NormalForce,
    ) -> np.ndarray:
        """Depths of linearisation (count,) for contacts of geometric depth `depth`; other arguments as in `NormalLaw`."""
        place = find_keys(self.key, key)
        known = place >= 0
        if known.all():
            return np.asarray(self.depth[place])
        at = depth.copy()
        at[known] = self.depth[place[known]]
        if self.most > 0.0:
            force, _ = normal.law.force(depth, closing, onset, share, normal.params)
            over = ~known & (force > self.most)
            at[over] *= (self.most / force[over]) ** (1.0 / normal.exponent)
        return at

    def advanced(
        self,
        key: np.ndarray,
        measured: ContactKinematics,
        at: np.ndarray,
        acting: np.ndarray,
        forces: ContactForces,
        change: np.ndarray,
        per_second: float,
    ) -> ContactDepths:
        """Depths after a change (n_bodies, 3 or 6) of the poses, to first order; contacts with tensile force are released.

        Parameters
        ----------
        key, at, acting : (count,) arrays of contacts
            `acting` (N) is the law linearised at `at`, evaluated at the geometric depths.
        measured, forces : ContactKinematics and ContactForces
            Forces of the law at `at`.
        per_second : 1/s
            Inverse of the time since the last state; zero in statics.
        """
        depth = advance_depths(
            measured.bodies, measured.gradient, change, per_second, at, forces.normal, acting,
            forces.by_depth, forces.by_closing,
        )  # fmt: skip
        pressing = depth > 0.0
        key, depth = key[pressing], depth[pressing]
        order = np.argsort(key, kind="stable")
        return ContactDepths(key[order], depth[order], self.most)
