"""Base class of a group of ANCF elements: vectors, mass, energy, force and tangents.

All coordinates are components of vectors (positions and slopes), and elements are connected vector by vector. Elements may
share a position, a slope or neither. Elements use the same index for a vector that they share, so no constraint equations
are needed.

The forces of a kind are kernels on two tables, that of the mesh (`fsm.model.nodes.arrays`) and that of the group. Compiled
steps call them by their addresses, and so do the methods of the group.

Constant block matrices of a mesh, and elimination of the rows and columns of held coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fsm.kernels.addresses import ROW, address_table, put_array
from fsm.kernels.blocks import BlockPattern, LowRank
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import address_of, call_at
from fsm.model.nodes import arrays as at
from fsm.model.nodes.assembly import slots_of
from fsm.solve.interface.records import PreviousState

_NO_BLOCKS = np.zeros((0, 1, 1))


@dataclass(frozen=True, eq=False)
class MassPart:
    """Mass matrices of a batch: the block of the vectors i and j of element e is scalar[e, i, j] tensor[e].

    Attributes
    ----------
    vectors : (m, v) int array
        First coordinate of each vector.
    scalar : (m, v, v) array, kg (positions), kg m (position and slope), kg m^2 (slopes) for slopes in m/m
    tensor : (m, d, d) array, or (d, d) if all are equal
        The unit matrix, or n n^T for a mass that moves along a normal n only (air).
    """

    vectors: np.ndarray
    scalar: np.ndarray
    tensor: np.ndarray


@kernel
def _call(
    address: int, table: np.ndarray, own: np.ndarray, moving: float, q: np.ndarray, u: np.ndarray, force: np.ndarray,
    stiffness: np.ndarray, damping: np.ndarray, last: np.ndarray,
) -> float:  # fmt: skip
    """Call a kernel with these arrays of the mesh."""
    put_array(table, at.Q, q)
    put_array(table, at.U, u)
    put_array(table, at.FORCE, force)
    put_array(table, at.STIFFNESS, stiffness)
    put_array(table, at.DAMPING, damping)
    put_array(table, at.LAST, last)
    return float(call_at(address, table, own, moving))


class _Alone:
    """A group alone as a mesh, for calls from Python."""

    def __init__(self, group: ElementGroup) -> None:
        self.group, self.numbers = group, np.zeros(5)
        self.table = np.zeros((at.LAST + 1, ROW), dtype=np.int64)
        self.table[at.NUMBERS] = address_table([self.numbers])[0]
        self.before: PreviousState | None = None
        self.halfway: tuple[np.ndarray, np.ndarray] | None = None
        self._slots: np.ndarray | None = None
        self._use(np.zeros((0, *group.vectors.shape[1:] * 2), dtype=np.int64))
        self._addresses = dict[Any, int]()

    def _use(self, slots: np.ndarray) -> None:
        if self._slots is not slots:
            self._slots, self._arrays = slots, self.group.arrays_with(slots)
            self.own = address_table(self._arrays)

    def call(
        self, column: int, q: np.ndarray, u: np.ndarray | None, force: np.ndarray, slots: np.ndarray | None = None,
        stiffness: np.ndarray = _NO_BLOCKS, damping: np.ndarray = _NO_BLOCKS,
    ) -> float:  # fmt: skip
        """Call a kernel; without rates at rest. Powers that elements put in are those of the present rates."""
        if slots is not None:
            self._use(slots)
        moving, rates, last = (0.0, q, q) if u is None else (1.0, u, q if self.before is None else self.before[1])
        moving = moving if column < at.PUT_IN_AT else 0.0
        function, rest = self.group.kernels[column], (force, stiffness, damping, last)
        if self.halfway is None or moving == at.AT_REST or column == at.STORED_AT:
            return self._run(function, moving, q, rates, *rest)
        if column == at.LOST_AT:
            return self._run(function, moving, *self.halfway, *rest)
        return self._run(function, at.UNDAMPED, q, rates, *rest) + self._run(function, at.DAMPERS, *self.halfway, *rest)

    def accept(self, t: float, q: np.ndarray) -> None:
        """Call the kernel that accepts a state."""
        self._run(self.group.accept, t, q, q, q, _NO_BLOCKS, _NO_BLOCKS, q)

    def _run(self, function: Any, number: float, *arrays: np.ndarray) -> float:
        if function not in self._addresses:
            self._addresses[function] = address_of(function, self.table, self.own, 0.0)
        return float(_call(self._addresses[function], self.table, self.own, float(number), *arrays))


class ElementGroup:
    """Batch of elements of one kind; q and u (n,) are all coordinates of the mesh and their rates.

    Attributes
    ----------
    vectors : (m, v) int array
        First coordinate of each vector of each element.
    name : name of the energy; empty without one
    """

    vectors: np.ndarray
    name: str
    kernels: tuple[Any, ...]
    """Kernels of the kind, in the order of the columns of `Coordinates.kernels`."""
    viscosity: float = 0.0
    """Kelvin-Voigt time, s."""
    arrays: Any
    """Tuple of arrays of the kind."""
    accept: Any = None
    """Kernel that changes the memory at an accepted state, with the arguments of `kernels` and its time; None without
    memory."""

    @property
    def table(self) -> list[np.ndarray]:
        """Arrays of the table of the group, without the positions of matrix blocks, which follow."""
        return list(self.arrays)

    @property
    def rate_dependent(self) -> bool:
        """Whether the forces depend on velocities."""
        return self.viscosity > 0.0

    def mass(self) -> MassPart:
        """Constant mass matrices; by default no mass."""
        width = self.vectors.shape[1]
        return MassPart(np.zeros((0, width), dtype=np.int64), np.zeros((0, width, width)), np.eye(3))

    def arrays_with(self, slots: np.ndarray) -> list[np.ndarray]:
        """All arrays of the table; `slots` as in `add_linearised`."""
        return [*self.table, np.ascontiguousarray(slots).reshape(-1, slots.shape[-1])]

    @cached_property
    def _alone(self) -> _Alone:
        return _Alone(self)

    def at(self, t: float, before: PreviousState | None) -> None:
        """Set the time, and in a step of a path the state at its other end, for all later calls."""
        alone = self._alone
        alone.before = before if before is not None and before[0] != t else None
        alone.numbers[at.NOW], alone.numbers[at.MEAN_OVER] = t, 0.0 if alone.before is None else t - alone.before[0]

    def act_halfway(self, state: tuple[np.ndarray, np.ndarray] | None) -> None:
        """Let the dampers act at these coordinates and rates, or with None at those of each call; see
        `fsm.solve.stepping.model.halfway`.
        """
        self._alone.halfway = state

    def add_force(self, q: np.ndarray, u: np.ndarray | None, force: np.ndarray) -> None:
        """Add the generalised forces -dU/dq - dR/du to `force` (n,); without u the rates are zero."""
        self._alone.call(at.FORCE_AT, q, u, force)

    def add_linearised(
        self,
        q: np.ndarray,
        u: np.ndarray | None,
        slots: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
    ) -> None:
        """Add forces, and -dh/dq and -dh/du to block data.

        Parameters
        ----------
        slots : (m, v, v) int array
            Position, in the flat block data, of the first entry of the block of two vectors; rows are `size` apart.
        stiffness, damping : (n_blocks, size, size) arrays
        """
        self._alone.call(at.TANGENT_AT, q, u, force, slots, stiffness, damping)

    def energy(self, q: np.ndarray, u: np.ndarray | None) -> tuple[float, float]:
        """Stored energy (J) and dissipated power (W)."""
        lost = 0.0 if u is None else self._alone.call(at.LOST_AT, q, u, q)
        return self._alone.call(at.STORED_AT, q, u, q), lost

    def put_in(self, q: np.ndarray, u: np.ndarray) -> float:
        """Power that the elements put into the system, W."""
        return self._alone.call(at.PUT_IN_AT, q, u, q) if len(self.kernels) > at.PUT_IN_AT else 0.0

    def slid(self, q: np.ndarray, u: np.ndarray) -> float:
        """Power that the memory of the elements dissipates, W."""
        return self._alone.call(at.SLID_AT, q, u, q) if len(self.kernels) > at.SLID_AT else 0.0

    @property
    def low_rank(self) -> LowRank | None:
        """Part of -dh/dq at the last tangent that is not in block data; by default none."""
        return None

    def add_force_rate(self, t: float, q: np.ndarray, force: np.ndarray) -> None:
        """Add the explicit time derivative of the forces at rest; by default none."""
        return

    def break_times(self) -> list[float]:
        """Times at which a function of time of the group is not smooth, s; by default none."""
        return []

    def peak_times(self) -> list[float]:
        """Times among which the forces of the group at rest are largest, s."""
        return self.break_times()

    # memory -------------------------------------------------------------------------------------------------------------

    @property
    def kept(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Arrays of the memory, which `accept` changes in place, and their values at the start; by default none."""
        return []

    def commit(self, t: float, q: np.ndarray) -> None:
        """Change the memory at an accepted state."""
        if self.accept is not None:
            self._alone.accept(t, q)

    @property
    def remembered(self) -> int:
        """Length of the memory."""
        return sum(len(one) for one, _ in self.kept)

    def memory(self) -> np.ndarray:
        """Memory as one flat array."""
        return np.concatenate([np.zeros(0), *(one for one, _ in self.kept)])

    def restore(self, memory: np.ndarray) -> None:
        """Set the memory; an empty array sets it to that of the start."""
        begin = 0
        for one, first in self.kept:
            one[:] = memory[begin : begin + len(one)] if len(memory) else first
            begin += len(one)


