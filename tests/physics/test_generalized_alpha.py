"""Generalized-alpha: order, damping at infinite frequency, invariants, error control, related methods and failures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.builders.scene import build_scene
from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case, Strip
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.loads import Drive, Load
from fsm.case.models.materials import LinearCrease, Material
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.case.models.time_program import Ramp
from fsm.errors import NotConverged
from fsm.kernels.rotation import rotation_matrix
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_case import compile_case
from fsm.model.plan.planned import save_times
from fsm.model.system.system import SegmentSystem
from fsm.solve.interface.records import Linearised
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import SavedState, Statistics
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.time.generalized_alpha import Coefficients, GeneralizedAlpha
from validation.closed_forms.bodies import top_scene

ALPHA = "generalized-alpha"
RADII = (0.0, 0.5, 0.8, 1.0)
State = tuple[np.ndarray, np.ndarray]


# systems ------------------------------------------------------------------------------------------------------------


@cache
def heavy_top() -> SegmentSystem:
    """The heavy top; the fixed point is a spring of 41 Hz, which the steps below resolve."""
    return compile_scene(top_scene(1e6, 1e3))


def chain(count: int, spatial: bool, held: bool, damping: float = 0.0) -> SegmentSystem:
    """A flexible chain of rods, hung at its first end or free; in space it rotates and bends about all axes."""
    length, keep = 1.0 / count, np.array([1.0, 1.0 if spatial else 0.0, 1.0])
    rng = np.random.default_rng(3)
    bodies, elements = [], []
    for i in range(count):
        bodies.append(
            Body(
                name=f"{i}",
                mass=0.2 / count,
                inertia=(2e-4 / count, 0.2 / count * length**2 / 12, 0.2 / count * length**2 / 12),
                position=((i + 0.5) * length, 0.0, 0.0),
                velocity=tuple(0.5 * rng.standard_normal(3) * keep),
                angular_velocity=tuple(rng.standard_normal(3) * (1.0 if spatial else 1.0 - keep)),
            )
        )
        if i or held:
            elements.append(
                ForceElement(
                    name=f"joint {i}",
                    inner=f"{i - 1}" if i else GROUND,
                    outer=f"{i}",
                    point_inner=(length / 2 if i else 0.0, 0.0, 0.0),
                    point_outer=(-length / 2, 0.0, 0.0),
                    translation=(2e2,) * 3,
                    rotation=(0.2 if i else 0.0,) * 3,
                    translation_damping=(damping * 2e2,) * 3,
                    rotation_damping=(damping * 0.2,) * 3,
                )
            )
    gravity = (0.0, 0.0, -9.81 if held else 0.0)
    return compile_scene(Scene(bodies=tuple(bodies), elements=tuple(elements), gravity=gravity), spatial)


@cache
def pendulum(spatial: bool) -> SegmentSystem:
    """A chain of four rods that swings about its first end."""
    return chain(4, spatial, held=True)


@cache
def free_chain() -> SegmentSystem:
    """An undamped chain of five rods in space that rotates and bends."""
    return chain(5, spatial=True, held=False)


def oscillator(stiffness: float) -> SegmentSystem:
    """1 kg between springs, at rest at the origin except for its initial velocity."""
    body = Body(name="mass", mass=1.0, inertia=(1.0,) * 3, velocity=(1.0, 0.0, 0.0))
    spring = ForceElement(name="spring", inner=GROUND, outer="mass", translation=(stiffness,) * 3, rotation=(1.0,) * 3)
    return compile_scene(Scene(bodies=(body,), elements=(spring,)))


@cache
def strip(travel: float = 0.02) -> SegmentSystem:
    """A small damped strip with contact and friction, pulled until its panels slide."""
    case = Case(
        strip=Strip(length=0.48, width=0.04, thickness=3e-4, panels=6, fold_angle=math.radians(83.0), segments_per_panel=4),
        material=Material(young=3e9, density=800, damping=1e-2),
        crease=LinearCrease(stiffness=9e-3),
        contact=Contact(stiffness=1e8, damping=10.0, ramp=1e-5),
        friction=Friction(law="step", mu_static=0.3, mu_dynamic=0.2, v_static=1e-3, v_dynamic=5e-3),
        drive=(Drive(crease=3, speed=0.05, travel=travel),),
    )
    return compile_scene(build_scene(case))


def run(solver: GeneralizedAlpha, end: float) -> list[float]:
    """Step to the end; returns the times of all steps."""
    times = []
    while solver.t < end:
        solver.step(end)
        times.append(solver.t)
    return times


# order --------------------------------------------------------------------------------------------------------------


def uniform(h: float, end: float) -> Iterator[float]:
    """Ends of equal steps."""
    count = round(end / h)
    yield from (end * (i + 1) / count for i in range(count))


def alternating(h: float, end: float) -> Iterator[float]:
    """Ends of alternating steps of 2/3 h and 4/3 h."""
    count = round(end / h)
    yield from (end * (i + 1 - (1 / 3 if i % 2 == 0 else 0.0)) / count for i in range(count))


def integrate(system: SegmentSystem, rho_inf: float, ends: Iterator[float], h: float) -> State:
    """State at the last of the end times, with one step to each."""
    solver = GeneralizedAlpha(system, 0.0, *system.initial(), 1e-9, rho_inf, fixed_step=2.0 * h)
    for count, end in enumerate(ends, 1):
        solver.step(end)
        assert solver.t == end
        assert solver.steps == count
    return solver.q, solver.u


@cache
def reference(name: str) -> State:
    """State at the end by Radau at a small tolerance, which is a method of another family."""
    system, end, _ = CASES[name]
    saved: list[SavedState] = []
    simulate(system(), Settings("Radau", 1e-11, end), [end], saved.append)
    return saved[-1].q, saved[-1].u


CASES: dict[str, tuple[Callable[[], SegmentSystem], float, float]] = {
    "top": (heavy_top, 0.04, 5e-4),
    "planar pendulum": (lambda: pendulum(False), 0.06, 4e-4),
    "spatial pendulum": (lambda: pendulum(True), 0.06, 4e-4),
}


def errors(name: str, rho_inf: float, ends: Callable[[float, float], Iterator[float]]) -> np.ndarray:
    """Errors of q and u, (2, 2), with a step and with half of it."""
    system, end, step = CASES[name]
    q, u = reference(name)
    found = []
    for h in (step, step / 2):
        reached = integrate(system(), rho_inf, ends(h, end), h)
        found.append([np.linalg.norm(system().difference(q, reached[0])), np.linalg.norm(reached[1] - u)])
    return np.array(found)


@pytest.mark.parametrize("ends", [uniform, alternating])
@pytest.mark.parametrize("rho_inf", RADII)
@pytest.mark.parametrize("name", CASES)
def test_order_two(name: str, rho_inf: float, ends: Callable[[float, float], Iterator[float]]) -> None:
    coarse, fine = errors(name, rho_inf, ends)
    order = np.log2(coarse / fine)
    assert order == pytest.approx([2.0, 2.0], abs=0.1)


@pytest.mark.parametrize("rho_inf", RADII[:-1])
def test_first_step_is_as_good_as_the_others(rho_inf: float) -> None:
    """If a starts as u', the error of u in the first step is of order 2; with the correct a it is of order 3.

    With rho_inf = 1 both are equal.
    """
    system, off = pendulum(True), []
    for h in (4e-4, 2e-4):
        u = integrate(system, rho_inf, uniform(h, h), h)[1]
        off.append(np.linalg.norm(u - integrate(system, 1.0, uniform(h / 40, h), h / 40)[1]))
    # the order is above 3 where the leading error term happens to be small
    assert math.log2(off[0] / off[1]) > 2.85


# damping at infinity ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rho_inf", [0.5, 0.8, 1.0])
def test_spectral_radius_at_infinity(rho_inf: float) -> None:
    h, count = 1e-2, 300
    solver = GeneralizedAlpha(oscillator((1e5 / h) ** 2), 0.0, *oscillator(1.0).initial(), 1e-6, rho_inf, fixed_step=h)
    speed = []
    for i in range(2 * count):
        solver.step((i + 1) * h)
        speed.append(abs(solver.u[0]))
    # all three roots are equal at infinite frequency, so the amplitude is rho^n times a quadratic function of n; at twice
    # the number of steps this adds at most a factor of 2^2, which is 0.5 % of the factor of a step here
    assert (speed[-1] / speed[count - 1]) ** (1.0 / count) == pytest.approx(rho_inf, rel=0.01)


def test_stiff_motion_vanishes_at_once_without_radius() -> None:
    h = 1e-2
    solver = GeneralizedAlpha(oscillator((1e5 / h) ** 2), 0.0, *oscillator(1.0).initial(), 1e-6, 0.0, fixed_step=h)
    for i in range(4):
        solver.step((i + 1) * h)
    assert abs(solver.u[0]) < 1e-6


def test_growing_steps_do_not_excite_stiff_motion() -> None:
    # if the whole of a - u' were rescaled, the velocity of this mode would grow by 1.07 per step
    solver = GeneralizedAlpha(oscillator(1e16), 0.0, *oscillator(1.0).initial(), 1e-6, 0.8, fixed_step=1.0)
    t, h = 0.0, 1e-2
    for _ in range(20):
        t, h = t + h, 1.2 * h
        solver.step(t)
    assert abs(solver.u[0]) < 0.9


# invariants ---------------------------------------------------------------------------------------------------------


def momentum(system: SegmentSystem, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear momentum, and angular momentum about the origin."""
    linear, angular = np.zeros(3), np.zeros(3)
    inertia = system.bodies.inertia[system.bodies.free]
    for pose, rate, mass in zip(q.reshape(-1, 7), u.reshape(-1, 6), inertia, strict=True):
        push = mass[:3] * rate[:3]
        linear += push
        angular += np.cross(pose[:3], push) + rotation_matrix(pose[3:]) @ (mass[3:] * rate[3:])
    return linear, angular


