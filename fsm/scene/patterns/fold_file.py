"""Crease patterns from files of the FOLD format, versions 1.0 to 1.2 (Demaine, Ku and Lang, 2016)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fsm.scene.patterns.pattern import ASSIGNMENTS, Pattern
from fsm.scene.patterns.planar import Line, check_size, planar_pattern, unit_targets

__all__ = ["UNITS", "read_fold"]

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "pt": 0.0254 / 72.0}
"""Lengths of `frame_unit`, m; "unit" has no length."""
_FLAT = 1e-6
"""Height relative to the size below which a pattern is flat."""
_MOST_VERTICES = 40_000
_NEAR = 1e-9
"""Distance relative to the size below which two vertices of a FOLD file coincide."""


def read_fold(text: str, scale: float | None, number: int | None = None) -> Pattern:
    """Pattern of a FOLD file: the first folded frame in space; without a folded frame, the first flat frame.

    Parameters
    ----------
    text : content of the file
    scale : length of one unit, m; None: `frame_unit`
    number : number of the frame, from 0; None: the first folded frame, else the first frame

    Raises
    ------
    ValueError
        The file is not FOLD, or the pattern is faulty.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"is not a FOLD file: {error}") from None
    if not isinstance(data, dict):
        raise ValueError("is not a FOLD file; the top level of a FOLD file is a JSON object")
    version = data.get("file_spec", 1)
    if not isinstance(version, int | float) or not 1.0 <= version < 2.0:
        raise ValueError(f"has file_spec {version!r}; versions 1.0 to 1.9 are read")
    listed = _frames(data)
    frames = [frame for frame in listed if frame.get("vertices_coords")]
    if not frames:
        raise ValueError("has no vertices_coords; give the coordinates of the vertices")
    if number is not None:
        if number >= len(listed) or not listed[number].get("vertices_coords"):
            raise ValueError(f"has no frame {number} with vertices_coords; its frames are 0 to {len(listed) - 1}")
        frames = [listed[number]]
    folded = [frame for frame in frames if _is_folded(frame)]
    frame = (folded or frames)[0]
    return _folded(frame, scale) if folded else _flat(frame, scale)


