"""Force elements and creases in one kernel, compared with separate calls of measure, law, scatter and tangent."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fsm.interactions.hinge_planar import stiffness_hinge_planar
from fsm.interactions.hinge_spatial import derivatives_hinge_spatial, stiffness_hinge_spatial
from fsm.kernels.body_poses import retract_poses
from fsm.kernels.scatter import add_block, scatter_efforts
from fsm.laws.crease import crease_moment, curve_from_data, join_curves
from fsm.model.bodies.group import BlockSums, BodyPattern, BodyState, PreviousPoses, body_pattern
from fsm.model.elements.creases import CreaseGroup
from fsm.model.elements.elements import BushingGroup

BODIES = np.array([[1, 0], [1, 2], [3, 2], [4, 3], [5, 4], [5, 0], [2, 5], [1, 4]])
DOF = np.array([-1, 0, 1, -1, 2, 3])  # the ground and a held body within
KINDS = pytest.mark.parametrize("kind", ["bushings", "creases"])
DIMENSIONS = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
MISSING = {"none": (), "dampers": ("damping",), "springs": ("stiffness",), "some": ("some",)}


def bushing(value: np.ndarray, rate: np.ndarray, rest: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Efforts of linear springs and dampers."""
    return stiffness * (value - rest) + damping * rate


def quaternions(vectors: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.roll(Rotation.from_rotvec(vectors).as_quat(), 1, axis=-1))


def random_poses(spatial: bool, rng: np.random.Generator, size: float) -> np.ndarray:
    if not spatial:
        return rng.normal(size=(len(DOF), 3))
    return np.column_stack([rng.normal(size=(len(DOF), 3)), quaternions(size * rng.normal(size=(len(DOF), 3)))])


