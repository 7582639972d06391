"""Several steps of the generalized-alpha method, with the energy balance at the end of each step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.kernels.pointers import borrowed
from fsm.stepping.generalized_alpha import STEPPED, TIME, Motion, Rules, take_step
from fsm.stepping.model import TIME as AT
from fsm.stepping.model import TURNOVER as BEFOREHAND
from fsm.stepping.model import energies
from fsm.stepping.vectors import copy_into

__all__ = [
    "ALLOWED", "DISSIPATED", "DRIVEN", "ERROR", "GAINED", "KINETIC_WORST", "LOSSES", "POWER", "ROUND_OFF", "SHORTEST",
    "START", "TURNOVER", "WORK", "WORST", "balanced", "march", "march_arrays",
]  # fmt: skip

(
    START, DISSIPATED, WORK, ERROR, WORST, GAINED, TURNOVER, KINETIC_WORST, ROUND_OFF, POWER, SHORTEST, ALLOWED, LOSSES,
    DRIVEN,
) = range(14)  # fmt: skip
"""Indices of the array `balance` of `march`: the numbers of `EnergyBalance` (J), the input power at the end of the last step
(W), the shortest step (s), the largest error relative to the turnover, whether losses are checked too (0 or 1), and the
kinetic energy of driven bodies (J)."""


@shared
def balanced(
    stored: float, kinetic: float, start: float, dissipated: float, work: float, worst: float, gained: float,
    turnover: float, kinetic_worst: float,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Energy balance at the end of a step, with the stored energy (kinetic and potential) and its kinetic part, J.

    Returns the new error, worst error, largest gain, turnover and largest kinetic energy of the balance.
    """
    error = stored - start + dissipated - work
    kinetic_worst = max(kinetic_worst, kinetic)
    turnover = max(turnover, abs(stored - start), abs(dissipated), abs(work), kinetic_worst)
    return error, max(worst, abs(error)), max(gained, error), turnover, kinetic_worst


@shared
def march(
    model: Any, motion: Motion, rules: Rules, balance: np.ndarray, until: float, most: int, records: np.ndarray
) -> int:
    """Take at most `most` steps up to `until`, and return the outcome of the last step.

    The function returns early if the energy error exceeds `balance[ALLOWED]`; the caller then takes single steps.
    `records` (m, k) receives a record of each step (`fsm.stepping.model`); steps beyond its last row share that row.
    """
    sizes = motion.sizes
    nq, nu, last = motion.q.shape[0], motion.u.shape[0], records.shape[0] - 1
    balance[DRIVEN] = energies(model, sizes[TIME], motion.q, motion.u, 0.0, records[0])[4]
    for number in range(most):
        begin, record = sizes[TIME], records[min(number, last)]
        if not begin < until:
            break
        for b in rules.breaks:
            if b == begin:  # powers may jump here
                balance[POWER] = energies(model, np.nextafter(begin, math.inf), motion.q, motion.u, 0.0, record)[3]
        outcome = take_step(model, motion, rules, until)
        if outcome != STEPPED:
            return outcome
        step = sizes[TIME] - begin
        kinetic, potential, dissipated, power, driven = energies(model, sizes[TIME], motion.q, motion.u, step, record)
        record[AT], record[BEFOREHAND] = sizes[TIME], balance[TURNOVER]
        first = record.shape[0] - nq - nu
        copy_into(motion.q, record[first : first + nq])
        copy_into(motion.u, record[first + nq :])
        balance[WORK] += 0.5 * step * (balance[POWER] + power) + driven - balance[DRIVEN]
        balance[DISSIPATED] += step * dissipated
        balance[POWER], balance[DRIVEN] = power, driven
        balance[SHORTEST] = min(balance[SHORTEST], step)
        balance[ERROR], balance[WORST], balance[GAINED], balance[TURNOVER], balance[KINETIC_WORST] = balanced(
            kinetic + potential, kinetic, balance[START], balance[DISSIPATED], balance[WORK], balance[WORST],
            balance[GAINED], balance[TURNOVER], balance[KINETIC_WORST],
        )  # fmt: skip
        off = balance[WORST] if balance[LOSSES] > 0.0 else balance[GAINED]
        if balance[TURNOVER] > balance[ROUND_OFF] and off > balance[ALLOWED] * balance[TURNOVER]:
            break
    return STEPPED


@kernel
def march_arrays(
    model: Any, motion: Motion, rules: Rules, balance: np.ndarray, until: float, most: int, records: np.ndarray
) -> int:
    """Compiled `march` for an `ArrayModel`."""
    return march(
        borrowed(model), borrowed(motion), borrowed(rules), borrowed(balance), until, most, borrowed(records)
    )
