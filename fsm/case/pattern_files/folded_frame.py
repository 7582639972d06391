"""Patterns of folded frames of files of the FOLD format."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fsm.case.pattern_files.fold_frames import Edge, edges_of, faces_of, scale_of, short, size_of, vertices_of
from fsm.case.pattern_files.mending import last_digit
from fsm.case.pattern_files.pattern import ASSIGNMENTS, RANK, TOLERANCE, Pattern, PatternFault, Reading, counted
from fsm.case.pattern_files.planar import check_size
from fsm.text.shown_units import shown

FLAT = 1e-6
"""Height relative to the size below which a pattern is flat."""
_PLANE = 1e-4
"""Height relative to the size up to which a facet is planar, for files whose digits do not need more."""
_MOST_CORNERS = 1_000
"""Largest number of corners of a face of a folded frame."""
NEAR = 1e-9
"""Distance relative to the size below which two vertices of a folded frame coincide."""


def folded_pattern(frame: Mapping[str, Any], scale: float | None, reading: Reading) -> Pattern:
    """Pattern of a folded frame, which is the initial state of the sheet."""
    points = vertices_of(frame)
    if not frame.get("faces_vertices"):
        raise ValueError("has a folded frame without faces_vertices; give the vertices of each face")
    size, length = size_of(points), scale_of(frame, scale)
    check_size(size * length)
    listed = edges_of(frame, points * length)
    ends = points[[edge[:2] for edge in listed]] * length
    try:
        edges, notes = _single(listed, points * length)
        every = _oriented(faces_of(frame, points * length))
        faces, points, edges, more = _of_sheet(every, points, edges, reading.part)
        pattern = Pattern.of_faces(points * length, faces)
        notes += [*more, *_check_planar(pattern, 5.0 * last_digit(points) * length, reading)]
        if _is_seen_from_behind(pattern, edges):
            pattern = Pattern.of_faces(pattern.vertices, [face[::-1] for face in pattern.faces])
        pattern = _with_letters(pattern, edges, NEAR * size * length)
    except PatternFault as fault:
        raise fault.among(ends, [edge[2] for edge in listed]) from None
    return replace(pattern, notes=tuple(notes))


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
            text = f"has face {number} with the vertices {short(list(face))}, whose sides cross"
            raise PatternFault(f"{text}; list them around the face", middle)
        if not normal.any():
            text = f"has face {number} with the vertices {short(list(face))}, whose area is zero"
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
    if most <= FLAT * size:
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
