"""Frames of files of the FOLD format, versions 1.0 to 1.2 (Demaine, Ku and Lang, 2016)."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from fsm.case.pattern_files.pattern import ASSIGNMENTS, PatternFault, others, unit_targets

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "pt": 0.0254 / 72.0}
"""Lengths of `frame_unit`, m; "unit" has no length."""
_MOST_VERTICES = 40_000
_MOST_EDGES = 60_000
_MOST_FRAMES = 2_000
_KEYS = (
    "vertices_coords", "edges_vertices", "edges_assignment", "edges_foldAngle", "edges_foldAngles", "faces_vertices",
    "frame_classes", "frame_unit",
)  # fmt: skip
"""Keys of a frame that are read."""
Edge = tuple[int, int, str, float]
"""Both vertices, letter and fold angle (rad) of an edge."""


def parsed(text: str) -> dict[str, Any]:
    """Top level of a FOLD file of a version that is read."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"is not a FOLD file: {error}") from None
    if not isinstance(data, dict):
        raise ValueError("is not a FOLD file; the top level of a FOLD file is a JSON object")
    version = data.get("file_spec", 1)
    try:
        known = not isinstance(version, bool) and 1.0 <= float(version) < 2.0
    except (TypeError, ValueError):
        known = False
    if not known:
        raise ValueError(f"has file_spec {short(version)}; versions 1.0 to 1.9 are read")
    return data


