"""Branch points of mechanisms: states in which locked directions lose their rank, so that a motion can go on in many ways.

Between two records, the rows of all locked directions are followed in bases of their row and column spaces, which turn
least. In these the rows are square matrices A and B. If A^-1 B has a negative eigenvalue mu, a state between the records is
singular, at the part 1/(1 - mu) of the way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.model.elements.joints import JointGroup
from fsm.model.elements.locked_couplings import LockedCouplings
from fsm.model.plan.joint_state import MOST_FOLLOWED
from fsm.model.system.system import SegmentSystem
from fsm.results.solution import Solution
from fsm.text.shown_units import shown

_REPEATED = 1e-9
"""Singular value relative to the largest that counts as zero."""
_NEARER = 0.1
"""Largest ratio of the smallest singular value at a branch point to the larger one beside it; one of both records may be
very near."""
_SMALL_TURN = 0.5
"""Smallest cosine of the turns of the spaces between two records."""


class _Rows(NamedTuple):
    """Singular values and vectors of the rows of locked directions that do not repeat others."""

    left: np.ndarray
    sizes: np.ndarray
    right: np.ndarray


def branch_warnings(solution: Solution, system: SegmentSystem) -> list[str]:
    """Warning on the first branch point that a mechanism of rigid bodies with loops passes, with its joint."""
    groups = [group for group in system.locking if isinstance(group, JointGroup)]
    if not groups or len(groups[0].names) <= system.n_free or system.steps_of:  # no loop, or other joints in other steps
        return []
    if system.of_vectors:
        return []
    group, rank = groups[0], 0
    couplings = [each for each in system.locking if isinstance(each, LockedCouplings)]
    names = [f"joint {group.names[of]!r}" for of in group.of.tolist()]
    names += [f"coupling {name!r}" for each in couplings for name in each.names]
    if len(names) * len(solution.time) > MOST_FOLLOWED:
        return []
    found: list[tuple[float, str]] = []
    before: _Rows | None = None
    poses_before, t_before = system.bodies.pose, 0.0
    for t, q in zip(solution.time.tolist(), solution.q, strict=True):
        poses = system.place(t, q, None)[0]
        present = _rows(system, group, couplings, poses)
        rank = max(rank, len(present.sizes))
        if len(present.sizes) < rank:  # this record is a branch point
            continue
        if before is not None and len(before.sizes) == rank:
            part = _crossing(before, present)
            if part is not None:
                middle = _rows(system, group, couplings, _between(poses_before, poses, part), rank)
                if middle.sizes[-1] < _NEARER * max(before.sizes[-1], present.sizes[-1]):
                    name = names[int(np.abs(middle.left[:, -1]).argmax())]
                    found.append((t_before + part * (t - t_before), name))
        before, poses_before, t_before = present, poses, t
    if not found:
        return []
    (t, name), more = found[0], f", and {len(found) - 1} more later" if len(found) > 1 else ""
    return [
        f"the loop of {name} passes a branch point near {shown(float(t), 's')}{more}: there the mechanism can go on "
        "in another way; the run follows its velocities, and round-off or a small load may choose the other one"
    ]


def _rows(
    system: SegmentSystem, group: JointGroup, couplings: list[LockedCouplings], poses: np.ndarray, rank: int = 0
) -> _Rows:
    """Rows at these poses, whose moments count over the length of bodies; at least `rank` singular values."""
    own = group.gradients(poses)
    matrix = np.zeros((len(own), len(poses), 6))
    np.add.at(matrix, (np.arange(len(own))[:, None], group.bodies), own)
    matrix = np.concatenate([matrix, *(each.gradients(poses) for each in couplings)])
    matrix *= np.repeat([1.0, 1.0 / system.scales().length], 3)
    active = np.concatenate([group.active, *(each.active for each in couplings)])
    matrix = matrix[:, system.bodies.free].reshape(len(matrix), -1) * (active > 0.0)[:, None]
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    count = max(rank, int(np.sum(sizes > _REPEATED * sizes[:1].max(initial=0.0))))
    return _Rows(left[:, :count], sizes[:count], right[:count])


def _crossing(before: _Rows, after: _Rows) -> float | None:
    """Part of the way between two records at which the rows are singular; None without one."""
    turns = []
    for one, two in ((before.left.T, after.left.T), (before.right, after.right)):
        outer, cosines, inner = np.linalg.svd(two @ one.T)
        if cosines[-1] < _SMALL_TURN:
            return None
        turns.append(outer @ inner)
    ahead = turns[0].T @ (after.sizes[:, None] * turns[1])
    found = np.linalg.eigvals(ahead / before.sizes[:, None])
    crossed = found[(found.real < 0.0) & (np.abs(found.imag) < 1e-6 * np.abs(found))].real
    return float(1.0 / (1.0 - crossed.min())) if len(crossed) else None


def _between(first: np.ndarray, second: np.ndarray, part: float) -> np.ndarray:
    """Poses (n, 7) between two others."""
    turned = np.where(np.sum(first[:, 3:] * second[:, 3:], axis=1, keepdims=True) < 0.0, -1.0, 1.0) * second[:, 3:]
    poses = (1.0 - part) * first + part * np.hstack([second[:, :3], turned])
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return poses
