"""Whether a failed scene has a solution: two proofs that it has none with the given settings."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from fsm.results.solution import Solution
from validation.stress.attempt import Attempt, attempt
from validation.stress.dice import Tables

__all__ = ["better_asked", "largest_turn", "turned_right_over", "turns"]

_OWN_RTOL = 1e-6
"""Relative tolerance of a case that gives none."""
_SMALL_RTOL = 1e-8
"""Smallest relative tolerance that is drawn."""
_PATIENCE = 4.0
"""Times its time that a scene has when it is tried again with settings that take longer."""
_OVER = np.radians(170.0)
"""Swing from which on a joint counts as turned right over, rad."""
_ROUND = np.radians(355.0)
"""Twist from its start, likewise, rad."""
_SHORTER = 0.25
"""Part of the time that a scene has next if it is cut off."""
_BALANCED = 0.05
"""Energy error over the reference energy, above which the turns of joints mean nothing."""
_BEFORE = 1.0 - 1e-5
"""Factor of the time of a failure, if its message states this time; a scene is solved again up to this time."""
_TRIES = 4
"""Solves that may fail earlier than the one before."""
_KEPT = ("end_time", "spatial")
"""Settings that belong to the scene; all others are the program's own when it is tried again."""


def better_asked(tables: Tables, first: Attempt, limit: float) -> str:
    """Class of a scene that failed with its given method, step or tolerance, by a run with the default settings.

    "asked": it is solved; if the message advises a smaller tolerance, smaller tolerances are used. The run stated that the
    scene cannot be solved with the given settings, and its advice helps. "cut off": the run is past the failure at its time
    limit. "": it fails again.
    """
    asked, what = tables["solve"], first.what
    own: dict[str, Any] = {key: asked[key] for key in _KEPT if key in asked}
    for rtol in (min(asked["rtol"], _OWN_RTOL), _SMALL_RTOL):
        solve = own | {"rtol": rtol}
        if solve != {key: value for key, value in asked.items() if (key, value) != ("method", "auto")}:
            again = attempt({**tables, "solve": solve}, _PATIENCE * limit)
            if again.end == "finished":
                return "asked"
            if again.end == "cut off" and again.reached > first.reached:
                return "cut off"
            what = again.what
        if "tighten" not in what:
            return ""
    return ""


def turned_right_over(tables: Tables, first: Attempt, limit: float) -> bool:
    """Whether a joint of a chain had rotated beyond the range of its measures when the solve failed.

    A swing of half a turn has no direction, and the moment of its springs jumps from one side to the other. The twist is
    continuous over one turn in each direction from its initial value, and jumps there. The shear angle of a ligament jumps
    in the same way at half a turn, for example where its ends meet. The equations have no solution beyond these rotations.
    The default method of the program solves the scene again up to the failure, or to the end of the fixed step that failed,
    without the energy check. The joints are examined only as long as its energy balance holds.
    """
    own = {key: tables["solve"][key] for key in _KEPT if key in tables["solve"]}
    own |= {"rtol": min(tables["solve"]["rtol"], _OWN_RTOL), "energy_abort": 1e30}
    what, more = first.what, tables["solve"].get("step", 0.0)
    for _ in range(_TRIES):
        when = re.search(r"at t = ([0-9.e+-]+) s", what)
        if when is None or "elements" not in tables.get("scene", {}):
            return False
        end = min(_BEFORE * float(when[1]) + more, tables["solve"]["end_time"])
        again = attempt({**tables, "solve": own | {"end_time": end}, "save": {"interval": end / 1000.0}}, _PATIENCE * limit)
        if again.solution is not None:
            return _balanced_turn(tables, again.solution) > 1.0
        what, more = (f"at t = {_SHORTER * end} s", 0.0) if again.end in ("cut off", "hang") else (again.what, 0.0)
    return False


def _balanced_turn(tables: Tables, solution: Solution) -> float:
    """Largest rotation up to the first record after the last one with a closed energy balance."""
    energy = solution.energy
    size = np.maximum.accumulate(np.abs(energy["kinetic"]) + np.abs(energy["dissipated"]) + np.abs(energy["work"]))
    off = np.abs(energy["error"] - energy["numerical"]) > _BALANCED * size
    last = int(np.argmax(off)) if off.any() else len(off) - 1
    return float(turns(tables, solution)[: last + 1].max())


def largest_turn(tables: Tables, solution: Solution) -> float:
    """Largest rotation of any joint in a run; see `turns`."""
    return float(turns(tables, solution).max())


def turns(tables: Tables, solution: Solution) -> np.ndarray:
    """Largest rotation of any joint at each record, relative to the range of its measures.

    In space these are a swing of `_OVER` and a twist of `_ROUND` from its start, in the plane a shear angle of `_OVER` of a
    ligament. Other joints in the plane can rotate without limit.
    """
    bodies = {body["name"]: body for body in tables["scene"]["bodies"]}
    names = list(solution.layout.body_names)
    q = solution.q.reshape(len(solution), len(names), -1)
    spatial = solution.layout.dimension == "spatial"
    largest = np.zeros(len(solution))
    for joint in tables["scene"]["elements"]:
        inner, outer = (
            q[:, names.index(joint[end])]
            if joint[end] in names
            else np.tile(_pose(bodies[joint[end]], spatial), (len(solution), 1))
            for end in ("inner", "outer")
        )
        if spatial:
            parts = _relative(outer[:, 3:], inner[:, 3:])
            swing = 2.0 * np.arctan2(np.hypot(parts[1], parts[3]), np.hypot(parts[0], parts[2]))
            twist = np.unwrap(2.0 * np.arctan2(parts[2], parts[0]))
            largest = np.maximum(largest, np.maximum(swing / _OVER, np.abs(twist - twist[0]) / _ROUND))
        elif joint.get("frame") == "chord":
            chord = _place(inner, joint["point_inner"]) - _place(outer, joint["point_outer"])
            shear = np.unwrap(np.arctan2(-chord[:, 1], chord[:, 0])) - 0.5 * (inner[:, 2] + outer[:, 2])
            largest = np.maximum(largest, np.abs(shear - shear[0]) / _OVER)
    return largest


def _pose(body: Tables, spatial: bool) -> np.ndarray:
    """Configuration of a held body."""
    place, turn = body["position"], body.get("orientation", [1.0, 0.0, 0.0, 0.0])
    if spatial:
        return np.array([*place, *turn])
    return np.array([place[0], place[2], 2.0 * np.arctan2(turn[2], turn[0])])


def _place(poses: np.ndarray, point: Sequence[float]) -> np.ndarray:
    """Position (records, 2) of a point of a body in the plane."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack([poses[:, 0] + c * point[0] + s * point[2], poses[:, 1] - s * point[0] + c * point[2]])


def _relative(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """conj(outer) inner of rows of quaternions, scalar first; (4, n)."""
    p, r = outer * np.array([1.0, -1.0, -1.0, -1.0]), inner
    scalar = p[:, 0] * r[:, 0] - np.einsum("ij,ij->i", p[:, 1:], r[:, 1:])
    vector = p[:, :1] * r[:, 1:] + r[:, :1] * p[:, 1:] + np.cross(p[:, 1:], r[:, 1:])
    return np.vstack([scalar, vector.T])
