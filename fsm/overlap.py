"""Do panels overlap as folded? The check of a planar scene before it is solved, in the x-z plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fsm.errors import CaseError, Fault
from fsm.scene.builders.strip import build_scene
from fsm.scene.case import Case
from fsm.scene.scene import Body, Scene

__all__ = [
    "Outline",
    "axes_of",
    "distance",
    "find_overlaps",
    "length_of",
    "outlines",
    "panel_of_body",
    "points_at",
]

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Outline:
    """A panel seen from the side.

    Attributes
    ----------
    name : str
    points : (m + 1, 2) array, m       x, z of its middle line
    thickness : m
    neighbours : names of the panels it shares a crease with, at an end of both
    """

    name: str
    points: Points
    thickness: float
    neighbours: tuple[str, ...] = ()


def outlines(scene: Scene) -> list[Outline]:
    """The panels of a scene as folded: one for each surface, then each other panel, then each other plate.

    Raises
    ------
    CaseError
        A plate of the scene is tilted out of the x-z plane.
    """
    plates = {body.name: body for body in scene.bodies if body.plate is not None}
    groups: dict[str, list[Body]] = {}
    for name, panel in panel_of_body(scene).items():
        groups.setdefault(panel, []).append(plates[name])
    lines = [_joined([_plate_ends(body) for body in group]) for group in groups.values()]
    names, near = list(groups), _neighbours(lines)
    return [
        Outline(
            name=name,
            points=line,
            thickness=max(body.plate.thickness for body in groups[name] if body.plate is not None),
            neighbours=tuple(names[j] for j in neighbours),
        )
        for name, line, neighbours in zip(names, lines, near, strict=True)
    ]


def panel_of_body(scene: Scene) -> dict[str, str]:
    """Name of the panel each body with a plate belongs to; bodies of a panel in order along it."""
    plates = {body.name: body for body in scene.bodies if body.plate is not None}
    panel: dict[str, str] = {}
    for surface in scene.surfaces:
        for name in surface.bodies:
            if name in plates:
                panel.setdefault(name, surface.name)
    for name, body in plates.items():
        panel.setdefault(name, f"panel {body.panel}" if body.panel else name)
    return panel


def find_overlaps(
    panels: Case | Scene | Sequence[Outline], thickness_in_gap: bool | None = None
) -> list[tuple[str, str, float]]:
    """Panels that overlap as folded, and by how much.

    Two panels without a common crease must not overlap at all. Two that share one overlap next to it by
    necessity, up to t/(2 tan(opening/2)) from the crease; that zone may be a quarter of the shorter panel at
    most, and beyond it they must not overlap. Without the thickness, middle lines must not cross.

    Parameters
    ----------
    panels : a case, a scene, or outlines
    thickness_in_gap : bool, optional
        Whether the thickness counts; absent means as the contact of the case says (no contact: it does not),
        and yes for outlines.

    Returns
    -------
    list of (name, name, depth)
        Depth in m: how far the faces are inside each other; of neighbours that are too closed, a quarter of
        the panel away from the crease.

    Raises
    ------
    CaseError
        A plate of the scene is tilted out of the x-z plane.
    """
    if isinstance(panels, Case):
        panels = build_scene(panels)
    if isinstance(panels, Scene):
        if thickness_in_gap is None:
            thickness_in_gap = panels.contact is not None and panels.contact.thickness_in_gap
        panels = outlines(panels)
    if len(panels) < 2:
        return []
    thick = np.array([p.thickness for p in panels]) * (thickness_in_gap is not False)
    low = np.array([p.points.min(axis=0) for p in panels]) - thick[:, None] / 2
    high = np.array([p.points.max(axis=0) for p in panels]) + thick[:, None] / 2
    tolerance = 1e-9 * float(np.max(high - low))
    near = np.all((low[:, None] <= high[None]) & (low[None] <= high[:, None]), axis=2)
    found = []
    for i, j in zip(*np.nonzero(np.triu(near, 1)), strict=True):
        a, b, t = panels[i], panels[j], float(thick[i] + thick[j]) / 2
        joined = b.name in a.neighbours or a.name in b.neighbours
        depth = _crease_depth(a.points, b.points, t) if joined else _depth(a.points, b.points, t)
        if depth > tolerance:
            found.append((a.name, b.name, depth))
    return found


# -- geometry ------------------------------------------------------------------------------------------


def axes_of(body: Body) -> Points:
    """Rotation matrix from body axes to inertial ones."""
    w, x, y, z = np.array(body.orientation) / np.linalg.norm(body.orientation)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _plate_ends(body: Body) -> Points:
    axes = axes_of(body)
    if abs(axes[1, 1]) < 1 - 1e-9:
        raise CaseError(
            Fault(f"scene.bodies.{body.name}", "is tilted out of the x-z plane; only planar scenes are shown")
        )
    assert body.plate is not None  # only plates come here
    half = axes[[0, 2], 0] * body.plate.length / 2
    centre = np.array(body.position)[[0, 2]]
    return np.array([centre - half, centre + half])


def _joined(ends: list[Points]) -> Points:
    """Plates in a row as one line through the middles of their joints."""
    inner = [(a[1] + b[0]) / 2 for a, b in pairwise(ends)]
    return np.array([ends[0][0], *inner, ends[-1][1]])


def _neighbours(lines: list[Points]) -> list[list[int]]:
    if not lines:
        return []
    ends = np.array([line[[0, -1]] for line in lines])
    size = float(np.max(np.ptp(ends.reshape(-1, 2), axis=0)))
    apart = np.linalg.norm(ends[:, None, :, None] - ends[None, :, None, :], axis=-1).min(axis=(2, 3))
    return [[int(j) for j in np.flatnonzero(row <= 1e-6 * size) if j != i] for i, row in enumerate(apart)]


def _depth(a: Points, b: Points, t: float) -> float:
    """How deep two lines of mean thickness t are inside each other; negative: how far apart."""
    if _cross(a, b):
        return t + min(float(distance(line[[0, -1]], other).min()) for line, other in ((a, b), (b, a)))
    return t - min(float(distance(a, b).min()), float(distance(b, a).min()))


def distance(points: Points, line: Points) -> Points:
    """Of points from a polyline."""
    start, along = line[:-1], np.diff(line, axis=0)
    square = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    offset = points[:, None] - start
    share = np.clip(np.einsum("kij,ij->ki", offset, along) / square, 0, 1)
    return np.linalg.norm(offset - share[..., None] * along, axis=-1).min(axis=1)


def _cross(a: Points, b: Points) -> bool:
    """Whether two polylines cross; a corner counts to one side, so that a crossing in a corner is found."""

    def sides(line: Points, points: Points) -> NDArray[np.bool_]:
        along, offset = np.diff(line, axis=0)[:, None], points[None] - line[:-1, None]
        return along[..., 0] * offset[..., 1] - along[..., 1] * offset[..., 0] > 0

    of_b, of_a = sides(a, b), sides(b, a)
    return bool(np.any((of_b[:, 1:] != of_b[:, :-1]) & (of_a[:, 1:] != of_a[:, :-1]).T))


def _crease_depth(a: Points, b: Points, t: float) -> float:
    """Overlap of two panels that share a crease, beyond what the crease itself makes."""
    a, b = _from_common_end(a, b)
    quarter = min(length_of(a), length_of(b)) / 4
    first, second = a[1] - a[0], b[1] - b[0]
    cosine = float(first @ second / (np.linalg.norm(first) * np.linalg.norm(second)))
    half = math.acos(max(-1.0, min(1.0, cosine))) / 2
    if t > 2 * quarter * math.tan(half) * (1 + 1e-9):  # the zone t/(2 tan(half)) is longer than a quarter
        return t - 2 * quarter * math.tan(half)
    # middle lines of straight layers are t apart from here on; rounder than the zone, by a factor 1/cos(half)
    cut = max(t / (2 * math.sin(half)) if t > 0 else 0.0, 1e-9 * quarter) * (1 + 1e-6)
    if cut >= 4 * quarter:
        return 0.0
    return _depth(_beyond(a, cut), _beyond(b, cut), t)


def _from_common_end(a: Points, b: Points) -> tuple[Points, Points]:
    turns = [(p, q) for p in (a, a[::-1]) for q in (b, b[::-1])]
    return min(turns, key=lambda pair: float(np.linalg.norm(pair[0][0] - pair[1][0])))


def length_of(line: Points) -> float:
    """Of a polyline."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def points_at(line: Points, arc: Points) -> Points:
    """Points of a polyline at given arc lengths."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.column_stack([np.interp(arc, along, line[:, 0]), np.interp(arc, along, line[:, 1])])


def _beyond(line: Points, cut: float) -> Points:
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.concatenate([points_at(line, np.array([cut])), line[along > cut]])
