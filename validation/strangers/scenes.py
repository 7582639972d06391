"""Mechanisms and stacks, written as a [scene]."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from validation.strangers.drawn import Drawn
from validation.strangers.typed import digits, mm, nice
from validation.stress.dice import Dice, Tables

__all__ = ["draw_scene"]

G = 9.81
HEAVY = {"gravity": [0, 0, "-9.81 m/s^2"]}
DENSITIES = (600.0, 1200.0, 2700.0, 7850.0)


def draw_scene(dice: Dice) -> Drawn:
    """A mechanism of rods on springs in place of hinges, a row of masses, panels that unfold, or plates that fall.

    The case has a solution: bodies start apart and at moderate speeds; hinges are damped and deflect by less than a
    thousandth of the length of a rod under its weight; loops are closed at the start; and plates fall from at most 0.2 m
    onto an unbounded floor. Every case is an initial value problem over half a second to a few seconds.
    """
    draw = dice.one_of((_pendulum, _pendulum, _four_bar, _row, _ball_joint, _panels, _fall, _fall, _fall, _slide))
    tables, end = draw(dice)
    tables["solve"] = {"end_time": f"{nice(end):g} s"}
    return Drawn(tables, {})


def _rod(dice: Dice, name: str, length: float, density: float, part: float = 0.1) -> Tables:
    """A body whose plate gives its outline."""
    width = digits(length * part, 2)
    thickness = digits(length * part * 0.3, 2)
    return _plate(name, length, width, thickness, density)


def _plate(name: str, length: float, width: float, thickness: float, density: float) -> Tables:
    mass = density * length * width * thickness
    about = (width**2 + thickness**2, length**2 + thickness**2, length**2 + width**2)
    # the moments are rounded so that none exceeds the sum of the others
    inertia = [digits(0.9999 * mass * x / 12.0 if i == 2 else mass * x / 12.0, 5) for i, x in enumerate(about)]
    return {
        "name": name, "mass": f"{digits(1e3 * mass, 5):.12g} g", "inertia": inertia,
        "plate": {"length": mm(length), "width": mm(width), "thickness": mm(thickness)},
    }  # fmt: skip


def _mass(body: Tables) -> float:
    return 1e-3 * float(body["mass"].split()[0])


def _placed(body: Tables, x: float, z: float, angle: float) -> Tables:
    """Orientation of a body in the plane, with its x axis at `angle` above the horizontal."""
    body["position"] = [mm(x, 8), 0, mm(z, 8)]
    if angle:
        body["orientation"] = [math.cos(angle / 2.0), 0, -math.sin(angle / 2.0), 0]
    return body


def _hinge(
    dice: Dice, name: str, inner: str, outer: str, inside: float, outside: float, load: float, length: float
) -> Tables:
    """A hinge about y at points on the x axes of both bodies; it deflects by at most 1e-4 of the length under the load."""
    stiffness = nice(1e4 * load / length * dice.decades(1.0, 10.0))
    damping = nice(2.0 * dice.between(0.02, 0.3) * math.sqrt(stiffness * load / G))
    about = nice(stiffness * length**2 * 0.01)
    joint: Tables = {
        "name": name, "inner": inner, "outer": outer, "point_outer": [mm(outside, 8), 0, 0],
        "translation": [stiffness] * 3, "translation_damping": [damping] * 3, "rotation": [about, 0, about],
    }  # fmt: skip
    if inside:
        joint["point_inner"] = [mm(inside, 8), 0, 0]
    return joint


def _pendulum(dice: Dice) -> tuple[Tables, float]:
    """A chain of one to five rods that hangs down or stands out, and is released."""
    count, length = dice.count(1, 5), 1e-3 * nice(dice.decades(50.0, 1000.0))
    density, angle = dice.one_of(DENSITIES), -math.radians(float(round(dice.between(0.0, 85.0))))
    bodies, elements = [], []
    for i in range(count):
        middle = (i + 0.5) * length
        bodies.append(
            _placed(_rod(dice, f"rod {i + 1}", length, density), middle * math.cos(angle), middle * math.sin(angle), angle)
        )
    load = count * _mass(bodies[0]) * G
    for i in range(count):
        inner = "ground" if i == 0 else f"rod {i}"
        hinge = _hinge(
            dice, f"hinge {i + 1}", inner, f"rod {i + 1}", 0.5 * length if i else 0.0, -0.5 * length, load, length
        )
        # the axes of the ground are along x and those of the rod are rotated with it, so the spring about y has no moment at
        # the start
        if i == 0:
            hinge["rotation"][0] = hinge["rotation"][2]
        if dice.chance(0.5) or count > 2:
            hinge["rotation_damping"] = [0, nice(0.05 * load * length / count * math.sqrt(length / G)), 0]
        if dice.chance(0.3):
            hinge["rotation"] = [hinge["rotation"][0], nice(load * length * dice.decades(0.02, 0.5)), hinge["rotation"][2]]
        elements.append(hinge)
    period = 2.0 * math.pi * math.sqrt(count * length / G)
    return {"scene": {"bodies": bodies, "elements": elements}, **HEAVY}, period * dice.between(0.4, 2.0)


def _four_bar(dice: Dice) -> tuple[Tables, float]:
    """Crank, coupler and rocker between two points of the ground, under gravity or a couple on the crank."""
    crank = 1e-3 * nice(dice.decades(30.0, 200.0))
    coupler, rocker = digits(crank * dice.between(2.0, 3.0)), digits(crank * dice.between(1.8, 2.6))
    base = digits(crank * dice.between(2.0, 2.6))
    turn = math.radians(float(round(dice.between(20.0, 160.0))))
    a, d = np.zeros(2), np.array([base, 0.0])
    b = crank * np.array([math.cos(turn), math.sin(turn)])
    span = float(np.linalg.norm(d - b))
    along = (d - b) / span
    foot = (coupler**2 - rocker**2 + span**2) / (2.0 * span)
    c = b + foot * along + math.sqrt(max(coupler**2 - foot**2, 0.0)) * np.array([-along[1], along[0]])
    density = dice.one_of(DENSITIES)
    bodies = []
    for name, start, end in (("crank", a, b), ("coupler", b, c), ("rocker", d, c)):
        way, middle = end - start, 0.5 * (start + end)
        length = float(np.linalg.norm(way))
        bodies.append(_placed(_plate(name, length, 0.1 * crank, 0.05 * crank, density), *middle, math.atan2(way[1], way[0])))
    load = sum(map(_mass, bodies)) * G
    elements = [
        _hinge(dice, "A", "ground", "crank", 0.0, -0.5 * crank, load, crank),
        _hinge(dice, "B", "crank", "coupler", 0.5 * crank, -0.5 * coupler, load, crank),
        _hinge(dice, "C", "coupler", "rocker", 0.5 * coupler, 0.5 * rocker, load, crank),
        _hinge(dice, "D", "ground", "rocker", 0.0, -0.5 * rocker, load, crank),
    ]
    elements[3]["point_inner"] = [mm(base, 8), 0, 0]
    elements[0]["rotation_damping"] = [0, nice(0.02 * load * crank * math.sqrt(crank / G)), 0]
    tables: Tables = {"scene": {"bodies": bodies, "elements": elements}}
    period = 2.0 * math.pi * math.sqrt(3.0 * crank / G)
    if dice.chance(0.6):
        tables |= HEAVY
    if "gravity" not in tables or dice.chance(0.4):
        moment = nice(0.3 * load * crank)
        tables["load"] = [
            {"body": "crank", "moment": [0, -moment, 0], "time": {"kind": "ramp", "end": f"{nice(0.2 * period):g} s"}}
        ]
    return tables, period * dice.between(0.5, 1.5)


def _row(dice: Dice) -> tuple[Tables, float]:
    """Masses in a row on springs, of which the first is struck or pulled slowly."""
    count, pitch = dice.count(2, 8), 1e-3 * nice(dice.decades(20.0, 200.0))
    mass, frequency = dice.decades(0.01, 10.0), dice.decades(1.0, 50.0)
    stiffness = nice(mass * (2.0 * math.pi * frequency) ** 2)
    damping = nice(2.0 * dice.between(0.005, 0.1) * math.sqrt(stiffness * mass))
    bodies: list[Tables] = []
    elements: list[Tables] = []
    for i in range(count):
        inertia = digits(mass * (0.3 * pitch) ** 2 / 6.0)
        bodies.append({"name": f"m{i + 1}", "mass": nice(mass), "inertia": [inertia] * 3, "position": [mm(i * pitch), 0, 0]})
        if i:
            turn = nice(stiffness * pitch**2 * 0.1)
            elements.append({
                "name": f"s{i}", "inner": f"m{i}", "outer": f"m{i + 1}", "point_inner": [mm(0.5 * pitch), 0, 0],
                "point_outer": [mm(-0.5 * pitch), 0, 0],
                "translation": [stiffness] * 3, "translation_damping": [damping] * 3,
                "rotation": [turn] * 3, "rotation_damping": [nice(turn * damping / stiffness)] * 3,
            })  # fmt: skip
    tables: Tables = {"scene": {"bodies": bodies, "elements": elements}}
    if dice.chance(0.5):
        speed = nice(2.0 * math.pi * frequency * pitch * dice.between(0.01, 0.1))
        bodies[0]["velocity"] = [f"{speed:g} m/s", 0, 0] if dice.chance(0.5) else [0, 0, f"{speed:g} m/s"]
        if dice.chance(0.5):
            bodies[-1] |= {"held": True}
    else:
        if count > 2:  # with two masses, one driven and one held, no mass could move freely
            bodies[-1] |= {"held": True}
        travel = nice(0.1 * pitch)
        speed = nice(travel * frequency * dice.between(0.02, 0.5))
        tables["drive"] = [{"body": "m1", "direction": [-1, 0, 0], "speed": f"{speed:g} m/s", "travel": mm(travel)}]
        return tables, travel / speed
    return tables, dice.between(3.0, 15.0) / frequency


def _ball_joint(dice: Dice) -> tuple[Tables, float]:
    """A rod on a ball joint with an initial sideways velocity, in space."""
    length, density = 1e-3 * nice(dice.decades(50.0, 1000.0)), dice.one_of(DENSITIES)
    rod = _placed(_rod(dice, "rod", length, density), 0.5 * length, 0.0, 0.0)
    load = _mass(rod) * G
    hinge = _hinge(dice, "ball", "ground", "rod", 0.0, -0.5 * length, load, length)
    hinge["rotation"] = [0, 0, 0]
    if dice.chance(0.5):
        hinge["rotation_damping"] = [nice(0.02 * load * length * math.sqrt(length / G))] * 3
    rate = digits(math.sqrt(G / length) * dice.between(0.5, 2.0), 2)
    rod |= {"angular_velocity": [0, 0, f"{rate:g} rad/s"], "velocity": [0, f"{digits(0.5 * length * rate, 8):.12g} m/s", 0]}
    period = 2.0 * math.pi * math.sqrt(length / G)
    return {"scene": {"bodies": [rod], "elements": [hinge]}, **HEAVY}, period * dice.between(0.5, 3.0)


def _panels(dice: Dice) -> tuple[Tables, float]:
    """Panels in a row that fold up from flat by springs and dampers in their hinges."""
    count, length = dice.count(2, 5), 1e-3 * nice(dice.decades(50.0, 1000.0))
    density = dice.one_of(DENSITIES[:3])
    width, thickness = nice(length * dice.between(0.3, 1.0)), nice(length * dice.between(0.005, 0.03))
    bodies = [
        _placed(_plate(f"panel {i}", length, width, thickness, density), (i + 0.5) * length, 0.0, 0.0) for i in range(count)
    ]
    bodies[0]["held"] = True
    mass = _mass(bodies[1])
    time = dice.decades(0.2, 3.0)
    about = nice(mass * count * length**2 * (2.0 / time) ** 2)
    rest = float(round(dice.between(20.0, 80.0)))
    elements = []
    for i in range(1, count):
        hinge = _hinge(
            dice,
            f"hinge {i}",
            f"panel {i - 1}",
            f"panel {i}",
            0.5 * length,
            -0.5 * length,
            mass * max(G, about / mass / length),
            length,
        )
        hinge["rotation"][1] = about
        hinge["rotation_damping"] = [0, nice(0.3 * about * time), 0]
        hinge["rest_angle"] = f"{rest if i % 2 else -rest:g} deg"
        elements.append(hinge)
    return {"scene": {"bodies": bodies, "elements": elements}}, time * dice.between(1.0, 3.0)


def _touching(dice: Dice) -> Tables:
    """[contact] and [friction] of falling bodies."""
    contact: Tables = {"stiffness": dice.one_of(("1e6 N/m^1.5", "1e7 N/m^1.5", "1e8 N/m^1.5"))}
    if dice.chance(0.75):
        contact["restitution"] = round(dice.between(0.2, 0.8), 2)
    else:
        contact |= {"damping": "20 N s/m", "ramp": "10 um"}
    tables: Tables = {"contact": contact}
    if dice.chance(0.8):
        dynamic = round(dice.between(0.1, 0.4), 2)
        law = dice.one_of((
            {"v_static": "1 mm/s", "v_dynamic": "10 mm/s"}, {"law": "lugre", "v_stribeck": "10 mm/s", "presliding": "10 um"},
        ))  # fmt: skip
        tables["friction"] = {"mu_static": round(1.3 * dynamic, 3), "mu_dynamic": dynamic, **law}
    return tables


def _fall(dice: Dice) -> tuple[Tables, float]:
    """One to five plates above each other that fall onto a floor, or onto a box, a cylinder or a sphere on it."""
    count, size = dice.count(1, 5), 1e-3 * nice(dice.decades(20.0, 200.0))
    width, thickness = nice(size * dice.between(0.5, 1.0)), nice(size * dice.between(0.02, 0.2))
    density, planar = dice.one_of(DENSITIES), dice.chance(0.6)
    obstacles: list[Tables] = [{"name": "floor", "shape": "plane"}]
    top = 0.0
    shape = dice.one_of(("", "", "box", "cylinder", "sphere"))
    if shape:
        radius = nice(size * dice.between(0.3, 1.0))
        top = 2.0 * radius
        more: Tables = {"name": shape, "shape": shape, "position": [0, 0, mm(radius)]}
        more |= {"size": [mm(2.0 * radius)] * 3} if shape == "box" else {"radius": mm(radius)}
        obstacles.append(more | ({"length": mm(3.0 * size)} if shape == "cylinder" else {}))
    bodies, names, height = [], [f"plate {i + 1}" for i in range(count)], top
    for name in names:
        tilt = 0.0 if dice.chance(0.3) else math.radians(float(round(dice.between(-25.0, 25.0))))
        room = 0.5 * size * abs(math.sin(tilt)) + 0.5 * thickness
        drop, aside = 1e-3 * nice(dice.decades(1.0, min(100.0, 500.0 * size))), size * dice.between(-0.2, 0.2)
        across, roll = (0.0, 0.0) if planar else (width * dice.between(-0.2, 0.2), math.radians(dice.between(-5.0, 5.0)))
        room += 0.5 * width * abs(math.sin(roll))  # below and above the middle
        height += room + drop
        body = _placed(_plate(name, size, width, thickness, density), aside, height, tilt)
        if not planar:
            body["position"][1] = mm(across)
            turned = _times(
                (math.cos(tilt / 2), 0.0, -math.sin(tilt / 2), 0.0), (math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0)
            )
            body["orientation"] = list(turned)
        bodies.append(body)
        height += room
    pairs = [{"first": names[j], "second": names[i]} for i in range(count) for j in range(i)]
    pairs += [{"first": name, "second": obstacle["name"]} for name in names for obstacle in obstacles]
    tables: Tables = {"scene": {"bodies": bodies, "pairs": pairs}, "obstacle": obstacles, **HEAVY, **_touching(dice)}
    return tables, dice.between(1.5, 4.0) * math.sqrt(2.0 * height / G)


def _times(p: tuple[float, ...], q: tuple[float, ...]) -> tuple[float, ...]:
    """Product of quaternions, scalar first."""
    a, b = np.array(p[1:]), np.array(q[1:])
    vector = p[0] * b + q[0] * a + np.cross(a, b)
    return (p[0] * q[0] - float(a @ b), *map(float, vector))


def _slide(dice: Dice) -> tuple[Tables, float]:
    """A plate that slides on a level floor, or down a slope (the gravity is rotated), until friction stops it, if it
    does."""
    size = 1e-3 * nice(dice.decades(20.0, 200.0))
    thickness = nice(size * dice.between(0.05, 0.2))
    body: Any = _placed(
        _plate("block", size, nice(0.6 * size), thickness, dice.one_of(DENSITIES)), 0.0, 0.5 * thickness + 1e-5, 0.0
    )
    speed = nice(dice.decades(0.1, 1.0))
    body["velocity"] = [f"{speed:g} m/s", 0, 0]
    slope = math.radians(float(round(dice.between(0.0, 20.0))))
    tables: Tables = {
        "scene": {"bodies": [body], "pairs": [{"first": "block", "second": "floor"}]},
        "obstacle": [{"name": "floor", "shape": "plane"}], **_touching(dice),
        "gravity": [f"{G * math.sin(slope):.4g} m/s^2", 0, f"{-G * math.cos(slope):.4g} m/s^2"],
    }  # fmt: skip
    return tables, dice.between(0.3, 1.5)
