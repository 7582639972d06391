"""Contact of an ellipsoid with a fixed plane.

With the normal n of the plane, nu = A^T n in body axes, the squares D of the semi-axes and s = sqrt(nu.D nu), the lowest
point is at p = -D nu/s from the centre, and

    g = n.(r - r_0) - s,    dg/dtheta = p x nu.

The slip velocity along t is t.v + Omega.(p x A^T t).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from fsm.case.schema.model import Model
from fsm.case.schema.units import Length, Number
from fsm.errors import CaseError, Fault
from fsm.interactions.contact.contact_frame import add_contact_tangent
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.tables import Floats1, Floats2, Floats3, Integers2, follows
from fsm.model.bodies.contact_arrays import ContactArrays, forces_of, index_of
from fsm.model.contact.contact_table import ContactTable
from fsm.model.contact.pair_contacts import PairContacts
from fsm.model.contact.touching import Touching
from fsm.registry import GEOMETRIES, AddedLaw

SemiAxis = Annotated[Length, Field(gt=0)]


class EllipsoidOnPlane(Model):
    """Parameters of a pair of an ellipsoid and the ground."""

    semi_axes: tuple[SemiAxis, SemiAxis, SemiAxis] = Field(description="semi-axes along the axes of the body")
    normal: tuple[Number, Number, Number] = Field(
        default=(0.0, 0.0, 1.0), description="normal of the plane towards the ellipsoid, inertial axes"
    )
    point: tuple[Length, Length, Length] = Field(default=(0.0, 0.0, 0.0), description="point of the plane, inertial axes")


class EllipsoidArrays(NamedTuple):
    """Bodies of all pairs, squares of the semi-axes (m^2), axes of the planes (t1, t2, n as rows) and n.r_0 (m)."""

    ends: Integers2
    squares: Floats2
    axes: Floats3
    height: Floats1


_own = follows(EllipsoidArrays, ContactArrays)


@kernel
def _lowest(
    g: ContactArrays, poses: np.ndarray, slot: int, turned: np.ndarray, low: np.ndarray
) -> float:
    """Write the axes of the plane in body axes as rows, and the lowest point from the centre; return the distance s."""
    own, turn, size = _own(g), np.empty((3, 3)), 0.0
    fill_rotation(poses[own.ends[slot, 0], 3:7], turn)
    for k in range(3):
        for m in range(3):
            turned[k, m] = 0.0
            for j in range(3):
                turned[k, m] += own.axes[slot, k, j] * turn[j, m]
    for m in range(3):
        size += own.squares[slot, m] * turned[2, m] ** 2
    size = np.sqrt(size)
    for m in range(3):
        low[m] = -own.squares[slot, m] * turned[2, m] / size
    return float(size)


@kernel
def _height(g: ContactArrays, poses: np.ndarray, slot: int) -> float:
    """Height of the centre over the plane, m."""
    own, height = _own(g), -_own(g).height[slot]
    for j in range(3):
        height += own.axes[slot, 2, j] * poses[own.ends[slot, 0], j]
    return float(height)


@kernel
def _find(g: ContactArrays, poses: np.ndarray, below: float) -> int:
    turned, low, count = np.empty((3, 3)), np.empty(3), 0
    for slot in range(_own(g).ends.shape[0]):
        gap = _height(g, poses, slot) - _lowest(g, poses, slot, turned, low)
        if gap < below:
            g.slot[count], g.gap[count] = slot, gap
            count += 1
    return count


@kernel
def _measure(g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int) -> None:
    own, turned, low = _own(g), np.empty((3, 3)), np.empty(3)
    for i in range(count):
        slot, way = g.slot[i], g.gradient[i]
        _lowest(g, poses, slot, turned, low)
        way[:] = 0.0
        for a in range(3):
            row = (a + 2) % 3  # the normal, then both tangents
            for j in range(3):
                way[a, j] = own.axes[slot, row, j]
            way[a, 3] = low[1] * turned[row, 2] - low[2] * turned[row, 1]
            way[a, 4] = low[2] * turned[row, 0] - low[0] * turned[row, 2]
            way[a, 5] = low[0] * turned[row, 1] - low[1] * turned[row, 0]
        for end in range(2):
            g.bodies[i, end] = own.ends[slot, end]
        for a in range(4):
            g.rate[i, a] = 0.0
            for m in range(6):
                g.rate[i, a] += way[a, m] * rates[own.ends[slot, 0], m]


@kernel
def _tangent(
    g: ContactArrays, poses: np.ndarray, rates: np.ndarray, count: int, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    own, turned, low, part = _own(g), np.empty((3, 3)), np.empty(3), np.eye(3)
    second, of_slip, of_low = np.zeros((12, 12)), np.zeros((12, 12, 3)), np.empty(3)
    block_k, block_d = np.empty((12, 12)), np.empty((12, 12))
    for i in range(count):
        slot = g.slot[i]
        size = _lowest(g, poses, slot, turned, low)
        nu = turned[2]
        for n in range(3):
            change = np.cross(nu, part[n])  # of nu, if the body turns about axis n
            of_size = -(low[0] * change[0] + low[1] * change[1] + low[2] * change[2])
            for m in range(3):
                of_low[m] = -(own.squares[slot, m] * change[m] + low[m] * of_size) / size
            of_gap = np.cross(of_low, nu) + np.cross(low, change)
            for m in range(3):
                second[3 + m, 3 + n] = of_gap[m]
                of_point = np.cross(part[n], np.cross(part[m], low)) + np.cross(part[m], of_low)
                for k in range(2):
                    of_slip[3 + m, 3 + n, k] = 0.0
                    for j in range(3):
                        of_slip[3 + m, 3 + n, k] += turned[k, j] * of_point[j]
        add_contact_tangent(
            i, rates, g.bodies[:count], g.gradient[:count], second, of_slip, forces_of(g, 0, count), index_of(g), stiffness,
            damping, block_k, block_d,
        )  # fmt: skip


@kernel
def _passed(g: ContactArrays, poses: np.ndarray) -> int:
    for slot in range(_own(g).ends.shape[0]):
        if _height(g, poses, slot) < 0.0:
            return slot
    return -1


def _build(touching: Touching) -> tuple[ContactTable, ...]:
    """Table of all pairs of an ellipsoid and the ground."""
    faults, axes, heights = list[Fault](), [], []
    for (number, pair), given in zip(touching.pairs, touching.parameters, strict=True):
        normal = np.array(given["normal"], dtype=float)
        if pair.second != "ground":
            text = f'the plane is fixed: the second side is "ground", not {pair.second!r}'
            faults.append(Fault(f"scene.pairs.{number}.second", text))
        if not normal.any():
            text = "a normal has a direction; give [0, 0, 1], for example"
            faults.append(Fault(f"scene.pairs.{number}.parameters.normal", text))
            continue
        normal /= np.linalg.norm(normal)
        first = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
        first /= np.linalg.norm(first)
        axes.append([first, np.cross(normal, first), normal])
        heights.append(float(normal @ np.array(given["point"])))
    if faults:
        raise CaseError(faults)
    sizes = np.array([given["semi_axes"] for given in touching.parameters])
    own = EllipsoidArrays(touching.ends, sizes**2, np.array(axes), np.array(heights))
    return (PairContacts(touching, own, float(sizes.min()), _find, _measure, _tangent, _passed),)


GEOMETRIES["ellipsoid-on-plane"] = AddedLaw(_build, EllipsoidOnPlane, "ellipsoid on a fixed plane")
