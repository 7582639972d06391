"""Derivatives of equilibria with respect to numbers of the case, by implicit differentiation.

An equilibrium satisfies h(q; p) = 0, and the drives have the reactions r(q; p). With the tangent A = -dh/dx,

    A dx/dp = dh/dp , dr/dp = dr/dp|x + (dr/dx) dx/dp; the forward method needs one solve per parameter
    A^T lambda = (dr/dx)^T, dr/dp = dr/dp|x + lambda . dh/dp; the adjoint method needs one solve per force

Dampers and friction compute rates as differences from the previous state. Then the force h also depends on the
previous state: A dx_k = dh/dp + (dh/dx_{k-1}) dx_{k-1}. The adjoint of this recursion would run backwards in time and is
not available.

dh/dp and dr/dp at a fixed configuration are central differences of two systems compiled with p (1 + d) and p (1 - d).
Stiffness, damping and factors enter h linearly. The differences are exact except for round-off, about 1e-16/d of the
largest effort, with d = 1e-6. Lengths and angles move bodies and rest states; their differences have an additional error of
d^2 times the third derivative. Contact forces are nonlinear over a micrometre, but they are not differences of large
numbers. The differences are computed separately with d = 1e-8. No further equilibrium has to be solved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu

from fsm.builders.scene import build_scene
from fsm.calibrate.parameters import value_at, with_values
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.errors import CaseError, Fault
from fsm.kernels.blocks import BlockMatrix
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.interface.records import PreviousState

_RELATIVE_STEP = 1e-6
"""Relative step of a parameter in the central differences."""
_CONTACT_STEP = 1e-8
"""Relative step of a parameter in the central differences of contact forces."""
_CONTACT_PARTS = ("bodies", "surfaces", "obstacles", "pairs", "contact", "friction")
"""Parts of the scene that contacts depend on."""
_OTHER_PARTS = ("bodies", "elements", "loads", "drives", "gravity")
"""Parts of the scene that other forces depend on."""
_EQUILIBRIUM = 1e-4
"""Largest ratio of the residual of an equilibrium to the largest drive force; a state with a larger ratio is in motion."""
_ROUND_OFF = 1e-13
"""Round-off of forces, relative to stiffness times size."""


@dataclass(frozen=True)
class SystemPair:
    """Two systems, compiled with the parameter increased and decreased by `step` (SI)."""

    more: SegmentSystem
    less: SegmentSystem
    step: float


@dataclass(frozen=True)
class VariedParameter:
    """Systems for the central differences of one parameter.

    Attributes
    ----------
    path : str
    others, contacts : SystemPair or None
        Systems for all forces except contact forces, and for contact forces. None if neither the parameter nor the previous
        state changes these forces.
    """

    path: str
    others: SystemPair | None
    contacts: SystemPair | None


def vary_parameters(case: Case, scene: Scene, system: SegmentSystem, paths: Sequence[str]) -> list[VariedParameter]:
    """Compile the case with every parameter slightly larger and slightly smaller.

    Parameters
    ----------
    case : Case
    scene, system : scene and system of the case
    paths : dotted paths of numbers

    Raises
    ------
    CaseError
        A path has no number, or its number changes the degrees of freedom of the system.
    """
    return [_vary(case, scene, system, path) for path in paths]


def _vary(case: Case, scene: Scene, system: SegmentSystem, path: str) -> VariedParameter:
    value = value_at(case, path)
    size = abs(value) or 1.0

    def changed(step: float) -> Scene:
        return build_scene(with_values(case, {path: value + step}))

    def pair(step: float, more: Scene, less: Scene) -> SystemPair:
        systems = [compile_scene(one, case.solve.spatial) for one in (more, less)]
        if any(one.nq != system.nq for one in systems):
            raise CaseError(Fault(path, "changes the number of degrees of freedom; it cannot be varied continuously"))
        return SystemPair(systems[0], systems[1], step)

    step = _RELATIVE_STEP * size
    more = changed(step)
    others = contacts = None
    if system.rate_dependent or not _same(scene, more, _OTHER_PARTS):
        less = changed(-step)
        others = pair(step, *(one.model_copy(update={"contact": None, "friction": None}) for one in (more, less)))
    rates = any(group.rate_dependent for group in system.contacts)
    if system.contacts and (rates or not _same(scene, more, _CONTACT_PARTS)):
        contact_step = _CONTACT_STEP * size
        both = changed(contact_step), changed(-contact_step)
        contacts = pair(contact_step, *(one.model_copy(update={"elements": (), "loads": ()}) for one in both))
    return VariedParameter(path, others, contacts)


def _same(one: Scene, other: Scene, parts: tuple[str, ...]) -> bool:
    return all(getattr(one, name) == getattr(other, name) for name in parts)


class PathSensitivity:
    """Derivatives of configurations and drive forces along an equilibrium path, state by state.

    Parameters
    ----------
    system : SegmentSystem
    varied : one VariedParameter per parameter

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

    def __init__(self, system: SegmentSystem, varied: Sequence[VariedParameter]) -> None:
        self.system, self.varied = system, list(varied)
        self._last: tuple[PreviousState, np.ndarray | None] | None = None
        self._largest_force = 0.0
        self._scales = system.scales()
        self.start_error = np.zeros(system.nu)
        self.derivative = np.zeros((system.nu, len(self.varied)))

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
        before = u = last_derivative = None
        if system.rate_dependent and last is not None:
            before, last_derivative = last
            u = system.difference(before[1], q) / (t - before[0])
        matrix, damping = self._matrix(t, q, u, before)
        if not self._in_equilibrium(t, q, u, before, matrix):
            self._last = ((t, q.copy()), None)
            return None
        by_parameter, explicit = self._partial_derivatives(t, q, u, before, last_derivative)
        tangent = splu(matrix.bsr().tocsc())
        self.derivative = derivative = tangent.solve(by_parameter)
        if damping is not None and last_derivative is not None:
            self.start_error = tangent.solve(damping.times(self.start_error))
        else:
            self.start_error = np.abs(derivative).max(axis=1)
        self._last = ((t, q.copy()), derivative)
        return np.asarray(explicit + system.drive_tangent(t, q, u, before) @ derivative) if needed else None

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
        by_parameter, explicit = self._partial_derivatives(t, q, None, None, None)
        tangent = splu(self._matrix(t, q, None, None)[0].bsr().tocsc())
        multipliers = tangent.solve(np.ascontiguousarray(system.drive_tangent(t, q, None).T), trans="T")
        return np.asarray(explicit + multipliers.T @ by_parameter)

    def _in_equilibrium(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None, matrix: BlockMatrix
    ) -> bool:
        """Whether the residual is small compared with the largest drive force so far, or is round-off."""
        force, reaction = self.system.balance(t, q, u, before)
        self._largest_force = max(self._largest_force, float(np.abs(reaction).max(initial=0.0)))
        divisors = self._scales.force_scale
        round_off = _ROUND_OFF * float((self._scales.span_forces(matrix) / divisors).max(initial=0.0))
        residual = float(np.abs(force / divisors).max(initial=0.0))
        return residual <= max(_EQUILIBRIUM * self._largest_force, round_off)

    def _partial_derivatives(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None, last_derivative: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """dh/dp (nu, p) and dr/dp (n_drives, p) at a fixed configuration; the last state changes by `last_derivative`."""
        system, memory = self.system, self.system.memory()
        by_parameter = np.zeros((system.nu, len(self.varied)))
        drive_force = np.zeros((len(system.motions), len(self.varied)))
        for k, one in enumerate(self.varied):
            for pair, contacts in ((one.others, False), (one.contacts, True)):
                if pair is None:
                    continue
                for varied, step in ((pair.more, pair.step), (pair.less, -pair.step)):
                    if contacts and len(memory):
                        varied.restore(memory)
                    previous, rate = before, u
                    if before is not None and last_derivative is not None:
                        previous = (before[0], system.retract(before[1], step * last_derivative[:, k]))
                        rate = system.difference(previous[1], q) / (t - before[0])
                    force, reaction = varied.balance(t, q, rate, previous, contacts)
                    by_parameter[:, k] += force / (2.0 * step)
                    drive_force[:, k] += reaction / (2.0 * step)
        return by_parameter, drive_force

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
