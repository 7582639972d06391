"""Crease patterns from files of the FOLD format, versions 1.0 to 1.2 (Demaine, Ku and Lang, 2016)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fsm.scene.patterns.pattern import ASSIGNMENTS, Pattern
from fsm.scene.patterns.planar import RANK, TOLERANCE, Line, check_size, counted, last_digit, planar_pattern, unit_targets
from fsm.scene.patterns.reading import PatternFault, Reading
from fsm.shown_units import shown

__all__ = ["UNITS", "read_fold"]

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "pt": 0.0254 / 72.0}
"""Lengths of `frame_unit`, m; "unit" has no length."""
_FLAT = 1e-6
"""Height relative to the size below which a pattern is flat."""
_PLANE = 1e-4
"""Height relative to the size up to which a facet is planar, for files whose digits do not need more."""
_MOST_VERTICES = 40_000
_MOST_EDGES = 60_000
_MOST_FRAMES = 2_000
_MOST_CORNERS = 1_000
"""Largest number of corners of a face of a folded frame."""
_NEAR = 1e-9
"""Distance relative to the size below which two vertices of a folded frame coincide."""
_KEYS = (
    "vertices_coords", "edges_vertices", "edges_assignment", "edges_foldAngle", "edges_foldAngles", "faces_vertices",
    "frame_classes", "frame_unit",
)  # fmt: skip
"""Keys of a frame that are read."""


def read_fold(text: str, scale: float | None, number: int | None = None, reading: Reading | None = None) -> Pattern:
    """Pattern of a FOLD file: the first folded frame in space; without a folded frame, the first flat frame.

    Parameters
    ----------
    text : content of the file
    scale : length of one unit, m; None: `frame_unit`
    number : number of the frame, from 0; None: the first folded frame, else the first frame
    reading : choices of the section [sheet]

    Raises
    ------
    ValueError
        The file is not FOLD, or the pattern is faulty.
    """
    reading = Reading() if reading is None else reading
    data = _parsed(text)
    frames = _frames(data)
    if number is not None:
        if number >= len(frames) or not frames[number].get("vertices_coords"):
            raise ValueError(f"has no frame {number} with vertices_coords; its frames are 0 to {len(frames) - 1}")
        frame = frames[number]
        return _folded(frame, scale, reading) if _is_folded(frame) else _flat(frame, scale, reading)
    listed = [k for k in range(len(frames)) if frames[k].get("vertices_coords")]
    if not listed:
        raise ValueError("has no vertices_coords; give the coordinates of the vertices")
    known: dict[int, bool] = {}  # by the list of vertices, which frames inherit

    def is_folded(k: int) -> bool:
        frame = frames[k]
        rows = id(frame["vertices_coords"])
        if rows not in known:
            known[rows] = _is_raised(frame)
        return known[rows] or "foldedForm" in _classes(frame)

    chosen = next((k for k in listed if is_folded(k)), None)
    frame = frames[listed[0] if chosen is None else chosen]
    pattern = _flat(frame, scale, reading) if chosen is None else _folded(frame, scale, reading)
    if len(listed) == 1:
        return pattern
    note = f"frame {listed[0] if chosen is None else chosen} of {len(frames)} is the start; sheet.frame selects another"
    return replace(pattern, notes=(note, *pattern.notes))


def _parsed(text: str) -> dict[str, Any]:
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
        raise ValueError(f"has file_spec {_short(version)}; versions 1.0 to 1.9 are read")
    return data


def _short(value: Any) -> str:
    """Value for a message, with at most 60 characters of it."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}..."


def _frames(data: Mapping[str, Any]) -> list[dict[str, Any]]:
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
                text = f"has frame {number} with the parent {_short(parent)}; give the number of an earlier frame"
                raise ValueError(text)
            inherited = frames[parent]
        frames.append(inherited | {key: frame[key] for key in _KEYS if key in frame})
    return frames


def _is_folded(frame: Mapping[str, Any]) -> bool:
    """Whether a frame is a folded state, according to its class or because its vertices do not lie in one plane."""
    return "foldedForm" in _classes(frame) or _is_raised(frame)


def _classes(frame: Mapping[str, Any]) -> list[Any]:
    classes = frame.get("frame_classes") or []
    if not isinstance(classes, list):
        raise ValueError(f"has frame_classes {_short(classes)}; give a list of texts")
    return classes


