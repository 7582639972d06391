"""Elements on the coordinates of several joints: `[[scene.couplings]]`.

A kind of coupling is one kernel with the arguments of all kernels of elements (`fsm.model.elements.element_group`). From
coordinates (m, n) and rates (m, n) of its n joints it writes the energy U (m,) and the dissipated power (m,) of each
element, the efforts e = dU/dx + (part of dampers) (m, n), and their derivatives (m, n, n) with respect to coordinates and
rates. Forces and tangents follow here, in the plane and in space:

    h = -sum e_j g_j,    K = sum g_j (de_j/dx_k g_k + de_j/dx'_k dx'_k/dq) + sum e_j dg_j/dq,    g_j = dx_j/dq

Coordinates count from the start: twists of force elements, angles (with all their turns) and displacements of ideal joints.
A kind may lock an opening of the coordinates (`fsm.model.elements.locked_couplings`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.hinge_planar import measure_hinge_planar
from fsm.interactions.hinge_spatial import derivatives_hinge_spatial, measure_hinge_spatial
from fsm.interactions.openings import TURN, bend, opening
from fsm.kernels.addresses import ROW, address_table, floats_1d, floats_2d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import address_of, call_at
from fsm.kernels.scatter import add_block
from fsm.model.bodies.arrays import DAMPING, DOF, FORCE, POSES, RATES, STIFFNESS, STORED, pattern_of
from fsm.model.bodies.group import BodyState
from fsm.model.elements.element_group import LAST, OWN, ElementGroup, ElementKernels, bodies_of

_ENDS, _KINDS, _INNER, _OUTER, _OFFSET, _CALLS, KEPT, GRADIENTS, _HESSIANS = range(OWN, OWN + 9)
ANGLES, SPEEDS, ENERGIES, DISSIPATED, EFFORTS, STIFFNESSES, VISCOSITIES = range(OWN + 9, OWN + 16)
FIRST_PARAMETER = OWN + 16
"""Rows of the table of a group for a kind's kernel: what it reads, what it writes, and from here on its parameters."""
_LAW, _MEASURE = range(2)
"""Kernels of the row `_CALLS`."""
TWIST = -1
"""Kind of a coordinate that is the twist of a force element; others are those of `fsm.interactions.openings`."""


