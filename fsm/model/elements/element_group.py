"""Groups of elements whose kernels are called by their addresses, by compiled steps and by Python alike.

A kind of element is one file: a group, the table of its arrays, and kernels with the arguments (table of the model, table of
the group, time t in s, inverse of the time since the last state in 1/s), which return a number. If the inverse is zero,
dampers use the rates of the bodies. The table of the model has the rows of `fsm.model.bodies.arrays`. The table of a group
begins with the bodies, the positions of the matrix blocks (`pair_slots`, for two bodies), and the deformations at the last
state; the arrays of the group follow from row `OWN` on.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.addresses import ROW, address_table, integers_2d, put_array
from fsm.kernels.block_equations import Pattern
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import address_of, call_at, pointers
from fsm.kernels.scatter import pair_slots
from fsm.model.bodies.arrays import DAMPING, DOF, FORCE, GAS, PATTERN, POSES, RATES, STEP, STIFFNESS, STORED, SWAP
from fsm.model.bodies.group import BlockSums, BodyPattern, BodyState, Group, PreviousPoses

_BODIES, _SLOTS, LAST, OWN = range(4)
"""Rows of the table of a group."""
_EMPTY, _NO_ROWS = np.zeros((0, 0, 0)), np.zeros((0, 6))


@kernel
def nothing(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Kernel of elements that have no such part."""
    return 0.0


class ElementKernels(NamedTuple):
    """Kernels of a kind of elements, in the order of the columns of `fsm.model.bodies.arrays.Segments.elements`.

    `force` and `tangent` add to the arrays of the model. `keep` writes the deformations at the present poses to row `LAST`.
    `stored` adds the energies in panels and in creases (J) to the first numbers of the row `STORED`, and that of gas to the
    number `GAS`. `lost` returns the dissipated power (W). To the third number of this row it adds the power that an element
    puts into the system, and to the fourth the part of the dissipated power whose forces also act at rest. `accept` changes
    the memory of the group at an accepted state. `part` has the length of the step (s) in place of its inverse, and returns
    the factor by which a step that passes an event is shortened, or 0 to accept it. `lock`, `advance` and `project` belong
    to elements with locked directions, whose efforts are multipliers (`fsm.model.elements.joints`). `take_up` belongs to
    locked directions of springs (`fsm.model.elements.spring_locks`). `force_rate`, which only Python calls, adds
    the explicit time derivative of the forces at rest. `both` does what `force` and `lost` do at the present rates, from one
    evaluation of the laws; for kinds without it both are called.
    """

    force: Any
    tangent: Any
    keep: Any
    stored: Any = nothing
    lost: Any = nothing
    accept: Any = nothing
    lock: Any = nothing
    advance: Any = nothing
    project: Any = nothing
    part: Any = nothing
    take_up: Any = nothing
    force_rate: Any = nothing
    both: Any = nothing

    def addresses(self) -> list[int]:
        """Addresses of all kernels."""
        example = np.zeros((1, ROW), dtype=np.int64)
        arguments = example, example, 0.0, 0.0
        pointers(self, ElementKernels(*[arguments] * len(self)))
        found = [address_of(each, *arguments) for each in self]
        return found if self.both is not nothing else [*found[:-1], 0]


class ElementArrays(NamedTuple):
    """A group for compiled steps: kernels, arrays of its table in order, and the deformations at the last state among
    them.
    """

    kernels: ElementKernels
    arrays: list[np.ndarray]
    last: np.ndarray


@kernel(inline=True)
def bodies_of(own: np.ndarray) -> np.ndarray:
    """Bodies (m, n) of a group."""
    return integers_2d(own, _BODIES)


@kernel(inline=True)
def slots_of(own: np.ndarray) -> np.ndarray:
    """Positions (m, 4) of the matrix blocks of a group between two bodies."""
    return integers_2d(own, _SLOTS)


@kernel
def _call(
    address: int, table: np.ndarray, own: np.ndarray, t: float, per_second: float, poses: np.ndarray, rates: np.ndarray,
    force: np.ndarray, stiffness: np.ndarray, damping: np.ndarray,
) -> float:  # fmt: skip
    """Call a kernel with these arrays of the model."""
    put_array(table, POSES, poses)
    put_array(table, RATES, rates)
    put_array(table, FORCE, force)
    put_array(table, STIFFNESS, stiffness)
    put_array(table, DAMPING, damping)
    return float(call_at(address, table, own, t, per_second))