def mass_data(parts: Iterable[MassPart], pattern: BlockPattern, first: int = 0) -> np.ndarray:
    """Mass matrix of all coordinates as block data; `first` is the row of coordinate 0."""
    data = pattern.zeros()
    flat = data.reshape(-1)
    for part in parts:
        if not len(part.vectors):
            continue
        slots = slots_of(np.ascontiguousarray(part.vectors + first), pattern.size, pattern.indptr, pattern.indices)
        tensor = np.broadcast_to(part.tensor, (len(slots), *part.tensor.shape[-2:]))
        for a in range(tensor.shape[-2]):
            for b in range(tensor.shape[-1]):
                if np.any(tensor[:, a, b]):
                    values = part.scalar * tensor[:, a, b, None, None]
                    np.add.at(flat, slots + a * pattern.size + b, values)
    return data


@kernel
def set_held(
    fixed: np.ndarray, indptr: np.ndarray, indices: np.ndarray, diagonal: float, data: np.ndarray
) -> None:
    """Set the rows and columns of held coordinates (n_nodes, size) to zero, and their diagonal to `diagonal`."""
    size = data.shape[1]
    for i in range(indptr.shape[0] - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            for a in range(size):
                if fixed[i, a]:
                    for b in range(size):
                        data[k, a, b] = 0.0
            for b in range(size):
                if fixed[j, b]:
                    for a in range(size):
                        data[k, a, b] = 0.0
            if i == j:
                for a in range(size):
                    if fixed[i, a]:
                        data[k, a, a] = diagonal


def clear_held(fixed: np.ndarray, pattern: BlockPattern, diagonal: float, data: np.ndarray) -> None:
    """Apply `set_held` with `fixed` of shape (n,)."""
    set_held(fixed.reshape(-1, pattern.size), pattern.indptr, pattern.indices, diagonal, data)
