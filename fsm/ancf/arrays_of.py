"""Arrays of a mesh for compiled steps, if all its elements and loads have arrays."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from fsm.ancf.array_cables import CABLES, arrays_of_cables
from fsm.ancf.array_kernels import AT_REST, KERNELS
from fsm.ancf.arrays import Arrays, Coordinates, Moved, Pattern, Rows
from fsm.ancf.cable import CableGroup
from fsm.ancf.matrices import clear_held
from fsm.ancf.programs import programs_of
from fsm.kernels.addresses import address_table
from fsm.kernels.block_lu import factorise, solve_refined
from fsm.kernels.pointers import Pointer
from fsm.stepping.equilibrium import RestModel
from fsm.stepping.model import ArrayModel
from fsm.system_records import Ready

if TYPE_CHECKING:
    from fsm.ancf.system import AncfSystem

__all__ = ["Compiled", "has_arrays"]

_KERNELS: dict[type, tuple[tuple[Any, ...], Callable[[Any, np.ndarray], list[np.ndarray]]]] = {
    CableGroup: (CABLES, arrays_of_cables),
}
"""By kind of group: kernels in the order of the columns of `Coordinates.kernels`, and the arrays of a group."""
_KINDS = {"panels": 1, "creases": 2}


def has_arrays(system: AncfSystem) -> bool:
    """Whether all elements and functions of time of a system have arrays, and kernels are compiled."""
    if not hasattr(KERNELS.force, "compile"):  # NUMBA_DISABLE_JIT
        return False
    functions = [forcing.time for forcing in system.loading.forcings]
    functions += [motion.time for motion in system.loading.motions]
    return all(type(group) in _KERNELS for group in system.mesh.groups) and programs_of(functions) is not None


class Compiled:
    """Models of arrays of a system for which `has_arrays` is true: in motion, and at rest. They share all arrays."""

    def __init__(self, system: AncfSystem, ready: Ready) -> None:
        self._arrays, self._held = _arrays_of(system, ready)
        self._state = system.initial()

    @cached_property
    def model(self) -> ArrayModel:
        """Model for time steps."""
        return ArrayModel.of(KERNELS, self._arrays, *self._state)

    @cached_property
    def at_rest(self) -> RestModel:
        """Model for equilibria."""
        return RestModel.of(AT_REST, self._arrays, self._state[0])


def _arrays_of(system: AncfSystem, ready: Ready) -> tuple[Coordinates, list[np.ndarray]]:
    """Arrays of a system, and all arrays to which their addresses refer."""
    pattern, loading, n = system.pattern, system.loading, system.nu
    known, factors = ready(pattern)
    p = Pattern(
        pattern.indptr, pattern.indices, pattern.transposed, known.order, known.indptr, known.indices, known.diagonal,
        known.place,
    )  # fmt: skip
    mass, mass_factors = system.inertia(system.start, pattern), np.zeros(factors.shape)
    factorise(mass, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, True, mass_factors)
    forcings = np.array([forcing.vector for forcing in loading.forcings], dtype=float).reshape(-1, n)
    arrays = Arrays(
        np.zeros(n), np.zeros(n), np.zeros(n), system.start, system.fixed.astype(np.int64).reshape(-1, pattern.size),
        system.weight, pattern.zeros(), pattern.zeros(), pattern.zeros(), mass, system.full_mass, np.zeros(factors.shape),
        mass_factors, np.array([system.held_stiffness, loading.mass_damping, float(system.rate_dependent)]), forcings,
        np.array([float(np.linalg.norm(motion.displacement)) for motion in loading.motions]),
        np.array([_KINDS.get(group.name, 0) for group in system.mesh.groups], dtype=np.int64), *_held(system), np.zeros(n),
        np.zeros(1),
        _rows(system.mass(system.start)), _rows(system.full_mass_matrix), _programs(loading.forcings), _moved(system), p,
    )  # fmt: skip
    flat = list(_flat(arrays))
    table, flags = address_table(flat), np.zeros(3, dtype=np.int64)
    kernels, tables = np.zeros((len(system.mesh.groups), 4), dtype=np.int64), []
    for row, group, slots in zip(kernels, system.mesh.groups, system.slots, strict=True):
        own, arrays_of_group = _KERNELS[type(group)]
        held = arrays_of_group(group, slots)
        flat += held
        tables.append(address_table(held))
        row[:] = [Pointer(one, table, tables[-1], 0.0).address for one in own]
    padded = np.zeros((len(tables), max(map(len, tables), default=0), table.shape[1]), dtype=np.int64)
    for place, one in zip(padded, tables, strict=True):
        place[: len(one)] = one
    model = Coordinates(
        table, kernels, padded, flags,
        Pointer(factorise, mass, p.place, p.filled_rows, p.filled_columns, p.filled_diagonal, True, mass_factors),
        Pointer(
            solve_refined, p.order, p.filled_rows, p.filled_columns, p.filled_diagonal, mass_factors, p.rows, p.columns,
            mass, system.start, 0.0, True, True,
        ),
    )  # fmt: skip
    return model, flat


def _flat(arrays: Any) -> list[np.ndarray]:
    return [array for part in arrays for array in (_flat(part) if isinstance(part, tuple) else [part])]


def _rows(matrix: sparse.csr_matrix) -> Rows:
    return Rows(matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64), np.ascontiguousarray(matrix.data))


def _held(system: AncfSystem) -> tuple[np.ndarray, np.ndarray]:
    """Places of the rows and columns of held coordinates in the flat block data, and of their diagonal."""
    marked = np.ones_like(system.pattern.zeros())
    clear_held(system.fixed, system.pattern, 2.0, marked)
    return np.flatnonzero(marked == 0.0), np.flatnonzero(marked == 2.0)


def _programs(parts: Any) -> Any:
    found = programs_of([part.time for part in parts])
    assert found is not None
    return found


def _moved(system: AncfSystem) -> Moved:
    motions = system.loading.motions
    numbers = [np.full(len(motion.coordinates), k) for k, motion in enumerate(motions)]
    none: list[Any] = [np.zeros(0)]
    return Moved(
        np.concatenate(none + [motion.coordinates for motion in motions]).astype(np.int64),
        np.concatenate(none + numbers).astype(np.int64),
        np.concatenate(none + [motion.displacement for motion in motions]).astype(float), _programs(motions),
    )  # fmt: skip
