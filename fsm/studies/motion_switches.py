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


class JointSwitches:
    """Laws of the joints of a system, and of systems with one number increased.

    Parameters
    ----------
    systems : the system, and the others

    Raises
    ------
    CaseError
        A law has no derivatives.
    """

    def __init__(self, systems: Sequence[SegmentSystem]) -> None:
        self.systems = list(systems)
        self._groups = [_joint_forces(system) for system in systems]
        if self._groups[0] is not None:
            _refuse(self._groups[0])
        self._laws = [None if group is None else group.laws.copy() for group in self._groups]
        self._held: tuple[np.ndarray, np.ndarray] | None = None
        self._held_laws = np.zeros((0, 0))

    def hold(self, pushes: np.ndarray, latched: np.ndarray) -> None:
        """Let stops and latches of all systems push or not, whatever their coordinates; else a step of a difference would
        pass a switch nearby.

        A law that pushes, k (c - l) + d c', becomes a part of spring and damper.
        """
        own, laws = self._groups[0], self._held_laws
        if own is None:
            return
        if self._held is None or not all(map(np.array_equal, self._held, (pushes, latched))):
            self._held = pushes.copy(), latched.copy()
            for group, given in zip(self._groups, self._laws, strict=True):
                if group is not None and given is not None:
                    group.laws[:] = _held_laws(given, pushes.reshape(-1, 3), latched)
            self._held_laws = own.laws.copy()
        else:
            own.laws[:] = laws

    def release(self) -> None:
        """Restore the laws of the system itself."""
        if self._groups[0] is not None:
            self._groups[0].laws[:] = self._laws[0]

    def release_all(self) -> None:
        """Restore the laws of all systems."""
        self._held = None
        for group, laws in zip(self._groups, self._laws, strict=True):
            if group is not None:
                group.laws[:] = laws

    def latched(self) -> np.ndarray:
        """State of the latches at the last accepted step, (m,)."""
        group = self._groups[0]
        m = 0 if group is None else len(group.start)
        return np.zeros(0) if group is None else group.memory_of[law.LATCHED * m : (law.LATCHED + 1) * m].copy()

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
    held[:, [law.STOP, law.STOP_DAMPER, law.LATCH, law.LATCH_DAMPER]] = 0.0
    return held


def _limits(laws: np.ndarray) -> np.ndarray:
    """Coordinates (m, 3) beyond which lower stop, upper stop and closed latch push."""
    return np.column_stack(
        [laws[:, [law.LOWER, law.UPPER]], laws[:, law.LATCH_AT] - laws[:, law.LATCH_SENSE] * laws[:, law.PLAY]]
    )
