"""Equilibria of ANCF cables in one kernel compared with the same iterations in Python for the same system."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.errors import NotConverged
from fsm.kernels.programs import ramp
from fsm.model.nodes.loading import Forcing, Loading, SupportMotion, point_force
from fsm.model.nodes.system.build import CableMaterial, MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import equilibrium

TIMES = np.linspace(0.0, 1.0, 5)


def cantilever(held: bool = True, moved: bool = False, load: float = 40.0, weight: float = 9.81) -> AncfSystem:
    """Six cables in a row, clamped or free at one end, with weight and a force; the other end may be moved."""
    builder = MeshBuilder(size=6)
    line = builder.cable(np.zeros(3), np.array([1.0, 0.2, 0.1]), CableMaterial(1e8, 1000.0, 0.02), 6)
    if held:
        builder.hold(line[0, 0])
        builder.hold(line[0, 1])
    mesh = builder.build()
    tip = int(line[-1, 0])
    force = point_force(len(mesh.coordinates), int(line[3, 0]), np.array([0.0, load, -load]))
    motion = SupportMotion(tip + np.arange(2), np.array([-0.2, 0.1]), ramp())
    return AncfSystem(mesh, Loading((Forcing(force, ramp()),), (motion,) if moved else (), (0.0, 0.0, -weight)))


def in_python(system: AncfSystem) -> AncfSystem:
    """The same system without arrays."""
    system.__dict__["arrays_at_rest"] = lambda ready: None
    return system


@pytest.mark.parametrize("moved", [False, True], ids=["loaded", "moved"])
def test_same_equilibria(moved: bool) -> None:
    """Configurations at all times agree."""
    found: list[list[tuple[float, np.ndarray]]] = []
    for system in (cantilever(moved=moved), in_python(cantilever(moved=moved))):
        seen: list[tuple[float, np.ndarray]] = []
        q = equilibrium(system, system.initial()[0], TIMES, 1e-8, on_state=lambda t, q, seen=seen: seen.append((t, q)))
        assert np.array_equal(q, seen[-1][1])
        found.append(seen)
    system = cantilever(moved=moved)
    assert system.arrays_at_rest(LinearSolver().ready) is not None
    for (t, q), (other, expected) in zip(*found, strict=True):
        assert t == other
        assert np.abs(q - expected).max() < 1e-7
        residual = system.force(t, q, None)
        assert np.abs(residual).max() < 1e-6 * 40.0
    assert np.abs(found[0][-1][1] - system.start).max() > 0.1


def test_kernels_and_python_fail_alike() -> None:
    """A load is too large for the number of iterations: the states before it are reported, and the message states time and
    place."""
    for system in (cantilever(load=4e6, weight=0.0), in_python(cantilever(load=4e6, weight=0.0))):
        q, times, seen = system.initial()[0], np.array([0.0, 1.0]), []
        with pytest.raises(NotConverged, match=r"no equilibrium found at t = 1 s in 15 iterations"):
            equilibrium(system, q, times, 1e-6, 15, lambda t, q, seen=seen: seen.append(t))
        assert seen == [0.0]


def test_a_free_cable_has_no_equilibrium() -> None:
    """A cable without supports: the equations are singular, or the iteration does not end."""
    system = cantilever(held=False)
    with pytest.raises(NotConverged):
        equilibrium(system, system.initial()[0], TIMES, 1e-8)
