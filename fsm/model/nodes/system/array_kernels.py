"""Kernels of a mesh as a compiled model that time steps call; see `fsm.model.nodes.arrays` and
`fsm.solve.stepping.model`.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.block_equations import FAILED, keep_low_rank
from fsm.kernels.block_lu import REFINE_ABOVE, multiply_blocks
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import program_at
from fsm.kernels.pointers import call_at
from fsm.model.nodes import arrays as at
from fsm.model.nodes.arrays import Coordinates, forcing_programs, full_mass_of, mass_of, moved_of, pattern_of
from fsm.model.nodes.system import array_forces as nodes
from fsm.solve.stepping.equilibrium import RestCalls, never_advance, never_lock
from fsm.solve.stepping.model import (
    CREASES,
    DRIVES,
    KINETIC,
    NOT_MINIMAL,
    PANELS,
    STEADY,
    UNLOCKED,
    Calls,
    always_consistent,
)
from fsm.solve.stepping.vectors import copy_into, inner, kept


@kernel
def _factorise(model: Coordinates, by_rate: float, by_acceleration: float, x: np.ndarray, maps: bool) -> bool:
    nodes.set_matrix(model.table, by_rate, by_acceleration)
    return nodes.factorise_matrix(model, True)


@kernel
def _factorise_mass(model: Coordinates) -> bool:
    copy_into(floats_3d(model.table, at.MASS), floats_3d(model.table, at.MATRIX))
    return nodes.factorise_matrix(model, False)


@kernel
def _mapped(model: Coordinates, change: np.ndarray) -> np.ndarray:
    return change


@kernel
def _retract(model: Coordinates, q: np.ndarray, x: np.ndarray) -> np.ndarray:
    out = np.empty(q.shape[0])
    for i in range(q.shape[0]):
        out[i] = q[i] + x[i]
    return out


@kernel
def _mass_times(model: Coordinates, vector: np.ndarray) -> np.ndarray:
    return nodes.rows_times(mass_of(model.table), vector)


@kernel
def _stiffness_times(model: Coordinates, vector: np.ndarray) -> np.ndarray:
    p = pattern_of(model.table)
    return multiply_blocks(p.rows, p.columns, floats_3d(model.table, at.STIFFNESS), vector)


@kernel
def _damping_times(model: Coordinates, vector: np.ndarray) -> np.ndarray:
    p = pattern_of(model.table)
    return multiply_blocks(p.rows, p.columns, floats_3d(model.table, at.DAMPING), vector)


@kernel
def _unable(model: Coordinates) -> bool:
    return model.flags[FAILED] == 1


@kernel
def keep_tangent(model: Coordinates, by_stiffness: float, by_damping: float, first: bool) -> bool:
    """See `fsm.solve.stepping.model`."""
    table = model.table
    kept(floats_3d(table, at.STIFFNESS), by_stiffness, first, floats_3d(table, at.KEPT_STIFFNESS))
    kept(floats_3d(table, at.DAMPING), by_damping, first, floats_3d(table, at.KEPT_DAMPING))
    keep_low_rank(model.equations, by_stiffness, first)
    return True


# contacts: a mesh alone has no contacts ----------------------------------------------------------------------------------


@kernel
def _touching(model: Coordinates) -> tuple[int, bool]:
    return 0, False


@kernel
def _part_of_step(model: Coordinates, t: float, q: np.ndarray, u: np.ndarray, step: float) -> float:
    return 1.0


@kernel
def _longest_step(model: Coordinates, t: float, q: np.ndarray, u: np.ndarray) -> float:
    return np.inf


@kernel
def accept_present(model: Coordinates, t: float) -> None:
    """Accept the present state."""
    for k in range(model.accepting.shape[0]):
        call_at(model.accepting[k], model.table, model.accept_tables[k], t)


@kernel
def _accept(model: Coordinates, t: float, q: np.ndarray, u: np.ndarray) -> float:
    if model.accepting.shape[0] > 0:
        nodes.place(model.table, t, t, q, u)
        accept_present(model, t)
    return np.inf


# at rest ----------------------------------------------------------------------------------------------------------------


@kernel
def _force_at_rest(model: Coordinates, t: float, q: np.ndarray) -> np.ndarray:
    nodes.place(model.table, t, t, q, q)
    nodes.sum_forces(model, t, 0.0)
    return nodes.forces_of_coordinates(model.table, q)


@kernel
def _renewed_force_at_rest(model: Coordinates, t: float, q: np.ndarray) -> np.ndarray:
    nodes.place(model.table, t, t, q, q)
    nodes.sum_tangents(model, t, 0.0)
    nodes.hold(model.table)
    return nodes.forces_of_coordinates(model.table, q)


@kernel
def _factorise_stiffness(model: Coordinates) -> bool:
    copy_into(floats_3d(model.table, at.STIFFNESS), floats_3d(model.table, at.MATRIX))
    done = nodes.factorise_matrix(model, True)
    model.flags[FAILED] = 0  # these are the matrices of time steps
    return done


@kernel
def _solved(model: Coordinates, right: np.ndarray) -> np.ndarray:
    x = nodes.solve(model, right)
    if model.flags[FAILED] == 1:
        model.flags[FAILED] = 0
        x[:] = np.nan
    return x


# energies ---------------------------------------------------------------------------------------------------------------


@kernel
def _dissipated(model: Coordinates, t: float, q: np.ndarray, step: float) -> float:
    """Mean power of dampers since the last call; the forces are those at the middle of the step, see
    `fsm.solve.outcome.energy_balance`.
    """
    table = model.table
    last, last_time = floats_1d(table, at.LAST), floats_1d(table, at.LAST_TIME)
    damped, lost = floats_1d(table, at.NUMBERS)[at.DAMPED], 0.0
    if step > 0.0 and floats_1d(table, at.NUMBERS)[at.RATE_DEPENDENT] > 0.0:
        begin = last_time[0]
        halfway, mean = np.empty(q.shape[0]), np.empty(q.shape[0])
        for i in range(q.shape[0]):
            halfway[i] = last[i] + 0.5 * (q[i] - last[i])
            mean[i] = (q[i] - last[i]) / (t - begin)
        nodes.place(table, 0.5 * (begin + t), begin, halfway, mean)
        lost += nodes.lost_by_dampers(model)
        if damped > 0.0:
            rates = floats_1d(table, at.U)
            momentum = nodes.rows_times(full_mass_of(table), rates)
            for i in range(rates.shape[0]):
                lost += damped * rates[i] * momentum[i]
    if step > 0.0:
        nodes.place(table, t, t, q, last)
        lost += sum_of(model, at.SLID_AT, step)
    copy_into(q, last)
    last_time[0] = t
    return lost


@kernel
def sum_of(model: Coordinates, column: int, step: float) -> float:
    """Sum of the powers that a kernel of all groups returns for an accepted step (s), or at the present rates, W."""
    total = 0.0
    for k in range(model.kernels.shape[0]):
        total += call_at(model.kernels[k, column], model.table, model.tables[k], step)
    return total


@kernel
def _reactions(model: Coordinates, t: float) -> np.ndarray:
    """Forces that hold the held coordinates in motion, (n,); see `AncfSystem.held_forces`."""
    table = model.table
    nodes.sum_forces(model, t, 1.0)
    total, fixed, p = floats_1d(table, at.FORCE), integers_2d(table, at.FIXED).reshape(-1), pattern_of(table)
    free = np.empty(total.shape[0])
    for i in range(total.shape[0]):
        free[i] = 0.0 if fixed[i] == 1 else total[i]
    acceleration, _, _ = model.equations.solve(
        p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, floats_3d(table, at.MASS_FACTORS), p.rows, p.columns,
        floats_3d(table, at.MASS), free, REFINE_ABOVE, True, False,
    )  # fmt: skip
    out = nodes.rows_times(full_mass_of(table), acceleration)
    for i in range(out.shape[0]):
        out[i] = out[i] - total[i] if fixed[i] == 1 else 0.0
    return out


@kernel
def _powers(model: Coordinates, t: float, record: np.ndarray) -> float:
    """Input power at the present state, W; travels and forces of the motions are recorded."""
    table, power = model.table, 0.0
    programs, moved = forcing_programs(table), moved_of(table)
    rates, forcings = floats_1d(table, at.U), floats_2d(table, at.FORCINGS)
    for k in range(forcings.shape[0]):
        factor = program_at(programs, k, t)[0]
        for i in range(rates.shape[0]):
            power += factor * forcings[k, i] * rates[i]
    for k in range(model.kernels.shape[0]):
        power += call_at(model.kernels[k, at.PUT_IN_AT], table, model.tables[k], 0.0)
    sizes = floats_1d(table, at.SIZES)
    count = sizes.shape[0]
    if count == 0:
        return power
    reactions = _reactions(model, t)
    for k in range(count):
        record[DRIVES + k], record[DRIVES + count + k] = program_at(moved.programs, k, t)[0] * sizes[k], 0.0
    for i in range(moved.coordinates.shape[0]):
        k = moved.motions[i]
        record[DRIVES + count + k] += reactions[moved.coordinates[i]] * moved.displacements[i] / sizes[k]
    for i in range(rates.shape[0]):
        power += reactions[i] * rates[i]
    return power


@kernel
def energies(
    model: Coordinates, t: float, q: np.ndarray, u: np.ndarray, step: float, record: np.ndarray
) -> tuple[float, float, float, float, float]:
    """See `fsm.solve.stepping.model`."""
    table = model.table
    lost = _dissipated(model, t, q, step)
    nodes.place(table, t, t, q, u)
    here, rates = floats_1d(table, at.Q), floats_1d(table, at.U)
    weight, kinds = floats_1d(table, at.WEIGHT), integers_1d(table, at.KINDS)
    record[PANELS] = record[CREASES] = record[STEADY] = kinetic = stored = 0.0
    for k in range(model.kernels.shape[0]):
        energy = call_at(model.kernels[k, at.STORED_AT], table, model.tables[k], 1.0)
        stored += energy
        if kinds[k] == 1:
            record[PANELS] += energy
        if kinds[k] == 2:
            record[CREASES] += energy
    momentum = nodes.rows_times(full_mass_of(table), rates)
    for i in range(rates.shape[0]):
        kinetic += 0.5 * rates[i] * momentum[i]
        stored -= weight[i] * here[i]
    record[KINETIC] = kinetic
    return kinetic, stored, lost, _powers(model, t, record), 0.0


@kernel
def present_powers(model: Coordinates, t: float, drive_force: np.ndarray) -> tuple[float, float]:
    """Powers at the present state, as `powers`."""
    table = model.table
    damped = floats_1d(table, at.NUMBERS)[at.DAMPED]
    lost = nodes.lost_by_dampers(model) + sum_of(model, at.SLID_AT, 0.0)
    if damped > 0.0:
        rates = floats_1d(table, at.U)
        lost += damped * inner(rates, nodes.rows_times(full_mass_of(table), rates))
    count = floats_1d(table, at.SIZES).shape[0]
    record = np.zeros(DRIVES + 2 * count)
    put_in = _powers(model, t, record)
    for k in range(count):
        drive_force[k] += record[DRIVES + count + k]
    return put_in, lost


@kernel
def powers(
    model: Coordinates, t: float, q: np.ndarray, u: np.ndarray, of_pairs: np.ndarray, drive_force: np.ndarray
) -> tuple[float, float]:
    """See `fsm.solve.stepping.model`."""
    nodes.place(model.table, t, t, q, u)
    return present_powers(model, t, drive_force)


KERNELS = Calls(
    nodes.force, nodes.renewed_force, _factorise, _factorise_mass, nodes.solve, _mapped, _retract, _mass_times,
    _stiffness_times,
    _damping_times, _touching, _part_of_step, _longest_step, _accept, _unable, energies, keep_tangent, powers,
    *UNLOCKED, nodes.set_halfway, always_consistent, *NOT_MINIMAL,
)  # fmt: skip
"""Kernels of `Coordinates` that time steps call."""
AT_REST = RestCalls(
    _force_at_rest, _renewed_force_at_rest, _factorise_stiffness, _solved, _retract, never_lock, never_advance
)
"""Kernels of `Coordinates` that Newton's method for equilibria calls."""
