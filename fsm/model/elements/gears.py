"""Gears, racks and synchronising cables: the opening e = x_1 - n x_2 of the coordinates of two joints, elastic or locked.

Elastic: effort T = k (e - b) + c e' above the play, e > b, and T = k (e - a) + c e' below it, e < a; none inside it, and
dampers never turn its sign. Without play (a = b) the law is linear. Both joints have the efforts T and -n T.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d
from fsm.kernels.jit import kernel
from fsm.laws.one_sided import mean_loss, one_sided
from fsm.model.elements import couplings
from fsm.model.elements.couplings import Coupling


@kernel
def _law(table: np.ndarray, own: np.ndarray, t: float, per_second: float) -> float:
    angle, rate = floats_2d(own, couplings.ANGLES), floats_2d(own, couplings.SPEEDS)
    parameters = floats_2d(own, couplings.FIRST_PARAMETER)
    effort, by_angle = floats_2d(own, couplings.EFFORTS), floats_3d(own, couplings.STIFFNESSES)
    by_rate = floats_3d(own, couplings.VISCOSITIES)
    energy, lost, way = floats_1d(own, couplings.ENERGIES), floats_1d(own, couplings.DISSIPATED), np.ones(2)
    for i in range(angle.shape[0]):
        way[1], stiffness, damping = -parameters[i, 0], parameters[i, 1], parameters[i, 2]
        lower, upper = parameters[i, 3], parameters[i, 4]
        slip, speed = angle[i, 0] + way[1] * angle[i, 1], rate[i, 0] + way[1] * rate[i, 1]
        if lower == upper:
            push, slope, viscosity = stiffness * (slip - upper) + damping * speed, stiffness, damping
            energy[i], lost[i] = 0.5 * stiffness * (slip - upper) ** 2, damping * speed**2
        else:
            push, slope, viscosity, energy[i], lost[i] = one_sided(slip - upper, speed, stiffness, damping)
            back, other, viscous, stored, heat = one_sided(lower - slip, -speed, stiffness, damping)
            push, slope, viscosity = push - back, slope + other, viscosity + viscous
            energy[i] += stored
            lost[i] += heat
            if per_second > 0.0:
                before = slip - speed / per_second
                lost[i] = mean_loss(before - upper, slip - upper, speed, stiffness, damping, 0.0)
                lost[i] += mean_loss(lower - before, lower - slip, -speed, stiffness, damping, 0.0)
        for j in range(2):
            effort[i, j] = way[j] * push
            for k in range(2):
                by_angle[i, j, k], by_rate[i, j, k] = slope * way[j] * way[k], viscosity * way[j] * way[k]
    return 0.0


def _parameters(given: list[Any]) -> list[np.ndarray]:
    rows = []
    for own in given:
        middle, half = own["lag"] - own["preload"] / own["stiffness"], 0.5 * own["backlash"]
        lower = -math.inf if own.get("slack") == "below" else middle - half
        upper = math.inf if own.get("slack") == "above" else middle + half
        rows.append([own["ratio"], own["stiffness"], own["damping"], lower, upper])
    return [np.array(rows, dtype=float)]


GEAR = Coupling(2, _law, _parameters)
"""Kinds "gear" and "rack" of `[[scene.couplings]]` with a stiffness, parameters of `fsm.case.models.coupling`."""
