"""Several steps of the generalized-alpha method, with the energy balance at the end of each step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.kernels.pointers import borrowed
from fsm.solve.stepping.generalized_alpha import (
    SPENT,
    STARTED,
    TIME,
    UNSEEN,
    Motion,
    Rules,
    before_break,
    take_step,
)
from fsm.solve.stepping.model import TIME as AT
from fsm.solve.stepping.model import TURNOVER as BEFOREHAND
from fsm.solve.stepping.model import consistent, energies
from fsm.solve.stepping.outcomes import STEPPED
from fsm.solve.stepping.vectors import copy_into

(
    START, DISSIPATED, WORK, LOST, ERROR, WORST, DRIFT, GAINED, TURNOVER, KINETIC_WORST, ROUND_OFF, POWER, SHORTEST, ALLOWED,
    LOSSES, DRIVEN,
) = range(16)  # fmt: skip
BALANCE = DRIVEN + 1
"""Indices of the array `balance` of `march`. START to ROUND_OFF are the fields of `EnergyBalance` (J). POWER is the
input power at the end of the last step (W), SHORTEST the shortest step (s). ALLOWED is the largest error relative to
the turnover. LOSSES is 1 if losses are checked too. DRIVEN is the kinetic energy of driven bodies (J).
BALANCE is the length of the array."""

_CERTAIN = 0.1
"""Bound of the difference of the energies that dampers of elements dissipate along a step and in the balance, relative to
its numerical dissipation. Where stiff springs turn by much in a step, their forces along the step are not those of the
motion, and differ by more; so does the numerical dissipation from the kinetic energy, which is its other bound. It is then
left out."""


@shared
def add_up(balance: np.ndarray, stored: float, kinetic: float) -> None:
    """Update the balance with the stored energy (kinetic and potential) at the end of a step, and its kinetic part, J.

    Drift and gain contain the numerical dissipation, and the error does not.
    """
    drift = stored - balance[START] + balance[DISSIPATED] - balance[WORK]
    balance[ERROR] = drift + balance[LOST]
    balance[WORST], balance[DRIFT] = max(balance[WORST], abs(balance[ERROR])), max(balance[DRIFT], abs(drift))
    balance[GAINED], balance[KINETIC_WORST] = max(balance[GAINED], drift), max(balance[KINETIC_WORST], kinetic)
    largest = max(abs(stored - balance[START]), abs(balance[DISSIPATED]), abs(balance[WORK]), balance[KINETIC_WORST])
    balance[TURNOVER] = max(balance[TURNOVER], largest)


@shared
def add_pairs(motion: Any) -> float:
    """Add the energy that contact pairs have dissipated in a step to that of all steps; returns its sum, J."""
    total = 0.0
    for row in range(2):
        for k in range(motion.of_pairs.shape[1]):
            motion.all_pairs[row, k] += motion.of_pairs[row, k]
            total += motion.of_pairs[row, k]
    return total


@shared
def end_step(
    balance: np.ndarray, record: np.ndarray, motion: Any, begin: float, work: float, dissipated: float, lost: float,
    kinetic: float, potential: float, power: float, driven: float,
) -> bool:  # fmt: skip
    """Write the record of a step that began at `begin` (s), and add its energies (J) to the balance.

    `work`, `dissipated` and the numerical dissipation `lost` are those of the step; the others are values at its end, with
    the input power in W. Returns whether the drift of the energy is above its bound.
    """
    q, u, t = motion.q, motion.u, motion.sizes[TIME]
    record[AT], record[BEFOREHAND] = t, balance[TURNOVER]
    first = record.shape[0] - q.shape[0] - u.shape[0]
    copy_into(q, record[first : first + q.shape[0]])
    copy_into(u, record[first + q.shape[0] :])
    balance[SHORTEST] = min(balance[SHORTEST], t - begin)
    balance[WORK] += work + driven - balance[DRIVEN]
    balance[DISSIPATED] += dissipated
    balance[LOST] += lost
    balance[POWER], balance[DRIVEN] = power, driven
    add_up(balance, kinetic + potential, kinetic)
    off = balance[DRIFT] if balance[LOSSES] > 0.0 else balance[GAINED]
    return bool(balance[TURNOVER] > balance[ROUND_OFF] and off > balance[ALLOWED] * balance[TURNOVER])


@shared
def march(
    model: Any, motion: Motion, rules: Rules, balance: np.ndarray, until: float, most: int, records: np.ndarray
) -> int:
    """Take at most `most` steps up to `until`, and return the outcome of the last step.

    The dissipated energy of a step is that of the dampers of elements by their mean rates, and that of contacts along the
    step, which is also added to `motion.all_pairs`. The function returns early if the energy error exceeds
    `balance[ALLOWED]`; the caller then takes single steps. `records` (m, k) receives a record of each step
    (`fsm.solve.stepping.model`); all steps beyond the last row overwrite this row.
    """
    sizes, last = motion.sizes, records.shape[0] - 1
    # dampers use this state as the previous state
    kinetic, _, _, _, driven = energies(model, sizes[TIME], motion.q, motion.u, 0.0, records[0])
    moving = kinetic - driven
    for number in range(most):
        begin, record = sizes[TIME], records[min(number, last)]
        if not begin < until:
            break
        for b in rules.breaks:
            if b == begin:  # powers may jump at this time, with the multipliers of locked directions
                after = np.nextafter(begin, math.inf)
                consistent(model, after, motion.q, motion.u, motion.rate.copy(), False)
                balance[POWER] = energies(model, after, motion.q, motion.u, 0.0, record)[3]
        outcome = take_step(model, motion, rules, until)
        if outcome != STEPPED:
            return outcome
        step = sizes[TIME] - begin
        end = before_break(rules.breaks, sizes[TIME])
        kinetic, potential, dissipated, power, driven = energies(model, end, motion.q, motion.u, step, record)
        # after an event the power at the end of the step is that of the next one
        jumps = motion.counts[STARTED] == 0 and end == sizes[TIME]
        work = step * (balance[POWER] if jumps else 0.5 * (balance[POWER] + power))
        lost, largest, moving = sizes[UNSEEN] + work, moving + kinetic - driven, kinetic - driven
        certain = abs(sizes[SPENT] - step * dissipated) <= _CERTAIN * abs(lost) and abs(lost) <= largest
        if rules.balances == 0.0 or not certain:
            lost = 0.0
        spent = step * dissipated + add_pairs(motion)
        if end_step(balance, record, motion, begin, work, spent, lost, kinetic, potential, power, driven):
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