def drift(h: float) -> tuple[float, float]:
    """Largest change of linear and angular momentum of the free chain over 0.2 s, relative to their initial magnitudes."""
    system = free_chain()
    solver = GeneralizedAlpha(system, 0.0, *system.initial(), 1e-9, 0.8, fixed_step=h)
    linear, angular = momentum(system, solver.q, solver.u)
    worst = np.zeros(2)
    while solver.t < 0.2:
        solver.step(0.2)
        now = momentum(system, solver.q, solver.u)
        worst = np.maximum(worst, [np.linalg.norm(now[0] - linear), np.linalg.norm(now[1] - angular)])
    return float(worst[0] / np.linalg.norm(linear)), float(worst[1] / np.linalg.norm(angular))


def test_momentum_of_a_free_chain() -> None:
    coarse, fine = drift(1e-3), drift(5e-4)
    assert max(coarse[0], fine[0]) < 1e-12
    assert math.log2(coarse[1] / fine[1]) == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("rho_inf", [0.0, 0.5, 0.8])
def test_energy_of_a_free_chain_does_not_grow(rho_inf: float) -> None:
    system = free_chain()
    solver = GeneralizedAlpha(system, 0.0, *system.initial(), 1e-6, rho_inf, fixed_step=2e-3)
    energy = [system.energy(0.0, solver.q, solver.u).stored]
    while solver.t < 1.0:
        solver.step(1.0)
        energy.append(system.energy(solver.t, solver.q, solver.u).stored)
    # the energy of the method differs from this energy by a relative amount of (omega h)^2, which oscillates but does not
    # accumulate
    assert max(energy) < (1.0 + 5e-4) * energy[0]
    quarters = [np.mean(part) for part in np.array_split(energy, 4)]
    assert quarters[0] > quarters[1] > quarters[2] > quarters[3]


