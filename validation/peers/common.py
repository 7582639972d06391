"""Common functions of the runs of all problems."""

from __future__ import annotations

import importlib.util

import numpy as np

__all__ = ["EXUDYN", "THERE", "quiet", "rms"]

THERE = importlib.util.find_spec("exudyn") is not None
"""Exudyn is installed."""
EXUDYN = "build without range checks, one thread, no files, no sensor but of what is compared"


def rms(path: np.ndarray, reference: np.ndarray, size: float) -> float:
    """Root mean square of the distance between two paths, relative to a size."""
    return float(np.sqrt(((path - reference) ** 2).sum(axis=1).mean()) / size)


def quiet() -> None:
    """Exudyn does not print that a run failed; the call still raises an error."""
    import exudyn

    exudyn.config.printToConsole = False