def _is_raised(frame: Mapping[str, Any]) -> bool:
    """Whether the vertices of a frame do not lie in one plane normal to z."""
    sides = np.ptp(_vertices(frame), axis=0)
    return bool(sides[2] > _FLAT * sides.max())


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
    if len(pairs) > _MOST_EDGES:
        raise ValueError(f"has {len(pairs):,} edges; at most {_MOST_EDGES:,} are allowed")
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
            raise ValueError(
                f"has edge {number} with the assignment {_short(letter)}; it must be one of {', '.join(ASSIGNMENTS)}"
            )
        if not _are_numbers(pair, count) or len(pair) != 2:
            raise ValueError(
                f"has edge {number} with the vertices {_short(pair)}; they must be two numbers from 0 to {count - 1}"
            )
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
        raise ValueError(
            f"has edge {number} with the fold angle {_short(angle)}; it must be a number from -180 to 180 (degrees)"
        )
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
        raise ValueError(f"has the frame_unit {_short(unit)}, which has no length in m; give sheet.scale")
    return UNITS[unit]


def _flat(frame: Mapping[str, Any], scale: float | None, reading: Reading) -> Pattern:
    """Pattern of a flat frame; its faces follow from its edges."""
    points, length = _vertices(frame), _scale(frame, scale)
    edges = _edges(frame, len(points))
    faces = None if frame.get("faces_vertices") is None else _faces(frame, len(points))
    ends = points[:, :2].tolist()
    lines = [Line(tuple(ends[u]), tuple(ends[v]), letter, target) for u, v, letter, target in edges]
    try:
        pattern = planar_pattern(lines, length, split=False, reading=reading)
    except PatternFault as fault:
        if faces or not str(fault).startswith("edges cross"):
            raise
        pattern = planar_pattern(
            lines, length, reading=replace(reading, merge=reading.merge or _NEAR * length * _size(points))
        )
        note = "edges cross where the file has no vertex; vertices are added there"
        pattern = replace(pattern, notes=(note, *pattern.notes))
    flat = points[:, :2] * length
    if reading.part is None:
        _check_edges(pattern, lines, length)
        if faces is not None:
            _check_faces(pattern, faces, flat)
    return _in_order(pattern, flat, [edge[:2] for edge in edges], faces)


def _size(points: np.ndarray) -> float:
    return float(np.ptp(points, axis=0).max())


def _in_order(pattern: Pattern, points: np.ndarray, edges: list[tuple[int, int]], faces: list[list[int]] | None) -> Pattern:
    """Pattern with its vertices, edges and faces in the order of the file."""
    from scipy.spatial import KDTree

    assert pattern.flat is not None
    apart, nearest = KDTree(pattern.flat).query(points)
    # vertex of the pattern for each vertex of the file; -1 for vertices without facets
    listed = np.where(apart <= TOLERANCE * pattern.extent(), nearest, -1).tolist()
    before = [v for v in dict.fromkeys((*listed, *range(len(pattern.vertices)))) if v >= 0]
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
    """Raise a PatternFault if a line that is not flat is a side of no facet."""
    from scipy.spatial import KDTree

    assert pattern.flat is not None
    near = TOLERANCE * pattern.extent()
    used = KDTree(pattern.flat[np.unique(pattern.edges)])
    ends = scale * np.array([(line.first, line.last) for line in lines])
    bad = [k for k in np.flatnonzero(used.query(ends)[0].max(axis=1) > near).tolist() if lines[k].letter not in "FJ"]
    if bad:
        line = lines[bad[0]]
        where = f"from ({line.first[0]:g}, {line.first[1]:g}) to ({line.last[0]:g}, {line.last[1]:g})"
        more = f" ({counted(len(bad) - 1, 'other line', 'other lines')} too)" if len(bad) > 1 else ""
        text = f"the line {where} is a side of no facet{more}; complete the boundary, or remove the line"
        raise PatternFault(text, ends[bad].mean(axis=1)).among(ends, [line.letter for line in lines])


