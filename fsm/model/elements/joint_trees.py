"""Trees of ideal joints, for explicit steps in the coordinates of the joints (`fsm.interactions.joint_tree`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fsm.interactions import joint_tree as place
from fsm.interactions.joint_tree import JointTree
from fsm.interactions.openings import ACROSS, ALONG, TURN
from fsm.model.elements.element_group import ElementGroup
from fsm.model.elements.joints import JointGroup

_SAME = 1e-9
"""Difference of unit vectors, or of points relative to their distance from the centre, below which they are equal."""


def joint_tree(locking: Sequence[ElementGroup], n_bodies: int, free: np.ndarray, driven: bool) -> JointTree:
    """Tree of the joints of free bodies; without links if the system has other locked directions or driven bodies.

    Parameters
    ----------
    locking : groups with locked directions
    free : (n_free,) int array
        Free bodies.
    driven : whether bodies have a prescribed motion
    """
    group = locking[0] if len(locking) == 1 and not driven else None
    links, openings = (len(free), len(group.kinds)) if isinstance(group, JointGroup) else (0, 0)
    bodies = n_bodies if links else 0
    rows, inverse, felt = np.zeros((3, links, 6, 6))
    tree = JointTree(
        np.zeros((links, place.INSIDE + 1), dtype=np.int64), np.full(links, -1, dtype=np.int64), np.zeros(openings),
        np.zeros((links, place.SECOND_TURN + 3)), np.zeros((links, 7)), rows, felt, inverse, np.zeros((links, 6)),
        np.zeros((links, 6)), np.zeros((links, 3)), np.zeros((bodies, 3)), np.zeros((bodies, 6, 6)), np.zeros((bodies, 6)),
        np.zeros((bodies, 6)), np.zeros((7, 6)),
    )  # fmt: skip
    if links:
        set_tree(tree, group, free)
    return tree


def set_tree(tree: JointTree, group: ElementGroup | None, free: np.ndarray) -> None:
    """Set the links of a tree by the openings that act. Joints that form loops, or of other kinds, have none: then the child
    of the first link is -1.
    """
    assert isinstance(group, JointGroup)
    tree.acting[:], tree.links[:] = group.active, -1
    rows = _rows(group, free)
    if rows is None:
        return
    at = of = 0
    for link, axes, (k, row) in zip(tree.links, tree.axes, enumerate(rows), strict=True):
        parent, tree.stands[k], child, axes[:], slides, turns, inside = row
        link[[place.PARENT, place.CHILD, place.SLIDES, place.TURNS, place.INSIDE]] = parent, child, slides, turns, inside
        link[[place.FIRST_COORDINATE, place.FIRST_RATE, place.RATES]] = at, of, slides + turns
        at, of = at + slides + (4 if turns == 3 else turns), of + slides + turns


def follows(tree: JointTree, locking: Sequence[ElementGroup]) -> bool:
    """Whether the tree has been set for the openings that act now."""
    return not len(tree.links) or all(np.array_equal(tree.acting, g.active) for g in locking if isinstance(g, JointGroup))


_Row = tuple[int, int, int, np.ndarray, int, int, int]
"""Parent of a link, first body that stands still, child, and results of `_axes`."""


def _rows(group: JointGroup, free: np.ndarray) -> list[_Row] | None:
    """Links of all free bodies from the roots to the leaves; None if there is no such tree."""
    acts = group.active > 0.0
    if np.any(group.program[acts] >= 0):
        return None
    moves, placed, rows = set(free.tolist()), set[int](), list[_Row]()
    joints = {int(group.of[i]): group.bodies[i].tolist() for i in np.flatnonzero(acts)}
    left = [(number, *ends) for number, ends in joints.items() if moves & set(ends)]
    while left or len(rows) < len(free):
        at = next((k for k, (_, *ends) in enumerate(left) if any(end not in moves or end in placed for end in ends)), None)
        if at is None:  # a body without joints to the ground begins a tree
            body = next(body for body in free.tolist() if body not in placed)
            axes = np.zeros(place.SECOND_TURN + 3)
            axes[place.SLIDE : place.SLIDE + 9] = np.eye(3).ravel()
            rows.append((-1, -1, body, axes, 3, 3, 0))
            placed.add(body)
            continue
        number, first, second = left.pop(at)
        turned = second not in moves or second in placed
        parent, child = (second, first) if turned else (first, second)
        own = np.flatnonzero((group.of == number) & acts)
        found = None if child not in moves or child in placed else _axes(group.kinds[own], group.constants[own], turned)
        if found is None:
            return None
        rows.append((parent if parent in moves else -1, -1 if parent in moves else parent, child, *found))
        placed.add(child)
    return rows


def _axes(kinds: np.ndarray, constants: np.ndarray, turned: bool) -> tuple[np.ndarray, int, int, int] | None:
    """Axes of a link by the openings of its joint, its numbers of translations and rotations, and whether the axes of
    translation turn with the second body; None for other joints.

    `turned`: the second body of the joint is the first one of the link.
    """
    along, across, held = (constants[kinds == kind] for kind in (ALONG, ACROSS, TURN))
    if len(along) + len(across) + len(held) < len(kinds):
        return None
    if len(along) and np.abs(along[:, 3:6] - along[0, 3:6]).max() > _SAME * (1.0 + np.abs(along[:, 3:6]).max()):
        return None
    slides, point = _others(along[:, :3]), along[0, 3:6] if len(along) else np.zeros(3)
    axis, other, turns = np.zeros(3), np.zeros(3), (3, 2, 1, 0)[min(len(across), 3)]
    if turns == 2:
        axis, other = across[0, :3], across[0, 3:6]
    elif turns == 1:
        axis, other = np.cross(across[0, :3], across[1, :3]), across[0, 3:6]
        if np.abs(across[1, 3:6] - other).max() > _SAME or np.linalg.norm(axis) < 1.0 - _SAME:
            return None
    if len(held):
        if turns > 1:
            return None
        turns = 0
    if turned:
        axis, other = other, axis
        if len(slides):
            other = point
        else:
            point = np.linalg.lstsq(along[:, :3], along[:, 6])[0]
    found = np.zeros(place.SECOND_TURN + 3)
    found[place.SLIDE : place.SLIDE + slides.size] = slides.ravel()
    found[place.POINT : place.SECOND_TURN + 3] = *point, *axis, *other
    return found, len(slides), turns, int(turned and len(slides) > 0)


def _others(rows: np.ndarray) -> np.ndarray:
    """Unit vectors (k, 3) at right angles to rows (m, 3) and to each other."""
    if not len(rows):
        return np.eye(3)
    _, sizes, vectors = np.linalg.svd(rows)
    return np.asarray(vectors[int(np.count_nonzero(sizes > _SAME)) :])
