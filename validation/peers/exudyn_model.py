"""A scene of fsm as an Exudyn system with the same bodies and springs, and its static or dynamic solution.

Axes: (x, y, z) of Exudyn are (x, z, -y) of fsm. The strip then lies in the x-y plane of Exudyn, as planar bodies of Exudyn
require, and bends about z. Bushings of Exudyn measure a rotation by three angles, which are singular at 90 degrees of the
second; bending is the third angle.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import exudyn as exu
import numpy as np
from exudyn import itemInterface as item
from exudyn.advancedUtilities import CreateSymbolicUserFunction

from fsm.case.models.scene import Body, ForceElement, Scene
from fsm.model.bodies.drive import PrescribedMotion
from fsm.model.elements.element_angles import initial_twists, rest_twists

__all__ = ["Contact", "ExudynSettings", "ExudynStrip"]

_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Matrix that converts components in fsm's axes to components in Exudyn's axes."""
_ORDER = [0, 2, 1]
"""Positions of the stiffnesses of fsm's three axes in the order of Exudyn."""


@dataclass(frozen=True)
class Contact:
    """Contact points of the panel before the driven crease with the mirror plane.

    Attributes
    ----------
    stiffness : of a whole panel, force k d^1.5, N/m^1.5
    plane : x of the plane, m
    points : intervals between the points of a segment
    """

    stiffness: float
    plane: float
    points: int = 2


@dataclass(frozen=True)
class ExudynSettings:
    """Settings of Exudyn's solver.

    Attributes
    ----------
    steps : number of load steps or of time steps
    planar : planar bodies instead of spatial ones
    dynamic : generalised alpha instead of static load steps
    solver : linear solver
    modified : whether the Jacobian is reused as long as each iteration reduces the residual to `contractivity` times its
    value
    each_step : whether a new Jacobian is computed at the start of every step
    relative, absolute : tolerances of the residual
    radius : spectral radius of generalised alpha
    exact : whether Jacobians of the springs include their geometric stiffness; without it Newton's method is cheaper, and
    more robust in large steps
    adaptive : whether a failed step is shortened
    plain : number of steps and linear solver as given, contact by a function in Python, and all else as Exudyn has it by
        default: Newton's method to 1e-8 with the whole Jacobian (modified in dynamics, spectral radius 0.9), a file of the
        solution, sensors at every step
    """

    steps: int
    planar: bool = False
    dynamic: bool = False
    solver: str = "EigenSparse"
    modified: bool = False
    each_step: bool = False
    contractivity: float = 0.5
    relative: float = 1e-6
    absolute: float = 1e-10
    radius: float = 0.5
    exact: bool = False
    adaptive: bool = True
    plain: bool = False


