"""Random chains of bodies on springs, free or held, and plates that fall on each other, as scenes written out."""

from __future__ import annotations

import math

from validation.stress.dice import Dice, Tables, laws_of_contact, solve_section

__all__ = ["draw_chain", "draw_stack"]


def draw_chain(dice: Dice) -> Tables:
    """2 to 60 bodies, masses over four and stiffness over ten decades, speeds over eight; large rotations."""
    planar, free = dice.chance(0.5), dice.chance(0.5)
    count = dice.count(2, 60)
    size, mass, period = dice.decades(1e-4, 1.0), dice.decades(1e-6, 1e2), dice.decades(1e-5, 1.0)
    stiffness = mass / period**2
    speed = size / period * dice.decades(1e-7, 10.0)
    bodies = [_body(dice, i, size, mass * dice.decades(1e-2, 1e2), speed, planar) for i in range(count)]
    if not free:
        bodies[0] |= {"held": True, "velocity": [0.0] * 3, "angular_velocity": [0.0] * 3}
    ratio = dice.one_of((1.0, 30.0, 1e5))
    end_time = period * dice.decades(0.03, 10.0) / (1.0 if dice.chance(0.3) else math.sqrt(ratio))
    tables: Tables = {
        "scene": {"bodies": bodies, "elements": [
            _joint(dice, bodies[i]["name"], bodies[i + 1]["name"], size, stiffness, period, ratio, planar)
            for i in range(count - 1)
        ]},
        "save": {"interval": end_time / dice.count(5, 40)},
    }  # fmt: skip
    if not free:
        tables["gravity"] = [0.0, 0.0, -size / period**2 * dice.decades(1e-4, 1.0)]
        if dice.chance(0.4):
            force = stiffness * size * dice.decades(1e-4, 1.0)
            tables["load"] = [_load(dice, bodies[-1]["name"], force, size, end_time, planar)]
    tables["solve"] = solve_section(dice, static=False, end_time=end_time)
    if planar and dice.chance(0.1) and not any("frame" in joint for joint in tables["scene"]["elements"]):
        tables["solve"]["spatial"] = True
    return tables


def _body(dice: Dice, i: int, size: float, mass: float, speed: float, planar: bool) -> Tables:
    """A body on an irregular line, with or without a plate, in any orientation."""
    flat = [1.0, 0.0, 1.0] if planar else [1.0, 1.0, 1.0]
    thin = dice.decades(1e-4, 0.5)
    inertia = [mass * size**2 * (a**2 + b**2) / 12.0 for a, b in ((1.0, thin), (1.0, thin), (1.0, 1.0))]
    body: Tables = {
        "name": f"b{i}", "mass": mass, "inertia": inertia, "orientation": dice.turn(planar),
        "position": [size * (x + f * dice.between(-0.3, 0.3)) for x, f in zip((1.5 * i, 0.0, 0.0), flat, strict=True)],
        "velocity": [x * f for x, f in zip(dice.vector(speed), flat, strict=True)],
        "angular_velocity": [x * (1.0 - f if planar else 1.0) for x, f in zip(dice.vector(speed / size), flat, strict=True)],
    }  # fmt: skip
    if dice.chance(0.7):
        body["plate"] = {"length": size, "width": size, "thickness": size * thin}
    return body


def _joint(
    dice: Dice, inner: str, outer: str, size: float, stiffness: float, period: float, ratio: float, planar: bool
) -> Tables:
    """Springs and dampers whose ends do not coincide, so the chain starts under load."""
    damping = 0.0 if dice.chance(0.4) else period * dice.decades(1e-6, 1.0)
    along = [stiffness * dice.decades(1.0 / ratio, ratio) for _ in range(3)]
    about = [size**2 * stiffness * dice.decades(1.0 / ratio, ratio) for _ in range(3)]
    arm = [size / 2, 0.0, 0.0] if planar else dice.vector(size / 2)
    joint: Tables = {
        "name": f"{inner} to {outer}", "inner": inner, "outer": outer,
        "point_inner": arm, "point_outer": [-x for x in arm],
        "translation": along, "translation_damping": [damping * k for k in along],
        "rotation": about, "rotation_damping": [damping * k for k in about],
    }  # fmt: skip
    if planar and dice.chance(0.2):
        joint["frame"] = "chord"
        joint["point_inner"], joint["point_outer"] = [size / 3, 0.0, 0.0], [-size / 3, 0.0, 0.0]
    elif dice.chance(0.2):
        joint["rest_angle"] = dice.between(-math.pi, math.pi)
    return joint


