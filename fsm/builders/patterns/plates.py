"""Meshes of single plates (rectangles, flat or bent to a cylinder, and annuli with or without a slit) and of booms.

Booms are shells with a curved section and a straight axis along x; the initial state is free of stress. The section lies in
the plane y-z and is symmetric about z. The arc has the radius R, the normal points outwards:

    y = R sin(phi),  z = R (cos(phi) - 1),  phi from -a/2 to a/2 with the subtended angle a

The slopes of a node are along the boom and along the section, so angles of plies are measured from the axis of the boom.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fsm.case.models.facet_mesh import MOST_TRIANGLES, FacetMesh, MeshCrease, graded, many
from fsm.case.models.sheet import Sheet
from fsm.errors import CaseError, Fault


def rectangle_mesh(
    length: float, width: float, mesh: tuple[int, int], radius: float | None = None, moved: np.ndarray | None = None
) -> FacetMesh:
    """Rectangle from the origin along x and y.

    Parameters
    ----------
    length, width : m
    mesh : numbers of cells along x and y
    radius : m
        The plate is bent without stress to a cylinder whose axis is parallel to y, below the plate; None: flat.
    moved : (nx + 1, ny + 1, 2) array, m
        Displacements of the nodes in the plane, for irregular meshes; None: none.
    """

    def bent(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turn = np.zeros(len(points)) if radius is None else points[:, 0] / radius
        zero = np.zeros(len(points))
        if radius is None:
            positions = np.column_stack([points, zero])
        else:
            positions = np.column_stack([radius * np.sin(turn), points[:, 1], radius * (np.cos(turn) - 1.0)])
        along = np.column_stack([np.cos(turn), zero, -np.sin(turn)])
        return positions, np.stack([along, np.column_stack([zero, zero + 1.0, zero])], axis=1)

    return bent_mesh(length, width, mesh, moved, bent, radius is not None)


def bent_mesh(
    length: float,
    width: float,
    mesh: tuple[int, int],
    moved: np.ndarray | None,
    bent: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    curved: bool = True,
) -> FacetMesh:
    """Rectangle that a function bends: it gives positions (n, 3) and slopes (n, 2, 3) of points (n, 2) of the flat plate.

    The other arguments are those of `rectangle_mesh`; `curved`: see `FacetMesh`.
    """
    nx, ny = mesh
    x, y = np.meshgrid(np.linspace(0.0, length, nx + 1), np.linspace(0.0, width, ny + 1), indexing="ij")
    flat = np.stack([x, y], axis=-1)
    if moved is not None:
        flat = flat + moved
    number = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    points = flat.reshape(-1, 2)
    triangles = _triangles(number, points)
    positions, slopes = bent(points)
    edges = {
        "left": _edge(triangles, number[0]), "right": _edge(triangles, number[-1]),
        "bottom": _edge(triangles, number[:, 0]), "top": _edge(triangles, number[:, -1]),
    }  # fmt: skip
    corners = np.array([number[0, 0], number[-1, 0], number[-1, -1], number[0, -1]])
    return FacetMesh(
        positions, slopes, np.arange(len(points)), triangles, points[triangles], np.zeros(triangles.shape), corners,
        np.zeros(len(triangles), dtype=np.int64), edges, curved, cells=_cells(triangles),
    )  # fmt: skip


def annulus_mesh(
    inner: float, outer: float, slit: bool, mesh: tuple[int, int], moved: np.ndarray | None = None
) -> FacetMesh:
    """Flat annulus about the origin; a slit lies along the positive x axis.

    Parameters
    ----------
    inner, outer : radii, m
    slit : bool
    mesh : numbers of cells along the radius and around
    moved : (nr + 1, n + 1, 2) array, -
        Displacements of the nodes in radius (m) and angle (rad), for irregular meshes; None: none.

    Notes
    -----
    The slopes of a node are along the radius and around. Vertices 1 and 2 are the inner and outer ends of the edge
    "slit-start" at the angle 0, vertices 3 and 4 the outer and inner ends of "slit-end" at 360 degrees.
    """
    nr, around = mesh
    angles = 2.0 * math.pi * np.arange(around + 1) / around
    radius, angle = np.meshgrid(np.linspace(inner, outer, nr + 1), angles, indexing="ij")
    polar = np.stack([radius, angle], axis=-1)
    if moved is not None:
        polar = polar + moved
    columns = around + 1 if slit else around
    polar = polar[:, :columns]
    points = polar[..., :1] * np.stack([np.cos(polar[..., 1]), np.sin(polar[..., 1])], axis=-1)
    number = np.arange((nr + 1) * columns).reshape(nr + 1, columns)
    closed = number if slit else np.concatenate([number, number[:, :1]], axis=1)
    flat = points.reshape(-1, 2)
    triangles = _triangles(closed, flat)
    at = polar[..., 1].ravel()
    cosine, sine, zero = np.cos(at), np.sin(at), np.zeros(len(at))
    slopes = np.stack([np.column_stack([cosine, sine, zero]), np.column_stack([-sine, cosine, zero])], axis=1)
    edges = {"inner": _edge(triangles, closed[0]), "outer": _edge(triangles, closed[-1])}
    corners = np.zeros(0, dtype=np.int64)
    if slit:
        edges |= {"slit-start": _edge(triangles, closed[:, 0]), "slit-end": _edge(triangles, closed[:, -1])}
        corners = np.array([closed[0, 0], closed[-1, 0], closed[-1, -1], closed[0, -1]])
    return FacetMesh(
        np.column_stack([flat, zero]), slopes, np.arange(len(flat)), triangles, flat[triangles], at[triangles], corners,
        np.zeros(len(triangles), dtype=np.int64), edges, cells=_cells(triangles),
    )  # fmt: skip


def disc_mesh(radius: float, rings: int) -> FacetMesh:
    """Flat disc about the origin: ring k has 6 k nodes. The slopes of a node are along the radius and around.

    Vertex 1 is the centre.
    """
    ring = np.repeat(np.arange(rings + 1), [1, *(6 * k for k in range(1, rings + 1))])
    first = np.concatenate([[0], 1 + 3 * np.arange(rings + 1) * np.arange(1, rings + 2)])  # of each ring
    place = np.arange(len(ring)) - first[ring]
    angle = 2.0 * math.pi * place / np.maximum(6 * ring, 1)
    flat = (radius * ring / rings)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    triangles = []
    for k in range(1, rings + 1):
        outer = first[k] + np.arange(6 * k + 1) % (6 * k)
        inner = first[k - 1] + np.arange(6 * k - 5) % max(6 * k - 6, 1)
        for sextant in range(6):
            a, b = outer[sextant * k :], inner[sextant * (k - 1) :]
            triangles += [(b[i], a[i], a[i + 1]) for i in range(k)]
            triangles += [(b[i], a[i + 1], b[i + 1]) for i in range(k - 1)]
    cosine, sine, zero = np.cos(angle), np.sin(angle), np.zeros(len(angle))
    slopes = np.stack([np.column_stack([cosine, sine, zero]), np.column_stack([-sine, cosine, zero])], axis=1)
    cells = np.array(triangles)
    edge = first[rings] + np.arange(6 * rings + 1) % (6 * rings)
    return FacetMesh(
        np.column_stack([flat, zero]), slopes, np.arange(len(flat)), cells, flat[cells], angle[cells],
        np.zeros(1, dtype=np.int64), np.zeros(len(cells), dtype=np.int64), {"outer": _edge(cells, edge)},
    )  # fmt: skip


def _triangles(number: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Two triangles of each cell of a grid of nodes, counter-clockwise, along the shorter diagonal.

    Diagonals of equal length alternate from cell to cell, so that the mesh has no preferred direction.
    """
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    first, second = (np.linalg.norm(points[p] - points[q], axis=1) for p, q in ((a, c), (b, d)))
    i, j = (part.ravel() for part in np.indices((number.shape[0] - 1, number.shape[1] - 1)))
    equal = np.abs(first - second) < 1e-9 * (first + second)
    along = np.where(equal, (i + j) % 2 == 0, first < second)
    one = np.where(along[:, None], np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    two = np.where(along[:, None], np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return np.stack([one, two], axis=1).reshape(-1, 3)


def _cells(triangles: np.ndarray) -> np.ndarray:
    """Numbers (c, 2) of the triangles of each cell of `_triangles`."""
    return np.arange(len(triangles)).reshape(-1, 2)


def _edge(triangles: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Triangles and numbers of their edges along a row of nodes, (k, 2)."""
    pairs = {frozenset(pair): k for k, pair in enumerate(zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True))}
    found = np.zeros((len(pairs), 2), dtype=np.int64)
    for number in range(3):
        sides = np.stack([triangles[:, number], triangles[:, (number + 1) % 3]], axis=1)
        near = np.flatnonzero(np.isin(sides, nodes).all(axis=1))
        for triangle in near.tolist():
            place = pairs.get(frozenset(sides[triangle].tolist()))
            if place is not None:
                found[place] = triangle, number
    return found


def plate_mesh(sheet: Sheet) -> FacetMesh:
    """Mesh of a sheet of the kind "plate"."""
    if sheet.is_disc:
        assert sheet.outer_radius is not None and sheet.mesh_size is not None
        rings = max(2, math.ceil(sheet.outer_radius / sheet.mesh_size - 1e-9))
        if 6 * rings**2 > MOST_TRIANGLES:
            text = f"{rings:,} rings are {6 * rings**2:,} triangles; at most {MOST_TRIANGLES:,} are allowed: use fewer"
            raise CaseError(Fault("sheet.mesh_size", text))
        return disc_mesh(sheet.outer_radius, rings)
    if sheet.is_annulus:
        inner, outer = sheet.inner_radius, sheet.outer_radius
        assert inner is not None and outer is not None
        sides = outer - inner, math.pi * (inner + outer)
    else:
        assert sheet.length is not None and sheet.width is not None
        sides = sheet.length, sheet.width
    mesh = cells_of(sheet, sides, 4 if sheet.is_annulus else 1)
    if sheet.is_annulus:
        assert inner is not None and outer is not None
        moved = displacements(sheet, mesh, (outer - inner, 2.0 * math.pi))
        return annulus_mesh(inner, outer, bool(sheet.slit), mesh, moved)
    return rectangle_mesh(*sides, mesh, sheet.radius, displacements(sheet, mesh, sides))


def cells_of(sheet: Sheet, sides: tuple[float, float], least: int) -> tuple[int, int]:
    """Numbers of cells along both sides (m), at least `least` along the second if they follow from `mesh_size`.

    Raises
    ------
    CaseError
        There are too many.
    """
    mesh = sheet.mesh
    if mesh is None:
        assert sheet.mesh_size is not None
        cells = [max(1, math.ceil(side / sheet.mesh_size - 1e-9)) for side in sides]
        mesh = cells[0], max(cells[1], least)
    if 2 * mesh[0] * mesh[1] > MOST_TRIANGLES:
        raise CaseError(
            Fault(
                "sheet.mesh" if sheet.mesh else "sheet.mesh_size",
                f"{many(mesh[0])} x {many(mesh[1])} cells are {many(2 * mesh[0] * mesh[1])} triangles; "
                f"at most {MOST_TRIANGLES:,} are allowed: use fewer cells",
            )
        )
    return mesh


def displacements(sheet: Sheet, mesh: tuple[int, int], sides: tuple[float, float]) -> np.ndarray | None:
    """Displacements of the nodes from a uniform mesh; None without displacements.

    Inner nodes are displaced at random by at most a part of a cell; the same mesh always has the same displacements.
    Then coordinates from -1 to 1 along each side are `graded`.
    """
    if not sheet.mesh_shift and not any(sheet.mesh_grading):
        return None
    uniform = np.stack(np.meshgrid(*(np.linspace(-1.0, 1.0, cells + 1) for cells in mesh), indexing="ij"), axis=-1)
    moved = uniform.copy()
    if sheet.mesh_shift:
        random = np.random.default_rng(mesh).uniform(-sheet.mesh_shift, sheet.mesh_shift, moved.shape)
        random[[0, -1]] = random[:, [0, -1]] = 0.0
        moved += random * (2.0 / np.array(mesh))
    return np.asarray(0.5 * (graded(moved, np.array(sheet.mesh_grading)) - uniform) * np.array(sides))


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