class _Alone:
    """A group alone as a model, for calls from Python."""

    def __init__(self, group: ElementGroup) -> None:
        self.stored, self.last = np.zeros(GAS + 1), np.zeros(group.last_shape)
        self.table = np.zeros((PATTERN + len(Pattern._fields), ROW), dtype=np.int64)
        self.table[STORED] = address_table([self.stored])[0]
        self._arrays = [group.bodies, np.zeros((0, 4), dtype=np.int64), self.last, *group.arrays]
        self.own = address_table(self._arrays)
        self.pattern: BodyPattern | None = None
        self.past: np.ndarray | None = None
        self._kernels, self._addresses = group.kernels, dict[str, int]()

    def use(self, group: ElementGroup, pattern: BodyPattern) -> None:
        """Set the pattern of the matrices."""
        if self.pattern is pattern:
            return
        self.pattern, self._arrays[_SLOTS] = pattern, group.slots(pattern)
        self.own[_SLOTS] = address_table([self._arrays[_SLOTS]])[0]
        dof, rows, columns = pattern.index
        self._index = dof, rows, columns  # the table has their addresses
        self.table[DOF], self.table[PATTERN : PATTERN + 2] = address_table([dof])[0], address_table([rows, columns])

    def call(
        self, name: str, t: float, per_second: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray,
        stiffness: np.ndarray = _EMPTY, damping: np.ndarray = _EMPTY,
    ) -> float:  # fmt: skip
        """Call a kernel."""
        if name not in self._addresses:
            one = getattr(self._kernels, name)
            self._addresses[name] = address_of(one, self.table, self.own, 0.0, 0.0)
        address = self._addresses[name]
        return float(_call(address, self.table, self.own, t, per_second, poses, rates, force, stiffness, damping))


