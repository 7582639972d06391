"""Random tensioned films and scissor arrays."""

from __future__ import annotations

import math

from validation.stress.dice import METHODS, Dice, Tables

__all__ = ["draw_film", "draw_scissor"]


def draw_film(dice: Dice) -> Tables:
    """A film with or without patch, cables, air and damping, with random stretch and an impact."""
    length, thickness = dice.decades(1e-2, 10.0), dice.decades(1e-6, 1e-2)
    width = length * dice.decades(0.1, 10.0)
    young, density, poisson = dice.decades(1e6, 1e12), dice.decades(10.0, 2e4), dice.between(-0.5, 0.49)
    strain = dice.decades(1e-6, 1e-1)
    stress = young * strain
    tables: Tables = {
        "analysis": "vibrate",
        "membrane": {
            "length": length, "width": width, "thickness": thickness, "mesh": [dice.count(1, 10), dice.count(1, 10)],
        },
        "material": {"young": young, "poisson": poisson, "density": density},
    }  # fmt: skip
    tension: Tables = {"film": dice.one_of(("plain", "tension-field", "wrinkles"), (5, 4, 1))}
    if dice.chance(0.5):
        tension["strain"] = strain if dice.chance(0.6) else [strain, strain * dice.between(-0.5, 1.0)]
    else:
        tension["pull"] = stress * thickness * min(length, width) * dice.decades(1e-2, 1.0)
        if dice.chance(0.7):
            tables["cable"] = [_cable(dice, length, young, density)]
    tables["tension"] = tension
    if dice.chance(0.4):
        tables["patch"] = [_patch(dice, length, width, thickness, young, density)]
    if dice.chance(0.4):
        tables["air"] = {"density": dice.decades(1e-3, 10.0)}
    period = 2.0 * min(length, width) / math.sqrt(stress / density)
    if dice.chance(0.5):
        tables["damping"] = {"air": dice.decades(1e-3, 10.0) / period, "material": period * dice.decades(1e-6, 1e-1)}
    at = dice.one_of(("edges", "corners", "cables", None), (4, 1, 1, 4))
    if at is not None:
        tables["support"] = [{"at": at, "clamped": dice.chance(0.2)}]
    tables["vibration"] = {
        "duration": period * dice.decades(0.1, 5.0), "modes": dice.count(1, 20),
        "model": dice.one_of(("auto", "full", "reduced")), "stretch": dice.chance(0.2),
    }  # fmt: skip
    if dice.chance(0.9):
        force = stress * thickness * length * dice.decades(1e-6, 1.0)
        pulse = dice.one_of(("half-sine", "rectangle"))
        tables["impact"] = {
            "pulse": pulse, "force": force, "duration": period * dice.decades(1e-3, 1.0),
            "point": [length * dice.between(-0.5, 0.5), width * dice.between(-0.5, 0.5)],
        }  # fmt: skip
    tables["solve"] = {"rtol": dice.decades(1e-8, 1e-2)}
    return tables


def _cable(dice: Dice, length: float, young: float, density: float) -> Tables:
    cable: Tables = {
        "place": "corners", "diameter": length * dice.decades(1e-4, 1e-2), "young": young * dice.decades(1e-2, 1e4),
        "density": density * dice.decades(0.1, 10.0),
    }  # fmt: skip
    if dice.chance(0.7):
        return cable | {"length": length * dice.decades(0.05, 1.0), "elements": dice.count(1, 6)}
    return cable | {"place": "edges"}


def _patch(dice: Dice, length: float, width: float, thickness: float, young: float, density: float) -> Tables:
    patch: Tables = {
        "place": dice.one_of(("centre", "diagonal", "position")), "size": min(length, width) * dice.decades(0.1, 0.5),
        "thickness": thickness * dice.decades(0.3, 100.0), "young": young * dice.decades(0.1, 1e3),
        "density": density * dice.decades(0.1, 10.0),
    }  # fmt: skip
    if patch["place"] == "diagonal":
        patch["distance"] = min(length, width) * dice.between(0.05, 0.4)
    if patch["place"] == "position":
        patch["position"] = [length * dice.between(-0.4, 0.4), width * dice.between(-0.4, 0.4)]
    return patch


