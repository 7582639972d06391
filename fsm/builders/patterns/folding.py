"""State of a flat pattern folded with rigid facets, nearest to a given fraction of its fold angles."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from fsm.builders.patterns.cuts import facet_frames
from fsm.case.pattern_files.pattern import Pattern, polygon_normal

_WEIGHT = 10.0
"""Weight of the lengths and the planarity of facets relative to fold angles, in radians, along the path. A
large weight shortens the steps of the iteration; the last state is projected onto states with rigid facets."""
_INCREMENT = math.radians(5.0)
"""Largest increment of a fold angle on the path."""
_ITERATIONS = 20
_RIGID = 1e-11
"""Largest relative error of lengths and planarity of the folded state."""


_STAYS_FLAT = 1e-3
"""Largest ratio of fold angle to target at which a pattern counts as not folded."""


class _Constraints(NamedTuple):
    """Pairs (m, 2) of vertices with constant distances, quadruples (k, 4) of vertices in a plane, and the distances."""

    pairs: np.ndarray
    planes: np.ndarray
    lengths: np.ndarray
    volumes: np.ndarray


class _Hinges(NamedTuple):
    """Vertices (m, 4) of hinges: both ends of the edge, one vertex of the left face and one vertex of the right face."""

    vertices: np.ndarray
    weights: np.ndarray
    targets: np.ndarray


def fold_pattern(pattern: Pattern, part: float) -> Pattern:
    """Pattern folded by a fraction of its fold angles; the first facet stays in place.

    The fold angles are a least-squares fit to the part of the target, weighted with the lengths of the creases. Distances
    within facets and planarity of facets hold to round-off.

    Parameters
    ----------
    pattern : flat Pattern
    part : from 0 to 1

    Raises
    ------
    ValueError
        The pattern is not flat, has no fold angles, or no rigid folded state is found.
    """
    if part == 0.0:
        return pattern
    if pattern.flat is None or float(np.ptp(pattern.vertices[:, 2])) > _RIGID * pattern.extent():
        raise ValueError("`fold` folds a flat pattern, and this pattern starts folded; remove it")
    hinges = _hinges(pattern)
    if not len(hinges.vertices) or not np.any(hinges.targets):
        raise ValueError(
            "`fold` needs mountains or valleys with fold angles, but the pattern has none; "
            "assign creases or remove `fold`"
        )
    constraints = _constraints(pattern)
    x = pattern.vertices.copy()
    steps = max(2, math.ceil(part * float(np.abs(hinges.targets).max()) / _INCREMENT))
    for step in range(1, steps + 1):
        x = _fit(x, constraints, hinges, part * step / steps)
    x = _project(x, constraints)
    error = float(np.abs(_errors(x, constraints)).max())
    if not error <= _RIGID:
        text = f"distances in facets change by {error:.1e} of their length; use facets = 'bend-lines', or a smaller part"
        raise ValueError(f"no state with rigid facets was found at fold = {part:g}: {text}")
    folded = replace(pattern, vertices=_in_place(pattern, x))
    if float(np.abs(folded.fold_angles()).max()) < _STAYS_FLAT * part * float(np.abs(hinges.targets).max()):
        raise ValueError('the pattern cannot fold from flat with rigid facets; use facets = "bend-lines"')
    return folded


def _constraints(pattern: Pattern) -> _Constraints:
    pairs = {(min(u, v), max(u, v)) for u, v in pattern.edges.tolist()}
    planes = []
    for face in pattern.faces:
        first, second, third = _wide_corner(pattern.vertices, face)
        for other in face:
            if other not in (first, second, third):
                pairs |= {(min(first, other), max(first, other)), (min(second, other), max(second, other))}
                planes.append((first, second, third, other))
        pairs |= {(min(a, b), max(a, b)) for a, b in ((first, second), (second, third), (third, first))}
    listed, quads = np.array(sorted(pairs)), np.array(planes, dtype=np.int64).reshape(-1, 4)
    lengths = np.linalg.norm(pattern.vertices[listed[:, 1]] - pattern.vertices[listed[:, 0]], axis=1)
    p = pattern.vertices[quads]
    sizes = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) ** 1.5
    return _Constraints(listed, quads, lengths, sizes)


def _wide_corner(vertices: np.ndarray, face: tuple[int, ...]) -> tuple[int, int, int]:
    """Three successive corners of a face; they are chosen for the largest area."""
    count = len(face)
    triples = [(face[k - 1], face[k], face[(k + 1) % count]) for k in range(count)]
    areas = [float(np.linalg.norm(np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a]))) for a, b, c in triples]
    return triples[int(np.argmax(areas))]


def _hinges(pattern: Pattern) -> _Hinges:
    rows, targets, weights = [], [], []
    size = float(pattern.lengths.mean())
    for edge in pattern.creases.tolist():
        letter, target = pattern.assignment[edge], float(pattern.target[edge])
        if letter not in "MVFJ" or not math.isfinite(target):
            continue
        u, v = pattern.edges[edge].tolist()
        left, right = pattern.edge_faces[edge].tolist()
        sides = [_farthest(pattern, (u, v), left), _farthest(pattern, (v, u), right)]
        rows.append((u, v, *sides))
        targets.append(target if letter in "MV" else 0.0)
        weights.append(math.sqrt(float(pattern.lengths[edge]) / size) * (1.0 if letter in "MV" else 0.1))
    return _Hinges(np.array(rows, dtype=np.int64).reshape(-1, 4), np.array(weights), np.array(targets))


def _farthest(pattern: Pattern, edge: tuple[int, int], face: int) -> int:
    """Vertex of a face that is farthest from an edge, to the left of the edge; a face may extend to both sides."""
    start = pattern.vertices[edge[0]]
    along, normal = pattern.vertices[edge[1]] - start, polygon_normal(pattern.vertices[list(pattern.faces[face])])
    areas = [np.cross(along, pattern.vertices[v] - start) for v in pattern.faces[face]]
    away = [math.copysign(float(np.linalg.norm(area)), float(area @ normal)) for area in areas]
    return pattern.faces[face][int(np.argmax(away))]


def _errors(x: np.ndarray, c: _Constraints) -> np.ndarray:
    """Relative changes of the distances, and relative volumes of the quadruples."""
    apart = x[c.pairs[:, 1]] - x[c.pairs[:, 0]]
    stretch = (np.einsum("ij,ij->i", apart, apart) / c.lengths**2 - 1.0) / 2.0
    p = x[c.planes]
    volume = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0])
    return np.concatenate([stretch, volume / c.volumes])


def _slopes(x: np.ndarray, c: _Constraints) -> Any:
    """Sparse derivative of `_errors` with respect to the coordinates."""
    apart = (x[c.pairs[:, 1]] - x[c.pairs[:, 0]]) / c.lengths[:, None] ** 2
    p = x[c.planes]
    a, b, d = (p[:, k] - p[:, 0] for k in (1, 2, 3))
    by = [np.cross(b, d), np.cross(d, a), np.cross(a, b)]
    by = [-(by[0] + by[1] + by[2]), *by]
    blocks = [(c.pairs[:, 1], apart), (c.pairs[:, 0], -apart)]
    volumes = [(c.planes[:, k], by[k] / c.volumes[:, None]) for k in range(4)]
    return _stacked(len(x), [(0, blocks), (len(c.pairs), volumes)], len(c.pairs) + len(c.planes))


def _stacked(count: int, parts: list[tuple[int, list[tuple[np.ndarray, np.ndarray]]]], rows: int) -> Any:
    """Sparse matrix of derivatives with respect to the vertices. A part consists of the number of its first row, (m,)
    vertices and (m, 3) values.
    """
    from scipy import sparse

    row, column, value = [], [], []
    for first, blocks in parts:
        for vertices, values in blocks:
            number = first + np.arange(len(vertices))
            for axis in range(3):
                row.append(number)
                column.append(3 * vertices + axis)
                value.append(values[:, axis])
    data = (np.concatenate(value), (np.concatenate(row), np.concatenate(column)))
    return sparse.csr_matrix(data, shape=(rows, 3 * count))


def _angles(x: np.ndarray, hinges: _Hinges) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """Fold angles of the hinges, and their derivatives with respect to the four vertices."""
    u, v, a, b = (x[hinges.vertices[:, k]] for k in range(4))
    length = np.linalg.norm(v - u, axis=1)[:, None]
    along = (v - u) / length
    left, right = np.cross(v - u, a - u), np.cross(u - v, b - v)
    height_a, height_b = (np.linalg.norm(n, axis=1)[:, None] / length for n in (left, right))
    left, right = left / (height_a * length), right / (height_b * length)
    sine = np.einsum("ij,ij->i", along, np.cross(right, left))
    angle = np.arctan2(sine, np.einsum("ij,ij->i", left, right))
    by_a, by_b = left / height_a, right / height_b
    at_a, at_b = (np.einsum("ij,ij->i", p - u, along)[:, None] / length for p in (a, b))
    by_u, by_v = -(1.0 - at_a) * by_a - (1.0 - at_b) * by_b, -at_a * by_a - at_b * by_b
    return angle, [(hinges.vertices[:, k], by) for k, by in enumerate((by_u, by_v, by_a, by_b))]


def _fit(x: np.ndarray, c: _Constraints, hinges: _Hinges, part: float) -> np.ndarray:
    """Vertices that best fit a fraction of the fold angles, by the Levenberg-Marquardt method."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    def residual(at: np.ndarray) -> np.ndarray:
        off = np.angle(np.exp(1j * (_angles(at, hinges)[0] - part * hinges.targets)))
        return np.concatenate([_WEIGHT * _errors(at, c), hinges.weights * off])

    damping, now = 1e-6, residual(x)
    for _ in range(_ITERATIONS):
        _, blocks = _angles(x, hinges)
        weighted = [(vertices, hinges.weights[:, None] * by) for vertices, by in blocks]
        slopes = sparse.vstack([_WEIGHT * _slopes(x, c), _stacked(len(x), [(0, weighted)], len(hinges.weights))]).tocsr()
        square, right = (slopes.T @ slopes).tocsc(), slopes.T @ now
        scale = float(np.median(square.diagonal()))
        step = -splu(square + damping * scale * sparse.identity(square.shape[0], format="csc")).solve(right)
        moved = x + step.reshape(-1, 3)
        then = residual(moved)
        if then @ then < now @ now:
            small = now @ now - then @ then < 1e-10 * (now @ now)
            x, now, damping = moved, then, max(0.1 * damping, 1e-12)
            if small:
                break
        else:
            damping *= 10.0
            if damping > 1e3:
                break
    return x


