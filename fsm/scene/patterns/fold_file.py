"""Crease patterns from files of the FOLD format, versions 1.0 to 1.2 (Demaine, Ku and Lang, 2016)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fsm.scene.patterns.pattern import ASSIGNMENTS, Pattern
from fsm.scene.patterns.planar import Line, planar_pattern, unit_targets

__all__ = ["UNITS", "read_fold"]

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "pt": 0.0254 / 72.0}
"""Lengths of `frame_unit`, m; "unit" has no length."""
_FLAT = 1e-6
"""Height relative to the size below which a pattern is flat."""
_MOST_VERTICES = 40_000
_NEAR = 1e-9
"""Distance relative to the size below which two vertices of a FOLD file coincide."""


def read_fold(text: str, scale: float | None) -> Pattern:
    """Pattern of a FOLD file: its first folded frame in space, else its first flat frame.

    Parameters
    ----------
    text : content of the file
    scale : length of one unit, m; None: `frame_unit`

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
        raise ValueError("is not a FOLD file: it has no object at its top level")
    version = data.get("file_spec", 1)
    if not isinstance(version, int | float) or not 1.0 <= version < 2.0:
        raise ValueError(f"has file_spec {version!r}; versions 1.0 to 1.2 are supported")
    frames = [frame for frame in _frames(data) if frame.get("vertices_coords")]
    if not frames:
        raise ValueError("has no vertices_coords")
    folded = [frame for frame in frames if _is_folded(frame)]
    frame = (folded or frames)[0]
    return _folded(frame, scale) if folded else _flat(frame, scale)


