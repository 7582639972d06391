"""Contact of edges with edges: closest points, and the transition to contact points where edges are nearly parallel or past
their ends."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import minimize

from fsm.interactions.contact.shapes import EdgePairs, Edges
from fsm.interactions.shapes.edge_edge import find_edges
from fsm.interactions.shapes.swept import edges_pass, local_edges
from fsm.kernels.rotation import exponential, multiply
from fsm.kernels.scatter import scatter_efforts
from fsm.model.contact.shapes.shape_tables import Units, as_rectangle
from fsm.model.contact.shapes.side_contacts import SideContacts

STIFFNESS = 1e5


def closest_by_search(one: np.ndarray, two: np.ndarray) -> float:
    """Distance of two segments given by their ends (2, 3)."""

    def square(x: np.ndarray) -> float:
        return float(np.sum((one[0] + x[0] * (one[1] - one[0]) - two[0] - x[1] * (two[1] - two[0])) ** 2))

    starts = [(0.5, 0.5), (0.0, 1.0), (1.0, 0.0)]
    return float(np.sqrt(min(minimize(square, start, bounds=[(0, 1)] * 2, tol=1e-16).fun for start in starts)))


def test_distance_is_that_of_a_search() -> None:
    rng = np.random.default_rng(1)
    poses = np.zeros((2, 7))
    poses[:, 3] = 1.0
    for number in range(30):
        ends = rng.uniform(-1, 1, (2, 2, 3))
        if number % 3 == 0:  # nearly parallel
            ends[1] = ends[0] + rng.uniform(-0.3, 0.3, 3) + 1e-3 * rng.normal(size=(2, 3))
        along = ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(along, axis=1)
        table = Edges(np.array([0, 1]), ends.mean(axis=1), along / length[:, None], length / 2, np.array([0.1, 0.05]))
        pairs = EdgePairs(np.array([[0, 1]]), np.zeros(1), np.array([0.15]))
        slot, gap = find_edges(poses, np.zeros(1, dtype=np.int64), pairs, table, 10.0)
        assert list(slot) == [0]
        assert gap[0] == pytest.approx(closest_by_search(*ends) - 0.15, abs=1e-6)


# two plates ------------------------------------------------------------------------------------------------------------


def turned(vector: tuple[float, float, float], base: np.ndarray | None = None) -> np.ndarray:
    start = np.array([1.0, 0.0, 0.0, 0.0]) if base is None else base
    return np.asarray(multiply(exponential(np.array(vector)), start))


class Unscaled(SideContacts):
    """No pair of edges counts as nearly parallel."""

    def _lay_out(self, units: Units) -> None:
        super()._lay_out(units)
        self.own.pair_parallel[:] = 0.0


def plates(scaled: bool = True) -> SideContacts:
    """Plates of 0.2 x 0.1 m and 0.16 x 0.12 m, 4 and 2 mm thick, of bodies 0 and 1."""
    rectangles = [as_rectangle(0, 0.2, 0.1, 4e-3), as_rectangle(1, 0.16, 0.12, 2e-3)]
    kind = SideContacts if scaled else Unscaled
    return kind(rectangles, np.array([[0, 1]]), True, 0.02, points=2)


def force_and_energy(contacts: SideContacts, poses: np.ndarray) -> tuple[np.ndarray, float]:
    """Hertzian forces on both bodies without motion, (2, 6), and their energy."""
    touching = contacts.find(poses, 0.0)
    bodies, _, gradient = contacts.measure(poses, np.zeros((2, 6)), 0.0)
    share = contacts.share[touching.slot]
    force = np.zeros((2, 6))
    effort = np.zeros((len(share), 4))
    effort[:, 0] = -share * STIFFNESS * (-touching.gap) ** 1.5
    scatter_efforts(bodies, gradient, effort, len(share), force)
    return force, float(np.sum(share * STIFFNESS * (-touching.gap) ** 2.5 / 2.5))


def through_parallel(x: float) -> np.ndarray:
    """Plate 1 stands on a long edge, 2 mm inside the long edge of plate 0, and turns about the vertical."""
    upright = turned((0.0, 0.0, 0.08 * (x - 0.47)), turned((np.pi / 2, 0.0, 0.0)))
    return np.array([[0, 0, 0, 1, 0, 0, 0], [0.013, 0.0505, 0.06 + 2.2e-3, *upright]], dtype=float)


def over_the_edge(x: float) -> np.ndarray:
    """Plate 1, tilted, slides with its corners and edges over the face, the sides and a corner of plate 0."""
    tilted = turned((0.009 + 0.004 * x, -0.01, 0.4))
    return np.array([[0, 0, 0, 1, 0, 0, 0], [0.02 + 0.15 * x, 0.01 + 0.08 * x, 3.1e-3, *tilted]])


def flat_on(x: float) -> np.ndarray:
    """Plate 1 lies on plate 0 and turns and slides over it."""
    return np.array([[0, 0, 0, 1, 0, 0, 0], [0.1 * x, 0.1 * x, 2.6e-3, *turned((1e-3, -2e-3, 0.1 + 1.7 * x))]])


PATHS = pytest.mark.parametrize("path", [through_parallel, over_the_edge, flat_on])


def largest_jump(contacts: SideContacts, path: Callable[[float], np.ndarray], count: int) -> tuple[float, float]:
    """Largest change of the force from one state to the next on a path, and the largest force."""
    forces = np.array([force_and_energy(contacts, path(x))[0] for x in np.linspace(0, 1, count + 1)])
    return float(np.abs(np.diff(forces, axis=0)).max()), float(np.abs(forces).max())


@PATHS
def test_force_is_continuous(path: Callable[[float], np.ndarray]) -> None:
    """A jump would remain with steps eight times shorter; the change of a continuous force decreases with the step."""
    contacts = plates()
    coarse, size = largest_jump(contacts, path, 500)
    fine, _ = largest_jump(contacts, path, 4000)
    assert size > 0.01
    assert fine < 0.3 * coarse


def test_without_the_scaling_it_jumps_at_parallel() -> None:
    coarse, _ = largest_jump(plates(scaled=False), through_parallel, 500)
    fine, _ = largest_jump(plates(scaled=False), through_parallel, 4000)
    assert fine > 0.8 * coarse


def work_and_energy(contacts: SideContacts, path: Callable[[float], np.ndarray], count: int) -> tuple[float, float]:
    """Difference between the work done along a path and the change of energy, and the largest energy."""
    states = [path(x) for x in np.linspace(0, 1, count + 1)]
    energies = [force_and_energy(contacts, state)[1] for state in (states[0], states[count // 2], states[-1])]
    missing = energies[-1] - energies[0]
    for before, after in pairwise(states):
        middle = 0.5 * (before + after)
        middle[:, 3:] /= np.linalg.norm(middle[:, 3:], axis=1, keepdims=True)
        conjugate = middle[:, 3:] * [1.0, -1.0, -1.0, -1.0]
        step = np.hstack([after[:, :3] - before[:, :3], 2 * multiply(conjugate, after[:, 3:] - before[:, 3:])[:, 1:]])
        missing += float(np.sum(force_and_energy(contacts, middle)[0] * step))
    return abs(missing), max(energies)


@PATHS
def test_work_along_the_path_is_the_change_of_energy(path: Callable[[float], np.ndarray]) -> None:
    """Forces of points and edges together: the error is of second order in the step, also where the closest features
    change."""
    contacts = plates()
    coarse, energy = work_and_energy(contacts, path, 500)
    # 2026-11-23: 4000 steps instead of 2000, because more points cross edges along the path
    fine, _ = work_and_energy(contacts, path, 4000)
    assert fine < 0.1 * coarse
    assert fine < 2e-4 * energy


def test_an_edge_that_crosses_carries_what_points_do_not_see() -> None:
    """Two plates on edge, crossed like an X: all points of each plate are far from the other plate."""
    contacts = plates()
    one = turned((np.pi / 2, 0.0, 0.0))
    two = turned((0.0, 0.0, 1.1), one)
    poses = np.array([[0, 0, 0, *one], [0.022, 0.013, 0.05 + 0.06 + 2.7e-3, *two]])
    touching = contacts.find(poses, 0.0)
    assert len(touching.slot) == 1
    assert touching.slot[0] >= len(contacts.tables.points.body)
    assert touching.gap[0] == pytest.approx(-0.3e-3, abs=1e-12)
    force, _ = force_and_energy(contacts, poses)
    assert force[1, 2] == pytest.approx(0.25 * STIFFNESS * 0.3e-3**1.5, rel=1e-10)


# passing through -------------------------------------------------------------------------------------------------------


def random_edges(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return rng.uniform(-1, 1, (2, 3)), rng.uniform(-1, 1, (2, 3)), rng.uniform(0.2, 1.0)


def test_edges_pass_when_their_distance_goes_through_zero() -> None:
    """Compared with a search for contact in many small increments of the path."""
    rng, seen = np.random.default_rng(4), 0
    for _ in range(30):
        start, end, half = random_edges(rng)
        passed = edges_pass(np.array([half]), start[None], end[None])[0]
        time, part = np.meshgrid(np.linspace(0, 1, 1501), np.linspace(0, 1, 401), indexing="ij")
        ends = start + time[..., None, None] * (end - start)
        at = ends[..., 0, :] + part[..., None] * (ends[..., 1, :] - ends[..., 0, :])
        least = np.sqrt(np.maximum(np.abs(at[..., 0]) - half, 0) ** 2 + at[..., 1] ** 2 + at[..., 2] ** 2).min()
        if least > 0.02:
            assert not passed
        elif least < 2e-3:
            seen += 1
            assert passed
    assert seen >= 3


def test_local_edges_are_the_same_edges_seen_from_the_other() -> None:
    rng = np.random.default_rng(6)
    poses = rng.normal(size=(2, 7))
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    direction = rng.normal(size=(2, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    table = Edges(np.array([0, 1]), rng.normal(size=(2, 3)), direction, np.array([0.4, 0.7]), np.zeros(2))
    slots = np.zeros(1, dtype=np.int64)
    local = local_edges(poses, slots, np.array([[0, 1]]), table)[0]
    back = local_edges(poses, slots, np.array([[1, 1]]), table)[0]
    np.testing.assert_allclose(back, [[-0.7, 0, 0], [0.7, 0, 0]], atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(local[1] - local[0]), 0.8, rtol=1e-14)
    _, gap = find_edges(poses, slots, EdgePairs(np.array([[0, 1]]), np.zeros(1), np.zeros(1)), table, 100.0)
    assert closest_by_search(local, back) == pytest.approx(gap[0], abs=1e-6)
