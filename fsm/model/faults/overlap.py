"""Detection of panels that overlap as folded, before the solve: in the x-z plane, and more coarsely in space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fsm.builders.scene import build_scene
from fsm.case.derived.contact_points import contact_sides
from fsm.case.derived.frame_bodies import quaternion_matrix
from fsm.case.models.case import Case
from fsm.case.models.flexible import SceneFilm
from fsm.case.models.scene import Body, Plate, Scene
from fsm.errors import CaseError, Fault

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Outline:
    """Panel in side view.

    Attributes
    ----------
    name : str
    points : (m + 1, 2) array, m       x, z of the middle line
    thickness : m
    neighbours : names of the panels that share a crease with this panel, at an end of both
    """

    name: str
    points: Points
    thickness: float
    neighbours: tuple[str, ...] = ()


def outlines(scene: Scene) -> list[Outline]:
    """Outlines of the panels of a scene as folded: one for each surface, each other panel, and each other plate.

    Raises
    ------
    CaseError
        A plate of the scene is tilted out of the x-z plane.
    """
    plates = {body.name: body for body in scene.bodies if body.plate is not None}
    groups: dict[str, list[Body]] = {}
    for name, panel in panel_of_body(scene).items():
        groups.setdefault(panel, []).append(plates[name])
    if not groups:
        return []
    ends = _plate_ends([body for group in groups.values() for body in group])
    lines = [_joined(part) for part in np.split(ends, np.cumsum([len(group) for group in groups.values()])[:-1])]
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
    """Name of the panel of each body with a plate; the bodies of a panel are in order along it."""
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
    """Pairs of panels that overlap as folded, with the depth.

    Two panels without a common crease must not overlap. Two panels with a common crease necessarily overlap close to it,
    up to t/(2 tan(opening/2)) from the crease. This zone may be at most a quarter of the shorter panel; beyond it the
    panels must not overlap. If the thickness does not count, only the middle lines must not cross.

    Parameters
    ----------
    panels : a case, a scene, or outlines
    thickness_in_gap : bool, optional
        Whether the thickness counts. Absent: as in the contact section of the case (false without contact); true for
        outlines.

    Returns
    -------
    list of (name, name, depth)
        Depth of the overlap of the faces, m. For neighbours at a crease that is too closed, the depth at a quarter of the
        panel from the crease.

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
    found = []
    for i, j in zip(*near_boxes(low, high), strict=True):
        a, b, t = panels[i], panels[j], float(thick[i] + thick[j]) / 2
        joined = b.name in a.neighbours or a.name in b.neighbours
        depth = _crease_depth(a.points, b.points, t) if joined else _depth(a.points, b.points, t)
        if depth > tolerance:
            found.append((a.name, b.name, depth))
    return found


def find_pierced(scene: Scene) -> list[tuple[str, str]]:
    """Names of contact pairs in which an edge of one plate passes through the middle surface of the other.

    The contact search uses points and edges, so it can miss plates that pass through each other.
    """
    plates = {body.name: (body, body.plate) for body in scene.bodies if body.plate is not None}
    flat = {film.name: _as_plate(film) for film in scene.films}
    known = contact_sides(scene)
    found = []
    for pair in scene.pairs:
        sides = [known[name] for name in (pair.first, pair.second)]
        names = pair.first, pair.second
        if pair.geometry is not None:
            continue
        cables = any(side.kind == "film" and name not in flat for side, name in zip(sides, names, strict=True))
        if cables or "obstacle" in (sides[0].kind, sides[1].kind):
            continue
        one, two = (
            [flat[name]] if side.kind == "film" else [plates[body] for body in side.bodies]
            for side, name in zip(sides, names, strict=True)
        )
        if _pierce(one, two) or _pierce(two, one):
            found.append((pair.first, pair.second))
    return found


def _as_plate(film: SceneFilm) -> tuple[Body, Plate]:
    """Plate in the place of a film at the start."""
    length, width = film.length * (1.0 + film.strain[0]), film.width * (1.0 + film.strain[1])
    body = Body(name=film.name, mass=0.0, inertia=(0.0, 0.0, 0.0), position=film.position, orientation=film.orientation)
    return body, Plate(length=length, width=width, thickness=film.thickness)


def _pierce(edged: list[tuple[Body, Plate]], faces: list[tuple[Body, Plate]]) -> bool:
    """Whether an edge of the first plates passes through a face of the second, beyond round-off at common edges."""
    start, end = (np.concatenate(ends) for ends in zip(*(_sides(body, plate) for body, plate in edged), strict=True))
    for body, plate in faces:
        outline = _outline(plate)
        near = 0.5e-6 * max(plate.length, plate.width)
        (a, b) = ((points - np.array(body.position)) @ axes_of(body) for points in (start, end))
        across = (np.minimum(a[:, 2], b[:, 2]) < -near) & (np.maximum(a[:, 2], b[:, 2]) > near)
        part = a[across, 2:] / (a[across, 2:] - b[across, 2:])
        at = a[across, :2] + part * (b[across, :2] - a[across, :2])
        if np.any(_inside(outline, at, near)):
            return True
    return False