def _frames(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All frames with the keys that they inherit."""
    listed = data.get("file_frames") or []
    if not isinstance(listed, list) or not all(isinstance(frame, dict) for frame in listed):
        raise ValueError("has `file_frames` that is not a list of frames")
    top = {key: value for key, value in data.items() if not key.startswith("file_")}
    frames: list[dict[str, Any]] = [top]
    for number, frame in enumerate(listed, 1):
        whole = dict(frame)
        if frame.get("frame_inherit"):
            parent = frame.get("frame_parent", 0)
            if not isinstance(parent, int) or not 0 <= parent < number:
                raise ValueError(f"has frame {number} with the parent {parent!r}; a parent is an earlier frame")
            whole = {**frames[parent], **frame}
        frames.append(whole)
    return frames


def _is_folded(frame: Mapping[str, Any]) -> bool:
    """Whether a frame is a folded state: its class, or vertices out of one plane."""
    classes = frame.get("frame_classes") or []
    points = _vertices(frame)
    heights = np.ptp(points, axis=0)[2] if len(points) else 0.0
    size = float(np.ptp(points, axis=0).max())
    return "foldedForm" in classes or heights > _FLAT * size


def _vertices(frame: Mapping[str, Any]) -> np.ndarray:
    rows = frame["vertices_coords"]
    try:
        points = np.array([[*row, 0.0, 0.0][:3] for row in rows], dtype=float)
    except (TypeError, ValueError):
        raise ValueError("has vertices_coords that are not lists of two or three numbers") from None
    if points.ndim != 2 or not np.isfinite(points).all() or any(len(row) not in (2, 3) for row in rows):
        raise ValueError("has vertices_coords that are not lists of two or three finite numbers")
    if len(points) > _MOST_VERTICES:
        raise ValueError(f"has {len(points):,} vertices; at most {_MOST_VERTICES:,} are allowed")
    return points


def _edges(frame: Mapping[str, Any], count: int) -> list[tuple[int, int, str, float]]:
    """Edges with letter and fold angle, rad."""
    pairs = frame.get("edges_vertices")
    if not pairs:
        raise ValueError("has no edges_vertices, so it has no creases")
    letters = frame.get("edges_assignment") or ["U"] * len(pairs)
    angles = frame.get("edges_foldAngle") or frame.get("edges_foldAngles") or [None] * len(pairs)
    if len(letters) != len(pairs) or len(angles) != len(pairs):
        lists = f"{len(pairs)} edges, {len(letters)} assignments and {len(angles)} fold angles"
        raise ValueError(f"has {lists}; these numbers must be equal")
    found = []
    for number, (pair, letter, angle) in enumerate(zip(pairs, letters, angles, strict=True)):
        letter = str(letter).upper()
        if letter not in ASSIGNMENTS:
            raise ValueError(f"has edge {number} with the assignment {letter!r}; it must be one of {', '.join(ASSIGNMENTS)}")
        if len(pair) != 2 or not all(isinstance(v, int) and 0 <= v < count for v in pair):
            raise ValueError(f"has edge {number} with the vertices {pair}; they must be two numbers from 0 to {count - 1}")
        found.append((pair[0], pair[1], letter, _target(number, letter, angle)))
    return found


def _target(number: int, letter: str, angle: Any) -> float:
    """Fold angle of an edge in rad; refused if it contradicts the assignment."""
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
    if unit not in UNITS:
        raise ValueError(f"has the frame_unit {unit!r}, which has no length in m; give sheet.scale")
    return UNITS[unit]


def _flat(frame: Mapping[str, Any], scale: float | None) -> Pattern:
    """Pattern of a flat frame; its faces follow from its edges."""
    points = _vertices(frame)
    lines = []
    for u, v, letter, target in _edges(frame, len(points)):
        lines.append(Line((points[u, 0], points[u, 1]), (points[v, 0], points[v, 1]), letter, target))
    pattern = planar_pattern(lines, _scale(frame, scale), split=False, tolerance=_NEAR)
    faces = frame.get("faces_vertices")
    if faces is not None and len(faces) != len(pattern.faces):
        text = f"has {len(faces)} faces_vertices, but its edges enclose {len(pattern.faces)} facets"
        raise ValueError(f"{text}; faces are missing or overlap")
    return pattern


def _folded(frame: Mapping[str, Any], scale: float | None) -> Pattern:
    """Pattern of a folded frame: the start of the sheet."""
    points = _vertices(frame)
    faces = frame.get("faces_vertices")
    if not faces:
        raise ValueError("has a folded frame without faces_vertices; give the vertices of each face")
    for number, face in enumerate(faces):
        if len(face) < 3 or len(set(face)) < len(face) or not all(isinstance(v, int) and 0 <= v < len(points) for v in face):
            raise ValueError(f"has face {number} with the vertices {face}; it needs three or more different vertices")
    size = float(np.ptp(points, axis=0).max())
    pattern = Pattern.of_faces(points * _scale(frame, scale), faces)
    _check_planar(pattern)
    edges = _edges(frame, len(points))
    if _is_seen_from_behind(pattern, edges):
        pattern = Pattern.of_faces(pattern.vertices, [face[::-1] for face in pattern.faces])
    letters, targets = list(pattern.assignment), pattern.target.copy()
    numbers = {frozenset(edge): k for k, edge in enumerate(pattern.edges.tolist())}
    for u, v, letter, target in edges:
        if float(np.linalg.norm(points[u] - points[v])) <= _NEAR * size:
            raise ValueError(f"has an edge of zero length between the vertices {u} and {v}; remove it")
        k = numbers.get(frozenset((u, v)))
        if k is None:
            raise ValueError(f"has the edge {u}, {v}, which is a side of no face")
        if letters[k] == "B":
            continue
        now = float(targets[k])
        if abs(abs(now) - math.pi) < 1e-3:  # closed: the sign follows from the assignment only
            now = math.copysign(now, target) if math.isfinite(target) and target else now
        elif letter in "MV" and abs(now) > 1e-3 and (now > 0.0) != (letter == "V"):
            text = f"a {ASSIGNMENTS[letter]} that is folded by {math.degrees(now):.4g} deg"
            raise ValueError(f"has the edge {u}, {v}, {text}; valleys are positive around the normals of faces_vertices")
        letters[k] = "C" if letter == "B" else letter
        targets[k] = now
    return pattern.assigned(letters, targets)


def _is_seen_from_behind(pattern: Pattern, edges: list[tuple[int, int, str, float]]) -> bool:
    """Whether all mountains and valleys contradict the normals of the faces, so that the faces have the other order."""
    angles = {frozenset(edge): float(angle) for edge, angle in zip(pattern.edges.tolist(), pattern.target, strict=True)}
    found = [(letter, angles.get(frozenset((u, v)), 0.0)) for u, v, letter, _ in edges if letter in "MV"]
    folded = [(angle > 0.0) == (letter == "V") for letter, angle in found if 1e-3 < abs(angle) < math.pi - 1e-3]
    return bool(folded) and not any(folded)


def _check_planar(pattern: Pattern) -> None:
    """Raise a ValueError if a face is not planar."""
    size = pattern.extent()
    for number, (face, normal) in enumerate(zip(pattern.faces, pattern.normals(), strict=True)):
        corners = pattern.vertices[list(face)]
        off = float(np.abs((corners - corners.mean(axis=0)) @ normal).max())
        if not normal.any():
            raise ValueError(f"has face {number} with the vertices {list(face)}, whose area is zero")
        if off > _FLAT * size:
            text = f"a vertex is {1e3 * off:.3g} mm off its plane; divide it into triangles"
            raise ValueError(f"has face {number}, which is not planar: {text}")