def draw_scissor(dice: Dice) -> Tables:
    """A linear, arched or ring-shaped array of flexible or rigid bars, pushed or released."""
    shape = dice.one_of(("linear", "arched", "ring"), (4, 2, 2))
    units = dice.count(3 if shape == "ring" else 1, 6)
    length = dice.decades(1e-2, 10.0)
    height = length * dice.decades(3e-3, 0.1)
    young, density = dice.decades(1e7, 1e12), dice.decades(10.0, 2e4)
    start = math.radians(dice.between(3.0, 87.0))
    scissor: Tables = {
        "shape": shape, "units": units, "bar_length": length, "initial_angle": start,
        "element": dice.one_of(("section", "green", "cable")), "elements_per_bar": dice.count(2, 6),
    }  # fmt: skip
    if shape == "arched":
        scissor["hinge"] = dice.one_of((dice.between(0.35, 0.49), dice.between(0.51, 0.6)))
    if dice.chance(0.2):
        scissor["rigid"] = True
    width = height * dice.decades(0.2, 5.0)
    bending = young * width * height**3 / 12.0
    period = math.sqrt(density * width * height * length**4 / bending)
    push = bending / length**2 * dice.decades(1e-4, 0.3)
    mass = density * width * height * length * units
    end_time = min(200.0 * period, math.sqrt(mass * length / push)) * dice.decades(0.01, 0.5)
    tables: Tables = {
        "analysis": "scissor", "scissor": scissor, "bar": {"width": width, "height": height},
        "material": {
            "young": young, "poisson": dice.between(0.0, 0.45), "density": density,
            "damping": 0.0 if dice.chance(0.4) else period * dice.decades(1e-6, 1e-1),
        },
        "save": {"interval": end_time / dice.count(5, 40)},
    }  # fmt: skip
    force = [0.0, -push] if dice.chance(0.7) else [push * dice.between(-1.0, 1.0), push * dice.between(-1.0, 1.0)]
    load: Tables = {"point": dice.one_of(("a1", f"b{units}", "h1")), "force": force}
    if dice.chance(0.6):
        load["time"] = {"kind": "ramp", "end": end_time * dice.decades(1e-2, 1.0)}
    tables["force"] = [load]
    if dice.chance(0.5):
        tables["hinge"] = _hinge(dice, push * length, period)
    if dice.chance(0.3):
        tables["stop"] = {"angle": start * dice.between(0.3, 0.99), "stiffness": push * length * dice.decades(1.0, 1e4)}
    solve: Tables = {"rtol": dice.decades(1e-8, 1e-2), "end_time": end_time}
    solve["method"] = dice.one_of(METHODS, (8, 4, 1, 1, 1, 0))
    if solve["method"] == "generalized-alpha" and dice.chance(0.4):
        solve["step"] = end_time * dice.decades(2e-3, 2e-2)
        solve["rho_inf"] = dice.between(0.0, 1.0)
    tables["solve"] = solve
    return tables


def _hinge(dice: Dice, moment: float, period: float) -> Tables:
    hinge: Tables = {"at": dice.one_of(("middle", "tips", "all"))}
    if dice.chance(0.6):
        hinge |= {"stiffness": moment * dice.decades(1e-3, 10.0), "rest_turn": dice.between(-1.0, 1.0)}
    if dice.chance(0.5):
        hinge["damping"] = moment * period * dice.decades(1e-4, 1.0)
    if dice.chance(0.4):
        hinge |= {"friction_moment": moment * dice.decades(1e-3, 0.5), "friction_speed": dice.decades(1e-4, 1e-1) / period}
    return hinge
