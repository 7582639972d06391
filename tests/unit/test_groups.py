"""Plates named together: a group consists of all its pairs, at a cost that does not grow with the number of pairs."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, PlateGroup, Scene, Surface
from fsm.kernels.rotation import rotation_matrix
from fsm.model.compile.compile import compile_scene
from fsm.model.contact.contact_memory import ContactMemory
from fsm.model.contact.shapes.shape_tables import as_rectangle
from fsm.model.contact.shapes.side_contacts import Side, SideContacts
from fsm.model.faults.check_scene import check_scene
from fsm.model.system.system import SegmentSystem
from validation.contact.box_of_plates import box_scene

FLOOR = Obstacle(name="floor", shape="plane")
COUNT = 40


def heap(seed: int = 3) -> tuple[Body, ...]:
    """Plates in random orientations and in motion, so close that many overlap."""
    rng = np.random.default_rng(seed)
    turns = rng.normal(size=(COUNT, 4))
    return tuple(
        Body(
            name=f"p{i}", mass=1e-3, inertia=(1e-7, 1e-7, 2e-7), plate=Plate(length=0.02, width=0.015, thickness=1e-3),
            position=tuple(rng.uniform([0, 0, 0.003], [0.06, 0.05, 0.04])), orientation=tuple(turn / np.linalg.norm(turn)),
            velocity=tuple(0.3 * rng.normal(size=3)),
        )
        for i, turn in enumerate(turns)
    )  # fmt: skip


def system_of(bodies: tuple[Body, ...], pairs: list[tuple[str, str]], groups: tuple[PlateGroup, ...] = ()) -> SegmentSystem:
    scene = Scene(
        bodies=bodies, groups=groups, obstacles=(FLOOR,), pairs=tuple(ContactPair(first=a, second=b) for a, b in pairs),
        contact=Contact(stiffness=1e6, restitution=0.5), friction=Friction(law="tanh", mu_dynamic=0.3, v_static=0.01),
    )  # fmt: skip
    assert not check_scene(scene)
    return compile_scene(scene, True)


def test_a_group_is_all_its_pairs() -> None:
    bodies = heap()
    names = tuple(body.name for body in bodies)
    one_by_one = system_of(bodies, [*combinations(names, 2), *((name, "floor") for name in names)])
    together = system_of(bodies, [("heap", "heap"), ("heap", "floor")], (PlateGroup(name="heap", bodies=names),))
    parted = system_of(
        bodies,
        [("some", "some"), ("some", "others"), ("others", "others"), ("floor", "some"), ("others", "floor")],
        (PlateGroup(name="some", bodies=names[:15]), PlateGroup(name="others", bodies=names[15:])),
    )
    q, u = one_by_one.initial()
    wanted = one_by_one.linearise(0.0, q, u)
    size = np.abs(wanted.force).max()
    assert np.count_nonzero(wanted.force) > 100
    for system in (together, parted):
        found = system.linearise(0.0, q, u)
        np.testing.assert_allclose(found.force, wanted.force, atol=1e-12 * size)
        for ours, theirs in ((found.stiffness, wanted.stiffness), (found.damping, wanted.damping)):
            np.testing.assert_allclose(ours.bsr().toarray(), theirs.bsr().toarray(), atol=1e-11 * np.abs(theirs.data).max())
    seen, each = (system.observe(0.0, q, u).pairs for system in (together, one_by_one))
    assert seen.force.sum() == pytest.approx(each.force.sum(), rel=1e-12)
    assert seen.gap.min() == pytest.approx(each.gap.min(), rel=1e-12)


def pile(count: int) -> tuple[SideContacts, np.ndarray]:
    """Plates that fill a cube with the same density for any number."""
    rng = np.random.default_rng(count)
    poses = rng.normal(size=(count, 7))
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    poses[:, :3] = 0.025 * count ** (1 / 3) * rng.uniform(size=(count, 3))
    plates = [as_rectangle(body, 0.02, 0.015, 1e-3) for body in range(count)]
    sides = [Side(np.arange(count), np.ones(count))]
    return SideContacts(plates, np.array([[0, 0]]), True, 5e-3, sides=sides), poses


def test_what_is_watched_grows_with_the_plates_not_with_their_pairs() -> None:
    """Numbers of slots laid out, of 250 and 4000 plates; their pairs grow 256 times."""
    slots = []
    for count in (250, 4000):
        contacts, poses = pile(count)
        contacts.find(poses, 0.0)
        slots.append(len(contacts.share))
        assert slots[-1] < 0.2 * 34 * count * (count - 1) / 2
    assert slots[1] / slots[0] < 16.0**1.2


def test_keys_stay_when_slots_are_numbered_anew() -> None:
    """Plates 1 and 2 lie on each other; plate 0 approaches and leaves, and the memory of its pairs precedes that of
    theirs."""
    plates = [as_rectangle(body, 0.02, 0.015, 1e-3) for body in range(3)]
    contacts = SideContacts(plates, np.array([[0, 0]]), True, 5e-3, sides=[Side(np.arange(3), np.ones(3))])
    poses = np.zeros((3, 7))
    poses[:, 3] = 1.0
    poses[2, 2], poses[0, 2] = 0.9e-3, 0.1
    far = contacts.find(poses, 0.0)
    keys = contacts.keys(far.slot).copy()
    assert len(keys) >= 9 + 9
    own = 1.0 + np.arange(len(keys))
    order = np.argsort(keys)
    kept = ContactMemory(keys[order], *(factor * own[order] for factor in (1.0, 2.0, 3.0)), own[order, None] * np.eye(3)[0])
    contacts.load_contacts(kept)
    poses[0, 2] = -2e-3
    near = contacts.find(poses, 0.0)
    np.testing.assert_array_equal(contacts.common.onset[near.slot], own)
    for now, before in zip(contacts.contacts(), kept, strict=True):
        np.testing.assert_array_equal(now, before)
    assert not np.array_equal(near.slot, far.slot)
    np.testing.assert_array_equal(contacts.keys(near.slot), keys)
    np.testing.assert_array_equal(near.gap, far.gap)


def test_memory_is_one_flat_array() -> None:
    onset, began, depth = np.array([0.2, 0.7, 3.0]), np.array([1.0, 2.0, 3.0]), np.array([1e-4, 2e-4, 3e-4])
    kept = ContactMemory(np.array([2, 7, 30]), onset, began, depth, np.eye(3))
    again, rest = ContactMemory.from_flat(np.concatenate([kept.flat(), [8.0, 9.0]]), 3)
    for one, other in zip(again, kept, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(rest, [8.0, 9.0])


def test_a_wall_far_away_is_not_searched() -> None:
    """Of 72 plates over a floor between four walls, only plates near a wall are examined for it, and none is missed."""
    system = compile_scene(box_scene(72, 6), True)
    walls = system.contacts[1].geometry
    q, _ = system.initial()
    for lower in (0.0, 0.013, 0.0275):
        poses, _ = system.place(0.0, q, None)
        poses[1:, 2] -= lower
        bodies, _ = walls.pairs(poses)
        found = {int(system.contacts[1].geometry.tables.points.body[slot]) for slot in walls.find(poses, 0.0).slot}
        assert found == {body for body in range(1, 73) if _below_or_beyond(system, poses, body)}
        assert found <= set(bodies[:, 1].tolist()) | set(bodies[:, 0].tolist())
    assert len(bodies) < 73


def _below_or_beyond(system: SegmentSystem, poses: np.ndarray, body: int) -> bool:
    """Whether a rounded corner penetrates a wall."""
    walls = system.contacts[1].geometry
    one = SideContacts([as_rectangle(0, 0.02, 0.015, 1e-3)], np.zeros((0, 2)), True, 5e-3)
    corners = one.kit.place @ rotation_matrix(poses[body, 3:]).T + poses[body, :3]
    half = -float(walls.kit.shapes.offset[-4:, :2].min())
    return bool(corners[:, 2].min() < 0.5e-3 or np.abs(corners[:, :2]).max() > half - 0.5e-3)


@pytest.mark.parametrize(
    ("groups", "pairs", "said"),
    [
        ([("all", ())], [], "the list is empty; give at least one body"),
        ([("all", ("a", "x"))], [], "no body is called 'x'"),
        ([("all", ("a", "bare"))], [], "'bare' has no plate"),
        ([("all", ("a", "b", "a"))], [], "body 'a' is listed 2 times; list it once"),
        ([("a", ("a", "b"))], [], "'a' is the name of something else already"),
        ([("all", ("a",)), ("all", ("b",))], [], "'all' is used 2 times"),
        ([("all", ("a", "b"))], [("all", "b")], "both part of body 'b'"),
        ([("all", ("a", "b"))], [("a", "a")], "both part of body 'a'"),
        ([("all", ("a", "b"))], [("all", "row")], "both part of body 'b'"),
    ],
)
def test_what_is_wrong_with_a_group_is_said(
    groups: list[tuple[str, tuple[str, ...]]], pairs: list[tuple[str, str]], said: str
) -> None:
    outline = Plate(length=0.1, width=0.05, thickness=1e-3)
    bodies = [
        Body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0), plate=outline, position=(0, 0, z))
        for z, name in enumerate("abc")
    ]
    scene = Scene(
        bodies=(*bodies, Body(name="bare", mass=1.0, inertia=(1.0, 1.0, 1.0))),
        elements=(ForceElement(name="e", inner="b", outer="c", translation=(1.0, 1.0, 1.0)),),
        surfaces=(Surface(name="row", bodies=("b", "c")),),
        groups=tuple(PlateGroup(name=name, bodies=names) for name, names in groups),
        pairs=tuple(ContactPair(first=one, second=two) for one, two in pairs),
        contact=Contact(stiffness=1e6),
    )
    faults = [str(fault) for fault in check_scene(scene)]
    assert len(faults) == 1 or "'all' is used" in said
    assert said in faults[0]
