"""Crease patterns from files of the FOLD format, versions 1.0 to 1.2 (Demaine, Ku and Lang, 2016)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fsm.case.pattern_files import fold_frames
from fsm.case.pattern_files.folded_frame import FLAT, NEAR, folded_pattern
from fsm.case.pattern_files.pattern import TOLERANCE, Line, Pattern, PatternFault, Reading, others
from fsm.case.pattern_files.planar import planar_pattern


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
    data = fold_frames.parsed(text)
    frames = fold_frames.frames_of(data)
    if number is not None:
        if number >= len(frames) or not frames[number].get("vertices_coords"):
            raise ValueError(f"has no frame {number} with vertices_coords; its frames are 0 to {len(frames) - 1}")
        frame = frames[number]
        return _pattern(frame, _is_folded(frame), scale, reading)
    listed = [k for k in range(len(frames)) if frames[k].get("vertices_coords")]
    if not listed:
        raise ValueError("has no vertices_coords; give the coordinates of the vertices")
    known: dict[int, bool] = {}  # by the list of vertices, which frames inherit

    def is_folded(k: int) -> bool:
        frame = frames[k]
        rows = id(frame["vertices_coords"])
        if rows not in known:
            known[rows] = _is_raised(frame)
        return known[rows] or "foldedForm" in fold_frames.classes(frame)

    chosen = next((k for k in listed if is_folded(k)), None)
    start = listed[0] if chosen is None else chosen
    pattern = _pattern(frames[start], chosen is not None, scale, reading)
    if len(listed) == 1:
        return pattern
    note = f"frame {start} of {len(frames)} is the start; sheet.frame selects another"
    return replace(pattern, notes=(note, *pattern.notes))


def _pattern(frame: Mapping[str, Any], folded: bool, scale: float | None, reading: Reading) -> Pattern:
    """Pattern of a frame that is folded or flat."""
    frame, notes = fold_frames.with_edges(frame)
    try:
        pattern = (folded_pattern if folded else _flat)(frame, scale, reading)
    except PatternFault as fault:
        if not notes:
            raise
        text = f"has no edges_vertices, and the sides of its faces are no pattern: {fault}"
        raise PatternFault(text, fault.places, fault.labels).among(fault.lines, fault.letters) from None
    return replace(pattern, notes=(*notes, *pattern.notes))


def _is_folded(frame: Mapping[str, Any]) -> bool:
    """Whether a frame is a folded state, according to its class or because its vertices do not lie in one plane."""
    return "foldedForm" in fold_frames.classes(frame) or _is_raised(frame)


def _is_raised(frame: Mapping[str, Any]) -> bool:
    """Whether the vertices of a frame do not lie in one plane normal to z."""
    sides = np.ptp(fold_frames.vertices_of(frame), axis=0)
    return bool(sides[2] > FLAT * sides.max())


def _flat(frame: Mapping[str, Any], scale: float | None, reading: Reading) -> Pattern:
    """Pattern of a flat frame; its faces follow from its edges."""
    points, length = fold_frames.vertices_of(frame), fold_frames.scale_of(frame, scale)
    edges = fold_frames.edges_of(frame, points * length)
    faces = None if frame.get("faces_vertices") is None else fold_frames.faces_of(frame, points * length)
    ends = points[:, :2].tolist()
    lines = [Line(tuple(ends[u]), tuple(ends[v]), letter, target) for u, v, letter, target in edges]
    try:
        pattern = planar_pattern(lines, length, split=False, reading=reading)
    except PatternFault as fault:
        if faces or not str(fault).startswith("edges cross"):
            raise
        pattern = planar_pattern(
            lines, length, reading=replace(reading, merge=reading.merge or NEAR * length * fold_frames.size_of(points))
        )
        note = "edges cross where the file has no vertex; vertices are added there"
        pattern = replace(pattern, notes=(note, *pattern.notes))
    flat = points[:, :2] * length
    if reading.part is None:
        _check_edges(pattern, lines, length)
        if faces is not None:
            _check_faces(pattern, faces, flat)
    return _in_order(pattern, flat, [edge[:2] for edge in edges], faces)


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
        text = f"the line {where} is a side of no facet{others(len(bad), 'line')}; complete the boundary, or remove the line"
        raise PatternFault(text, ends[bad].mean(axis=1)).among(ends, [line.letter for line in lines])


def _check_faces(pattern: Pattern, faces: list[list[int]], points: np.ndarray) -> None:
    """Raise a PatternFault if listed faces are not the facets that the edges enclose."""
    from scipy.spatial import KDTree

    if any("added between the outline" in note for note in pattern.notes):
        return  # FOLD cannot list a face with a hole
    assert pattern.flat is not None
    nearest = KDTree(pattern.flat).query(points)[1].tolist()
    known = {frozenset(face): k for k, face in enumerate(pattern.faces)}
    missing = dict.fromkeys(range(len(pattern.faces)))
    bad = []
    for number, face in enumerate(faces):
        own = known.get(frozenset(nearest[v] for v in face))
        if own is None or own not in missing:
            bad.append((number, own is not None))
        missing.pop(-1 if own is None else own, None)
    if not bad and not missing:
        return
    if len(faces) != len(pattern.faces):
        text = f"has {len(faces)} faces_vertices, but its edges enclose {len(pattern.faces)} facets"
        text = f"{text}; faces are missing or overlap"
    else:
        (number, twice), more = bad[0], others(len(bad), "face")
        text = f"has face {number} with the vertices {fold_frames.short(faces[number])}"
        text = (
            f"{text} twice{more}; faces are missing or overlap" if twice
            else f"{text}, but its edges enclose no such facet{more}; correct the face"
        )  # fmt: skip
    middles = [pattern.flat[list(pattern.faces[k])].mean(axis=0) for k in missing]
    middles += [points[faces[number]].mean(axis=0) for number, _ in bad]
    raise PatternFault(text, np.array(middles)).among(pattern.flat[pattern.edges], pattern.assignment)