def _project(x: np.ndarray, c: _Constraints) -> np.ndarray:
    """Nearest vertices with rigid facets, by Gauss-Newton steps of minimum norm."""
    from scipy.sparse.linalg import lsmr

    best, least = x, math.inf
    for _ in range(_ITERATIONS):
        errors = _errors(x, c)
        now = float(np.abs(errors).max())
        if now < least:
            best, least = x, now
        if now <= 0.01 * _RIGID or not math.isfinite(now):
            break
        x = x - lsmr(_slopes(x, c), errors, atol=1e-14, btol=1e-14, maxiter=20 * x.size)[0].reshape(-1, 3)
    return best


def _in_place(pattern: Pattern, x: np.ndarray) -> np.ndarray:
    """Vertices after a rigid-body motion that returns the first facet to its initial position."""
    one = replace(pattern, vertices=x, faces=pattern.faces[:1])
    before, after = facet_frames(replace(pattern, faces=pattern.faces[:1])), facet_frames(one)
    # the signs of principal axes are arbitrary; the first corners of both facets determine them
    corners = list(pattern.faces[0][:2])
    old = _corner_axes(pattern.vertices[corners], before.axes[0][:, 2])
    new = _corner_axes(x[corners], after.axes[0][:, 2])
    return np.asarray(pattern.vertices[corners[0]] + (x - x[corners[0]]) @ (old @ new.T).T)


def _corner_axes(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    along = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    return np.column_stack([along, np.cross(normal, along), normal])