class ExudynStrip:
    """An fsm scene in Exudyn.

    Parameters
    ----------
    scene : Scene
    motion : prescribed motion of the driven body
    settings : ExudynSettings
    contact : points against a plane, or None
    """

    def __init__(
        self, scene: Scene, motion: PrescribedMotion, settings: ExudynSettings, contact: Contact | None = None
    ) -> None:
        self.motion, self.settings, self.share = motion, settings, 1.0
        if contact is not None:
            scene, self.share = _half(scene), 2.0
        self.scene = scene
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.bodies = {body.name: body for body in scene.bodies}
        self.nodes: dict[str, int] = {}
        self.numbers = {body.name: self._body(body) for body in scene.bodies}
        starts = initial_twists(scene.elements, scene.bodies)
        for element, start, rest in zip(scene.elements, starts, rest_twists(scene.elements, starts), strict=True):
            self._element(element, start, rest)
        self.sensor = self._drive(scene.drives[0].body)
        if contact is not None:
            self._contacts(contact)
        self.mbs.Assemble()
        self.options = self._options()

    def solve(self, clock: Callable[[], float] = time.perf_counter) -> tuple[float, tuple[np.ndarray, np.ndarray]]:
        """Time of the solver by a clock (s); travel (m) and pull force (N) at the end of every step."""
        begun = clock()
        if self.settings.dynamic:
            good = self.mbs.SolveDynamic(self.options, solverType=exu.DynamicSolverType.GeneralizedAlpha)
        else:
            good = self.mbs.SolveStatic(self.options)
        taken = clock() - begun
        if not good:
            raise RuntimeError(f"Exudyn found no solution with {self.settings}")
        data = np.asarray(self.mbs.GetSensorStoredData(self.sensor))
        data = data[np.concatenate([[True], np.diff(data[:, 0]) > 0])]
        sign = -1.0 if self.settings.dynamic else 1.0  # the static solver of Exudyn gives multipliers with the opposite sign
        travel = np.array([self._travel(t) for t in data[:, 0]])
        return taken, (travel, self.share * sign * data[:, 1])

    # building -------------------------------------------------------------------------------------------------------

    def _body(self, body: Body) -> int:
        place = _AXES @ np.array(body.position)
        angle = -2.0 * math.atan2(body.orientation[2], body.orientation[0])
        if body.held:
            return self.mbs.AddObject(item.ObjectGround(referencePosition=place, referenceRotation=_turn(angle)))
        if self.settings.planar:
            node = self.mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=[*place[:2], angle]))
            self.nodes[body.name] = node
            inertia = body.inertia[1]
            return self.mbs.AddObject(item.ObjectRigidBody2D(mass=body.mass, inertia=inertia, nodeNumber=node))
        node = self.mbs.AddNode(item.NodeRigidBodyRxyz(referenceCoordinates=[*place, 0.0, 0.0, angle]))
        self.nodes[body.name] = node
        moments = [body.inertia[0], body.inertia[2], body.inertia[1], 0.0, 0.0, 0.0]
        return self.mbs.AddObject(item.ObjectRigidBody(mass=body.mass, inertia=moments, nodeNumber=node))

    def _element(self, element: ForceElement, start: float, rest: float) -> None:
        """A 6-DOF bushing, measured in the axes of the outer body as in fsm; its angle is zero as folded."""
        if not math.isclose(rest, start, abs_tol=1e-12):
            raise ValueError(f"{element.name}: creases must be at rest as folded")
        inner = -2.0 * math.atan2(element.axes_inner[2], element.axes_inner[0]) + start
        outer = -2.0 * math.atan2(element.axes_outer[2], element.axes_outer[0])
        first = self._marker(element.outer, element.point_outer, outer)
        second = self._marker(element.inner, element.point_inner, inner)
        stiffness = [*np.array(element.translation)[_ORDER], *np.array(element.rotation)[_ORDER]]
        damping = [*np.array(element.translation_damping)[_ORDER], *np.array(element.rotation_damping)[_ORDER]]
        self.mbs.AddObject(
            item.ObjectConnectorRigidBodySpringDamper(
                markerNumbers=[first, second], stiffness=np.diag(stiffness), damping=np.diag(damping)
            )
        )

    def _marker(self, name: str, point: tuple[float, float, float], angle: float) -> int:
        frame = exu.HT(rotation=_turn(angle), translation=_AXES @ np.array(point))
        return self.mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=self.numbers[name], localHT=frame))

    def _drive(self, name: str) -> int:
        """Constrain all coordinates of the driven body, the pulled one to its travel; returns the sensor of its force."""
        ground = self.mbs.AddNode(item.NodePointGround())
        fixed = self.mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
        pulled = -1
        for coordinate in range(3 if self.settings.planar else 6):
            moved = self.mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=self.nodes[name], coordinate=coordinate))
            keys: dict[str, Any] = {"offsetUserFunction": self._offset} if coordinate == 1 else {}
            number = self.mbs.AddObject(item.ObjectConnectorCoordinate(markerNumbers=[fixed, moved], **keys))
            pulled = number if coordinate == 1 else pulled
        return self.mbs.AddSensor(
            item.SensorObject(objectNumber=pulled, storeInternal=True, outputVariableType=exu.OutputVariableType.Force)
        )

    def _offset(self, mbs: Any, t: float, number: int, offset: float) -> float:
        return self._travel(t)

    def _travel(self, t: float) -> float:
        return self.motion.at(t)[0] if self.settings.dynamic else self.motion.travel * t

    def _contacts(self, contact: Contact) -> None:
        """Points of the panel beside the plane, each with a one-sided spring along x whose law Exudyn evaluates itself."""
        panel = max(body.panel for body in self.scene.bodies)
        segments = [body for body in self.scene.bodies if body.panel == panel]
        whole = sum(body.plate.length for body in segments if body.plate)
        ground = self.mbs.AddObject(item.ObjectGround(referencePosition=[contact.plane, 0.0, 0.0]))
        wall = self.mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=ground))
        self.law: Any = _one_sided_in_python
        if not self.settings.plain:
            self.law = CreateSymbolicUserFunction(
                self.mbs,
                _one_sided,
                "springForceUserFunction",
                itemTypeName="ObjectConnectorCartesianSpringDamper",
            )  # stored here, because Exudyn does not own it
        for body in segments:
            assert body.plate is not None
            for at, weight in _points(contact.points):
                share = weight * body.plate.length / whole
                place = _AXES @ np.array([at * body.plate.length / 2.0, 0.0, 0.0])
                number = self.numbers[body.name]
                point = self.mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=number, localPosition=place))
                self.mbs.AddObject(
                    item.ObjectConnectorCartesianSpringDamper(
                        markerNumbers=[wall, point],
                        stiffness=[contact.stiffness * share, 0.0, 0.0],
                        springForceUserFunction=self.law,
                    )
                )

    # settings -------------------------------------------------------------------------------------------------------

    def _options(self) -> Any:
        wanted, options = self.settings, exu.SimulationSettings()
        options.linearSolver.solverType = getattr(exu.LinearSolverType, wanted.solver)
        if wanted.plain:
            return self._plain_options(options)
        options.linearSolver.reuseAnalyzedPattern = True
        options.parallel.numberOfThreads = 1
        options.solution.file.write = False
        options.show.globalTimers = False
        if wanted.dynamic:
            part = options.timeIntegration
            part.endTime = self.motion.end_time
            part.numberOfSteps = wanted.steps
            part.generalizedAlpha.spectralRadius = wanted.radius
            step = part.endTime / wanted.steps
        else:
            part = options.staticSolver
            part.numberOfLoadSteps = wanted.steps
            part.computeLoadsJacobian = False
            step = 1.0 / wanted.steps
        options.solution.sensors.writePeriod = 0.5 * step
        part.adaptiveStep = wanted.adaptive
        part.verboseMode = 0
        part.newton.relativeTolerance, part.newton.absoluteTolerance = wanted.relative, wanted.absolute
        part.newton.useModifiedNewton = wanted.modified
        part.newton.modifiedNewtonJacUpdatePerStep = wanted.each_step
        part.newton.modifiedNewtonContractivity = wanted.contractivity
        part.newton.numericalDifferentiation.jacobianConnectorDerivative = wanted.exact
        return options

    def _plain_options(self, options: Any) -> Any:
        """Steps, and a folder for the files."""
        self.files = TemporaryDirectory()
        for part, name in ((options.solution.file, "name"), (options.solution, "solverInformationFileName")):
            setattr(part, name, str(Path(self.files.name) / name))
        if self.settings.dynamic:
            options.timeIntegration.endTime = self.motion.end_time
            options.timeIntegration.numberOfSteps = self.settings.steps
        else:
            options.staticSolver.numberOfLoadSteps = self.settings.steps
        return options


