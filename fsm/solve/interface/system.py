"""Interface between solvers and models: a mechanical system M(q) u' = h(t, q, u), q' = T(q) u.

Finite segments (`fsm.model`) and absolute nodal coordinates (`fsm.model.nodes`) implement it. All quantities are in SI. The
configuration q holds positions and, for each rigid body in space, a unit quaternion with the scalar part first. The
velocity u holds velocities in inertial axes and angular rates in body axes. Increments dx have the components of u.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from fsm.kernels.blocks import BlockMatrix, BlockPattern
from fsm.solve.interface.records import (
    Depths,
    Energy,
    Linearised,
    LockedSprings,
    Observation,
    PreviousState,
    Ready,
    StepRejection,
)
from fsm.solve.interface.scales import Scales

if TYPE_CHECKING:
    from scipy import sparse


class System(Protocol):
    """Protocol of a mechanical system; see the module docstring.

    Shapes: q (nq,); u, h and dx (nu,); K and D (nu, nu), sparse on one pattern. Statics passes u = None: all velocities
    are zero, and drives are at their positions at time t. Quasi-statics passes the previous state as `before`. Then u
    contains the mean velocities since that state, and rates of deformation are differences over that time.

    Systems derive from this class. The methods with a body suit a system without contacts and internal variables, whose
    configurations form a vector space.
    """

    nq: int
    nu: int
    rate_dependent: bool
    """Whether forces depend on velocities: dampers, friction."""
    fixed_pattern: bool
    """Whether the pattern of K and D is constant, because no bodies can come into contact."""
    remembers: bool = False
    """Whether elements have a memory, which channels read: a kernel stops at each saved state."""
    replays: bool = False
    """Whether this memory follows from the states alone: `replayed` finds it again, and a kernel need not stop."""
    of_vectors: bool
    """Whether coordinates are slopes, not angles: a straight path between two states strains the elements."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.nq} coordinates, {self.dof} degrees of freedom)"

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

    def drive_turns(self, number: int) -> bool:
        """Whether a drive (by its number from 0) turns bodies: its travel is an angle (rad), its force a moment (N m)."""
        return False

    def progress(self, t: float) -> float:
        """Path parameter: travel of the drives, or the time without a drive; states are smooth functions of it."""
        return t

    def break_times(self) -> list[float]:
        """Times (s) at which loads or drives are not smooth; a step should end at each of them."""
        ...

    def peak_times(self) -> list[float]:
        """Times (s) among which loads have their largest sizes."""
        return self.break_times()

    def scales(self) -> Scales:
        """Typical sizes of q and u; see `fsm.solve.interface.scales`."""
        ...

    def kinematic_map(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Rate of the configuration, q' = T(q) u, with a term that keeps quaternion norms at one."""
        return u

    def kinematic_jacobian(self, q: np.ndarray, u: np.ndarray) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """d(q')/dq (nq, nq) and d(q')/du = T (nq, nu)."""
        from scipy import sparse

        return sparse.csr_matrix((self.nq, self.nq)), sparse.eye_array(self.nu, format="csr")

    def tangent_map(self, q: np.ndarray) -> sparse.csr_matrix:
        """Derivative dx/dq (nu, nq): increment in the tangent space for a change of q."""
        from scipy import sparse

        return sparse.eye_array(self.nu, format="csr")

    def retract(self, q: np.ndarray, dx: np.ndarray) -> np.ndarray:
        """Configuration after an increment of the tangent space."""
        return q + dx

    def difference(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Increment dx from configuration `start` to `end`, the inverse of `retract`."""
        return end - start

    def increment_map(self, dx: np.ndarray) -> np.ndarray | None:
        """Derivative of an increment with respect to a small increment after it, one block per node, (n, size, size).

        None means the identity.

        difference(q, retract(retract(q, dx), d)) = dx + increment_map(dx) d + O(d^2)
        """
        return None

    def mass(self, q: np.ndarray) -> sparse.csr_matrix:
        """Mass matrix (nu, nu)."""
        ...

    def momentum(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Momentum M(q) u, (nu,)."""
        return np.asarray(self.mass(q) @ u)

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
        """Force, and the static reaction along the direction of every drive, (n_drives,), N."""
        ...

    def force_rate(self, t: float, q: np.ndarray) -> np.ndarray:
        """Partial derivative dh/dt at rest, due to drives and loads that depend on time, (nu,), N/s and N m/s."""
        ...

    def tangent(self, t: float, q: np.ndarray, u: np.ndarray | None) -> tuple[sparse.bsr_matrix, sparse.bsr_matrix]:
        """Exact derivatives K = -dh/dx and D = -dh/du."""
        linear = self.linearise(t, q, u)
        return linear.stiffness.bsr(), linear.damping.bsr()

    def linearise(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None,
        efforts: np.ndarray | None = None, depths: Depths | None = None,
    ) -> Linearised:  # fmt: skip
        """Force and both tangents in one pass; the pattern is the same object until the contact search adds blocks. If
        `mixed`, the tangents can be those at given efforts of springs and depths of contacts.
        """
        ...

    def energy(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Energy:
        """Energies and powers of a state."""
        ...

    def loss_of_elements(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> float:
        """Power that all parts except contacts dissipate in a state, W."""
        return self.energy(t, q, u, before).dissipated_power

    def reactions(self, t: float, q: np.ndarray, u: np.ndarray | None) -> np.ndarray:
        """Reaction wrench on each held or driven body, (n_bodies, 3 or 6), N and N m; zero for free bodies."""
        ...

    def observe(self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None = None) -> Observation:
        """Drive, energies and contacts of a state."""
        ...

    def shape(self, t: float, q: np.ndarray) -> np.ndarray:
        """Corner points (n_quads, 4, 3) of the visible faces, m."""
        ...

    def shapes(self, times: np.ndarray, q: np.ndarray) -> np.ndarray:
        """`shape` at several times (n,), s, and configurations (n, nq)."""
        return np.array([self.shape(float(t), state) for t, state in zip(times, q, strict=True)])

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

    def element_memory(self) -> np.ndarray:
        """Internal variables without those of contacts, of the same length at all times; results have them at all states."""
        return self.memory()

    def restore(self, memory: np.ndarray) -> None:
        """Set the internal variables, for a restart or after rejected steps; an empty array resets them.

        `element_memory` is accepted too; the memory of contacts is then empty.
        """
        return

    def replayed(self, memory: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """`element_memory` (n, m) at states (n, nq) that a kernel has passed at times (n,), s; `memory` is the one before
        them.
        """
        return np.tile(memory, (len(times), 1))

    def recall(self, memory: np.ndarray) -> None:
        """Set what `replayed` finds to a row of it; by default nothing."""
        return

    def in_turn(self, memories: np.ndarray) -> Iterator[int]:
        """Numbers of rows of `replayed`; elements have the memory of each in turn, and at the end their present one."""
        present = self.element_memory()
        for number, memory in enumerate(memories):
            self.recall(memory)
            yield number
        self.recall(present)

    def memory_in_place(self) -> Sequence[np.ndarray] | None:
        """Arrays that make up `memory` in order, which kernels change in place; None if there is other memory."""
        return None

    def counters(self) -> np.ndarray:
        """Counters for the summary, (n,); empty for most systems."""
        return np.zeros(0)

    def clear_caches(self, counters: np.ndarray) -> None:
        """Clear all caches, so that later results equal the results of a new system, and set the counters to `counters`.

        Internal variables are not affected, see `restore`.
        """
        return

    def lacks_arrays(self) -> bool:
        """Whether the system needs new arrays, because two bodies that the arrays do not couple have met."""
        return False

    def to_arrays(self, resolve: bool) -> None:
        """Copy the internal variables to the arrays, before a kernel takes steps.

        `resolve`: steps resolve impacts; fixed steps do not.
        """
        return

    def from_arrays(self) -> None:
        """Copy the internal variables from the arrays."""
        return

    def touching(self) -> tuple[int, bool]:
        """Number of contacts with a force in the last evaluated state, and whether contacts that were closed in the last
        tangents are open in this state.

        The tangents are then too stiff, so a small correction does not prove convergence.
        """
        return 0, False

    def lock(self, by_acceleration: float) -> bool:
        """Begin Newton's method of a step; see `fsm.solve.stepping.model`. False without locked directions."""
        return False

    def advance(self, change: np.ndarray, part: float = 1.0, again: bool = False) -> bool:
        """Advance the multipliers of locked directions by a part of those of an increment; see `fsm.solve.stepping.model`.

        With `again`, this part replaces that of the last call.
        """
        return False

    def advance_in_time(self, t: float, change: np.ndarray, passed: float) -> None:
        """Advance the multipliers of locked directions by an increment in which the time passes from t, s."""
        return

    def work_of_locks(self, change: np.ndarray) -> float:
        """Work of the penalties of locked directions along an increment of the last evaluated state, J."""
        return 0.0

    def swap_multipliers(self) -> None:
        """Exchange the present multipliers of locked directions and those of the last accepted state."""
        return

    def hold_still(self, still: bool) -> bool:
        """Begin or end equilibria, with penalties of locked directions also at accepted states; the multipliers are those
        of the last accepted state if this changes. Returns whether the penalties were those of equilibria before.
        """
        return False

    def locked_rows(self, t: float, q: np.ndarray) -> np.ndarray:
        """Gradients (n, nu) of the openings of locked directions."""
        return np.zeros((0, self.nu))

    def locked_springs(self, t: float, q: np.ndarray) -> LockedSprings | None:
        """Locked directions of springs at rest; None without any."""
        return None

    def measure_step(self, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
        """Begin an iteration of the mean-force method; see `fsm.solve.stepping.model`. False without locked directions."""
        return False

    def halfway(self, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
        """Let dampers of flexible elements act half-way in a step; see `fsm.solve.stepping.model`. False without any."""
        return False

    def consistent(self, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool = False) -> bool:
        """Make a state consistent with locked directions; see `fsm.solve.stepping.model`."""
        return False

    def rejection(self, t: float, q: np.ndarray, u: np.ndarray | None, step: float) -> StepRejection | None:
        """Rejection of a state as the end of a step of the given length (s) since the last commit; None to accept it.

        In statics u is None, and impacts are not resolved.
        """
        return None

    def hold(self, held: bool) -> None:
        """Let forces be smooth up to the first event of a step, if `held`, or jump where it is, as at first."""
        return

    def part_before_event(self, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
        """Part of a step of this length (s), which ends at this state, up to its first event; 2 without one."""
        return 2.0

    def shortest_step(self) -> float:
        """Shortest step of error control, s, because the mesh does not resolve faster waves; 0 without a limit."""
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

    def sticking_damping(self, t: float, q: np.ndarray) -> BlockMatrix | None:
        """Damping of contacts at rest, where regularised friction resists sliding most; None without friction."""
        return None

    def max_joint_opening(self, t: float, q: np.ndarray) -> tuple[float, str]:
        """Largest separation (m) of the two sides of a joint of the structure, and the name of the joint."""
        return 0.0, "none"

    # kernels ------------------------------------------------------------------------------------------------------------

    def arrays(self, ready: Ready) -> Any:
        """`fsm.solve.stepping.model.ArrayModel` of this system for steps in kernels, always the same object; None if any
        interaction has no arrays.

        The last of `arrays.flags` is 1 if a step was unable to solve its equations. If `lacks_arrays` is true, the
        result is a new model.
        """
        return None

    def arrays_at_rest(self, ready: Ready) -> Any:
        """`fsm.solve.stepping.equilibrium.RestModel` of this system for equilibria in kernels, always the same object.

        None if any interaction has no arrays, or if the equations are large: `Elimination.large`.
        """
        return None

    def static_arrays(self, ready: Ready) -> StaticArrays | None:
        """Arrays of this system for quasi-static steps in one kernel, always the same object, with the factors of `ready`;
        None if any interaction has no arrays.
        """
        return None

    # mixed Newton method ------------------------------------------------------------------------------------------------
    #
    # In statics, forces of stiff springs are unknowns besides q. The efforts e = k (m(q) - x0) (forces and moments of
    # springs) are separate equations. The geometric stiffness then uses efforts that are advanced to first order in each
    # iteration. The displacement method uses k (m(q) - x0) instead; in a stiff spring, a small error of position makes this
    # force meaningless. The equilibria are the same (Magisano, Leonetti and Garcea, 2017). Contacts are linearised at depths
    # that are advanced in the same way; they stay closed until their force would become tensile.

    mixed: bool = False
    """Whether there are such efforts and depths; else both are empty."""

    def efforts(
        self, t: float, q: np.ndarray, before: PreviousState | None = None, dx: np.ndarray | None = None
    ) -> np.ndarray:
        """Efforts of all springs at q, as one array; with dx, efforts after that increment to first order."""
        return np.zeros(0)

    def take_up(self, efforts: np.ndarray, task: int) -> float:
        """Do a task for the multipliers of locked springs (`fsm.solve.stepping.quasi_static.StaticCalls`).

        `lock` goes back to those of the last accepted state.
        """
        return 0.0

    def depths(self, most: float) -> Depths:
        """Depths of all contacts at the last accepted step; new contacts start with at most the force `most` (N)."""
        return ()

    def advance_depths(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None, dx: np.ndarray, depths: Depths
    ) -> Depths:
        """Depths after an increment, with forces to first order; other arguments as in `linearise`."""
        return depths


class StaticArrays(Protocol):
    """Arrays of a system for quasi-static steps in one kernel.

    Attributes
    ----------
    model : Any
        `fsm.solve.stepping.quasi_static.StaticModel` of the arrays.
    """

    model: Any

    @property
    def lacks(self) -> bool:
        """Whether the last step met bodies whose block the pattern of the matrix lacks; `prepare` adds the block."""
        ...

    def prepare(self, before: PreviousState) -> None:
        """Give the arrays the present memory, the factors and the pattern, before a kernel takes steps from the state
        `before`.
        """
        ...

    def begin(self, t: float, before: PreviousState, efforts: np.ndarray, most: float) -> None:
        """`prepare`, and set the time, the last state, and the efforts to begin with; `most` (N) as in
        `System.depths`.
        """
        ...

    def end(self) -> tuple[np.ndarray, BlockMatrix, bool, bool]:
        """Efforts at the end, the matrix of the last factorisation, whether it is symmetric, and whether its last solution
        needed no refinement.
        """
        ...

    def followed(self, q: np.ndarray) -> None:
        """A kernel has accepted steps to q: the memory of the arrays is the present one."""
        ...

    def observation(self, records: np.ndarray) -> Observation:
        """Observation of several states from their records (`fsm.solve.stepping.path`); all arrays have a first axis."""
        ...
