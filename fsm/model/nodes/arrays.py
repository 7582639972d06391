"""ANCF meshes as a compiled model (`ArrayModel`), for compiled steps and equilibria (see `fsm.solve.stepping.model`).

The model covers all elements with loads, moved and held coordinates, gravity and damping by mass. A new kind of element is
a group with its kernels (`fsm.model.nodes.group`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d, integers_1d
from fsm.kernels.block_equations import EquationKernels, Pattern, pattern_at
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at
from fsm.kernels.programs import Pieces
from fsm.kernels.records import record


class Rows(NamedTuple):
    """A sparse matrix by rows."""

    first: np.ndarray
    columns: np.ndarray
    values: np.ndarray


class Moved(NamedTuple):
    """Moved coordinates: index, motion and displacement of each, and the program of each motion."""

    coordinates: np.ndarray
    motions: np.ndarray
    displacements: np.ndarray
    programs: Pieces


class Arrays(NamedTuple):
    """Arrays of a mesh with its loads; each has n entries, one per coordinate, unless stated otherwise.

    Attributes
    ----------
    q, u, force : present coordinates, rates and forces
    start : coordinates at which held coordinates stay
    fixed : (n_nodes, size) int array
        1 for held and moved coordinates, else 0.
    weight : N
    stiffness, damping, matrix, mass, full_mass : block data
        `mass` has the rows of held coordinates replaced, `full_mass` has not.
    factors, mass_factors : block data of the pattern with fill-in
    numbers : (6,) array
        Stiffness of the oscillators of held coordinates; damping by mass, 1/s; 1 if forces depend on rates, else 0; present
        time, s. In a quasi-static step the fifth one is its duration (s): folds and bars then have the mean rate since the
        state `last`. Else it is zero. The last one is 1 while the dampers of elements act at the state `halfway`, and 2
        once their tangents there are known; else it is zero.
    forcings : (n_loads, n) array
        Forces at the factor 1.
    sizes : (n_motions,) array
        Norm of the displacement of each motion.
    kinds : (n_groups,) int array
        Numbers of `KINDS_OF_ENERGY` from 1 on, or 0.
    cleared, diagonal : int arrays
        Positions, in the flat block data, of the rows and columns of held coordinates, and of their diagonal entries.
    last, last_time : coordinates and (1,) time at the end of the last step
    kept_stiffness, kept_damping : block data, see `fsm.solve.stepping.model.keep_tangent`
    halfway, halfway_rates : coordinates half-way in a step of the mean-force method, and their rates
    dampers, damper_stiffness, damper_damping : forces and tangents of the dampers of elements there
    damped : (n_groups,) int array
        1 for groups whose forces depend on rates.
    rows, full_rows : `mass` and `full_mass`, stored by rows
    forcing_programs, moved, pattern : arrays of each
    """

    q: np.ndarray
    u: np.ndarray
    force: np.ndarray
    start: np.ndarray
    fixed: np.ndarray
    weight: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    matrix: np.ndarray
    mass: np.ndarray
    full_mass: np.ndarray
    factors: np.ndarray
    mass_factors: np.ndarray
    numbers: np.ndarray
    forcings: np.ndarray
    sizes: np.ndarray
    kinds: np.ndarray
    cleared: np.ndarray
    diagonal: np.ndarray
    last: np.ndarray
    last_time: np.ndarray
    kept_stiffness: np.ndarray
    kept_damping: np.ndarray
    halfway: np.ndarray
    halfway_rates: np.ndarray
    dampers: np.ndarray
    damper_stiffness: np.ndarray
    damper_damping: np.ndarray
    damped: np.ndarray
    rows: Rows
    full_rows: Rows
    forcing_programs: Pieces
    moved: Moved
    pattern: Pattern


@record
class Coordinates(NamedTuple):
    """Model of `Arrays` by their addresses.

    Attributes
    ----------
    table : table of `fsm.kernels.addresses`, of `Arrays`
    kernels : (n_groups, 7) int array
        Addresses of the kernels of each group of elements, in the order of `FORCE_AT` and so on.
    tables : (n_groups, m, 4) int array
        Table of the arrays of each group.
    accepting : (k,) int array
        Addresses of kernels that record each accepted state, with its time; arguments as in `kernels`.
    accept_tables : (k, m, 4) int array
        Table of the arrays of each of these kernels.
    flags : (3,) int array, see `fsm.kernels.block_equations`
    equations : EquationKernels
    """

    table: np.ndarray
    kernels: np.ndarray
    tables: np.ndarray
    accepting: np.ndarray
    accept_tables: np.ndarray
    flags: np.ndarray
    equations: EquationKernels


UNDAMPED, AT_REST, IN_MOTION, DAMPERS = -1.0, 0.0, 1.0, 2.0
"""Numbers of the kernels of elements; they have dampers if the number is positive, and all but dampers if it is below 2."""
FORCE_AT, TANGENT_AT, STORED_AT, LOST_AT, PUT_IN_AT, SLID_AT, ADVANCE_AT = range(7)
"""Columns of `Coordinates.kernels`. All kernels have the arguments table, table of the group, and a number: `IN_MOTION` or
`AT_REST`. Groups whose forces depend on rates also take `UNDAMPED`, in motion without dampers, and `DAMPERS`, forces and
tangents of dampers alone.