# error control ------------------------------------------------------------------------------------------------------


def controlled(name: str, rtol: float) -> tuple[float, int]:
    """Error relative to the scales, and number of steps, with error control."""
    system, end, _ = CASES[name]
    q, u = reference(name)
    solver = GeneralizedAlpha(system(), 0.0, *system().initial(), rtol)
    run(solver, end)
    scales = system().scales()
    off_q = system().difference(q, solver.q) / scales.increment
    return float(max(np.abs(off_q).max(), np.abs((solver.u - u) / (scales.velocity + np.abs(u))).max())), solver.steps


@pytest.mark.parametrize("name", CASES)
def test_error_follows_the_tolerance(name: str) -> None:
    tolerances = np.array([1e-4, 1e-5, 1e-6, 1e-7])
    found = np.array([controlled(name, rtol) for rtol in tolerances])
    # local errors of h^3 are kept at rtol, so steps are proportional to rtol^(-1/3) and errors to rtol^(2/3)
    of_error, of_steps = (np.polyfit(np.log(tolerances), np.log(column), 1)[0] for column in found.T)
    assert of_error == pytest.approx(2.0 / 3.0, abs=0.15)
    assert of_steps == pytest.approx(-1.0 / 3.0, abs=0.1)


@cache
def pulled(method: str, rtol: float) -> tuple[Statistics, EnergyBalance, list[SavedState]]:
    """The rubbing strip."""
    system = strip()
    saved: list[SavedState] = []
    end = system.end_time()
    assert end is not None
    statistics, energy_balance = simulate(system, Settings(method, rtol, end), list(np.linspace(0.0, end, 21)), saved.append)
    return statistics, energy_balance, saved


