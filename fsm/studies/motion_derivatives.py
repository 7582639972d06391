"""Derivatives of the motion of a mechanism with respect to numbers of the case, by the variational equations.

The state of rigid bodies with ideal joints has n independent changes of the configuration and n of the velocity. Their
derivatives z (2n, p) with respect to p numbers satisfy the linear equation

    z' = A(t) z + B(t)

along the motion. A and B are differences of consistent accelerations at the same state: of the system itself with 4n varied
states (central differences), and of p systems compiled with one number increased. They cost 4n + p accelerations at a time;
a run with other numbers costs 12 for each of its steps. Other numbers move joints, so B includes the motion of the dependent
bodies that closes the joints again.

The interval between two switches of a law is divided into panels. In each, z is the polynomial that satisfies the equation
at the Lobatto points, of order 2m - 2 with m points at the end of a panel. The last coefficient of z' is the error, which
sets the length of the next panel. The states at these points are those of the motion itself, integrated once more.

At a switch, where a stop or latch begins or ceases to push, the acceleration jumps from a to b. The time of the switch has
the derivative -dg/g' with the switching function g, and the velocity changes by (a - b) dt (Hiskens and Pai 2000).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import qr
from scipy.optimize import brentq

from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.channels import sample  # noqa: F401  # loads all channels
from fsm.channels.offer import Model, State, offers_of
from fsm.errors import CaseError, Fault
from fsm.kernels.pointers import enter
from fsm.model.compile.compile_case import compile_planned, compile_whole
from fsm.model.compile.compile_contacts import Compiled
from fsm.model.compile.compile_joint_forces import laws_of_joints
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.stepping.outcomes import STEPPED
from fsm.solve.stepping.responses import respond_arrays
from fsm.solve.time.explicit import Explicit
from fsm.studies.motion_switches import NOTHING, JointSwitches
from fsm.studies.problem import LATCH_TIME

STEP_OF_MOTION = 1e-7
"""Relative step of a number, in one-sided differences."""
_STATE_STEP = 3e-6
"""Step of a changed state in central differences, m, rad, m/s and rad/s."""
_POINTS = 6
"""Lobatto points of a panel."""
_ERROR = 1e-4
"""Bound of the error of a panel, relative to the derivatives."""
_SMALL = 1e-2
"""Effect of a number, relative to the largest effect, below which the error of its derivatives is relative to the latter."""
_FINER = 0.1
"""Tolerance of the repeated motion, relative to that of the run."""
_MOST = 100
"""Largest number of panels."""
_POOR = 0.3
"""Smallest part of the first quality with which independent coordinates are kept."""
_TURNS = 0.1
"""Weight of displacements against turns in the choice of coordinates; turns depend on each other more simply."""
_PAST = 4e-9
"""Distance before and after a switch, in its switching function, rad or m; latches close within 1e-9."""
_AXES = ("x", "y", "z")
_OTHER = "no motion of rigid bodies with ideal joints in the explicit method"


def _lobatto(m: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lobatto points on [0, 1], weights (m, m) of the integrals from 0 to each point, and (m,) of the last coefficient."""
    inner = legendre.legroots(legendre.legder([0.0] * (m - 1) + [1.0]))
    x = np.concatenate([[-1.0], inner, [1.0]])
    coefficients = np.linalg.inv(legendre.legvander(x, m - 1))
    integrals = np.array([legendre.legval(x, legendre.legint(row, lbnd=-1.0)) for row in coefficients.T]).T
    return 0.5 * (x + 1.0), 0.5 * integrals, coefficients[-1]


_AT, _INTEGRALS, _LAST = _lobatto(_POINTS)


class Varied(NamedTuple):
    """System with one number increased by `step` (SI), its solver, and the case and scene of the system.

    A number on which only laws of joints depend needs no other system; `laws` are those of the joints.
    """

    system: SegmentSystem
    solver: Explicit
    step: float
    case: Case
    scene: Scene
    laws: np.ndarray | None


@dataclass(frozen=True)
class MotionState:
    """State of a motion and its derivatives.

    Attributes
    ----------
    t, q, u : time (s), configuration, velocity
    memory : internal variables of the system
    by_q, by_u : (nu, p) arrays
        Increments of the configuration and changes of the velocity per SI unit of each number.
    """

    t: float
    q: np.ndarray
    u: np.ndarray
    memory: np.ndarray
    by_q: np.ndarray
    by_u: np.ndarray