def _outline(plate: Plate) -> Points:
    """Corners (k, 2) of a plate in its body axes, m."""
    if plate.outline is not None:
        return np.array(plate.outline)
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2 * [plate.length, plate.width]


def _sides(body: Body, plate: Plate) -> tuple[Points, Points]:
    """Starts and ends (k, 3) of the sides of a plate, m."""
    corners = np.array(body.position) + _outline(plate) @ axes_of(body)[:, :2].T
    return corners, np.roll(corners, -1, axis=0)


def _inside(outline: Points, points: Points, near: float) -> NDArray[np.bool_]:
    """Whether points (m, 2) are inside of a polygon (k, 2), and farther than `near`, m, from its sides."""
    one, two = outline[:, None], np.roll(outline, -1, axis=0)[:, None]
    along, over = two - one, points[None] - one
    part = np.clip((over * along).sum(axis=2) / (along**2).sum(axis=2), 0.0, 1.0)
    clear = np.linalg.norm(over - part[..., None] * along, axis=2).min(axis=0) > near
    crosses = (one[..., 1] > points[:, 1]) != (two[..., 1] > points[:, 1])
    height = np.where(along[..., 1] == 0.0, 1.0, along[..., 1])
    right = points[:, 0] < one[..., 0] + along[..., 0] * over[..., 1] / height
    return np.asarray(clear & ((crosses & right).sum(axis=0) % 2 == 1))


def near_boxes(low: Points, high: Points) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of axis-aligned rectangles that overlap or touch, by a sweep along the axis with fewer candidates.

    Parameters
    ----------
    low, high : (n, 2) arrays, m

    Returns
    -------
    first, second : (m,) int arrays
        first < second, in ascending order.
    """
    best: tuple[int, NDArray[np.int64], NDArray[np.int64]] | None = None
    for axis in (0, 1):
        order = np.argsort(low[:, axis], kind="stable")
        end = np.searchsorted(low[order, axis], high[order, axis], side="right")
        count = np.maximum(end - np.arange(1, len(low) + 1), 0)
        if best is None or count.sum() < best[0]:
            best = int(count.sum()), order, count
    assert best is not None
    total, order, count = best
    one = np.repeat(np.arange(len(low)), count)
    other = one + 1 + np.arange(total) - np.repeat(np.cumsum(count) - count, count)
    i, j = order[one], order[other]
    near = np.all((low[i] <= high[j]) & (low[j] <= high[i]), axis=1)
    first, second = np.minimum(i[near], j[near]), np.maximum(i[near], j[near])
    ascending = np.lexsort((second, first))
    return first[ascending], second[ascending]


# -- geometry ------------------------------------------------------------------------------------------


def axes_of(body: Body) -> Points:
    """Rotation matrix from body axes to inertial ones."""
    return quaternion_matrix(np.array(body.orientation) / np.linalg.norm(body.orientation))


def _plate_ends(bodies: Sequence[Body]) -> Points:
    """Ends (n, 2, 2) of plates in side view, m."""
    w, x, y, z = turned = np.array([body.orientation for body in bodies]).T
    square = (turned * turned).sum(axis=0)
    tilted = np.flatnonzero(np.abs(1.0 - 2.0 * (x * x + z * z) / square) < 1.0 - 1e-9)
    if tilted.size:
        path, text = f"scene.bodies.{bodies[tilted[0]].name}", "is tilted out of the x-z plane"
        raise CaseError(Fault(path, f"{text}; the preview shows planar scenes only"))
    half = np.array([body.plate.length / 2.0 for body in bodies if body.plate is not None]) / square
    along = np.column_stack([half * (square - 2.0 * (y * y + z * z)), half * 2.0 * (x * z - w * y)])
    centre = np.array([body.position for body in bodies])[:, ::2]
    return np.stack([centre - along, centre + along], axis=1)


def _joined(ends: Points) -> Points:
    """Plates (n, 2, 2) in a row as one line through the centres of their joints."""
    return np.concatenate([ends[:1, 0], (ends[:-1, 1] + ends[1:, 0]) / 2.0, ends[-1:, 1]])


def _neighbours(lines: list[Points]) -> list[list[int]]:
    if not lines:
        return []
    ends = np.array([line[[0, -1]] for line in lines]).reshape(-1, 2)
    close = 1e-6 * float(np.max(np.ptp(ends, axis=0)))
    near: list[set[int]] = [set() for _ in lines]
    for p, q in zip(*near_boxes(ends - close, ends + close), strict=True):
        if p // 2 != q // 2 and np.linalg.norm(ends[p] - ends[q]) <= close:
            near[p // 2].add(int(q // 2))
            near[q // 2].add(int(p // 2))
    return [sorted(numbers) for numbers in near]


def _depth(a: Points, b: Points, t: float) -> float:
    """Depth of overlap of two lines of mean thickness t, m; at most 0 if they do not overlap."""
    i, j = _near_pieces(a, b, t)
    if not len(i):
        return 0.0
    if _cross(a, b, i, j):
        return t + min(float(distance(line[[0, -1]], other).min()) for line, other in ((a, b), (b, a)))
    nearest = np.inf
    for line, other, m, n in ((a, b, i, j), (b, a, j, i)):
        start, along = other[n], other[n + 1] - other[n]
        for point in (line[m], line[m + 1]):
            nearest = min(nearest, float(_from_piece(point, start, along).min()))
    return t - nearest


def _near_pieces(a: Points, b: Points, t: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Candidates (i, j): pieces of two lines whose bounding boxes, widened by t, overlap."""
    start, end = np.concatenate([a[:-1], b[:-1]]), np.concatenate([a[1:], b[1:]])
    low, high = np.minimum(start, end), np.maximum(start, end)
    reach = 0.5 * t + 1e-9 * float(np.max(np.ptp(start, axis=0)) + t)
    first, second = near_boxes(low - reach, high + reach)
    of_both = (first < len(a) - 1) & (second >= len(a) - 1)
    return first[of_both], second[of_both] - (len(a) - 1)


