"""Interface between solvers and models: a mechanical system M(q) u' = h(t, q, u), q' = T(q) u.

Finite segments (`fsm.segments`) and absolute nodal coordinates (`fsm.ancf`) implement it. All quantities are in SI. The
configuration q holds positions and, for each rigid body in space, a unit quaternion with the scalar part first. The
velocity u holds velocities in inertial axes and angular rates in body axes. Increments dx have the components of u.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np
from scipy import sparse

from fsm.blocks import BlockMatrix, BlockPattern, Elimination

__all__ = [
    "ArraySystem", "Depths", "DriveState", "Energy", "Linearised", "MixedSystem", "NewtonRules", "Observation", "PairState",
    "PreviousState", "Ready", "Scales", "NewtonSolution", "StepRejection", "System",
]  # fmt: skip


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
        Part of the dissipated power whose forces hold at rest, too: hysteresis of creases, friction with bristles.
    driven : J
        Kinetic energy of driven bodies, which follows from the prescribed motion.
    load_power : W
        Part of the input power that loads give; None for all of it.
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
    def stored_freely(self) -> float:
        """Kinetic energy of all bodies except driven ones, plus all potential energy, J."""
        return self.stored - self.driven

    @property
    def stored_at_rest(self) -> float:
        """All potential energy, J."""
        return sum(self.potential.values())


@dataclass(frozen=True)
class DriveState:
    """Travel (m) and reaction along the drive direction (N) of every drive, (n_drives,) arrays."""

    travel: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class Scales:
    """Typical sizes of the variables, from which tolerances follow.

    Attributes
    ----------
    length : m
    configuration : (nq,) array
        Size of each component of q: `length` for positions, 1 for angles and quaternions.
    velocity : (nu,) array
        Size of each component of u.
    increment : (nu,) array
        Size of each component of dx for one element: its length, or 1 rad.
    span : (nu,) array
        Size of each component of dx for the whole structure: its extent, or 1 rad.
    resolution : (nu,) array
        Error of dx above which forces are meaningless, whatever the tolerance; infinite for most systems.
    """

    length: float
    configuration: np.ndarray
    velocity: np.ndarray
    increment: np.ndarray
    span: np.ndarray
    resolution: np.ndarray

    @cached_property
    def force_scale(self) -> np.ndarray:
        """Divisors (nu,) that convert generalised forces to N: moments become forces at the end of an element."""
        return self.increment / self.length

    @cached_property
    def largest_span(self) -> float:
        """Largest component of `span`."""
        return float(self.span.max(initial=0.0))


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

    `reaction` (N) is the largest reaction at any body, with which statics scales its residual. In dynamics it may be 0.
    """

    drive: DriveState
    energy: Energy
    reaction: float
    pairs: PairState


@dataclass(frozen=True)
class Linearised:
    """Force h and its derivatives K = -dh/dx and D = -dh/du, on one pattern.

    With a previous state, rates are increments over the time step dt. The whole derivative -dh/dx is then K + D/dt.
    """

    force: np.ndarray
    stiffness: BlockMatrix
    damping: BlockMatrix


@dataclass(frozen=True)
class StepRejection:
    """Rejection of a step by the system.

    Attributes
    ----------
    part : -
        Recommended length of a new step, over that of the rejected one.
    reason : str
        Reason for the rejection; empty if a shorter step only reduces the error.
    """

    part: float
    reason: str = ""


PreviousState = tuple[float, np.ndarray]
"""Previous state of a quasi-static path: time (s) and configuration."""


