"""Panels that pass through each other without contact are reported, in the plane, and in space while creases remain along
y."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fsm.analyses.panel_crossing import unwatched_crossings

SCENE: Any = SimpleNamespace(contact=None)


def quad(start: tuple[float, float], end: tuple[float, float], across: tuple[float, float] = (-1.0, 1.0)) -> np.ndarray:
    """Corners of a plate from one point of the x-z plane to another, between two places along y."""
    (x0, z0), (x1, z1) = start, end
    low, high = across
    return np.array([[x0, low, z0], [x1, low, z1], [x1, high, z1], [x0, high, z0]])


class Run:
    """Data of a solution: a level panel, and a panel that moves down through its middle at half the travel."""

    def __init__(self, dimension: str, across: tuple[float, float] = (-1.0, 1.0), turned_from: int = 99) -> None:
        level = quad((-1.0, 0.0), (1.0, 0.0))
        self.shape = np.array([[level, quad((0.1, 1.02 - 0.1 * k), (0.1, 2.02 - 0.1 * k), across)] for k in range(21)])
        self.shape[turned_from:, 1, 2:, 0] += 0.01
        self.layout = SimpleNamespace(dimension=dimension, panel=np.array([1, 2]))
        self.travel = 0.1 * np.arange(21.0)[:, None]

    def __len__(self) -> int:
        return len(self.shape)


@pytest.mark.parametrize("dimension", ["planar", "spatial"])
def test_a_crossing_is_told_in_plane_and_space(dimension: str) -> None:
    run: Any = Run(dimension)
    assert unwatched_crossings(run, SCENE) == [(1, 2, pytest.approx(1.1))]  # past the 5 % at its end


def test_panels_beside_each_other_do_not_cross() -> None:
    run: Any = Run("spatial", across=(1.0, 2.0))
    assert unwatched_crossings(run, SCENE) == []


def test_panels_that_turn_out_of_the_plane_are_not_looked_at_from_there_on() -> None:
    later: Any = Run("spatial", turned_from=15)
    assert unwatched_crossings(later, SCENE) == [(1, 2, pytest.approx(1.1))]
    before: Any = Run("spatial", turned_from=5)
    assert unwatched_crossings(before, SCENE) == []
