"""Gears: springs and dampers between the angles of two joints, with a ratio.

U = k/2 (phi_1 - n phi_2)^2,    moment M = k (phi_1 - n phi_2) + c (phi_1' - n phi_2') on phi_1, and -n M on phi_2
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d
from fsm.kernels.jit import kernel
from fsm.model.elements.couplings import (
    ANGLES,
    DISSIPATED,
    EFFORTS,
    ENERGIES,
    FIRST_PARAMETER,
    SPEEDS,
    STIFFNESSES,
    VISCOSITIES,
    Coupling,
)


@kernel
def _law(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate, parameters = floats_2d(own, ANGLES), floats_2d(own, SPEEDS), floats_2d(own, FIRST_PARAMETER)
    effort, by_angle, by_rate = floats_2d(own, EFFORTS), floats_3d(own, STIFFNESSES), floats_3d(own, VISCOSITIES)
    energy, lost, way = floats_1d(own, ENERGIES), floats_1d(own, DISSIPATED), np.ones(2)
    for i in range(angle.shape[0]):
        way[1], stiffness, damping = -parameters[i, 0], parameters[i, 1], parameters[i, 2]
        slip, speed = angle[i, 0] + way[1] * angle[i, 1], rate[i, 0] + way[1] * rate[i, 1]
        energy[i], lost[i] = 0.5 * stiffness * slip**2, damping * speed**2
        for j in range(2):
            effort[i, j] = way[j] * (stiffness * slip + damping * speed)
            for k in range(2):
                by_angle[i, j, k], by_rate[i, j, k] = stiffness * way[j] * way[k], damping * way[j] * way[k]
    return 0.0


def _parameters(given: list[Any]) -> list[np.ndarray]:
    return [np.array([[own["ratio"], own["stiffness"], own["damping"]] for own in given], dtype=float)]


GEAR = Coupling(2, _law, _parameters)
"""Kind "gear" of `[[scene.couplings]]`, with the parameters of `fsm.case.models.gear`."""