def random_group(spatial: bool, missing: str, rng: np.random.Generator, size: float) -> BushingGroup:
    m, n = len(BODIES), 6 if spatial else 3
    if spatial:
        points = rng.normal(size=(2, m, 3))
        axes = [quaternions(size * rng.normal(size=(m, 3))) for _ in range(2)]
        geometry = (points[0], points[1], *axes, rng.normal(size=m), np.arange(m) % 3 != 0)
    else:
        geometry = (*rng.normal(size=(2, m, 2)), *rng.normal(size=(2, m)))
    rest, stiffness, damping = rng.normal(size=(m, n)), *rng.uniform(1, 5, (2, m, n))
    if "damping" in MISSING[missing]:
        damping[:] = 0.0
    if "stiffness" in MISSING[missing]:
        stiffness[:] = 0.0
    if "some" in MISSING[missing]:
        stiffness[rng.random((m, n)) < 0.4] = 0.0
        damping[rng.random((m, n)) < 0.4] = 0.0
        damping[0, : n // 2] = 0.0  # dampers of rotations only
        damping[1] = 0.0
        damping[2, n // 2 :] = stiffness[2, n // 2 :] = 0.0  # translations only
    return BushingGroup(
        BODIES, geometry, rest, stiffness, damping, np.zeros(m, dtype=np.int64), np.ones(1),
        tuple(f"element {k}" for k in range(m)), np.ones(m, dtype=bool), np.zeros((m, n), dtype=bool),
    )  # fmt: skip


def random_creases(spatial: bool, missing: str, rng: np.random.Generator, size: float) -> CreaseGroup:
    m = len(BODIES)
    axes = [quaternions(size * rng.normal(size=(m, 3))) for _ in range(2)] if spatial else []
    curves = [curve_from_data(np.linspace(-2, 2, 5), rng.normal(size=5)) for _ in range(2)]
    damping = rng.uniform(1, 5, m)
    if MISSING[missing]:
        damping[:: 1 if missing == "dampers" else 2] = 0.0
    return CreaseGroup(
        BODIES, (*axes, rng.normal(size=m)), rng.normal(size=m), np.where(np.arange(m) % 3, 1.0, -1.0), damping,
        np.arange(m) % 2, join_curves(curves), np.zeros(m),
    )  # fmt: skip


def random_elements(kind: str, *arguments: Any) -> BushingGroup | CreaseGroup:
    return random_group(*arguments) if kind == "bushings" else random_creases(*arguments)


def second_derivatives(group: BushingGroup, poses: np.ndarray) -> np.ndarray:
    """Derivatives (m, k, 2 n, 2 n) of gradients by increments of both bodies, the last axis, by differences."""
    n = group.rest.shape[1]
    rates, out = np.zeros((len(DOF), n)), np.zeros((len(BODIES), n, 2 * n, 2 * n))
    for i, ends in enumerate(BODIES):
        for column in range(2 * n):
            step = np.zeros_like(rates)
            step[ends[column // n], column % n] = 1e-3
            states = [moved(poses, k * step) for k in (1, -1, 2, -2, 3, -3)]
            far = [group.measure(state, rates, BODIES, *group.geometry)[2][i] for state in states]
            out[i, :, :, column] = (45 * (far[0] - far[1]) - 9 * (far[2] - far[3]) + far[4] - far[5]) / 0.06
    return out


def one_after_the_other(
    group: BushingGroup | CreaseGroup, poses: np.ndarray, rates: np.ndarray, pattern: BodyPattern, past: PreviousPoses | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    value, rate, gradient = group.measure(poses, rates, BODIES, *group.geometry)
    if past is not None:
        rate = (value - group.measure(past.poses, rates, BODIES, *group.geometry)[0]) / past.duration
        rates = np.zeros_like(rates)
    force, stiffness, damping = np.zeros_like(rates), pattern.zeros(), pattern.zeros()
    spatial = poses.shape[1] == 7
    dof, *index = pattern.index
    if isinstance(group, BushingGroup):
        effort = bushing(value, rate, group.rest, group.stiffness, group.damping)
        laws = effort, group.stiffness, group.damping
        second = second_derivatives(group, poses)
        for i, ends in enumerate(BODIES):
            for g, h, e, k, c in zip(gradient[i], second[i], *(law[i] for law in laws), strict=True):
                add_block(np.outer(g, k * g + c * (h.T @ rates[ends].ravel())) + e * h, dof, ends, *index, stiffness)
                add_block(c * np.outer(g, g), dof, ends, *index, damping)
    else:
        effort, slope = crease_moment(value, rate, group.law)
        turned = np.zeros((len(BODIES), 6, 6))
        if spatial:
            turned = derivatives_hinge_spatial(poses, BODIES, *group.geometry[:2])[1]
            stiffness_hinge_spatial(poses, BODIES, *group.geometry[:2], effort, slope, pattern.index, stiffness)
        else:
            stiffness_hinge_planar(BODIES, slope, pattern.index, stiffness)
        for ends, g, h, c in zip(BODIES, gradient[:, 0], turned, group.damping, strict=True):
            add_block(c * np.outer(g, h.T @ rates[ends].ravel()), dof, ends, *index, stiffness)
            add_block(c * np.outer(g, g), dof, ends, *index, damping)
    scatter_efforts(BODIES, gradient, effort, len(BODIES), force)
    return force, stiffness, damping


def in_one_pass(
    group: BushingGroup | CreaseGroup, poses: np.ndarray, rates: np.ndarray, pattern: BodyPattern, past: PreviousPoses | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The entries are added to existing values, so overwriting would be seen."""
    force, stiffness, damping = np.ones_like(rates), pattern.zeros() + 1.0, pattern.zeros() + 1.0
    group.add_linearised(BodyState(0.0, poses, rates, past), BlockSums(pattern, force, stiffness, damping))
    alone = np.ones_like(rates)
    group.add_force(BodyState(0.0, poses, rates, past), alone)
    np.testing.assert_allclose(alone, force, rtol=1e-13, atol=1e-13 * np.abs(force).max())
    return force - 1.0, stiffness - 1.0, damping - 1.0


@KINDS
@DIMENSIONS
@pytest.mark.parametrize("missing", list(MISSING))
@pytest.mark.parametrize("seen", ["rates", "rest", "past"])
@pytest.mark.parametrize("size", [0.01, 0.6], ids=["little turned", "much turned"])
def test_one_pass_is_one_after_the_other(
    kind: str, spatial: bool, missing: str, seen: str, size: float
) -> None:
    rng = np.random.default_rng(7)
    group = random_elements(kind, spatial, missing, rng, size)
    poses, rates = random_poses(spatial, rng, size), rng.normal(size=(len(DOF), 6 if spatial else 3))
    if seen == "rest":
        rates[:] = 0.0
    past = PreviousPoses(random_poses(spatial, rng, size), 0.4) if seen == "past" else None
    pattern = body_pattern(DOF, [BODIES], rates.shape[1])
    wanted = one_after_the_other(group, poses, rates, pattern, past)
    for name, new, old in zip(("force", "K", "D"), in_one_pass(group, poses, rates, pattern, past), wanted, strict=True):
        error = 1e-13 if kind == "creases" or name == "force" else 1e-9  # second derivatives by differences
        np.testing.assert_allclose(new, old, atol=error * max(np.abs(old).max(), 1.0), err_msg=name)
    assert np.abs(wanted[0]).max() > 0.5 or (missing, seen) == ("springs", "rest")
    assert np.abs(wanted[2]).max() > 0.5 or missing == "dampers"


@KINDS
@DIMENSIONS
def test_what_is_kept_is_of_the_last_pattern_and_past(kind: str, spatial: bool) -> None:
    """Patterns and pasts in turn; a group that has seen none of them gives the same."""
    rng = np.random.default_rng(8)
    group = random_elements(kind, spatial, "none", rng, 0.5)
    poses, rates = random_poses(spatial, rng, 0.5), rng.normal(size=(len(DOF), 6 if spatial else 3))
    patterns = [body_pattern(dof, [BODIES], rates.shape[1]) for dof in (DOF, np.array([-1, 3, 2, 1, 0, -1]))]
    pasts = [PreviousPoses(random_poses(spatial, rng, 0.5), 0.1), PreviousPoses(random_poses(spatial, rng, 0.5), 0.2), None]
    first = in_one_pass(group, poses, rates, patterns[0], pasts[0])
    for pattern in patterns:
        for past in pasts:
            found = in_one_pass(group, poses, rates, pattern, past)
            fresh = in_one_pass(replace(group), poses, rates, pattern, past)
            for new, other in zip(found, fresh, strict=True):
                np.testing.assert_array_equal(new, other)
    for new, other in zip(in_one_pass(group, poses, rates, patterns[0], pasts[0]), first, strict=True):
        np.testing.assert_array_equal(new, other)


@KINDS
@DIMENSIONS
def test_dissipated_power_with_a_past(kind: str, spatial: bool) -> None:
    rng = np.random.default_rng(9)
    group = random_elements(kind, spatial, "none", rng, 0.5)
    poses, past = random_poses(spatial, rng, 0.5), PreviousPoses(random_poses(spatial, rng, 0.5), 0.3)
    rates = np.zeros((len(DOF), 6 if spatial else 3))
    now, then = (group.measure(p, rates, BODIES, *group.geometry)[0] for p in (poses, past.poses))
    _, power, _ = group.energy(BodyState(0.0, poses, rates, past))
    assert power == pytest.approx(np.sum(group.damping * ((now - then) / 0.3) ** 2), rel=1e-12)


def efforts_of(group: BushingGroup, poses: np.ndarray, past: PreviousPoses | None) -> np.ndarray:
    """By measure and law; at rest, or with rates since the past."""
    rates = np.zeros((len(DOF), group.rest.shape[1]))
    value, rate, _ = group.measure(poses, rates, BODIES, *group.geometry)
    if past is not None:
        rate = (value - group.measure(past.poses, rates, BODIES, *group.geometry)[0]) / past.duration
    return bushing(value, rate, group.rest, group.stiffness, group.damping)


def moved(poses: np.ndarray, change: np.ndarray) -> np.ndarray:
    return poses + change if poses.shape[1] == 3 else retract_poses(poses.ravel(), change.ravel()).reshape(-1, 7)


@DIMENSIONS
@pytest.mark.parametrize("missing", list(MISSING))
@pytest.mark.parametrize("seen", ["rest", "past"])
def test_efforts_are_advanced_to_first_order(spatial: bool, missing: str, seen: str) -> None:
    rng = np.random.default_rng(10)
    group = random_group(spatial, missing, rng, 0.5)
    poses, change = random_poses(spatial, rng, 0.5), rng.normal(size=(len(DOF), 6 if spatial else 3))
    past = PreviousPoses(random_poses(spatial, rng, 0.5), 0.3) if seen == "past" else None
    # measures without a law are not computed
    acting = (group.stiffness != 0.0) | (group.damping != 0.0)
    now = efforts_of(group, poses, past)
    np.testing.assert_allclose(group.efforts(poses, np.zeros_like(change), past), acting * now, atol=1e-12)
    errors = []
    for size in (1e-2, 1e-3):
        exact = acting * efforts_of(group, moved(poses, size * change), past)
        errors.append(np.abs(group.efforts(poses, size * change, past) - exact).max())
    assert errors[1] < 0.02 * errors[0] or errors[0] == 0.0
    assert np.abs(acting * (efforts_of(group, moved(poses, change), past) - now)).max() > 0.1 or (
        (missing, seen) == ("springs", "rest")
    )


@DIMENSIONS
@pytest.mark.parametrize("seen", ["rates", "rest", "past"])
def test_given_efforts_are_in_the_geometric_stiffness_alone(spatial: bool, seen: str) -> None:
    """Efforts of the same poses change no entry; other efforts change only K, in proportion."""
    rng = np.random.default_rng(11)
    group = random_group(spatial, "none", rng, 0.5)
    poses, rates = random_poses(spatial, rng, 0.5), rng.normal(size=(len(DOF), 6 if spatial else 3))
    if seen != "rates":
        rates[:] = 0.0
    past = PreviousPoses(random_poses(spatial, rng, 0.5), 0.4) if seen == "past" else None
    pattern = body_pattern(DOF, [BODIES], rates.shape[1])

    def linearised(efforts: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        at = BodyState(0.0, poses, rates, past)
        sums = BlockSums.zero(pattern, at)
        group.add_linearised(at, sums, efforts)
        return sums.force, sums.stiffness, sums.damping

    force, stiffness, damping = linearised(None)
    value, rate, _ = group.measure(poses, rates, BODIES, *group.geometry)
    at_poses = efforts_of(group, poses, past) if past is not None else bushing(
        value, rate, group.rest, group.stiffness, group.damping
    )
    for part, (given, own) in enumerate(zip(linearised(at_poses), (force, stiffness, damping), strict=True)):
        np.testing.assert_allclose(given, own, atol=1e-12 * np.abs(own).max(), err_msg=str(part))
    change = rng.normal(size=at_poses.shape)
    once, twice = linearised(at_poses + change), linearised(at_poses + 2.0 * change)
    np.testing.assert_array_equal(once[0], force)
    np.testing.assert_array_equal(once[2], damping)
    assert np.abs(once[1] - stiffness).max() > 0.1
    np.testing.assert_allclose(twice[1] - stiffness, 2.0 * (once[1] - stiffness), atol=1e-11)


@DIMENSIONS
@pytest.mark.parametrize("missing", list(MISSING))
def test_stored_energy_and_gaps(spatial: bool, missing: str) -> None:
    rng = np.random.default_rng(12)
    group = random_group(spatial, missing, rng, 0.5)
    poses, rates = random_poses(spatial, rng, 0.5), rng.normal(size=(len(DOF), 6 if spatial else 3))
    value, rate, _ = group.measure(poses, rates, BODIES, *group.geometry)
    energy = 0.5 * np.sum(group.stiffness * (value - group.rest) ** 2, axis=1)
    power = float(np.sum(group.damping * rate**2))
    stored, lost, gained = group.energy(BodyState(0.0, poses, rates))
    assert stored["panels"] == pytest.approx(energy.sum(), rel=1e-12)
    assert lost == pytest.approx(power, rel=1e-12)
    assert gained == 0.0
    n = 3 if spatial else 2
    strained = np.where(group.stiffness[:, :n] > 0.0, value[:, :n] - group.rest[:, :n], 0.0)
    apart = np.linalg.norm(strained, axis=1)
    gap, name = group.gap(poses)
    assert gap == pytest.approx(apart.max(), rel=1e-12)
    assert name == f"element {np.argmax(apart)}"
