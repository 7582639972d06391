"""Several steps of the generalized-alpha method, with the energy ledger kept at each."""

from __future__ import annotations

from typing import Any

import numpy as np

from fsm.kernels.jit import kernel, shared
from fsm.stepping.generalized_alpha import STEPPED, TIME, Motion, Rules, take_step
from fsm.stepping.model import energies

__all__ = [
    "ALLOWED", "DISSIPATED", "ERROR", "GAINED", "KINETIC_WORST", "LOSSES", "POWER", "SHORTEST", "START", "TRIFLE",
    "TURNOVER", "WORK", "WORST", "balanced", "march", "march_arrays",
]  # fmt: skip

START, DISSIPATED, WORK, ERROR, WORST, GAINED, TURNOVER, KINETIC_WORST, TRIFLE, POWER, SHORTEST, ALLOWED, LOSSES = range(13)
"""Indices of books: the numbers of `fsm.solve.ledger.Ledger` (J), the input power at the end of the last step (W), the
shortest step (s), the error over the turnover up to which the march goes on, and whether losses count for that (0 or 1)."""


@shared
def balanced(
    stored: float, kinetic: float, start: float, dissipated: float, work: float, worst: float, gained: float,
    turnover: float, kinetic_worst: float,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Compare a ledger with the energy stored now, of which some is kinetic, J.

    The new error, worst, gained, turnover and largest kinetic energy of `fsm.solve.ledger.Ledger`.
    """
    error = stored - start + dissipated - work
    kinetic_worst = max(kinetic_worst, kinetic)
    turnover = max(turnover, abs(stored - start), abs(dissipated), abs(work), kinetic_worst)
    return error, max(worst, abs(error)), max(gained, error), turnover, kinetic_worst


@shared
def march(model: Any, motion: Motion, rules: Rules, books: np.ndarray, until: float, most: int) -> int:
    """Take at most so many steps, the last of which ends at `until`; the outcome of the last one.

    It ends early where the balance is off by more than the books allow: the caller judges these steps one by one.
    """
    sizes = motion.sizes
    energies(model, sizes[TIME], motion.q, motion.u, 0.0)
    for _ in range(most):
        begin = sizes[TIME]
        if not begin < until:
            break
        outcome = take_step(model, motion, rules, until)
        if outcome != STEPPED:
            return outcome
        step = sizes[TIME] - begin
        kinetic, potential, dissipated, power = energies(model, sizes[TIME], motion.q, motion.u, step)
        books[WORK] += 0.5 * step * (books[POWER] + power)
        books[DISSIPATED] += step * dissipated
        books[POWER] = power
        books[SHORTEST] = min(books[SHORTEST], step)
        books[ERROR], books[WORST], books[GAINED], books[TURNOVER], books[KINETIC_WORST] = balanced(
            kinetic + potential, kinetic, books[START], books[DISSIPATED], books[WORK], books[WORST], books[GAINED],
            books[TURNOVER], books[KINETIC_WORST],
        )  # fmt: skip
        off = books[WORST] if books[LOSSES] > 0.0 else books[GAINED]
        if books[TURNOVER] > books[TRIFLE] and off > books[ALLOWED] * books[TURNOVER]:
            break
    return STEPPED


march_arrays = kernel(march)
"""The same in one kernel, for an `ArrayModel`."""
