"""The slit annulus by Kratos, in a separate process.

    python -m validation.peers.kratos_shell ELEMENT CELLS_RADIAL CELLS_AROUND STEPS

It prints one line of JSON: displacements of the lifted edge, number of unknowns, processor time of the solution.
"""

from __future__ import annotations

import json
import sys
import time

import KratosMultiphysics as KM
import KratosMultiphysics.LinearSolversApplication
import KratosMultiphysics.StructuralMechanicsApplication as SMA
import numpy as np
from KratosMultiphysics.python_linear_solver_factory import ConstructSolver

from validation.peers.shells import LIFT, THICKNESS, YOUNG, radii

_MOST = 25
"""Iterations of a load step."""


def main(element: str, radial: int, around: int, steps: int) -> None:
    """Solve with the loads (k/n)^2 of n steps; a step that does not converge ends the run."""
    part = KM.Model().CreateModelPart("sheet", 2)
    part.ProcessInfo[KM.DOMAIN_SIZE] = 3
    for variable in (KM.DISPLACEMENT, KM.ROTATION, KM.REACTION, KM.REACTION_MOMENT, KM.VOLUME_ACCELERATION, SMA.POINT_LOAD):
        part.AddNodalSolutionStepVariable(variable)
    number = np.arange(1, (radial + 1) * (around + 1) + 1).reshape(radial + 1, around + 1)
    for i, r in enumerate(radii(radial)):
        for j, angle in enumerate(np.linspace(0.0, 2.0 * np.pi, around + 1)):
            part.CreateNewNode(int(number[i, j]), float(r * np.cos(angle)), float(r * np.sin(angle)), 0.0)
    material = part.CreateNewProperties(1)
    material.SetValue(KM.YOUNG_MODULUS, YOUNG)
    material.SetValue(KM.POISSON_RATIO, 0.0)
    material.SetValue(KM.THICKNESS, THICKNESS)
    material.SetValue(KM.DENSITY, 0.0)
    material.SetValue(KM.CONSTITUTIVE_LAW, SMA.LinearElasticPlaneStress2DLaw())
    count = 0
    for i in range(radial):
        for j in range(around):
            a, b, c, d = (int(k) for k in (number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]))
            for corners in ([a, b, c, d],) if "4N" in element else ([a, b, c], [a, c, d]):
                count += 1
                part.CreateNewElement(element, count, corners, material)
    edge = [int(k) for k in number[:, -1]]
    for k, node in enumerate(edge):
        part.CreateNewCondition("PointLoadCondition3D1N", k + 1, [node], material)
    for components, reaction in ((KM.DISPLACEMENT, KM.REACTION), (KM.ROTATION, KM.REACTION_MOMENT)):
        for axis in "XYZ":
            freedom = KM.KratosGlobals.GetVariable(f"{components.Name()}_{axis}")
            held = KM.KratosGlobals.GetVariable(f"{reaction.Name()}_{axis}")
            KM.VariableUtils().AddDof(freedom, held, part)
            for node in number[:, 0]:
                part.GetNode(int(node)).Fix(freedom)
    share = np.convolve(LIFT * np.diff(radii(radial)), [0.5, 0.5])
    solver = ConstructSolver(KM.Parameters('{"solver_type": "LinearSolversApplication.sparse_lu"}'))
    strategy = KM.ResidualBasedNewtonRaphsonStrategy(
        part, KM.ResidualBasedIncrementalUpdateStaticScheme(), KM.ResidualCriteria(1e-6, 1e-9),
        KM.ResidualBasedBlockBuilderAndSolver(solver), _MOST, False, False, True,
    )  # fmt: skip
    strategy.SetEchoLevel(0)
    begun, converged = time.process_time(), True
    for step in range(1, steps + 1):
        part.CloneTimeStep(step / steps)
        part.ProcessInfo[KM.STEP] = step
        for node, force in zip(edge, share, strict=True):
            part.GetNode(node).SetSolutionStepValue(SMA.POINT_LOAD_Z, float(force * (step / steps) ** 2))
        strategy.Initialize()
        strategy.InitializeSolutionStep()
        strategy.Predict()
        converged = bool(strategy.SolveSolutionStep())
        strategy.FinalizeSolutionStep()
        if not converged:
            break
    ends = [part.GetNode(node).GetSolutionStepValue(KM.DISPLACEMENT_Z) for node in (edge[0], edge[-1])]
    unknowns = 6 * (radial + 1) * around
    found = {"inner": ends[0], "outer": ends[1], "unknowns": unknowns, "seconds": time.process_time() - begun}
    print(json.dumps(found | {"converged": converged}))


if __name__ == "__main__":
    main(sys.argv[1], *(int(text) for text in sys.argv[2:5]))
