"""Derivatives of equilibria with respect to numbers of the case, by implicit differentiation.

An equilibrium satisfies h(q; p) = 0, and the drives have the reactions r(q; p). With the tangent A = -dh/dx,

    A dx/dp = dh/dp , dr/dp = dr/dp|x + (dr/dx) dx/dp; the forward method needs one solve per parameter
    A^T lambda = (dr/dx)^T, dr/dp = dr/dp|x + lambda . dh/dp; the adjoint method needs one solve per force

Dampers and friction compute rates as differences from the previous state. Then the force h also depends on the
previous state: A dx_k = dh/dp + (dh/dx_{k-1}) dx_{k-1}. The adjoint of this recursion would run backwards in time and is
not available.

dh/dp and dr/dp at a fixed configuration are differences of systems compiled with other p. Stiffness, damping and factors
move nothing and enter h linearly, or nearly so: (h(p (1 + d)) - h(p))/(p d) with d = 1e-7 has an error of d/2 times the
second derivative and a round-off of 1e-16/d of the largest effort, both about 1e-7, for one compilation. Lengths and
angles move bodies and rest states; there one-sided differences are wrong by 0.1 %, because stiff springs stretch. Their
differences are central, p (1 + d) and p (1 - d) with d = 1e-6, with an error of d^2 times the third derivative. Contact
forces are nonlinear over a micrometre, but they are not differences of large numbers. They have d = 1e-8 where plates
change, and are central too where bodies move or contacts depend on rates. A number that does not change a kind of forces
needs no compilation for it. No further equilibrium has to be solved. The rates of one-sided differences are those of the
constant previous state; the effect of its change is a central difference too.

The forces of flexible facets, films, cables and beams are differences of large numbers for every parameter: with d = 1e-6
the round-off is 1e-3 of the result. Their differences have the steps d and 2d with d = 5e-4, (4 D(d) - D(2d))/3, with an
error of d^4 times the fifth derivative and a round-off of 1e-6. The whole system is compiled four times for each parameter,
and dr/dx dx/dp is a difference of the same kind along dx/dp.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu

from fsm.builders.scene import build_scene
from fsm.calibrate.parameters import value_at, with_values
from fsm.case.derived.planar import out_of_plane
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.errors import CaseError, Fault
from fsm.kernels.blocks import BlockMatrix
from fsm.model.compile.compile import SceneCompiler
from fsm.model.compile.compile_case import compile_whole
from fsm.model.system.system import SegmentSystem
from fsm.solve.interface.records import PreviousState

_STEP = 1e-7
"""Relative step of a parameter that moves nothing, in one-sided differences."""
_MOVING_STEP = 1e-6
"""Relative step of a parameter that moves bodies or points, in central differences."""
_FLEXIBLE_STEP = 5e-4
"""Smaller relative step of a parameter, and step of a motion relative to the span, with flexible parts."""
_TWO_STEPS = (1.0, 4.0 / 3.0), (2.0, -1.0 / 3.0)
"""Two steps of differences in units of the smaller one, and the weights of the differences."""
_CONTACT_STEP = 1e-8
"""Relative step of a parameter in the differences of contact forces whose sides change."""
_CONTACT_PARTS = ("surfaces", "groups", "obstacles", "pairs", "contact", "friction")
"""Parts of the scene that contacts alone depend on."""
_OTHER_PARTS = tuple(name for name in Scene.model_fields if name not in _CONTACT_PARTS)
"""Parts of the scene that other forces depend on."""
_FACTORS = ("bodies", "elements", "loads", "gravity")
"""Parts whose numbers move nothing, except the places below."""
_SIDES = ("surfaces", "groups", "obstacles", "pairs", "drives")
"""Parts of the scene that move the sides of contacts."""
_PLACES = ("position", "orientation", "held")
"""Places of bodies."""
_POINTS = ("point_inner", "point_outer", "axes_inner", "axes_outer")
"""Places of elements."""
_OTHER_SIZE = "changes the number of degrees of freedom; it cannot be varied continuously"
_EQUILIBRIUM = 1e-4
"""Largest ratio of the residual of an equilibrium to the largest drive force; a state with a larger ratio is in motion."""
_ROUND_OFF = 1e-13
"""Round-off of forces, relative to stiffness times size."""


@dataclass(frozen=True)
class SystemPair:
    """Two systems, compiled with the parameter increased by `up` and decreased by `down` (SI).

    If `down` is 0, the previous state is kept constant; else it changes with the parameter too. The difference counts with a
    `weight`.
    """

    more: SegmentSystem
    less: SegmentSystem
    up: float
    down: float
    weight: float = 1.0


@dataclass(frozen=True)
class VariedParameter:
    """Systems for the differences of one parameter.

    Attributes
    ----------
    path : str
    others, contacts : tuple of SystemPair
        Systems for all forces except contact forces, and for contact forces, whose differences add up. Empty if neither the
        parameter nor the previous state changes these forces.
    whole : tuple of SystemPair
        Systems for all forces together.
    """

    path: str
    others: tuple[SystemPair, ...] = ()
    contacts: tuple[SystemPair, ...] = ()
    whole: tuple[SystemPair, ...] = ()

    def pairs(self) -> Iterator[tuple[SystemPair, bool | None]]:
        """Pairs of systems, and whether contacts alone count (None: all forces)."""
        yield from ((pair, False) for pair in self.others)
        yield from ((pair, True) for pair in self.contacts)
        yield from ((pair, None) for pair in self.whole)


def vary_parameters(case: Case, scene: Scene, system: SegmentSystem, paths: Sequence[str]) -> list[VariedParameter]:
    """Compile the case with every parameter slightly changed.

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

    @cache
    def changed(step: float) -> Scene:
        return build_scene(with_values(case, {path: value + step}))

    if not _is_rigid(system):
        whole = []
        for times, weight in _TWO_STEPS:
            step = times * _FLEXIBLE_STEP * size
            more, less = (compile_whole(case, changed(sign * step), None) for sign in (1.0, -1.0))
            if not more.nq == less.nq == system.nq:
                raise CaseError(Fault(path, _OTHER_SIZE))
            whole.append(SystemPair(more, less, step, step, weight))
        return VariedParameter(path, whole=tuple(whole))

    def compiled(one: Scene, left_out: dict[str, Any]) -> SegmentSystem:
        spatial = case.solve.spatial or bool(out_of_plane(one))
        found = SceneCompiler(one.model_copy(update=left_out), spatial).system()  # `scene` has no faults
        if found.nq != system.nq:
            raise CaseError(Fault(path, _OTHER_SIZE))
        return found

    def pair(left_out: dict[str, Any], step: float) -> tuple[SystemPair, ...]:
        return (SystemPair(compiled(changed(step), left_out), compiled(changed(-step), left_out), step, step),)

    def carried(rates: bool, step: float) -> tuple[SystemPair, ...]:
        """Differences due to the previous state alone."""
        return (SystemPair(system, system, step, step),) if rates else ()

    other = changed(_STEP * size)
    places_are_same = _same_items(scene.bodies, other.bodies, _PLACES)
    alone: dict[str, Any] = {"contact": None, "friction": None}
    rates = system.rate_dependent
    if _same(scene, other, _OTHER_PARTS):
        others = carried(rates, _MOVING_STEP * size)
    elif places_are_same and _only_factors(scene, other):
        others = SystemPair(compiled(other, alone), system, _STEP * size, 0.0), *carried(rates, _MOVING_STEP * size)
    else:
        others = pair(alone, _MOVING_STEP * size)
    contacts: tuple[SystemPair, ...] = ()
    if system.contacts:
        rates = any(group.rate_dependent for group in system.contacts)
        step, only_contacts = _CONTACT_STEP * size, {"elements": (), "loads": ()}
        still = places_are_same and _same(scene, other, _SIDES)
        same_plates = _same_items(scene.bodies, other.bodies, ("plate",))
        if still and same_plates and _same(scene, other, _CONTACT_PARTS):
            contacts = carried(rates, step)
        elif still and same_plates and not rates:
            contacts = (SystemPair(compiled(other, only_contacts), system, _STEP * size, 0.0),)
        elif still and not rates:
            contacts = (SystemPair(compiled(changed(step), only_contacts), system, step, 0.0),)
        else:
            contacts = pair(only_contacts, step)
    return VariedParameter(path, others, contacts)


