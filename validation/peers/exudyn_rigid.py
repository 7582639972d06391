"""Rigid mechanisms in Exudyn, with joints as constraints and, where this is faster, in independent coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn import itemInterface as item

from validation.peers.rigid import BRICARD, GRAVITY, WINDOWS, WING
from validation.peers.sweep import timed

__all__ = ["Stepping", "bricard", "four_bars", "pendulum", "pendulum_tree", "solve", "top", "top_free", "wing"]

_POSITION = exu.OutputVariableType.Position


@dataclass(frozen=True)
class Stepping:
    """Settings of Exudyn's time integration: step (s), solver, Newton, spectral radius of generalised alpha.

    `smooth`: contact forces are continuous, so no iterations determine which contacts are closed.
    """

    step: float
    solver: str = "GeneralizedAlpha"
    modified: bool = True
    radius: float = 0.9
    relative: float = 1e-6
    dense: bool = True
    smooth: bool = False


def solve(mbs: Any, sensor: int, stepping: Stepping, times: np.ndarray) -> tuple[float, np.ndarray]:
    """Processor time of the solver, s, and values of the sensor (times, 3) at equally spaced times."""
    options = exu.SimulationSettings()
    options.solution.file.write = False
    options.parallel.numberOfThreads = 1
    options.linearSolver.solverType = getattr(exu.LinearSolverType, "EXUdense" if stepping.dense else "EigenSparse")
    if not stepping.dense:
        options.linearSolver.reuseAnalyzedPattern = True
    part = options.timeIntegration
    part.verboseMode = 0
    part.endTime = float(times[-1])
    part.numberOfSteps = round(part.endTime / stepping.step)
    part.adaptiveStep = False
    options.solution.sensors.writePeriod = float(times[0])
    part.generalizedAlpha.spectralRadius = stepping.radius
    part.generalizedAlpha.computeInitialAccelerations = True
    part.newton.relativeTolerance = stepping.relative
    part.newton.useModifiedNewton = stepping.modified
    if stepping.smooth:
        part.discontinuous.maxIterations, part.discontinuous.iterationTolerance = 1, 1e6
    solver = getattr(exu.DynamicSolverType, stepping.solver)
    taken, good = timed(lambda: mbs.SolveDynamic(options, solverType=solver))
    if not good:
        raise RuntimeError(f"Exudyn found no solution with {stepping}")
    data = np.asarray(mbs.GetSensorStoredData(sensor))
    rows = [int(np.abs(data[:, 0] - t).argmin()) for t in times]
    if np.abs(data[rows, 0] - times).max() > 1e-6 * times[-1]:
        raise RuntimeError("Exudyn stored other times")
    return taken, data[rows, 1:]


def _system() -> Any:
    return exu.SystemContainer().AddSystem()


def _see(mbs: Any, body: int, point: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> int:
    return mbs.AddSensor(
        item.SensorBody(bodyNumber=body, localPosition=point, storeInternal=True, outputVariableType=_POSITION)
    )


def _at(mbs: Any, body: int, point: Any) -> int:
    return mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=body, localPosition=[float(x) for x in point]))


def _weight(mbs: Any, body: int, down: tuple[float, float, float]) -> None:
    marker = mbs.AddMarker(item.MarkerBodyMass(bodyNumber=body))
    mbs.AddLoad(item.LoadMassProportional(markerNumber=marker, loadVector=down))


Made = tuple[Any, int, Callable[[np.ndarray], np.ndarray]]
"""System, sensor, and what turns its values into the path of the reference."""
_DOWN = (0.0, -GRAVITY, 0.0)


def pendulum() -> Made:
    """A01: a mass point at a constant distance."""
    mbs = _system()
    ground = mbs.AddObject(item.ObjectGround())
    body = mbs.AddObject(
        item.ObjectMassPoint2D(mass=1.0, nodeNumber=mbs.AddNode(item.NodePoint2D(referenceCoordinates=[-1.0, 0.0])))
    )
    ends = [_at(mbs, ground, (0, 0, 0)), _at(mbs, body, (0, 0, 0))]
    mbs.AddObject(item.ObjectConnectorDistance(markerNumbers=ends, distance=1.0))
    _weight(mbs, body, _DOWN)
    sensor = _see(mbs, body)
    mbs.Assemble()
    return mbs, sensor, lambda x: x[:, :2]


def pendulum_tree() -> Made:
    """A01 with its angle as the only coordinate: a kinematic tree of one link."""
    mbs = _system()
    node = mbs.AddNode(
        item.NodeGenericODE2(
            referenceCoordinates=[0.0], initialCoordinates=[0.0], initialCoordinates_t=[0.0], numberOfODE2Coordinates=1
        )
    )
    mbs.AddObject(
        item.ObjectKinematicTree(
            nodeNumber=node, gravity=list(_DOWN), jointTypes=[exu.JointType.RevoluteZ], linkParents=[-1],
            jointTransformations=exu.Matrix3DList([np.eye(3)]), jointOffsets=exu.Vector3DList([np.zeros(3)]),
            linkInertiasCOM=exu.Matrix3DList([np.zeros((3, 3))]),
            linkCOMs=exu.Vector3DList([np.array([-1.0, 0.0, 0.0])]), linkMasses=[1.0],
        )
    )  # fmt: skip
    kind = exu.OutputVariableType.Coordinates
    sensor = mbs.AddSensor(item.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
    mbs.Assemble()
    return mbs, sensor, lambda x: np.stack([-np.cos(x[:, 0]), -np.sin(x[:, 0])], 1)


def four_bars(windows: int = WINDOWS) -> Made:
    """A02: planar bodies and revolute joints."""
    mbs = _system()
    ground = mbs.AddObject(item.ObjectGround())

    def bar(place: tuple[float, float], speed: tuple[float, float, float]) -> int:
        node = item.NodeRigidBody2D(referenceCoordinates=[*place, 0.0], initialVelocities=list(speed))
        body = item.ObjectRigidBody2D(mass=1.0, inertia=1.0 / 12.0, nodeNumber=mbs.AddNode(node))
        number = mbs.AddObject(body)
        _weight(mbs, number, _DOWN)
        return number

    def pin(first: int, at: tuple, second: int, point: tuple) -> None:
        mbs.AddObject(item.ObjectJointRevolute2D(markerNumbers=[_at(mbs, first, at), _at(mbs, second, point)]))

    up, down, left, right = (0, 0.5, 0), (0, -0.5, 0), (-0.5, 0, 0), (0.5, 0, 0)
    bars = [bar((i, 0.5), (0.5, 0.0, -1.0)) for i in range(windows + 1)]
    for i, body in enumerate(bars):
        pin(ground, (i, 0, 0), body, down)
    for i in range(windows):
        top = bar((i + 0.5, 1.0), (1.0, 0.0, 0.0))
        pin(bars[i], up, top, left)
        pin(bars[i + 1], up, top, right)
    sensor = _see(mbs, bars[0], up)
    mbs.Assemble()
    return mbs, sensor, lambda x: x[:, :2]


_SPIN = [0.0, 150.0, -4.61538]


def top() -> Made:
    """Heavy top: a body at its centre, Euler parameters, and a spherical joint."""
    mbs = _system()
    ground = mbs.AddObject(item.ObjectGround())
    node = item.NodeRigidBodyEP(
        referenceCoordinates=[0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        initialVelocities=[4.61538, 0.0, 0.0, *(0.5 * x for x in (0.0, *_SPIN))],
    )
    inertia = [0.234375, 0.46875, 0.234375, 0.0, 0.0, 0.0]
    body = mbs.AddObject(item.ObjectRigidBody(mass=15.0, inertia=inertia, nodeNumber=mbs.AddNode(node)))
    _weight(mbs, body, (0.0, 0.0, -GRAVITY))
    mbs.AddObject(item.ObjectJointSpherical(markerNumbers=[_at(mbs, ground, (0, 0, 0)), _at(mbs, body, (0, -1, 0))]))
    sensor = _see(mbs, body)
    mbs.Assemble()
    return mbs, sensor, lambda x: x


def top_free() -> Made:
    """Heavy top: a body that turns about the fixed point, with the moments of inertia there; its translation is held."""
    mbs = _system()
    node = item.NodeRigidBodyRotVecLG(referenceCoordinates=[0.0] * 6, initialVelocities=[0.0, 0.0, 0.0, *_SPIN])
    number = mbs.AddNode(node)
    inertia = [15.234375, 0.46875, 15.234375, 0.0, 0.0, 0.0]
    body = mbs.AddObject(item.ObjectRigidBody(mass=15.0, inertia=inertia, nodeNumber=number))
    mbs.AddLoad(item.LoadForceVector(markerNumber=_at(mbs, body, (0, 1, 0)), loadVector=[0.0, 0.0, -15.0 * GRAVITY]))
    fixed = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0))
    for coordinate in range(3):
        moved = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=number, coordinate=coordinate))
        mbs.AddObject(item.CoordinateConstraint(markerNumbers=[fixed, moved]))
    sensor = _see(mbs, body, (0.0, 1.0, 0.0))
    mbs.Assemble()
    return mbs, sensor, lambda x: x


def bricard() -> Made:
    """A04: five bodies with Euler parameters and six hinges; one hinge omits a translation that the other hinges
    constrain."""
    mbs = _system()
    ground = mbs.AddObject(item.ObjectGround())
    corners, bodies = BRICARD.corners, []
    bars = np.roll(corners, -1, axis=0) - corners
    for i in range(5):
        moments = np.where(np.abs(bars[i]) > 0.5, BRICARD.slender, 1.0 / 12.0)
        node = item.NodeRigidBodyEP(referenceCoordinates=[*(corners[i] + 0.5 * bars[i]), 1.0, 0.0, 0.0, 0.0])
        body = item.ObjectRigidBody(mass=1.0, inertia=[*moments, 0.0, 0.0, 0.0], nodeNumber=mbs.AddNode(node))
        bodies.append(mbs.AddObject(body))
        _weight(mbs, bodies[-1], (0.0, 0.0, -GRAVITY))
    for i in range(6):
        inner, outer = (bodies[i - 1] if i else ground), (bodies[i] if i < 5 else ground)
        at = [0.5 * bars[i - 1] if i else np.zeros(3), -0.5 * bars[i] if i < 5 else corners[5]]
        markers = [
            mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=b, localPosition=p.tolist()))
            for b, p in zip((inner, outer), at, strict=True)
        ]
        axis = BRICARD.axes[i]
        other = np.roll(axis, 1)
        turned = np.stack([other, np.cross(axis, other), axis], 1)  # rotation about the third axis is free
        mbs.AddObject(
            item.ObjectJointGeneric(
                markerNumbers=markers, constrainedAxes=[1, 1, 1, 1, 1, 0] if i < 5 else [1, 1, 0, 1, 1, 0],
                rotationMarker0=turned, rotationMarker1=turned,
            )
        )  # fmt: skip
    sensor = _see(mbs, bodies[2], tuple(0.5 * bars[2]))
    mbs.Assemble()
    return mbs, sensor, lambda x: x


def wing() -> Made:
    """Wing: planar bodies, revolute joints, and springs between the angles of neighbouring panels."""
    mbs = _system()
    ground, half = mbs.AddObject(item.ObjectGround()), 0.5 * WING.length
    fixed = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0))
    end, angle, at = _at(mbs, ground, (0, 0, 0)), fixed, np.zeros(2)
    for phi, stowed, rest in zip(np.cumsum(WING.stowed), WING.stowed, WING.rest, strict=True):
        along = half * np.array([np.cos(phi), np.sin(phi)])
        node = mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=[*(at + along), float(phi)]))
        body = mbs.AddObject(item.ObjectRigidBody2D(mass=WING.mass, inertia=WING.inertia, nodeNumber=node))
        mbs.AddObject(item.ObjectJointRevolute2D(markerNumbers=[end, _at(mbs, body, (-half, 0, 0))]))
        turned = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=2))  # counts from the start
        mbs.AddObject(
            item.CoordinateSpringDamper(
                markerNumbers=[angle, turned], stiffness=WING.stiffness, damping=WING.damping, offset=float(rest - stowed)
            )
        )
        end, angle, at = _at(mbs, body, (half, 0, 0)), turned, at + 2.0 * along
    sensor = _see(mbs, body)
    mbs.Assemble()
    return mbs, sensor, lambda x: x[:, :2]
