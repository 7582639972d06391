"""Typical sizes of the variables of a case, from which all tolerances and step sizes follow.

No size is a fixed number of metres, seconds or newtons. A case in other units, or a geometrically and dynamically similar
case, therefore takes the same steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from fsm.kernels.blocks import BlockMatrix

OF_DRIVES = 10.0
"""Scale of the speed relative to the largest speed of a drive. On the pulled strip a smaller scale needs more steps, and a
larger scale causes energy errors."""


@dataclass(frozen=True)
class Scales:
    """Typical sizes of the variables.

    Components of q, u and dx have the unit m (positions), 1 (angles, quaternions, slopes) or 1/m (derivatives of slopes).

    Attributes
    ----------
    length, extent : m
        Size of an element, and of the whole structure.
    drive_speed : m/s
        `OF_DRIVES` times the largest speed of a drive; 0 without drives.
    work : J
        Without drives, the largest work of the forces at rest, see `AtRest`.
    configuration : (nq,) array
        Size of each component of q: `length` for positions, else 1.
    velocity : (nu,) array
        Size of each component of u.
    increment : (nu,) array
        Size of each component of dx for one element: its length, 1 rad, or the inverse of its length.
    span : (nu,) array
        Size of each component of dx for the whole structure: its extent, 1 rad, or the inverse of `length`.
    resolution : (nu,) array
        Error of dx above which forces are meaningless, whatever the tolerance; infinite for most systems.
    positions : (nu,) bool array
        Whether each component of u is the velocity of a position.
    free : (nu,) bool array
        Whether each component of u is free to move.
    of_drives : (n_drives,) array
        Divisors that convert forces of drives to N: the moment of a turn acts at the extent of the structure.
    """

    length: float
    extent: float
    drive_speed: float
    work: float
    configuration: np.ndarray
    velocity: np.ndarray
    increment: np.ndarray
    span: np.ndarray
    resolution: np.ndarray
    positions: np.ndarray
    free: np.ndarray
    of_drives: np.ndarray

    @classmethod
    def of(
        cls, length: float, extent: float, drive_speed: float, speed: float, in_q: np.ndarray, in_u: np.ndarray,
        free: np.ndarray, resolution: float = math.inf, turns: Iterable[bool] = (), work: float = 0.0,
    ) -> Scales:  # fmt: skip
        """Sizes of variables from the sizes of the structure.

        Parameters
        ----------
        length, drive_speed, work : see the attributes
        extent : m
            Distance between the outermost places; at least `length` is used.
        speed : m/s
            Typical speed of a part.
        in_q, in_u : (nq,) and (nu,) int or bool arrays
            Power of the metre in the unit of each component: 1 for positions, 0 for angles and slopes.
        free : (nu,) bool array
        resolution : m
        turns : whether each drive turns bodies
        """
        extent = max(extent, length)
        power, positions = in_u.astype(float), in_u == 1
        increment = length**power
        return cls(
            length, extent, drive_speed, work, length ** in_q.astype(float), speed / length * increment, increment,
            np.where(positions, extent, increment), resolution / length * increment, positions, free,
            np.array([extent if turn else 1.0 for turn in turns]),
        )  # fmt: skip

    @cached_property
    def force_scale(self) -> np.ndarray:
        """Divisors (nu,) that convert generalised forces to N: moments become forces at the extent of the structure."""
        return self.extent / self.span

    @property
    def driven_velocity(self) -> np.ndarray:
        """Velocity (nu,) of all parts at the speed of the drives, times `OF_DRIVES`."""
        return self.drive_speed / self.length * self.increment

    def span_forces(self, stiffness: BlockMatrix) -> np.ndarray:
        """Largest generalised force (nu,) of an entry of each row of a stiffness matrix along `span`, N or N m.

        The force is 0 for components that are not free.
        """
        pattern = stiffness.pattern
        if not pattern.order:
            return np.zeros(0)
        forces = np.abs(stiffness.data) * self.span.reshape(-1, 1, pattern.size)[pattern.indices]
        return np.where(self.free, np.maximum.reduceat(forces.max(axis=2), pattern.indptr[:-1]).ravel(), 0.0)


class AtRest(NamedTuple):
    """Scales of a structure without drives, from the forces at rest: weight, loads, pressures and springs.

    Attributes
    ----------
    work : J
        Work of all forces along the span of the structure, of which the largest over time counts; 0 without forces.
    speed : m/s
        Part of the speed v of a translation with this kinetic energy, m v^2/2. Without any force at rest, nothing moves, and
        the speed is the extent times the frequency of the softest component.
    """

    work: float
    speed: float
