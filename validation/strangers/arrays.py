"""Scissor arrays that a force opens, or the springs in their hinges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fsm.case.derived.scissor import array_at
from fsm.case.models.scissor import Scissor
from validation.strangers.drawn import Drawn
from validation.strangers.typed import deg, digits, gpa, mm, newton, nice
from validation.stress.dice import Dice, Tables

__all__ = ["draw_array"]

BARS = (
    (200e9, 7850.0, 0.3),
    (70e9, 2700.0, 0.33),
    (110e9, 1600.0, 0.3),
    (25e9, 1900.0, 0.25),
    (10e9, 600.0, 0.3),
    (5e9, 1400.0, 0.35),
)
"""Steel, aluminium, carbon and glass laminates, wood, filled polymers: E (Pa), density (kg/m^3), Poisson's ratio."""


def draw_array(dice: Dice) -> Drawn:
    """An array of 1 to 20 units, slender to deep bars, opened by a force or by springs, with or without stops and latches.

    The case has a solution. The force, or the springs, bend the bars with strains of at most 1e-3. The time ends where the
    same array with rigid bars is still 10 degrees from flat (a ring: from fully open), or some time after its stops are
    reached; the stops are stiff enough to absorb the energy of the motion within 3 to 10 degrees.
    """
    shape = dice.one_of(("linear", "linear", "arched", "ring"))
    length = nice(dice.decades(0.1, 3.0))
    height = 1e-3 * nice(1e3 * length / dice.decades(8.0, 150.0))
    breadth = 1e-3 * nice(1e3 * height * dice.decades(0.5, 3.0))
    young, density, poisson = dice.one_of(BARS)
    units, hinge, start = _folded(dice, shape)
    scissor: Tables = {"shape": shape, "units": units, "bar_length": mm(length), "initial_angle": deg(start)}
    if shape == "arched":
        scissor["hinge"] = hinge
    element = dice.one_of(("", "", "", "section", "green", "cable"))
    if element:
        scissor["element"] = element
    rigid = Scissor(shape=shape, units=units, bar_length=length, initial_angle=start, **({"hinge": hinge} if hinge else {}))
    out = math.pi / units if shape == "ring" else 0.0
    last = out + min(math.radians(10.0), 0.3 * (start - out))
    moment = young * breadth * height**2 / 6.0 * dice.decades(2e-5, 1e-3)
    opening = _Opening(rigid, start, last, density * breadth * height)
    tables: Tables = {
        "analysis": "scissor", "scissor": scissor, "bar": {"width": mm(breadth), "height": mm(height)},
        "material": {"young": gpa(young), "poisson": poisson, "density": f"{density:g} kg/m^3"},
    }  # fmt: skip
    if dice.chance(0.4):
        tables["material"]["damping"] = dice.one_of((0.0, "0.1 ms"))
    work = np.zeros(len(opening.angles))
    springs = dice.one_of((False, False, True))
    if springs:
        rest = digits(2.0 * (start - last) * dice.between(1.0, 1.3))
        stiffness = digits(moment / rest)
        tables["hinge"] = {"stiffness": f"{stiffness:.12g} N m/rad", "rest_turn": deg(rest), "at": "middle"}
        work += units * (0.5 * stiffness * rest**2 - 0.5 * stiffness * (rest - 2.0 * (start - opening.angles)) ** 2)
    elif dice.chance(0.3):
        tables["hinge"] = _resisting(dice, moment)
    push, ramp = digits(4.0 * moment / length * (0.3 if springs else 1.0)), ""
    if not springs or dice.chance(0.3):
        load, gained = opening.pushed(push)
        work += gained
        if dice.chance(0.75):
            ramp = dice.one_of(("10 ms", "20 ms", "50 ms", "100 ms"))
            load["time"] = {"kind": "ramp", "end": ramp}
        tables["force"] = [load]
    # springs act suddenly, even if a force has a ramp
    late = 0.6e-3 * float(ramp.split()[0]) if ramp and not springs else 0.0
    if dice.chance(0.4):
        part = dice.between(0.3, 0.8)
        stop = digits(start - part * (start - last))
        energy, soft = opening.at(work, stop) / units, math.radians(dice.between(3.0, 10.0))
        tables["stop"] = {"angle": deg(stop), "stiffness": f"{digits(2.5 * energy / soft**2.5):.12g} N m/rad^1.5"}
        if dice.chance(0.6):
            tables["stop"] |= {"latch": True, "damping": "0.1 s/rad"}
        end = dice.between(1.2, 2.0) * opening.time(work, stop) + late
    else:
        end = opening.time(work, start - dice.between(0.3, 0.95) * (start - last)) + late
    return Drawn(tables | {"solve": {"end_time": f"{nice(end):g} s"}}, {})


