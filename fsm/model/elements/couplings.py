"""Elements on the angles of several joints: `[[scene.couplings]]`.

A kind of coupling is one kernel with the arguments of all kernels of elements (`fsm.model.elements.element_group`). From
angles (m, n) and rates (m, n) of its n joints it writes the energy U (m,) and the dissipated power (m,) of each element, the
efforts e = dU/dphi + (part of dampers) (m, n), and their derivatives (m, n, n) with respect to angles and rates. Forces and
tangents follow here, in the plane and in space:

    h = -sum e_j g_j,    K = sum g_j (de_j/dphi_k g_k + de_j/dphi'_k dphi'_k/dx) + sum e_j dg_j/dx,    g_j = dphi_j/dx

Angles are rotations from the start.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.hinge_planar import measure_hinge_planar
from fsm.interactions.hinge_spatial import derivatives_hinge_spatial, measure_hinge_spatial
from fsm.kernels.addresses import ROW, address_table, floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import address_of, call_at
from fsm.kernels.scatter import add_block
from fsm.model.bodies.arrays import DAMPING, DOF, FORCE, POSES, RATES, STIFFNESS, STORED, pattern_of
from fsm.model.elements.element_group import LAST, OWN, ElementGroup, ElementKernels, bodies_of

_ENDS, _INNER, _OUTER, _OFFSET, _LAW, ANGLES, SPEEDS, ENERGIES, DISSIPATED, EFFORTS, STIFFNESSES, VISCOSITIES = range(
    OWN, OWN + 12
)
FIRST_PARAMETER = OWN + 12
"""Rows of the table of a group for a kind's kernel: what it reads, what it writes, and from here on its parameters."""


class Coupling(NamedTuple):
    """Kind of elements on the angles of joints.

    Attributes
    ----------
    joints : number of joints of an element
    law : kernel, see `fsm.model.elements.couplings`
    parameters : function from the parameters of all elements to the arrays of the kernel
        One array for each row from `FIRST_PARAMETER` on.
    """

    joints: int
    law: Any
    parameters: Callable[[list[Any]], list[np.ndarray]]


class Joints(NamedTuple):
    """Joints of all elements, (m n) one element after another: ends (m n, 2), axes (m n, 4) in both bodies (empty in the
    plane), and the offset (m n,) that makes each angle zero at the start.
    """

    ends: np.ndarray
    inner: np.ndarray
    outer: np.ndarray
    offset: np.ndarray


@kernel
def _planar(table: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return measure_hinge_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), integers_2d(own, _ENDS), floats_1d(own, _OFFSET)
    )