def _one_sided(mbs: Any, t: Any, number: Any, shift: Any, rate: Any, stiffness: Any, damping: Any, offset: Any) -> Any:
    """Hertz force k d^1.5 of a point that has passed the plane by d, in symbols of Exudyn, so that the solution calls no
    Python."""
    symbol = exu.symbolic
    depth = symbol.max(symbol.Real(0.0), shift[0])
    return symbol.Vector([stiffness[0] * depth * symbol.sqrt(depth), symbol.Real(0.0), symbol.Real(0.0)])


def _one_sided_in_python(
    mbs: Any, t: float, number: int, shift: Any, rate: Any, stiffness: Any, damping: Any, offset: Any
) -> list[float]:
    """The same law as a function that Exudyn calls."""
    return [stiffness[0] * max(0.0, shift[0]) ** 1.5, 0.0, 0.0]


def _points(intervals: int) -> list[tuple[float, float]]:
    """Gauss-Lobatto points on [-1, 1], and weights with the sum 1, as in the contact of fsm."""
    inner = np.polynomial.legendre.Legendre.basis(intervals).deriv().roots()
    points = np.concatenate([[-1.0], inner, [1.0]])
    weights = 1.0 / (intervals * (intervals + 1) * np.polynomial.legendre.legval(points, [0.0] * intervals + [1.0]) ** 2)
    return [(float(x), float(w)) for x, w in zip(points, weights, strict=True)]


def _half(scene: Scene) -> Scene:
    """Half of the strip before its driven crease; this crease rotates relative to the line, with twice the stiffness."""
    line = scene.drives[0].body
    assert line is not None
    last = next(e.outer for e in scene.elements if e.kind == "drive" and e.inner == line and e.point_outer[0] > 0)
    middle = next(body.panel for body in scene.bodies if body.name == last)
    bodies = tuple(body for body in scene.bodies if body.panel <= middle)
    names = {body.name for body in bodies}
    own = [e for e in scene.elements if {e.inner, e.outer} <= names]
    crease = next(e for e in scene.elements if e.inner == last and e.outer not in names)
    own = [_stiffened(e, crease) if e.kind == "drive" else e for e in own]
    return scene.model_copy(update={"bodies": bodies, "elements": tuple(own)})


def _stiffened(half_joint: ForceElement, crease: ForceElement) -> ForceElement:
    """Half a joint to the line with the moment of the crease; its mirror image rotates by the opposite angle."""
    k, c = list(half_joint.rotation), list(half_joint.rotation_damping)
    k[1], c[1] = 2.0 * crease.rotation[1], 2.0 * crease.rotation_damping[1]
    return half_joint.model_copy(update={"rotation": tuple(k), "rotation_damping": tuple(c)})


def _turn(angle: float) -> np.ndarray:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
