"""Check that supports and drives of a sheet prevent its motion as a whole."""

from __future__ import annotations

import numpy as np

from fsm.builders.patterns.of_sheet import place_of
from fsm.case.models.case import Case
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError, Fault
from fsm.text.shown_units import shown_points

_FREE = 1e-7
"""Relative singular value below which a motion is free; the reference is the largest singular value."""


def check_supports(case: Case, pattern: Pattern) -> None:
    """Raise a CaseError if a static sheet can move as a whole.

    Cases with steps, which may change drives, are not checked. Dynamic cases need no supports and are not checked either.
    """
    if case.step or case.solve.method not in ("static", "arc-length"):
        return
    free = free_motions(case, pattern)
    if free:
        motions = " and ".join(free) if len(free) < 6 else "move freely"
        text = f"supports and drives let the sheet {motions}; statics needs a support that prevents it"
        raise CaseError(Fault("sheet.support", text))


def free_motions(case: Case, pattern: Pattern) -> list[str]:
    """Text of the rigid-body motions of the sheet that no support and no drive prevents."""
    assert case.sheet is not None
    middle, size = pattern.vertices.mean(axis=0), max(pattern.extent(), 1e-300)
    rows = [np.zeros((1, 6))]
    for support in case.sheet.support:
        rows.append(_rows(pattern, support.at, np.eye(3)[["xyz".index(axis) for axis in support.fixed]], middle, size))
    for drive in case.drive:
        at = f"edge {drive.edge}" if drive.edge is not None else drive.at
        if at is None:  # a facet
            return []
        along = np.array(drive.direction)[None] / np.linalg.norm(drive.direction)
        rows.append(_rows(pattern, at, np.eye(3) if drive.guide else along, middle, size))
    _, values, motions = np.linalg.svd(np.concatenate(rows))
    values = np.concatenate([values, np.zeros(6 - len(values))])
    return [_text(motion, middle, size) for motion, value in zip(motions, values, strict=True) if value <= _FREE * values[0]]


def _rows(pattern: Pattern, at: object, directions: np.ndarray, middle: np.ndarray, size: float) -> np.ndarray:
    """Displacements at a place along directions (d, 3) due to the six rigid-body motions, three translations and three
    rotations.
    """
    place = place_of(pattern, at)  # type: ignore[arg-type]
    vertices = place.vertices if place.facet is None else pattern.faces[place.facet]
    directions = directions if place.facet is None else np.eye(3)
    arms = (pattern.vertices[list(vertices)] - middle) / size
    turns = np.cross(arms[:, None], directions[None])
    return np.concatenate([np.broadcast_to(directions, turns.shape), turns], axis=2).reshape(-1, 6)


def _text(motion: np.ndarray, middle: np.ndarray, size: float) -> str:
    """Text of a motion: translation, or rotation about an axis."""
    move, turn = motion[:3], motion[3:]
    rate = float(np.linalg.norm(turn))
    if rate < 1e-6:
        return f"move along {_vector(_upright(move))}"
    point = middle + size * np.cross(turn, move) / rate**2
    return f"rotate about {_vector(_upright(turn))} through {shown_points([point])}"


def _vector(values: np.ndarray) -> str:
    small = np.abs(values) < 1e-6 * float(np.abs(values).max())
    return f"({', '.join(f'{value:.3g}' for value in np.where(small, 0.0, values))})"


def _upright(vector: np.ndarray) -> np.ndarray:
    """Unit vector whose largest component is positive."""
    return np.asarray(vector / np.linalg.norm(vector) * np.sign(vector[np.argmax(np.abs(vector))]))