@kernel
def _spatial(table: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return measure_hinge_spatial(
        floats_2d(table, POSES), floats_2d(table, RATES), integers_2d(own, _ENDS), floats_2d(own, _INNER),
        floats_2d(own, _OUTER), floats_1d(own, _OFFSET),
    )  # fmt: skip


@kernel
def _apply_law(
    table: np.ndarray, own: np.ndarray, t: float, per_second: float, angle: np.ndarray, rate: np.ndarray
) -> None:
    """Write angles and rates, and call the kind's kernel."""
    angles, rates, last = floats_2d(own, ANGLES).reshape(-1), floats_2d(own, SPEEDS).reshape(-1), floats_1d(own, LAST)
    for i in range(angle.shape[0]):
        angles[i] = angle[i]
        rates[i] = rate[i] if per_second == 0.0 else (angle[i] - last[i]) * per_second
    call_at(integers_1d(own, _LAW)[0], table, own, t, per_second)


@kernel
def _add_forces(table: np.ndarray, own: np.ndarray, gradient: np.ndarray) -> None:
    force, ends, efforts = floats_2d(table, FORCE), integers_2d(own, _ENDS), floats_2d(own, EFFORTS).reshape(-1)
    size = force.shape[1]
    for i in range(ends.shape[0]):
        for side in range(2):
            for c in range(size):
                force[ends[i, side], c] -= efforts[i] * gradient[i, 0, side * size + c]


@kernel
def _add_tangents(table: np.ndarray, own: np.ndarray, gradient: np.ndarray, hessian: np.ndarray, moving: bool) -> None:
    """Add K and D; `hessian` (m n, 2 d, 2 d) is empty in the plane. Without `moving` rates do not depend on rotations."""
    stiffness, damping, p = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING), pattern_of(table)
    dof, rates, bodies, ends = integers_1d(table, DOF), floats_2d(table, RATES), bodies_of(own), integers_2d(own, _ENDS)
    efforts, by_angle, by_rate = floats_2d(own, EFFORTS), floats_3d(own, STIFFNESSES), floats_3d(own, VISCOSITIES)
    n, width = efforts.shape[1], 2 * rates.shape[1]
    block, rows, turned = np.zeros((n * width, n * width)), np.zeros((n, n * width)), np.zeros((n, n * width))
    speed = np.zeros(width)
    for i in range(bodies.shape[0]):
        block[:] = 0.0
        for j in range(n):
            k, first = i * n + j, j * width
            for a in range(width):
                rows[j, first + a] = gradient[k, 0, a]
                turned[j, first + a] = 0.0
                speed[a] = rates[ends[k, 2 * a // width], a % (width // 2)]
            if hessian.shape[0] == 0:
                continue
            for a in range(width):
                for b in range(width):
                    block[first + a, first + b] = efforts[i, j] * hessian[k, a, b]
                    if moving:
                        turned[j, first + b] += hessian[k, a, b] * speed[a]
        _add_products(rows, by_angle[i], rows, block)
        _add_products(rows, by_rate[i], turned, block)
        add_block(block, dof, bodies[i], p.rows, p.columns, stiffness)
        block[:] = 0.0
        _add_products(rows, by_rate[i], rows, block)
        add_block(block, dof, bodies[i], p.rows, p.columns, damping)


@kernel
def _add_products(left: np.ndarray, middle: np.ndarray, right: np.ndarray, block: np.ndarray) -> None:
    """Add left^T middle right."""
    for j in range(middle.shape[0]):
        for k in range(middle.shape[1]):
            if middle[j, k] == 0.0:
                continue
            for a in range(block.shape[0]):
                for b in range(block.shape[1]):
                    block[a, b] += left[j, a] * middle[j, k] * right[k, b]


@kernel
def _planar_force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, gradient = _planar(table, own)
    _apply_law(table, own, t, per_second, angle, rate)
    _add_forces(table, own, gradient)
    return 0.0


@kernel
def _spatial_force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, gradient = _spatial(table, own)
    _apply_law(table, own, t, per_second, angle, rate)
    _add_forces(table, own, gradient)
    return 0.0


@kernel
def _planar_tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, gradient = _planar(table, own)
    _apply_law(table, own, t, per_second, angle, rate)
    _add_forces(table, own, gradient)
    _add_tangents(table, own, gradient, np.zeros((0, 1, 1)), False)
    return 0.0


@kernel
def _spatial_tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, gradient = _spatial(table, own)
    _apply_law(table, own, t, per_second, angle, rate)
    _add_forces(table, own, gradient)
    _, hessian = derivatives_hinge_spatial(
        floats_2d(table, POSES), integers_2d(own, _ENDS), floats_2d(own, _INNER), floats_2d(own, _OUTER)
    )
    _add_tangents(table, own, gradient, hessian, per_second == 0.0)
    return 0.0


@kernel
def _planar_keep(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    floats_1d(own, LAST)[:] = _planar(table, own)[0]
    return 0.0


@kernel
def _spatial_keep(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    floats_1d(own, LAST)[:] = _spatial(table, own)[0]
    return 0.0


@kernel
def _planar_stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, _ = _planar(table, own)
    _apply_law(table, own, t, per_second, angle, rate)
    floats_1d(table, STORED)[0] += floats_1d(own, ENERGIES).sum()
    return 0.0


@kernel
def _spatial_stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, _ = _spatial(table, own)
    _apply_law(table, own, t, per_second, angle, rate)
    floats_1d(table, STORED)[0] += floats_1d(own, ENERGIES).sum()
    return 0.0


@kernel
def _planar_lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, _ = _planar(table, own)
    _apply_law(table, own, t, per_second, angle, rate)
    return float(floats_1d(own, DISSIPATED).sum())


@kernel
def _spatial_lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, _ = _spatial(table, own)
    _apply_law(table, own, t, per_second, angle, rate)
    return float(floats_1d(own, DISSIPATED).sum())


_PLANAR = ElementKernels(_planar_force, _planar_tangent, _planar_keep, _planar_stored, _planar_lost)
_SPATIAL = ElementKernels(_spatial_force, _spatial_tangent, _spatial_keep, _spatial_stored, _spatial_lost)


@dataclass(frozen=True)
class CouplingGroup(ElementGroup):
    """Couplings of one kind.

    Attributes
    ----------
    bodies : (m, 2 n) int array
        Inner and outer body of each joint.
    joints : Joints
    kind : Coupling
    parameters : parameters of all elements
    names : names of the elements
    """

    bodies: np.ndarray
    joints: Joints
    kind: Coupling
    parameters: tuple[Any, ...]
    names: tuple[str, ...]
    categories = ("panels",)

    @property
    def kernels(self) -> ElementKernels:
        """See `ElementGroup`."""
        return _SPATIAL if len(self.joints.inner) else _PLANAR

    @property
    def last_shape(self) -> tuple[int, ...]:
        """See `ElementGroup`."""
        return (len(self.joints.ends),)

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`; whether the law has dampers at rest."""
        own = self.arrays
        table = address_table([self.bodies, np.zeros((0, 4), dtype=np.int64), np.zeros(self.last_shape), *own])
        _call_law(self._law, table)
        return bool(np.any(own[VISCOSITIES - OWN]))

    @cached_property
    def _law(self) -> int:
        example = np.zeros((1, ROW), dtype=np.int64)
        return address_of(self.kind.law, example, example, 0.0, 0.0)

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        m, n = len(self.bodies), self.kind.joints
        work = [np.zeros((m, n)), np.zeros((m, n)), np.zeros(m), np.zeros(m), np.zeros((m, n))]
        law = np.array([self._law], dtype=np.int64)
        return [
            *self.joints, law, *work, np.zeros((m, n, n)), np.zeros((m, n, n)), *self.kind.parameters(list(self.parameters)),
        ]  # fmt: skip

    def states(self, t: float, poses: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angles (rad) and efforts (N m) of the joints of every element, (m, n) arrays."""
        self.energy(t, poses, rates)
        return self.arrays[ANGLES - OWN].copy(), self.arrays[EFFORTS - OWN].copy()


@kernel
def _call_law(address: int, own: np.ndarray) -> float:
    return float(call_at(address, own, own, 0.0, 0.0))
