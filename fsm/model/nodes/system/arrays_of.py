"""Arrays of a mesh for compiled steps, if all its elements and loads have arrays."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy import sparse

from fsm.kernels.addresses import address_table
from fsm.kernels.block_equations import equation_kernels, pattern_arrays
from fsm.kernels.block_lu import factorise
from fsm.kernels.blocks import BlockPattern, Elimination
from fsm.kernels.pointers import Pointer
from fsm.kernels.programs import table_of
from fsm.model.nodes.arrays import ADVANCE_AT, KINDS_OF_ENERGY, Arrays, Coordinates, Moved, Rows, no_power
from fsm.model.nodes.group import set_held
from fsm.model.nodes.system.array_kernels import AT_REST, KERNELS
from fsm.solve.interface.records import Ready
from fsm.solve.stepping.equilibrium import RestModel
from fsm.solve.stepping.model import ArrayModel

if TYPE_CHECKING:
    from fsm.model.nodes.system.moving_mesh import MovingMesh


_KINDS = {name: number for number, name in enumerate(KINDS_OF_ENERGY, start=1)}


class Compiled:
    """Compiled models of a system without parts in Python: in motion, and at rest. Both models share all arrays."""

    def __init__(self, system: MovingMesh, ready: Ready) -> None:
        self._arrays, self._held = coordinates_of(system, Matrices.of(system, ready))
        self._state = system.initial()

    @cached_property
    def model(self) -> ArrayModel:
        """Model for time steps."""
        return ArrayModel.of(KERNELS, self._arrays, *self._state)

    @cached_property
    def at_rest(self) -> RestModel:
        """Model for equilibria."""
        return RestModel.of(AT_REST, self._arrays, self._state[0])


class Matrices(NamedTuple):
    """Block matrices that contain the coordinates of a mesh.

    Attributes
    ----------
    pattern : BlockPattern
    known, factors : symbolic factorisation of the pattern, and data for the factors
    fixed : (n_rows, size) array
        Held and moved coordinates.
    mass, full_mass : block data, see `Arrays`
    slots : list of (m, v, v) arrays
        See `ElementGroup.add_linearised`.
    """

    pattern: BlockPattern
    known: Elimination
    factors: np.ndarray
    fixed: np.ndarray
    mass: np.ndarray
    full_mass: np.ndarray
    slots: list[np.ndarray]

    @classmethod
    def of(cls, system: MovingMesh, ready: Ready) -> Matrices:
        """Matrices of a mesh alone."""
        pattern = system.pattern
        fixed, mass = system.fixed.reshape(-1, pattern.size), system.inertia(system.start, pattern)
        return cls(pattern, *ready(pattern), fixed, mass, system.full_mass, system.slots)


def coordinates_of(
    system: MovingMesh, matrices: Matrices, low_rank: np.ndarray | None = None
) -> tuple[Coordinates, list[np.ndarray]]:
    """Model of the coordinates of a system, and all arrays whose addresses the model contains; `low_rank` is the table of a
    part of low rank.
    """
    groups = system.groups
    pattern, known, factors, fixed, mass, full_mass, all_slots = matrices
    loading, n = system.loading, system.nu
    p = pattern_arrays(pattern, known)
    mass_factors = np.zeros(factors.shape)
    if loading.motions:
        factorise(mass, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, True, mass_factors)
    forcings = np.array([forcing.vector for forcing in loading.forcings], dtype=float).reshape(-1, n)
    damped = np.array([group.rate_dependent for group in groups], dtype=np.int64)
    of_dampers = pattern.zeros() if damped.any() else np.zeros((0, 0, 0))
    arrays = Arrays(
        np.zeros(n), np.zeros(n), np.zeros(n), system.start,
        system.fixed.astype(np.int64).reshape(-1, system.pattern.size),
        system.weight, pattern.zeros(), pattern.zeros(), pattern.zeros(), mass, full_mass, np.zeros(factors.shape),
        mass_factors, np.array([system.held_stiffness, loading.mass_damping, float(system.rate_dependent), 0.0, 0.0, 0.0]),
        forcings,
        np.array([float(np.linalg.norm(motion.displacement)) for motion in loading.motions]),
        np.array([_KINDS.get(group.name, 0) for group in groups], dtype=np.int64), *_held(fixed, pattern),
        np.zeros(n), np.zeros(1), pattern.zeros(), pattern.zeros(),
        np.zeros(n), np.zeros(n), np.zeros(n), of_dampers, of_dampers.copy(), damped,
        _rows(system.mass(system.start)), _rows(system.full_mass_matrix),
        table_of([forcing.time for forcing in loading.forcings]), _moved(system), p,
    )  # fmt: skip
    flat = list(_flat(arrays))
    table, flags = address_table(flat), np.zeros(3, dtype=np.int64)
    kernels, tables = np.zeros((len(groups), ADVANCE_AT + 1), dtype=np.int64), []
    for row, group, slots in zip(kernels, groups, all_slots, strict=True):
        held = group.arrays_with(slots)
        flat += held
        tables.append(address_table(held))
        all_kernels = (*group.kernels, *(no_power,) * (len(row) - len(group.kernels)))
        row[:] = [Pointer(one, table, tables[-1], 0.0).address for one in all_kernels]
    accepting, accept_tables = [], []
    accepted = [(group.accept, group.table) for group in groups if group.accept is not None]
    for one, held in (*system.accepting(), *accepted):
        flat += held
        accept_tables.append(address_table(held))
        accepting.append(Pointer(one, table, accept_tables[-1], 0.0).address)
    model = Coordinates(
        table, kernels, _padded(tables), np.array(accepting, dtype=np.int64), _padded(accept_tables), flags,
        equation_kernels(p, mass, mass_factors, system.start, low_rank),
    )  # fmt: skip
    return model, flat


def _padded(tables: list[np.ndarray]) -> np.ndarray:
    """Tables (k, m, 4), all with the number of rows of the longest table."""
    out = np.zeros((len(tables), max(map(len, tables), default=0), 4), dtype=np.int64)
    for place, table in zip(out, tables, strict=True):
        place[: len(table)] = table
    return out


def _flat(arrays: Any) -> list[np.ndarray]:
    return [array for part in arrays for array in (_flat(part) if isinstance(part, tuple) else [part])]


def _rows(matrix: sparse.csr_matrix) -> Rows:
    return Rows(matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64), np.ascontiguousarray(matrix.data))


def _held(fixed: np.ndarray, pattern: BlockPattern) -> tuple[np.ndarray, np.ndarray]:
    """Positions, in the flat block data, of the rows and columns of held coordinates, and of their diagonal entries."""
    marked = np.ones_like(pattern.zeros())
    set_held(fixed, pattern.indptr, pattern.indices, 2.0, marked)
    return np.flatnonzero(marked == 0.0), np.flatnonzero(marked == 2.0)


def _moved(system: MovingMesh) -> Moved:
    motions = system.loading.motions
    numbers = [np.full(len(motion.coordinates), k) for k, motion in enumerate(motions)]
    none: list[Any] = [np.zeros(0)]
    return Moved(
        np.concatenate(none + [motion.coordinates for motion in motions]).astype(np.int64),
        np.concatenate(none + numbers).astype(np.int64),
        np.concatenate(none + [motion.displacement for motion in motions]).astype(float),
        table_of([motion.time for motion in motions]),
    )  # fmt: skip