def _from_piece(points: Points, start: Points, along: Points) -> Points:
    """Distance of points from straight pieces, with one piece for each point (or by broadcasting), m."""
    square = np.maximum(np.sum(along * along, axis=-1), 1e-300)
    offset = points - start
    share = np.clip(np.sum(offset * along, axis=-1) / square, 0, 1)
    return np.asarray(np.linalg.norm(offset - share[..., None] * along, axis=-1))


def distance(points: Points, line: Points) -> Points:
    """Distance of points from a polyline, m."""
    return _from_piece(points[:, None], line[:-1], np.diff(line, axis=0)).min(axis=1)


def _cross(a: Points, b: Points, i: NDArray[np.int64], j: NDArray[np.int64]) -> bool:
    """Whether two polylines cross, piece i with piece j; a corner counts to one side, so its crossing is found."""

    def on_both_sides(line: Points, m: NDArray[np.int64], points: Points, n: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether the ends of piece n are on different sides of piece m."""
        along = line[m + 1] - line[m]
        before, after = (
            along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0] > 0
            for offset in (points[n] - line[m], points[n + 1] - line[m])
        )
        return np.asarray(before != after)

    return bool(np.any(on_both_sides(a, i, b, j) & on_both_sides(b, j, a, i)))


def _crease_depth(a: Points, b: Points, t: float) -> float:
    """Depth of overlap of two panels with a common crease, beyond the zone that is necessary at the crease, m."""
    a, b = _from_common_end(a, b)
    quarter = min(length_of(a), length_of(b)) / 4
    first, second = a[1] - a[0], b[1] - b[0]
    cosine = float(first @ second / (np.linalg.norm(first) * np.linalg.norm(second)))
    half = math.acos(max(-1.0, min(1.0, cosine))) / 2
    if t > 2 * quarter * math.tan(half) * (1 + 1e-9):  # the zone t/(2 tan(half)) is longer than a quarter of the panel
        return t - 2 * quarter * math.tan(half)
    # from here on the middle lines of straight layers are t apart; farther than the zone by a factor 1/cos(half)
    cut = max(t / (2 * math.sin(half)) if t > 0 else 0.0, 1e-9 * quarter) * (1 + 1e-6)
    if cut >= 4 * quarter:
        return 0.0
    return _depth(_beyond(a, cut), _beyond(b, cut), t)


def _from_common_end(a: Points, b: Points) -> tuple[Points, Points]:
    turns = [(p, q) for p in (a, a[::-1]) for q in (b, b[::-1])]
    return min(turns, key=lambda pair: float(np.linalg.norm(pair[0][0] - pair[1][0])))


def length_of(line: Points) -> float:
    """Length of a polyline, m."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def points_at(line: Points, arc: Points) -> Points:
    """Points of a polyline at given arc lengths."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.column_stack([np.interp(arc, along, line[:, 0]), np.interp(arc, along, line[:, 1])])


def _beyond(line: Points, cut: float) -> Points:
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.concatenate([points_at(line, np.array([cut])), line[along > cut]])
