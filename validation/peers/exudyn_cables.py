"""Cables in absolute nodal coordinates, in Exudyn: the cantilever and the flexible pendulum."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from exudyn import itemInterface as item

from validation.peers.sweep import timed

__all__ = ["cable", "pendulum", "static"]


def cable(
    elements: int, length: float, density: float, bending: float, axial: float, clamped: bool
) -> tuple[Any, list[int], list[int]]:
    """System, nodes and bodies of a straight cable along x that starts at the origin."""
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0))
    at = np.linspace(0.0, length, elements + 1)
    nodes = [mbs.AddNode(item.NodePoint2DSlope1(referenceCoordinates=[float(x), 0.0, 1.0, 0.0])) for x in at]
    bodies = [
        mbs.AddObject(
            item.ObjectANCFCable2D(
                length=length / elements, massPerLength=density, bendingStiffness=bending, axialStiffness=axial,
                nodeNumbers=nodes[k : k + 2],
            )
        )
        for k in range(elements)
    ]  # fmt: skip
    for coordinate in (0, 1, 3) if clamped else (0, 1):
        held = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=coordinate))
        mbs.AddObject(item.CoordinateConstraint(markerNumbers=[ground, held]))
    return mbs, nodes, bodies


def pendulum(elements: int) -> tuple[Any, int]:
    """The flexible pendulum and the sensor of its tip."""
    young, density, area, second = 0.7e6, 5540.0, 0.0018, 1.215e-8
    mbs, nodes, bodies = cable(elements, 1.2, density * area, young * second, young * area, False)
    for body in bodies:
        marker = mbs.AddMarker(item.MarkerBodyMass(bodyNumber=body))
        mbs.AddLoad(item.LoadMassProportional(markerNumber=marker, loadVector=[0.0, -9.81, 0.0]))
    kind = exu.OutputVariableType.Position
    sensor = mbs.AddSensor(item.SensorNode(nodeNumber=nodes[-1], storeInternal=True, outputVariableType=kind))
    mbs.Assemble()
    return mbs, sensor


def static(elements: int, steps: int, relative: float, modified: bool) -> tuple[float, np.ndarray]:
    """The cantilever under 3 EI/L^2: processor time of the solver, s, and displacement (along, down) of the tip, m."""
    young, side, length = 2.07e11, 0.1, 2.0
    bending = young * side**4 / 12
    mbs, nodes, _ = cable(elements, length, 78.0, bending, young * side**2, True)
    tip = mbs.AddMarker(item.MarkerNodePosition(nodeNumber=nodes[-1]))
    mbs.AddLoad(item.LoadForceVector(markerNumber=tip, loadVector=[0.0, -3.0 * bending / length**2, 0.0]))
    mbs.Assemble()
    options = exu.SimulationSettings()
    options.solution.file.write = False
    options.parallel.numberOfThreads = 1
    options.linearSolver.solverType = exu.LinearSolverType.EXUdense if elements < 8 else exu.LinearSolverType.EigenSparse
    part = options.staticSolver
    part.verboseMode = 0
    part.numberOfLoadSteps = steps
    part.adaptiveStep = False
    part.newton.relativeTolerance = relative
    part.newton.useModifiedNewton = modified
    taken, good = timed(lambda: mbs.SolveStatic(options, updateInitialValues=True))
    if not good:
        raise RuntimeError("Exudyn found no equilibrium")
    moved = mbs.GetNodeOutput(nodes[-1], exu.OutputVariableType.Displacement, exu.ConfigurationType.Current)
    return taken, np.asarray(moved)[:2]
