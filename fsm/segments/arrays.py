"""Segments as a model of arrays: kernels for compiled time steps (see `fsm.stepping.model`).

It covers bodies without drives, with springs, dampers, creases, ligaments and gravity. Contacts, hysteresis, drives and
loads that depend on time have no arrays yet; such systems take the same steps in Python.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.interactions.bushing_planar import (
    deformations_pose_planar,
    force_pose_planar,
    linearise_pose_planar,
    stored_pose_planar,
)
from fsm.interactions.bushing_spatial import (
    deformations_pose_spatial,
    force_pose_spatial,
    linearise_pose_spatial,
    stored_pose_spatial,
)
from fsm.interactions.crease_planar import force_crease_planar, linearise_crease_planar
from fsm.interactions.crease_spatial import force_crease_spatial, linearise_crease_spatial
from fsm.interactions.hinge_planar import measure_hinge_planar
from fsm.interactions.hinge_spatial import measure_hinge_spatial
from fsm.interactions.ligament_planar import (
    force_ligament_planar,
    linearise_ligament_planar,
    measure_ligament_planar,
    stored_ligament_planar,
)
from fsm.kernels.block_lu import (
    MAX_ERROR,
    REFINE_ABOVE,
    SYMMETRY_TOLERANCE,
    factorise,
    is_symmetric,
    multiply_blocks,
    solve_refined,
)
from fsm.kernels.block_sum import effective_stiffness
from fsm.kernels.body_poses import gather_free, increment_blocks, retract_poses, scatter_free
from fsm.kernels.jit import kernel
from fsm.kernels.newton_euler import add_gyroscopic, gyroscopic_damping
from fsm.laws.crease import crease_energy
from fsm.stepping.model import Calls
from fsm.stepping.vectors import copy_into, scaled

__all__ = ["KERNELS", "Creases", "Ligaments", "Pattern", "Segments", "Springs"]

_SYMMETRIC, _TRUSTED, _FAILED = 0, 1, 2
"""Indices of `Segments.flags`: two on the last factorisation, and whether any factorisation or solution has failed."""


class Springs(NamedTuple):
    """Arrays of a `BushingGroup`; `last` (m, 3 or 6) holds the deformations at the end of the last step."""

    bodies: np.ndarray
    constants: np.ndarray
    slots: np.ndarray
    last: np.ndarray


class Creases(NamedTuple):
    """Arrays of a `CreaseGroup`; empty axes in the plane; `last` (m,) holds the angles at the end of the last step."""

    bodies: np.ndarray
    axes_inner: np.ndarray
    axes_outer: np.ndarray
    angle_offset: np.ndarray
    rest: np.ndarray
    side: np.ndarray
    damping: np.ndarray
    curve: np.ndarray
    bounds: np.ndarray
    knots: np.ndarray
    coefficients: np.ndarray
    energies: np.ndarray
    slots: np.ndarray
    last: np.ndarray


class Ligaments(NamedTuple):
    """Arrays of a `LigamentGroup`; `last` (m, 3) holds the deformations at the end of the last step."""

    bodies: np.ndarray
    constants: np.ndarray
    last: np.ndarray


class Pattern(NamedTuple):
    """A `BodyPattern` and its `Elimination`."""

    dof: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    transposed: np.ndarray
    diagonal: np.ndarray
    order: np.ndarray
    filled_rows: np.ndarray
    filled_columns: np.ndarray
    filled_diagonal: np.ndarray
    place: np.ndarray


class Segments(NamedTuple):
    """Arrays of a system; matrices and sums are changed in place.

    Attributes
    ----------
    free : int array
    mass : (nu,) array
    inertia : (n_bodies, 6) array; None in the plane
        The type selects the kernels at compile time. Such branches must be written with `if` and `else`.
    moments : (n_bodies, 3 or 6) array
        Inertia of every degree of freedom, for the kinetic energy.
    weight : (n_bodies, 2 or 3) array, N
    poses, rates, force : arrays of all bodies
    pattern : Pattern
    springs, creases, ligaments : None if there are none
    stiffness, damping, matrix, factors : block data
    turned : (n_free, 6, 6) array; None in the plane
        Derivatives of the increment of the last factors.
    flags : (3,) int array
    """

    free: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray | None
    moments: np.ndarray
    weight: np.ndarray
    poses: np.ndarray
    rates: np.ndarray
    force: np.ndarray
    pattern: Pattern
    springs: Springs | None
    creases: Creases | None
    ligaments: Ligaments | None
    stiffness: np.ndarray
    damping: np.ndarray
    matrix: np.ndarray
    factors: np.ndarray
    turned: np.ndarray | None
    flags: np.ndarray


# configuration ----------------------------------------------------------------------------------------------------------


@kernel
def _place(model: Segments, q: np.ndarray, u: np.ndarray) -> None:
    no = u.shape[0] < 0  # a variable, because a constant would compile the kernel again
    scatter_free(model.free, q, not no and model.poses.shape[1] == 7, model.poses)
    scatter_free(model.free, u, no, model.rates)


@kernel
def _retract(model: Segments, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    return _moved(q, x, model.inertia)


@kernel
def _moved(q: np.ndarray, x: np.ndarray, inertia: np.ndarray | None) -> np.ndarray:
    if inertia is None:
        return q + x
    else:
        return retract_poses(q, x)


# forces -----------------------------------------------------------------------------------------------------------------


@kernel
def _add_spring_forces(
    springs: Springs | None, inertia: np.ndarray | None, poses: np.ndarray, rates: np.ndarray, force: np.ndarray
) -> None:
    if springs is None:
        pass
    else:
        if inertia is None:
            force_pose_planar(poses, rates, springs.bodies, springs.constants, springs.last, 0.0, force)
        else:
            force_pose_spatial(poses, rates, springs.bodies, springs.constants, springs.last, 0.0, force)


@kernel
def _add_crease_forces(
    creases: Creases | None, inertia: np.ndarray | None, poses: np.ndarray, rates: np.ndarray, force: np.ndarray
) -> None:
    if creases is None:
        pass
    else:
        c = creases
        if inertia is None:
            force_crease_planar(
                poses, rates, c.bodies, c.angle_offset, c.rest, c.side, c.damping, c.curve, c.bounds, c.knots,
                c.coefficients, c.energies, c.last, 0.0, force,
            )  # fmt: skip
        else:
            force_crease_spatial(
                poses, rates, c.bodies, c.axes_inner, c.axes_outer, c.angle_offset, c.rest, c.side, c.damping, c.curve,
                c.bounds, c.knots, c.coefficients, c.energies, c.last, 0.0, force,
            )  # fmt: skip


@kernel
def _add_ligament_forces(ligaments: Ligaments | None, poses: np.ndarray, rates: np.ndarray, force: np.ndarray) -> None:
    if ligaments is None:
        pass
    else:
        force_ligament_planar(poses, rates, ligaments.bodies, ligaments.constants, ligaments.last, 0.0, force)


@kernel
def _add_gyroscopic(inertia: np.ndarray | None, rates: np.ndarray, force: np.ndarray) -> None:
    if inertia is None:
        pass
    else:
        add_gyroscopic(rates, inertia, force)


@kernel
def _force(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    _place(model, q, u)
    poses, rates, total = model.poses, model.rates, model.force
    total[:] = 0.0
    for i in range(model.weight.shape[0]):
        for k in range(model.weight.shape[1]):
            total[i, k] = model.weight[i, k]
    _add_spring_forces(model.springs, model.inertia, poses, rates, total)
    _add_crease_forces(model.creases, model.inertia, poses, rates, total)
    _add_ligament_forces(model.ligaments, poses, rates, total)
    _add_gyroscopic(model.inertia, rates, total)
    return gather_free(model.free, total)


# tangents ---------------------------------------------------------------------------------------------------------------


@kernel
def _linearise_springs(model: Segments, springs: Springs | None, inertia: np.ndarray | None) -> None:
    if springs is None:
        pass
    else:
        own = springs.last[:0]
        if inertia is None:
            linearise_pose_planar(
                model.poses, model.rates, springs.bodies, springs.constants, springs.last, 0.0, own, springs.slots,
                model.force, model.stiffness, model.damping,
            )  # fmt: skip
        else:
            linearise_pose_spatial(
                model.poses, model.rates, springs.bodies, springs.constants, springs.last, 0.0, own, springs.slots,
                model.force, model.stiffness, model.damping,
            )  # fmt: skip


@kernel
def _linearise_creases(model: Segments, creases: Creases | None, inertia: np.ndarray | None) -> None:
    if creases is None:
        pass
    else:
        c = creases
        if inertia is None:
            linearise_crease_planar(
                model.poses, model.rates, c.bodies, c.angle_offset, c.rest, c.side, c.damping, c.curve, c.bounds, c.knots,
                c.coefficients, c.energies, c.last, 0.0, c.slots, model.force, model.stiffness, model.damping,
            )  # fmt: skip
        else:
            linearise_crease_spatial(
                model.poses, model.rates, c.bodies, c.axes_inner, c.axes_outer, c.angle_offset, c.rest, c.side, c.damping,
                c.curve, c.bounds, c.knots, c.coefficients, c.energies, c.last, 0.0, c.slots, model.force, model.stiffness,
                model.damping,
            )  # fmt: skip


@kernel
def _linearise_ligaments(model: Segments, ligaments: Ligaments | None) -> None:
    if ligaments is None:
        pass
    else:
        linearise_ligament_planar(
            model.poses, model.rates, ligaments.bodies, ligaments.constants, ligaments.last, 0.0, model.pattern.dof,
            model.pattern.rows, model.pattern.columns, model.force, model.stiffness, model.damping,
        )  # fmt: skip


@kernel
def _linearise_gyroscopic(model: Segments, inertia: np.ndarray | None) -> None:
    if inertia is None:
        pass
    else:
        add_gyroscopic(model.rates, inertia, model.force)
        pattern = model.pattern
        gyroscopic_damping(model.rates, inertia, pattern.dof, pattern.rows, pattern.columns, model.damping)


@kernel
def _renewed_force(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    _place(model, q, u)
    model.force[:] = 0.0
    model.stiffness[:] = 0.0
    model.damping[:] = 0.0
    for i in range(model.weight.shape[0]):
        for k in range(model.weight.shape[1]):
            model.force[i, k] = model.weight[i, k]
    _linearise_gyroscopic(model, model.inertia)
    _linearise_springs(model, model.springs, model.inertia)
    _linearise_creases(model, model.creases, model.inertia)
    _linearise_ligaments(model, model.ligaments)
    return gather_free(model.free, model.force)


# equations --------------------------------------------------------------------------------------------------------------


@kernel
def _factors_of(model: Segments) -> bool:
    pattern, flags = model.pattern, model.flags
    symmetric = is_symmetric(model.matrix, pattern.transposed, SYMMETRY_TOLERANCE)
    flags[_SYMMETRIC], flags[_TRUSTED] = 1 if symmetric else 0, 0
    failed = factorise(
        model.matrix, pattern.place, pattern.filled_rows, pattern.filled_columns, pattern.filled_diagonal, symmetric,
        model.factors,
    )  # fmt: skip
    if failed >= 0:
        flags[_FAILED] = 1
    return failed < 0


@kernel
def _add_inertia(model: Segments, factor: float) -> None:
    size = model.matrix.shape[1]
    for row in range(model.pattern.diagonal.shape[0]):
        for k in range(size):
            model.matrix[model.pattern.diagonal[row], k, k] += factor * model.mass[row * size + k]


@kernel
def _turned_matrix(
    model: Segments, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool, turned: np.ndarray | None
) -> None:
    """S, written to `model.matrix`."""
    if turned is None:
        for k in range(model.matrix.shape[0]):
            for i in range(model.matrix.shape[1]):
                for j in range(model.matrix.shape[1]):
                    model.matrix[k, i, j] = model.stiffness[k, i, j] + by_rate * model.damping[k, i, j]
        _add_inertia(model, by_acceleration)
    else:
        # (c_d D + c_m M) first, then its product with T
        for k in range(model.matrix.shape[0]):
            for i in range(model.matrix.shape[1]):
                for j in range(model.matrix.shape[1]):
                    model.matrix[k, i, j] = by_rate * model.damping[k, i, j]
        _add_inertia(model, by_acceleration)
        copy_into(increment_blocks(x if maps else scaled(0.0, x)), turned)
        s = effective_stiffness(model.stiffness, model.matrix, 1.0, turned, model.pattern.columns)
        copy_into(s, model.matrix)


@kernel
def _factorise(model: Segments, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
    _turned_matrix(model, by_rate, by_acceleration, x, maps, model.turned)
    return _factors_of(model)


@kernel
def _factorise_mass(model: Segments) -> bool:
    model.matrix[:] = 0.0
    _add_inertia(model, 1.0)
    return _factors_of(model)


@kernel
def _solve(model: Segments, right: np.ndarray) -> np.ndarray:
    p, flags = model.pattern, model.flags
    x, error, refined = solve_refined(
        p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, model.factors, p.rows, p.columns, model.matrix, right,
        REFINE_ABOVE, flags[_SYMMETRIC] == 1, flags[_TRUSTED] == 1,
    )  # fmt: skip
    if not error <= MAX_ERROR:
        flags[_FAILED] = 1
    flags[_TRUSTED] = 0 if refined else 1
    return x


@kernel
def _mapped(model: Segments, change: np.ndarray) -> np.ndarray:
    return _turned_change(model.turned, change)


@kernel
def _turned_change(turned: np.ndarray | None, change: np.ndarray) -> np.ndarray:
    if turned is None:
        return change
    else:
        out = np.empty(change.shape[0])
        for i in range(turned.shape[0]):
            for a in range(6):
                total = 0.0
                for b in range(6):
                    total += turned[i, a, b] * change[6 * i + b]
                out[6 * i + a] = total
        return out


@kernel
def _mass_times(model: Segments, vector: np.ndarray) -> np.ndarray:
    return model.mass * vector


@kernel
def _stiffness_times(model: Segments, vector: np.ndarray) -> np.ndarray:
    return multiply_blocks(model.pattern.rows, model.pattern.columns, model.stiffness, vector)


@kernel
def _damping_times(model: Segments, vector: np.ndarray) -> np.ndarray:
    return multiply_blocks(model.pattern.rows, model.pattern.columns, model.damping, vector)


@kernel
def _unable(model: Segments) -> bool:
    return model.flags[_FAILED] == 1


# contacts: none in this model -------------------------------------------------------------------------------------------


@kernel
def _contacts_opened(model: Segments) -> bool:
    return False


@kernel
def _part_of_step(model: Segments, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
    return 1.0


@kernel
def _longest_step(model: Segments, t: float, q: np.ndarray, u: np.ndarray) -> float:
    return np.inf


# energies ---------------------------------------------------------------------------------------------------------------


@kernel
def _spring_energies(
    model: Segments, springs: Springs | None, inertia: np.ndarray | None, per_second: float
) -> tuple[float, float]:
    if springs is None:
        return 0.0, 0.0
    else:
        kinds = np.zeros(springs.bodies.shape[0], dtype=np.int64)
        if inertia is None:
            stored, power = stored_pose_planar(
                model.poses, model.rates, springs.bodies, springs.constants, springs.last, per_second, kinds, 1
            )
            copy_into(deformations_pose_planar(model.poses, model.rates, springs.bodies, springs.constants), springs.last)
        else:
            stored, power = stored_pose_spatial(
                model.poses, model.rates, springs.bodies, springs.constants, springs.last, per_second, kinds, 1
            )
            copy_into(deformations_pose_spatial(model.poses, model.rates, springs.bodies, springs.constants), springs.last)
        return stored[0], power


@kernel
def _crease_energies(
    model: Segments, creases: Creases | None, inertia: np.ndarray | None, per_second: float
) -> tuple[float, float]:
    if creases is None:
        return 0.0, 0.0
    else:
        c = creases
        if inertia is None:
            angle, rate, _ = measure_hinge_planar(model.poses, model.rates, c.bodies, c.angle_offset)
        else:
            angle, rate, _ = measure_hinge_spatial(
                model.poses, model.rates, c.bodies, c.axes_inner, c.axes_outer, c.angle_offset
            )
        stored = np.sum(
            crease_energy(angle, c.rest, c.side, c.curve, c.bounds, c.knots, c.coefficients, c.energies)
        )
        power = 0.0
        for i in range(angle.shape[0]):
            speed = rate[i] if per_second == 0.0 else (angle[i] - c.last[i]) * per_second
            power += c.damping[i] * speed**2
        copy_into(angle, c.last)
        return stored, power


@kernel
def _ligament_energies(model: Segments, ligaments: Ligaments | None, per_second: float) -> tuple[float, float]:
    if ligaments is None:
        return 0.0, 0.0
    else:
        stored, power = stored_ligament_planar(
            model.poses, model.rates, ligaments.bodies, ligaments.constants, ligaments.last, per_second
        )
        copy_into(
            measure_ligament_planar(model.poses, model.rates, ligaments.bodies, ligaments.constants)[0], ligaments.last
        )
        return stored, power


@kernel
def _energies(model: Segments, t: float, q: np.ndarray, u: np.ndarray, step: float) -> tuple[float, float, float, float]:
    _place(model, q, u)
    per_second = 1.0 / step if step > 0.0 else 0.0
    springs, by_springs = _spring_energies(model, model.springs, model.inertia, per_second)
    creases, by_creases = _crease_energies(model, model.creases, model.inertia, per_second)
    ligaments, by_ligaments = _ligament_energies(model, model.ligaments, per_second)
    kinetic = height = 0.0
    for i in range(model.rates.shape[0]):
        for k in range(model.rates.shape[1]):
            kinetic += 0.5 * model.moments[i, k] * model.rates[i, k] ** 2
        for k in range(model.weight.shape[1]):
            height -= model.weight[i, k] * model.poses[i, k]
    return kinetic, springs + creases + ligaments + height, by_springs + by_creases + by_ligaments, 0.0


KERNELS = Calls(
    _force, _renewed_force, _factorise, _factorise_mass, _solve, _mapped, _retract, _mass_times, _stiffness_times,
    _damping_times, _contacts_opened, _part_of_step, _longest_step, _longest_step, _unable, _energies,
)  # fmt: skip
"""Kernels of `Segments` that time steps call."""