class Coupling(NamedTuple):
    """Kind of elements on the coordinates of joints.

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
    """Joints of all elements, (m n) one element after another.

    Ends (m n, 2), kinds (m n,), and the offset (m n,) that makes each coordinate zero at the start. The other two are, for
    `TWIST`, axes (m n, 4) in both bodies, empty in the plane; else constants (m n, 14) of openings, and an empty array.
    """

    ends: np.ndarray
    kinds: np.ndarray
    inner: np.ndarray
    outer: np.ndarray
    offset: np.ndarray


@kernel(inline=True)
def ends_of(own: np.ndarray) -> np.ndarray:
    """Bodies (m n, 2) of all coordinates."""
    return integers_2d(own, _ENDS)


@kernel
def _planar(table: np.ndarray, own: np.ndarray, t: float, twice: float) -> float:
    angle, rate, gradient = measure_hinge_planar(
        floats_2d(table, POSES), floats_2d(table, RATES), ends_of(own), floats_1d(own, _OFFSET)
    )
    _write(own, angle, rate, gradient[:, 0])
    return 0.0


@kernel
def _spatial(table: np.ndarray, own: np.ndarray, t: float, twice: float) -> float:
    poses, ends, inner, outer = floats_2d(table, POSES), ends_of(own), floats_2d(own, _INNER), floats_2d(own, _OUTER)
    angle, rate, gradient = measure_hinge_spatial(
        poses, floats_2d(table, RATES), ends, inner, outer, floats_1d(own, _OFFSET)
    )
    _write(own, angle, rate, gradient[:, 0])
    if twice > 0.0:
        floats_3d(own, _HESSIANS)[:] = derivatives_hinge_spatial(poses, ends, inner, outer)[1]
    return 0.0


@kernel
def _of_joints(table: np.ndarray, own: np.ndarray, t: float, twice: float) -> float:
    poses, rates, ends, kinds = floats_2d(table, POSES), floats_2d(table, RATES), ends_of(own), integers_1d(own, _KINDS)
    constants, gradient, hessian = floats_2d(own, _INNER), floats_2d(own, GRADIENTS), floats_3d(own, _HESSIANS)
    angles, speeds = floats_2d(own, ANGLES).reshape(-1), floats_2d(own, SPEEDS).reshape(-1)
    rows = 12 if twice > 0.0 else 0
    for k in range(ends.shape[0]):
        a, b = ends[k, 0], ends[k, 1]
        angles[k] = opening(kinds[k], poses[a], poses[b], constants[k], 0.0, gradient[k], hessian[k, :rows])
        speeds[k] = 0.0
        for c in range(12):
            speeds[k] += gradient[k, c] * rates[ends[k, c // 6], c % 6]
    return 0.0


@kernel
def _write(own: np.ndarray, angle: np.ndarray, rate: np.ndarray, gradient: np.ndarray) -> None:
    floats_2d(own, ANGLES).reshape(-1)[:] = angle
    floats_2d(own, SPEEDS).reshape(-1)[:] = rate
    floats_2d(own, GRADIENTS)[:] = gradient


@kernel
def measure_coordinates(table: np.ndarray, own: np.ndarray, t: float, twice: bool) -> None:
    """Write coordinates with all turns, their rates and gradients, and with `twice` their second derivatives."""
    call_at(integers_1d(own, _CALLS)[_MEASURE], table, own, t, 1.0 if twice else 0.0)
    angles, kinds, kept = floats_2d(own, ANGLES).reshape(-1), integers_1d(own, _KINDS), floats_1d(own, KEPT)
    for k in range(angles.shape[0]):
        if kinds[k] == TURN or kinds[k] == TWIST:
            angles[k] += 2.0 * np.pi * np.round((kept[k] - angles[k]) / (2.0 * np.pi))


@kernel
def _measure(table: np.ndarray, own: np.ndarray, t: float, per_second: float, twice: bool) -> None:
    """Measure, and call the kind's kernel."""
    measure_coordinates(table, own, t, twice)
    if per_second > 0.0:
        angles, rates, last = floats_2d(own, ANGLES).reshape(-1), floats_2d(own, SPEEDS).reshape(-1), floats_1d(own, LAST)
        for k in range(angles.shape[0]):
            rates[k] = (angles[k] - last[k]) * per_second
    call_at(integers_1d(own, _CALLS)[_LAW], table, own, t, per_second)


