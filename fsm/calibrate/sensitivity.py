"""Derivatives of equilibria with respect to numbers of the case.

An equilibrium satisfies h(q; p) = 0, and the drives have the reactions r(q; p). A system compiled with p + d has an
equilibrium at q + d z next to it, with the reactions r + d r'. With the tangent A = -dh/dq of the system itself, Newton's
method finds z, starting from that of the state before:

    A dz = (h(q + d z; p + d) - h(q; p))/d ,  r' = (r(q + d z; p + d) - r(q; p))/d + (dr/dq) dz

One factorisation serves all parameters. With d -> 0 this is implicit differentiation, A z = dh/dp. Differences at a fixed q
would be wrong: a change of lengths by 1e-6 stretches stiff springs more than the forces of the state do. Both systems have
the same residual, so that of the equilibrium does not matter. The relative step d, 1e-6 or 2e-6, has an error of d/2 times
the second derivative of the path. The round-off of stiff springs, 1e-16/d of stiffness times size, is a pair of opposite
forces at almost the same place, so little of it is left in dz and (dr/dq) dz. Where the sides of contacts move, the second
derivative is up to 1e3 times larger, and d = 1e-8.

Dampers and friction compute rates as differences from the previous state, whose derivative is known then: it changes with
the parameter too. Times change with the drives, so that states at the same travel are compared, and the ends of the drives.

With contacts of flexible parts, differences are central, p + d and p - d. Systems of nodes alone have no dr/dq, and the
round-off of r counts: their differences are central with d = 5e-4, with an error of d^2 times the third derivative and a
round-off of 1e-6. The tangent is that of the system itself, so the corrections dz decrease by a constant factor. They are
repeated until the remaining error of z and of the reactions is below 1e-8, or 1e-6 in states before those asked for, or
until a correction is more than half the last one, which is round-off: numbers that hardly change a state reach it soon.

The adjoint method solves A^T lambda = (dr/dq)^T once for each force, r' = dr/dp + lambda . dh/dp with central differences
at a fixed q. Dampers and friction have none: it would run backwards in time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu

from fsm.builders.scene import rebuilt
from fsm.calibrate.study import value_at, with_values
from fsm.case.derived.planar import out_of_plane
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.errors import CaseError, Fault
from fsm.kernels.blocks import BlockMatrix
from fsm.model.compile.compile import SceneCompiler
from fsm.model.compile.compile_case import compile_whole
from fsm.model.compile.compile_contacts import Compiled, same_sides
from fsm.model.system.system import SegmentSystem
from fsm.solve.interface.records import PreviousState

_STEP = 1e-6
"""Relative step of a parameter."""
_FREE_STEP = 2e-6
"""The same without contacts: errors of 1e-5 by the round-off of stiff joints at 1e-6, by the second derivative at 5e-6."""
_CONTACT_STEP = 1e-8
"""The same for a parameter that moves the sides of contacts of rigid bodies."""
_GEOMETRY = {"strip", "sheet", "lattice"}
"""Sections most of whose numbers move the sides of contacts."""
_NODES_STEP = 5e-4
"""The same for systems of nodes alone, in central differences."""
_MOST = 6
"""Largest number of corrections of a neighbouring equilibrium."""
_NEAR = 1e-8
"""Error of a neighbouring equilibrium, relative to its distance."""
_FAR = 1e-6
"""The same in a state before those whose derivatives are needed."""
_SAME = 1e-8
"""The same without dr/dq."""
_SMALL = 1e-3
"""Effect of a number on the reactions, relative to the largest effect, below which its error is relative to the latter."""
_FIRST_RATE = 1e-3
"""Least ratio of two successive corrections, until it has been measured at a state."""
_STALLED = 0.5
"""Ratio of two successive corrections above which both are round-off."""
_OTHER_SIZE = "changes the number of degrees of freedom; it cannot be varied continuously"
_NO_RATES = "a small change adds dampers, and the run has none; give a value above 0 for exact derivatives"
_EQUILIBRIUM = 1e-4
"""Largest ratio of the residual of an equilibrium to the largest drive force; a state with a larger ratio is in motion."""
_ROUND_OFF = 1e-13
"""Round-off of forces, relative to stiffness times size."""


@dataclass(frozen=True)
class VariedSystem:
    """System compiled with one parameter changed by a step (SI); `weight` is its part of the derivative."""

    system: SegmentSystem
    step: float
    weight: float = 1.0


@dataclass(frozen=True)
class VariedParameter:
    """Path of a number, and systems with other values of it; none if the number changes nothing."""

    path: str
    systems: tuple[VariedSystem, ...]


def vary_parameters(
    case: Case, scene: Scene, system: SegmentSystem, paths: Sequence[str], central: bool = False
) -> list[VariedParameter]:
    """Compile the case with every parameter slightly changed.

    Parameters
    ----------
    case : Case
    scene, system : scene and system of the case
    paths : dotted paths of numbers
    central : bool
        Whether differences are central for rigid parts too, as the adjoint method needs.

    Raises
    ------
    CaseError
        A path has no number, or its number changes the degrees of freedom of the system.
    """
    return [_vary(case, scene, system, path, central) for path in paths]


def _vary(case: Case, scene: Scene, system: SegmentSystem, path: str, central: bool) -> VariedParameter:
    value, rigid = value_at(case, path), type(system) is SegmentSystem
    size = abs(value) or 1.0
    if not _has_bodies(system):
        step = _NODES_STEP
    else:
        step = _FREE_STEP if not system.contacts else _CONTACT_STEP if central else _STEP
    central = central or not _has_bodies(system) or (not rigid and bool(system.contacts))

    def changed(by: float) -> Scene:
        return rebuilt(with_values(case, {path: value + by * size}), case, scene)

    small = rigid and not central and bool(system.contacts)
    if small and path.partition(".")[0] in _GEOMETRY:  # their numbers move sides of contacts
        step = _CONTACT_STEP
    other = changed(step)
    if other == scene:
        return VariedParameter(path, ())
    if small and same_sides(other, scene) != (step == _STEP):
        step = _STEP + _CONTACT_STEP - step
        other = changed(step)
    found = []
    for signed, one in ((step, other), (-step, changed(-step))) if central else ((step, other),):
        if rigid:  # `scene` has no faults
            spatial = system.spatial or bool(out_of_plane(one))
            varied = SceneCompiler(one, spatial, like=Compiled(scene, system)).system()
        else:
            varied = compile_whole(case, one, None)
        if varied.nq != system.nq:
            raise CaseError(Fault(path, _OTHER_SIZE))
        if varied.rate_dependent != system.rate_dependent:
            raise CaseError(Fault(path, f"is {value:g}; {_NO_RATES}"))
        found.append(VariedSystem(varied, signed * size, 0.5 if central else 1.0))
    return VariedParameter(path, tuple(found))


def _has_bodies(system: SegmentSystem) -> bool:
    """Whether a system has bodies, perhaps with flexible parts, and dr/dq."""
    return isinstance(system, SegmentSystem)


class PathSensitivity:
    """Derivatives of configurations and drive forces along an equilibrium path, state by state.

    Parameters
    ----------
    system : SegmentSystem
    varied : one VariedParameter per parameter
    end : float
        Time (s) of the end of the path, which changes with its drive.

    Attributes
    ----------
    derivative : (nu, p) array
        d(configuration)/d(parameter) of the last state.
    start_error : (nu,) array
        Effect of the first state on `derivative`. The derivatives of the first state ignore the states before it.

    Notes
    -----
    The caller passes every state to `advance` in the order of the path. A state in motion (snap-through) has no derivatives.
    The derivatives of the next equilibrium treat that state as fixed.
    """

    def __init__(self, system: SegmentSystem, varied: Sequence[VariedParameter], end: float = math.inf) -> None:
        self.system, self.end = system, end
        self._varied = [one for parameter in varied for one in parameter.systems]
        self._parts = np.zeros((len(self._varied), len(varied)))
        row = 0
        for k, parameter in enumerate(varied):
            for one in parameter.systems:
                self._parts[row, k], row = one.weight, row + 1
        self._steps = np.array([one.step for one in self._varied])
        self._last: PreviousState | None = None
        self._known = False  # whether the derivatives of the last state are known
        self._largest_force = 0.0
        self._scales = system.scales()
        self.start_error = np.zeros(system.nu)
        self._ways = np.zeros((system.nu, len(self._varied)))
        self._rates = np.full(len(self._varied), _FIRST_RATE)

    @property
    def derivative(self) -> np.ndarray:
        """See the class."""
        return self._ways @ self._parts

    def advance(self, t: float, q: np.ndarray, needed: bool = True) -> np.ndarray | None:
        """Process the next state of the path.

        Parameters
        ----------
        t, q : time (s) and configuration
        needed : bool
            Whether the caller needs the derivatives of this state. If not, they are computed only for the next state.

        Returns
        -------
        (n_drives, p) array or None
            d(force)/d(parameter); None if the state is in motion or its derivatives are not needed.
        """
        system, last = self.system, self._last
        if not system.rate_dependent and not needed:
            return None
        before = u = None
        if system.rate_dependent and last is not None:
            before = last
            u = system.difference(before[1], q) / (t - before[0])
        matrix, damping = self._matrix(t, q, u, before)
        own = system.balance(t, q, u, before)
        self._last = t, q.copy()
        if not self._in_equilibrium(own, matrix):
            self._ways, self._known = np.zeros_like(self._ways), False
            return None
        tangent = splu(matrix.bsr().tocsc())
        by_motion = system.drive_tangent(t, q, u, before) if _has_bodies(system) else None
        forces = self._neighbours(t, q, before, own, tangent, by_motion, needed)
        if damping is not None and self._known:
            self.start_error = tangent.solve(damping.times(self.start_error))
        else:
            self.start_error = np.abs(self.derivative).max(axis=1, initial=0.0)
        self._known = True
        return np.asarray(forces @ self._parts) if needed else None

    def _neighbours(
        self, t: float, q: np.ndarray, before: PreviousState | None, own: tuple[np.ndarray, np.ndarray], tangent: Any,
        by_motion: np.ndarray | None, needed: bool,
    ) -> np.ndarray:
        """Find the equilibria of the varied systems next to a state; gives the changes of the reactions (n_drives, m)."""
        ways, memory = self._ways.copy(), self.system.memory()
        changes, left = np.zeros((len(own[1]), len(self._varied))), np.arange(len(self._varied))
        for k in left.tolist():
            self._restore(k, memory)
        times = [self._time(k, t) for k in left.tolist()]
        pasts = [None if before is None else self._past(k, before) for k in left.tolist()]
        tolerance = _SAME if by_motion is None else _NEAR if needed else _FAR
        last = np.full(len(left), math.inf)
        for turn in range(_MOST):
            residual, earlier = np.zeros((len(own[0]), len(left))), changes[:, left]
            for column, k in enumerate(left.tolist()):
                force, reaction = self._balance(k, times[k], q, pasts[k], ways[:, k])
                residual[:, column] = (force - own[0]) / self._steps[k]
                changes[:, k] = (reaction - own[1]) / self._steps[k]
            more = tangent.solve(residual)
            ways[:, left] += more
            if by_motion is not None:
                changes[:, left] += by_motion @ more
            span = self._scales.span[:, None]
            whole = np.abs(ways[:, left] / span).max(axis=0, initial=0.0)
            correction = _largest(more / span, whole)
            if turn > 0 and needed and by_motion is not None:
                effect = np.abs(self._steps * changes)
                size = np.maximum(effect[:, left], _SMALL * effect.max(axis=1, initial=0.0, keepdims=True))
                moved = self._steps[left] * (changes[:, left] - earlier)
                correction = np.maximum(correction, _largest(moved, size))
            if turn > 0:
                self._rates[left] = np.minimum(correction / last, 1.0)
            elif needed:
                self._rates = np.maximum(self._rates, _FIRST_RATE)
            open_ = self._rates[left] * correction > tolerance
            if turn > 1:
                open_ &= correction < _STALLED * last
            left, last = left[open_], np.maximum(correction[open_], 1e-300)
            if not len(left):
                break
        self._ways = ways
        return changes

    def _restore(self, k: int, memory: np.ndarray) -> None:
        """Give a varied system the memory of the present state."""
        system, other = self.system, self._varied[k].system
        shared = all(one.geometry is own.geometry for one, own in zip(other.contacts, system.contacts, strict=True))
        if len(memory) and not shared:
            other.restore(memory)
        other.copy_locks(system)

    def _past(self, k: int, before: PreviousState) -> PreviousState:
        """Last state of a varied system."""
        return self._time(k, before[0]), self.system.retract(before[1], self._steps[k] * self._ways[:, k])

    def _balance(
        self, k: int, t: float, q: np.ndarray, before: PreviousState | None, way: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Force and reactions of a varied system near a state; time and last state are its own."""
        system, other = self.system, self._varied[k].system
        there = system.retract(q, self._steps[k] * way)
        if before is None:
            return other.balance(t, there, None, None)
        return other.balance(t, there, system.difference(before[1], there) / (t - before[0]), before)

    def _time(self, k: int, t: float) -> float:
        """Time at which a varied system has the same travel as the system at a time."""
        system, other = self.system, self._varied[k].system
        end, other_end = system.end_time(), other.end_time()
        if t <= 0.0 or end is None or other_end is None:
            return t
        if not _has_bodies(system):
            return t * other_end / end
        own, varied = system.motions[0].program, other.motions[0].program
        if own == varied:
            return t
        return other_end if t >= self.end else varied.time_of(own.gone(t)) if own.forward else t

    def adjoint(self, t: float, q: np.ndarray) -> np.ndarray:
        """d(force)/d(parameter) (n_drives, p) of one equilibrium, by one linear solve per drive.

        Raises
        ------
        CaseError
            The system has dampers or friction.
        """
        system = self.system
        if system.rate_dependent:
            text = "not available with dampers or friction, which depend on the previous state; use forward derivatives"
            raise CaseError(Fault("adjoint", text))
        tangent = splu(self._matrix(t, q, None, None)[0].bsr().tocsc())
        multipliers = tangent.solve(np.ascontiguousarray(system.drive_tangent(t, q, None).T), trans="T")
        force, reaction = system.balance(t, q, None)
        changes, memory = np.zeros((len(reaction), len(self._varied))), system.memory()
        for k, step in enumerate(self._steps):
            self._restore(k, memory)
            other = self._balance(k, self._time(k, t), q, None, np.zeros(system.nu))
            changes[:, k] = (other[1] - reaction + multipliers.T @ (other[0] - force)) / step
        return np.asarray(changes @ self._parts)

    def _in_equilibrium(self, own: tuple[np.ndarray, np.ndarray], matrix: BlockMatrix) -> bool:
        """Whether the residual is small compared with the largest drive force so far, or is round-off."""
        force, reaction = own
        self._largest_force = max(self._largest_force, float(np.abs(reaction).max(initial=0.0)))
        divisors = self._scales.force_scale
        round_off = _ROUND_OFF * float((self._scales.span_forces(matrix) / divisors).max(initial=0.0))
        residual = float(np.abs(force / divisors).max(initial=0.0))
        return residual <= max(_EQUILIBRIUM * self._largest_force, round_off)

    def _matrix(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None
    ) -> tuple[BlockMatrix, BlockMatrix | None]:
        """Tangent A = K + D/dt, and D/dt; None for D/dt without a previous state."""
        system = self.system
        linear = system.linearise(t, q, u, before)
        if before is None:
            return linear.stiffness, None
        pattern, damping = linear.damping.pattern, linear.damping.data / (t - before[0])
        return linear.stiffness.with_data(linear.stiffness.data + damping), BlockMatrix(pattern, damping)


def _largest(values: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Largest component of each column (m,) relative to sizes, which broadcast; zero for sizes of zero."""
    ratios = np.abs(values) / np.where(sizes > 0.0, sizes, math.inf)
    return np.asarray(ratios.max(axis=0, initial=0.0))
