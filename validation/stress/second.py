"""Second solution: the same scene by another method, or with other increments."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from fsm.results.solution import Solution
from validation.stress.attempt import Attempt, attempt

__all__ = ["Opinion", "difference_of", "second_opinion"]

_SAME = 2e-2
"""Largest difference, relative to the displacement, with which two solvers agree."""
_TOLERANCES = 30.0
"""Multiple of rtol times the size that is added to this displacement, because errors of steps add up."""
_FINER = 1e-2
"""Factor of rtol for a repeated solution if they do not agree."""
_NUDGE = 1e-6
"""Relative change of the speeds or of the first load of a scene, to find whether it is sensitive."""


@dataclass(frozen=True)
class Opinion:
    """Verdict of the second solver: "agrees", "loose", "sensitive", "none" or "differs", with the difference."""

    says: str
    difference: float
    by: str


def second_opinion(tables: dict[str, Any], first: Attempt, limit: float) -> Opinion:
    """Solve the scene again in another way, and determine the cause of a difference.

    "loose": both agree at a smaller tolerance, so the given tolerance was too large; "sensitive": the accurate solutions
    differ as much as after a change of the scene by 1e-6; "none": the second solver could not solve the scene in its time.
    """
    other, by = _otherwise(tables, first.method)
    again = attempt(other, limit)
    if first.solution is None or again.solution is None:
        return Opinion("none", 0.0, by)
    rtol = tables["solve"]["rtol"]
    difference = difference_of(first.solution, again.solution, rtol)
    if difference <= _SAME:
        return Opinion("agrees", difference, by)
    fine, fine_other = attempt(_finer(tables), 2.0 * limit), attempt(_finer(other), 2.0 * limit)
    if fine.solution is None or fine_other.solution is None:
        return Opinion("none", difference, by)
    left = difference_of(fine.solution, fine_other.solution, _FINER * rtol)
    if left <= _SAME:
        return Opinion("loose" if rtol > 1e-7 else "differs", difference, by)
    nudged = attempt(_nudged(_finer(tables)), 2.0 * limit)
    if nudged.solution is None:
        return Opinion("none", left, by)
    moved = difference_of(fine.solution, nudged.solution, _FINER * rtol)
    return Opinion("sensitive" if moved > 0.1 * left else "differs", left, by)


def _otherwise(tables: dict[str, Any], method: str) -> tuple[dict[str, Any], str]:
    """The same scene for another solver."""
    other = copy.deepcopy(tables)
    solve = other["solve"]
    for key in ("step", "rho_inf", "max_step"):
        solve.pop(key, None)
    if "sheet" in other and (method != "static" or "drive" not in other):
        solve |= {"method": method, "rtol": max(1e-10, _FINER * solve["rtol"])}
        return other, "a hundredth of rtol"
    if method == "static":
        solve["method"] = "static"
        solve["increment"] = other["drive"][0]["travel"] / 1000.0
        return other, "static, increments of a thousandth"
    if other.get("analysis") == "vibrate":
        other["vibration"]["model"] = "full"
        return other, "full model"
    solve.pop("imperfection", None)  # a key of statics, which the other method does not use
    solve["method"] = "generalized-alpha" if method != "generalized-alpha" else "Radau-blocks"
    if _plates_touch(other):
        if solve["method"] == "Radau-blocks":
            # this method does not repeat a step in which a body passed through a face, nor a step in which an impact begins
            solve["rtol"] = max(1e-10, _FINER * solve["rtol"])
            solve["max_step"] = _no_leap(other["scene"]["bodies"], other.get("gravity", [0.0]), solve["end_time"])
        return other, solve["method"]
    if _flat(other):
        solve["spatial"] = True
        return other, f"{solve['method']}, in space"
    return other, solve["method"]


def _flat(tables: dict[str, Any]) -> bool:
    """Whether the scene lies in its plane and may also be solved in space."""
    return "scene" in tables and "obstacle" not in tables and "load" not in tables


def _plates_touch(tables: dict[str, Any]) -> bool:
    """Whether rigid plates may touch each other.

    In space the edges of plates touch in addition to their points. Where edges of plates of one width lie over each other,
    as in every plane motion, a contact is several times stiffer than in the plane, so the problem is different.
    """
    return "scene" in tables and bool(tables["scene"].get("pairs")) and not tables["scene"].get("surfaces")


def _no_leap(bodies: list[dict[str, Any]], gravity: list[float], duration: float) -> float:
    """Step, s, in which no point moves by more than a quarter of the thinnest plate, at the initial speeds."""
    plates = [(body, body["plate"]) for body in bodies if body.get("plate")]
    speed = duration * float(np.linalg.norm(gravity))
    for body, plate in plates:
        turning = 0.5 * plate["length"] * np.linalg.norm(body.get("angular_velocity", [0.0]))
        speed = max(speed, float(np.linalg.norm(body.get("velocity", [0.0])) + turning))
    return float(min(duration, 0.25 * min(plate["thickness"] for _, plate in plates) / max(speed, 1e-300)))


def _finer(tables: dict[str, Any]) -> dict[str, Any]:
    fine = copy.deepcopy(tables)
    solve = fine["solve"]
    solve["rtol"] = max(1e-10, _FINER * solve["rtol"])
    for key in ("step", "increment"):
        if key in solve:
            solve[key] *= 0.2
    return fine


def _nudged(tables: dict[str, Any]) -> dict[str, Any]:
    nudged = copy.deepcopy(tables)
    if "scene" in nudged:
        for body in nudged["scene"]["bodies"]:
            body["velocity"] = [x * (1.0 + _NUDGE) for x in body["velocity"]]
            body["position"] = [x * (1.0 + _NUDGE) for x in body["position"]]
    angles = ("strip", "fold_angle"), ("lattice", "angle"), ("scissor", "initial_angle")
    for section, key in (*angles, ("tension", "pull"), ("sheet", "fold_angle"), ("sheet", "twist")):
        if nudged.get(section, {}).get(key):
            nudged[section][key] *= 1.0 + _NUDGE
    return nudged


def difference_of(one: Solution, two: Solution, rtol: float) -> float:
    """Largest difference of the quantities that both results have at common times, relative to the displacement so far;
    motions within `rtol` count little."""
    common, a, b = np.intersect1d(one.time, two.time, return_indices=True)
    if len(common) < 2:
        n = min(len(one), len(two))
        a = b = np.arange(n)
    first, second = one.shape[a].reshape(len(a), -1, 3), two.shape[b].reshape(len(b), -1, 3)
    if not first.size:
        return 0.0
    way = float(np.abs(first - first[0]).max()) + _TOLERANCES * rtol * float(np.ptp(first[0], axis=0).max())
    return float(np.abs(first - second).max() / way)
