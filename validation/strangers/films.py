"""Tensioned films with an impact."""

from __future__ import annotations

import math

from validation.strangers.drawn import Drawn
from validation.strangers.typed import digits, gpa, mm, newton, nice, um
from validation.stress.dice import Dice, Tables

__all__ = ["draw_film"]

FILMS = (
    (2.5e9, 3e9, 0.34, 1420.0, 7.5e-6, 125e-6),  # polyimide
    (3.5e9, 5e9, 0.38, 1390.0, 2e-6, 250e-6),  # polyester
    (5e9, 6e9, 0.3, 1350.0, 2e-6, 50e-6),  # polyethylene naphthalate
    (0.2e9, 1e9, 0.42, 930.0, 10e-6, 250e-6),  # polyethylene
    (69e9, 70e9, 0.33, 2700.0, 10e-6, 100e-6),  # aluminium foil
)
"""Young's modulus from, to (Pa), Poisson's ratio, density (kg/m^3), thickness from, to (m)."""

CABLES = ((100e9, 1450.0), (60e9, 970.0), (200e9, 7850.0), (3e9, 1150.0))
"""Aramid, polyethylene fibre, steel, polyamide: Young's modulus (Pa), density (kg/m^3)."""

PATCHES = ((200e9, 7850.0, 0.3), (70e9, 2700.0, 0.33), (20e9, 1800.0, 0.2), (3e9, 1420.0, 0.34))
"""Steel, aluminium, circuit board, film upon film: Young's modulus (Pa), density (kg/m^3), Poisson's ratio."""


def draw_film(dice: Dice) -> Drawn:
    """A rectangular film under tension, with patches, cables and air, and a short impact force.

    The case has a solution: stresses are 0.1 to 5 MPa and strains at most 0.2 % where the stress is uniform, cables carry at
    most 300 MPa, and the impact moves the film by 2 % of its width at most. A film that carries compression ("plain") is
    stretched along both axes, by at least its Poisson contraction, so that no part is compressed. A film that is pulled at
    its corners has wrinkled or slack edges, so the model is a tension field or its wrinkles are computed.
    """
    soft, stiff, poisson, density, thin, thick = dice.one_of(FILMS)
    young = digits(dice.between(soft, stiff))
    length = nice(dice.decades(0.05, 20.0))
    width = digits(length * dice.between(0.3, 1.0))
    thickness = nice(dice.decades(max(thin, 2e-6), min(thick, 250e-6)))
    stress = min(dice.decades(0.1e6, 5e6), 2e-3 * young)
    mesh = _mesh(dice, length, width)
    tables: Tables = {
        "analysis": "vibrate",
        "membrane": {"length": mm(length), "width": mm(width), "thickness": um(thickness), "mesh": mesh},
        "material": {"young": gpa(young), "poisson": poisson, "density": f"{density:g} kg/m^3"},
    }
    tables |= (
        _strained(dice, stress / young, poisson) if dice.chance(0.4) else _pulled(dice, stress, width, length, thickness)
    )
    if dice.chance(0.3):
        tables["patch"] = [_patch(dice, length, width, thickness, length / mesh[0])]
    air = 0.0
    if dice.chance(0.5):
        tables["air"] = {"density": "1.2 kg/m^3"}
        air = 0.68 * 1.2 * length
    if dice.chance(0.8):
        tables["damping"] = {"air": dice.one_of(("1 1/s", "2 1/s", "4 1/s", "10 1/s"))}
    wave = math.sqrt(stress * thickness / (density * thickness + air))
    frequency = 0.5 * wave * math.hypot(1.0 / length, 1.0 / width)
    force = digits(stress * thickness * width * dice.decades(1e-3, 2e-2), 2)
    point = [mm(length * round(dice.between(-0.35, 0.35), 2)), mm(width * round(dice.between(-0.35, 0.35), 2))]
    tables["impact"] = {
        "pulse": dice.one_of(("half-sine", "half-sine", "rectangle")), "force": newton(force),
        "duration": f"{nice(1e3 * dice.between(0.1, 0.8) / frequency):g} ms", "point": point if dice.chance(0.6) else [0, 0],
    }  # fmt: skip
    vibration: Tables = {
        "duration": f"{nice(dice.between(5.0, 25.0) / frequency):g} s", "modes": dice.one_of((10, 20, 20, 40, 60)),
    }  # fmt: skip
    model = dice.one_of(("auto", "auto", "reduced", "full"))
    if model != "auto":
        vibration["model"] = model
    if dice.chance(0.5):
        vibration["probes"] = {"edge": [mm(0.45 * length), 0]}
    return Drawn(tables | {"vibration": vibration}, {})


def _mesh(dice: Dice, length: float, width: float) -> list[int]:
    along = dice.one_of((8, 10, 12, 12, 16))
    return [along, max(6, round(along * width / length))]


def _strained(dice: Dice, strain: float, poisson: float) -> Tables:
    """Film with displaced edges, with any film model."""
    film = dice.one_of(("plain", "plain", "tension-field", "wrinkles"))
    along = digits(strain)
    tension: Tables = {"strain": along if dice.chance(0.5) else [along, digits(along * dice.between(0.3, 1.0), 2)]}
    return {"tension": tension | ({} if film == "plain" else {"film": film})}


def _pulled(dice: Dice, stress: float, width: float, length: float, thickness: float) -> Tables:
    """Film with pulled corners, mostly by cables."""
    pull = digits(stress * thickness * width, 2)
    tables: Tables = {"tension": {"pull": newton(pull), "film": dice.one_of(("tension-field",) * 4 + ("wrinkles",))}}
    young, density = dice.one_of(CABLES)
    diameter = max(1e-4, math.sqrt(4.0 * pull / (math.pi * 300e6))) * dice.decades(1.0, 4.0)
    cable: Tables = {"diameter": mm(diameter, 2), "young": gpa(young), "density": f"{density:g} kg/m^3"}
    cables = []
    if dice.chance(0.7):
        cables.append({"place": "corners", "length": mm(nice(length * dice.between(0.05, 0.4)))} | cable)
    if dice.chance(0.25):
        cables.append({"place": "edges"} | cable)
    return tables | ({"cable": cables} if cables else {})


def _patch(dice: Dice, length: float, width: float, thickness: float, element: float) -> Tables:
    """Stiff square that is thicker than the film, well inside it, and at least a third of an element wide."""
    young, density, poisson = dice.one_of(PATCHES)
    patch: Tables = {
        "place": dice.one_of(("centre", "diagonal", "position")),
        "size": mm(nice(max(width * dice.between(0.06, 0.25), 0.35 * element))),
        "thickness": um(nice(thickness * dice.decades(1.0, 30.0))),
        "young": gpa(young),
        "poisson": poisson,
        "density": f"{density:g} kg/m^3",
    }
    if patch["place"] == "diagonal":
        patch["distance"] = mm(nice(width * dice.between(0.18, 0.3)))
    if patch["place"] == "position":
        patch["position"] = [mm(length * round(dice.between(-0.3, 0.3), 2)), mm(width * round(dice.between(-0.3, 0.3), 2))]
    return patch