The first column adds forces. The second adds forces and tangents. The third returns the stored energy (J), the fourth
the dissipated power of dampers (W). The fifth returns the power that elements put into the system (W), the sixth the power
that their memory dissipates (W); their number is the size of the accepted step that ends at the present state (s), or zero
for the power of the present rates. The seventh advances efforts that are unknowns of their own in statics; the rates are
then an increment.
"""
(
    Q, U, FORCE, START, FIXED, WEIGHT, STIFFNESS, DAMPING, MATRIX, MASS, FULL_MASS, FACTORS, MASS_FACTORS, NUMBERS,
    FORCINGS, SIZES, KINDS, CLEARED, DIAGONAL, LAST, LAST_TIME, KEPT_STIFFNESS, KEPT_DAMPING,
    HALFWAY, HALFWAY_RATES, DAMPER_FORCE, DAMPER_STIFFNESS, DAMPER_DAMPING, DAMPED_GROUPS, _MASS_ROWS,
) = range(30)  # fmt: skip
"""Rows of `Coordinates.table`."""
_FULL_ROWS = _MASS_ROWS + len(Rows._fields)
_PROGRAMS = _FULL_ROWS + len(Rows._fields)
_MOVED = _PROGRAMS + len(Pieces._fields)
_PATTERN = _MOVED + 3 + len(Pieces._fields)
HELD_STIFFNESS, DAMPED, RATE_DEPENDENT, NOW, MEAN_OVER, APART = range(6)
"""Indices of `Arrays.numbers`."""
KINDS_OF_ENERGY = ("panels", "creases", "bars", "hinges", "film", "patch", "cable", "beam", "gas")
"""Names of groups, in the order of the numbers in `Arrays.kinds`, from 1 on."""


@kernel
def no_power(table: np.ndarray, own: np.ndarray, number: float) -> float:
    """Kernel of elements in a column that they do not need."""
    return 0.0


@kernel
def _rows_of(t: np.ndarray, k: int) -> Rows:
    return Rows(integers_1d(t, k), integers_1d(t, k + 1), floats_1d(t, k + 2))


@kernel
def mass_of(t: np.ndarray) -> Rows:
    """Mass matrix of the table with oscillators in place of held coordinates."""
    return _rows_of(t, _MASS_ROWS)


@kernel
def full_mass_of(t: np.ndarray) -> Rows:
    """Mass matrix of the table."""
    return _rows_of(t, _FULL_ROWS)


@kernel
def forcing_programs(t: np.ndarray) -> Pieces:
    """Programs of the loads of the table."""
    return pieces_at(t, _PROGRAMS)


@kernel
def moved_of(t: np.ndarray) -> Moved:
    """Moved coordinates of the table."""
    k = _MOVED
    return Moved(integers_1d(t, k), integers_1d(t, k + 1), floats_1d(t, k + 2), pieces_at(t, k + 3))


@kernel
def pattern_of(t: np.ndarray) -> Pattern:
    """Pattern of the table."""
    return pattern_at(t, _PATTERN)