def _load(dice: Dice, body: str, force: float, size: float, end_time: float, planar: bool) -> Tables:
    pull = dice.vector(force)
    if planar:
        pull[1] = 0.0
    times: list[Tables] = [
        {"kind": "constant"},
        {"kind": "ramp", "end": end_time * dice.decades(1e-2, 2.0)},
        {"kind": "table", "time": [0.0, end_time / 3, end_time / 2], "value": [0.0, 1.0, -1.0]},
    ]
    follower = dice.chance(0.4)
    return {"body": body, "force": pull, "point": [size / 2, 0.0, 0.0], "follower": follower, "time": dice.one_of(times)}


def draw_stack(dice: Dice) -> Tables:
    """Plates that fall on a table and on each other, or that collide in free flight."""
    planar, floating = dice.chance(0.5), dice.chance(0.3)
    count = dice.count(2, 8)
    size = dice.decades(1e-3, 0.3)
    thickness = max(size * dice.decades(3e-3, 0.2), 1e-6)
    mass = dice.decades(10.0, 1e4) * size**2 * thickness
    speed = dice.decades(1e-4, 10.0)
    weight = 9.81 if not floating else mass
    bodies, pairs = [], []
    for i in range(count):
        body = _body(dice, i, size, mass, speed if floating else 0.1 * speed, planar)
        tilt = 0.0 if dice.chance(0.3) else dice.between(-0.4, 0.4)
        # without gravity, every plate moves towards its neighbour: the lower ones upwards, the upper ones downwards
        velocity = [0.0, 0.0, speed * (1.0 - 2.0 * i / max(1, count - 1))] if floating else body["velocity"]
        lift = 0.7 * size + i * (thickness + size * abs(math.sin(0.4)) * dice.between(1.0, 1.4))
        body |= {
            "plate": {"length": size, "width": size, "thickness": thickness},
            "inertia": [mass * size**2 / 12, mass * size**2 / 12, mass * size**2 / 6.1],
            "position": [size * dice.between(-0.3, 0.3), 0.0 if planar else size * dice.between(-0.3, 0.3), lift],
            "orientation": [math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0],
            "velocity": velocity,
        }
        if dice.chance(0.5):
            body["angular_velocity"] = [0.0, 0.0, 0.0]
        bodies.append(body)
        pairs += [{"first": f"b{j}", "second": f"b{i}"} for j in range(i)]
    fall = math.sqrt(2.0 * size / 9.81)
    end_time = (2.0 * size / speed if floating else fall) * dice.decades(0.3, 3.0)
    tables: Tables = {"scene": {"bodies": bodies, "pairs": pairs}, "save": {"interval": end_time / dice.count(10, 40)}}
    if not floating:
        tables["gravity"] = [0.0, 0.0, -weight]
        tables["obstacle"] = [_obstacle(dice, size, count)]
        pairs += [{"first": f"b{i}", "second": "table"} for i in range(count)]
    hit = max(speed, 0.0 if floating else math.sqrt(9.81 * size))
    depth = thickness * dice.decades(1e-4, 0.1)  # penetration of a plate at that speed
    tables |= laws_of_contact(dice, 1.25 * mass * hit**2 / depth**2.5, depth, hit)
    tables["solve"] = solve_section(dice, static=False, end_time=end_time)
    return tables


def _obstacle(dice: Dice, size: float, count: int) -> Tables:
    """A table, or a round obstacle, below all plates."""
    kind = dice.one_of(("plane", "box", "cylinder", "sphere"), (5, 2, 1, 1))
    if kind == "plane":
        return {"name": "table", "shape": "plane"}
    if kind == "box":
        return {"name": "table", "shape": "box", "size": [4 * size, 4 * size, size], "position": [0.0, 0.0, -size / 2]}
    radius = size * dice.decades(0.5, 5.0)
    round_one: Tables = {"name": "table", "shape": kind, "radius": radius, "position": [0.0, 0.0, -radius]}
    return round_one | ({"length": 4 * size} if kind == "cylinder" else {})