def _check_faces(pattern: Pattern, faces: list[list[int]], points: np.ndarray) -> None:
    """Raise a ValueError if listed faces are not the facets that the edges enclose."""
    from scipy.spatial import KDTree

    if any("added between the outline" in note for note in pattern.notes):
        return  # FOLD cannot list a face with a hole
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
            raise ValueError(f"has face {number} with the vertices {_short(face)}, {text}")
        if own in seen:
            raise ValueError(f"has face {number} with the vertices {_short(face)} twice; faces are missing or overlap")
        seen.add(own)


def _faces(frame: Mapping[str, Any], count: int) -> list[list[int]]:
    """Faces of a frame: lists of three or more different vertices."""
    faces = frame["faces_vertices"]
    if not isinstance(faces, list):
        raise ValueError("has faces_vertices that are not a list; give a list of vertex numbers for each face")
    for number, face in enumerate(faces):
        if not _are_numbers(face, count) or len(face) < 3 or len(set(face)) < len(face):
            raise ValueError(
                f"has face {number} with the vertices {_short(face)}; it needs three or more different vertices"
            )
    return faces


def _folded(frame: Mapping[str, Any], scale: float | None, reading: Reading) -> Pattern:
    """Pattern of a folded frame, which is the initial state of the sheet."""
    points = _vertices(frame)
    if not frame.get("faces_vertices"):
        raise ValueError("has a folded frame without faces_vertices; give the vertices of each face")
    size, length = _size(points), _scale(frame, scale)
    check_size(size * length)
    listed = _edges(frame, len(points))
    ends = points[[edge[:2] for edge in listed]] * length
    try:
        edges, notes = _single(listed, points * length)
        faces, points, edges, more = _of_sheet(_oriented(_faces(frame, len(points))), points, edges, reading.part)
        pattern = Pattern.of_faces(points * length, faces)
        notes += [*more, *_check_planar(pattern, 5.0 * last_digit(points) * length, reading)]
        if _is_seen_from_behind(pattern, edges):
            pattern = Pattern.of_faces(pattern.vertices, [face[::-1] for face in pattern.faces])
        pattern = _with_letters(pattern, edges, _NEAR * size * length)
    except PatternFault as fault:
        raise fault.among(ends, [edge[2] for edge in listed]) from None
    return replace(pattern, notes=tuple(notes))


Edge = tuple[int, int, str, float]
"""Both vertices, letter and fold angle (rad) of an edge."""


def _with_letters(pattern: Pattern, edges: list[Edge], near: float) -> Pattern:
    """Folded pattern with the assignments of its file; its fold angles are those of its vertices."""
    letters, targets = list(pattern.assignment), pattern.target.copy()
    numbers = {frozenset(edge): k for k, edge in enumerate(pattern.edges.tolist())}
    for u, v, letter, target in edges:
        ends = pattern.vertices[[u, v]]
        if float(np.linalg.norm(ends[1] - ends[0])) <= near:
            raise PatternFault(f"has an edge of zero length between the vertices {u} and {v}; remove it", ends[:1])
        k = numbers.get(frozenset((u, v)))
        if k is None:
            text = f"has the edge {u}, {v}, which is a side of no face; remove the edge or add the face"
            raise PatternFault(text, ends.mean(axis=0, keepdims=True))
        if letters[k] == "B":
            continue
        now = float(targets[k])
        if abs(abs(now) - math.pi) < 1e-3:  # a closed crease has an ambiguous sign, so the sign comes from the assignment
            now = math.copysign(now, target) if math.isfinite(target) and target else now
        elif letter in "MV" and abs(now) > 1e-3 and (now > 0.0) != (letter == "V"):
            text = f"a {ASSIGNMENTS[letter]} that is folded by {math.degrees(now):.4g} deg"
            text = f"has the edge {u}, {v}, {text}; valleys are positive around the normals of faces_vertices"
            raise PatternFault(text, ends.mean(axis=0, keepdims=True))
        letters[k] = "C" if letter == "B" else letter
        targets[k] = now
    return pattern.assigned(letters, targets)