def frames_of(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All frames with the keys that are read, their own ones and those that they inherit."""
    listed = data.get("file_frames") or []
    if not isinstance(listed, list) or not all(isinstance(frame, dict) for frame in listed):
        raise ValueError("has `file_frames` that is not a list; give a list of frames")
    if len(listed) >= _MOST_FRAMES:
        raise ValueError(f"has {len(listed):,} frames; at most {_MOST_FRAMES:,} are read")
    frames = [{key: data[key] for key in _KEYS if key in data}]
    for number, frame in enumerate(listed, 1):
        inherited: dict[str, Any] = {}
        if frame.get("frame_inherit"):
            parent = frame.get("frame_parent", 0)
            if type(parent) is not int or not 0 <= parent < number:
                text = f"has frame {number} with the parent {short(parent)}; give the number of an earlier frame"
                raise ValueError(text)
            inherited = frames[parent]
        frames.append(inherited | {key: frame[key] for key in _KEYS if key in frame})
    return frames


def classes(frame: Mapping[str, Any]) -> list[Any]:
    """Classes of a frame."""
    listed = frame.get("frame_classes") or []
    if not isinstance(listed, list):
        raise ValueError(f"has frame_classes {short(listed)}; give a list of texts")
    return listed


def vertices_of(frame: Mapping[str, Any]) -> np.ndarray:
    """Coordinates of the vertices, (n, 3), in units of the file."""
    rows = frame["vertices_coords"]
    if not isinstance(rows, list):
        raise ValueError("has vertices_coords that are not a list; give the coordinates of each vertex")
    if len(rows) > _MOST_VERTICES:
        raise ValueError(f"has {len(rows):,} vertices; at most {_MOST_VERTICES:,} are allowed")
    try:
        points = np.array([[*row, 0.0][:3] for row in rows if len(row) in (2, 3)], dtype=float)
        if len(points) == len(rows) and np.isfinite(points).all():
            return points
    except (TypeError, ValueError, OverflowError):
        pass
    bad = [_coordinates(row) is None for row in rows]
    first = bad.index(True)
    text = f"has vertices_coords that are not lists of two or three finite numbers: vertex {first} is {short(rows[first])}"
    points = np.array([_coordinates(row) or [math.nan] * 3 for row in rows])
    edges = _drawn(frame, np.zeros((len(points), 3)))[0]
    neighbours = [v for pair in edges if first in pair for v in pair if v != first]
    raise fault_of(text, frame, points * _unit(frame), neighbours)


def _coordinates(row: Any) -> list[float] | None:
    """Coordinates of a vertex; None if they are faulty."""
    try:
        found = [float(x) for x in row] if isinstance(row, list) and not any(isinstance(x, str) for x in row) else []
    except (TypeError, ValueError, OverflowError):
        return None
    return [*found, 0.0][:3] if len(found) in (2, 3) and all(map(math.isfinite, found)) else None


def fault_of(text: str, frame: Mapping[str, Any], points: np.ndarray, *listed: Any) -> PatternFault:
    """Fault at some edges or faces, which are given by their vertices, among the edges of their frame.

    Parameters
    ----------
    text : message
    frame : frame, whose other edges may be faulty too
    points : (n, 3) vertices, m; NaN for unknown ones
    listed : vertices of each edge or face, also faulty ones
    """
    known = [[v for v in one if _are_numbers([v], points)] if isinstance(one, list) else [] for one in listed]
    places = [points[own].mean(axis=0) for own in known if own]
    pairs, letters = _drawn(frame, points)
    return PatternFault(text, np.array(places).reshape(-1, 3)).among(
        points[np.array(pairs, dtype=np.int64).reshape(-1, 2)], letters
    )


def _drawn(frame: Mapping[str, Any], points: np.ndarray) -> tuple[list[list[int]], list[str]]:
    """Vertices and letters of the edges of a faulty frame that can be drawn."""
    pairs, letters = (frame.get(key) for key in ("edges_vertices", "edges_assignment"))
    pairs, letters = (listed if isinstance(listed, list) else [] for listed in (pairs, letters))
    rows = [k for k, pair in enumerate(pairs[:_MOST_EDGES]) if _are_numbers(pair, points) and len(pair) == 2]
    known = [str(letters[k]).upper() if k < len(letters) else "U" for k in rows]
    return [pairs[k] for k in rows], [letter if letter in ASSIGNMENTS else "U" for letter in known]


def with_edges(frame: Mapping[str, Any]) -> tuple[Mapping[str, Any], list[str]]:
    """Frame with edges, and a note if they are the sides of its faces."""
    if frame.get("edges_vertices") or not frame.get("faces_vertices"):
        return frame, []
    uses: Counter[tuple[int, int]] = Counter()
    for face in faces_of(frame, vertices_of(frame) * _unit(frame)):
        uses.update((min(pair), max(pair)) for pair in zip(face, [*face[1:], face[0]], strict=True))
    letters = ["B" if count == 1 else "U" for count in uses.values()]
    note = "the file has no edges_vertices; the common sides of its faces are unassigned creases"
    return {**frame, "edges_vertices": [list(pair) for pair in uses], "edges_assignment": letters}, [note]


def edges_of(frame: Mapping[str, Any], points: np.ndarray) -> list[Edge]:
    """Edges with letter and fold angle (rad) between vertices (n, 3), m."""
    pairs = frame.get("edges_vertices")
    if not pairs:
        raise ValueError("has no edges_vertices, so it has no creases; give pairs of vertex numbers")
    if not isinstance(pairs, list):
        raise ValueError("has edges_vertices that are not a list; give pairs of vertex numbers")
    if len(pairs) > _MOST_EDGES:
        raise ValueError(f"has {len(pairs):,} edges; at most {_MOST_EDGES:,} are allowed")
    letters = frame.get("edges_assignment") or ["U"] * len(pairs)
    angles = frame.get("edges_foldAngle") or frame.get("edges_foldAngles") or [None] * len(pairs)
    if not isinstance(letters, list) or not isinstance(angles, list):
        raise ValueError("has edges_assignment or edges_foldAngle that are not lists; give one entry for each edge")
    if len(letters) != len(pairs) or len(angles) != len(pairs):
        lists = f"{len(pairs)} edges, {len(letters)} assignments and {len(angles)} fold angles"
        text = f"has {lists}; these numbers must be equal"
        raise fault_of(text, frame, points, *pairs[min(len(letters), len(angles), len(pairs) - 1) :])
    found = []
    for number, (pair, letter, angle) in enumerate(zip(pairs, letters, angles, strict=True)):
        letter = str(letter).upper()
        text = f"has edge {number} with the"
        if letter not in ASSIGNMENTS:
            text = f"{text} assignment {short(letter)}; it must be one of {', '.join(ASSIGNMENTS)}"
            raise fault_of(text, frame, points, pair)
        if not _are_numbers(pair, points) or len(pair) != 2:
            text = f"{text} vertices {short(pair)}; they must be two numbers from 0 to {len(points) - 1}"
            raise fault_of(text, frame, points, pair)
        try:
            found.append((pair[0], pair[1], letter, _target(number, letter, angle)))
        except ValueError as error:
            raise fault_of(str(error), frame, points, pair) from None
    return found


def _are_numbers(listed: Any, points: np.ndarray) -> bool:
    """Whether a value is a list of numbers of vertices with known positions."""
    count = len(points)
    return isinstance(listed, list) and all(
        type(v) is int and 0 <= v < count and not math.isnan(points[v, 0]) for v in listed
    )


def _target(number: int, letter: str, angle: Any) -> float:
    """Fold angle of an edge in rad; an error if it contradicts the assignment."""
    if angle is None:
        return unit_targets(letter)
    if isinstance(angle, bool) or not isinstance(angle, int | float) or not -180.001 <= angle <= 180.001:
        raise ValueError(
            f"has edge {number} with the fold angle {short(angle)}; it must be a number from -180 to 180 (degrees)"
        )
    wrong = {"M": angle > 0.0, "V": angle < 0.0, "F": angle != 0.0}.get(letter, False)
    if wrong:
        rule = "mountains are negative, valleys positive and flat creases 0"
        raise ValueError(f"has edge {number}, a {ASSIGNMENTS[letter]}, with the fold angle {angle:g} deg; {rule}")
    return math.radians(angle) if letter not in "BC" else 0.0


def _unit(frame: Mapping[str, Any]) -> float:
    """Length of one unit in the picture of a fault, m."""
    unit = frame.get("frame_unit")
    return UNITS.get(unit, 1.0) if isinstance(unit, str) else 1.0


def scale_of(frame: Mapping[str, Any], scale: float | None) -> float:
    """Length of one unit of a frame, m; `scale` if it is given."""
    if scale is not None:
        return scale
    unit = frame.get("frame_unit", "unit")
    if not isinstance(unit, str) or unit not in UNITS:
        raise ValueError(f"has the frame_unit {short(unit)}, which has no length in m; give sheet.scale")
    return UNITS[unit]


def faces_of(frame: Mapping[str, Any], points: np.ndarray) -> list[list[int]]:
    """Faces of a frame with vertices (n, 3), m: lists of three or more different vertices."""
    faces = frame["faces_vertices"]
    if not isinstance(faces, list):
        raise ValueError("has faces_vertices that are not a list; give a list of vertex numbers for each face")
    bad = [
        k for k, face in enumerate(faces) if not _are_numbers(face, points) or len(face) < 3 or len(set(face)) < len(face)
    ]  # fmt: skip
    if bad:
        text = f"has face {bad[0]} with the vertices {short(faces[bad[0]])}{others(len(bad), 'face')}"
        raise fault_of(f"{text}; it needs three or more different vertices", frame, points, *(faces[k] for k in bad))
    return faces


def short(value: Any) -> str:
    """Value for a message, with at most 60 characters of it."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}..."


def size_of(points: np.ndarray) -> float:
    """Largest side of the box around points (n, 3)."""
    return float(np.ptp(points, axis=0).max())
