"""Creases whose rest angle moves: an additional moment on linear springs, as a function of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fsm.interactions.crease_spatial import force_crease_spatial, linearise_crease_spatial
from fsm.interactions.hinge_spatial import measure_hinge_spatial
from fsm.kernels.programs import Program
from fsm.kernels.scatter import pair_slots
from fsm.laws.crease import CreaseLaws, MomentCurve, join_curves
from fsm.segments.group import Group, PreviousPoses
from fsm.segments.pattern import BodyPattern

__all__ = ["ActuatorGroup"]

_add_force: Callable[..., Any] = force_crease_spatial
_add_linearised: Callable[..., Any] = linearise_crease_spatial
_ANGLE = 10.0
"""Half the range of the table of a constant moment, rad; it continues outside."""


@dataclass(frozen=True)
class ActuatorGroup(Group):
    """Moments k (change of the rest angle) about the axes of linear creases, in space.

    A spring with the moment k (psi - rest) and a rest angle that changes by d(t) has the additional moment k d(t). The
    moment counts as a load: its power is input power, and the energy of the spring refers to the rest angle at the start.

    Attributes
    ----------
    bodies : (m, 2) int array
    axes : axes of both bodies and offset of the angle, as in `fsm.interactions.hinge_spatial.measure_hinge_spatial`
    moment : (m,) array
        Moment at the factor 1, N m.
    time : function of time of all moments
    names : names of the elements
    """

    bodies: np.ndarray
    axes: tuple[np.ndarray, ...]
    moment: np.ndarray
    time: Program
    names: tuple[str, ...]

    @cached_property
    def _unit(self) -> CreaseLaws:
        """Laws for the factor 1: the opening is the negative angle, and the moment is constant."""
        values, which = np.unique(self.moment, return_inverse=True)
        knots = np.array([-_ANGLE, _ANGLE])
        curves = [MomentCurve(knots, np.array([[0.0, 0.0, 0.0, m]] * 2), np.zeros(2)) for m in values]
        table = join_curves(curves)
        count = len(self.moment)
        return CreaseLaws(
            np.zeros(count), np.ones(count), np.zeros(count), np.asarray(which, dtype=np.int64).ravel(), table.bounds,
            table.knots, table.coefficients, table.energies,
        )  # fmt: skip

    def _arguments(self, t: float) -> tuple[Any, ...]:
        """Arguments of the kernels that follow poses and rates, at a time (s); these elements have no dampers."""
        law = self._unit._replace(coefficients=self.time.at(t)[0] * self._unit.coefficients)
        return (self.bodies, *self.axes, law, self._still, 0.0)

    @cached_property
    def _still(self) -> np.ndarray:
        return np.zeros(len(self.moment))

    def moments(self, t: float) -> np.ndarray:
        """Moments along the twists of the elements at a time (s), (m,), N m."""
        return self.time.at(t)[0] * self.moment

    def break_times(self) -> set[float]:
        """Times at which the function of time is not smooth, s."""
        return set(self.time.breaks())

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: PreviousPoses | None = None
    ) -> None:
        """See `Group`."""
        _add_force(poses, rates, *self._arguments(t), force)

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: PreviousPoses | None = None,
    ) -> None:
        """See `Group`."""
        slots = np.asarray(pair_slots(self.bodies, *pattern.index))
        _add_linearised(poses, rates, *self._arguments(t), slots, force, stiffness, damping)

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: PreviousPoses | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`; the moments count as input power."""
        _, rate, _ = measure_hinge_spatial(poses, rates, self.bodies, *self.axes)
        return {}, 0.0, self.time.at(t)[0] * float(self.moment @ rate)

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        return self.bodies, 0