def _single(edges: list[Edge], points: np.ndarray) -> tuple[list[Edge], list[str]]:
    """Edges without repeated ones, and notes on those with two letters; the first letter of `RANK` is used."""
    found: dict[frozenset[int], Edge] = {}
    notes = []
    for edge in edges:
        pair = frozenset(edge[:2])
        old = found.setdefault(pair, edge)
        if {old[2], edge[2]} == {"M", "V"}:
            text = f"has the edge {edge[0]}, {edge[1]} as a mountain and as a valley; remove one of them"
            raise PatternFault(text, points[list(pair)].mean(axis=0, keepdims=True))
        if old[2] != edge[2]:
            used, other = sorted((old, edge), key=lambda e: RANK.index(e[2]))
            found[pair] = used
            names = ASSIGNMENTS[used[2]], ASSIGNMENTS[other[2]]
            notes.append(f"edge {edge[0]}, {edge[1]} is given twice, as {names[0]} and as {names[1]}; {names[0]} is used")
    return list(found.values()), notes[:20]


def _oriented(faces: list[list[int]]) -> list[list[int]]:
    """Faces with orders that agree at their common edges with that of the first face, if there are such orders."""
    owners: dict[tuple[int, int], list[tuple[int, bool]]] = {}
    for number, face in enumerate(faces):
        for u, v in zip(face, [*face[1:], face[0]], strict=True):
            owners.setdefault((min(u, v), max(u, v)), []).append((number, u < v))
    beside: dict[int, list[tuple[int, bool]]] = {}
    for both in owners.values():
        if len(both) == 2:
            (one, way), (other, way_of_other) = both
            beside.setdefault(one, []).append((other, way == way_of_other))
            beside.setdefault(other, []).append((one, way == way_of_other))
    turned: dict[int, bool] = {}
    for first in range(len(faces)):
        turned.setdefault(first, False)
        waiting = [first]
        while waiting:
            number = waiting.pop()
            for other, opposite in beside.pop(number, []):
                if other not in turned:
                    turned[other] = turned[number] != opposite
                    waiting.append(other)
    return [face[::-1] if turned[number] else face for number, face in enumerate(faces)]


