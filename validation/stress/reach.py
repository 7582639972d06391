"""Largest travel of a crease line of a folded strip before a panel is taut, closed or stretched."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

__all__ = ["crease_at", "reach"]

_TAUT = 0.95
"""Part of the length of several panels to which they may be drawn out."""
_CRUSHED = 0.4
"""Part of their first distance to which the ends of several panels may come together."""
_BUCKLED = 0.55
"""Part of the length of a single panel to which it may be shortened."""


def crease_at(number: int, panel: float, angle: float) -> np.ndarray:
    """Place of a crease line, (x, z), m, of panels of a length (m) at an angle with the horizontal (rad)."""
    return np.array([number * panel * math.cos(angle), (number % 2) * panel * math.sin(angle)])


def reach(
    panel: float, most: float, start: np.ndarray, direction: np.ndarray, anchors: Sequence[tuple[np.ndarray, float]]
) -> float:
    """Travel, m, up to which a point can be moved: no panel is taut or closed, and a single panel is only shortened.

    Parameters
    ----------
    panel, most : m
        Length of a panel; largest travel that is examined
    start, direction : (x, z) of the point, and a unit vector
    anchors : for every side that holds the point, the position of the holding point and the length of the panels in between,
    m
    """
    step = panel / 200.0
    first = [float(np.linalg.norm(start - place)) for place, _ in anchors]
    travel = 0.0
    while travel < most:
        at = start + (travel + step) * direction
        for (place, length), before in zip(anchors, first, strict=True):
            distance = float(np.linalg.norm(at - place))
            single = length < 1.01 * panel
            taut = max(_TAUT * length, 0.5 * (before + length))  # a strip that is almost flat is almost taut at the start
            longest, shortest = (length, _BUCKLED * length) if single else (taut, _CRUSHED * before)
            if distance > longest * (1.0 + 1e-9) or distance < shortest:
                return travel
        travel += step
    return most
