"""Pinched and pulled cylinders (Sze, Liu and Lo, 2004) by Kratos; an eighth of each, with planes of symmetry.

    python -m validation.peers.kratos_cylinder pinched|pulled ELEMENT CELLS_AROUND CELLS_ALONG STEPS

ELEMENT is a name of Kratos, for example ShellThinElementCorotational3D4N. The pinched cylinder has diaphragms, and the
displacement of its point A increases in equal steps; the pulled one has open ends, and its force increases in equal steps.
Every line has the force over the largest, and displacements: of the points A and B (pinched), or A, B and C (pulled).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from typing import Any

import KratosMultiphysics as KM
import KratosMultiphysics.LinearSolversApplication
import KratosMultiphysics.StructuralMechanicsApplication as SMA
import numpy as np
from KratosMultiphysics.python_linear_solver_factory import ConstructSolver

_CASES = {
    "pinched": (100.0, 200.0, 1.0, 30e3, 0.3, 3000.0),
    "pulled": (4.953, 10.35, 0.094, 10.5e6, 0.3125, 10_000.0),
}
"""Radius, length and thickness (m), Young's modulus (Pa), Poisson's ratio, largest force on an eighth (N)."""
_PINCH = 84.5
"""Largest displacement of point A of the pinched cylinder, m."""
_MOST = 40
"""Iterations of a step."""


def _freedom(name: str) -> Any:
    return KM.KratosGlobals.GetVariable(name)


def _mesh(case: str, element: str, around: int, along: int) -> tuple[Any, np.ndarray]:
    """Model part with supports, and the numbers of its nodes."""
    radius, length, thickness, young, poisson, _ = _CASES[case]
    part = KM.Model().CreateModelPart("sheet", 2)
    part.ProcessInfo[KM.DOMAIN_SIZE] = 3
    for variable in (KM.DISPLACEMENT, KM.ROTATION, KM.REACTION, KM.REACTION_MOMENT, KM.VOLUME_ACCELERATION, SMA.POINT_LOAD):
        part.AddNodalSolutionStepVariable(variable)
    number = np.arange(1, (around + 1) * (along + 1) + 1).reshape(around + 1, along + 1)
    for i, j in np.ndindex(number.shape):
        angle, y = 0.5 * math.pi * i / around, 0.5 * length * j / along
        part.CreateNewNode(int(number[i, j]), radius * math.sin(angle), y, radius * math.cos(angle))
    material = part.CreateNewProperties(1)
    for key, value in ((KM.YOUNG_MODULUS, young), (KM.POISSON_RATIO, poisson), (KM.THICKNESS, thickness), (KM.DENSITY, 0.0)):
        material.SetValue(key, value)
    material.SetValue(KM.CONSTITUTIVE_LAW, SMA.LinearElasticPlaneStress2DLaw())
    count = 0
    for i, j in np.ndindex(around, along):
        a, b, c, d = (int(k) for k in (number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]))
        for corners in ([a, b, c, d],) if "4N" in element else ([a, b, c], [a, c, d]):
            count += 1
            part.CreateNewElement(element, count, corners, material)
    part.CreateNewCondition("PointLoadCondition3D1N", 1, [1], material)
    for one, other in (("DISPLACEMENT", "REACTION"), ("ROTATION", "REACTION_MOMENT")):
        for axis in "XYZ":
            KM.VariableUtils().AddDof(_freedom(f"{one}_{axis}"), _freedom(f"{other}_{axis}"), part)
    held = {
        "DISPLACEMENT_X ROTATION_Y ROTATION_Z": number[0], "DISPLACEMENT_Z ROTATION_X ROTATION_Y": number[-1],
        "DISPLACEMENT_Y ROTATION_X ROTATION_Z": number[:, 0],
    }  # fmt: skip
    if case == "pinched":
        held |= {"DISPLACEMENT_X DISPLACEMENT_Z": number[:, -1]}
    for names, nodes in held.items():
        for node in nodes.tolist():
            for name in names.split():
                part.GetNode(node).Fix(_freedom(name))
    return part, number


def path(case: str, element: str, around: int, along: int, steps: int) -> Iterator[tuple[float, ...]]:
    """Force over the largest and displacements of the points; a step that does not converge ends the path."""
    part, number = _mesh(case, element, around, along)
    force = _CASES[case][-1]
    first, second, third = (part.GetNode(int(k)) for k in (number[0, 0], number[-1, 0], number[-1, -1]))
    if case == "pinched":
        first.Fix(KM.DISPLACEMENT_Z)
    solver = ConstructSolver(KM.Parameters('{"solver_type": "LinearSolversApplication.sparse_lu"}'))
    strategy = KM.ResidualBasedNewtonRaphsonStrategy(
        part, KM.ResidualBasedIncrementalUpdateStaticScheme(), KM.ResidualCriteria(1e-6, 1e-9),
        KM.ResidualBasedBlockBuilderAndSolver(solver), _MOST, True, False, True,
    )  # fmt: skip
    strategy.SetEchoLevel(0)
    for step in range(1, steps + 1):
        part.CloneTimeStep(step / steps)
        part.ProcessInfo[KM.STEP] = step
        if case == "pinched":
            first.SetSolutionStepValue(KM.DISPLACEMENT_Z, -_PINCH * step / steps)
        else:
            first.SetSolutionStepValue(SMA.POINT_LOAD_Z, force * step / steps)
        strategy.Initialize()
        strategy.InitializeSolutionStep()
        strategy.Predict()
        if not strategy.SolveSolutionStep():
            return
        strategy.FinalizeSolutionStep()
        up = first.GetSolutionStepValue(KM.DISPLACEMENT_Z)
        out = second.GetSolutionStepValue(KM.DISPLACEMENT_X)
        if case == "pinched":
            yield -first.GetSolutionStepValue(KM.REACTION_Z) / force, -up, out
        else:
            yield step / steps, up, -out, -third.GetSolutionStepValue(KM.DISPLACEMENT_X)


if __name__ == "__main__":
    for point in path(sys.argv[1], sys.argv[2], *(int(text) for text in sys.argv[3:6])):
        print(", ".join(f"{value:.4f}" for value in point), flush=True)
