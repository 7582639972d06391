"""Kernels of planar beams in a compiled model (`ArrayModel`), called by their addresses; see `fsm.model.nodes.arrays`.

The kernels also call the kernels of strains by address, so all elements use the same kernels of forces and tangents.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_3d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.pointers import address_of, call_at
from fsm.model.nodes.arrays import AT_REST, DAMPERS, DAMPING, FORCE, IN_MOTION, STIFFNESS, Q, U
from fsm.model.nodes.beams.bar_stress import bar_stresses
from fsm.model.nodes.beams.beam_bernoulli import bernoulli_hessians, bernoulli_strains
from fsm.model.nodes.beams.beam_green import green_hessians, green_strains
from fsm.model.nodes.beams.beam_section import section_hessians, section_strains
from fsm.model.nodes.beams.beam_strain import at_points, strain_energy, strain_force, strain_tangent

_ROWS, _GRADIENT, _HESSIAN, _BY_ADDRESS, _SLOTS = 2, 7, 8, 9, 10
"""Rows of a group's table, those of `BeamArrays` first."""
_BARS, _BESIDE, _SIZES, _LARGEST = 10, 11, 12, 13
"""Rows of the table of `note_stress`, after those of the group."""


@kernel
def gathered(vectors: np.ndarray, frames: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Coordinates of every element, (m, v, 2), each turned by the angle of its frame."""
    count, width = vectors.shape
    out = np.empty((count, width, 2))
    for e in range(count):
        for i in range(width):
            x, y = q[vectors[e, i]], q[vectors[e, i] + 1]
            cosine, sine = frames[e, i, 0], frames[e, i, 1]
            out[e, i, 0], out[e, i, 1] = cosine * x - sine * y, sine * x + cosine * y
    return out


@kernel
def scatter_forces(vectors: np.ndarray, frames: np.ndarray, element: np.ndarray, force: np.ndarray) -> None:
    """Add element forces (m, v, 2)."""
    for e in range(vectors.shape[0]):
        for i in range(vectors.shape[1]):
            x, y = element[e, i, 0], element[e, i, 1]
            cosine, sine = frames[e, i, 0], frames[e, i, 1]
            force[vectors[e, i]] += cosine * x + sine * y
            force[vectors[e, i] + 1] += cosine * y - sine * x


@kernel
def scatter_matrices(slots: np.ndarray, frames: np.ndarray, size: int, element: np.ndarray, flat: np.ndarray) -> None:
    """Add element matrices (m, 2 v, 2 v) to the flat block data."""
    for e in range(slots.shape[0]):
        for i in range(slots.shape[1]):
            c, s = frames[e, i, 0], frames[e, i, 1]
            for j in range(slots.shape[2]):
                slot, k, n = slots[e, i, j], 2 * i, 2 * j
                d, t = frames[e, j, 0], frames[e, j, 1]
                xx, xy, yx, yy = element[e, k, n], element[e, k, n + 1], element[e, k + 1, n], element[e, k + 1, n + 1]
                # R_i^T K_ij R_j, row by row
                one, two, three, four = c * xx + s * yx, c * xy + s * yy, c * yx - s * xx, c * yy - s * xy
                flat[slot] += one * d + two * t
                flat[slot + 1] += two * d - one * t
                flat[slot + size] += three * d + four * t
                flat[slot + size + 1] += four * d - three * t


class BeamArrays(NamedTuple):
    """Arrays of m beam elements for the kernels.

    Attributes
    ----------
    vectors, frames, rows, stiffness, beta : see `BeamGroup`
    z : (m, g, 2 p) array
        Derivatives of r at all points; this and the next arrays are work space.
    strain, gradient, hessian : (m, g, s), (m, g, s, 2 p), (m, g, s, 2 p, 2 p) arrays
    """

    vectors: np.ndarray
    frames: np.ndarray
    rows: np.ndarray
    stiffness: np.ndarray
    beta: np.ndarray
    z: np.ndarray
    strain: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray


@kernel
def _beams_of(t: np.ndarray) -> BeamArrays:
    z, strain = floats_3d(t, 5), floats_3d(t, 6)
    (count, points, width), strains = z.shape, strain.shape[2]
    return BeamArrays(
        integers_2d(t, 0), floats_3d(t, 1), floats_1d(t, _ROWS).reshape(count, points, width // 2, -1), floats_3d(t, 3),
        floats_1d(t, 4), z, strain, floats_1d(t, _GRADIENT).reshape(count, points, strains, width),
        floats_1d(t, _HESSIAN).reshape(count, points, strains, width, width),
    )  # fmt: skip


@kernel
def _green(table: np.ndarray, own: np.ndarray, second: float) -> float:
    b = _beams_of(own)
    if second == 1.0:
        green_hessians(b.z, b.hessian)
    else:
        green_strains(b.z, b.strain, b.gradient)
    return 0.0


@kernel
def _section(table: np.ndarray, own: np.ndarray, second: float) -> float:
    b = _beams_of(own)
    if second == 1.0:
        section_hessians(b.z, b.hessian)
    else:
        section_strains(b.z, b.strain, b.gradient)
    return 0.0


@kernel
def _bernoulli(table: np.ndarray, own: np.ndarray, second: float) -> float:
    b = _beams_of(own)
    if second == 1.0:
        bernoulli_hessians(b.z, b.hessian)
    else:
        bernoulli_strains(b.z, b.strain, b.gradient)
    return 0.0


_OF_ELEMENT = {green_strains: _green, section_strains: _section, bernoulli_strains: _bernoulli}


def beam_table(beams: BeamArrays, strains: Any) -> list[np.ndarray]:
    """Arrays of a group in the order of the rows of its table; `strains` is the kernel of `BeamGroup`."""
    table = np.zeros((0, 4), dtype=np.int64)
    address = address_of(_OF_ELEMENT[strains], table, table, 0.0)
    flat = [array.reshape(-1) if row in (_ROWS, _GRADIENT, _HESSIAN) else array for row, array in enumerate(beams)]
    return [*flat, np.array([address])]


@kernel
def _strain(own: np.ndarray, q: np.ndarray) -> None:
    b = _beams_of(own)
    at_points(gathered(b.vectors, b.frames, q), b.rows, b.z)
    call_at(integers_1d(own, _BY_ADDRESS)[0], own, own, 0.0)


@kernel
def _rates(table: np.ndarray, b: BeamArrays, moving: float) -> np.ndarray:
    if moving < IN_MOTION:
        return np.zeros((b.vectors.shape[0], b.vectors.shape[1], 2))
    return gathered(b.vectors, b.frames, floats_1d(table, U))


@kernel
def _add_force(table: np.ndarray, b: BeamArrays, rates: np.ndarray, moving: float) -> None:
    if moving == DAMPERS:
        b.strain[:] = 0.0
    element = strain_force(b.strain, b.gradient, rates, b.rows, b.stiffness, b.beta)
    scatter_forces(b.vectors, b.frames, element, floats_1d(table, FORCE))


@kernel
def _force(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _strain(own, floats_1d(table, Q))
    b = _beams_of(own)
    _add_force(table, b, _rates(table, b, moving), moving)
    return 0.0


@kernel
def _tangent(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    _strain(own, floats_1d(table, Q))
    call_at(integers_1d(own, _BY_ADDRESS)[0], own, own, 1.0)
    b, stiffness, damping = _beams_of(own), floats_3d(table, STIFFNESS), floats_3d(table, DAMPING)
    rates = _rates(table, b, moving)
    _add_force(table, b, rates, moving)
    elastic = 0.0 if moving == DAMPERS else 1.0
    by_coordinates, by_rates = strain_tangent(
        b.strain, b.gradient, b.hessian, rates, b.rows, b.stiffness, b.beta, elastic
    )
    (count, width), size = b.vectors.shape, stiffness.shape[1]
    slots = integers_2d(own, _SLOTS).reshape(count, width, width)
    scatter_matrices(slots, b.frames, size, by_coordinates, stiffness.reshape(-1))
    damped = False
    for i in range(count):
        damped = damped or (moving >= AT_REST and b.beta[i] > 0.0)
    if damped:
        scatter_matrices(slots, b.frames, size, by_rates, damping.reshape(-1))
    return 0.0


@kernel
def _energy(table: np.ndarray, own: np.ndarray, moving: float) -> tuple[float, float]:
    _strain(own, floats_1d(table, Q))
    b = _beams_of(own)
    return strain_energy(b.strain, b.gradient, _rates(table, b, moving), b.rows, b.stiffness, b.beta)


@kernel
def _stored(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return _energy(table, own, 0.0)[0]


@kernel
def _lost(table: np.ndarray, own: np.ndarray, moving: float) -> float:
    return _energy(table, own, moving)[1]


BEAMS = (_force, _tangent, _stored, _lost)
"""Kernels of a group, in the order of the columns of `Coordinates.kernels`."""


@kernel
def note_stress(table: np.ndarray, own: np.ndarray, t: float) -> float:
    """Update the largest stress of each bar at an accepted state.

    The table has the rows of the group, the arguments `bars` and `beside` of `bar_stresses`, Young's modulus (Pa) and height
    (m), and the largest stress of each bar so far (n_bars,), Pa.
    """
    _strain(own, floats_1d(table, Q))
    sizes, largest = floats_1d(own, _SIZES), floats_1d(own, _LARGEST)
    stress = bar_stresses(
        floats_3d(own, 6), integers_2d(own, _BARS), integers_2d(own, _BESIDE), sizes[0], sizes[1]
    )
    for i in range(largest.shape[0]):
        largest[i] = max(largest[i], stress[i])
    return 0.0
