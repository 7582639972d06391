"""Functions of a model that a time step calls.

In Python these functions call the methods of the model. A kernel calls the kernels of an `ArrayModel` instead.
`fsm.solve.interface.system.System` defines the shapes.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import compiled_as, kernel
from fsm.kernels.pointers import Example, pointers, typed_by

TIME, TURNOVER, KINETIC, PANELS, CREASES, STEADY, DRIVES = range(7)
"""Indices of the record of a step. First are time (s), turnover before the step, kinetic energy, and elastic energies of
panels and creases (J). `STEADY` is 1 for a state near a stable equilibrium, else 0. From `DRIVES` on, the record contains
travels, then forces of all drives, normal forces of all contact pairs, q and u."""

INERTIAL = 1e-2
"""Largest ratio of inertial forces to the force of the drives near an equilibrium."""


class Calls(NamedTuple):
    """Kernels of the functions of this module; their first argument is the arrays of the model."""

    force: Any
    renewed_force: Any
    factorise: Any
    factorise_mass: Any
    solve: Any
    mapped: Any
    retract: Any
    mass_times: Any
    stiffness_times: Any
    damping_times: Any
    touching: Any
    part_of_step: Any
    longest_step: Any
    accept: Any
    unable: Any
    energies: Any
    keep_tangent: Any
    powers: Any
    lock: Any
    advance: Any
    measure_step: Any
    halfway: Any
    consistent: Any
    to_minimal: Any
    minimal_rates: Any
    from_minimal: Any
    from_minimal_changes: Any


class ArrayModel(NamedTuple):
    """Compiled model. `calls` holds `Pointer`s to kernels, and the NumPy arrays `arrays` are their first argument."""

    calls: Calls
    arrays: Any

    @classmethod
    def of(cls, kernels: Calls, arrays: Any, q: np.ndarray, u: np.ndarray) -> ArrayModel:
        """Create a model from arrays and kernels; q (nq,) and u (nu,) are an example of a state, and u of a record."""
        t, state = 0.0, (0.0, q, u)
        arguments = Calls(
            state, state, (t, t, u, True), (), (u,), (u,), (q, u), (u,), (u,), (u,), (), (*state, t), state, state, (),
            (*state, t, u), (t, t, True), (*state, np.zeros((2, 0)), u), (t,), (u,), (t, *state), (t, *state),
            (*state, u, True),
            (*state, q, u), (*state, q, u, np.zeros((2, 0)), u, True), (q, u, q, u), (q, q, u, u, u),
        )  # fmt: skip
        example = Example(arrays)
        return cls(pointers(kernels, Calls(*((example, *rest) for rest in arguments))), arrays)


def force(model: Any, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Force h (nu,)."""
    return np.asarray(model.force(t, q, u))


