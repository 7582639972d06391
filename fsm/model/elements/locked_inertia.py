"""Inertia of locked openings, which scales their penalties."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence

import numpy as np

from fsm.model.elements.element_group import ElementGroup
from fsm.model.elements.joints import JointGroup
from fsm.model.elements.locked_couplings import LockedCouplings

_REPEATED = 1e-10
"""Smallest ratio of eigenvalues of openings, scaled to unit size, that do not follow from others."""


_STANDS = 1e-13
"""Motion of an opening by unit efforts, relative to that between the lightest bodies, that counts as none."""


def set_inertia(group: JointGroup, couplings: Sequence[LockedCouplings], poses: np.ndarray, inverse: np.ndarray) -> None:
    """Set the inertia of all locked openings; that of released ones is zero, so that they have no effort.

    Parameters
    ----------
    group : openings of all joints
    couplings : ideal couplings
    poses : (n_bodies, 7) array
        Present poses.
    inverse : (n_bodies, 6) array
        Inverse of the inertia; zero for bodies that cannot move. That of frames is their own, without others on the same
        part.
    """
    rows = np.zeros((len(group.kinds), *inverse.shape))
    for row, gradient, ends in zip(rows, group.openings(poses)[1].reshape(-1, 2, 6), group.bodies.tolist(), strict=True):
        row[ends] += gradient
    rows *= group.active[:, None, None]
    of_couplings = (coupled.gradients(poses) * coupled.active[:, None, None] for coupled in couplings)
    inertia = _inertia(np.concatenate([rows, *of_couplings]), inverse)
    for number, kind in set(zip(group.of.tolist(), group.kinds.tolist(), strict=True)):
        own = np.flatnonzero((group.of == number) & (group.kinds == kind))  # axes of a joint turn with its first body
        group.masses[own] = inertia[own].max() * group.active[own]
    end = len(rows)
    for coupled in couplings:
        coupled.masses[:], end = inertia[end : end + len(coupled.masses)], end + len(coupled.masses)


def _inertia(rows: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Inertia (n,) of each opening while all others stay closed, kg or kg m^2: the diagonal of (J M^-1 J^T)^-1.

    With penalties in this ratio, the smallest eigenvalue of the penalties times J M^-1 J^T is their factor over n at least,
    whatever the ratios of masses. Of openings that follow from others the pseudo-inverse has a share. `rows` are the
    gradients (n, n_bodies, 6).
    """
    largest = np.linalg.norm((rows * np.sqrt(inverse.max(axis=0))).reshape(len(rows), -1), axis=1)
    rows = (rows * np.sqrt(inverse)).reshape(len(rows), -1)
    sizes = np.linalg.norm(rows, axis=1)
    sizes[sizes <= _STANDS * largest] = math.inf
    scaled = rows / sizes[:, None]
    return np.asarray(np.diag(np.linalg.pinv(scaled @ scaled.T, _REPEATED, hermitian=True)) / sizes**2)


def have_loops(groups: Iterable[ElementGroup], dof: np.ndarray) -> bool:
    """Whether openings may depend on each other.

    They do not if joints between bodies form trees, where all bodies that cannot move (`dof` < 0) are one, and couplings
    between joints form trees, where all joints with motors are one.
    """
    parents = dict[Hashable, Hashable]()

    def joined(one: Hashable, two: Hashable) -> bool:
        """Join the trees of two bodies, or of two joints; false if both are in one tree."""
        while one in parents:
            one = parents[one]
        while two in parents:
            two = parents[two]
        if one != two:
            parents[one] = two
        return one != two

    groups = list(groups)
    joints = [group for group in groups if isinstance(group, JointGroup)]
    couplings = [group for group in groups if isinstance(group, LockedCouplings)]
    if len(joints) + len(couplings) < len(groups) or (couplings and any(group.spare for group in joints)):
        return True
    for group in joints:
        ends = dict(zip(group.of.tolist(), group.bodies.tolist(), strict=True))
        if not all(joined(*(body if dof[body] >= 0 else -1 for body in pair)) for pair in ends.values()):
            return True
        for number in group.of[group.program >= 0].tolist():
            joined(tuple(ends[number]), "held")
    return not all(joined(*map(tuple, pair)) for group in couplings for pair in group.coupled.tolist())


def length_at(groups: Iterable[ElementGroup], poses: np.ndarray, dof: np.ndarray) -> float:
    """Typical length of free bodies (`dof` >= 0) at locked directions, m: twice the median distance of these from centres of
    mass, 0 without any.
    """
    arms = [np.zeros(0)]
    for group in groups:
        if group.bodies.shape[1] == 2:
            rows = group.gradients(poses)
            moved, turned = np.linalg.norm(rows[..., :3], axis=-1), np.linalg.norm(rows[..., 3:], axis=-1)
            acts = (moved > 0.0) & (turned > 0.0) & (dof[group.bodies] >= 0)
            arms.append(turned[acts] / moved[acts])
    found = np.concatenate(arms)
    return 2.0 * float(np.median(found)) if len(found) else 0.0