def _frames(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All frames with the keys that they inherit."""
    listed = data.get("file_frames") or []
    if not isinstance(listed, list) or not all(isinstance(frame, dict) for frame in listed):
        raise ValueError("has `file_frames` that is not a list; give a list of frames")
    top = {key: value for key, value in data.items() if not key.startswith("file_")}
    frames: list[dict[str, Any]] = [top]
    for number, frame in enumerate(listed, 1):
        whole = dict(frame)
        if frame.get("frame_inherit"):
            parent = frame.get("frame_parent", 0)
            if type(parent) is not int or not 0 <= parent < number:
                raise ValueError(f"has frame {number} with the parent {parent!r}; give the number of an earlier frame")
            whole = {**frames[parent], **frame}
        frames.append(whole)
    return frames


def _is_folded(frame: Mapping[str, Any]) -> bool:
    """Whether a frame is a folded state, according to its class or because its vertices do not lie in one plane."""
    classes = frame.get("frame_classes") or []
    if not isinstance(classes, list):
        raise ValueError(f"has frame_classes {classes!r}; give a list of texts")
    points = _vertices(frame)
    sides = np.ptp(points, axis=0)
    return "foldedForm" in classes or bool(sides[2] > _FLAT * sides.max())


def _vertices(frame: Mapping[str, Any]) -> np.ndarray:
    rows = frame["vertices_coords"]
    try:
        points = np.array([[*row, 0.0, 0.0][:3] for row in rows], dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError("has vertices_coords that are not lists of two or three finite numbers") from None
    if points.ndim != 2 or not np.isfinite(points).all() or any(len(row) not in (2, 3) for row in rows):
        raise ValueError("has vertices_coords that are not lists of two or three finite numbers")
    if len(points) > _MOST_VERTICES:
        raise ValueError(f"has {len(points):,} vertices; at most {_MOST_VERTICES:,} are allowed")
    return points


def _edges(frame: Mapping[str, Any], count: int) -> list[tuple[int, int, str, float]]:
    """Edges with letter and fold angle, rad."""
    pairs = frame.get("edges_vertices")
    if not pairs:
        raise ValueError("has no edges_vertices, so it has no creases; give pairs of vertex numbers")
    if not isinstance(pairs, list):
        raise ValueError("has edges_vertices that are not a list; give pairs of vertex numbers")
    letters = frame.get("edges_assignment") or ["U"] * len(pairs)
    angles = frame.get("edges_foldAngle") or frame.get("edges_foldAngles") or [None] * len(pairs)
    if not isinstance(letters, list) or not isinstance(angles, list):
        raise ValueError("has edges_assignment or edges_foldAngle that are not lists; give one entry for each edge")
    if len(letters) != len(pairs) or len(angles) != len(pairs):
        lists = f"{len(pairs)} edges, {len(letters)} assignments and {len(angles)} fold angles"
        raise ValueError(f"has {lists}; these numbers must be equal")
    found = []
    for number, (pair, letter, angle) in enumerate(zip(pairs, letters, angles, strict=True)):
        letter = str(letter).upper()
        if letter not in ASSIGNMENTS:
            raise ValueError(f"has edge {number} with the assignment {letter!r}; it must be one of {', '.join(ASSIGNMENTS)}")
        if not _are_numbers(pair, count) or len(pair) != 2:
            raise ValueError(f"has edge {number} with the vertices {pair}; they must be two numbers from 0 to {count - 1}")
        found.append((pair[0], pair[1], letter, _target(number, letter, angle)))
    return found


def _are_numbers(listed: Any, count: int) -> bool:
    """Whether a value is a list of numbers of vertices."""
    return isinstance(listed, list) and all(type(v) is int and 0 <= v < count for v in listed)


def _target(number: int, letter: str, angle: Any) -> float:
    """Fold angle of an edge in rad; an error if it contradicts the assignment."""
    if angle is None:
        return unit_targets(letter)
    if isinstance(angle, bool) or not isinstance(angle, int | float) or not -180.001 <= angle <= 180.001:
        raise ValueError(f"has edge {number} with the fold angle {angle!r}; it must be a number from -180 to 180 (degrees)")
    wrong = {"M": angle > 0.0, "V": angle < 0.0, "F": angle != 0.0}.get(letter, False)
    if wrong:
        rule = "mountains are negative, valleys positive and flat creases 0"
        raise ValueError(f"has edge {number}, a {ASSIGNMENTS[letter]}, with the fold angle {angle:g} deg; {rule}")
    return math.radians(angle) if letter not in "BC" else 0.0


def _scale(frame: Mapping[str, Any], scale: float | None) -> float:
    if scale is not None:
        return scale
    unit = frame.get("frame_unit", "unit")
    if not isinstance(unit, str) or unit not in UNITS:
        raise ValueError(f"has the frame_unit {unit!r}, which has no length in m; give sheet.scale")
    return UNITS[unit]


def _flat(frame: Mapping[str, Any], scale: float | None) -> Pattern:
    """Pattern of a flat frame; its faces follow from its edges."""
    points = _vertices(frame)
    lines = []
    for u, v, letter, target in _edges(frame, len(points)):
        lines.append(Line((points[u, 0], points[u, 1]), (points[v, 0], points[v, 1]), letter, target))
    pattern = planar_pattern(lines, _scale(frame, scale), split=False, tolerance=_NEAR)
    scale = _scale(frame, scale)
    _check_edges(pattern, lines, scale)
    faces = None if frame.get("faces_vertices") is None else _faces(frame, len(points))
    if faces is not None:
        _check_faces(pattern, faces, points[:, :2] * scale)
    return _in_order(pattern, points[:, :2] * scale, [line[:2] for line in _edges(frame, len(points))], faces)


def _in_order(pattern: Pattern, points: np.ndarray, edges: list[tuple[int, int]], faces: list[list[int]] | None) -> Pattern:
    """Pattern with its vertices, edges and faces in the order of the file."""
    from scipy.spatial import KDTree

    assert pattern.flat is not None
    listed = KDTree(pattern.flat).query(points)[1].tolist()  # vertex of the pattern for each vertex of the file
    before = list(dict.fromkeys(listed))
    number = {old: new for new, old in enumerate(before)}

    def place(pairs: list[frozenset[int]], wanted: list[frozenset[int]]) -> list[int]:
        rank = {pair: k for k, pair in reversed([*enumerate(wanted)])}
        return sorted(range(len(pairs)), key=lambda k: rank.get(pairs[k], len(wanted)))

    rows = place([frozenset(pair) for pair in pattern.edges.tolist()], [frozenset((listed[u], listed[v])) for u, v in edges])
    known = [frozenset(face) for face in pattern.faces]
    order = list(range(len(known))) if faces is None else place(known, [frozenset(listed[v] for v in f) for f in faces])
    renumbered = np.array([number[v] for v in range(len(pattern.vertices))])
    return replace(
        pattern, vertices=pattern.vertices[before], flat=pattern.flat[before], edges=renumbered[pattern.edges[rows]],
        assignment=tuple(pattern.assignment[k] for k in rows), target=pattern.target[rows],
        faces=tuple(tuple(number[v] for v in pattern.faces[k]) for k in order),
        groups={name: tuple(sorted(number[v] for v in group)) for name, group in pattern.groups.items()},
    )  # fmt: skip


def _check_edges(pattern: Pattern, lines: list[Line], scale: float) -> None:
    """Raise a ValueError if a line is a side of no facet."""
    from scipy.spatial import KDTree

    assert pattern.flat is not None
    near = 1e-6 * pattern.extent()
    used = KDTree(pattern.flat[np.unique(pattern.edges)])
    off = used.query(scale * np.array([(line.first, line.last) for line in lines]))[0].max(axis=1)
    for k in np.flatnonzero(off > near)[:1]:
        line = lines[k]
        ends = f"from ({line.first[0]:g}, {line.first[1]:g}) to ({line.last[0]:g}, {line.last[1]:g})"
        raise ValueError(f"the line {ends} is a side of no facet; complete the boundary, or remove the line")


def _check_faces(pattern: Pattern, faces: list[list[int]], points: np.ndarray) -> None:
    """Raise a ValueError if listed faces are not the facets that the edges enclose."""
    from scipy.spatial import KDTree

    if len(faces) != len(pattern.faces):
        text = f"has {len(faces)} faces_vertices, but its edges enclose {len(pattern.faces)} facets"
        raise ValueError(f"{text}; faces are missing or overlap")
    assert pattern.flat is not None
    known = {frozenset(face) for face in pattern.faces}
    seen: set[frozenset[int]] = set()
    nearest = KDTree(pattern.flat).query(points)[1].tolist()
    for number, face in enumerate(faces):
        own = frozenset(nearest[v] for v in face)
        if own not in known:
            text = "but its edges enclose no such facet; correct the face"
            raise ValueError(f"has face {number} with the vertices {face}, {text}")
        if own in seen:
            raise ValueError(f"has face {number} with the vertices {face} twice; faces are missing or overlap")
        seen.add(own)


def _faces(frame: Mapping[str, Any], count: int) -> list[list[int]]:
    """Faces of a frame: lists of three or more different vertices."""
    faces = frame["faces_vertices"]
    if not isinstance(faces, list):
        raise ValueError("has faces_vertices that are not a list; give a list of vertex numbers for each face")
    for number, face in enumerate(faces):
        if not _are_numbers(face, count) or len(face) < 3 or len(set(face)) < len(face):
            raise ValueError(f"has face {number} with the vertices {face}; it needs three or more different vertices")
    return faces


def _folded(frame: Mapping[str, Any], scale: float | None) -> Pattern:
    """Pattern of a folded frame, which is the initial state of the sheet."""
    points = _vertices(frame)
    if not frame.get("faces_vertices"):
        raise ValueError("has a folded frame without faces_vertices; give the vertices of each face")
    faces, edges = _faces(frame, len(points)), _edges(frame, len(points))
    size = float(np.ptp(points, axis=0).max())
    length = _scale(frame, scale)
    check_size(size * length)
    pattern = Pattern.of_faces(points * length, faces)
    _check_planar(pattern)
    if _is_seen_from_behind(pattern, edges):
        pattern = Pattern.of_faces(pattern.vertices, [face[::-1] for face in pattern.faces])
    letters, targets = list(pattern.assignment), pattern.target.copy()
    numbers = {frozenset(edge): k for k, edge in enumerate(pattern.edges.tolist())}
    for u, v, letter, target in edges:
        if float(np.linalg.norm(points[u] - points[v])) <= _NEAR * size:
            raise ValueError(f"has an edge of zero length between the vertices {u} and {v}; remove it")
        k = numbers.get(frozenset((u, v)))
        if k is None:
            raise ValueError(f"has the edge {u}, {v}, which is a side of no face; remove the edge or add the face")
        if letters[k] == "B":
            continue
        now = float(targets[k])
        if abs(abs(now) - math.pi) < 1e-3:  # a closed crease has an ambiguous sign, so the sign comes from the assignment
            now = math.copysign(now, target) if math.isfinite(target) and target else now
        elif letter in "MV" and abs(now) > 1e-3 and (now > 0.0) != (letter == "V"):
            text = f"a {ASSIGNMENTS[letter]} that is folded by {math.degrees(now):.4g} deg"
            raise ValueError(f"has the edge {u}, {v}, {text}; valleys are positive around the normals of faces_vertices")
        letters[k] = "C" if letter == "B" else letter
        targets[k] = now
    pattern = pattern.assigned(letters, targets)
    _check_joined(pattern)
    return pattern


def _check_joined(pattern: Pattern) -> None:
    """Raise a ValueError if a vertex has no face, or if creases do not join all faces."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    unused = np.setdiff1d(np.arange(len(pattern.vertices)), np.concatenate(pattern.faces))
    if len(unused):
        raise ValueError(f"has the vertex {unused[0]}, which is in no face; remove it")
    count = len(pattern.faces)
    one, other = pattern.edge_faces[pattern.creases].T
    parts, number = connected_components(coo_matrix((np.ones(len(one)), (one, other)), shape=(count, count)))
    if parts > 1:
        face = int(np.flatnonzero(number != number[0])[0])
        raise ValueError(f"has {parts} separate parts: no creases join the faces 0 and {face}; give one connected sheet")


def _is_seen_from_behind(pattern: Pattern, edges: list[tuple[int, int, str, float]]) -> bool:
    """Whether all mountains and valleys contradict the normals of the faces, so that the order of the faces must be
    reversed.
    """
    angles = {frozenset(edge): float(angle) for edge, angle in zip(pattern.edges.tolist(), pattern.target, strict=True)}
    found = [(letter, angles.get(frozenset((u, v)), 0.0)) for u, v, letter, _ in edges if letter in "MV"]
    folded = [(angle > 0.0) == (letter == "V") for letter, angle in found if 1e-3 < abs(angle) < math.pi - 1e-3]
    return bool(folded) and not any(folded)


def _check_planar(pattern: Pattern) -> None:
    """Raise a ValueError if a face is not planar."""
    size = pattern.extent()
    for number, (face, normal) in enumerate(zip(pattern.faces, pattern.normals(), strict=True)):
        corners = pattern.vertices[list(face)]
        if _sides_cross(corners):
            text = f"has face {number} with the vertices {list(face)}, whose sides cross"
            raise ValueError(f"{text}; list them around the face")
        off = float(np.abs((corners - corners.mean(axis=0)) @ normal).max())
        if not normal.any():
            raise ValueError(
                f"has face {number} with the vertices {list(face)}, whose area is zero; "
                "move its vertices or remove the face"
            )
        if off > _FLAT * size:
            text = f"a vertex is {1e3 * off:.3g} mm off its plane; divide it into triangles"
            raise ValueError(f"has face {number}, which is not planar: {text}")


def _sides_cross(corners: np.ndarray) -> bool:
    """Whether two sides of a polygon (k, 3) cross in the projection with the largest area."""
    count = len(corners)
    if count < 4:
        return False
    apart = corners - corners.mean(axis=0)
    _, _, axes = np.linalg.svd(apart, full_matrices=False)
    flat = apart @ axes[:2].T

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    for i in range(count):
        a, b = flat[i], flat[(i + 1) % count]
        for j in range(i + 2, count if i else count - 1):
            c, d = flat[j], flat[(j + 1) % count]
            if side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0:
                return True
    return False
