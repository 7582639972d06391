"""Rigid plates against each other and against obstacles: all contacts are found, and every crossing is reported."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.interactions.shapes.face_overlap import COLUMNS
from fsm.interactions.shapes.face_weights import SHARE
from fsm.interactions.shapes.shape_distance import BOX, CYLINDER, HALF_SPACE, SPHERE
from fsm.kernels.rotation import exponential, multiply
from fsm.model.contact.shapes.shape_contacts import ShapeContacts
from fsm.model.contact.shapes.shape_features import plate_grid
from fsm.model.contact.shapes.shape_tables import Shape, as_polygon, as_rectangle
from fsm.model.contact.shapes.side_contacts import SideContacts

SPATIAL = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
THICK = 4e-3


def pose(spatial: bool, x: float, z: float, turn: float = 0.0, y: float = 0.0) -> list[float]:
    """A pose in the plane, or the same pose in space with an offset of y."""
    if not spatial:
        return [x, z, turn]
    return [x, y, z, np.cos(turn / 2), 0.0, np.sin(turn / 2), 0.0]


def two_plates(spatial: bool, first: tuple[float, float], second: tuple[float, float]) -> SideContacts:
    rectangles = [as_rectangle(body, *size, THICK) for body, size in enumerate((first, second))]
    return SideContacts(rectangles, np.array([[0, 1]]), spatial, 0.02)


def crossed(contacts: ShapeContacts, *states: np.ndarray) -> tuple[int, ...]:
    """The pairs found crossed at the end, after all states but the last were accepted one after the other."""
    for state in states[:-1]:
        assert not len(contacts.crossed(state)) or state is states[0]
        contacts.commit(state)
    return contacts.crossed(states[-1])


# plates ----------------------------------------------------------------------------------------------------------------


@SPATIAL
def test_shares_of_faces_that_lie_on_each_other_add_to_one(spatial: bool) -> None:
    contacts = two_plates(spatial, (0.2, 0.1), (0.2, 0.1))
    touching = contacts.find(np.array([pose(spatial, 0.3, 0.2), pose(spatial, 0.3, 0.2 + 0.9 * THICK)]), 0.0)
    points = touching.slot[touching.slot < len(contacts.tables.points.body)]
    # 2026-11-23: in space, edges that cross at the corners add a two-thousandth of the stiffness; before, they added that of
    # two faces
    assert contacts.share[touching.slot].sum() == pytest.approx(1.0, rel=1e-12)
    assert contacts.share[points].sum() == pytest.approx(1.0, rel=3e-3)
    np.testing.assert_allclose(touching.gap[: len(points)], -0.1 * THICK, atol=1e-15)
    places, share = plate_grid(as_rectangle(0, 0.2, 0.1, THICK), 2, True)
    assert share @ places[:, 0] ** 2 == pytest.approx(0.2**2 / 12)


@SPATIAL
@pytest.mark.parametrize("small_first", [False, True])
def test_a_small_plate_in_the_middle_of_a_large_one_is_found(spatial: bool, small_first: bool) -> None:
    """The plate touches with its own points; it is far from all points and edges of the other plate."""
    sizes = [(0.02, 0.01), (0.5, 0.3)][:: 1 if small_first else -1]
    contacts = two_plates(spatial, *sizes)
    low = 0 if small_first else 1
    poses = np.zeros((2, 7 if spatial else 3))
    poses[low] = pose(spatial, 0.06, 0.95 * THICK, 0.0, 0.04)
    poses[1 - low] = pose(spatial, 0.0, 0.0)
    touching = contacts.find(poses, 0.0)
    probing = contacts.tables.points.body[touching.slot]
    assert set(probing) == {low}
    np.testing.assert_allclose(touching.gap, -0.05 * THICK, atol=1e-15)
    poses[low] = pose(spatial, 0.06, 1.05 * THICK, 0.0, 0.04)
    assert not len(contacts.find(poses, 0.0).slot)
    near = contacts.find(poses, 0.5 * THICK)
    assert near.gap.min() == pytest.approx(0.05 * THICK)


def test_long_plates_that_cross_between_their_points_lean_on_their_edges() -> None:
    """Crossed like a plus sign: no point of either plate is over the other, and four pairs of edges cross."""
    contacts = two_plates(True, (0.5, 0.04), (0.5, 0.04))
    quarter = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
    poses = np.array([[0, 0, 0, 1, 0, 0, 0], [0.06, 0.07, 0.9 * THICK, *quarter]], dtype=float)
    touching = contacts.find(poses, 0.0)
    assert (touching.slot >= len(contacts.tables.points.body)).all()
    assert len(touching.slot) == 4
    np.testing.assert_allclose(touching.gap, -0.1 * THICK, atol=1e-15)
    gradient = contacts.measure(poses, np.zeros((2, 6)), 0.0).gradient
    np.testing.assert_allclose(np.abs(gradient[:, 0, 2]), 1.0)


@SPATIAL
def test_what_is_found_does_not_depend_on_when_the_broad_phase_was_renewed(spatial: bool) -> None:
    """A path in small steps, compared with a new broad phase at every state."""
    rng, walker = np.random.default_rng(2), two_plates(spatial, (0.2, 0.1), (0.16, 0.12))
    here, versions, touched = np.array([pose(spatial, 0.0, 0.0), pose(spatial, 0.05, 0.012, 0.1)]), set(), 0
    for step in range(400):
        # down and up again, sometimes out of reach
        here[1, 2 if spatial else 1] = 0.03 * (1 + np.cos(step / 25)) + 1e-3
        here[:, 0] += 3e-4 * rng.normal(size=2)
        fresh = two_plates(spatial, (0.2, 0.1), (0.16, 0.12))
        for below in (0.0, 0.004, 0.02):
            walked, direct = walker.find(here, below), fresh.find(here, below)
            np.testing.assert_array_equal(walked.slot, direct.slot)
            np.testing.assert_array_equal(walked.gap, direct.gap)
        touched += bool(len(walker.find(here, 0.0).slot))
        versions.add(walker.pairs(here)[1])
    assert 20 < touched < 380
    assert 2 < len(versions) < 200


@SPATIAL
@pytest.mark.parametrize("turn", [0.0, 0.4, np.pi / 2])
def test_a_thin_fast_plate_that_passes_another_is_seen(spatial: bool, turn: float) -> None:
    """In one step from well above to well below: there is no contact at either end."""
    contacts = two_plates(spatial, (0.2, 0.1), (0.16, 0.12))
    above = np.array([pose(spatial, 0.0, 0.0), pose(spatial, 0.05, 0.3, turn, 0.02)])
    below = np.array([pose(spatial, 0.0, 0.0), pose(spatial, 0.04, -0.3, turn + 0.1, 0.02)])
    aside = np.array([pose(spatial, 0.0, 0.0), pose(spatial, 0.6, -0.3, turn + 0.1, 0.02)])
    assert not len(contacts.find(above, 0.0).slot)
    assert not len(contacts.find(below, 0.0).slot)
    assert not len(contacts.crossed(below))
    found = crossed(contacts, above, below)
    assert found == (0,)
    assert not len(crossed(contacts, above, aside))
    # both plates moved together, so neither passed the other
    assert not len(crossed(contacts, above, above + 0.0))
    contacts.commit(below)
    assert not len(contacts.crossed(below))


@SPATIAL
def test_a_plate_that_swings_through_another_is_seen(spatial: bool) -> None:
    """The tip moves along an arc of 1.8 rad in one step; on the straight line between its ends it would miss the plate."""
    contacts = two_plates(spatial, (0.2, 0.1), (0.05, 0.1))
    turns = (-0.9, 0.9)
    poses = [np.array([pose(spatial, 0.0, 0.0, turn), pose(spatial, 0.105, 0.0)]) for turn in turns]
    assert len(crossed(contacts, *poses))
    far = [np.array([pose(spatial, 0.0, 0.0, turn), pose(spatial, 0.13, 0.0)]) for turn in turns]
    assert not len(crossed(contacts, *far))


def test_edges_that_pass_are_seen_where_no_point_does() -> None:
    """Two plates on edge, crossed like an X; one is pushed down through the other."""
    contacts = two_plates(True, (0.2, 0.1), (0.16, 0.12))
    one = exponential(np.array([np.pi / 2, 0.0, 0.0]))
    two = multiply(exponential(np.array([0.0, 0.0, 1.1])), one)
    above = np.array([[0, 0, 0, *one], [0.022, 0.013, 0.115, *two]])
    below = np.array([[0, 0, 0, *one], [0.022, 0.013, 0.07, *two]])
    found = crossed(contacts, above, below)
    assert found == (0,)
    contacts.own.slots_open[len(contacts.tables.points.body) :] = 0
    contacts.clear_caches()
    assert contacts.crossed(below) == ()  # the points alone do not see it
    contacts.own.slots_open[:] = 1
    beside = np.array([[0, 0, 0, *one], [0.19, 0.13, 0.07, *two]])
    assert not len(crossed(contacts, beside + [0, 0, 0.045, 0, 0, 0, 0], beside))


@SPATIAL
def test_resting_and_sliding_contact_is_no_alarm(spatial: bool) -> None:
    contacts, rng = two_plates(spatial, (0.2, 0.1), (0.16, 0.12)), np.random.default_rng(5)
    for step in range(200):
        x, z = 2e-3 * (step - 100), THICK * (0.8 + 0.1 * rng.normal())
        here = np.array([pose(spatial, 0.0, 0.0), pose(spatial, x, z, 1e-3 * rng.normal(), 0.01)])
        assert not len(contacts.crossed(here))
        contacts.commit(here)


@SPATIAL
def test_memory_comes_back(spatial: bool) -> None:
    contacts = two_plates(spatial, (0.2, 0.1), (0.16, 0.12))
    above = np.array([pose(spatial, 0.0, 0.0), pose(spatial, 0.05, 0.3)])
    below = np.array([pose(spatial, 0.0, 0.0), pose(spatial, 0.05, -0.3)])
    empty = contacts.memory()
    contacts.commit(above)
    kept = contacts.memory()
    contacts.commit(below)
    assert not len(contacts.crossed(below))
    contacts.restore(kept)
    assert len(contacts.crossed(below))
    contacts.restore(empty)
    assert not len(contacts.crossed(below))


@SPATIAL
def test_shares_come_back_from_memory_and_change_when_a_step_is_over(spatial: bool) -> None:
    """Shares of a plate that slides off another: the final state of a step has the shares with which it was solved."""
    contacts = two_plates(spatial, (0.2, 0.1), (0.2, 0.1))
    no_impact = np.zeros(0, dtype=np.int64)

    def slid(x: float) -> np.ndarray:
        return np.array([pose(spatial, 0.0, 0.0), pose(spatial, x, 0.99 * THICK)])

    def whole(at: np.ndarray, of: SideContacts) -> float:
        return float(of.share[of.find(at, 0.0).slot].sum())

    contacts.commit(slid(0.0), no_impact)
    for x in (0.05, 0.1):
        contacts.find(slid(x), 0.0)
        contacts.commit(slid(x), no_impact)
    # solved with the overlap of the last state, 0.15 m of 0.2
    points = len(contacts.find(slid(0.1), 0.0).slot)
    before = contacts.share.copy()
    assert whole(slid(0.1 + 1e-9), contacts) == pytest.approx(0.5, rel=1e-3)
    assert np.abs(contacts.share - before).max() > 1e-3
    other = two_plates(spatial, (0.2, 0.1), (0.2, 0.1))
    other.size_for(2)
    other.restore(contacts.memory())
    assert len(other.find(slid(0.1), 0.0).slot) == points
    np.testing.assert_array_equal(other.share, contacts.share)
    # within a step the shares follow the overlap
    contacts.commit(slid(0.105), no_impact)
    at = slid(0.106)
    touching = contacts.find(at, 0.0)
    rows, part, _, _ = contacts.kernels.tapered(contacts.table, at, len(touching.slot))
    share = contacts.share[touching.slot]
    share[rows] *= part
    assert share.sum() == pytest.approx(0.47, rel=2e-3)
    # a jump of the shares, here of 10 %, is delayed to the end of an impact
    contacts.own.latest[:, SHARE : SHARE + COLUMNS] *= 1.1
    for x, young, factor in ((0.107, None, 1.1), (0.108, no_impact, 1.0)):
        contacts.commit(slid(x), young)
        assert whole(slid(x + 1e-9), contacts) == pytest.approx((1.0 - x / 0.2) * factor, rel=5e-3)


@SPATIAL
def test_joined_plates_do_not_touch_where_they_are_joined(spatial: bool) -> None:
    """Plates hinged along an edge are folded from flat until they lie on each other: no crossing is reported on the way."""
    half = 0.1
    rectangles = [as_rectangle(body, 2 * half, 0.1, THICK) for body in range(2)]

    def folded(angle: float) -> np.ndarray:
        at = pose(spatial, half + half * np.cos(angle), half * np.sin(angle), -angle)
        return np.array([pose(spatial, 0.0, 0.0), at])

    contacts = SideContacts(
        rectangles, np.array([[0, 1]]), spatial, 0.02, joined=np.array([[0, 1]]), reference=folded(0.0)
    )
    for angle in np.linspace(0.0, 3.0, 60):
        here = folded(angle)
        assert not len(contacts.find(here, 0.0).slot)
        assert not len(contacts.crossed(here))
        contacts.commit(here)
    last = contacts.find(folded(np.pi - 0.5 * THICK / (2 * half)), 0.0)
    assert len(last.slot)
    assert contacts.share[last.slot[last.slot < len(contacts.tables.points.body)]].sum() > 0.5


LEANING = ((0.0, -0.05), (0.2, 0.05), (0.2, 0.15), (0.0, 0.05))
"""Side edges of two such plates cross near their crease x = 0 when one lies on the other."""
OUTLINES = {
    "leaning": (LEANING, tuple((x, -y) for x, y in LEANING[::-1])),
    "short": (((0.0, -0.05), (0.2, -0.05), (0.2, 0.05), (0.0, 0.05)), ((0.0, -0.05), (0.12, 0.0), (0.0, 0.05))),
}


@pytest.mark.parametrize("points", [1, 2, 5])
@pytest.mark.parametrize("shape", ["planar", "rectangles", "leaning", "short"])
def test_a_fold_closes_at_one_angle_with_any_number_of_points(shape: str, points: int) -> None:
    """The plates touch on their whole length at sin(angle) = t/L, not at the first point beside the crease."""
    spatial, middle = shape != "planar", 0.0
    if shape in OUTLINES:
        depth = min(max(x for x, _ in outline) for outline in OUTLINES[shape])
        plates = [as_polygon(k, np.array(of), (True,) * len(of), THICK) for k, of in enumerate(OUTLINES[shape])]
    else:
        depth, middle = 0.2, 0.1
        plates = [as_rectangle(body, 0.2, 0.1, THICK) for body in range(2)]

    def folded(angle: float) -> np.ndarray:
        """Poses with this angle between the plates."""
        at = pose(spatial, middle * np.cos(angle), middle * np.sin(angle), -angle)
        return np.array([pose(spatial, middle, 0.0), at])

    start = folded(1.0)
    contacts = SideContacts(plates, np.array([[0, 1]]), spatial, 0.05, points, joined=np.array([[0, 1]]), reference=start)
    closed = float(np.arcsin(THICK / depth))
    for angle in (1.0, 4.0 * closed, 1.01 * closed):
        assert not len(contacts.find(folded(angle), 0.0).slot)
        assert not len(contacts.crossed(folded(angle)))
        contacts.commit(folded(angle))
    touching = contacts.find(folded(0.99 * closed), 0.0)
    assert len(touching.slot)
    over = 0.5 if shape == "leaning" else 1.0  # leaning plates lie on each other up to half of their depth
    assert -touching.gap.min() == pytest.approx(0.01 * THICK * over, rel=0.02)
    assert contacts.share[touching.slot].sum() > 0.02
    assert contacts.crossed(folded(-closed)) == (0,)


# obstacles -------------------------------------------------------------------------------------------------------------

OBSTACLES = {
    "plane": (HALF_SPACE, (0.0, 0.0, 0.0), 0.0),
    "box": (BOX, (0.01, 0.02, 0.03), 0.03),
    "cylinder": (CYLINDER, (0.02, 0.1, 0.02), 0.02),
    "sphere": (SPHERE, (0.02, 0.02, 0.02), 0.02),
}
EACH = pytest.mark.parametrize("name", list(OBSTACLES))


def on_obstacle(name: str, spatial: bool, turn: float = 0.0) -> SideContacts:
    kind, size, _ = OBSTACLES[name]
    quaternion = (float(np.cos(turn / 2)), 0.0, float(np.sin(turn / 2)), 0.0)
    shape = Shape(0, kind, size, orientation=quaternion)
    return SideContacts([as_rectangle(1, 0.4, 0.3, THICK), shape], np.array([[0, 1]]), spatial, 0.02)


@SPATIAL
@EACH
def test_a_plate_that_rests_on_an_obstacle_between_its_points(name: str, spatial: bool) -> None:
    """The points of the plate are 0.2 m apart and the obstacle measures a few cm, so points of the obstacle find the
    contact."""
    contacts, top = on_obstacle(name, spatial), OBSTACLES[name][2]
    for lift, touches in ((0.45 * THICK, True), (0.55 * THICK, False)):
        poses = np.array([pose(spatial, 0.0, 0.0), pose(spatial, 0.07, top + lift, 0.0, 0.05)])
        touching = contacts.find(poses, 0.0)
        assert bool(len(touching.slot)) == touches
        near = contacts.find(poses, THICK)
        assert near.gap.min() == pytest.approx(lift - 0.5 * THICK, abs=1e-12)


def test_a_box_corner_and_a_turned_box() -> None:
    """Turned by 45 degrees, the box touches the plate with an edge, which its corners find."""
    contacts = on_obstacle("box", True, np.pi / 4)
    top = np.sqrt(0.5) * (0.01 + 0.03)
    poses = np.array([pose(True, 0.0, 0.0), pose(True, 0.05, top + 0.45 * THICK)])
    assert contacts.find(poses, 0.0).gap.min() == pytest.approx(-0.05 * THICK, abs=1e-12)


@SPATIAL
@EACH
def test_a_plate_that_passes_an_obstacle_is_seen(name: str, spatial: bool) -> None:
    contacts = on_obstacle(name, spatial)
    still = pose(spatial, 0.0, 0.0)
    above, below = (np.array([still, pose(spatial, 0.05, z, 0.1, 0.03)]) for z in (0.3, -0.3))
    assert not len(contacts.find(above, 0.0).slot)
    assert len(crossed(contacts, above, below))
    aside = np.array([still, pose(spatial, 0.9, -0.3 if name != "plane" else 0.1, 0.1, 0.03)])
    assert not len(crossed(contacts, above, aside))


@SPATIAL
@EACH
def test_a_plate_that_lies_on_an_obstacle_is_no_alarm(name: str, spatial: bool) -> None:
    contacts, rng, top = on_obstacle(name, spatial), np.random.default_rng(7), OBSTACLES[name][2]
    for step in range(100):
        z = top + THICK * rng.uniform(0.3, 0.49)
        here = np.array([pose(spatial, 0.0, 0.0), pose(spatial, 1e-3 * (step - 50), z, 0.0, 0.03)])
        assert len(contacts.find(here, 0.0).slot)
        assert not len(contacts.crossed(here))
        contacts.commit(here)


@SPATIAL
def test_an_obstacle_may_move(spatial: bool) -> None:
    """Only the relative position of both counts, also for the detection of crossings."""
    contacts = on_obstacle("sphere", spatial)
    away = [np.array([pose(spatial, x, 0.3), pose(spatial, x + 0.05, 0.6)]) for x in (0.0, 0.7)]
    assert not len(crossed(contacts, *away))
    through = np.array([pose(spatial, 0.0, 0.9), pose(spatial, 0.05, 0.6)])
    assert len(crossed(contacts, away[0], through))
