"""Derivatives of equilibria with respect to numbers of the case, by differentiating the equilibrium itself.

At an equilibrium h(q; p) = 0, and its drives feel the force r(q; p). With the tangent A = -dh/dx, which the last Newton
step has had,

    A dx/dp = dh/dp ,        dr/dp = dr/dp|x + (dr/dx) dx/dp                 forward: one solve a parameter
    A^T lambda = (dr/dx)^T,  dr/dp = dr/dp|x + lambda . dh/dp                adjoint: one solve a force

Where dampers or friction take rates as differences from the last state, h depends on that state too, and its derivative is
carried along: A dx_k = dh/dp + (dh/dx_{k-1}) dx_{k-1}; the adjoint of that would have to run backwards and is not
offered.

dh/dp and dr/dp at a fixed configuration are the difference of two systems compiled with p (1 + d) and p (1 - d), over
2 d p. Stiffness, damping and factors enter h linearly, where this is exact but for rounding, about 1e-16/d of the largest
effort; d = 1e-6. A length or an angle moves bodies and rest states by d of itself, and the error is d^2 times the third
derivative besides. Contacts bend within a micrometre and have no large efforts that cancel: theirs is taken apart,
with d = 1e-8. No equilibrium is solved twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu

from fsm.blocks import BlockMatrix
from fsm.calibrate.parameters import value_at, with_values
from fsm.errors import CaseError, Fault
from fsm.scene.builders.scene import build_scene
from fsm.scene.case import Case
from fsm.scene.scene import Scene
from fsm.segments.compile import compile_scene
from fsm.segments.system import SegmentSystem
from fsm.system import Before

__all__ = ["PathSensitivity", "Varied", "vary"]

_PART = 1e-6
"""Part of itself that a parameter is varied by."""
_TOUCHING = 1e-8
"""The same, for what contacts have of it."""
_OF_CONTACTS = ("bodies", "surfaces", "obstacles", "pairs", "contact", "friction")
"""What contacts are compiled from."""
_BUT_CONTACTS = ("bodies", "elements", "loads", "drives", "gravity")
"""What all else is compiled from."""
_LEFT_OVER = 1e-4
"""Force left over, over the largest pull, above which a state is no equilibrium but in motion."""
_ROUND_OFF = 1e-13
"""Forces are known to this part of stiffness times size."""


@dataclass(frozen=True)
class Pair:
    """Systems of the case with so much (SI) more and less of a parameter."""

    more: SegmentSystem
    less: SegmentSystem
    step: float


@dataclass(frozen=True)
class Varied:
    """One parameter.

    Attributes
    ----------
    path : str
    others, contacts : Pair or None
        For all but contacts, and for contacts; None where neither the parameter nor the past changes them.
    """

    path: str
    others: Pair | None
    contacts: Pair | None


def vary(case: Case, scene: Scene, system: SegmentSystem, paths: Sequence[str]) -> list[Varied]:
    """Compile the case with every parameter a little larger and a little smaller.

    Parameters
    ----------
    case : Case
    scene, system : what it describes and was compiled to
    paths : dotted paths of numbers

    Raises
    ------
    CaseError
        A path without a number, or one that changes what the system is made of.
    """
    return [_varied(case, scene, system, path) for path in paths]


def _varied(case: Case, scene: Scene, system: SegmentSystem, path: str) -> Varied:
    value = value_at(case, path)
    size = abs(value) or 1.0

    def changed(step: float) -> Scene:
        return build_scene(with_values(case, {path: value + step}))

    def pair(step: float, more: Scene, less: Scene) -> Pair:
        systems = [compile_scene(one, case.solve.spatial) for one in (more, less)]
        if any(one.nq != system.nq for one in systems):
            raise CaseError(Fault(path, "changes what the structure is made of; it cannot be varied continuously"))
        return Pair(systems[0], systems[1], step)

    step = _PART * size
    more = changed(step)
    others = contacts = None
    if system.rate_dependent or not _same(scene, more, _BUT_CONTACTS):
        less = changed(-step)
        others = pair(step, *(one.model_copy(update={"contact": None, "friction": None}) for one in (more, less)))
    rates = any(group.rate_dependent for group in system.contacts)
    if system.contacts and (rates or not _same(scene, more, _OF_CONTACTS)):
        touching = _TOUCHING * size
        both = changed(touching), changed(-touching)
        contacts = pair(touching, *(one.model_copy(update={"elements": (), "loads": ()}) for one in both))
    return Varied(path, others, contacts)


def _same(one: Scene, other: Scene, parts: tuple[str, ...]) -> bool:
    return all(getattr(one, name) == getattr(other, name) for name in parts)


class PathSensitivity:
    """Derivatives of configurations and drive forces along a quasi-static path, state by state.

    Parameters
    ----------
    system : SegmentSystem
    varied : of every parameter

    Notes
    -----
    `advance` is called with every state in turn. A state in motion, at a snap, has no derivatives; of the next equilibrium
    the last state is taken as one that no parameter moves.

    Attributes
    ----------
    doubt : (nu,) array
        What is left of the derivatives of the first state, which know of none before it, in those of the last one.
    change : (nu, p) array
        d(configuration)/d(parameter) of the last one.
    """

    def __init__(self, system: SegmentSystem, varied: Sequence[Varied]) -> None:
        self.system, self.varied = system, list(varied)
        self._last: tuple[Before, np.ndarray | None] | None = None
        self._largest = 0.0
        scales = system.scales()
        self._to_force = scales.increment / scales.length
        self._span = float(scales.span.max(initial=0.0))
        self.doubt = np.zeros(system.nu)
        self.change = np.zeros((system.nu, len(self.varied)))

    def advance(self, t: float, q: np.ndarray, wanted: bool = True) -> np.ndarray | None:
        """Take the next state.

        Parameters
        ----------
        t, q : time (s) and configuration
        wanted : bool
            False: nobody asks for derivatives here, so they are worked out only if the next state needs them.

        Returns
        -------
        (n_drives, p) array or None
            d(force)/d(parameter); None where the state is in motion, or nobody asked.
        """
        system, last = self.system, self._last
        if not system.rate_dependent and not wanted:
            return None
        before = u = past = None
        if system.rate_dependent and last is not None:
            before, past = last
            u = system.difference(before[1], q) / (t - before[0])
        matrix, damping = self._matrix(t, q, u, before)
        if not self._in_balance(t, q, u, before, matrix):
            self._last = ((t, q.copy()), None)
            return None
        by_parameter, direct = self._direct(t, q, u, before, past)
        tangent = splu(matrix.bsr().tocsc())
        self.change = change = tangent.solve(by_parameter)
        known = damping is not None and past is not None
        self.doubt = tangent.solve(damping.times(self.doubt)) if known and damping else np.abs(change).max(axis=1)
        self._last = ((t, q.copy()), change)
        return np.asarray(direct + system.drive_tangent(t, q, u, before) @ change) if wanted else None

    def adjoint(self, t: float, q: np.ndarray) -> np.ndarray:
        """d(force)/d(parameter) (n_drives, p) of one equilibrium, by one solve a drive.

        Raises
        ------
        CaseError
            Dampers or friction carry the past along.
        """
        system = self.system
        if system.rate_dependent:
            text = "dampers and friction carry the past along, which an adjoint of one state does not know; take them out"
            raise CaseError(Fault("adjoint", text))
        by_parameter, direct = self._direct(t, q, None, None, None)
        tangent = splu(self._matrix(t, q, None, None)[0].bsr().tocsc())
        multipliers = tangent.solve(np.ascontiguousarray(system.drive_tangent(t, q, None).T), trans="T")
        return np.asarray(direct + multipliers.T @ by_parameter)

    def _in_balance(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: Before | None, matrix: BlockMatrix
    ) -> bool:
        """Whether the forces left over are nothing against the largest pull so far, or round-off."""
        force, pull = self.system.balance(t, q, u, before)
        self._largest = max(self._largest, float(np.abs(pull).max(initial=0.0)))
        round_off = _ROUND_OFF * self._span * float(np.abs(matrix.data).max(initial=0.0))
        left_over = float(np.abs(force / self._to_force).max(initial=0.0))
        return left_over <= max(_LEFT_OVER * self._largest, round_off)

    def _direct(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: Before | None, past: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """dh/dp (nu, p) and dr/dp (n_drives, p) at a fixed configuration, the last one moving by `past` dp."""
        system, memory = self.system, self.system.memory()
        by_parameter = np.zeros((system.nu, len(self.varied)))
        pull = np.zeros((len(system.motions), len(self.varied)))
        for k, one in enumerate(self.varied):
            for pair, contacts in ((one.others, False), (one.contacts, True)):
                if pair is None:
                    continue
                for varied, step in ((pair.more, pair.step), (pair.less, -pair.step)):
                    if contacts and len(memory):
                        varied.restore(memory)
                    then, speed = before, u
                    if before is not None and past is not None:
                        then = (before[0], system.retract(before[1], step * past[:, k]))
                        speed = system.difference(then[1], q) / (t - before[0])
                    force, reaction = varied.balance(t, q, speed, then, contacts)
                    by_parameter[:, k] += force / (2.0 * step)
                    pull[:, k] += reaction / (2.0 * step)
        return by_parameter, pull

    def _matrix(
        self, t: float, q: np.ndarray, u: np.ndarray | None, before: Before | None
    ) -> tuple[BlockMatrix, BlockMatrix | None]:
        """A = K + D/dt, and its second part."""
        system = self.system
        linear = system.linearise(t, q, u, before)
        if before is None:
            return linear.stiffness, None
        pattern, damping = linear.damping.pattern, linear.damping.data / (t - before[0])
        return BlockMatrix(pattern, linear.stiffness.data + damping), BlockMatrix(pattern, damping)