def _folded(dice: Dice, shape: str) -> tuple[int, float, float]:
    """Number of units, position of the hinges of an arch (else 0), and initial angle of the bars, rad."""
    if shape == "ring":
        units = dice.count(5, 20)
        least = 180.0 / units
        return units, 0.0, math.radians(round(dice.between(least + 0.7 * (90.0 - 2.0 * least), 89.0 - least)))
    units, start = dice.count(1, 20), math.radians(round(dice.between(55.0, 86.0)))
    hinge = dice.one_of((0.46, 0.48, 0.52, 0.54)) if shape == "arched" else 0.0
    if hinge:  # the bars of an arch that closes rotate more than those of a ring
        units = min(units, 6)
    return units, hinge, start


def _resisting(dice: Dice, moment: float) -> Tables:
    """Springs and dampers of hinges; their moments are small relative to the moment in the bars."""
    hinge: Tables = {}
    if dice.chance(0.6):
        hinge["stiffness"] = f"{digits(0.02 * moment):.12g} N m/rad"
    if dice.chance(0.5) or not hinge:
        hinge["damping"] = f"{digits(0.002 * moment):.12g} N m s/rad"
    if dice.chance(0.3):
        hinge["friction_moment"] = f"{digits(0.02 * moment):.12g} N m"
    return hinge


class _Opening:
    """The array with rigid bars: work of a force at a point, and time at which an angle is reached."""

    def __init__(self, rigid: Scissor, start: float, last: float, line_mass: float) -> None:
        self.rigid, self.line_mass = rigid, line_mass
        self.angles = np.linspace(start, last, 60)
        self.mass = np.array([self._inertia(angle) for angle in self.angles])

    def _places(self, angle: float) -> dict[str, np.ndarray]:
        array = array_at(self.rigid, angle)
        centre = np.array(array.centre if array.closed and array.centre else (0.0, 0.0))
        return {name: np.array(place) - centre for name, place in array.points.items()}

    def _inertia(self, angle: float) -> float:
        """Kinetic energy over half the squared rate of the angle, kg m^2."""
        one, two = self._places(angle - 1e-4), self._places(angle + 1e-4)
        move = {name: (two[name] - one[name]) / 2e-4 for name in one}
        total = 0.0
        for bar in array_at(self.rigid, angle).bars:
            for a, b in (bar.points[:2], bar.points[1:]):
                half = self.line_mass * float(np.linalg.norm(one[a] - one[b]))
                total += half / 3.0 * float(move[a] @ move[a] + move[a] @ move[b] + move[b] @ move[b])
        return total

    def pushed(self, force: float) -> tuple[dict[str, Any], np.ndarray]:
        """[[force]] that opens the array, and its work at every angle, J."""
        places = np.array([self._places(angle)["a1"] for angle in self.angles])
        if self.rigid.shape == "ring":
            radius = np.linalg.norm(places, axis=1)
            way = math.copysign(1.0, radius[-1] - radius[0])
            return {"point": "a1", "radial": newton(way * force)}, force * np.abs(radius - radius[0])
        return {"point": "a1", "force": [0, newton(-force)]}, force * (places[0, 1] - places[:, 1])

    def at(self, values: np.ndarray, angle: float) -> float:
        """Interpolated value at an angle."""
        return float(np.interp(-angle, -self.angles, values))

    def time(self, work: np.ndarray, angle: float) -> float:
        """Time at which an angle is reached from rest, s."""
        middle = 0.5 * (self.mass[1:] + self.mass[:-1])
        # the speed first grows as a square root, so the durations of steps follow from the growth of the work, not from a
        # speed
        speed = np.sqrt(2.0 * np.maximum(work, 1e-12 * work.max()) / self.mass)
        speed[0] = 0.0
        step = 2.0 * np.abs(np.diff(self.angles)) / (speed[1:] + speed[:-1])
        return float(np.interp(-angle, -self.angles, np.concatenate([[0.0], np.cumsum(step)]))) if middle.size else 0.0
