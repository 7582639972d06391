"""Records that systems return to solvers: energies, contacts, scales and linearisations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from fsm.kernels.blocks import BlockMatrix, BlockPattern, Elimination

if TYPE_CHECKING:
    from scipy import sparse


@dataclass(frozen=True)
class Energy:
    """Energies and powers of one state.

    Attributes
    ----------
    kinetic : J
    potential : J, by kind of element
    dissipated_power : W, >= 0
    input_power : W
        Power of loads and drives, without the power that accelerates driven bodies (the rate of `driven`).
    pair_power : (2, n_pairs) array, W
        Part of the dissipated power due to friction (first row) and damping (second row) of each contact pair.
    sliding_power : W
        Part of the dissipated power whose forces also act at rest: hysteresis of creases, friction with bristles.
    driven : J
        Kinetic energy of driven bodies, which follows from the prescribed motion.
    load_power : W
        Part of the input power that comes from loads; None if loads give all input power.
    """

    kinetic: float
    potential: dict[str, float]
    dissipated_power: float
    input_power: float
    pair_power: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))
    sliding_power: float = 0.0
    driven: float = 0.0
    load_power: float | None = None

    @property
    def stored(self) -> float:
        """Kinetic plus all potential energy, J."""
        return self.kinetic + self.stored_at_rest

    @property
    def stored_except_driven(self) -> float:
        """Kinetic energy of all bodies except driven ones, plus all potential energy, J."""
        return self.stored - self.driven

    @property
    def stored_at_rest(self) -> float:
        """All potential energy, J."""
        return sum(self.potential.values())

    def plus(self, nodes: Energy) -> Energy:
        """Sum with the energies and powers of nodes, all of whose input power is that of loads."""
        names = {**self.potential, **nodes.potential}
        return Energy(
            self.kinetic + nodes.kinetic,
            {name: self.potential.get(name, 0.0) + nodes.potential.get(name, 0.0) for name in names},
            self.dissipated_power + nodes.dissipated_power,
            self.input_power + nodes.input_power,
            self.pair_power,
            self.sliding_power + nodes.sliding_power,
            self.driven,
            (self.load_power or 0.0) + nodes.input_power,
        )


@dataclass(frozen=True)
class DriveState:
    """Travel (m) and reaction along the drive direction (N) of every drive, (n_drives,) arrays."""

    travel: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class PairState:
    """Contact pairs of one state, (n_pairs,) arrays.

    Attributes
    ----------
    force : N
        Sum of the normal forces.
    gap : m
        Smallest gap, at most the search distance; negative where faces penetrate each other.
    area : m^2
        Area in contact, mean of both faces.
    friction : N
        Sum of the magnitudes of the friction forces.
    slip : m/s
        Mean slip speed, weighted by the normal force of each contact; 0 without contact.
    friction_power, damping_power : W
        Power dissipated by friction, and by the damping of the normal force.
    """

    force: np.ndarray
    gap: np.ndarray
    area: np.ndarray
    friction: np.ndarray
    slip: np.ndarray
    friction_power: np.ndarray
    damping_power: np.ndarray

    def joined(self, other: PairState) -> PairState:
        """State of the same pairs with the contacts of both states."""
        force = self.force + other.force
        slip = np.divide(
            self.force * self.slip + other.force * other.slip, force, out=np.zeros(len(force)), where=force > 0.0
        )
        return PairState(
            force,
            np.minimum(self.gap, other.gap),
            self.area + other.area,
            self.friction + other.friction,
            slip,
            self.friction_power + other.friction_power,
            self.damping_power + other.damping_power,
        )


@dataclass(frozen=True)
class Observation:
    """Quantities of one state for the results file, besides q and u.

    `reaction` (N) is the largest reaction at any body; statics scales its residual by it. In dynamics it may be 0.
    """

    drive: DriveState
    energy: Energy
    reaction: float
    pairs: PairState


@cache
def _names(kind: Any) -> tuple[str, ...]:
    """Names of the fields of a dataclass."""
    return tuple(one.name for one in fields(kind))


def mapped(values: Any, function: Callable[[Any], Any]) -> Any:
    """Copy of nested dataclasses, tuples and dicts with a function of every float and array."""
    kind = type(values)
    if is_dataclass(kind):
        return kind(*(mapped(getattr(values, name), function) for name in _names(kind)))
    if isinstance(values, dict):
        return {name: mapped(item, function) for name, item in values.items()}
    if isinstance(values, tuple):
        return tuple(mapped(item, function) for item in values)
    return values if values is None or isinstance(values, bool | int) else function(values)


def as_rows(values: Any) -> Any:
    """One state as several: floats and arrays get a first axis of length one."""
    return mapped(values, lambda value: np.asarray(value)[None])


def row_of(values: Any, number: int) -> Any:
    """One of several states, whose floats and arrays have a first axis."""
    return mapped(values, lambda value: value[number])


@dataclass(frozen=True)
class Linearised:
    """Force h and its derivatives K = -dh/dx and D = -dh/du, on one pattern.

    With a previous state, rates are increments over the time step dt. The whole derivative -dh/dx is then K + D/dt.
    """

    force: np.ndarray
    stiffness: BlockMatrix
    damping: BlockMatrix


class LockedSprings(NamedTuple):
    """Locked directions of springs at rest.

    Attributes
    ----------
    rows : sparse (n, nu) matrix
        Gradients of their deformations.
    stiffness : (n,) array, N/m or N m/rad
    others : BlockMatrix
        Stiffness K = -dh/dx without that of the locked directions.
    """

    rows: sparse.csr_matrix
    stiffness: np.ndarray
    others: BlockMatrix


@dataclass(frozen=True)
class StepRejection:
    """Rejection of a step by the system.

    Attributes
    ----------
    part : -
        Recommended length of a new step, relative to the rejected step.
    reason : str
        Reason for the rejection; empty if a shorter step only reduces the error.
    """

    part: float
    reason: str = ""


PreviousState = tuple[float, np.ndarray]
"""Previous state of a quasi-static path: time (s) and configuration."""


Ready: TypeAlias = Callable[[BlockPattern], tuple[Elimination, np.ndarray]]
"""Function that gives the elimination of a pattern, and the block data of its factors."""


Depths: TypeAlias = Any
"""Depths at which contacts are linearised; only the system interprets them."""
