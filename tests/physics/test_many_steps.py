"""Steps of generalized-alpha in one kernel compared with the same steps in Python for the same system."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fsm.builders.lattice import build_lattice
from fsm.builders.strip import build_strip
from fsm.case.models.case import Case
from fsm.case.models.flexible_facets import FoldData
from fsm.case.models.loads import Drive, Load
from fsm.case.models.materials import SplineCrease
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.case.models.time_program import Cycle, Ramp, Table
from fsm.kernels.programs import CONSTANT, half_sine, ramp, rectangle, sampled
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.fold_laws_of import fold_laws_of
from fsm.model.nodes.cable import CableGroup
from fsm.model.nodes.facets.folds import BETWEEN_POINTS, FoldGroup
from fsm.model.nodes.films.film import FilmMaterial, MembraneGroup
from fsm.model.nodes.loading import Forcing, Loading, SupportMotion, point_force
from fsm.model.nodes.system.build import CableMaterial, MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.nodes.tension_field import MOVING
from fsm.model.system.system import SegmentSystem
from fsm.solve.equations.newton import negative_pivots
from fsm.solve.outcome.run_io import inertia_counts
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.stepping import march as balances
from fsm.solve.stepping.march import march
from fsm.solve.stepping.model import DRIVES, STEADY, TIME
from fsm.solve.stepping.outcomes import STEPPED
from fsm.solve.time.generalized_alpha import GeneralizedAlpha
from tests.physics.test_many_steps_joined import opened

SPLINE = {"law": "spline", "angle": [-1.0, 0.0, 0.7, 1.5, 3.0], "moment": [-3e-4, 0.0, 1e-4, 1.5e-4, 4e-4]}


def undriven(system: SegmentSystem) -> SegmentSystem:
    """The same system without drives and contacts. The driven bodies are held."""
    return SegmentSystem(system.bodies, (), tuple(g for g in system.groups if g not in system.contacts), ())


def strip(spatial: bool) -> SegmentSystem:
    """Panels of three segments with splined creases, dampers and gravity."""
    data: dict[str, Any] = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": "80 deg", "segments_per_panel": 3,
        },
        "material": {"young": 3e6, "density": 800, "damping": 1e-3},
        "crease": SPLINE,
        "gravity": [0.0, 0.0, -9.81],
        "drive": [{"crease": 3, "speed": "2 mm/s", "travel": "150 mm"}],
    }  # fmt: skip
    return undriven(compile_scene(build_strip(Case.model_validate(data)), spatial))


def lattice(driven: bool = False) -> SegmentSystem:
    """Rotating squares on ligaments, pulled slowly or held."""
    data: dict[str, Any] = {
        "lattice": {
            "columns": 1, "rows": 4, "spacing": 0.015, "hinge_length": 2e-3, "angle": 0.3, "axial": 1e3, "shear": 1e2,
            "rotational": 1e-3, "depth": 0.01, "density": 1200.0, "damping": 1e-4,
        },
        "drive": [{"edge": "top", "speed": 1e-3, "travel": 1e-3}],
    }  # fmt: skip
    system = compile_scene(build_lattice(Case.model_validate(data)))
    return system if driven else undriven(system)


def ball_joints() -> SegmentSystem:
    """Three rods on ball joints with even rotational dampers."""
    bodies, elements = [], []
    for i in range(3):
        bodies.append(
            Body(name=f"{i}", mass=0.1, inertia=(1e-4, 2e-4, 3e-4), position=(0.1 * i + 0.05, 0.0, 0.0))
        )
        elements.append(
            ForceElement(
                name=f"joint {i}", inner=f"{i - 1}" if i else GROUND, outer=f"{i}",
                point_inner=(0.05 if i else 0.0, 0.0, 0.0), point_outer=(-0.05, 0.0, 0.0), translation=(1e3,) * 3,
                translation_damping=(0.1,) * 3, rotation_damping=(1e-4,) * 3,
            )
        )  # fmt: skip
    return compile_scene(Scene(bodies=tuple(bodies), elements=tuple(elements), gravity=(0.0, 1.0, -9.81)), True)


TABLE = Table(kind="table", time=(0.0, 0.004, 0.01), value=(0.0, 1.0, -0.5), interpolation="linear")
LOADS = (
    Load(body="2", point=(0.02, 0.01, 0.03), force=(1.0, 0.0, 2.0), moment=(0.0, 0.1, 0.0), time=TABLE),
    Load(body="1", point=(0.02, 0.0, 0.03), force=(1.0, 0.0, 2.0), follower=True, time=Cycle(kind="cycle", period=0.01)),
    Load(body="0", moment=(0.0, 0.1, 0.0), time=Ramp(kind="ramp", start=0.001, end=0.02)),
    Load(body="2", force=(1.0, 0.0, 0.0)),
)
TURN = Drive(body="0", turn=1.0, rate=5.0, axis=(0.0, 0.6, 0.8), point=(0.0, 0.0, 0.01))
PLANAR_TURN = Drive(body="0", turn=1.0, rate=5.0, point=(0.0, 0.0, 0.01))
ZIGZAG = Drive(body="0", direction=(0.0, 0.0, 1.0), travel=0.01, time=TABLE)
CYCLE = Drive(body="0", travel=0.01, time=Cycle(kind="cycle", period=0.01, cycles=1, form="alternating"))


LOOP: dict[str, Any] = {"rotation": (0.1, 0.0, 0.1), "crease": SplineCrease(
    law="spline", angle=(-1.0, 0.0, 1.0), moment=(-0.1, 0.0, 0.1), unloading=(-0.105, -0.01, 0.1), reversal=0.02
)}  # fmt: skip
"""Creases with loading and unloading curves."""
TURNING = {"rest_turn": 0.5, "rest_time": Table(kind="table", time=(0.0, 2e-3, 5e-3, 0.02), value=(0.0, 1.0, 0.8, -1.0))}


def rods(
    spatial: bool, loads: tuple[Load, ...] = (), drives: tuple[Drive, ...] = (), damping: float = 1e-4, **joint: Any
) -> SegmentSystem:
    """Three rods in a row on springs; the first rod is joined to the ground or driven."""
    bodies, elements = [], []
    for i in range(3):
        bodies.append(Body(name=f"{i}", mass=0.1, inertia=(1e-4, 2e-4, 3e-4), position=(0.1 * i + 0.05, 0.0, 0.0)))
        if i == 0 and drives:
            continue
        elements.append(
            ForceElement(
                name=f"joint {i}", inner=f"{i - 1}" if i else GROUND, outer=f"{i}",
                point_inner=(0.05 if i else 0.0, 0.0, 0.0), point_outer=(-0.05, 0.0, 0.0), translation=(1e3,) * 3,
                translation_damping=(1e3 * damping,) * 3, rotation_damping=(damping,) * 3,
                **{"rotation": (0.1,) * 3} | joint,
            )
        )  # fmt: skip
    gravity = (0.0, 1.0 if spatial else 0.0, -9.81)
    scene = Scene(bodies=tuple(bodies), elements=tuple(elements), gravity=gravity, loads=loads, drives=drives)
    return compile_scene(scene, spatial)


def cables(viscosity: float, pulsed: bool, moved: bool, **options: bool) -> AncfSystem:
    """Four ANCF cables in a row, held at one end, with weight, a mass at the tip, pulses on the tip, and a moved end."""
    builder = MeshBuilder(size=6)
    line = builder.cable(np.zeros(3), np.array([1.0, 0.0, 0.2]), CableMaterial(1e6, 1000.0, 0.02), 4)
    builder.hold(line[0, 0])
    builder.point_mass(line[-1, 0], 0.1)
    mesh = builder.build()
    (group,) = mesh.groups
    assert isinstance(group, CableGroup)
    mesh = replace(mesh, groups=(replace(group, viscosity=viscosity, **options),))
    tip, count = int(line[-1, 0]), len(mesh.coordinates)
    functions = [half_sine(4e-3, 1e-3), rectangle(0.01), sampled((1e-3, 3e-3, 0.02), (0.5, 1.0, -1.0)), CONSTANT.scaled(0.2)]
    forces = [point_force(count, tip, 0.1 * np.eye(3)[k % 3]) for k in range(4)]
    forcings = tuple(Forcing(*pair) for pair in zip(forces, functions, strict=True)) if pulsed else ()
    motion = SupportMotion(tip + np.array([0, 2]), np.array([3e-3, 4e-3]), ramp(0.015, 2e-3))
    damping = 1.0 if pulsed else 0.0
    return AncfSystem(mesh, Loading(forcings, (motion,) if moved else (), (0.0, 1.0, -9.81), damping))


def films(viscosity: float, tension_field: bool) -> AncfSystem:
    """A tensioned film of two materials, held at one edge and moved at the other, with a load and damping by mass."""
    builder, cells = MeshBuilder(), np.array([[0, 0], [0, 1], [0, 0]])
    materials = FilmMaterial(1e6, 0.3, 1000.0, 1e-3), FilmMaterial(2e6, 0.3, 1000.0, 2e-3)
    x, y = np.array([0.0, 0.3, 0.7, 1.0]), np.array([0.0, 0.4, 0.9])
    grid = builder.film(x, y, materials, cells, tension_field, viscosity)
    builder.transform(0, np.eye(3), np.zeros(3), (1e-3, 2e-3))
    builder.hold(grid.edge("left"))
    mesh = builder.build()
    count, moved = len(mesh.coordinates), grid.edge("right") + 2
    forcing = Forcing(point_force(count, int(grid.position[1, 1]), np.array([0.0, 0.1, 0.2])), half_sine(4e-3, 1e-3))
    motion = SupportMotion(moved, np.full(len(moved), 1e-3), ramp(0.015, 2e-3))
    system = AncfSystem(mesh, Loading((forcing,), (motion,), (0.0, 0.0, -9.81), 1.0))
    for group in mesh.groups:
        if isinstance(group, MembraneGroup):
            group.release(system.start, MOVING)
    return system


def folds(loop: bool) -> AncfSystem:
    """Three cables with a fold between their ends. The fold has two branches, or its rest angle moves."""
    builder, material = MeshBuilder(size=6), CableMaterial(1e5, 1000.0, 0.02)
    ends = [(0.0, 0.1), (0.5, 0.3), (1.0, 0.0)]
    lines = [builder.cable(np.array([0.0, y, 0.0]), np.array([1.0, y, z]), material, 1) for y, z in ends]
    for line in lines:
        builder.hold(line[0, 0])
    mesh = builder.build()
    corners = np.array([[lines[0][1, 0], lines[1][0, 0], lines[1][1, 0], lines[2][1, 0]]], dtype=np.int64)
    unknown = fold_laws_of(FoldData.linear(np.ones(1), np.zeros(1), np.zeros(1)))
    start = FoldGroup(corners, BETWEEN_POINTS[None], unknown).angles(mesh.coordinates)
    data = FoldData.linear(np.ones(1), start, start)
    if loop:
        data = replace(data, laws=(LOOP["crease"],), share=np.full(1, 20.0))
    else:
        data = replace(data, turning=np.full(1, 2.0))
    laws = replace(fold_laws_of(data), time=half_sine(0.02, -1e-3))
    group = FoldGroup(corners, BETWEEN_POINTS[None], laws)
    cables = (replace(one, viscosity=1e-4) for one in mesh.groups)
    return AncfSystem(replace(mesh, groups=(*cables, group)), Loading((), (), (0.0, 0.0, -9.81), 0.0))


DRIVEN: dict[str, Callable[[], SegmentSystem | AncfSystem]] = {
    "moved cables": lambda: cables(1e-4, True, True),
    "moved film": lambda: films(1e-4, False),
    "moved tension field": lambda: films(0.0, True),
    "turned in the plane": lambda: rods(False, drives=(PLANAR_TURN,)),
    "turned in space": lambda: rods(True, drives=(TURN,)),
    "pulled by a table": lambda: rods(False, LOADS[:1], (ZIGZAG,)),
    "pulled by a cycle": lambda: rods(True, LOADS[:1], (CYCLE,)),
}
SYSTEMS: dict[str, Callable[[], SegmentSystem | AncfSystem]] = {
    "cables": lambda: cables(1e-3, True, False, engineering=True),
    "tension-only cables": lambda: cables(1e-3, False, False, tension_only=True),
    "fold whose rest angle moves": lambda: folds(False),
    "fold with hysteresis": lambda: folds(True),
    "strip in the plane": lambda: strip(False),
    "strip in space": lambda: strip(True),
    "lattice": lattice,
    "ball joints": ball_joints,
    "loads in the plane": lambda: rods(False, LOADS),
    "loads in space": lambda: rods(True, LOADS),
    "hysteresis in the plane": lambda: rods(False, **LOOP),
    "hysteresis in space": lambda: rods(True, **LOOP),
    "hysteresis without dampers": lambda: rods(True, damping=0.0, **LOOP),
    "rest angles that move": lambda: rods(True, **TURNING),
    **DRIVEN,
}


def solver_of(system: SegmentSystem | AncfSystem, fixed_step: float | None) -> GeneralizedAlpha:
    """A solver at the start, with random velocities."""
    q, u = system.initial()
    scale = system.scales().increment
    u = u + scale * np.random.default_rng(1).standard_normal(len(u))
    if isinstance(system, AncfSystem):
        u[system.fixed] = 0.0
    return GeneralizedAlpha(system, 0.0, q, u, 1e-5, fixed_step=fixed_step)


@pytest.mark.parametrize("fixed_step", [None, 2e-4], ids=["controlled", "fixed"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_same_steps(name: str, fixed_step: float | None) -> None:
    """States, counts, work and energies of 40 steps agree."""
    compiled, python = (solver_of(SYSTEMS[name](), fixed_step) for _ in range(2))
    assert compiled.marches
    balance, others = opened(compiled), opened(python)
    until = 0.02 if name in DRIVEN else 1.0
    records, expected = compiled.march(balance, until, 40, every=True), python.records(40)
    assert march(python.model, python.motion, python.rules, others, until, 40, expected) == STEPPED
    assert compiled.steps == python.steps == len(records)
    assert len(records) == 40 or compiled.t == until
    assert (compiled.iterations, compiled.rejected) == (python.iterations, python.rejected)
    assert compiled.t == pytest.approx(python.t, rel=1e-6)
    scales = python.system.scales()
    assert np.abs((compiled.q - python.q) / scales.configuration).max() < 1e-6
    assert np.abs((compiled.u - python.u) / np.abs(python.u).max()).max() < 1e-6
    turnover = others[balances.TURNOVER]
    assert turnover > 0.0
    assert np.abs(balance[: balances.POWER] - others[: balances.POWER]).max() < 1e-6 * turnover
    known = np.arange(records.shape[1]) != STEADY
    assert np.abs(records - expected[: len(records)])[:, known].max() < 1e-6 * np.abs(expected).max()
    if name in DRIVEN:
        drives = slice(DRIVES, DRIVES + 2)
        assert records[:, drives] == pytest.approx(expected[: len(records), drives], rel=1e-6, abs=1e-9)
    if name != "lattice":
        assert balance[balances.DISSIPATED] > 1e-4 * turnover


@pytest.mark.parametrize("spatial", [False, True], ids=["plane", "space"])
def test_a_kernel_that_cannot_solve_leaves_the_step_to_python(spatial: bool) -> None:
    """If the kernel gives up a step, Python takes it from the state before it."""
    whole, helped = (solver_of(strip(spatial), None) for _ in range(2))
    whole.march(opened(whole), 1.0, 20)
    balance = opened(helped)
    helped.march(balance, 1.0, 10)
    assert helped._arrays is not None
    flags = helped._arrays.arrays.flags
    flags[-1] = 1
    helped.march(balance, 1.0, 10)
    assert helped.steps == 11
    assert flags[-1] == 0
    helped.march(balance, 1.0, 9)
    assert helped.t == pytest.approx(whole.t, rel=1e-3)
    assert np.abs(helped.q - whole.q).max() < 1e-4 * np.abs(whole.q).max()


def test_saved_states_and_energy_balance_of_a_run() -> None:
    """A run reports the requested states at their times, with the energies of the system there."""
    system = ball_joints()
    times = [0.0, 0.013, 0.05]
    saved: list[Any] = []
    statistics, energy_balance = simulate(system, Settings("generalized-alpha", 1e-6, 0.05), times, saved.append)
    assert [state.time for state in saved] == times
    for state in saved:
        energy = system.energy(state.time, state.q, state.u)
        assert state.observation.energy.stored == pytest.approx(energy.stored, rel=1e-12)
    assert energy_balance.relative_error < 1e-4
    assert statistics.factorisations > 0
    assert 0.0 < statistics.smallest_step < 0.05


def test_times_without_decimals() -> None:
    """A run to a whole number of seconds, and then to a fraction, ends at both."""
    system = cables(1e-3, False, False)
    saved: list[Any] = []
    simulate(system, Settings("generalized-alpha", 1e-2, 1.25, step=0.125), [1, 1.25], saved.append)
    assert [state.time for state in saved] == [1.0, 1.25]


@pytest.mark.parametrize("name", DRIVEN)
def test_curve_of_a_run_with_a_drive(name: str) -> None:
    """Forces of the drive at the ends of all steps, and the energy balance, as in a run that steps in Python."""
    found = []
    for arrays in (True, False):
        system = DRIVEN[name]()
        if not arrays:
            system.__dict__["arrays"] = lambda ready: None
        # in Python a run has a restart point after 64 steps
        settings = Settings("generalized-alpha", 1e-2 if isinstance(system, AncfSystem) else 1e-4, 0.02)
        found.append(simulate(system, settings, [0.0, 0.01, 0.02], lambda saved: None))
    (statistics, balance), (others, other) = found
    assert statistics.steps == others.steps < 64
    assert [point.path for point in statistics.points] == [point.path for point in others.points]
    for one, two in zip(statistics.points, others.points, strict=True):
        assert one.time == pytest.approx(two.time, rel=1e-9)
        assert one.drive.travel == pytest.approx(two.drive.travel, rel=1e-6, abs=1e-12)
        assert one.drive.force == pytest.approx(two.drive.force, rel=1e-6, abs=1e-6)
    assert balance.work == pytest.approx(other.work, rel=1e-6)
    assert balance.worst == pytest.approx(other.worst, rel=1e-4)


def test_steps_near_equilibria() -> None:
    """States of a slow drive that a kernel calls steady have little inertia and no negative pivots, and there are many such
    states."""
    system = lattice(driven=True)
    q, u = system.initial()
    solver = GeneralizedAlpha(system, 0.0, q, u, 1e-4)
    records = solver.march(opened(solver), 1.0, 600, every=True)
    state = DRIVES + 2
    steady = 0
    for record in records[::30]:
        t, q, u = float(record[TIME]), record[state : state + len(q)].copy(), record[state + len(q) :].copy()
        known = not inertia_counts(system, t, q, u, system.observe(t, q, u)) and negative_pivots(system, t, q) == 0
        assert known == (record[STEADY] == 1.0)
        steady += known
    assert steady > 5


def test_without_the_compiler() -> None:
    """Where kernels are not compiled, systems step in Python."""
    code = """
from fsm.case.models.scene import Body, Scene
from fsm.model.compile.compile import compile_scene
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
body = Body(name="free", mass=0.1, inertia=(1e-4, 2e-4, 3e-4))
system = compile_scene(Scene(bodies=(body,), gravity=(0.0, 0.0, -9.81)), False)
simulate(system, Settings("generalized-alpha", 1e-3, 1e-3), [0.0], lambda saved: print(saved.time))
"""
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode, done.stdout) == (0, "0.0\n"), done.stderr
