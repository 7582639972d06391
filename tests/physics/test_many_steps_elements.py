"""Many steps of a mesh of each kind of element in one kernel, against the same steps in Python."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.analyses.array import compile_array
from fsm.case.checks.check_scissor import default_holds
from fsm.case.loading.load_case import load_case
from fsm.case.models.flexible_facets import FoldData
from fsm.case.models.materials import Material
from fsm.case.models.scissor import BarSection, HingeJoint, PointForce, Scissor, Stop
from fsm.case.models.time_program import Ramp
from fsm.model.compile.compile_case import compile_case
from fsm.model.compile.fold_laws_of import fold_laws_of
from fsm.model.joined.system import JoinedSystem
from fsm.model.nodes.facets.folds import BETWEEN_POINTS, FoldGroup
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.loading import Loading
from fsm.model.nodes.system.build import MeshBuilder
from fsm.model.nodes.system.from_deployed import CreaseLine, DeployedStrip, deployed_mesh
from fsm.model.nodes.system.scissor_system import ScissorSystem
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.nodes.truss import BarGroup
from fsm.solve.stepping import march as balances
from fsm.solve.stepping.march import march
from fsm.solve.stepping.mean_force import march_mean_force
from fsm.solve.stepping.outcomes import STEPPED
from fsm.solve.time.array_steps import StepMethod
from fsm.solve.time.generalized_alpha import GeneralizedAlpha
from fsm.solve.time.mean_force import MeanForce
from tests.physics.test_many_steps_joined import check_same_state, opened

STEEL = Material(young=2.07e11, poisson=0.0, density=7850.0, damping=1e-5)


def scissor(element: str, stop: Stop | None = None) -> ScissorSystem:
    """Two units that a force opens, with springs, dampers and friction in all hinges."""
    units = Scissor(
        units=2, bar_length=1.0, initial_angle=math.radians(75.0), element=element, elements_per_bar=3,
    )  # fmt: skip
    hinge = HingeJoint(stiffness=2.0, rest_turn=0.1, damping=0.1, friction_moment=0.05, friction_speed=0.01, at="all")
    force = PointForce(point="a1", force=(0.0, -400.0), time=Ramp(kind="ramp", end=0.01))
    return compile_array(
        units, BarSection(width=0.02, height=0.012), STEEL, default_holds(units), (force,), hinge, stop, (0.0, -9.81)
    )


def creased() -> AncfSystem:
    """Film of two panels with a viscous crease between them, folded against its free angle."""
    turn, place = 0.6, np.linspace(0.0, 0.16, 13)
    far = np.clip(place - 0.08, 0.0, None)[:, None] * np.array([np.cos(turn), 0.0, -np.sin(turn)])
    position = np.minimum(place, 0.08)[:, None] * np.array([1.0, 0.0, 0.0]) + far
    strip = DeployedStrip(
        place, np.repeat([1, 2], 6), position, np.array([0.0, 1.0, 0.0]), 0.04, FilmMaterial(3e9, 0.3, 800.0, 3e-4),
        (CreaseLine(0.08, 2e-3, 0.5),),
    )  # fmt: skip
    mesh, _ = deployed_mesh(strip, np.linspace(0.0, 0.16, 5), np.array([-0.02, 0.0, 0.02]), viscosity=1e-5)
    return AncfSystem(mesh)


def truss(law: str) -> AncfSystem:
    """Two triangles of bars that fold about their common side until the moment rises as a tangent, and a third bar law."""
    at = np.array([[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 1.0, 0.0], [1.1, 1.1, 0.7]])
    ends = np.array([[0, 1], [1, 2], [2, 0], [1, 3], [3, 2]])
    builder = MeshBuilder(size=3)
    places = builder.points(at, "truss", ())
    for place in places.tolist():
        builder.point_mass(place, 0.1)
    builder.hold(places[:1], (0, 1, 2))
    length = np.linalg.norm(at[ends[:, 1]] - at[ends[:, 0]], axis=1)
    builder.add(BarGroup(places[ends], 0.99 * length, np.full(5, 5e3), law, viscosity=1e-4))
    data = replace(FoldData.linear(np.array([2.0]), np.array([0.3]), np.zeros(1), 0.5), damping=np.array([0.01]))
    builder.add(FoldGroup(places[[[0, 1, 2, 3]]], BETWEEN_POINTS[None], fold_laws_of(data)))
    return AncfSystem(builder.build(), Loading(gravity=(0.0, 0.0, -9.81), mass_damping=0.5))


def sheet(name: str, damping: float = 0.0, **changes: object) -> JoinedSystem:
    """Sheet of a shipped case."""
    case = Path(__file__).parents[2] / "folding_cases" / name / "case.toml"
    sheet = (f"sheet.{key}={value}" for key, value in changes.items())
    _, system = compile_case(load_case(case, [f"material.damping={damping}", *sheet]).case)
    assert isinstance(system, JoinedSystem)
    return system


STOP = Stop(angle=math.radians(74.8), stiffness=2e4, damping=1.0, latch=True)
SYSTEMS: dict[str, tuple[Callable[[], AncfSystem | JoinedSystem], float, float]] = {
    "section": (lambda: scissor("section", STOP), 2e-4, 0.0),
    "green": (lambda: scissor("green"), 2e-4, 0.0),
    "cable": (lambda: scissor("cable"), 2e-4, 0.0),
    "creased film": (creased, 2e-5, 0.01),
    "linear truss": (lambda: truss("linear"), 5e-4, 0.5),
    "truss of Green's strain": (lambda: truss("green"), 5e-4, 0.5),
    "truss of Ogden's law": (lambda: truss("ogden"), 5e-4, 0.5),
    "sheet of bars": (lambda: sheet("kresling"), 5e-3, 0.01),
    "flexible facets": (
        lambda: sheet("miura_push", columns=2, rows=2, facets="flexible", mesh_size=2.0), 1e-4, 1e-4,
    ),
    "damped flexible facets": (
        lambda: sheet("miura_push", 1e-4, columns=2, rows=2, facets="flexible", mesh_size=2.0), 1e-4, 1e-4,
    ),
}
"""Systems, their fixed step (s), and their initial velocity relative to `Scales.velocity`."""
COUNT = 120


def pair(name: str, method: str, fixed: bool) -> tuple[StepMethod, StepMethod]:
    """Solvers of two equal systems."""
    make, step, speed = SYSTEMS[name]
    found: list[StepMethod] = []
    for system in (make(), make()):
        q, u = system.initial()
        nodes = system.elements if isinstance(system, JoinedSystem) else system
        moved = speed * system.scales().velocity * np.random.default_rng(1).standard_normal(len(u))
        moved[len(u) - nodes.nu :][nodes.fixed] = 0.0
        u += moved
        if method == "generalized-alpha":
            found.append(GeneralizedAlpha(system, 0.0, q, u, 1e-4, None, step if fixed else None))
        else:
            found.append(MeanForce(system, 0.0, q, u, 1e-3, step))
            found[-1]._begin()  # type: ignore[attr-defined]
    return found[0], found[1]


@pytest.mark.parametrize(
    ("method", "fixed"), [("generalized-alpha", True), ("generalized-alpha", False), ("mean-force", True)]
)
@pytest.mark.parametrize("name", SYSTEMS)
def test_same_steps(name: str, method: str, fixed: bool) -> None:
    """States, counts, work, energies and memory of many steps agree."""
    in_python: Any = march if method == "generalized-alpha" else march_mean_force
    compiled, python = pair(name, method, fixed)
    assert compiled.marches
    balance, others = opened(compiled), opened(python)
    compiled.march(balance, 1.0, COUNT)
    assert in_python(python.model, python.motion, python.rules, others, 1.0, COUNT, python.records(1)) == STEPPED
    check_same_state(compiled, python, COUNT)
    turnover = others[balances.TURNOVER]
    for number in (balances.START, balances.WORK, balances.TURNOVER, balances.KINETIC_WORST):
        assert balance[number] == pytest.approx(others[number], abs=1e-6 * turnover)
    # in the kernel, dampers use the rates in the middle of the step; in Python, they use mean rates of its first half, of
    # lower order
    close = 1e-2 if ("truss" in name or "damped" in name) and method == "generalized-alpha" else 1e-4
    assert balance[balances.DISSIPATED] == pytest.approx(others[balances.DISSIPATED], rel=close)
    apart = abs(balance[balances.DISSIPATED] - others[balances.DISSIPATED])
    assert abs(balance[balances.ERROR]) < abs(others[balances.ERROR]) + apart + 1e-6 * turnover
    assert balance[balances.DISSIPATED] > 1e-5 * turnover or not python.system.rate_dependent
    memory = python.system.memory()
    assert compiled.system.memory() == pytest.approx(memory, rel=1e-5, abs=1e-9)


def test_a_hinge_latches_in_a_compiled_step() -> None:
    """Hinges latch at the end of the same steps as in Python, and largest stresses are kept."""
    compiled, python = pair("section", "generalized-alpha", True)
    compiled.march(opened(compiled), 1.0, COUNT)
    while python.steps < COUNT:
        python.step(1.0)
    systems = compiled.system, python.system
    assert all(isinstance(system, ScissorSystem) for system in systems)
    (found, expected) = (system.latches.events() for system in systems)  # type: ignore[attr-defined]
    assert [name for name, t in expected if 0.0 < t < compiled.t] == ["h1"]
    assert [name for name, _ in found] == [name for name, _ in expected]
    assert [t for _, t in found] == pytest.approx([t for _, t in expected], rel=1e-9)
    largest = [system.largest for system in systems]  # type: ignore[attr-defined]
    assert largest[0].min() > 1e6
    assert largest[0] == pytest.approx(largest[1], rel=1e-6)