class ElementGroup(Group):
    """Elements of one kind between bodies.

    Attributes
    ----------
    bodies : (m, n) int array
    memory_of : array
        Memory that `accept` changes in place; empty for most kinds.
    """

    bodies: np.ndarray
    categories: tuple[str, ...] = ("panels", "creases")
    """Names of the stored energies."""
    has_events: bool = False
    """Whether steps end at events of the elements (kernel `part`)."""
    locks: bool = False
    """Whether the elements have locked directions."""

    @property
    def feels_reactions(self) -> bool:
        """Whether forces depend on the multipliers of locked directions."""
        return False

    @property
    @abstractmethod
    def kernels(self) -> ElementKernels:
        """Kernels of the kind."""

    @property
    @abstractmethod
    def arrays(self) -> list[np.ndarray]:
        """Arrays of the table from row `OWN` on."""

    @property
    def last_shape(self) -> tuple[int, ...]:
        """Shape of the deformations."""
        return (len(self.bodies),)

    @property
    def memory_of(self) -> np.ndarray:
        """Memory that `accept` changes in place."""
        return np.zeros(0)

    @property
    def looks_back(self) -> bool:
        """Whether kernels read the deformations at the last state."""
        return self.rate_dependent

    def compiled(self, pattern: BodyPattern) -> ElementArrays:
        """Kernels and arrays for compiled steps. The memory is that of the group."""
        last = np.zeros(self.last_shape)
        return ElementArrays(self.kernels, [self.bodies, self.slots(pattern), last, *self.arrays], last)

    def slots(self, pattern: BodyPattern) -> np.ndarray:
        """Positions (m, 4) of the matrix blocks of elements between two bodies."""
        if self.bodies.shape[1] != 2:
            return np.zeros((0, 4), dtype=np.int64)
        return np.asarray(pair_slots(self.bodies, *pattern.index))

    @cached_property
    def _alone(self) -> _Alone:
        return _Alone(self)

    def _since(self, at: BodyState) -> float:
        """Inverse of the time since a past state, 1/s, whose deformations are kept; zero at rest or in motion."""
        alone, past = self._alone, at.past
        if past is None or not self.looks_back:
            return 0.0
        if alone.past is not past.poses:
            alone.call("keep", at.t, 0.0, past.poses, at.rates, at.rates)
            alone.past = past.poses
        return 1.0 / past.duration

    def deformations_before(self, rates: np.ndarray, past: PreviousPoses) -> np.ndarray:
        """Deformations at a past state."""
        self._since(BodyState(0.0, past.poses, rates, past))
        return self._alone.last

    def add_force(self, at: BodyState, force: np.ndarray) -> None:
        """See `Group`."""
        self._alone.call("force", at.t, self._since(at), at.poses, at.rates, force)

    def add_linearised(self, at: BodyState, sums: BlockSums) -> None:
        """See `Group`."""
        pattern, *of_blocks = sums
        self._alone.use(self, pattern)
        self._alone.call("tangent", at.t, self._since(at), at.poses, at.rates, *of_blocks)

    def energy(self, at: BodyState) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        alone, state = self._alone, (at.t, self._since(at), at.poses, at.rates, at.rates)
        alone.stored[:] = 0.0
        alone.call("stored", *state)
        lost = alone.call("lost", *state)
        panels, creases, put_in, _, gas = alone.stored.tolist()
        stored = {"panels": panels, "creases": creases, "gas": gas}
        return {name: stored[name] for name in self.categories}, lost, put_in

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self._pairs, 0

    @cached_property
    def _pairs(self) -> np.ndarray:
        found = np.concatenate([self.bodies[:, pair] for pair in combinations(range(self.bodies.shape[1]), 2)])
        return np.ascontiguousarray(found[found[:, 0] != found[:, 1]])

    # locked directions ------------------------------------------------------------------------------------------------

    @property
    def still(self) -> np.ndarray:
        """Energy scale of penalties at rest (J), 0 in motions, the part of the last change of the multipliers,
        the length of a body (m), and 1 in a step of the mean-force method, else 0.
        """
        return np.zeros(4)

    @property
    def sizes(self) -> np.ndarray:
        """Sizes (n,) of the openings: inverse squares of the motions over their scales that open by one."""
        return np.zeros(0)

    @property
    def acting(self) -> np.ndarray:
        """Whether each opening (n,) is locked; all are by default."""
        return np.ones(len(self.sizes), dtype=bool)

    def gradients(self, poses: np.ndarray) -> np.ndarray:
        """Gradients (n, k, 6) of the openings for each of several bodies."""
        return np.zeros((0, 0, 6))

    def lock(self, factor: float) -> None:
        """Begin Newton's method of a step; see `fsm.solve.stepping.model.lock`."""
        self._alone.call("lock", 0.0, factor, _NO_ROWS, _NO_ROWS, _NO_ROWS)

    def advance(self, change: np.ndarray, part: float = 1.0, task: float = STEP) -> float:
        """Do a task of the kernel `advance` with an increment (n_bodies, 6) of all bodies."""
        return self._alone.call("advance", task, part, _NO_ROWS, change, _NO_ROWS)

    def swap(self) -> None:
        """Exchange the present multipliers and those of the last accepted state."""
        self._alone.call("project", 0.0, float(SWAP), _NO_ROWS, _NO_ROWS, _NO_ROWS)

    def pass_time(self, t: float, passed: float) -> None:
        """Add the change of prescribed openings by a short time (s) from t to the openings; by default none."""
        return

    # memory -----------------------------------------------------------------------------------------------------------

    def resolution(self, length: float) -> float:
        """Error of positions above which efforts are wrong, whatever the tolerance, m; angles times `length`."""
        return math.inf

    def hold(self, held: bool) -> None:
        """See `System`; by default, forces of a step depend on the present state alone."""
        return

    def part_of_step(self, at: BodyState, step: float) -> float:
        """Part of a step that ends at a state up to its first event; 2 without one."""
        return self._alone.call("part", at.t, step, at.poses, at.rates, at.rates) or 2.0

    def commit(self, at: BodyState) -> None:
        """Change the memory after an accepted step."""
        self._alone.call("accept", at.t, 0.0, at.poses, at.rates, at.rates)

    def memory(self) -> np.ndarray:
        """Memory as one flat array."""
        return self.memory_of.copy()

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory; an empty array sets it to that of the start."""
        self.memory_of[:] = memory if len(memory) else self.first_memory

    @property
    def first_memory(self) -> np.ndarray:
        """Memory at the start."""
        return np.zeros(0)