class _Poor(Exception):
    """The independent coordinates are nearly dependent."""


class _Panel(NamedTuple):
    """Relative error of a panel, and the state at its end."""

    error: float
    state: MotionState


class _Switch(NamedTuple):
    """Times just before and after a switch, and the latches before it."""

    before: float
    after: float
    latched: np.ndarray


class _Node(NamedTuple):
    """Linear equations at a time: d(full state)/d(z) and the part of the numbers, and A and B.

    Attributes
    ----------
    of_q, of_u : (nu, 2n) arrays
    q, u : (nu, p) arrays
    matrix, right : A (2n, 2n) and B (2n, p)
    """

    of_q: np.ndarray
    of_u: np.ndarray
    q: np.ndarray
    u: np.ndarray
    matrix: np.ndarray
    right: np.ndarray


class MotionDerivatives:
    """Derivatives of the motion of a case, from its start to later and later times.

    Parameters
    ----------
    case : Case
    cases : cases with one number increased
    steps : increases (SI)

    Attributes
    ----------
    state : MotionState
        State at the last time.
    switches : list of (time, derivative (p,), what)
        Switches so far: times (s) at which a latch closes, or a stop or latch begins or ceases to push.
    evaluations : number of accelerations
    one_sided : warnings of derivatives that hold to one side only

    Raises
    ------
    CaseError
        The case has no such derivatives.
    """

    def __init__(self, case: Case, cases: Sequence[Case], steps: Sequence[float]) -> None:
        self.case, warnings = case, list[str]()
        self.scene, self.system, plan = compile_planned(case, "", warnings)
        rtol = case.solve.rtol
        self._refuse(plan, bool(warnings))
        start = self.system.initial()
        self.solver = Explicit(self.system, 0.0, *start, _FINER * rtol, case.solve.max_step or math.inf)
        if not self.solver.marches:
            raise CaseError(Fault("solve.method", _OTHER))
        self.varied = list[Varied]()
        for other, step in zip(cases, steps, strict=True):
            scene, system, solver = build_scene(other), self.system, self.solver
            laws = laws_of_joints(scene, Compiled(self.scene, self.system))
            if laws is None:
                system = compile_whole(other, scene, None)
                solver = Explicit(system, 0.0, *system.initial(), rtol)
            self.varied.append(Varied(system, solver, step, other, scene, laws))
        self.evaluations, self.switches = 0, list[tuple[float, np.ndarray, str]]()
        systems = [self.system, *(one.system for one in self.varied)]
        self._joints = JointSwitches(systems, [None, *(one.laws for one in self.varied)])
        self._breaks = self.system.break_times()
        self._regime = np.zeros(0, dtype=bool), np.zeros(0)
        self._quality = 1.0
        self._known: tuple[float, _Node] | None = None
        self._length, self._chosen = 0.0, np.zeros(0, dtype=np.int64)
        self.one_sided = self._joints.one_sided(0.0, self.solver.q, self.solver.u)
        self.state = self._start()

    def _refuse(self, plan: Any, warned: bool) -> None:
        """Refuse systems whose memory or laws have no derivatives."""
        system = self.system
        if type(system) is not SegmentSystem or plan is not None or self.case.event or not system.locking:
            raise CaseError(Fault("solve.method", _OTHER))
        if system.contacts or system.motions:
            raise CaseError(Fault("contact", "a motion with contact or drives has no exact derivatives"))

    def _start(self) -> MotionState:
        """State at the start with its derivatives."""
        q, u = self.solver.q, self.solver.u
        self.system.restore(np.zeros(0))
        self.system.consistent(0.0, q, u, np.zeros(len(u)))
        self.system.commit(0.0, q, u)
        by_q, by_u = np.zeros((len(u), len(self.varied))), np.zeros((len(u), len(self.varied)))
        for k, one in enumerate(self.varied):
            if one.laws is not None:
                continue
            other, speed = one.system.initial()
            by_q[:, k] = self.system.difference(q, other) / one.step
            by_u[:, k] = (speed - u) / one.step
        return MotionState(0.0, q.copy(), u.copy(), self.system.memory(), by_q, by_u)

    # nodes ------------------------------------------------------------------------------------------------------------

    def _respond(self, solver: Explicit, t: float, q: np.ndarray, u: np.ndarray, ways: np.ndarray) -> np.ndarray:
        """See `fsm.solve.stepping.responses`."""
        model, out = solver._arrays, np.zeros((len(ways), 3 * len(u)))
        assert model is not None
        self.evaluations += len(ways)
        if enter(model.calls.force, respond_arrays, model, float(t), q, u, ways, out) != STEPPED:
            raise CaseError(Fault("solve.method", "the mass is singular"))
        return out

    def _choose(self, t: float, q: np.ndarray, u: np.ndarray) -> None:
        """Choose independent coordinates at a state."""
        n = len(u)
        ways = np.zeros((n + 1, 2 * n))
        ways[1:, :n] = _STATE_STEP * np.eye(n)
        out = self._respond(self.solver, t, q, u, ways)[:, :n]
        tangent = (out[1:] - out[0]).T / _STATE_STEP
        left, sizes, _ = np.linalg.svd(tangent)
        basis = left[:, : int(np.sum(sizes > 1e-4 * sizes[0]))]
        if n % 6 == 0:
            weighted = basis.reshape(-1, 6, basis.shape[1]) * np.repeat([_TURNS, 1.0], 3)[:, None]
        else:
            weighted = basis
        order = qr(weighted.reshape(basis.shape).T, mode="r", pivoting=True)[1]
        self._chosen = np.sort(order[: basis.shape[1]])
        self._quality = _quality(basis, self._chosen)

    def _node(self, t: float, q: np.ndarray, u: np.ndarray, poor: float = _POOR) -> _Node:
        """Linear equations at a state."""
        n = len(u)
        self._joints.hold(*self._regime)
        if not len(self._chosen):
            self._choose(t, q, u)
        chosen = self._chosen
        m = len(chosen)
        ways = np.zeros((1 + 4 * m, 2 * n))
        ways[np.arange(1, m + 1), chosen] = ways[np.arange(m + 1, 2 * m + 1), n + chosen] = _STATE_STEP
        ways[2 * m + 1 :] = -ways[1 : 2 * m + 1]
        out = self._respond(self.solver, t, q, u, ways)
        by = (out[1 : 2 * m + 1] - out[2 * m + 1 :]).T / (2.0 * _STATE_STEP)  # (3 nu, 2 m)
        given = np.zeros((3 * n, len(self.varied)))
        for k, one in enumerate(self.varied):
            if self._joints.differs(k + 1):
                self._joints.use(k + 1)
                given[:, k] = (self._respond(one.solver, t, q, u, ways[:1])[0] - out[0]) / one.step
        self._joints.release()
        pick = np.concatenate([chosen, n + chosen])
        inner = by[pick]
        if _quality(np.linalg.qr(by[:n, :m])[0], chosen) < poor * self._quality:
            raise _Poor
        inverse = np.linalg.inv(inner)
        of_z = by @ inverse  # full changes by z
        free = given - of_z @ given[pick]  # full changes by the numbers at z = 0
        # the increments turn with the bodies: theta' = omega' - omega x theta
        def turned(values: np.ndarray) -> np.ndarray:
            cross = np.zeros(values[:n].shape)
            spin, angles = u.reshape(-1, 6)[:, 3:, None], values[:n].reshape(-1, 6, values.shape[1])[:, 3:]
            product = spin[:, [1, 2, 0]] * angles[:, [2, 0, 1]] - spin[:, [2, 0, 1]] * angles[:, [1, 2, 0]]
            cross.reshape(-1, 6, values.shape[1])[:, 3:] = product
            return np.concatenate([(values[n : 2 * n] - cross)[chosen], values[2 * n :][chosen]])

        return _Node(of_z[:n], of_z[n : 2 * n], free[:n], free[n : 2 * n], turned(of_z), turned(free))

    # panels -----------------------------------------------------------------------------------------------------------

    def advance(self, until: float) -> MotionState:
        """State at a later time, with derivatives.

        Raises
        ------
        CaseError
            The derivatives need too many panels.
        """
        for _ in range(_MOST):
            if not self.state.t < until:
                return self.state
            self._panel(min([until, *(b for b in self._breaks if b > self.state.t)]))
        text = f"derivatives of the motion need more than {_MOST} panels, as with rattling latches"
        raise CaseError(Fault("solve.method", text))

    def _panel(self, end: float) -> None:
        """Advance by one panel, and past the switch at its end if there is one."""
        begin, resume = self.state, self.solver.state()
        left = end - begin.t
        length, switch = self._length or 1e-3 * left, None
        length = left if length > 0.99 * left else min(length, 0.5 * left)
        while length > 0.0:
            found = self._collocate(begin, length)
            if isinstance(found, _Switch):
                switch, length = found, found.before - begin.t
            elif found.error > _ERROR:
                length *= max(0.2, 0.7 * (_ERROR / found.error) ** (1.0 / _POINTS))
                switch = None
            else:
                break
            self._back(begin, resume)
        else:
            self._known = None
        if length > 0.0:
            assert isinstance(found, _Panel)
            self.state = found.state
            longer = 0.7 * (_ERROR / max(found.error, 1e-5 * _ERROR)) ** (1.0 / _POINTS)
            self._length = max(min(longer, 5.0) * length, 0.0 if switch is None and length < left else self._length)
        if switch is not None:
            self._pass(switch)

    def _back(self, state: MotionState, resume: Any) -> None:
        self.solver.back_to(state.t, state.q, state.u, resume)
        self.system.restore(state.memory)

    def _restore(self, memory: np.ndarray) -> None:
        """Restore the internal variables of the other systems."""
        for one in self.varied:
            if one.laws is None:
                one.system.restore(memory)

    def _collocate(self, begin: MotionState, length: float) -> _Panel | _Switch:
        """Derivatives at the end of a panel, or the first switch in it."""
        latched, solver = self._joints.latched(), self.solver
        pushes = self._joints.values(0, begin.t, begin.q, begin.u, latched) > NOTHING
        self._regime = pushes, latched
        self._restore(begin.memory)
        nodes, before = [self._first_node(begin)], (begin, solver.state())
        for part in _AT[1:].tolist():
            t = begin.t + part * length
            self._march(t)
            now = self._joints.values(0, t, solver.q, solver.u, latched)
            changed = np.flatnonzero((now > NOTHING) != pushes)
            if len(changed):
                return self._locate(*before, t, changed, np.where(pushes[changed], -1.0, 1.0), latched)
            try:
                nodes.append(self._node(t, solver.q, solver.u))
            except _Poor:
                return _Panel(math.inf, begin)
            before = replace(begin, t=t, q=solver.q.copy(), u=solver.u.copy(), memory=self.system.memory()), solver.state()
        self._known = t, nodes[-1]
        m, first = len(self._chosen), nodes[0]
        start = np.concatenate([begin.by_q[self._chosen], begin.by_u[self._chosen]])
        matrices, rights = np.array([node.matrix for node in nodes]), np.array([node.right for node in nodes])
        weights, inner = length * _INTEGRALS[1:], _POINTS - 1
        system = np.eye(2 * m * inner).reshape(inner, 2 * m, inner, 2 * m)
        system = system - np.einsum("ij,jab->iajb", weights[:, 1:], matrices[1:])
        right = start + np.einsum("ij,jak->iak", weights[:, 1:], rights[1:])
        right = right + weights[:, 0, None, None] * (first.matrix @ start + first.right)
        z = np.linalg.solve(system.reshape(2 * m * inner, -1), right.reshape(2 * m * inner, -1))
        z = np.concatenate([start[None], z.reshape(inner, 2 * m, -1)])
        rates = matrices @ z + rights
        size = np.abs(z).max(axis=(0, 1)) + length * np.abs(rates).max(axis=(0, 1))
        last = length * np.abs(np.einsum("j,jak->ak", _LAST, rates)).max(axis=0)
        weight = np.array([one.step for one in self.varied])
        size = np.maximum(size, _SMALL * (size * weight).max(initial=0.0) / weight)
        error = float((last / np.where(size > 0.0, size, 1.0)).max(initial=0.0))
        node = nodes[-1]
        state = replace(before[0], by_q=node.of_q @ z[-1] + node.q, by_u=node.of_u @ z[-1] + node.u)
        return _Panel(error, state)

    def _first_node(self, begin: MotionState) -> _Node:
        """Equations at the start of a panel; other independent coordinates if the present ones are poor."""
        if self._known is not None and self._known[0] == begin.t:
            return self._known[1]
        try:
            return self._node(begin.t, begin.q, begin.u)
        except _Poor:
            self._chosen = self._chosen[:0]
            return self._node(begin.t, begin.q, begin.u)

    def _march(self, until: float) -> None:
        """Integrate the motion up to a time."""
        solver = self.solver
        energy = EnergyBalance()
        balance = np.array([*energy.numbers(), 0.0, math.inf, math.inf, 0.0, 0.0])
        while solver.t < until:
            solver.march(balance, until, 10_000)

    # switches ---------------------------------------------------------------------------------------------------------

    def _locate(
        self, before: MotionState, resume: Any, after: float, changed: np.ndarray, ways: np.ndarray, latched: np.ndarray
    ) -> _Switch:
        """First switch between a state and a time."""

        def nearest(t: float) -> float:
            self._back(before, resume)
            self._march(t)
            return float((ways * self._joints.values(0, t, self.solver.q, self.solver.u, latched)[changed]).max())

        low = float((ways * self._joints.values(0, before.t, before.q, before.u, latched)[changed]).max())
        if low >= 0.0:
            return _Switch(before.t, before.t, latched)
        t = float(brentq(nearest, before.t, after, xtol=1e-15 * max(after, 1.0), rtol=8.9e-16))
        slope = -low / (t - before.t)
        for _ in range(2):  # pace of the switching function just before the switch
            gone = min(_PAST / slope, 0.5 * (t - before.t))
            slope = max(-nearest(t - gone), 1e-3 * _PAST) / gone
        return _Switch(t - gone, min(t + gone, 0.5 * (t + after)) if after > t else t + gone, latched)

    def _rate(
        self, t: float, q: np.ndarray, u: np.ndarray, values: np.ndarray, latched: np.ndarray, still: np.ndarray
    ) -> np.ndarray:
        """Acceleration at a state with given values of the switching functions."""
        self._joints.hold(values > NOTHING, latched)
        rate = self._respond(self.solver, t, q, u, still)[0, 2 * len(u) :]
        self._joints.release()
        return rate

    def _pass(self, switch: _Switch) -> None:
        """Pass a switch with the jump of the derivatives there."""
        state, latched, still = self.state, switch.latched, np.zeros((1, 2 * len(self.state.u)))
        before = self._joints.values(0, state.t, state.q, state.u, latched)
        self._regime = before > NOTHING, latched
        node, m = self._first_node(state), len(self._chosen)
        self._march(max(switch.after, math.nextafter(state.t, math.inf)))
        q, u, t, now = self.solver.q.copy(), self.solver.u.copy(), self.solver.t, self._joints.latched()
        after, acting = self._joints.values(0, t, q, u, latched), self._joints.values(0, t, q, u, now)
        changed = np.flatnonzero((before > NOTHING) != (after > NOTHING))
        closes = (changed % 3 == 2) & (latched[changed // 3] == 0.0)
        z, middle = np.concatenate([state.by_q[self._chosen], state.by_u[self._chosen]]), 0.5 * (state.t + t)
        for row in changed[closes].tolist():
            self.switches.append((*self._delay(row, state, (t, after), before, latched), "latch closes"))
        part = before.copy()
        rate = self._rate(t, q, u, part, latched, still)
        for row in changed[~closes].tolist():  # one after the other: their times may have other derivatives
            middle, delay = self._delay(row, state, (t, after), before, latched)
            part[row] = after[row]
            pushed = self._rate(t, q, u, part, latched, still)
            z[m:] += np.outer(rate - pushed, delay)[self._chosen]
            rate = pushed
            self.switches.append((middle, delay, "stop"))
        z += (middle - state.t) * (node.matrix @ z + node.right)
        memory = self.system.memory()
        self._restore(memory)
        self._regime = acting > NOTHING, now
        node = self._node(t, q, u, 0.0)
        z += (t - middle) * (node.matrix @ z + node.right)
        self._known = t, node
        self.state = MotionState(t, q, u, memory, node.of_q @ z + node.q, node.of_u @ z + node.u)

    def _delay(
        self, row: int, state: MotionState, end: tuple[float, np.ndarray], before: np.ndarray, latched: np.ndarray
    ) -> tuple[float, np.ndarray]:
        """Time of a switch after a state, s, and its derivatives (p,); see `JointSwitches.delay`."""
        varied = [
            (self.system.retract(state.q, one.step * state.by_q[:, k]), state.u + one.step * state.by_u[:, k], one.step)
            for k, one in enumerate(self.varied)
        ]
        return self._joints.delay(row, varied, (state.t, before), end, latched)

    # responses --------------------------------------------------------------------------------------------------------

    def response(self, of: Callable[[Case, Scene, Any, SavedState], float]) -> tuple[float, np.ndarray]:
        """A function of case, scene, system and state at the present state, and its derivatives (p,)."""
        state = self.state

        def value(case: Case, scene: Scene, system: SegmentSystem, q: np.ndarray, u: np.ndarray) -> float:
            system.restore(state.memory)
            q, u = q.copy(), u.copy()
            system.consistent(state.t, q, u, np.zeros(len(u)))
            system.commit(state.t, q, u)
            observed = system.observe(state.t, q, u)
            return of(case, scene, system, SavedState(state.t, q, u, observed, 0.0, 0.0, 0.0, np.zeros((2, 0))))

        self._joints.release_all()
        own = value(self.case, self.scene, self.system, state.q, state.u)
        slopes = np.zeros(len(self.varied))
        for k, one in enumerate(self.varied):
            self._joints.use(k + 1)
            there = self.system.retract(state.q, one.step * state.by_q[:, k])
            other = value(one.case, one.scene, one.system, there, state.u + one.step * state.by_u[:, k])
            slopes[k] = (other - own) / one.step
        self._joints.release()
        self.system.restore(state.memory)
        return own, slopes


def motion_response(of: str, summary: Mapping[str, Any]) -> tuple[float, str, int] | None:
    """Time (s) of a response of a motion, its channel, and its component; None without derivatives.

    The latch time has no channel. Reactions of joints have a round-off of 1e-9 of their size, too much for differences.
    """
    times = [event["time"] for event in summary.get("joint_events", ()) if event.get("what") == "latch closes"]
    if of == LATCH_TIME:
        return (times[0], "", 0) if times else None
    extreme, _, name = of.partition(" of ")
    entry = summary.get("channels", {}).get(name, {})
    if extreme not in ("max", "min") or f"{extreme}_time" not in entry:
        return None
    label = entry.get(f"{extreme}_at", name)
    channel, _, component = label.rpartition(" ")
    if component not in _AXES:
        channel, component = label, _AXES[0]
    reaction = channel.rpartition(".")[2].startswith(("force", "moment"))
    return None if reaction else (entry[f"{extreme}_time"], channel, _AXES.index(component))


def derivatives_of_motion(
    case: Case, cases: Sequence[Case], steps: Sequence[float], time: float, channel: str, component: int,
    warnings: list[str],
) -> np.ndarray:
    """Derivatives (p,) of a channel at a time (s), or of the time at which the first latch closes; see `motion_response`.
    Warnings are appended.

    Raises
    ------
    CaseError
        The case has no such derivatives.
    """
    motion = MotionDerivatives(case, cases, steps)
    warnings += motion.one_sided
    if not channel:
        motion.advance(time * (1.0 + 1e-6))
        return next(delay for _, delay, what in motion.switches if what == "latch closes")
    motion.advance(time)

    def at(case: Case, scene: Scene, system: SegmentSystem, saved: SavedState) -> float:
        offered = offers_of(Model(case, system, scene))
        if channel not in offered:
            raise CaseError(Fault("response", f"no channel {channel} with one number or three axes"))
        found = np.atleast_1d(np.asarray(offered[channel].at(State(system, saved)), dtype=float)).ravel()
        return float(found[component])

    return motion.response(at)[1]


def _quality(basis: np.ndarray, chosen: np.ndarray) -> float:
    """Smallest singular value of the chosen rows of an orthonormal basis."""
    return float(np.linalg.svd(basis[chosen], compute_uv=False).min(initial=1.0))
