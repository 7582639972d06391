"""Meshes of booms: shells with a curved section and a straight axis along x; the initial state is free of stress.

The section lies in the plane y-z and is symmetric about z. The arc has the radius R, the normal points outwards:

    y = R sin(phi),  z = R (cos(phi) - 1),  phi from -a/2 to a/2 with the subtended angle a

The slopes of a node are along the boom and along the section, so angles of plies are measured from the axis of the boom.
"""

from __future__ import annotations

import math

import numpy as np

from fsm.builders.patterns.plates import bent_mesh, cells_of, displacements
from fsm.case.models.facet_mesh import FacetMesh, MeshCrease
from fsm.case.models.sheet import Sheet


def boom_mesh(sheet: Sheet) -> FacetMesh:
    """Mesh of a boom: "tape-spring", "stem" or "lenticular".

    Raises
    ------
    CaseError
        The mesh is too large.
    """
    assert sheet.length is not None and sheet.radius is not None and sheet.subtended_angle is not None
    radius, angle = sheet.radius, sheet.subtended_angle
    sides = sheet.length, radius * angle
    mesh = cells_of(sheet, sides, 2)
    pitch = sheet.thickness if angle > 2.0 * math.pi else 0.0
    shell = bent_mesh(*sides, mesh, displacements(sheet, mesh, sides), lambda flat: _arc(flat, radius, angle, pitch))
    return _lens(shell, mesh, radius * (1.0 - math.cos(0.5 * angle))) if sheet.kind == "lenticular" else shell


def seam_angle(sheet: Sheet) -> float:
    """Fold angle of the seams of a lenticular boom, rad; a mountain, because its normals point outwards."""
    assert sheet.subtended_angle is not None
    return sheet.subtended_angle - math.pi


def _arc(flat: np.ndarray, radius: float, angle: float, pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and slopes of points (n, 2) of the development.

    The layers of a tube of more than one turn are a spiral, whose radius grows by `pitch` (m) a turn.
    """
    growth = pitch / (2.0 * math.pi)
    turn = flat[:, 1] / radius - 0.5 * angle  # the mean radius gives the length of a full circle
    if growth:  # arc length along a spiral from its middle: radius phi + growth phi^2/2
        turn = (np.sqrt(radius**2 + 2.0 * growth * radius * turn) - radius) / growth
    at = radius + growth * turn
    c, s, zero = np.cos(turn), np.sin(turn), np.zeros(len(flat))
    across = np.column_stack([zero, at * c + growth * s, growth * c - at * s])
    across /= np.linalg.norm(across, axis=1)[:, None]
    along = np.column_stack([zero + 1.0, zero, zero])
    return np.column_stack([flat[:, 0], at * s, at * c - radius]), np.stack([along, across], axis=1)


def _lens(upper: FacetMesh, mesh: tuple[int, int], rise: float) -> FacetMesh:
    """Lenticular section: a curved shell and its copy, which is rotated by half a turn about x; seams join both edges.

    Both shells have common positions along the seams, and each shell has its own slopes there.
    """
    count = len(upper.positions)
    middle = np.array([0.0, 0.0, -rise])  # of the chord
    half = np.diag([1.0, -1.0, -1.0])
    number = np.arange(count).reshape(mesh[0] + 1, mesh[1] + 1)
    owner = np.concatenate([upper.owner, count + upper.owner])
    owner[count + number[:, 0]] = number[:, -1]
    owner[count + number[:, -1]] = number[:, 0]
    x = upper.positions[number[:, 0], 0]
    parts = 0.5 * np.diff(x)
    lengths = np.concatenate([parts, [0.0]]) + np.concatenate([[0.0], parts])
    along = np.tile([1.0, 0.0], (len(x), 2, 1))
    seams = tuple(
        MeshCrease(k, np.column_stack([left, right]), along, lengths)
        for k, (left, right) in enumerate([(count + number[:, 0], number[:, -1]), (number[:, 0], count + number[:, -1])])
    )
    triangles = len(upper.triangles)
    edges = {
        name: np.concatenate([upper.edges[name], upper.edges[name] + np.array([triangles, 0])]) for name in ("left", "right")
    }
    edges |= {"bottom": upper.edges["bottom"], "top": upper.edges["top"]}
    return FacetMesh(
        np.concatenate([upper.positions, (upper.positions - middle) @ half + middle]),
        np.concatenate([upper.slopes, upper.slopes @ half]), owner,
        np.concatenate([upper.triangles, count + upper.triangles]), np.tile(upper.plane, (2, 1, 1)),
        np.tile(upper.angle, (2, 1)), upper.vertices, np.repeat([0, 1], triangles), edges, True, seams,
        np.concatenate([upper.cells, triangles + upper.cells]),
    )  # fmt: skip
