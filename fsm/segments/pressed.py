"""Depths of contacts as unknowns beside the positions, for Newton's method of statics: see `fsm.interactions.pressed`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.pressed import advance_depths
from fsm.kernels.keys import find_keys
from fsm.segments.contact_geometry import ContactForces, Measured
from fsm.segments.normal_force import NormalForce

__all__ = ["Pressed"]


class Pressed(NamedTuple):
    """Depths at which the normal law of contacts is linearised.

    Attributes
    ----------
    key : (k,) int array
        Contacts that have one, `ContactGeometry.keys`, ascending. They are held closed until their force would pull.
    depth : (k,) array, m
    most : N
        A contact that has none is linearised no deeper than this force would press it, if there is one.
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
        """Depths (count,) for contacts that are `depth` deep; other arguments as in `NormalLaw`."""
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
        measured: Measured,
        at: np.ndarray,
        acting: np.ndarray,
        forces: ContactForces,
        change: np.ndarray,
        per_second: float,
        exponent: float,
    ) -> Pressed:
        """The same after a change (n_bodies, 3 or 6) of the poses, forces to first order; what would pull is let go.

        Parameters
        ----------
        key, at, acting : of contacts
            `acting` (N) is the law, linearised at `at`, at the contacts' own depths.
        measured, forces : Measured and ContactForces
            Forces by the law at `at`.
        per_second : 1/s
            One over the time since the last state; zero at rest.
        """
        depth = advance_depths(
            measured.bodies, measured.gradient, change, per_second, exponent, at, forces.normal, acting,
            forces.by_depth, forces.by_closing,
        )  # fmt: skip
        pressing = depth > 0.0
        key, depth = key[pressing], depth[pressing]
        order = np.argsort(key, kind="stable")
        return Pressed(key[order], depth[order], self.most)
