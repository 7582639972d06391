"""Motion of bodies on a tree of joints by the coordinates of the joints: articulated bodies (Featherstone 2008, ch. 7).

A link is a joint with its second body. Joints translate along axes fixed in one body, and rotate about one axis of the first
body, about this axis and one of the second, or freely. A body without a joint is a link of the inertial frame with
three translations and a free rotation. Coordinates count from a reference configuration; those of a free rotation are the
relative quaternion. Rates are those of translations and angles, and the relative angular velocity in axes of the second
body.

Rows of six are (velocity of the centre, angular velocity) or (force, moment about the centre), all in inertial axes. With
d = r_B - r_A and the rows S of a link, a_B = (a_A + alpha_A x d, alpha_A) + S v' + gamma.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels import tensor
from fsm.kernels.jit import kernel
from fsm.kernels.tensor import Matrix, Quaternion, Vector

PARENT, CHILD, SLIDES, TURNS, FIRST_COORDINATE, FIRST_RATE, RATES, INSIDE = range(8)
"""Columns of `JointTree.links`: both bodies (the parent is -1 for the inertial frame and for bodies that stand still),
numbers of translations and of rotations (3: free), places of the coordinates and rates, and whether the axes of translation
turn with the second body."""
SLIDE, POINT, FIRST_TURN, SECOND_TURN = 0, 9, 12, 15
"""Columns of `JointTree.axes`: axes of translation, point of the joint in the second body, axes of rotation. If the axes of
translation turn with the second body, the last three numbers are the point of the joint in the first body, and `refer` sets
that in the second."""
RESOLVED = 1.5
"""Largest turn of a free rotation in an explicit step, rad, also at a loose tolerance: a tolerance of the turn of a fast top
is a poor bound of the error of its slow precession."""
COUNTED = 1.8
"""The same about an axis: steps with larger turns than 2 rad are repeated, because angles are counted from step to step."""
_NO_INERTIA = 1e-14
"""Inertia of a coordinate that others leave, relative to its own, below which it counts as none."""


class JointTree(NamedTuple):
    """Links from the roots to the leaves, and work space.

    Attributes
    ----------
    links : (k, 8) int array, see above
    stands : (k,) int array
        First body of a link that stands still, else -1.
    acting : (n,) array
        1 for the openings of joints that act in this tree, else 0.
    axes : (k, 18) array, see above
    reference : (k, 7) array
        Point of the joint in the first body, and relative quaternion, without coordinates.
    rows : (k, 6, 6) array
        S: rates of the second body by each coordinate.
    felt : (k, 6, 6) array
        Inertia times S.
    inverse : (k, 6, 6) array
        Inverse of the inertia of the coordinates.
    pushed : (k, 6) array
        Efforts along the coordinates.
    bias : (k, 6) array
        gamma.
    between : (k, 3) array
        d, m.
    spin : (n_bodies, 3) array
        Angular velocities in inertial axes.
    inertia : (n_bodies, 6, 6) array
    force, acceleration : (n_bodies, 6) arrays
    left : (7, 6) array
        Inertia and force that a link passes on.
    """

    links: np.ndarray
    stands: np.ndarray
    acting: np.ndarray
    axes: np.ndarray
    reference: np.ndarray
    rows: np.ndarray
    felt: np.ndarray
    inverse: np.ndarray
    pushed: np.ndarray
    bias: np.ndarray
    between: np.ndarray
    spin: np.ndarray
    inertia: np.ndarray
    force: np.ndarray
    acceleration: np.ndarray
    left: np.ndarray


@kernel(inline=True)
def _three(row: np.ndarray, first: int) -> Vector:
    return row[first], row[first + 1], row[first + 2]


@kernel(inline=True)
def _four(row: np.ndarray, first: int) -> Quaternion:
    return row[first], row[first + 1], row[first + 2], row[first + 3]


@kernel(inline=True)
def _put(v: Vector, row: np.ndarray, first: int) -> None:
    row[first], row[first + 1], row[first + 2] = v[0], v[1], v[2]


@kernel(inline=True)
def _plus(u: Vector, factor: float, v: Vector) -> Vector:
    return u[0] + factor * v[0], u[1] + factor * v[1], u[2] + factor * v[2]


@kernel(inline=True)
def _dot(u: Vector, v: Vector) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@kernel(inline=True)
def _turn(axis: Vector, angle: float) -> Quaternion:
    sine = np.sin(0.5 * angle)
    return np.cos(0.5 * angle), sine * axis[0], sine * axis[1], sine * axis[2]


@kernel(inline=True)
def _unit(p: Quaternion) -> Quaternion:
    size = 1.0 / np.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3])
    return size * p[0], size * p[1], size * p[2], size * p[3]


@kernel(inline=True)
def _conjugate(p: Quaternion) -> Quaternion:
    return p[0], -p[1], -p[2], -p[3]


@kernel(inline=True)
def _parent_pose(tree: JointTree, i: int, poses: np.ndarray) -> tuple[Vector, Quaternion]:
    """Position and quaternion of the first body of a link."""
    body = tree.links[i, PARENT] if tree.links[i, PARENT] >= 0 else tree.stands[i]
    if body < 0:
        return (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    return _three(poses[body], 0), _four(poses[body], 3)


@kernel(inline=True)
def _parent_rates(tree: JointTree, i: int, rates: np.ndarray) -> tuple[Vector, Vector]:
    """Velocity and angular velocity of the first body of a link, in inertial axes."""
    body = tree.links[i, PARENT]
    if body < 0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return _three(rates[body], 0), _three(tree.spin[body], 0)


@kernel
def refer(tree: JointTree, poses: np.ndarray, rates: np.ndarray, y: np.ndarray, v: np.ndarray) -> None:
    """Make the present poses the reference, and write coordinates y and rates v. Parts of the rates that the joints do not
    allow are left out; `rates` has the others afterwards.
    """
    for i in range(tree.links.shape[0]):
        link, axes, child = tree.links[i], tree.axes[i], tree.links[i, CHILD]
        r, p = _parent_pose(tree, i, poses)
        frame, first = tensor.quaternion_matrix(_four(poses[child], 3)), tensor.quaternion_matrix(p)
        if link[INSIDE] == 1:
            there = _plus(r, 1.0, tensor.times_vector(first, _three(axes, SECOND_TURN)))
            _put(tensor.transposed_times_vector(frame, _plus(there, -1.0, _three(poses[child], 0))), axes, POINT)
        apart = _plus(_plus(_three(poses[child], 0), 1.0, tensor.times_vector(frame, _three(axes, POINT))), -1.0, r)
        _put(tensor.transposed_times_vector(first, apart), tree.reference[i], 0)
        own = tensor.quaternion_product(_conjugate(p), _four(poses[child], 3))
        for k in range(4):
            tree.reference[i, 3 + k] = own[k]
        at = link[FIRST_COORDINATE]
        for k in range(link[SLIDES] + min(link[TURNS], 2)):
            y[at + k] = 0.0
        if link[TURNS] == 3:
            for k in range(4):
                y[at + link[SLIDES] + k] = own[k]
    for i in range(tree.links.shape[0]):
        _rates_of(tree, i, poses, rates, v)
        place_link(tree, i, y, v, poses, rates)


@kernel
def _rates_of(tree: JointTree, i: int, poses: np.ndarray, rates: np.ndarray, v: np.ndarray) -> None:
    """Write the rates of a link nearest to those of its second body."""
    link, axes, child = tree.links[i], tree.axes[i], tree.links[i, CHILD]
    (r, p), (velocity, omega) = _parent_pose(tree, i, poses), _parent_rates(tree, i, rates)
    frame, first = tensor.quaternion_matrix(_four(poses[child], 3)), tensor.quaternion_matrix(p)
    relative = _plus(tensor.times_vector(frame, _three(rates[child], 3)), -1.0, omega)
    at, turns = link[FIRST_RATE], link[SLIDES]
    spin = omega
    if link[TURNS] == 3:
        own = tensor.transposed_times_vector(frame, relative)
        _put(own, v, at + turns)
        spin = _plus(omega, 1.0, relative)
    elif link[TURNS] > 0:
        n = tensor.times_vector(first, _three(axes, FIRST_TURN))
        if link[TURNS] == 1:
            v[at + turns] = _dot(n, relative)
        else:
            m = tensor.times_vector(frame, _three(axes, SECOND_TURN))
            both, one, two = _dot(n, m), _dot(n, relative), _dot(m, relative)
            v[at + turns] = (one - both * two) / (1.0 - both * both)
            v[at + turns + 1] = (two - both * one) / (1.0 - both * both)
            spin = _plus(spin, v[at + turns + 1], m)
        spin = _plus(spin, v[at + turns], n)
    arm = tensor.times_vector(frame, _three(axes, POINT))
    apart = _plus(_plus(_three(poses[child], 0), 1.0, arm), -1.0, r)
    left = _plus(
        _plus(_three(rates[child], 0), 1.0, tensor.crossed(spin, arm)), -1.0,
        _plus(velocity, 1.0, tensor.crossed(omega, apart))
    )
    for k in range(link[SLIDES]):
        v[at + k] = _dot(tensor.times_vector(frame if link[INSIDE] == 1 else first, _three(axes, SLIDE + 3 * k)), left)


@kernel(inline=True)
def place_links(tree: JointTree, y: np.ndarray, v: np.ndarray, poses: np.ndarray, rates: np.ndarray) -> None:
    """Write poses, rates, S, gamma and d of all links."""
    for i in range(tree.links.shape[0]):
        place_link(tree, i, y, v, poses, rates)


@kernel(inline=True)
def place_link(tree: JointTree, i: int, y: np.ndarray, v: np.ndarray, poses: np.ndarray, rates: np.ndarray) -> None:
    """Write pose, rates, S, gamma and d of a link; its first body is placed."""
    link, axes, child, rows, bias = tree.links[i], tree.axes[i], tree.links[i, CHILD], tree.rows[i], tree.bias[i]
    (r, p), (velocity, omega) = _parent_pose(tree, i, poses), _parent_rates(tree, i, rates)
    at, of, slides = link[FIRST_COORDINATE], link[FIRST_RATE], link[SLIDES]
    n, first, turn = (0.0, 0.0, 0.0), tensor.quaternion_matrix(p), _four(tree.reference[i], 3)
    if link[TURNS] == 3:
        turn = _unit(_four(y, at + slides))
    elif link[TURNS] > 0:
        axis = _three(axes, FIRST_TURN)
        turn = tensor.quaternion_product(_turn(axis, y[at + slides]), turn)
        n = tensor.times_vector(first, axis)
        if link[TURNS] == 2:
            turn = tensor.quaternion_product(turn, _turn(_three(axes, SECOND_TURN), y[at + slides + 1]))
    own = tensor.quaternion_product(p, turn)
    for k in range(4):
        poses[child, 3 + k] = own[k]
    frame = tensor.quaternion_matrix(own)
    point, end, slid, inside = _three(tree.reference[i], 0), _three(axes, POINT), (0.0, 0.0, 0.0), link[INSIDE] == 1
    for k in range(slides):
        axis = _three(axes, SLIDE + 3 * k)
        if inside:
            end = _plus(end, -y[at + k], axis)
        else:
            point = _plus(point, y[at + k], axis)
        along = tensor.times_vector(frame if inside else first, axis)
        slid = _plus(slid, v[of + k], along)
        _put(along, rows[k], 0)
        rows[k, 3:] = 0.0
    arm = tensor.times_vector(frame, end)
    apart = tensor.times_vector(first, point)
    back = (-arm[0], -arm[1], -arm[2])
    between = _plus(apart, 1.0, back)
    _put(_plus(r, 1.0, between), poses[child], 0)
    _put(between, tree.between[i], 0)

    spin, turned = omega, (0.0, 0.0, 0.0)  # the latter is the part of the angular acceleration without accelerations
    if link[TURNS] == 3:
        for k in range(3):
            axis = (frame[k], frame[3 + k], frame[6 + k])
            _put(tensor.crossed(axis, back), rows[slides + k], 0)
            _put(axis, rows[slides + k], 3)
            spin = _plus(spin, v[of + slides + k], axis)
        turned = tensor.crossed(omega, spin)
    elif link[TURNS] > 0:
        spin = _plus(spin, v[of + slides], n)
        turned = tensor.crossed(omega, spin)
        _put(tensor.crossed(n, back), rows[slides], 0)
        _put(n, rows[slides], 3)
        if link[TURNS] == 2:
            m = tensor.times_vector(frame, _three(axes, SECOND_TURN))
            turned = _plus(turned, v[of + slides + 1], tensor.crossed(spin, m))
            spin = _plus(spin, v[of + slides + 1], m)
            _put(tensor.crossed(m, back), rows[slides + 1], 0)
            _put(m, rows[slides + 1], 3)
    centripetal = _plus(
        tensor.crossed(omega, tensor.crossed(omega, apart)), 2.0, tensor.crossed(spin if inside else omega, slid)
    )
    _put(
        _plus(_plus(centripetal, 1.0, tensor.crossed(turned, back)), 1.0, tensor.crossed(spin, tensor.crossed(spin, back))),
        bias, 0
    )
    _put(turned, bias, 3)
    _put(spin, tree.spin[child], 0)
    _put(
        _plus(_plus(velocity, 1.0, tensor.crossed(omega, apart)), 1.0, _plus(slid, 1.0, tensor.crossed(spin, back))),
        rates[child], 0
    )
    _put(tensor.transposed_times_vector(frame, spin), rates[child], 3)


@kernel
def longest_step_of_turns(tree: JointTree, v: np.ndarray) -> float:
    """Longest step (s) in which no joint turns by more than `RESOLVED`, or `COUNTED` about an axis, at the present rates;
    infinite at rest.
    """
    most = 0.0
    for i in range(tree.links.shape[0]):
        first, turns = tree.links[i, FIRST_RATE] + tree.links[i, SLIDES], tree.links[i, TURNS]
        if turns == 3:
            omega = _three(v, first)
            most = max(most, np.sqrt(_dot(omega, omega)) / RESOLVED)
        else:
            for k in range(turns):
                most = max(most, abs(v[first + k]) / COUNTED)
    return 1.0 / most if most > 0.0 else np.inf


@kernel(inline=True)
def coordinate_rates(tree: JointTree, y: np.ndarray, v: np.ndarray, out: np.ndarray) -> None:
    """Rates of the coordinates; that of a quaternion p is p (0, omega)/2, also if p has not the length 1."""
    for i in range(tree.links.shape[0]):
        link = tree.links[i]
        at, of, simple = link[FIRST_COORDINATE], link[FIRST_RATE], link[SLIDES]
        if link[TURNS] < 3:
            simple += link[TURNS]
        else:
            rate = tensor.quaternion_product(
                _four(y, at + simple), (0.0, v[of + simple], v[of + simple + 1], v[of + simple + 2])
            )
            for k in range(4):
                out[at + simple + k] = 0.5 * rate[k]
        for k in range(simple):
            out[at + k] = v[of + k]


@kernel
def with_unit_turns(tree: JointTree, y: np.ndarray) -> None:
    """Normalise the quaternions of free rotations."""
    for i in range(tree.links.shape[0]):
        if tree.links[i, TURNS] == 3:
            at = tree.links[i, FIRST_COORDINATE] + tree.links[i, SLIDES]
            p = _unit(_four(y, at))
            for k in range(4):
                y[at + k] = p[k]


@kernel
def _own_inertia(pose: np.ndarray, inertia: np.ndarray, out: np.ndarray) -> Matrix:
    """Write the inertia (6, 6) of a body in inertial axes; returns its axes."""
    frame = tensor.quaternion_matrix(_four(pose, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = out[i, 3 + j] = out[3 + i, j] = 0.0
            out[3 + i, 3 + j] = (
                frame[3 * i] * inertia[3] * frame[3 * j] + frame[3 * i + 1] * inertia[4] * frame[3 * j + 1]
                + frame[3 * i + 2] * inertia[5] * frame[3 * j + 2]
            )  # fmt: skip
        out[i, i] = inertia[i]
    return frame


@kernel
def _invert(a: np.ndarray, n: int, own: np.ndarray) -> bool:
    """Invert a symmetric positive definite matrix of n rows in place; false if it is singular. `own` (n,) is work space."""
    for k in range(n):
        own[k] = a[k, k]
    for k in range(n):
        pivot = a[k, k]
        if not pivot > _NO_INERTIA * own[k]:
            return False
        a[k, k] = 1.0
        for j in range(n):
            a[k, j] /= pivot
        for i in range(n):
            if i != k:
                factor = a[i, k]
                a[i, k] = 0.0
                for j in range(n):
                    a[i, j] -= factor * a[k, j]
    return True


@kernel
def _pass_on(inertia: np.ndarray, force: np.ndarray, apart: Vector, inertia_on: np.ndarray, force_on: np.ndarray) -> None:
    """Add inertia and force of a link, at its second body, to those of its first body; changes the inertia."""
    moment = tensor.crossed(apart, _three(force, 0))
    for k in range(3):
        force_on[k] += force[k]
        force_on[3 + k] += force[3 + k] + moment[k]
    x, y, z = apart
    for i in range(3):
        for j in range(3):
            inertia_on[i, j] += inertia[i, j]
        a, b, c = inertia[i, 0], inertia[i, 1], inertia[i, 2]
        inertia[i, 3] -= b * z - c * y  # H - M [d]
        inertia[i, 4] -= c * x - a * z
        inertia[i, 5] -= a * y - b * x
        for j in range(3):
            inertia_on[i, 3 + j] += inertia[i, 3 + j]
            inertia_on[3 + j, i] += inertia[i, 3 + j]
    for j in range(3):
        # J - H^T [d] + [d] (H - M [d])
        a, b, c = inertia[3 + j, 0], inertia[3 + j, 1], inertia[3 + j, 2]
        inertia_on[3 + j, 3] += inertia[3 + j, 3] - (b * z - c * y)
        inertia_on[3 + j, 4] += inertia[3 + j, 4] - (c * x - a * z)
        inertia_on[3 + j, 5] += inertia[3 + j, 5] - (a * y - b * x)
        a, b, c = inertia[0, 3 + j], inertia[1, 3 + j], inertia[2, 3 + j]
        inertia_on[3, 3 + j] += y * c - z * b
        inertia_on[4, 3 + j] += z * a - x * c
        inertia_on[5, 3 + j] += x * b - y * a


@kernel(inline=True)
def accelerate(tree: JointTree, poses: np.ndarray, masses: np.ndarray, forces: np.ndarray, out: np.ndarray) -> bool:
    """Write the accelerations (of all rates v) of the placed bodies; false if a coordinate has no inertia.

    Parameters
    ----------
    masses : (n_bodies, 6) array
        Masses and principal moments of inertia.
    forces : (n_bodies, 6) array
        Forces, and moments in body axes with the gyroscopic ones.
    """
    links, count = tree.links, tree.links.shape[0]
    for i in range(count):
        body = links[i, CHILD]
        frame = _own_inertia(poses[body], masses[body], tree.inertia[body])
        _put(_three(forces[body], 0), tree.force[body], 0)
        _put(tensor.times_vector(frame, _three(forces[body], 3)), tree.force[body], 3)
    left, on = tree.left[:6], tree.left[6]
    for i in range(count - 1, -1, -1):
        body, parent, n = links[i, CHILD], links[i, PARENT], links[i, RATES]
        inertia, force, rows, felt = tree.inertia[body], tree.force[body], tree.rows[i], tree.felt[i]
        inverse, pushed, bias = tree.inverse[i], tree.pushed[i], tree.bias[i]
        for c in range(n):
            pushed[c] = 0.0
            for a in range(6):
                total = 0.0
                for b in range(6):
                    total += inertia[a, b] * rows[c, b]
                felt[c, a] = total
                pushed[c] += rows[c, a] * force[a]
        for c in range(n):
            for e in range(n):
                total = 0.0
                for a in range(6):
                    total += rows[c, a] * felt[e, a]
                inverse[c, e] = total
        if not _invert(inverse, n, on):
            return False
        if parent < 0:
            continue
        for a in range(6):
            for b in range(6):
                left[a, b] = inertia[a, b]
            on[a] = force[a]
        for c in range(n):
            for a in range(6):
                gain = 0.0
                for e in range(n):
                    gain += inverse[c, e] * felt[e, a]
                on[a] -= gain * pushed[c]
                for b in range(6):
                    left[a, b] -= gain * felt[c, b]
        for a in range(6):
            for b in range(6):
                on[a] -= left[a, b] * bias[b]
        _pass_on(left, on, _three(tree.between[i], 0), tree.inertia[parent], tree.force[parent])
    for i in range(count):
        body, parent, n, first = links[i, CHILD], links[i, PARENT], links[i, RATES], links[i, FIRST_RATE]
        a = tree.acceleration[body]
        for k in range(6):
            a[k] = tree.bias[i, k]
        if parent >= 0:
            before = tree.acceleration[parent]
            carried = tensor.crossed(_three(before, 3), _three(tree.between[i], 0))
            for k in range(3):
                a[k] += before[k] + carried[k]
                a[3 + k] += before[3 + k]
        for c in range(n):
            total = 0.0
            for e in range(n):
                along = tree.pushed[i, e]
                for k in range(6):
                    along -= tree.felt[i, e, k] * a[k]
                total += tree.inverse[i, c, e] * along
            out[first + c] = total
        for c in range(n):
            for k in range(6):
                a[k] += out[first + c] * tree.rows[i, c, k]
    return True


@kernel
def spread(tree: JointTree, poses: np.ndarray, y: np.ndarray, small: np.ndarray, turns: bool, out: np.ndarray) -> None:
    """Write motions (n_bodies, 6) of all bodies, angles in body axes, by small changes of the coordinates y at the placed
    state; or by changes of the rates, of which a free rotation has three and not four (`turns` is false).
    """
    for i in range(tree.links.shape[0]):
        link, moved = tree.links[i], tree.acceleration[tree.links[i, CHILD]]
        moved[:] = 0.0
        if link[PARENT] >= 0:
            before = tree.acceleration[link[PARENT]]
            carried = tensor.crossed(_three(before, 3), _three(tree.between[i], 0))
            for k in range(3):
                moved[k], moved[3 + k] = before[k] + carried[k], before[3 + k]
        at, simple = link[FIRST_COORDINATE] if turns else link[FIRST_RATE], link[RATES]
        if turns and link[TURNS] == 3:
            simple = link[SLIDES]
            own = tensor.quaternion_product(_conjugate(_four(y, at + simple)), _four(small, at + simple))
            for k in range(3):
                for a in range(6):
                    moved[a] += 2.0 * own[1 + k] * tree.rows[i, simple + k, a]
        for k in range(simple):
            for a in range(6):
                moved[a] += small[at + k] * tree.rows[i, k, a]
    for i in range(tree.links.shape[0]):
        body = tree.links[i, CHILD]
        _put(_three(tree.acceleration[body], 0), out[body], 0)
        frame = tensor.quaternion_matrix(_four(poses[body], 3))
        _put(tensor.transposed_times_vector(frame, _three(tree.acceleration[body], 3)), out[body], 3)