def test_strip_agrees_with_radau() -> None:
    """Contact, friction and a drive with a run-up; forces are the most difficult results."""
    _, _, exact = pulled("Radau", 1e-5)
    _, _, found = pulled(ALPHA, 1e-6)
    force = np.array([[record.observation.drive.force[0] for record in run] for run in (exact, found)])
    assert exact[-1].observation.pairs.force.sum() > 1e-3
    assert force[1] == pytest.approx(force[0], abs=2e-3 * np.abs(force[0]).max())
    off = strip().difference(exact[-1].q, found[-1].q) / strip().scales().increment
    assert np.abs(off).max() < 1e-3


def test_energy_balance_closes_and_improves() -> None:
    loose, tight = pulled(ALPHA, 1e-4)[1].relative_drift, pulled(ALPHA, 1e-6)[1].relative_drift
    assert tight < 1e-3
    assert tight < 0.3 * loose


def test_energy_balance_is_of_second_order() -> None:
    system = chain(4, spatial=False, held=True, damping=0.02)
    worst = []
    for h in (5e-4, 2.5e-4):
        _, energy_balance = simulate(system, Settings(ALPHA, 1e-9, 0.2, step=h), [], lambda saved: None)
        assert energy_balance.dissipated > 1e-2 * energy_balance.turnover
        worst.append(energy_balance.drift)
    # the dissipation of the method itself is of order 3 and contributes
    assert 1.85 < math.log2(worst[0] / worst[1]) < 3.1


# times that are hit -------------------------------------------------------------------------------------------------


def test_wanted_times_are_hit_exactly() -> None:
    statistics, _, saved = pulled(ALPHA, 1e-4)
    end = strip().end_time()
    assert [record.time for record in saved] == list(np.linspace(0.0, end, 21))
    assert len(statistics.points) == statistics.steps + 1


def towed(steps: int) -> np.ndarray:
    """Velocity of a mass on a damper, 0.1 s after the end of its drive."""
    bodies = (
        Body(name="mass", mass=1.0, inertia=(1.0,) * 3),
        Body(name="hand", mass=0.0, inertia=(0.0,) * 3, position=(1.0, 0.0, 0.0)),
    )
    tow = ForceElement(
        name="tow", inner="mass", outer="hand", point_inner=(1.0, 0.0, 0.0),
        translation=(100.0,) * 3, translation_damping=(10.0,) * 3, rotation=(10.0,) * 3, rotation_damping=(1.0,) * 3,
    )  # fmt: skip
    drive = Drive(body="hand", direction=(1.0, 0.0, 0.0), speed=1.0, travel=0.1, run_up=0.05)
    system = compile_scene(Scene(bodies=bodies, elements=(tow,), drives=(drive,)))
    stop = system.end_time()
    assert stop is not None
    solver = GeneralizedAlpha(system, 0.0, *system.initial(), 1e-9, fixed_step=0.1 / steps)
    assert set(system.motions[0].program.breaks()) - {0.0} <= set(run(solver, stop + 0.1))
    return solver.u