@kernel
def bends_of(table: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Second derivatives (m n,) of coordinates of ideal joints in time, at constant rates of the bodies."""
    poses, rates, ends, kinds = floats_2d(table, POSES), floats_2d(table, RATES), ends_of(own), integers_1d(own, _KINDS)
    found, constants, speed = np.empty(ends.shape[0]), floats_2d(own, _INNER), np.empty(12)
    for k in range(ends.shape[0]):
        first, second = ends[k, 0], ends[k, 1]
        speed[:6], speed[6:] = rates[first, :6], rates[second, :6]
        found[k] = bend(kinds[k], poses[first], poses[second], constants[k], speed)
    return found


@kernel
def add_efforts(table: np.ndarray, own: np.ndarray) -> None:
    """Add the forces of all efforts."""
    force, ends, efforts = floats_2d(table, FORCE), ends_of(own), floats_2d(own, EFFORTS).reshape(-1)
    size, gradient = force.shape[1], floats_2d(own, GRADIENTS)
    for i in range(ends.shape[0]):
        for side in range(2):
            for c in range(size):
                force[ends[i, side], c] -= efforts[i] * gradient[i, side * size + c]


@kernel
def add_tangents(table: np.ndarray, own: np.ndarray, moving: bool) -> None:
    """Add K and D. Without `moving` rates do not depend on rotations."""
    stiffness, damping, p = floats_3d(table, STIFFNESS), floats_3d(table, DAMPING), pattern_of(table)
    dof, rates, bodies, ends = integers_1d(table, DOF), floats_2d(table, RATES), bodies_of(own), ends_of(own)
    efforts, by_angle, by_rate = floats_2d(own, EFFORTS), floats_3d(own, STIFFNESSES), floats_3d(own, VISCOSITIES)
    gradient, hessian = floats_2d(own, GRADIENTS), floats_3d(own, _HESSIANS)
    n, width = efforts.shape[1], gradient.shape[1]
    block, rows, turned = np.zeros((n * width, n * width)), np.zeros((n, n * width)), np.zeros((n, n * width))
    speed, damped = np.zeros(width), np.any(by_rate)
    for i in range(bodies.shape[0]):
        block[:] = 0.0
        for j in range(n):
            k, first = i * n + j, j * width
            for a in range(width):
                rows[j, first + a] = gradient[k, a]
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
        if not damped:
            continue
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
def _force(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    _measure(table, own, t, per_second, False)
    add_efforts(table, own)
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    _measure(table, own, t, per_second, True)
    add_efforts(table, own)
    add_tangents(table, own, per_second == 0.0)
    return 0.0


@kernel
def _keep(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    measure_coordinates(table, own, t, False)
    floats_1d(own, LAST)[:] = floats_2d(own, ANGLES).reshape(-1)
    return 0.0


@kernel
def _stored(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    _measure(table, own, t, per_second, False)
    floats_1d(table, STORED)[0] += floats_1d(own, ENERGIES).sum()
    return 0.0


@kernel
def _lost(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    _measure(table, own, t, per_second, False)
    return float(floats_1d(own, DISSIPATED).sum())


@kernel
def accept(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    """Count the turns."""
    measure_coordinates(table, own, t, False)
    angles, kept = floats_2d(own, ANGLES).reshape(-1), floats_1d(own, KEPT)
    for k in range(angles.shape[0]):
        kept[k] = angles[k]
    return 0.0


KERNELS = ElementKernels(_force, _tangent, _keep, _stored, _lost, accept)


@dataclass(frozen=True)
class CouplingGroup(ElementGroup):
    """Couplings of one kind, on coordinates of one sort.

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
    categories: tuple[str, ...] = ("panels",)
    kernels = KERNELS

    @property
    def last_shape(self) -> tuple[int, ...]:
        """See `ElementGroup`."""
        return (len(self.joints.ends),)

    @cached_property
    def rate_dependent(self) -> bool:
        """See `Group`; whether the law has dampers at the start, or far on either side of it, where a play is closed."""
        own, found = self.arrays, False
        table = address_table([self.bodies, np.zeros((0, 4), dtype=np.int64), np.zeros(self.last_shape), *own])
        for way in (1e3, -1e3, 0.0):
            own[ANGLES - OWN][:, 0] = way
            _call_law(self._law, table)
            found |= bool(np.any(own[VISCOSITIES - OWN]))
        return found

    @cached_property
    def _law(self) -> int:
        return _address(self.kind.law)

    @property
    def coordinates(self) -> int:
        """Number of all coordinates, m n."""
        return len(self.joints.ends)

    @property
    def memory_of(self) -> np.ndarray:
        """Coordinates (m n,) at the last accepted state, which count the turns."""
        return self.arrays[KEPT - OWN]

    @property
    def first_memory(self) -> np.ndarray:
        """See `ElementGroup`."""
        return np.zeros(len(self.memory_of))

    @cached_property
    def arrays(self) -> list[np.ndarray]:
        """See `ElementGroup`."""
        m, n, count = len(self.bodies), self.kind.joints, self.coordinates
        ideal, spatial = len(self.joints.kinds) > 0 and self.joints.kinds[0] != TWIST, len(self.joints.inner) > 0
        measure, width = _of_joints if ideal else _spatial if spatial else _planar, 12 if spatial else 6
        calls = np.array([self._law, _address(measure)], dtype=np.int64)
        work = [np.zeros((count, width)), np.zeros((count if spatial else 0, width, width))]
        work += [np.zeros((m, n)), np.zeros((m, n)), np.zeros(m), np.zeros(m), np.zeros((m, n))]
        return [
            *self.joints, calls, np.zeros(self.memories), *work, np.zeros((m, n, n)), np.zeros((m, n, n)),
            *self.kind.parameters(list(self.parameters)),
        ]  # fmt: skip

    @property
    def memories(self) -> int:
        """Length of the memory."""
        return self.coordinates

    def states(self, t: float, poses: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates (rad or m) and efforts (N m or N) of the joints of every element, (m, n) arrays."""
        self.energy(BodyState(t, poses, rates))
        return self.arrays[ANGLES - OWN].copy(), self.arrays[EFFORTS - OWN].copy()


def _address(of: Any) -> int:
    example = np.zeros((1, ROW), dtype=np.int64)
    return address_of(of, example, example, 0.0, 0.0)


@kernel
def _call_law(address: int, own: np.ndarray) -> float:
    return float(call_at(address, own, own, 0.0, 0.0))
