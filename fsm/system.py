"""The one interface that solvers know: a mechanical system M(q) u' = h(t, q, u), q' = T(q) u.

Finite segments and (later) ANCF are implementations. Conventions: SI; q holds configurations (quaternions scalar first,
one of unit norm a body), u velocities (inertial axes) and body rates; increments dx live in the tangent space, as u does.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np
from scipy import sparse

from fsm.blocks import BlockMatrix, BlockPattern, Elimination

__all__ = [
    "Before", "Depths", "DriveState", "Energy", "Linearised", "MixedSystem", "NewtonRules", "Objection",
    "Observation", "PairState", "Scales", "Settled", "System",
]  # fmt: skip


@dataclass(frozen=True)
class Energy:
    """Energies and powers of one state.

    Attributes
    ----------
    kinetic : J
    potential : J, by what stores it
    dissipated_power : W, >= 0
    input_power : W
        Of loads and drives, but for what accelerates driven bodies: that is the change of `driven`.
    pair_power : (2, n_pairs) array, W
        Of the dissipated power, what friction (first row) and damping (second) of every contact pair take.
    sliding_power : W
        Of the dissipated power, what is taken without regard to rates: creases whose way back is another. Their forces
        are there at rest too.
    driven : J
        Part of the kinetic energy that driven bodies have; it is known, and no rule of integration has to find it.
    """

    kinetic: float
    potential: dict[str, float]
    dissipated_power: float
    input_power: float
    pair_power: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))
    sliding_power: float = 0.0
    driven: float = 0.0

    @property
    def stored(self) -> float:
        """Kinetic plus all potential energy, J."""
        return self.kinetic + self.stored_at_rest

    @property
    def stored_freely(self) -> float:
        """The same without the kinetic energy of driven bodies, J."""
        return self.stored - self.driven

    @property
    def stored_at_rest(self) -> float:
        """All potential energy, J."""
        return sum(self.potential.values())


@dataclass(frozen=True)
class DriveState:
    """Travel (m) and reaction along the pull (N) of every drive, (n_drives,) arrays."""

    travel: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class Scales:
    """Typical sizes that tolerances follow from.

    Attributes
    ----------
    length : m
    configuration : (nq,) array
        Size of each component of q: the length for positions, one for angles and quaternions.
    velocity : (nu,) array
        Size of each component of u.
    increment : (nu,) array
        Size of each component of an increment for one element: the length, or a radian.
    span : (nu,) array
        The same for the whole structure: how far it reaches, or a radian.
    resolution : (nu,) array
        Error of an increment above which forces mean nothing, however loose a tolerance is; infinite in most systems.
    """

    length: float
    configuration: np.ndarray
    velocity: np.ndarray
    increment: np.ndarray
    span: np.ndarray
    resolution: np.ndarray

    @cached_property
    def of_forces(self) -> np.ndarray:
        """What forces (nu,) are divided by to be compared in N: moments count as forces at the end of an element."""
        return self.increment / self.length

    @cached_property
    def widest(self) -> float:
        """Largest of `span`."""
        return float(self.span.max(initial=0.0))


@dataclass(frozen=True)
class PairState:
    """The contact pairs of one state, (n_pairs,) arrays.

    Attributes
    ----------
    force : N
        Sum of the normal forces.
    gap : m
        The smallest, at most as far as contacts look; negative where the faces penetrate.
    area : m^2
        Of the face that touches, the mean of both faces.
    friction : N
        Sum of the magnitudes of the friction forces.
    slip : m/s
        Mean slip speed, each contact weighted by its normal force; 0 without any.
    friction_power, damping_power : W
        Dissipated by friction, and by the damping of the normal force.
    """

    force: np.ndarray
    gap: np.ndarray
    area: np.ndarray
    friction: np.ndarray
    slip: np.ndarray
    friction_power: np.ndarray
    damping_power: np.ndarray

    def joined(self, other: PairState) -> PairState:
        """The same pairs with the contacts of both."""
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
    """What a result file keeps of one state besides q and u.

    `reaction` (N) is the largest one at any body, which statics measures its forces by; in motion it may be left out: 0.
    """

    drive: DriveState
    energy: Energy
    reaction: float
    pairs: PairState


@dataclass(frozen=True)
class Linearised:
    """Force h and its derivatives K = -dh/dx and D = -dh/du, on one pattern.

    With a last state, D is that by increments since then over the time: K + D/(time since) is the whole of -dh/dx.
    """

    force: np.ndarray
    stiffness: BlockMatrix
    damping: BlockMatrix


@dataclass(frozen=True)
class Objection:
    """Why a step should not be accepted.

    Attributes
    ----------
    part : -
        Part of the step that may do.
    reason : str
        Nothing, when a shorter step is only more exact.
    """

    part: float
    reason: str = ""


Before = tuple[float, np.ndarray]
"""Time (s) and configuration of the last state of a quasi-static path."""


class System(Protocol):
    """See the module docstring; shapes: q (nq,), u and h and dx (nu,), K and D (nu, nu) sparse on one pattern.

    Where u may be None, it means everything at rest, the drives too, which stand where they are at time t: statics.
    With `before`, the time and configuration of the last state, u holds the mean velocities since then, the drives move at
    theirs, and deformation rates are differences over that time: quasi-statics.
    """

    nq: int
    nu: int
    rate_dependent: bool
    """Whether velocities matter besides inertia: dampers, friction."""
    fixed_pattern: bool
    """Whether K and D keep their pattern for ever: no bodies that can meet."""

    def initial(self) -> tuple[np.ndarray, np.ndarray]:
        """Configuration and velocity at time zero."""
        ...

    def end_time(self) -> float | None:
        """Time at which the last drive has done its travel, s; None without a drive."""
        ...

    def progress(self, t: float) -> float:
        """How far drives, or without one the time, have come: rises with time, and states are smooth in it."""
        ...

    def break_times(self) -> list[float]:
        """Times, s, at which loads or drives are not smooth, so that a step should end there."""
        ...

    def scales(self) -> Scales:
        """Typical sizes of q and u."""
        ...

    def kinematic_map(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Rate of the configuration, q' = T(q) u; holds quaternion norms at one."""
        ...

    def kinematic_jacobian(self, q: np.ndarray, u: np.ndarray) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """d(q')/dq (nq, nq) and d(q')/du = T (nq, nu)."""
        ...

    def tangent_map(self, q: np.ndarray) -> sparse.csr_matrix:
        """dx/dq (nu, nq): the increment in the tangent space that a change of q amounts to."""
        ...

    def retract(self, q: np.ndarray, dx: np.ndarray) -> np.ndarray:
        """Configuration moved by an increment of the tangent space."""
        ...

    def difference(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """The increment dx that moves configuration `start` to `end`: the inverse of `retract`."""
        ...

    def increment_map(self, dx: np.ndarray) -> np.ndarray | None:
        """Change of an increment by a small one after it, a block a node, (n, size, size); None where it is the identity.

        difference(q, retract(retract(q, dx), d)) = dx + increment_map(dx) d + O(d^2)
        """
        ...

    def mass(self, q: np.ndarray) -> sparse.csr_matrix:
        """Mass matrix (nu, nu)."""
        ...

    def inertia(self, q: np.ndarray, pattern: BlockPattern) -> np.ndarray:
        """The mass matrix as block data on the pattern of `linearise`."""
        ...

    def acceleration(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """M(q)^-1 h(t, q, u), (nu,)."""
        ...

    def force(self, t: float, q: np.ndarray, u: np.ndarray | None, before: Before | None = None) -> np.ndarray:
        """h: applied + elastic + contact - gyroscopic, (nu,), N and N m."""
        ...

    def balance(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: Before | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """The force, as `force` has it, and the reaction along the pull (N) of every drive, (n_drives,), in statics."""
        ...

    def force_rate(self, t: float, q: np.ndarray) -> np.ndarray:
        """dh/dt at rest and at a fixed configuration: what drives and loads that move change, (nu,), N/s and N m/s."""
        ...

    def tangent(self, t: float, q: np.ndarray, u: np.ndarray | None) -> tuple[sparse.bsr_matrix, sparse.bsr_matrix]:
        """K = -dh/dx and D = -dh/du, exact."""
        ...

    def linearise(self, t: float, q: np.ndarray, u: np.ndarray | None, before: Before | None = None) -> Linearised:
        """Force and both tangents in one pass; the pattern is the same object until bodies come near that were not."""
        ...

    def energy(self, t: float, q: np.ndarray, u: np.ndarray | None, before: Before | None = None) -> Energy:
        """Energies and powers of a state."""
        ...

    def reactions(self, t: float, q: np.ndarray, u: np.ndarray | None) -> np.ndarray:
        """Wrench that holds or drives each body without degrees of freedom, (n_bodies, 3 or 6); zero for free bodies."""
        ...

    def observe(self, t: float, q: np.ndarray, u: np.ndarray | None, before: Before | None = None) -> Observation:
        """Drive, energies and contacts of a state."""
        ...

    def shape(self, t: float, q: np.ndarray) -> np.ndarray:
        """Corner points (n_quads, 4, 3) of what a person would see, m."""
        ...

    def commit(self, t: float, q: np.ndarray, u: np.ndarray, before: Before | None = None) -> None:
        """A step was accepted: what remembers (sides and onsets of contacts, bristles of friction, sliders of creases)
        takes this state.

        Solvers call it at the start and at the end of every step that they keep; nothing else changes what is remembered,
        so that between two calls forces are functions of the state alone.
        """
        ...

    def memory(self) -> np.ndarray:
        """All that is remembered, as one flat array; empty in most scenes."""
        ...

    def restore(self, memory: np.ndarray) -> None:
        """Remember that again: a solve goes on, or steps are taken back. Nothing: a solve begins."""
        ...

    def counted(self) -> np.ndarray:
        """What it has counted so far for the summary, (n,); empty in most."""
        ...

    def forget(self, counted: np.ndarray) -> None:
        """Drop all that was kept to be faster, so that what comes is what a new system would give; count on from `counted`.

        What is remembered, which forces depend on, is another matter: see `restore`.
        """
        ...

    def parted(self) -> bool:
        """Whether contacts closed where the tangents were taken last are open at the state looked at last.

        Then those tangents are far too stiff there, and a correction that they give may be small for that alone.
        """
        ...

    def objection(self, t: float, q: np.ndarray, u: np.ndarray | None, step: float) -> Objection | None:
        """What stands against accepting the state as the end of a step of that length (s) since the last commit.

        u is None in statics, where no impacts are resolved.
        """
        ...

    def longest_step(self, t: float, q: np.ndarray, u: np.ndarray) -> float:
        """Longest step from an accepted state that resolves what goes on there, s; infinite in most."""
        ...

    def blame(self, vector: np.ndarray) -> str:
        """Name of the body that the largest entry of a (nu,) vector belongs to, for messages."""
        ...

    def contact_force(self, t: float, q: np.ndarray) -> float:
        """Largest force that contacts put on a body, everything at rest, N; 0 in most."""
        ...

    def widest_joint(self, t: float, q: np.ndarray) -> tuple[float, str]:
        """Largest distance (m) by which a joint of the structure itself has come apart, and its name."""
        ...


Depths: TypeAlias = Any
"""Depths that contacts are linearised at; nobody but the system looks into them."""


class NewtonRules(NamedTuple):
    """When Newton's method for one quasi-static step has found an equilibrium, and when it should be watched.

    Attributes
    ----------
    tolerance : -
        Forces left over at an equilibrium, over the largest reaction.
    round_off : -
        Forces are known to this part of stiffness times size.
    nearly : -
        After a step smaller than this, over the structure's span or radians, the forces alone are looked at first.
    reach : -
        Largest step, over the same.
    overshoot : -
        A step whose work turns to more than minus so many times what it was has gone much too far.
    far, hardly, late : -, -, iterations
        After so many iterations forces left over that are `far` times the largest reaction and `hardly` smaller than the
        first ones are given up.
    most : iterations
    """

    tolerance: float
    round_off: float
    nearly: float
    reach: float
    overshoot: float
    far: float
    hardly: float
    late: float
    most: int


class Settled(NamedTuple):
    """What Newton's method has found: see `fsm.solve.equilibrium_step.Equilibrium`.

    Attributes
    ----------
    q, efforts : configuration, and the efforts of the springs there
    residual : (nu,) array, N and N m
    matrix : BlockMatrix
        K + D/dt that the last factors are of.
    symmetric : bool
        Whether it is.
    iterations : int
    round_off : N
        Forces smaller than this are nothing.
    """

    q: np.ndarray
    efforts: np.ndarray
    residual: np.ndarray
    matrix: BlockMatrix
    symmetric: bool
    iterations: int
    round_off: float


@runtime_checkable
class MixedSystem(Protocol):
    """A system of stiff springs that lets Newton's method for statics take their efforts as unknowns beside q.

    With efforts e = k (m(q) - x0) as equations of their own, Newton's matrix has the geometric stiffness of e as it is
    advanced from one iteration to the next, to first order, instead of that of k (m(q) - x0): a position that is slightly
    off strains a stiff spring out of all proportion, and the stiffness of such efforts means nothing. All else, and the
    equilibria, are the same (Magisano, Leonetti, Garcea 2017). Contacts, whose law is not linear, are linearised at depths
    that are advanced in the same way, and are held closed until they would pull.
    """

    def efforts(
        self, t: float, q: np.ndarray, before: Before | None = None, dx: np.ndarray | None = None
    ) -> np.ndarray:
        """Efforts of the springs at q, one after the other; with dx, as they are after that increment to first order."""
        ...

    def linearise_mixed(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray | None,
        before: Before | None,
        efforts: np.ndarray,
        depths: Depths,
    ) -> Linearised:
        """As `System.linearise`, the geometric stiffness of the springs that of the given efforts, contacts at depths."""
        ...

    def depths(self, most: float) -> Depths:
        """Of all contacts, as they were when the last step was accepted; new ones no deeper than `most` (N) presses them."""
        ...

    def advance_depths(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: Before | None, dx: np.ndarray, depths: Depths
    ) -> Depths:
        """As they are after an increment, the forces to first order; other arguments those of `linearise_mixed`."""
        ...

    def settles(self) -> BlockPattern | None:
        """The pattern of its matrices, if it can run Newton's method in one call; see `settle`."""
        ...

    def settle(
        self,
        t: float,
        q: np.ndarray,
        before: Before,
        efforts: np.ndarray,
        largest_reaction: float,
        rules: NewtonRules,
        elimination: Elimination,
        factors: np.ndarray,
    ) -> Settled | None:
        """The equilibrium at time t, by the iterations of `EquilibriumStep` in one call; None where that takes more care.

        `factors` gets those of the last matrix.
        """
        ...