def test_order_two_past_the_stop_of_a_drive() -> None:
    """The force of the damper jumps at this time, and u' with it; if u' were carried across the jump, an order would be
    lost."""
    exact = towed(1280)
    coarse, fine = (float(np.linalg.norm(towed(steps) - exact)) for steps in (20, 40))
    assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_steps_end_where_loads_have_kinks() -> None:
    ramp = Load(body="0", force=(0.0, 0.0, 1.0), time=Ramp(kind="ramp", start=0.0123, end=0.0345))
    body = Body(name="0", mass=1.0, inertia=(1.0,) * 3)
    system = compile_scene(Scene(bodies=(body,), loads=(ramp,)))
    solver = GeneralizedAlpha(system, 0.0, *system.initial(), 1e-3)
    times = run(solver, 0.1)
    assert {0.0123, 0.0345, 0.1} <= set(times)


# rest and failure ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("spatial", [False, True])
def test_equilibrium_stays(spatial: bool) -> None:
    bodies = tuple(Body(name=f"{i}", mass=1.0, inertia=(0.1,) * 3, position=(float(i), 0.0, 0.0)) for i in range(3))
    joints = tuple(
        ForceElement(
            name=f"{i}", inner=f"{i}", outer=f"{i + 1}", point_inner=(0.5, 0.0, 0.0), point_outer=(-0.5, 0.0, 0.0),
            translation=(1e6,) * 3, rotation=(10.0,) * 3,
        )
        for i in range(2)
    )  # fmt: skip
    system = compile_scene(Scene(bodies=bodies, elements=joints), spatial)
    q, u = system.initial()
    solver = GeneralizedAlpha(system, 0.0, q, u, 1e-6)
    run(solver, 1.0)
    assert np.abs(solver.q - q).max() < 1e-13
    assert np.abs(solver.u).max() < 1e-13


class Broken(SegmentSystem):
    """A system whose forces are NaN beyond a time."""

    def __init__(self, system: SegmentSystem, until: float) -> None:
        self.__dict__.update(system.__dict__)
        self.until = until

    def force(self, t: float, *rest: Any, **more: Any) -> np.ndarray:
        """Force, or NaN beyond the time."""
        return super().force(t, *rest, **more) if t <= self.until else np.full(self.nu, np.nan)

    def linearise(self, t: float, *rest: Any, **more: Any) -> Linearised:
        """As the force."""
        linear = super().linearise(t, *rest, **more)
        return linear if t <= self.until else Linearised(np.full(self.nu, np.nan), linear.stiffness, linear.damping)


@pytest.mark.parametrize("step", [None, 1e-3])
def test_failure_says_when_and_where(step: float | None) -> None:
    system = Broken(pendulum(False), 0.0505)
    saved: list[SavedState] = []
    with pytest.raises(NotConverged) as caught:
        simulate(system, Settings(ALPHA, 1e-4, 0.1, step=step), [0.0, 0.05, 0.1], saved.append)
    words = str(caught.value)
    assert "t = 0.05" in words
    assert "equations of a step" in words
    assert "Fastest changing body" in words
    assert [record.time for record in saved] == [0.0, 0.05]


def test_steps_are_cut_before_failure() -> None:
    system = Broken(pendulum(False), 0.0505)
    solver = GeneralizedAlpha(system, 0.0, *system.initial(), 1e-4)
    with pytest.raises(NotConverged):
        run(solver, 0.1)
    assert solver.failed > 5
    # as near as steps of round-off size
    assert solver.t == pytest.approx(0.0505, abs=1e-9)


