"""FOLD file (version 1.2) of a folded sheet: its crease pattern, and its motion as frames."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from fsm.analyses.sheet_motion import sheet_of, vertices_of
from fsm.builders.patterns.of_sheet import mesh_as_pattern
from fsm.case.pattern_files.pattern import Pattern
from fsm.results.film import Floats
from fsm.results.solution import Solution
from fsm.views.exporters.registry import exporter


@exporter("fold", "FOLD: crease pattern of a sheet, and its motion as frames")
def write_fold(solution: Solution, path: Path) -> None:
    """Write the crease pattern as the first frame, and each record as a folded frame, in m and degrees.

    A pattern without a flat state, for example a tube, has its start as the first frame. Flexible facets are written
    as the triangles of their mesh, with bend lines between triangles of one facet. A cut has the vertices of both sides, and
    is two boundary edges.

    Raises
    ------
    CaseError
        The result is not that of a sheet, or its case is damaged.
    """
    case, pattern = sheet_of(solution)
    if case.sheet is not None and case.sheet.facets == "flexible":
        pattern = mesh_as_pattern(case.sheet)
    flat = pattern.flat
    names = [f"record {number}, {time:.6g} s" for number, time in enumerate(solution.time.tolist(), 1)]
    data: dict[str, Any] = {
        "file_spec": 1.2, "file_creator": "fsm", "file_title": case.title, "file_classes": ["animation"],
        "frame_title": "crease pattern" if flat is not None else "start",
        "frame_classes": ["creasePattern" if flat is not None else "foldedForm"],
        "frame_unit": "m", "frame_attributes": ["2D" if flat is not None else "3D"],
        "vertices_coords": (pattern.vertices if flat is None else flat).tolist(),
        "edges_vertices": pattern.edges.tolist(),
        "edges_assignment": ["B" if letter == "C" else letter for letter in pattern.assignment],
        "edges_foldAngle": _degrees(pattern, pattern.target if flat is not None else pattern.start_angles()),
        "faces_vertices": [list(face) for face in pattern.faces],
        "file_frames": [
            {
                "frame_title": name, "frame_classes": ["foldedForm"], "frame_attributes": ["3D"], "frame_parent": 0,
                "frame_inherit": True, "vertices_coords": at.tolist(),
                "edges_foldAngle": _degrees(pattern, pattern.fold_angles(at)),
            }
            for name, at in zip(names, vertices_of(solution), strict=True)
        ],
    }  # fmt: skip
    path.write_text(json.dumps(data, allow_nan=False), encoding="utf-8")


def _degrees(pattern: Pattern, angles: Floats) -> list[float | None]:
    """Fold angles of all edges, degrees; None for boundaries, cuts and creases without an angle."""
    found = np.degrees(angles).tolist()
    return [
        None if letter in "BC" or angle != angle else angle for letter, angle in zip(pattern.assignment, found, strict=True)
    ]
