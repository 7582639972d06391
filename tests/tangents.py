"""Forces and tangents of systems against central differences."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest


def differences(function: Callable[[np.ndarray], Any], steps: np.ndarray) -> np.ndarray:
    """Central differences of f(dx) at zero, of second order; the last axis has the directions, with a step (n,) for each."""
    moves = np.diag(steps)
    columns = [np.asarray(function(x) - function(-x)) / (2.0 * h) for h, x in zip(steps, moves, strict=True)]
    return np.stack(columns, axis=-1)


def fine_differences(function: Callable[[np.ndarray], Any], steps: np.ndarray) -> np.ndarray:
    """Central differences as `differences`, of fourth order."""
    return (4.0 * differences(function, steps) - differences(function, 2.0 * steps)) / 3.0


def check_force(system: Any, q: np.ndarray, step: float, tolerance: float = 1e-5) -> np.ndarray:
    """Forces at rest are minus the slope of the stored energy; returns them."""
    force: np.ndarray = system.force(0.0, q, None)
    steps = np.full(system.nu, step)
    slope = differences(lambda x: system.energy(0.0, system.retract(q, x), None).stored, steps)
    assert force == pytest.approx(-slope, abs=tolerance * np.abs(slope).max())
    return force


def check_tangents(system: Any, q: np.ndarray, u: np.ndarray, steps: tuple[float, float], tolerance: float = 2e-5) -> None:
    """K and D are minus the derivatives of the forces; steps of coordinates and of rates."""
    stiffness, damping = (matrix.toarray() for matrix in system.tangent(0.0, q, u))
    by_q = differences(lambda x: system.force(0.0, system.retract(q, x), u), np.full(system.nu, steps[0]))
    by_u = differences(lambda x: system.force(0.0, q, u + x), np.full(system.nu, steps[1]))
    for found, wanted in ((stiffness, -by_q), (damping, -by_u)):
        assert found == pytest.approx(wanted, abs=tolerance * np.abs(wanted).max())
