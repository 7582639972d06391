"""Switches of the laws of joints in a motion: stops and latches that begin or cease to push, and latches that close.

The switching functions of a joint are its coordinate beyond the lower stop, the upper stop and the latch; a law pushes while
its function is positive. Between two switches the laws are held: they push or not whatever the coordinate, so that they are
smooth.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.errors import CaseError, Fault
from fsm.model.elements import joint_laws as law
from fsm.model.elements.joint_forces import JointForceGroup
from fsm.model.system.system import SegmentSystem

NOTHING = 1e-12
"""Least value of a switching function with which a stop or latch pushes, rad or m."""

_SAME_PLACE = 1e-9
"""Distance of a stop from a start or a latch that are at this stop, relative to its coordinate or 1 rad or m."""


class JointSwitches:
    """Laws of the joints of a system, and of systems with one number increased.

    Parameters
    ----------
    systems : the system, and the others
    laws : laws of each system, if it is the system itself with other laws of the joints; else None

    Raises
    ------
    CaseError
        A law has no derivatives.
    """

    def __init__(self, systems: Sequence[SegmentSystem], laws: Sequence[np.ndarray | None]) -> None:
        self.systems = list(systems)
        self._groups = [_joint_forces(system) for system in systems]
        if self._groups[0] is not None:
            _refuse(self._groups[0])
        self._laws = [
            None if group is None else group.laws.copy() if own is None else own
            for group, own in zip(self._groups, laws, strict=True)
        ]
        self._alone = [own is not None for own in laws]
        self._held: tuple[np.ndarray, np.ndarray] | None = None
        self._held_laws = self._laws

    def hold(self, pushes: np.ndarray, latched: np.ndarray) -> None:
        """Let stops and latches of all systems push or not, whatever their coordinates; else a step of a difference would
        pass a switch nearby.

        A law that pushes, k (c - l) + d c', becomes a part of spring and damper. `use` gives a system its laws.
        """
        if self._held is None or not all(map(np.array_equal, self._held, (pushes, latched))):
            self._held, sides = (pushes.copy(), latched.copy()), pushes.reshape(-1, 3)
            self._held_laws = [None if given is None else _held_laws(given, sides, latched) for given in self._laws]
        self.use(0)

    def differs(self, which: int) -> bool:
        """Whether system number `which` differs from the system itself while laws are held."""
        own, laws = self._held_laws[0], self._held_laws[which]
        return not self._alone[which] or own is None or laws is None or not np.array_equal(laws, own)

    def use(self, which: int) -> None:
        """Give system number `which` its laws, held or not."""
        group = self._groups[which]
        if group is not None:
            group.laws[:] = self._held_laws[which]

    def release(self) -> None:
        """Restore the laws of the system itself."""
        if self._groups[0] is not None:
            self._groups[0].laws[:] = self._laws[0]

    def release_all(self) -> None:
        """Hold no laws any more."""
        self._held, self._held_laws = None, self._laws
        self.release()

    def latched(self) -> np.ndarray:
        """State of the latches at the last accepted step, (m,)."""
        group = self._groups[0]
        m = 0 if group is None else len(group.start)
        return np.zeros(0) if group is None else np.sign(group.memory_of[law.LATCHED * m : (law.LATCHED + 1) * m])

    def values(self, which: int, t: float, q: np.ndarray, u: np.ndarray, latched: np.ndarray) -> np.ndarray:
        """Switching functions of system number `which`, (m, 3) as one array, rad or m.

        They are the coordinates beyond lower stop, upper stop and latch, positive while these push. Before a latch closes,
        its value is the coordinate beyond the place where it does.
        """
        group = self._groups[which]
        if group is None:
            return np.zeros(0)
        found, laws = group.states(t, *self.systems[which].place(t, q, u)), self._laws[which]
        assert laws is not None
        c, rate, values = found[:, 0], found[:, 1], np.full((len(laws), 3), -1.0)
        sense, limits = laws[:, law.LATCH_SENSE], _limits(laws)
        stops, latches = laws[:, [law.STOP, law.STOP_DAMPER]].T, laws[:, [law.LATCH, law.LATCH_DAMPER]].T
        sides = (0, -1.0, *stops, stops[0] > 0.0), (1, 1.0, *stops, stops[0] > 0.0), (2, -sense, *latches, latched > 0.0)
        for side, way, stiffness, damping, acts in sides:
            beyond = way * (c - np.where(acts, limits[:, side], 0.0))
            pushed = beyond + damping / np.where(stiffness > 0.0, stiffness, 1.0) * way * rate
            values[acts, side] = np.minimum(beyond, pushed)[acts]
        opens = (laws[:, law.LATCH] > 0.0) & (latched == 0.0)
        values[opens, 2] = (sense * (c - laws[:, law.LATCH_AT]))[opens]
        return values.ravel()

    def one_sided(self, t: float, q: np.ndarray, u: np.ndarray) -> list[str]:
        """Warnings of joints whose start (t, q, u) or latch is at a stop, if a number moves stops or latches: a shift to the
        other side of the stop changes the motion in another way.
        """
        group, laws, places = self._groups[0], self._laws[0], [law.LOWER, law.UPPER, law.LATCH_AT]
        if group is None or laws is None:
            return []
        if all(other is None or np.array_equal(other[:, places], laws[:, places]) for other in self._laws):
            return []
        start, stops = group.states(t, *self.systems[0].place(t, q, u))[:, :1], laws[:, [law.STOP]] > 0.0
        limits = _limits(laws)[:, :2]
        near = _SAME_PLACE * np.maximum(np.abs(limits), 1.0)
        begins = (stops & (np.abs(start - limits) <= near)).any(axis=1)
        closes = (laws[:, law.LATCH] > 0.0) & (stops & (np.abs(laws[:, [law.LATCH_AT]] - limits) <= near)).any(axis=1)
        found = []
        for which, what in ((begins, "start"), (closes, "latch")):
            names = [name.removeprefix("joint.") for name, own in zip(group.names, which.tolist(), strict=True) if own]
            if names:
                text = "derivatives with respect to the places of stops and latches hold to one side only"
                found.append(f"the {what} of {', '.join(names)} is at a stop; {text}")
        return found

    def delay(
        self, row: int, varied: Sequence[tuple[np.ndarray, np.ndarray, float]], begin: tuple[float, np.ndarray],
        end: tuple[float, np.ndarray], latched: np.ndarray,
    ) -> tuple[float, np.ndarray]:
        """Time of a switch between two states, s, and its derivatives (p,).

        Parameters
        ----------
        row : number of the switching function
        varied : configuration and velocity of each other system at the first time, and the increase (SI) of its number
        begin, end : times (s) and switching functions of the system itself in both states
        latched : state of the latches before the switch
        """
        (t, before), (after_t, after) = begin, end
        pace = (after[row] - before[row]) / (after_t - t)
        values = [self.values(k + 1, t, q, u, latched)[row] for k, (q, u, _) in enumerate(varied)]
        steps = np.array([step for _, _, step in varied])
        return float(t - before[row] / pace), -(np.array(values) - before[row]) / steps / pace


def _joint_forces(system: SegmentSystem) -> JointForceGroup | None:
    return next((group for group in system.groups if isinstance(group, JointForceGroup)), None)


def _refuse(group: JointForceGroup) -> None:
    """Refuse laws without derivatives."""
    if np.any(group.programs[:, law.FREE] >= 0):
        raise CaseError(Fault("scene.joints", "moving free lengths of springs have no exact derivatives"))
    columns = [law.FRICTION, law.FOLLOWS, law.PRESLIDING, law.SLIDER, law.SPRING_SLIDER, law.SIDE, law.BAND]
    if np.any(group.laws[:, columns]) or np.any(group.laws[:, law.REBOUND]):
        text = "friction, hysteresis, rebound and one-sided springs of joints have no exact derivatives"
        raise CaseError(Fault("scene.joints", text))


def _held_laws(laws: np.ndarray, pushes: np.ndarray, latched: np.ndarray) -> np.ndarray:
    """Laws whose stops and latches push or not, (m, 3)."""
    held, limits = laws.copy(), _limits(laws)
    for side, stiffness, damping in (
        (0, law.STOP, law.STOP_DAMPER), (1, law.STOP, law.STOP_DAMPER), (2, law.LATCH, law.LATCH_DAMPER)
    ):
        on = pushes[:, side] & ((side < 2) | (latched > 0.0))
        held[on, law.LOAD] -= laws[on, stiffness] * (limits[on, side] - laws[on, law.REST])
        held[on, law.SPRING] += laws[on, stiffness]
        held[on, law.DAMPER] += laws[on, damping]
    held[:, [law.STOP, law.STOP_DAMPER, law.LATCH, law.LATCH_DAMPER, law.LATCH_AT, law.PLAY]] = 0.0
    held[:, [law.LOWER, law.UPPER]] = -np.inf, np.inf
    return held


def _limits(laws: np.ndarray) -> np.ndarray:
    """Coordinates (m, 3) beyond which lower stop, upper stop and closed latch push."""
    return np.column_stack(
        [laws[:, [law.LOWER, law.UPPER]], laws[:, law.LATCH_AT] - laws[:, law.LATCH_SENSE] * laws[:, law.PLAY]]
    )