def _is_rigid(system: SegmentSystem) -> bool:
    """Whether a system consists of rigid bodies and their springs alone."""
    return type(system) is SegmentSystem


def _balance(
    system: SegmentSystem,
    t: float,
    q: np.ndarray,
    u: np.ndarray | None,
    before: PreviousState | None,
    contacts: bool | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Force and reactions; systems of nodes alone have no contacts."""
    return system.balance(t, q, u, before) if contacts is None else system.balance(t, q, u, before, contacts)


def _same(one: Scene, other: Scene, parts: Sequence[str]) -> bool:
    return all(getattr(one, name) == getattr(other, name) for name in parts)


def _same_items(some: Sequence[Any], others: Sequence[Any], names: Sequence[str]) -> bool:
    """Whether items of two scenes are equal in some of their fields."""
    return len(some) == len(others) and all(
        getattr(one, name) == getattr(other, name) for one, other in zip(some, others, strict=True) for name in names
    )


def _only_factors(one: Scene, other: Scene) -> bool:
    """Whether scenes with bodies at the same places differ in stiffness, damping, mass and loads alone."""
    same_points = _same_items(one.elements, other.elements, _POINTS)
    return same_points and _same(one, other, [name for name in _OTHER_PARTS if name not in _FACTORS])


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
        return np.asarray(explicit + self._by_motion(t, q, u, before, derivative)) if needed else None

    def _by_motion(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: PreviousState | None, derivative: np.ndarray
    ) -> np.ndarray:
        """(dr/dx) dx/dp (n_drives, p) with a constant previous state."""
        system, memory = self.system, self.system.memory()
        if _is_rigid(system):
            return np.asarray(system.drive_tangent(t, q, u, before) @ derivative)

        def reaction(way: np.ndarray) -> np.ndarray:
            there = system.retract(q, way)
            rate = u if before is None or u is None else system.difference(before[1], there) / (t - before[0])
            if len(memory):
                system.restore(memory)
            return system.balance(t, there, rate, before)[1]

        columns = []
        for way in derivative.T:
            smallest = _FLEXIBLE_STEP / (float(np.abs(way / self._scales.span).max(initial=0.0)) or 1.0)
            steps = [(times * smallest, weight) for times, weight in _TWO_STEPS]
            columns.append(sum(w * (reaction(h * way) - reaction(-h * way)) / (2.0 * h) for h, w in steps))
        return np.array(columns).T

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
        drive_force = np.zeros((len(system.balance(t, q, u, before)[1]), len(self.varied)))
        unvaried: dict[bool | None, tuple[np.ndarray, np.ndarray]] = {}

        def efforts(varied: SegmentSystem, step: float, k: int, contacts: bool | None) -> tuple[np.ndarray, np.ndarray]:
            """Force and reaction after a change of the parameter; the previous state of parameter `k` changes by `step`."""
            if varied is system and step == 0.0:
                if contacts not in unvaried:
                    unvaried[contacts] = _balance(varied, t, q, u, before, contacts)
                return unvaried[contacts]
            if contacts is not False and len(memory):
                varied.restore(memory)
            varied.copy_locks(system)
            previous, rate = before, u
            if step and before is not None and last_derivative is not None:
                previous = (before[0], system.retract(before[1], step * last_derivative[:, k]))
                rate = system.difference(previous[1], q) / (t - before[0])
            return _balance(varied, t, q, rate, previous, contacts)

        for k, one in enumerate(self.varied):
            for pair, contacts in one.pairs():
                carried = pair.up if pair.down else 0.0
                more, less = efforts(pair.more, carried, k, contacts), efforts(pair.less, -pair.down, k, contacts)
                by_parameter[:, k] += pair.weight * (more[0] - less[0]) / (pair.up + pair.down)
                drive_force[:, k] += pair.weight * (more[1] - less[1]) / (pair.up + pair.down)
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