class System(Protocol):
    """Protocol of a mechanical system; see the module docstring.

    Shapes: q (nq,); u, h and dx (nu,); K and D (nu, nu), sparse on one pattern. Statics passes u = None: all velocities
    are zero, and drives are at their positions at time t. Quasi-statics passes the previous state as `before`: u holds the
    mean velocities since then, and rates of deformation are differences over that time.

    Systems derive from this class. The methods with a body suit a system without contacts and internal variables, whose
    configurations form a vector space.
    """

    nq: int
    nu: int
    rate_dependent: bool
    """Whether forces depend on velocities: dampers, friction."""
    fixed_pattern: bool
    """Whether the pattern of K and D is constant, because no bodies can come into contact."""
    of_vectors: bool
    """Whether coordinates are slopes, not angles: a straight path between two states strains the elements."""

    @property
    def dof(self) -> int:
        """Number of degrees of freedom: components of u that are free to move."""
        ...

    def initial(self) -> tuple[np.ndarray, np.ndarray]:
        """Configuration and velocity at time zero."""
        ...

    def end_time(self) -> float | None:
        """Time at which the last drive completes its travel, s; None without a drive."""
        ...

    def progress(self, t: float) -> float:
        """Path parameter: travel of the drives, or the time without a drive; states are smooth functions of it."""
        return t

    def break_times(self) -> list[float]:
        """Times (s) at which loads or drives are not smooth; a step should end there."""
        ...

    def scales(self) -> Scales:
        """Typical sizes of q and u."""
        ...

    def kinematic_map(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Rate of the configuration, q' = T(q) u, with a term that keeps quaternion norms at one."""
        return u

    def kinematic_jacobian(self, q: np.ndarray, u: np.ndarray) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """d(q')/dq (nq, nq) and d(q')/du = T (nq, nu)."""
        return sparse.csr_matrix((self.nq, self.nq)), sparse.eye_array(self.nu, format="csr")

    def tangent_map(self, q: np.ndarray) -> sparse.csr_matrix:
        """Derivative dx/dq (nu, nq): increment in the tangent space for a change of q."""
        return sparse.eye_array(self.nu, format="csr")

    def retract(self, q: np.ndarray, dx: np.ndarray) -> np.ndarray:
        """Configuration moved by an increment of the tangent space."""
        return q + dx

    def difference(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Increment dx from configuration `start` to `end`, the inverse of `retract`."""
        return end - start

    def increment_map(self, dx: np.ndarray) -> np.ndarray | None:
        """Derivative of an increment by a small increment after it, one block per node, (n, size, size).

        None means the identity.

        difference(q, retract(retract(q, dx), d)) = dx + increment_map(dx) d + O(d^2)
        """
        return None

    def mass(self, q: np.ndarray) -> sparse.csr_matrix:
        """Mass matrix (nu, nu)."""
        ...

    def inertia(self, q: np.ndarray, pattern: BlockPattern) -> np.ndarray:
        """Mass matrix as block data on the pattern of `linearise`."""
        ...

    def acceleration(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """M(q)^-1 h(t, q, u), (nu,)."""
        ...

    def force(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> np.ndarray:
        """h: applied + elastic + contact - gyroscopic, (nu,), N and N m."""
        ...

    def balance(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Force as by `force`, and the static reaction along the direction of every drive, (n_drives,), N."""
        ...

    def force_rate(self, t: float, q: np.ndarray) -> np.ndarray:
        """Partial derivative dh/dt at rest, due to drives and loads that depend on time, (nu,), N/s and N m/s."""
        ...

    def tangent(self, t: float, q: np.ndarray, u: np.ndarray | None) -> tuple[sparse.bsr_matrix, sparse.bsr_matrix]:
        """Exact derivatives K = -dh/dx and D = -dh/du."""
        linear = self.linearise(t, q, u)
        return linear.stiffness.bsr(), linear.damping.bsr()

    def linearise(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Linearised:
        """Force and both tangents in one pass; the pattern is the same object until the contact search adds blocks."""
        ...

    def energy(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Energy:
        """Energies and powers of a state."""
        ...

    def reactions(self, t: float, q: np.ndarray, u: np.ndarray | None) -> np.ndarray:
        """Reaction wrench on each held or driven body, (n_bodies, 3 or 6), N and N m; zero for free bodies."""
        ...

    def observe(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Observation:
        """Drive, energies and contacts of a state."""
        ...

    def shape(self, t: float, q: np.ndarray) -> np.ndarray:
        """Corner points (n_quads, 4, 3) of the visible faces, m."""
        ...

    def commit(self, t: float, q: np.ndarray, u: np.ndarray, before: PreviousState | None = None) -> None:
        """Update the internal variables for an accepted state.

        Internal variables are sides and first touch of contacts, friction bristles, and hysteresis of creases. Solvers
        call this method at the start and at the end of every accepted step. No other method changes internal variables,
        so between two calls forces depend on the state alone.
        """
        return

    def memory(self) -> np.ndarray:
        """All internal variables as one flat array; empty for most scenes."""
        return np.zeros(0)

    def restore(self, memory: np.ndarray) -> None:
        """Set the internal variables, for a restart or after rejected steps; an empty array resets them."""
        return

    def counters(self) -> np.ndarray:
        """Counters for the summary, (n,); empty for most systems."""
        return np.zeros(0)

    def clear_caches(self, counters: np.ndarray) -> None:
        """Clear all caches, so that later results equal the results of a new system, and set the counters to `counters`.

        Internal variables are not affected, see `restore`.
        """
        return

    def lacks_arrays(self) -> bool:
        """Whether an `ArraySystem` needs new arrays, because bodies have met that the arrays do not couple."""
        return False

    def to_arrays(self) -> None:
        """Copy the internal variables of an `ArraySystem` to its arrays, before a kernel takes steps."""
        return

    def from_arrays(self) -> np.ndarray:
        """Copy the internal variables from the arrays; returns the energy (2, n_pairs) that contact pairs dissipated, J."""
        return np.zeros((2, 1))

    def contacts_opened(self) -> bool:
        """Whether contacts that were closed in the last tangents are open in the last evaluated state.

        The tangents are then too stiff, so a small correction does not prove convergence.
        """
        return False

    def rejection(self, t: float, q: np.ndarray, u: np.ndarray | None, step: float) -> StepRejection | None:
        """Rejection of a state as the end of a step of the given length (s) since the last commit; None to accept it.

        In statics u is None, and impacts are not resolved.
        """
        return None

    def shortest_step(self) -> float:
        """Step (s) below which errors cut no step, because the mesh does not resolve faster waves; 0 for none."""
        return 0.0

    def longest_step(self, t: float, q: np.ndarray, u: np.ndarray) -> float:
        """Longest step from an accepted state that resolves its contacts, s; infinite for most systems."""
        return math.inf

    def worst_body(self, vector: np.ndarray) -> str:
        """Name of the body with the largest entry of a (nu,) vector, for messages."""
        ...

    def contact_force(self, t: float, q: np.ndarray) -> float:
        """Largest contact force on a body at rest, N; 0 for most systems."""
        return 0.0

    def max_joint_opening(self, t: float, q: np.ndarray) -> tuple[float, str]:
        """Largest opening (m) of a joint of the structure, and the name of the joint."""
        return 0.0, "none"


Ready: TypeAlias = Callable[[BlockPattern], tuple[Elimination, np.ndarray]]
"""Function that gives the elimination of a pattern, and the block data of its factors."""


@runtime_checkable
class ArraySystem(Protocol):
    """System that can take steps in kernels, if all its forces have arrays."""

    def arrays(self, ready: Ready) -> Any:
        """`fsm.stepping.model.ArrayModel` of this system, always the same; None if something has no arrays.

        The last of `arrays.flags` is 1 where a step was unable to solve its equations. If `lacks_arrays`, a new model.
        """
        ...


@runtime_checkable
class ArrayRestSystem(Protocol):
    """System whose equilibria are found in kernels, if all its forces have arrays."""

    def arrays_at_rest(self, ready: Ready) -> Any:
        """`fsm.stepping.equilibrium.RestModel` of this system, always the same; None if something has no arrays."""
        ...


Depths: TypeAlias = Any
"""Depths at which contacts are linearised; only the system interprets them."""


class NewtonRules(NamedTuple):
    """Convergence criteria of Newton's method for one quasi-static step.

    Attributes
    ----------
    tolerance : -
        Residual at an equilibrium, over the largest reaction.
    round_off : -
        Round-off of forces, over stiffness times size.
    small_correction : -
        Correction, over the span of the structure or in radians, below which the residual is checked before the tangent.
    largest_correction : -
        Largest correction, over the span of the structure or in radians.
    overshoot : -
        A correction overshoots if its work changes sign and exceeds this multiple of the work before.
    large_residual, slow_reduction, patience : -, -, iterations
        The iteration stops after `patience` iterations if the residual exceeds `large_residual` times the largest reaction,
        and `slow_reduction` times the first residual.
    max_iterations : largest number of iterations
    """

    tolerance: float
    round_off: float
    small_correction: float
    largest_correction: float
    overshoot: float
    large_residual: float
    slow_reduction: float
    patience: float
    max_iterations: int


class NewtonSolution(NamedTuple):
    """Equilibrium found by Newton's method: see `fsm.solve.equilibrium_step.Equilibrium`.

    Attributes
    ----------
    q, efforts : configuration, and the forces and moments of the springs
    residual : (nu,) array, N and N m
    matrix : BlockMatrix
        Matrix K + D/dt of the last factorisation.
    symmetric : bool
        Whether the matrix is symmetric.
    iterations : int
    round_off : N
        Round-off floor of the residual.
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
    """System of stiff springs for a mixed Newton method, with forces of springs as unknowns besides q.

    The efforts e = k (m(q) - x0) (forces and moments of springs) are separate equations. The geometric stiffness then uses
    efforts that are advanced to first order in each iteration. The displacement method uses k (m(q) - x0) instead, which a
    small error of position in a stiff spring makes meaningless. The equilibria are the same (Magisano, Leonetti and
    Garcea, 2017). Contacts are linearised at depths that are advanced in the same way; they stay closed until their force
    would become tensile.
    """

    def efforts(
        self, t: float, q: np.ndarray, before: PreviousState | None = None, dx: np.ndarray | None = None
    ) -> np.ndarray:
        """Efforts of all springs at q, as one array; with dx, efforts after that increment to first order."""
        ...

    def linearise_mixed(
        self,
        t: float,
        q: np.ndarray,
        u: np.ndarray | None,
        before: PreviousState | None,
        efforts: np.ndarray,
        depths: Depths,
    ) -> Linearised:
        """Linearisation as by `System.linearise`, but with given efforts of springs and given depths of contacts."""
        ...

    def depths(self, most: float) -> Depths:
        """Depths of all contacts at the last accepted step; new contacts start with at most the force `most` (N)."""
        ...

    def advance_depths(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None, dx: np.ndarray, depths: Depths
    ) -> Depths:
        """Depths after an increment, with forces to first order; other arguments as in `linearise_mixed`."""
        ...

    def newton_pattern(self) -> BlockPattern | None:
        """Pattern of the matrices if the system runs Newton's method in one call (see `newton_solve`); otherwise None."""
        ...

    def newton_solve(
        self,
        t: float,
        q: np.ndarray,
        before: PreviousState,
        efforts: np.ndarray,
        largest_reaction: float,
        rules: NewtonRules,
        elimination: Elimination,
        factors: np.ndarray,
    ) -> NewtonSolution | None:
        """Equilibrium at time t by the iterations of `EquilibriumStep` in one call; None if this fast method fails.

        `factors` receives the factors of the last matrix.
        """
        ...
