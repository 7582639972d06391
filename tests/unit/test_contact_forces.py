"""Forces of contact surfaces: they are gradients of an energy, are balanced, agree in plane and space, and do not depend on
the broad phase."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fsm.builders.strip import build_strip
from fsm.case.models.case import Case
from fsm.interactions.surfaces.surface import STRAIGHT, TIP, overshoot
from fsm.kernels.rotation import rotation_matrix
from fsm.model.bodies.group import BodyState
from fsm.model.compile.compile import compile_scene
from fsm.model.contact.contacts import ContactGroup
from fsm.model.contact.surfaces.surface_contacts import SurfaceContacts
from fsm.model.system.system import SegmentSystem
from tests.tangents import fine_differences

PARTS = pytest.mark.parametrize("straight", [0.0, STRAIGHT], ids=["interior", "end probe"])
SPATIAL = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])


# forces -------------------------------------------------------------------------------------------------------


def pressed_strip(
    spatial: bool, friction: bool = False, thick: bool = True, damping: float = 0.0, segments: int = 4
) -> SegmentSystem:
    data: dict[str, Any] = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": "80 deg",
            "segments_per_panel": segments,
        },
        "material": {"young": 3e9, "density": 800},
        "crease": {"law": "linear", "stiffness": 9e-3},
        "contact": {"stiffness": 1e6, "damping": damping, "thickness_in_gap": thick},
        "drive": [{"crease": 3, "speed": "2 mm/s", "travel": "40 mm"}],
    }  # fmt: skip
    if friction:
        data["friction"] = {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 0.05, "v_dynamic": 0.2}
    return compile_scene(build_strip(Case.model_validate(data)), spatial)


def only_contacts(system: SegmentSystem) -> ContactGroup:
    (contacts,) = system.contacts
    return contacts


def surfaces_of(system: SegmentSystem) -> SurfaceContacts:
    geometry = only_contacts(system).geometry
    assert isinstance(geometry, SurfaceContacts)
    return geometry


def pressed(system: SegmentSystem, seed: int, depth: float = 7.5e-4) -> np.ndarray:
    """Panels 3 and 4 are upright, overlap, and are slightly displaced."""
    pose, middle = system.bodies.pose, 3 * 0.08 * np.cos(np.radians(80))
    move = np.zeros((system.n_free, system.size))
    for row, body in enumerate(system.bodies.free):
        panel = int(system.bodies.names[body].split()[1])
        if panel in (3, 4):
            side = 1.0 if panel == 3 else -1.0
            move[row, 0] = middle + side * depth - pose[body, 0]
            move[row, 2 if system.size == 3 else 4] = -side * np.radians(10)
    size = [2e-4, 2e-4, 1e-2] if system.size == 3 else [2e-4] * 3 + [1e-2] * 3
    noise = np.random.default_rng(seed).normal(size=(system.n_free, system.size)) * size
    return system.retract(system.retract(system.initial()[0], move.ravel()), noise.ravel())


def contact_force(system: SegmentSystem, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Contact forces on all bodies, and the poses of the bodies."""
    poses, rates = system.place(0.0, q, u)
    force = np.zeros_like(rates)
    only_contacts(system).add_force(BodyState(0.0, poses, rates), force)
    return force, poses


def slid(system: SegmentSystem, slide: float, depth: float, noise: float = 0.0) -> np.ndarray:
    """Panels 3 and 4 are upright with overlapping faces, and one panel is moved past the other along its length.

    `noise` (m and a hundredth of a rad) is in the plane, the same for a planar and a spatial system.
    """
    pose, middle = system.bodies.pose, 3 * 0.08 * np.cos(np.radians(80))
    spread, inward = np.random.default_rng(11), (depth - float(surfaces_of(system).probes.clearance.max())) / 2
    columns = [0, 1, 2] if system.size == 3 else [0, 2, 4]
    move = np.zeros((system.n_free, system.size))
    off = np.zeros((system.n_free, system.size))
    for row, body in enumerate(system.bodies.free):
        off[row, columns] = noise * spread.normal(size=3) * [1.0, 1.0, 1e2]
        panel = int(system.bodies.names[body].split()[1])
        if panel in (3, 4):
            side = 1.0 if panel == 3 else -1.0
            height = pose[body, columns[1]]
            move[row, columns] = (
                middle + side * inward - pose[body, 0],
                height / np.sin(np.radians(80)) + side * slide / 2 - height,
                -side * np.radians(10),
            )
    return system.retract(system.retract(system.initial()[0], move.ravel()), off.ravel())


