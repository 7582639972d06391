"""Random numbers of a scene; they depend on the seed and the number only, not on other draws."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

__all__ = ["Dice", "Tables", "laws_of_contact", "solve_section"]

Tables = dict[str, Any]
"""A case as its file would have it."""

T = TypeVar("T")


class Dice:
    """Random numbers for scenes."""

    def __init__(self, seed: int, number: int) -> None:
        self.rng = np.random.default_rng([seed, number])

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def decades(self, low: float, high: float) -> float:
        """Evenly in the logarithm."""
        return float(10.0 ** self.rng.uniform(math.log10(low), math.log10(high)))

    def count(self, low: int, high: int) -> int:
        """A whole number, evenly in the logarithm, both ends included."""
        return min(high, int(self.decades(low, high + 1)))

    def chance(self, part: float) -> bool:
        return bool(self.rng.random() < part)

    def one_of(self, items: Sequence[T], weights: Sequence[float] | None = None) -> T:
        part = None if weights is None else np.array(weights) / np.sum(weights)
        return items[int(self.rng.choice(len(items), p=part))]

    def vector(self, size: float) -> list[float]:
        """Vector of a given length in a random direction."""
        way = self.rng.standard_normal(3)
        return [float(x) for x in size * way / np.linalg.norm(way)]

    def turn(self, planar: bool) -> list[float]:
        """Random unit quaternion; in the plane it is a rotation about y."""
        q = self.rng.standard_normal(4) * ([1, 0, 1, 0] if planar else [1, 1, 1, 1])
        return [float(x) for x in q / np.linalg.norm(q)]


METHODS = ("auto", "generalized-alpha", "Radau-blocks", "Radau", "BDF", "LSODA")


def solve_section(dice: Dice, static: bool, end_time: float | None = None) -> Tables:
    """A [solve] section: any method, tolerances over six decades."""
    solve: Tables = {"rtol": dice.decades(1e-8, 1e-2)}
    solve["method"] = dice.one_of(METHODS, (6, 4, 3, 1, 1, 1))
    if static and dice.chance(0.2):
        solve["method"] = "static"
    if end_time is not None:
        solve["end_time"] = end_time
        if dice.chance(0.15):
            solve["max_step"] = end_time * dice.decades(1e-3, 1.0)
    if solve["method"] == "generalized-alpha":
        if dice.chance(0.4):
            solve["rho_inf"] = dice.between(0.0, 1.0)
        if end_time is not None and dice.chance(0.3):
            solve["step"] = end_time * dice.decades(1e-3, 0.1)
    if static and dice.chance(0.2):
        side = dice.one_of((-1.0, 1.0, 0.3))  # this number is drawn for every method, so that all later draws stay the same
        if solve["method"] in ("auto", "static"):
            solve["imperfection"] = side
    return solve


def laws_of_contact(dice: Dice, stiffness: float, depth: float, speed: float) -> Tables:
    """[contact] of any law, and mostly [friction]; stiffness (N/m^1.5), depth (m) and speed (m/s) are typical ones."""
    law = dice.one_of(("hertz", "impact", "linear", "restitution", "hunt-crossley", "lankarani-nikravesh", "flores"))
    exponent = 1.0 if law == "linear" else dice.one_of((1.5, 1.0, 2.0, 3.0), (5, 1, 1, 1))
    contact: Tables = {
        "law": law, "exponent": exponent, "stiffness": stiffness * depth ** (1.5 - exponent),
        "thickness_in_gap": dice.chance(0.7), "resolve_overlap": dice.chance(0.2),
    }  # fmt: skip
    if law in ("hertz", "impact", "linear"):
        contact["damping"] = dice.decades(1e-4, 1e2) * stiffness * depth**1.5 / speed if dice.chance(0.7) else 0.0
        contact["ramp"] = depth * dice.decades(1e-2, 10.0)
    else:
        contact["restitution"] = dice.between(0.01, 1.0)
        contact["speed_floor"] = speed * dice.decades(1e-4, 1.0)
    tables: Tables = {"contact": contact}
    if dice.chance(0.6):
        tables["friction"] = _friction(dice, speed)
    return tables


def _friction(dice: Dice, speed: float) -> Tables:
    law = dice.one_of(("step", "tanh", "stribeck", "lugre"))
    dynamic = dice.between(0.0, 2.0)
    slow = speed * dice.decades(1e-4, 1.0)
    friction: Tables = {"law": law, "mu_dynamic": dynamic}
    if law != "tanh":
        friction["mu_static"] = dynamic * dice.between(1.0, 1.5)
    if law != "lugre":
        friction["v_static"] = slow
    if law == "step":
        friction["v_dynamic"] = slow * dice.between(1.1, 20.0)
    if law in ("stribeck", "lugre"):
        friction["v_stribeck"] = slow * dice.between(1.1, 20.0)
    if law == "lugre":
        friction["presliding"] = dice.decades(1e-7, 1e-3)
    return friction
