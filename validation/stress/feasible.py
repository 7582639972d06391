"""Whether a scene that failed has an answer: two proofs that it has none as it was asked for."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from fsm.results.solution import Solution
from validation.stress.attempt import Attempt, attempt
from validation.stress.dice import Tables

__all__ = ["better_asked", "largest_turn", "turned_right_over"]

_OWN_RTOL = 1e-6
"""Relative tolerance of a case that gives none."""
_PATIENCE = 4.0
"""Times its time that a scene has when it is tried again with settings that take longer."""
_OVER = np.radians(170.0)
"""Swing from which on a joint counts as turned right over, rad."""
_ROUND = np.radians(355.0)
"""Twist from its start, likewise, rad."""
_KEPT = ("end_time", "spatial")
"""Settings that belong to the scene; all others are the program's own when it is tried again."""


def better_asked(tables: Tables, limit: float) -> bool:
    """Whether a scene that failed with the method, step or tolerance asked for is solved with the program's own.

    Then the run said that it cannot be done so, and what it advised helps.
    """
    asked = tables["solve"]
    own: dict[str, Any] = {key: asked[key] for key in _KEPT if key in asked} | {"rtol": min(asked["rtol"], _OWN_RTOL)}
    if own == {key: value for key, value in asked.items() if (key, value) != ("method", "auto")}:
        return False
    return attempt({**tables, "solve": own}, _PATIENCE * limit).end == "finished"


def turned_right_over(tables: Tables, first: Attempt, limit: float) -> bool:
    """Whether a joint of a chain had turned farther than its measures reach when the energy balance was lost.

    A swing of half a turn has no direction, and the moment of its springs jumps from one side to the other. The twist is
    continuous over a turn either way from where it starts, and jumps there. The equations have no solution beyond. The
    scene is solved up to the failure without regard to its energy, to see how far its joints turn.
    """
    when = re.search(r"at t = ([0-9.e+-]+) s", first.what)
    if when is None or "energy balance" not in first.what or "elements" not in tables.get("scene", {}):
        return False
    end = float(when[1])
    solve = tables["solve"] | {"end_time": end, "energy_abort": 1e30}
    again = attempt({**tables, "solve": solve, "save": {"interval": end / 1000.0}}, _PATIENCE * limit)
    return again.solution is not None and largest_turn(tables, again.solution) > 1.0


def largest_turn(tables: Tables, solution: Solution) -> float:
    """Largest turn of any joint, part of what its measures reach: swing of `_OVER`, twist of `_ROUND` from its start."""
    names = list(solution.layout.body_names)
    start = {body["name"]: np.array(body.get("orientation", [1.0, 0.0, 0.0, 0.0])) for body in tables["scene"]["bodies"]}
    spatial = solution.layout.dimension == "spatial"
    q = solution.q.reshape(len(solution), len(names), 7 if spatial else 3)
    largest = 0.0
    for joint in tables["scene"]["elements"]:
        a, b = (
            q[:, names.index(name), 3 if spatial else 2 :]
            if name in names
            else np.array([start[name] if spatial else [0.0]])
            for name in (joint["inner"], joint["outer"])
        )
        if spatial:
            parts = _relative(np.broadcast_to(b, (len(solution), 4)), np.broadcast_to(a, (len(solution), 4)))
            swing = 2.0 * np.arctan2(np.hypot(parts[1], parts[3]), np.hypot(parts[0], parts[2]))
            twist = np.unwrap(2.0 * np.arctan2(parts[2], parts[0]))
            largest = max(largest, float(swing.max()) / _OVER)
        else:
            twist = (a - b).ravel()
        largest = max(largest, float(np.abs(twist - twist[0]).max()) / _ROUND)
    return largest


def _relative(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """conj(outer) inner of rows of quaternions, scalar first; (4, n)."""
    p, r = outer * np.array([1.0, -1.0, -1.0, -1.0]), inner
    scalar = p[:, 0] * r[:, 0] - np.einsum("ij,ij->i", p[:, 1:], r[:, 1:])
    vector = p[:, :1] * r[:, 1:] + r[:, :1] * p[:, 1:] + np.cross(p[:, 1:], r[:, 1:])
    return np.vstack([scalar, vector.T])
