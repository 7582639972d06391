"""Shares of contact points that are tapered at the ends of faces: even sums, forces as gradients of an energy, exact
tangents."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.case.models.contact import Contact, Friction
from fsm.case.models.scene import Body, ContactPair, Plate, Scene, Surface
from fsm.interactions.quadrature import gauss_lobatto
from fsm.interactions.surfaces.end_taper import TAPER, end_taper
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from tests.tangents import differences

SPATIAL = pytest.mark.parametrize("spatial", [False, True], ids=["planar", "spatial"])
LENGTH, THICK, STIFFNESS = 0.02, 1e-3, 1e6


@pytest.mark.parametrize("half_cell", [0.5, 0.3, 0.05])
def test_taper_is_smooth(half_cell: float) -> None:
    inside = np.linspace(-1.0, 3.0, 4001)
    value, slope, bend = np.array([end_taper(s, half_cell, 1.0) for s in inside]).T
    assert np.all(value[inside <= 0.0] == 0.0)
    np.testing.assert_allclose(value[inside >= TAPER], 1.0, rtol=1e-14)
    assert value.min() >= 0.0
    h = inside[1] - inside[0]
    np.testing.assert_allclose(np.diff(value) / h, 0.5 * (slope[1:] + slope[:-1]), atol=1e-6 / half_cell)
    np.testing.assert_allclose(np.diff(slope) / h, 0.5 * (bend[1:] + bend[:-1]), atol=2.01 / half_cell)


@pytest.mark.parametrize("intervals", [1, 2, 3, 4])
def test_shares_of_a_row_add_up_wherever_it_stands(intervals: int) -> None:
    """A face is loaded in proportion to its length over the other face; with three or more intervals the points are not at
    the middle of their cells."""
    nodes, weights = gauss_lobatto(intervals + 1)
    cells = np.array([(0.5 if abs(node) == 1.0 else 0.25) * weight for node, weight in zip(nodes, weights, strict=True)])
    places = (np.arange(-20, 20)[:, None] + 0.5 * nodes).ravel()
    for shift in np.linspace(0.0, 1.0, 23):
        parts = np.array([end_taper(x + shift, a, 2.0 * cells.max())[0] for x, a in
                          zip(places, np.tile(cells, 40), strict=True)])  # fmt: skip
        assert parts @ np.tile(weights / 2, 40) == pytest.approx(19.5 + shift, abs=1e-12 if intervals < 3 else 0.06)


def panels(spatial: bool, friction: Friction | None = None, damping: float = 0.0) -> SegmentSystem:
    """A panel of one long segment below a panel of three segments, half of which lie over the beginning of the long one."""
    def body(name: str, length: float, x: float, z: float) -> Body:
        outline = Plate(length=length, width=0.01, thickness=THICK)
        return Body(name=name, mass=1e-3, inertia=(1e-8, 1e-8, 1e-8), plate=outline, position=(x, 0.0, z))

    low = [body("low", LENGTH, 0.0, 0.0)]
    high = [body(f"high {k}", 0.3 * LENGTH, (0.3 * k - 0.56) * LENGTH, 0.97 * THICK) for k in range(3)]
    scene = Scene(
        bodies=(*low, *high),
        surfaces=(
            Surface(name="below", bodies=("low",)),
            Surface(name="above", bodies=tuple(each.name for each in high)),
        ),
        pairs=(ContactPair(first="below", second="above"),),
        contact=Contact(stiffness=STIFFNESS, damping=damping, ramp=1e-3),
        friction=friction,
    )  # fmt: skip
    return compile_scene(scene, spatial)


def states(system: SegmentSystem, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """The panels are slightly displaced and move, with points in the taper."""
    found = []
    rng = np.random.default_rng(5)
    q0, _ = system.initial()
    length = system.scales().increment / system.scales().length
    for _ in range(count):
        q = system.retract(q0, 3e-6 * rng.standard_normal(system.nu) * length)
        u = 0.01 * rng.standard_normal(system.nu) * length
        poses, rates = system.place(0.0, q, u)
        geometry = system.contacts[0].geometry
        part = geometry.kernels.tapered(geometry.table, poses, len(geometry.measure(poses, rates, 0.0).bodies))[1]
        assert np.any((part > 0.05) & (part < 0.95))
        found.append((q, u))
    return found


@SPATIAL
def test_force_is_the_slope_of_the_energy(spatial: bool) -> None:
    system = panels(spatial)
    for q, u in states(system, 3):
        force = system.force(0.0, q, 0.0 * u)
        h = 1e-8 * system.scales().increment / LENGTH
        slope = differences(lambda x, q=q, u=u: system.energy(0.0, system.retract(q, x), 0.0 * u).stored_at_rest, h)
        assert -slope == pytest.approx(force, abs=2e-6 * np.abs(force).max())


@SPATIAL
@pytest.mark.parametrize(
    "friction", [None, Friction(law="tanh", mu_dynamic=0.3, v_static=0.05)], ids=["smooth", "friction"]
)
def test_tangent_is_exact(friction: Friction | None, spatial: bool) -> None:
    system = panels(spatial, friction, damping=10.0)
    for q, u in states(system, 3):
        stiffness, damping = (matrix.toarray() for matrix in system.tangent(0.0, q, u))
        h = 1e-7 * system.scales().increment / LENGTH
        for k in range(system.nu):
            dx = np.zeros(system.nu)
            dx[k] = h[k]
            slope = system.force(0.0, system.retract(q, dx), u) - system.force(0.0, system.retract(q, -dx), u)
            np.testing.assert_allclose(
                stiffness[:, k], -slope / (2.0 * h[k]), atol=2e-6 * np.abs(stiffness[:, k]).max()
            )
            slope = system.force(0.0, q, u + 1e3 * dx) - system.force(0.0, q, u - 1e3 * dx)
            np.testing.assert_allclose(
                damping[:, k], -slope / (2e3 * h[k]), atol=2e-6 * np.abs(damping[:, k]).max() + 1e-10 * damping.max()
            )
