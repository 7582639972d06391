"""Contacts of one geometry in a named table, which compiled steps and Python change by the same kernels.

A geometry has *slots*: possible contacts of a probe point with a surface, a corner with a plate, or two edges.
Slots may be renumbered at each renewal of the broad phase, but each slot has a constant key. The memory of contacts
changes only when a step is accepted, so forces between steps are functions of the state. The table holds the contacts of
the last evaluated state in its first rows; see `fsm.model.bodies.contact_arrays`.
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np

from fsm.kernels.keys import find_keys
from fsm.kernels.tables import Table, as_declared, empty_arrays, with_rows
from fsm.model.bodies import contact_arrays as row
from fsm.model.bodies.contact_arrays import ContactArrays, GeometryKernels
from fsm.model.bodies.group import BodyPattern
from fsm.model.contact.array_contact_state import find_slots, measure_slots, renew_search
from fsm.model.contact.contact_memory import ContactDepths, ContactMemory
from fsm.model.contact.geometry_calls import calls_of

Own = TypeVar("Own", bound="ContactTable")
_NONE = np.zeros(0, dtype=np.int64)


class ActiveContacts(NamedTuple):
    """Slots whose gap is below a bound.

    Attributes
    ----------
    slot : (count,) int array
    gap : (count,) array, m
        Negative when they touch.
    """

    slot: np.ndarray
    gap: np.ndarray


class ContactKinematics(NamedTuple):
    """Rates of contacts, and their gradients with respect to the bodies' coordinates.

    Attributes
    ----------
    bodies : (count, k) int array
        Bodies of each contact; the first body carries the point.
    rate : (count, 1 + c) array, m/s
        Rate of the gap; slip velocity, along the face in the plane (c = 1), in inertial axes in space (c = 3).
    gradient : (count, 1 + c, k size) array
        rate = gradient . rates of the bodies.
    """

    bodies: np.ndarray
    rate: np.ndarray
    gradient: np.ndarray


class ContactTable(ABC):
    """Contacts of one geometry. Poses (n_bodies, 3 or 7) and rates (n_bodies, 3 or 6) include all bodies.

    Parameters
    ----------
    kernels : GeometryKernels
    slips : number of slip components: 1 in the plane, 3 in space
    margin : largest gap that `find` returns, m
    moving, radii : bodies whose motion requires a renewal of the broad phase, and the distance of the farthest point of each
        body, m
    own : arrays of the geometry without slots

    Attributes
    ----------
    table : Table
    refreshes : int
        Number of renewals of the broad phase; slots keep their numbers until it changes.
    touched : int
        Number of calls of `find`, `measure` and `commit`, which overwrite the contacts of the last evaluated state.
    """

    coupled_bodies: ClassVar[int]
    """Number of bodies of a contact."""
    renumbers: ClassVar[bool] = False
    """Whether a renewal of the broad phase in compiled steps gives slots other numbers."""
    fades: ClassVar[bool] = False
    """Whether the depth of a contact, as a result, fades out with its tapered weight."""
    table: Any

    def __init__(
        self, kernels: GeometryKernels, slips: int, margin: float, moving: np.ndarray, radii: np.ndarray, own: Any
    ) -> None:
        self.kernels, self.slips, self.margin = kernels, slips, margin
        size, bodies, state = 3 if slips == 1 else 6, self.coupled_bodies, np.zeros(row.STATES, dtype=np.int64)
        poses, ways, square = np.zeros((0, 3 if slips == 1 else 7)), np.zeros((0, slips)), np.zeros((0, slips, slips))
        state[row.FOUND], state[row.RENUMBERS], state[row.FADES] = -1, self.renumbers, self.fades
        common = empty_arrays(ContactArrays)._replace(
            state=state, calls=calls_of(kernels), numbers=np.array([margin, 0.0, 0.0, 0.0, 1.0]), resolving=np.zeros(6),
            committed=poses,
            reference=poses, found_poses=poses, moving=moving, radii=radii, deflection=ways,
            bodies=np.zeros((0, bodies), dtype=np.int64), rate=np.zeros((0, 1 + slips)),
            gradient=np.zeros((0, 1 + slips, bodies * size)), slip=ways, effort=ways, by_slip=square, by_normal=ways,
            deflected=ways, by_distance=square, by_turn=square,
        )  # fmt: skip
        self.table = Table(common, as_declared(own))
        self.refreshes = self.touched = 0
        self._coupled: tuple[int, np.ndarray] = -1, np.zeros((0, 2), dtype=np.int64)
        self._order: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    @property
    def common(self) -> ContactArrays:
        """Arrays that all geometries have."""
        arrays: ContactArrays = self.table.parts[0]
        return arrays

    @property
    def own(self) -> Any:
        """Arrays of the geometry."""
        return self.table.parts[1]

    def with_slots(self, own: Any, count: int, share: np.ndarray, area: np.ndarray, pair: np.ndarray) -> None:
        """Replace all slots; their memory is zero."""
        common = self.common._replace(**{name: getattr(self.common, name)[:0] for name in row.OF_SLOTS})
        common = with_rows(common, row.OF_SLOTS, count)._replace(share=share.copy(), area=area, pair=pair)
        self.table.replace(common, as_declared(own))
        common.state[row.FOUND], common.state[row.REFERRED], self._order = -1, 0, None

    def twin(self: Own) -> Own:
        """Copy with a table of its own, for compiled steps."""
        other = copy.copy(self)
        other.table = Table(*(type(part)._make(array.copy() for array in part) for part in self.table.parts))
        other.clear_caches()
        other.common.state[row.EVALUATIONS] = 0
        return other

    def index(self, pattern: BodyPattern) -> None:
        """Replace the pattern of compiled steps."""
        dof, indptr, indices = pattern.index
        self.table.put(dof=dof, indptr=indptr, indices=indices)
        self.common.state[row.LACKS] = 0

    # slots ----------------------------------------------------------------------------------------------------------

    @property
    def slots(self) -> int:
        """Number of slots."""
        return len(self.common.share)

    @property
    def share(self) -> np.ndarray:
        """Fraction of the face that each slot represents, (n_slots,)."""
        return self.common.share[: self.slots]

    @property
    def area(self) -> np.ndarray:
        """Area that each slot represents, (n_slots,), m^2.

        If both faces of a pair probe each other, each probe point has half its weight. The areas then sum to the contact
        area.
        """
        return self.common.area[: self.slots]

    @property
    def pair(self) -> np.ndarray:
        """Number of the contact pair of each slot, (n_slots,)."""
        return self.common.pair[: self.slots]

    @abstractmethod
    def keys(self, slots: np.ndarray) -> np.ndarray:
        """Keys of slots: integers that do not change at a renewal."""

    def _rows(self, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (m,) of those keys (n,) that are slots at present, and these slots (m,)."""
        every = self.keys(np.arange(self.slots))
        if self._order is None or not np.array_equal(every, self._order[0]):
            order = np.argsort(every, kind="stable")
            self._order = every, every[order], order
        place = find_keys(self._order[1], keys)
        known = np.flatnonzero(place >= 0)
        return known, self._order[2][place[known]]

    # search ---------------------------------------------------------------------------------------------------------

    @abstractmethod
    def coupled(self) -> np.ndarray:
        """Pairs (m, 2) of bodies that contacts may couple until the next renewal."""

    def coupled_first(self, poses: np.ndarray) -> np.ndarray:
        """Pairs (m, 2) of bodies for which the first pattern of compiled steps has blocks."""
        return self.pairs(poses)[0]

    @abstractmethod
    def coupled_ahead(self) -> np.ndarray:
        """Pairs (m, 2) of bodies for which a further pattern of compiled steps has blocks."""

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """Pairs of bodies that contacts may couple until the next renewal, and a version number that changes when the pairs
        change.
        """
        self.refresh(poses)
        if self._coupled[0] != self.refreshes:
            self._coupled = self.refreshes, self.coupled()
        return self._coupled[1], self.refreshes

    def size_for(self, bodies: int) -> None:
        """Make room for the poses of a number of bodies."""
        if len(self.common.reference) != bodies:
            poses, rates = (bodies, 3 if self.slips == 1 else 7), (bodies, 3 if self.slips == 1 else 6)
            self.table.put(
                committed=np.zeros(poses), reference=np.zeros(poses), found_poses=np.zeros(poses),
                rates_before=np.zeros(rates), found_rates=np.zeros(rates), dof=np.full(bodies, -1),
            )  # fmt: skip

    def refresh(self, poses: np.ndarray) -> None:
        """Renew the broad phase if bodies have moved too far."""
        self.size_for(len(poses))
        if renew_search(self.table, poses):
            self._renewed()

    def _renewed(self) -> None:
        self.refreshes += 1

    def search(self, poses: np.ndarray, below: float) -> int:
        """Write the slots whose gap is below a bound, m, at most the margin, and return their number."""
        self.refresh(poses)
        return int(find_slots(self.table, poses, float(below)))

    def find(self, poses: np.ndarray, below: float) -> ActiveContacts:
        """Find the slots whose gap is below a bound, m; the bound is at most the margin."""
        count, common = self.search(poses, below), self.common
        self.touched += 1
        return ActiveContacts(common.slot[:count].copy(), common.gap[:count].copy())

    def measure(self, poses: np.ndarray, rates: np.ndarray, below: float) -> ContactKinematics:
        """Compute rates and gradients of the contacts that `find` returns."""
        count, common = self.search(poses, below), self.common
        self.touched += 1
        measure_slots(self.table, poses, rates, count)
        return ContactKinematics(*(values[:count].copy() for values in (common.bodies, common.rate, common.gradient)))

    def call_with(self, pattern: BodyPattern, function: Any, *arguments: Any) -> None:
        """Call a function whose first argument is the table, with another pattern."""
        dof, indptr, indices = pattern.index
        without = self.common.dof
        self.table.put(dof=dof, indptr=indptr, indices=indices)
        function(self.table, *arguments)
        self.table.put(dof=without, indptr=_NONE, indices=_NONE)  # so that the broad phase does not check this pattern

    def crossed(self, poses: np.ndarray) -> tuple[int, ...]:
        """Number of the first pair whose sides have passed through each other since the last commit, if any."""
        self.refresh(poses)
        pair = self.kernels.passed(self.table, poses)
        return () if pair < 0 else (int(pair),)

    # memory ---------------------------------------------------------------------------------------------------------

    def press(self, depths: ContactDepths) -> None:
        """Write the depths at which statics linearises the normal law."""
        pressed, (known, slots) = self.common.pressed, self._rows(depths.key)
        pressed[:] = 0.0
        pressed[slots], self.common.numbers[row.MOST] = depths.depth[known], depths.most

    def commit(self, poses: np.ndarray, young: np.ndarray | None = None) -> None:
        """Update the memory of the geometry after an accepted step, for example the side on which a point lies.

        `young` lists the slots of contacts that may be continuing impacts; None means all contacts.
        """
        count, common = self.search(poses, 0.0), self.common
        slots = common.slot[:count].copy() if young is None else young
        common.committed[:], common.state[row.STARTED] = poses, 1
        self.kernels.settle(self.table, poses, slots, False)
        self.touched, common.state[row.FOUND] = self.touched + 1, -1

    def contacts(self) -> ContactMemory:
        """Memory of contacts."""
        arrays = self.common
        rows = np.flatnonzero(arrays.onset > 0.0)
        keys = self.keys(rows)
        rows, keys = rows[np.argsort(keys, kind="stable")], np.sort(keys)
        return ContactMemory(keys, arrays.onset[rows], arrays.began[rows], arrays.depth[rows], arrays.deflection[rows])

    def load_contacts(self, kept: ContactMemory) -> None:
        """Restore the memory of contacts."""
        arrays, (known, rows) = self.common, self._rows(kept.key)
        for values, own in zip((arrays.onset, arrays.began, arrays.depth, arrays.deflection), kept[1:], strict=True):
            values[:] = 0.0
            values[rows] = own[known]

    @abstractmethod
    def own_memory(self) -> np.ndarray:
        """Memory of the geometry alone, as one flat array."""

    @abstractmethod
    def load_own(self, memory: np.ndarray) -> None:
        """Restore the memory of the geometry alone; an empty array gives the initial memory."""

    def memory(self) -> np.ndarray:
        """Memory as one flat array: time, contacts, poses and rates of the last accepted state, and the geometry's own;
        empty before the first accepted state.
        """
        common = self.common
        if not common.state[row.STARTED]:
            return np.zeros(0)
        time, contacts = common.numbers[row.COMMITTED_AT:row.BELOW], self.contacts().flat()
        return np.concatenate([time, contacts, common.committed.ravel(), common.rates_before.ravel(), self.own_memory()])

    def restore(self, memory: np.ndarray) -> None:
        """Restore the memory; an empty array gives the initial memory."""
        common = self.common
        self.touched, common.state[row.FOUND], common.state[row.CHANGES] = self.touched + 1, -1, 0
        common.state[row.REFERRED] = 0
        common.state[row.STARTED] = int(len(memory) > 0)
        if not len(memory):
            common.numbers[row.COMMITTED_AT] = 0.0
            none = np.zeros(0)
            self.load_contacts(ContactMemory(_NONE, none, none, none, np.zeros((0, self.slips))))
            self.load_own(memory)
            return
        common.numbers[row.COMMITTED_AT] = memory[0]
        kept, rest = ContactMemory.from_flat(memory[1:], self.slips)
        poses, rates, own = np.split(rest, np.cumsum([common.committed.size, common.rates_before.size]))
        common.committed.ravel()[:], common.rates_before.ravel()[:] = poses, rates
        self.load_contacts(kept)
        self.load_own(own)

    def clear_caches(self) -> None:
        """Discard the results of the broad phase; it is renewed at the next poses."""
        self.common.state[row.REFERRED], self.common.state[row.FOUND] = 0, -1
        self.common.state[row.LACKS] = self.common.state[row.MEASURED] = 0