class Stopped(SegmentSystem):
    """An oscillator whose mass touches a stiff stop at 0.1 m on each side."""

    def __init__(self) -> None:
        self.__dict__.update(oscillator(1.0).__dict__)

    @staticmethod
    def _depth(q: np.ndarray) -> float:
        return float(np.sign(q[0]) * max(abs(q[0]) - 0.1, 0.0))

    def force(self, t: float, q: np.ndarray, *rest: Any, **more: Any) -> np.ndarray:
        """Force with that of the stops."""
        return np.asarray(super().force(t, q, *rest, **more) - 1e6 * self._depth(q) * np.eye(self.nu)[0])

    def linearise(self, t: float, q: np.ndarray, *rest: Any, **more: Any) -> Linearised:
        """As the force."""
        linear = super().linearise(t, q, *rest, **more)
        stiffness = linear.stiffness.data.copy()
        stiffness[0, 0, 0] += 1e6 if self._depth(q) else 0.0
        return Linearised(self.force(t, q, *rest, **more), linear.stiffness.with_data(stiffness), linear.damping)

    def arrays(self, ready: Any) -> None:
        """No kernel has these stops."""


def test_a_contact_that_begins_in_a_step_renews_the_tangent() -> None:
    """Corrections without its stiffness would be far too long: 648 iterations in place of 405, and four steps that fail."""
    system = Stopped()
    solver = GeneralizedAlpha(system, 0.0, *system.initial(), 1e-2, 0.6, fixed_step=0.01)
    run(solver, 1.0)
    assert solver.steps == 100
    assert solver.failed == 0
    assert solver.iterations < 450


def test_counters() -> None:
    statistics, _, _ = pulled(ALPHA, 1e-4)
    assert statistics.steps > 20
    assert statistics.newton_iterations >= statistics.steps
    assert statistics.jacobian_evaluations < statistics.newton_iterations < statistics.force_evaluations + 1
    assert 0.0 < statistics.smallest_step < 0.01


@pytest.mark.nightly
def test_demo_strip_has_radaus_peak() -> None:
    """The peak of strip_pull is 1.98545 N by Radau at rtol 1e-6."""
    demo = Path(__file__).parents[2] / "folding_cases" / "strip_pull" / "case.toml"
    case = load_case(demo, ['drive.0.travel="28 mm"', "expect=none"]).case
    _, system = compile_case(case)
    end = system.end_time()
    assert end is not None
    times = save_times(case.save, system.motions[0].program, end)
    statistics, _ = simulate(system, Settings(ALPHA, 1e-4, end), times, lambda saved: None)
    peak = max(drive.force[0] for drive, *_ in statistics.points)
    assert peak == pytest.approx(1.98545, rel=5e-4)
    assert statistics.steps < 1000


def test_newmark_is_the_method_without_its_two_shifts() -> None:
    """Constant mean acceleration: one step of a linear oscillator computed by hand, and no loss of energy."""
    coefficients = Coefficients.newmark()
    assert (coefficients.alpha_m, coefficients.alpha_f) == (0.0, 0.0)
    assert (coefficients.beta, coefficients.gamma) == (0.25, 0.5)
    mass = Body(name="mass", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.1, 0.0, 0.0))
    spring = ForceElement(name="spring", inner=GROUND, outer="mass", translation=(50.0,) * 3)
    system = compile_scene(Scene(bodies=(mass,), elements=(spring,)))
    q, u = system.initial()
    solver = GeneralizedAlpha(system, 0.0, q, u, 1e-9, None, 0.05)
    omega, h, x, v = 5.0, 0.05, 0.1, 0.0
    for _ in range(40):
        solver.step(2.0)
        a = -(omega**2) * x
        ahead = (x + h * v + 0.25 * h * h * a) / (1.0 + 0.25 * (omega * h) ** 2)
        x, v = ahead, v + 0.5 * h * (a - omega**2 * ahead)
        assert solver.q[0] == pytest.approx(x, abs=1e-9)
        assert solver.u[0] == pytest.approx(v, abs=1e-8)
    assert x * x + (v / omega) ** 2 == pytest.approx(0.01, rel=1e-9)
