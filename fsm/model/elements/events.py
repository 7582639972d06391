"""Actions of `[[event]]` on a compiled model: parts are released, locked or changed. The group has no forces.

An action changes the arrays of other groups in place. The memory of the group is, for each event, its number in the order in
which events happened (0: not yet), its time (s), and the poses of all bodies at that time, at which joints are locked. The
changes follow from the memory alone, so that a run can be restored at any state.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fsm.model.elements.cords import CordGroup
from fsm.model.elements.couplings import FIRST_PARAMETER, CouplingGroup
from fsm.model.elements.element_group import OWN, ElementGroup, ElementKernels, nothing
from fsm.model.elements.joint_forces import JointForceGroup
from fsm.model.elements.joint_laws import DAMPER, FRICTION, LATCHED, OF_DAMPER, OF_SPRING, SPRING, TABLES
from fsm.model.elements.joints import JointGroup
from fsm.model.elements.locked_couplings import LockedCouplings
from fsm.model.elements.locked_inertia import set_inertia

_KERNELS = ElementKernels(nothing, nothing, nothing)
_ORDER, _TIME, _POSES = range(3)
_COLUMNS = {"damper": DAMPER, "spring": SPRING, "friction": FRICTION}
_TABLES = {"damper": OF_DAMPER, "spring": OF_SPRING}


@dataclass(frozen=True)
class EventGroup(ElementGroup):
    """Events of a model.

    Attributes
    ----------
    bodies : (0, 2) int array
    inverse : (n_bodies, 3 or 6) array
        Inverse of the inertia; zero for bodies that cannot move.
    actions : (verb, what, name, value) of all actions of each event, see `fsm.case.derived.event_words.Action`
    groups : groups of elements that they change
    """

    bodies: np.ndarray
    inverse: np.ndarray
    actions: tuple[tuple[Any, ...], ...]
    groups: tuple[ElementGroup, ...]
    categories = ()
    kernels = _KERNELS
    rate_dependent = False

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        return [self.first_memory]

    @property
    def memory_of(self) -> np.ndarray:
        """See `ElementGroup`."""
        return self.arrays[0]

    @property
    def first_memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        return np.zeros(len(self.actions) * (_POSES + len(self.inverse) * self._width))

    @property
    def _width(self) -> int:
        """Numbers of a pose."""
        return 7 if self.inverse.shape[1] == 6 else 3

    @property
    def _rows(self) -> np.ndarray:
        """Memory with a row for each event."""
        return self.memory_of.reshape(len(self.actions), -1)

    @property
    def happened(self) -> np.ndarray:
        """Whether each event has happened, (m,)."""
        return np.asarray(self._rows[:, _ORDER] > 0.0)

    def times(self) -> list[tuple[int, float]]:
        """Numbers and times (s) of the events that happened, in their order."""
        rows = self._rows
        order = [k for k in np.argsort(rows[:, _ORDER], kind="stable").tolist() if rows[k, _ORDER] > 0.0]
        return [(k, float(rows[k, _TIME])) for k in order]

    def happen(self, number: int, t: float, poses: np.ndarray) -> None:
        """Do the actions of an event."""
        row = self._rows[number]
        row[_ORDER], row[_TIME] = np.count_nonzero(self.happened) + 1, t
        row[_POSES:] = poses.ravel()
        for action in self.actions[number]:
            if action.what == "latch":
                for laws in self._of(JointForceGroup):
                    laws.memory_of[LATCHED * len(laws.start) + laws.row_of(f"joint.{action.name}")] = -1.0
        self._changed()
        for group in self.groups:
            if isinstance(group, JointGroup | LockedCouplings):
                group.let_go()

    def restore(self, memory: np.ndarray) -> None:
        """See `ElementGroup`; the parts become those after all events so far."""
        super().restore(memory)
        self._changed()

    def _of(self, kind: type[Any]) -> Iterator[Any]:
        return (group for group in self.groups if isinstance(group, kind))

    @cached_property
    def _first(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Arrays that actions change, with their values before all events."""
        found = [array for joints in self._of(JointGroup) for array in (joints.active, joints.constants, joints.masses)]
        found += [array for laws in self._of(JointForceGroup) for array in (laws.laws, laws.rows)]
        found += [cords.laws for cords in self._of(CordGroup)]
        for couplings in self._of(CouplingGroup):
            locked = isinstance(couplings, LockedCouplings)
            found += [couplings.active, couplings.masses] if locked else [couplings.arrays[FIRST_PARAMETER - OWN]]
        return [(array, array.copy()) for array in found]

    def _changed(self) -> None:
        """Change the parts as the events so far demand."""
        for array, first in self._first:
            array[:] = first
        poses = None
        for number, _ in self.times():
            poses = self._rows[number, _POSES:].reshape(-1, self._width)
            for action in self.actions[number]:
                self._act(action, poses)
        if poses is not None:
            for joints in self._of(JointGroup):
                set_inertia(joints, list(self._of(LockedCouplings)), poses, self.inverse)

    def _act(self, action: Any, poses: np.ndarray) -> None:
        for group in self.groups:
            if isinstance(group, JointGroup) and action.what == "joint":
                _switch_joint(group, action.verb, action.name, poses)
            elif isinstance(group, JointForceGroup):
                _change_law(group, action)
            elif isinstance(group, CordGroup) and action.what == "cord" and action.name in group.names:
                group.laws[group.names.index(action.name)] = 0.0
            elif isinstance(group, CouplingGroup) and action.what == "coupling" and action.name in group.names:
                i = group.names.index(action.name)
                if isinstance(group, LockedCouplings):
                    group.active[i] = 0.0
                else:
                    group.arrays[FIRST_PARAMETER - OWN][i, 1:3] = 0.0


def _switch_joint(group: JointGroup, verb: str, name: str, poses: np.ndarray) -> None:
    """Release, lock or unlock a joint."""
    own = group.of == group.names.index(name)
    locks = own & (np.arange(len(own)) >= len(own) - group.spare)
    if verb == "release":
        group.active[own] = 0.0
        return
    group.active[locks] = float(verb == "lock")
    group.active[own & (group.program >= 0)] = float(verb != "lock")
    if verb == "lock":
        group.lock_at(np.flatnonzero(locks), poses)


def _change_law(group: JointForceGroup, action: Any) -> None:
    """Release or change what acts on a coordinate."""
    kind = "spring" if action.verb == "release" and action.what == "spring" else "joint"
    name = f"{kind}.{action.name}"
    if name not in group.names or action.verb not in ("release", "change") or action.what == "latch":
        return
    i = group.row_of(name)
    if action.verb == "release":
        group.make_idle(i)
        return
    group.laws[i, _COLUMNS[action.what]] = action.value
    if action.what in _TABLES:
        begin, end = group.first[TABLES * i + _TABLES[action.what] :][:2]
        group.rows[begin:end, 1:] = 0.0