def renewed_force(model: Any, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Force h (nu,); K and D are evaluated at this state and used by all later calls."""
    return np.asarray(model.renewed_force(t, q, u))


def factorise(model: Any, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
    """Factorise S = K + (by_rate D + by_acceleration M) T, with T of the increment x (nu,) if `maps`, else the identity.

    The result is false if S is singular.
    """
    return bool(model.factorise(by_rate, by_acceleration, x, maps))


def factorise_mass(model: Any) -> bool:
    """Factorise M and return whether it is regular."""
    return bool(model.factorise_mass())


def solve(model: Any, right: np.ndarray) -> np.ndarray:
    """Solution (nu,) with the last factors."""
    return np.asarray(model.solve(right))


def mapped(model: Any, change: np.ndarray) -> np.ndarray:
    """Change (nu,) of x by an increment after x, with T of the last factorisation."""
    return np.asarray(model.mapped(change))


def retract(model: Any, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Configuration (nq,) after an increment."""
    return np.asarray(model.retract(q, x))


def mass_times(model: Any, vector: np.ndarray) -> np.ndarray:
    """M v."""
    return np.asarray(model.mass_times(vector))


def stiffness_times(model: Any, vector: np.ndarray) -> np.ndarray:
    """K v."""
    return np.asarray(model.stiffness_times(vector))


def damping_times(model: Any, vector: np.ndarray) -> np.ndarray:
    """D v."""
    return np.asarray(model.damping_times(vector))


def touching(model: Any) -> tuple[int, bool]:
    """Number of contacts with a force, and whether others of the last tangent have opened; see `System.touching`."""
    count, opened = model.touching()
    return count, opened


def part_of_step(model: Any, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
    """1 if the model accepts the step, 2 if it also ends at an event after which forces may differ, else the factor on the
    step size to try next; see `System.rejection`.
    """
    return float(model.part_of_step(t, q, u, step))


def longest_step(model: Any, t: float, q: np.ndarray, u: np.ndarray) -> float:
    """Longest step from an accepted state, s; see `System.longest_step`."""
    return float(model.longest_step(t, q, u))


def accept(model: Any, t: float, q: np.ndarray, u: np.ndarray) -> float:
    """Accept a state and return the longest step from it, s; see `System.commit`."""
    return float(model.accept(t, q, u))


def unable(model: Any) -> bool:
    """Whether the model failed to solve linear equations that another model of the same system can solve."""
    return bool(model.unable())


def energies(
    model: Any, t: float, q: np.ndarray, u: np.ndarray, step: float, record: np.ndarray
) -> tuple[float, float, float, float, float]:
    """Energies and powers of a state.

    Kinetic and potential energy (J), mean power of the dampers of elements over the step that ends at this state (W), input
    power (W), and kinetic energy of driven bodies (J). The mean power follows from the deformations since the last call, or
    from the present rates if the step is zero. Energies, travels and forces of drives are written to the record.
    """
    kinetic, potential, dissipated, put_in, driven = model.energies(t, q, u, step, record)
    return kinetic, potential, dissipated, put_in, driven


def keep_tangent(model: Any, by_stiffness: float, by_damping: float, first: bool) -> bool:
    """Keep K and D, multiplied by these factors, if `first`; else add the kept matrices to the present K and D,
    multiplied by these factors.

    The result is false if the tangents have different patterns.
    """
    return bool(model.keep_tangent(by_stiffness, by_damping, first))


def powers(
    model: Any, t: float, q: np.ndarray, u: np.ndarray, of_pairs: np.ndarray, drive_force: np.ndarray
) -> tuple[float, float]:
    """Input power and dissipated power of a state, W.

    The powers of contact pairs (`Energy.pair_power`) and the forces of all drives are added to `of_pairs` (2, n_pairs) and
    `drive_force` (n_drives,).
    """
    put_in, dissipated = model.powers(t, q, u, of_pairs, drive_force)
    return put_in, dissipated


def lock(model: Any, by_acceleration: float) -> bool:
    """Begin Newton's method of a step, with the multipliers of the last accepted state; false without locked directions.

    Locked directions are openings x(q) that stay zero. Their efforts are lambda + r x; the penalty r is large against
    `by_acceleration` (1/s^2) times their inertia. Zero sets r to zero.
    """
    return bool(model.lock(by_acceleration))


def advance(model: Any, change: np.ndarray) -> bool:
    """Advance the multipliers of locked directions by the increment `change` (nu,) of the last evaluated state."""
    return bool(model.advance(change))


def measure_step(model: Any, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
    """Begin an iteration of the mean-force method after `lock`, for the step h (s) from t and q with the increment x (nu,).

    Openings of locked directions are then those at the end of the step, and their efforts act at both Gauss points along
    gradients whose mean does no work in the step. False without locked directions.
    """
    return bool(model.measure_step(t, h, q, x))


def halfway(model: Any, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
    """Let the dampers of flexible elements act half-way in the step h (s) from t and q with the increment x (nu,), until a
    call with h = 0: in forces, tangents and powers of all states. False without such dampers.

    A rigid rotation by W = (R - 1)(R + 1)^-1 has the increment 2 W q_m of the mean q_m of both ends, which changes no
    strain at q_m. For strains that are quadratic in q, the rate there is the change over the step divided by h.
    """
    return bool(model.halfway(t, h, q, x))


def consistent(model: Any, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool) -> bool:
    """Make a state consistent with locked directions; false, without changes, if there are none.

    q (nq,) is corrected once, to second order in the openings. u (nu,) becomes the nearest velocity, in the norm of the
    kinetic energy, at which no locked direction opens. `rate` (nu,) becomes the acceleration with the multipliers that keep
    it so; the model keeps these multipliers. `inside` a step that ends without openings, q may stay.
    """
    return bool(model.consistent(t, q, u, rate, inside))


def to_minimal(
    model: Any, t: float, q: np.ndarray, u: np.ndarray, y: np.ndarray, v: np.ndarray
) -> tuple[int, int]:
    """Write the state to minimal coordinates y and rates v, and return their numbers; zero if the model has none.

    Minimal coordinates are those of joints that form trees. Locked directions then need neither multipliers nor projections.
    They count from this state. The present multipliers become zero, until a call of `consistent`.
    """
    coordinates, rates = model.to_minimal(t, q, u, y, v)
    return coordinates, rates


def minimal_rates(
    model: Any, t: float, y: np.ndarray, v: np.ndarray, of_y: np.ndarray, of_v: np.ndarray, of_pairs: np.ndarray,
    drive_force: np.ndarray, counts: bool,
) -> tuple[bool, float, float]:  # fmt: skip
    """Write the rates of minimal coordinates and of their rates. Returns false if the mass is singular; then the `powers` if
    `counts`, else zeros.
    """
    good, put_in, lost = model.minimal_rates(t, y, v, of_y, of_v, of_pairs, drive_force, counts)
    return good, put_in, lost


def from_minimal(model: Any, y: np.ndarray, v: np.ndarray, q: np.ndarray, u: np.ndarray) -> float:
    """Write the state of minimal coordinates to q and u; quaternions of y are normalised. Returns the longest step from
    there that resolves the turns, s.
    """
    return float(model.from_minimal(y, v, q, u))


def from_minimal_changes(
    model: Any, y: np.ndarray, change: np.ndarray, of_rates: np.ndarray, moved: np.ndarray, faster: np.ndarray
) -> bool:
    """Write the increments (nu,) and changes of velocities (nu,) by small changes of y and of v, near the last state."""
    return bool(model.from_minimal_changes(y, change, of_rates, moved, faster))


def stored(model: Any, t: float, q: np.ndarray, u: np.ndarray, record: np.ndarray) -> tuple[float, float]:
    """Kinetic energy, and kinetic and potential energy without driven bodies, J; the record is work space."""
    kinetic, total = model.stored(t, q, u)
    return kinetic, total


@kernel
def never_locks(model: Any, by_acceleration: float) -> bool:
    """`lock` of models without locked directions."""
    return False


@kernel
def never_advances(model: Any, change: np.ndarray) -> bool:
    """`advance` of models without locked directions."""
    return False


@kernel
def never_measures(model: Any, t: float, h: float, q: np.ndarray, x: np.ndarray) -> bool:
    """`measure_step` of models without locked directions."""
    return False


@kernel
def always_consistent(
    model: Any, t: float, q: np.ndarray, u: np.ndarray, rate: np.ndarray, inside: bool
) -> bool:
    """`consistent` of models without locked directions."""
    return False


@kernel
def never_to_minimal(
    model: Any, t: float, q: np.ndarray, u: np.ndarray, y: np.ndarray, v: np.ndarray
) -> tuple[int, int]:
    """`to_minimal` of models without minimal coordinates."""
    return 0, 0


@kernel
def never_minimal_rates(
    model: Any, t: float, y: np.ndarray, v: np.ndarray, of_y: np.ndarray, of_v: np.ndarray, of_pairs: np.ndarray,
    drive_force: np.ndarray, counts: bool,
) -> tuple[bool, float, float]:  # fmt: skip
    """`minimal_rates` of models without minimal coordinates."""
    return False, 0.0, 0.0


@kernel
def never_from_minimal(model: Any, y: np.ndarray, v: np.ndarray, q: np.ndarray, u: np.ndarray) -> float:
    """`from_minimal` of models without minimal coordinates."""
    return math.inf


@kernel
def never_from_minimal_changes(
    model: Any, y: np.ndarray, change: np.ndarray, of_rates: np.ndarray, moved: np.ndarray, faster: np.ndarray
) -> bool:
    """`from_minimal_changes` of models without minimal coordinates."""
    return False


NOT_MINIMAL = never_to_minimal, never_minimal_rates, never_from_minimal, never_from_minimal_changes
"""Last kernels of `Calls` for models without minimal coordinates."""
UNLOCKED = never_locks, never_advances, never_measures
"""Kernels `lock` to `measure_step` of `Calls` for models without locked directions."""


def _called(name: str) -> Any:
    """Function that calls the kernel of this name of an `ArrayModel`."""

    def instead(model: Any, *arguments: Any) -> Any:
        return getattr(model.calls, name)(model.arrays, *arguments)

    return instead


def _stored(model: Any, t: float, q: np.ndarray, u: np.ndarray, record: np.ndarray) -> Any:
    kinetic, potential, _, _, driven = model.calls.energies(model.arrays, t, q, u, 0.0, record)
    return kinetic, kinetic + potential - driven


for _name in Calls._fields:
    compiled_as(globals()[_name], ArrayModel, _called(_name))
compiled_as(stored, ArrayModel, _stored)
typed_by(ArrayModel)