@SPATIAL
@pytest.mark.parametrize("thick", [False, True], ids=["middle", "thickness"])
def test_force_is_minus_the_slope_of_the_contact_energy(spatial: bool, thick: bool) -> None:
    system = pressed_strip(spatial, thick=thick)
    q, rest = pressed(system, seed=2), np.zeros(system.nu)
    contacts = only_contacts(system)

    def energy(dx: np.ndarray) -> float:
        return contacts.energy(system.state(0.0, system.retract(q, dx), rest))[0]["contact"]

    force = contact_force(system, q, rest)[0][system.bodies.free].ravel()
    assert np.count_nonzero(force) > 10
    size = np.tile([1e-7] * (system.size // 2 + (system.size == 3)) + [1e-5] * (1 if system.size == 3 else 3), 16)
    np.testing.assert_allclose(force, -fine_differences(energy, size), atol=1e-7 * np.abs(force).max())


def assert_balanced(force: np.ndarray, poses: np.ndarray) -> None:
    if force.shape[1] == 6:
        arms = np.cross(poses[:, :3], force[:, :3])
        turned = np.array([rotation_matrix(p[3:]) @ f[3:] for p, f in zip(poses, force, strict=True)])
        moment, total = np.sum(arms + turned, axis=0), force[:, :3].sum(axis=0)
    else:
        total = force[:, :2].sum(axis=0)
        moment = np.sum(force[:, 2] + poses[:, 1] * force[:, 0] - poses[:, 0] * force[:, 1])
    size = np.abs(force).max()
    assert size > 0.1
    np.testing.assert_allclose(total, 0.0, atol=1e-12 * size)
    np.testing.assert_allclose(moment, 0.0, atol=1e-12 * size)


@SPATIAL
@pytest.mark.parametrize("friction", [False, True], ids=["frictionless", "friction"])
def test_contact_forces_balance(spatial: bool, friction: bool) -> None:
    """Force and moment about the origin of all bodies add up to zero: both faces are loaded at the same point."""
    system = pressed_strip(spatial, friction, damping=5.0)
    q, u = pressed(system, seed=3), np.random.default_rng(3).normal(size=system.nu)
    assert_balanced(*contact_force(system, q, u))


def on_a_tip(system: SegmentSystem, past: float, straight: float, angle: float, noise: float = 3e-5) -> np.ndarray:
    """A state in which a contact point lies on the disc of a tip, at an angle from the face's normal; `past` selects the
    panel."""
    radius = TIP * 0.08 / 2
    probe = 0.0 if straight else 0.01  # a panel's end or the middle of its last segment
    slide = past * (probe + 2 * straight * radius + 0.6 * radius * np.sin(angle))
    q = slid(system, slide, (1.0 - 0.6 * np.cos(angle)) * radius, noise)
    contacts = surfaces_of(system)
    found = contacts.find(system.place(0.0, q, np.zeros(system.nu))[0], 0.0)
    own, count = contacts.own, len(found.slot)
    piece, at = own.found_piece[:count], own.found_at[:count]
    s, stations = at.reshape(count, -1)[:, 0], contacts.surfaces.stations[piece]
    parts = contacts.probes.straight[found.slot]
    over = [overshoot(*row, 0.0)[0] for row in zip(s, stations, np.ones(len(piece)), parts, strict=True)]
    assert np.any((np.array(over) * past < 0.0) & (parts == straight))
    return q


PASTS = pytest.mark.parametrize("past", [1.0, -1.0], ids=["beginning", "end"])


def wobbled(system: SegmentSystem, q: np.ndarray) -> np.ndarray:
    """In space also slightly out of the plane."""
    if system.size == 3:
        return q
    noise = np.random.default_rng(17).normal(size=(system.n_free, 6)) * [0.0, 3e-5, 0.0, 3e-3, 0.0, 3e-3]
    return system.retract(q, noise.ravel())


@SPATIAL
@PASTS
@PARTS
@pytest.mark.parametrize(("angle", "thick"), [(0.5, True), (1.4, False)], ids=["thickness", "middle, nearly round"])
def test_force_on_a_tip_is_minus_the_slope_of_the_contact_energy(
    spatial: bool, past: float, straight: float, angle: float, thick: bool
) -> None:
    system = pressed_strip(spatial, thick=thick)
    q, rest = wobbled(system, on_a_tip(system, past, straight, angle)), np.zeros(system.nu)
    contacts = only_contacts(system)

    def energy(dx: np.ndarray) -> float:
        return contacts.energy(system.state(0.0, system.retract(q, dx), rest))[0]["contact"]

    force = contact_force(system, q, rest)[0][system.bodies.free].ravel()
    assert np.abs(force).max() > 0.1
    size = np.tile([1e-7] * (system.size // 2 + (system.size == 3)) + [1e-5] * (1 if system.size == 3 else 3), 16)
    np.testing.assert_allclose(force, -fine_differences(energy, size), atol=1e-7 * np.abs(force).max())


@PASTS
@PARTS
@pytest.mark.parametrize("friction", [False, True], ids=["frictionless", "friction"])
def test_planar_and_spatial_contact_agree_on_a_tip(past: float, straight: float, friction: bool) -> None:
    """Force, stiffness and damping of the same state in the plane."""
    results = []
    for spatial in (False, True):
        system = pressed_strip(spatial, friction, damping=5.0)
        q = on_a_tip(system, past, straight, 0.8)
        u = np.zeros((system.n_free, system.size))
        planar = [6 * body + c for body in range(system.n_free) for c in (0, 2, 4)]
        columns = planar if spatial else list(range(system.nu))
        u.ravel()[columns] = 0.1 * np.random.default_rng(6).normal(size=len(columns))
        alone = SegmentSystem(system.bodies, system.motions, (only_contacts(system),), system.pair_names)
        matrices = [matrix.toarray()[np.ix_(columns, columns)] for matrix in alone.tangent(0.0, q, u.ravel())]
        results.append([alone.force(0.0, q, u.ravel())[columns], *matrices])
    for one, other in zip(*results, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9 * np.abs(one).max())
        assert np.abs(one).max() > 0.1


@SPATIAL
@PASTS
@PARTS
@pytest.mark.parametrize("friction", [False, True], ids=["frictionless", "friction"])
def test_contact_forces_balance_on_a_tip(spatial: bool, past: float, straight: float, friction: bool) -> None:
    system = pressed_strip(spatial, friction, damping=5.0)
    q = wobbled(system, on_a_tip(system, past, straight, 0.9))
    assert_balanced(*contact_force(system, q, 0.1 * np.random.default_rng(3).normal(size=system.nu)))


@SPATIAL
def test_dissipation_is_what_damping_and_friction_take(spatial: bool) -> None:
    system = pressed_strip(spatial, friction=True, damping=5.0)
    q, u = pressed(system, seed=5), 0.1 * np.random.default_rng(5).normal(size=system.nu)
    poses, rates = system.place(0.0, q, u)
    power = only_contacts(system).energy(BodyState(0.0, poses, rates))[1]
    moving, resting = contact_force(system, q, u)[0], contact_force(system, q, 0 * u)[0]
    # the driven panel does not touch; the elastic part is the same without motion
    assert power == pytest.approx(-float(np.sum((moving - resting) * rates)), rel=1e-10)
    assert power > 0


# broad phase --------------------------------------------------------------------------------------------------


@SPATIAL
def test_result_does_not_depend_on_when_the_broad_phase_was_renewed(spatial: bool) -> None:
    """A long path in small steps renews the broad phase sometimes; a fresh system renews it at the present state. Bit for
    bit the same."""
    walker, rng = pressed_strip(spatial, friction=True, damping=5.0), np.random.default_rng(7)
    u = rng.normal(size=walker.nu)
    here = pressed(walker, seed=7, depth=2e-3)
    # first far away and back
    walker.force(0.0, walker.retract(here, np.full(walker.nu, 0.05)), u)
    size = np.tile([1e-3] * (walker.size // 2 + (walker.size == 3)) + [2e-2] * (1 if walker.size == 3 else 3), 16)
    touched = 0
    for _ in range(40):
        here = walker.retract(here, 0.3 * size * rng.normal(size=walker.nu))
        fresh = pressed_strip(spatial, friction=True, damping=5.0)
        walked, direct = contact_force(walker, here, u)[0], contact_force(fresh, here, u)[0]
        np.testing.assert_array_equal(walked, direct)
        touched += bool(direct.any())
        seen_walking, seen_fresh = walker.observe(0.0, here, u), fresh.observe(0.0, here, u)
        for name, values in vars(seen_fresh.pairs).items():
            np.testing.assert_array_equal(getattr(seen_walking.pairs, name), values, err_msg=name)
    assert touched > 20
    assert 1 < surfaces_of(walker).refreshes < 40


@SPATIAL
def test_tangent_does_not_depend_on_it_either(spatial: bool) -> None:
    walker, rng = pressed_strip(spatial), np.random.default_rng(9)
    here, u = pressed(walker, seed=9), np.zeros(walker.nu)
    walker.tangent(0.0, here, u)
    there = walker.retract(here, 1e-5 * rng.normal(size=walker.nu))
    before = surfaces_of(walker).refreshes
    walked = [matrix.toarray() for matrix in walker.tangent(0.0, there, u)]
    assert surfaces_of(walker).refreshes == before
    direct = [matrix.toarray() for matrix in pressed_strip(spatial).tangent(0.0, there, u)]
    np.testing.assert_array_equal(walked[0], direct[0])
    np.testing.assert_array_equal(walked[1], direct[1])


@pytest.mark.parametrize("segments", [20, 40])
def test_tips_are_found_whenever_the_broad_phase_was_renewed(segments: int) -> None:
    """One tip over another; the path along the panel is so short that the broad phase is not renewed on the way."""
    walker, fresh = (pressed_strip(False, thick=False, segments=segments) for _ in range(2))
    # so deep that the disc still touches there; the end of panel 3 then is its only contact
    rest, over, depth = np.zeros(walker.nu), 0.08 + 0.95 * TIP * 0.08, 0.6 * TIP * 0.08 / 2
    walker.force(0.0, slid(walker, over + 0.77 * surfaces_of(walker).margin, depth), rest)
    assert surfaces_of(walker).refreshes == 1
    walked, direct = (contact_force(system, slid(system, over, depth), rest)[0] for system in (walker, fresh))
    assert surfaces_of(walker).refreshes == 1
    assert direct.any()
    np.testing.assert_array_equal(walked, direct)