def _of_sheet(
    faces: list[list[int]], points: np.ndarray, edges: list[Edge], part: int | None
) -> tuple[list[list[int]], np.ndarray, list[Edge], list[str]]:
    """Faces, vertices and edges of the sheet, without flat lines that are sides of no face, and notes."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    notes = []
    sides = {frozenset(pair) for face in faces for pair in zip(face, [*face[1:], face[0]], strict=True)}
    kept = [edge for edge in edges if edge[2] not in "FJ" or frozenset(edge[:2]) in sides]
    if len(kept) < len(edges):
        count = counted(len(edges) - len(kept), "flat crease or bend line", "flat creases and bend lines")
        notes.append(f"{count} bound no facet and are ignored")
    cut = {frozenset(edge[:2]) for edge in edges if edge[2] in "BC"}
    owners: dict[frozenset[int], list[int]] = {}
    for number, face in enumerate(faces):
        for pair in zip(face, [*face[1:], face[0]], strict=True):
            owners.setdefault(frozenset(pair), []).append(number)
    joined = [(own[0], other) for pair, own in owners.items() if pair not in cut for other in own[1:]]
    joints = np.array(joined, dtype=np.int64).reshape(-1, 2)
    graph = coo_matrix((np.ones(len(joints)), joints.T), shape=(len(faces),) * 2)
    count, label = connected_components(graph, directed=False)
    if count > 1 or (part or 1) > 1:
        order = sorted(range(count), key=lambda k: (-int((label == k).sum()), int(np.argmax(label == k))))
        groups = [np.flatnonzero(label == k).tolist() for k in order[:50]]
        if part is None or part > count:
            middles = [points[np.unique(np.concatenate([faces[f] for f in group]))].mean(axis=0) for group in groups]
            listed = ", ".join(f"{k} with {counted(len(g), 'face', 'faces')}" for k, g in enumerate(groups[:4], 1))
            more = f" and {count - 4} more" if count > 4 else ""
            text = f"has {counted(count, 'part', 'separate parts')}, which no creases join: {listed}{more}"
            text = f"{text}; choose one by its number, for example sheet.part = 1"
            raise PatternFault(text, np.array(middles), [str(k + 1) for k in range(len(middles))])
        faces = [faces[f] for f in np.flatnonzero(label == order[part - 1]).tolist()]
        notes.append(f"part {part} of {count} is the sheet (sheet.part)")
    used = np.unique(np.concatenate(faces))
    of_sheet = set(used.tolist())
    if count == 1:
        loose = {v for edge in edges if edge not in kept for v in edge[:2]}
        unused = [v for v in range(len(points)) if v not in of_sheet and v not in loose]
        if unused:
            raise PatternFault(f"has the vertex {unused[0]}, which is in no face; remove it", points[unused])
    else:
        kept = [edge for edge in kept if edge[0] in of_sheet and edge[1] in of_sheet]
    place = {int(v): k for k, v in enumerate(used)}
    faces = [[place[v] for v in face] for face in faces]
    return faces, points[used], [(place.get(u, -1), place.get(v, -1), a, t) for u, v, a, t in kept], notes


def _is_seen_from_behind(pattern: Pattern, edges: list[tuple[int, int, str, float]]) -> bool:
    """Whether all mountains and valleys contradict the normals of the faces, so that the order of the faces must be
    reversed.
    """
    angles = {frozenset(edge): float(angle) for edge, angle in zip(pattern.edges.tolist(), pattern.target, strict=True)}
    found = [(letter, angles.get(frozenset((u, v)), 0.0)) for u, v, letter, _ in edges if letter in "MV"]
    folded = [(angle > 0.0) == (letter == "V") for letter, angle in found if 1e-3 < abs(angle) < math.pi - 1e-3]
    return bool(folded) and not any(folded)


def _check_planar(pattern: Pattern, rounding: float, reading: Reading) -> list[str]:
    """Note on the largest height of a vertex off the plane of its face; a PatternFault if faces are not planar."""
    size, most = pattern.extent(), 0.0
    limit = min(max(rounding, _PLANE * size), TOLERANCE * size) if reading.merge is None else reading.merge
    bad = []
    for number, (face, normal) in enumerate(zip(pattern.faces, pattern.normals(), strict=True)):
        corners = pattern.vertices[list(face)]
        middle = corners.mean(axis=0, keepdims=True)
        if len(face) > _MOST_CORNERS:
            text = f"has face {number} with {len(face):,} corners; at most {_MOST_CORNERS:,} are allowed, so divide it"
            raise PatternFault(text, middle)
        if _sides_cross(corners):
            text = f"has face {number} with the vertices {_short(list(face))}, whose sides cross"
            raise PatternFault(f"{text}; list them around the face", middle)
        if not normal.any():
            text = f"has face {number} with the vertices {_short(list(face))}, whose area is zero"
            raise PatternFault(f"{text}; move its vertices or remove the face", middle)
        off = float(np.abs((corners - middle) @ normal).max())
        most = max(most, off)
        if off > limit and len(face) > 3 and not reading.divided:
            bad.append((number, off, middle[0]))
    if bad:
        number, off, _ = bad[0]
        more = f" ({counted(len(bad) - 1, 'other face', 'other faces')} too)" if len(bad) > 1 else ""
        text = f"has face {number}, which is not planar{more}: a vertex is {shown(off, 'm')} off its plane"
        text = f'{text}; divide it into triangles, give facets = "bend-lines", or sheet.merge = "{1e3 * off:.2g} mm" or more'
        raise PatternFault(text, [middle for _, _, middle in bad])
    if most <= _FLAT * size:
        return []
    text = "they are divided into triangles" if reading.divided else f"the limit is sheet.merge = {shown(limit, 'm')}"
    return [f"vertices are up to {shown(most, 'm')} off the planes of their facets; {text}"]


def _sides_cross(corners: np.ndarray) -> bool:
    """Whether two sides of a polygon (k, 3) cross in the projection with the largest area."""
    count = len(corners)
    if count < 4:
        return False
    apart = corners - corners.mean(axis=0)
    _, _, axes = np.linalg.svd(apart, full_matrices=False)
    flat = apart @ axes[:2].T

    after = np.roll(flat, -1, axis=0)
    x, y = (after - flat).T
    for i in range(count - 2):
        others = slice(i + 2, count if i else count - 1)
        a, c, d = flat[i], flat[others], after[others]
        off_c, off_d = (x[i] * (p[:, 1] - a[1]) - y[i] * (p[:, 0] - a[0]) for p in (c, d))
        off_a, off_b = (x[others] * (p[1] - c[:, 1]) - y[others] * (p[0] - c[:, 0]) for p in (a, after[i]))
        if np.any((off_c * off_d < 0.0) & (off_a * off_b < 0.0)):
            return True
    return False
