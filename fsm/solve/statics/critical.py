"""Critical points of an equilibrium path: critical mode, type, and stable branch after a bifurcation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.solve.equations.equilibrium_step import Ending, Equilibrium, EquilibriumStep
from fsm.solve.equations.linear import LinearSolver, first_of_largest
from fsm.solve.interface.system import System
from fsm.text.short_repr import ShortRepr

_ITERATIONS = 30
_ALONG = 0.1
"""Component of the response along the critical mode, below which the point is a bifurcation."""
_AMPLITUDES = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1)
"""Trial amplitudes of the critical mode, relative to the span."""


@dataclass(frozen=True, repr=False)
class Critical(ShortRepr):
    """The softest mode of an equilibrium.

    Attributes
    ----------
    mode : (nu,) array
        Mode, scaled so that the first of its largest components, relative to the span, is 1.
    bifurcation : bool
        Whether loads and drives do no work along the mode; otherwise the point is a limit point.
    """

    mode: np.ndarray
    bifurcation: bool


def critical_point(system: System, t: float, q: np.ndarray, later: float) -> Critical:
    """Softest mode at a state, and whether the change of loads and drives until `later` (s) does work along it.

    Inverse iteration with the symmetric part of K, scaled by the span, from a fixed start. Near a limit point the
    response to the drive is along the mode; at a bifurcation it has no component along the mode.
    """
    span = system.scales().span
    solver = LinearSolver()
    solver.factorise(system.linearise(t, q, None).stiffness.symmetric())
    mode = np.random.default_rng(0).standard_normal(system.nu)
    for _ in range(_ITERATIONS):
        scaled = solver.solve(mode / span) / span
        size = float(np.linalg.norm(scaled))
        previous, mode = mode, scaled / size
        if min(np.linalg.norm(mode - previous), np.linalg.norm(mode + previous)) < 1e-8:
            break
    response = solver.solve(system.force(t + 0.01 * (later - t), q, None) - system.force(t, q, None)) / span
    along = abs(float(mode @ response)) / max(float(np.linalg.norm(response)), 1e-300)
    return Critical(mode * span / mode[first_of_largest(np.abs(mode))], along < _ALONG)


def softest_mode(system: System, t: float, q: np.ndarray) -> np.ndarray:
    """Mode without stiffness, (nu,): the softest mode of a singular stiffness to which a small diagonal shift is added."""
    span = system.scales().span
    stiffness = system.linearise(t, q, None).stiffness.symmetric()
    diagonal, size = stiffness.pattern.diagonal, range(stiffness.pattern.size)
    data = stiffness.data.copy()
    scale = span.reshape(-1, stiffness.pattern.size) ** 2
    shift = 1e-9 * float(np.max(np.abs(data[diagonal][:, size, size]) * scale)) or 1.0
    data[diagonal[:, None], size, size] += shift / scale
    solver = LinearSolver()
    solver.factorise(stiffness.with_data(data))
    mode = np.random.default_rng(0).standard_normal(system.nu)
    for _ in range(_ITERATIONS):
        mode = solver.solve(mode / span) / span
        mode /= np.linalg.norm(mode)
    return mode


def stable_branch(
    step: EquilibriumStep,
    t: float,
    guess: np.ndarray,
    efforts: np.ndarray | None,
    critical: Critical,
    side: float,
) -> Equilibrium | None:
    """Stable equilibrium at rest, at time t, beside the unstable path.

    Parameters
    ----------
    step : EquilibriumStep
    t, guess, efforts : time just past the bifurcation, and configuration and spring efforts of the path at that time
    critical : Critical
    side : sign of the critical mode; 0: try both signs and select the lower energy

    Returns
    -------
    Equilibrium or None
    """
    found = []
    for sign in (side,) if side else (1.0, -1.0):
        for amplitude in _AMPLITUDES:
            beside = step.system.retract(guess, np.copysign(amplitude, sign) * critical.mode)
            trial = step.solve(t, beside, (t, beside), efforts)
            if trial.ending is Ending.CONVERGED:
                found.append((step.system.energy(t, trial.q, None).stored, trial))
                break
    # if both energies are equal (a symmetric pair), the positive side is selected, because it is tried first
    return min(found, key=lambda pair: pair[0] - 1e-9 * abs(pair[0]) * (pair is found[0]))[1] if found else None
