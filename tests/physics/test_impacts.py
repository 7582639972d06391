"""Impacts computed by the complete program: restitution, duration, energy and order of convergence."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from fsm.case.models.contact import Contact
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, Scene, Surface
from fsm.laws.normal import NORMAL_LAWS
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.time.generalized_alpha import GeneralizedAlpha

LENGTH, THICK, MASS, G = 0.02, 1e-4, 4e-5, 9.81
TARGETS = ("surface", "plate", "plane")
# of 1 m/s: a plate that is hit at an edge rotates during the impact, and its arm changes
OF_SPEED = 1e-3
DIMENSIONS = pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
ACROSS = MASS * LENGTH**2 / 12  # moment of inertia of a thin square plate about an axis in its plane


def falling(
    target: str,
    contact: Contact,
    height: float,
    speed: float = 0.0,
    thick: float = THICK,
    floor_length: float = 0.08,
    **plate: Any,
) -> Scene:
    """A square plate whose middle is at a given height above the top of a floor, which is a surface, a plate or a
    half-space.

    The plate practically cannot rotate unless its inertia is given.
    """
    outline = Plate(length=LENGTH, width=LENGTH, thickness=thick)
    keys = {"mass": MASS, "inertia": (1.0, 1.0, 1.0), "velocity": (0.0, 0.0, -speed)} | plate
    body = Body(name="plate", plate=outline, position=(0.0, 0.0, height), **keys)
    top = Plate(length=floor_length, width=floor_length, thickness=thick)
    at = (0.0, 0.0, -thick / 2)
    floor = Body(name="floor", mass=1.0, inertia=(1.0, 1.0, 1.0), held=True, plate=top, position=at)
    if target == "plane":
        ground = (Obstacle(name="floor", shape="plane"),)
        return Scene(bodies=(body,), obstacles=ground, pairs=(ContactPair(first="plate", second="floor"),), contact=contact)
    surfaces = (Surface(name="low", bodies=("floor",)), Surface(name="high", bodies=("plate",)))
    names = ("high", "low") if target == "surface" else ("plate", "floor")
    pair = ContactPair(first=names[0], second=names[1])
    return Scene(bodies=(floor, body), surfaces=surfaces, pairs=(pair,), contact=contact)


def flight(system: SegmentSystem, rtol: float) -> GeneralizedAlpha:
    q, u = system.initial()
    system.commit(0.0, q, u)
    return GeneralizedAlpha(system, 0.0, q, u, rtol)


def bounce(system: SegmentSystem, rtol: float, end: float = 1.0) -> GeneralizedAlpha:
    """The state in which the first impact is over."""
    solver, touched = flight(system, rtol), False
    while solver.t < end:
        solver.step(end)
        touching = system.observe(solver.t, solver.q, solver.u).pairs.gap.min() < 0.0
        if touched and not touching:
            return solver
        touched = touched or touching
    raise AssertionError("it does not come back")


def delivered(contact: Contact) -> float:
    """e of h (1 + e) = ln[(1 + h)/(1 - h e)]."""
    h = float(NORMAL_LAWS[contact.law].params(contact)[2])
    most = min(1.0, 1.0 / h) * (1 - 1e-13)
    return float(brentq(lambda e: h * (1 + e) - math.log((1 + h) / (1 - h * e)), 1e-9, most, xtol=1e-14))


def upwards(spatial: bool) -> int:
    return 2 if spatial else 1


# restitution ------------------------------------------------------------------------------------------------------


@DIMENSIONS
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize(
    "law",
    [
        "restitution",
        *(pytest.param(law, marks=pytest.mark.nightly) for law in ("hunt-crossley", "lankarani-nikravesh", "flores")),
    ],
)
def test_a_plate_that_lands_flat_comes_back_as_asked(law: Any, target: str, spatial: bool) -> None:
    for c in (0.1, 0.3, 0.5, 0.7, 0.9):
        contact = Contact(law=law, stiffness=1e8, restitution=c, speed_floor=1e-6)
        system = compile_scene(falling(target, contact, THICK, 1.0), spatial)
        up = bounce(system, 1e-5).u[upwards(spatial)]
        assert up == pytest.approx(delivered(contact), rel=1e-3)


@DIMENSIONS
@pytest.mark.parametrize("target", TARGETS)
def test_restitution_at_a_loose_tolerance(target: str, spatial: bool) -> None:
    for c in (0.1, 0.5, 0.9):
        contact = Contact(stiffness=1e8, restitution=c, speed_floor=1e-6)
        system = compile_scene(falling(target, contact, THICK, 1.0), spatial)
        assert bounce(system, 1e-3).u[upwards(spatial)] == pytest.approx(c, rel=3e-3)


@pytest.mark.parametrize("speed", [0.01, 50.0])
def test_restitution_at_any_speed(speed: float) -> None:
    for target in TARGETS:
        contact = Contact(stiffness=1e12, restitution=0.5, speed_floor=1e-6)
        system = compile_scene(falling(target, contact, 2e-2, speed), False)
        assert bounce(system, 1e-5, 10.0).u[1] / speed == pytest.approx(0.5, rel=1e-3)


@pytest.mark.parametrize("c", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("target", TARGETS)
def test_a_plate_that_lands_on_an_edge(target: str, c: float) -> None:
    """The end of the plate rebounds with the given restitution; the impulse is that of the mass there, 1/(1/m + arm^2/J)."""
    tilt = 0.5
    contact = Contact(stiffness=1e10, restitution=c, speed_floor=1e-6)
    turned = (math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0)
    scene = falling(target, contact, 0.012, 1.0, orientation=turned, inertia=(ACROSS, ACROSS, 2 * ACROSS))
    end = bounce(compile_scene(scene, False), 1e-5)
    arm = 0.5 * LENGTH * math.cos(end.q[2])
    assert end.u[1] - end.u[2] * arm == pytest.approx(c, abs=OF_SPEED)
    effective = 1.0 / (1.0 / MASS + (0.5 * LENGTH * math.cos(tilt)) ** 2 / ACROSS)
    assert MASS * (end.u[1] + 1.0) == pytest.approx(effective * (1.0 + c), rel=1e-3)
    assert end.u[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("c", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("target", ["plate", "plane"])
def test_a_plate_that_lands_on_a_corner(target: str, c: float) -> None:
    """The same about a diagonal axis, which is also a principal axis of a square plate."""
    tilt = 0.5
    axis = math.sin(tilt / 2) / math.sqrt(2)
    contact = Contact(stiffness=1e10, restitution=c, speed_floor=1e-6)
    scene = falling(
        target, contact, 0.012, 1.0, orientation=(math.cos(tilt / 2), axis, axis, 0.0), inertia=(ACROSS, ACROSS, 2 * ACROSS)
    )
    end = bounce(compile_scene(scene, True), 1e-5)
    arm = LENGTH / math.sqrt(2)
    effective = 1.0 / (1.0 / MASS + (arm * math.cos(tilt)) ** 2 / ACROSS)
    assert MASS * (end.u[2] + 1.0) == pytest.approx(effective * (1.0 + c), rel=1e-3)
    spin = (end.u[3] + end.u[4]) / math.sqrt(2)
    assert end.u[2] - spin * arm * math.cos(tilt) == pytest.approx(c, abs=OF_SPEED)


@DIMENSIONS
@pytest.mark.parametrize(
    ("mass", "speed", "e"),
    [(0.1, 0.1, 0.5544), (0.1, 1, 0.1103), (1, 0.1, 0.5184), (1, 1, 0.4166), (10, 0.1, 0.7057), (10, 1, 0.7736)],
)
def test_impact_has_no_restitution_of_its_own(mass: float, speed: float, e: float, spatial: bool) -> None:
    """The table of docs/theory.md: K = 1e8 N/m^1.5, C = 1e3 N s/m, ramp 0.1 mm."""
    contact = Contact(law="impact", stiffness=1e8, damping=1e3, ramp=1e-4)
    system = compile_scene(falling("plane", contact, 5.1e-3, speed, 1e-2, mass=mass), spatial)
    assert bounce(system, 1e-5).u[upwards(spatial)] / speed == pytest.approx(e, rel=0.02)


@DIMENSIONS
def test_an_impact_in_the_very_first_step(spatial: bool) -> None:
    """However long the run is, its first step does not skip an impact."""
    contact = Contact(stiffness=1e8, restitution=0.1, speed_floor=1e-6)
    for target in TARGETS:
        system = compile_scene(falling(target, contact, THICK, 1.0), spatial)
        assert bounce(system, 1e-3, 100.0).u[upwards(spatial)] == pytest.approx(0.1, rel=3e-3)


# Hertz ------------------------------------------------------------------------------------------------------------


def cubic(before: np.ndarray, after: np.ndarray) -> Polynomial:
    """Height over a step from 0 to 1, from heights and speeds at its ends; rows of time, height, speed."""
    step = after[0] - before[0]
    rise, slopes = after[1] - before[1], step * np.array([before[2], after[2]])
    return Polynomial([before[1], slopes[0], 3 * rise - 2 * slopes[0] - slopes[1], slopes.sum() - 2 * rise])


def zero_of(curve: Polynomial) -> float:
    found = [x.real for x in curve.roots() if abs(x.imag) < 1e-9 and -1e-9 <= x.real <= 1 + 1e-9]
    return float(found[0])


@DIMENSIONS
@pytest.mark.parametrize("target", ["plane", "surface"])
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_depth_and_duration_of_an_elastic_impact(exponent: float, target: str, spatial: bool) -> None:
    """K belongs to the whole face; two surfaces of one size probe each other with half of it each."""
    stiffness, speed, up = 1e8, 1.0, upwards(spatial)
    contact = Contact(law="hertz", stiffness=stiffness, exponent=exponent)
    thick = 2e-2 if exponent > 2.0 else 2e-3
    system = compile_scene(falling(target, contact, thick / 2 + 1.3e-7, speed, thick, LENGTH), spatial)
    solver = flight(system, 1e-8)
    rows = [(0.0, 1.3e-7, -speed)]
    while rows[-1][1] <= 0.0 or rows[-1][2] <= 0.0:
        solver.step(1e-3)
        rows.append((solver.t, solver.q[up] - thick / 2, solver.u[up]))
    curve = np.array(rows)
    enter, leave = int(np.argmax(curve[:, 1] < 0.0)), len(curve) - 1
    turn = int(np.argmax(curve[:, 2] > 0.0))
    at = [
        curve[k - 1, 0] + zero_of(cubic(curve[k - 1], curve[k])) * (curve[k, 0] - curve[k - 1, 0]) for k in (enter, leave)
    ]
    lowest = cubic(curve[turn - 1], curve[turn])
    deepest = -lowest(zero_of(lowest.deriv()))
    expected = ((exponent + 1.0) * MASS * speed**2 / (2.0 * stiffness)) ** (1.0 / (exponent + 1.0))
    assert deepest == pytest.approx(expected, rel=1e-4)
    # 2 int_0^1 ds/sqrt(1 - s^(e + 1))
    n = exponent + 1.0
    factor = 2.0 * math.sqrt(math.pi) / n * math.gamma(1 / n) / math.gamma(1 / n + 0.5)
    if exponent == 1.5:
        assert factor == pytest.approx(2.943275, abs=5e-7)
    assert at[1] - at[0] == pytest.approx(factor * expected / speed, rel=1e-4)


# bouncing ---------------------------------------------------------------------------------------------------------


@DIMENSIONS
@pytest.mark.parametrize("target", ["plane", "surface"])
@pytest.mark.parametrize("e", [0.5, pytest.param(0.8, marks=pytest.mark.nightly)])
def test_fifteen_bounces(e: float, target: str, spatial: bool) -> None:
    """Duration sqrt(2 H/g) (1 + 2 (e + e^2 + ...)), and the speed at separation; the contact is so stiff that gravity has no
    effect."""
    height, up = 10.0, upwards(spatial)
    contact = Contact(stiffness=1e12, restitution=e, speed_floor=1e-6)
    scene = falling(target, contact, height + THICK / 2).model_copy(update={"gravity": (0.0, 0.0, -G)})
    solver = flight(compile_scene(scene, spatial), 1e-4)
    bounces, touched = 0, False
    while bounces < 15:
        solver.step(30.0)
        touching = solver.q[up] < THICK / 2
        bounces += touched and not touching
        touched = touching
    exact = math.sqrt(2 * height / G) * (1 + 2 * sum(e**k for k in range(1, 15)))
    assert solver.t == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize(("law", "least", "most"), [({}, 20, 40), ({"restitution": 0.9}, 60, 120)])
def test_steps_of_an_impact_at_a_loose_tolerance(law: dict[str, float], least: int, most: int) -> None:
    """A law with a coefficient of restitution needs more steps than the error control of a large tolerance gives."""
    solver = flight(compile_scene(falling("plane", Contact(stiffness=1e8, **law), 1e-3, speed=1.0), False), 1e-2)
    touching = 0
    while solver.u[1] < 0.0 or solver.q[1] < THICK / 2:
        solver.step(0.1)
        touching += int(solver.q[1] < THICK / 2)
    assert least <= touching <= most


# order and energy -------------------------------------------------------------------------------------------------


def on_a_spring(spatial: bool) -> SegmentSystem:
    """A plate that a spring pulls down onto the floor, where it bounces several times."""
    scene = falling("plane", Contact(law="hertz", stiffness=1e5), 0.012, thick=2e-3)
    stretched = ForceElement(
        name="spring", inner="ground", outer="plate", point_inner=(0.0, 0.0, 0.005), translation=(1.0, 1.0, 1.0)
    )
    return compile_scene(scene.model_copy(update={"elements": (stretched,)}), spatial)


def spinning() -> SegmentSystem:
    """A plate that rotates about all its axes as it falls, and hits the floor with a corner."""
    turned = (math.cos(0.2), 0.0, math.sin(0.2), 0.0)
    scene = falling(
        "plane", Contact(law="hertz", stiffness=1e6), 0.015, 1.0, 2e-3,
        inertia=(1e-9, 1.5e-9, 2e-9), orientation=turned, angular_velocity=(40.0, 90.0, 60.0),
    )  # fmt: skip
    return compile_scene(scene, True)


def ends(system: SegmentSystem, end: float, rtols: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """End states, numbers of steps, and energy errors."""
    states, steps, errors = [], [], []
    for rtol in rtols:
        seen: list[SavedState] = []
        statistics, energy_balance = simulate(system, Settings("generalized-alpha", rtol, end), [end], seen.append)
        assert max(force.max() for _, force, *_ in statistics.points) > 0.1  # it did strike
        states.append(np.concatenate([seen[-1].q, seen[-1].u / np.abs(seen[-1].u).max()]))
        steps.append(statistics.steps)
        errors.append(energy_balance.relative_error)
    return np.array(states), np.array(steps), errors


@pytest.mark.parametrize(
    "build",
    [
        lambda: (on_a_spring(False), 0.03),
        pytest.param(lambda: (on_a_spring(True), 0.03), marks=pytest.mark.nightly),
        pytest.param(lambda: (spinning(), 0.02), marks=pytest.mark.nightly),
    ],
    ids=["spring, plane", "spring, space", "spinning"],
)
def test_order_two_across_elastic_impacts(build: Any) -> None:
    states, steps, energy = ends(*build(), (1e-5, 1e-6, 1e-7, 1e-9))
    error = np.abs(states[:-1] - states[-1]).max(axis=1)
    order = math.log(error[0] / error[2]) / math.log(steps[2] / steps[0])
    assert order > 1.8
    # errors are compared with steps, not with tolerances, because impacts have their own steps at any tolerance
    assert (np.log(error[:-1] / error[1:]) / np.log(steps[1:-1] / steps[:-2]) > 1.5).all()
    assert energy[2] < 1e-4


@DIMENSIONS
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize(
    "keys",
    [{"restitution": 0.3}, pytest.param({"restitution": 0.9}, marks=pytest.mark.nightly), {}],
    ids=["c = .3", "c = .9", "elastic"],
)
def test_energy_through_an_impact(keys: dict[str, float], target: str, spatial: bool) -> None:
    """The energy that the contact damping dissipates is the energy that the plate has lost."""
    contact = Contact(stiffness=1e8, **keys)
    system = compile_scene(falling(target, contact, THICK, 1.0), spatial)
    seen: list[SavedState] = []
    _, energy_balance = simulate(system, Settings("generalized-alpha", 1e-7, 2e-4), [2e-4], seen.append)
    assert seen[-1].u[upwards(spatial)] > 0.2
    assert energy_balance.relative_error < 1e-4
    lost = 0.5 * MASS * (1.0 - keys.get("restitution", 1.0) ** 2)
    assert energy_balance.pair_energy[1, 0] == pytest.approx(lost, rel=1e-3, abs=1e-8)
