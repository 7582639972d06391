"""Faults of the surfaces, groups, obstacles and contact pairs of a scene.

Checks of the supply of gas over the time of a run. `fsm check` and `fsm run` use the same checks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from fsm.case.derived.contact_points import ContactSide, contact_sides, sheet_parts, sheet_spacing
from fsm.case.derived.frame_bodies import norm_faults
from fsm.case.models.case import Case
from fsm.case.models.flexible_facets import SHEET
from fsm.case.models.scene import GROUND, Body, ContactPair, Scene
from fsm.case.models.touching import MOST_POINTS
from fsm.case.schema.known_names import nearest_name
from fsm.errors import Fault
from fsm.model.bodies.drive import time_function
from fsm.model.plan.planned import Plan
from fsm.text.shown_units import shown


def contact_faults(scene: Scene) -> Iterator[Fault]:
    """All faults of contact and friction."""
    yield from _surfaces(scene)
    yield from _groups(scene)
    yield from _obstacles(scene)
    known, bodies = contact_sides(scene), {body.name for body in scene.bodies}
    shapes = {obstacle.name: obstacle.shape for obstacle in scene.obstacles}
    given = set[frozenset[str]]()
    for i, pair in enumerate(scene.pairs):
        yield from _pair(pair, known, bodies, shapes, f"scene.pairs.{i}")
        names = frozenset((pair.first, pair.second))
        if names in given:
            text = f"{pair.first!r} and {pair.second!r} are a pair already{_automatic(scene, names)}; remove this pair"
            yield Fault("scene.pairs", text)
        given.add(names)
    if scene.built.touching is not None and scene.contact is not None:
        yield from _sheet_points(scene)
    if scene.friction is not None and scene.contact is None:
        yield Fault("friction", "friction needs a [contact] section; add [contact], or remove [friction]")


def _automatic(scene: Scene, names: frozenset[str]) -> str:
    """Reason why a pair exists that the case does not contain: the pairs of a sheet."""
    others = {SHEET, *(obstacle.name for obstacle in scene.obstacles)}
    if SHEET in names and names <= others:
        return ", because a sheet has contact with itself and with every obstacle of the case"
    return ""


def _sheet_points(scene: Scene) -> Iterator[Fault]:
    """Fault of a body or an obstacle that could pass between the contact points of the sheet."""
    assert scene.built.touching is not None
    apart, passing = scene.built.touching.longest_edge / sheet_parts(scene), sheet_spacing(scene)[1]
    if apart > passing:
        yield Fault(
            "contact",
            f"the sheet touches bodies and obstacles at points, at most {MOST_POINTS:,}; they are {shown(apart, 'm')} "
            f"apart, and the smallest body or obstacle could pass between points {shown(passing, 'm')} apart; enlarge it, "
            "or use a smaller sheet",
        )


def _surfaces(scene: Scene) -> Iterator[Fault]:
    bodies = {body.name: body for body in scene.bodies}
    for i, surface in enumerate(scene.surfaces):
        yield from _members(surface.bodies, bodies, f"scene.surfaces.{i}.bodies")


def _members(names: tuple[str, ...], bodies: dict[str, Body], path: str) -> Iterator[Fault]:
    if not names:
        yield Fault(path, "the list is empty; give at least one body")
    for name in names:
        if name not in bodies:
            yield Fault(path, f"no body is called {name!r}{nearest_name(name, list(bodies))}")
        elif bodies[name].plate is None:
            yield Fault(path, f"body {name!r} has no plate, so it has no face to touch")


def _names(path: str, names: list[str], taken: set[str], what: str) -> Iterator[Fault]:
    """Faults of names that are already used, by `what`, or that occur more than once."""
    counts = Counter(names)
    for i, name in enumerate(names):
        if name in taken:
            yield Fault(f"{path}.{i}.name", f"{name!r} is {what} already; choose another name")
        if counts[name] > 1:
            yield Fault(f"{path}.{i}.name", f"{name!r} is used {counts[name]} times; names must differ")


def _groups(scene: Scene) -> Iterator[Fault]:
    bodies = {body.name: body for body in scene.bodies}
    taken = {GROUND, *bodies, *(surface.name for surface in scene.surfaces), *(o.name for o in scene.obstacles)}
    yield from _names("scene.groups", [group.name for group in scene.groups], taken, "the name of something else")
    for i, group in enumerate(scene.groups):
        path = f"scene.groups.{i}"
        yield from _members(group.bodies, bodies, f"{path}.bodies")
        for name, number in Counter(group.bodies).items():
            if number > 1:
                yield Fault(f"{path}.bodies", f"body {name!r} is listed {number} times; list it once")


def _obstacles(scene: Scene) -> Iterator[Fault]:
    bodies = [GROUND, *(body.name for body in scene.bodies)]
    taken = {*bodies, *(surface.name for surface in scene.surfaces)}
    yield from _names("scene.obstacles", [obstacle.name for obstacle in scene.obstacles], taken, "a body or a surface")
    for i, obstacle in enumerate(scene.obstacles):
        path = f"scene.obstacles.{i}"
        if obstacle.body is not None and obstacle.body not in bodies:
            yield Fault(f"{path}.body", f"no body is called {obstacle.body!r}{nearest_name(obstacle.body, bodies)}")
        yield from norm_faults(f"{path}.orientation", obstacle.orientation)


def _solids(pair: ContactPair, shapes: Mapping[str, str], path: str) -> Iterator[Fault]:
    """Faults of a pair of obstacles: one of them must be a sphere, exactly one must be a plane, or both must be boxes."""
    kinds = sorted((shapes[pair.first], shapes[pair.second]))
    if "sphere" in kinds or kinds.count("plane") == 1 or kinds == ["box", "box"]:
        return
    remedy = "give one of them a plate, or make it a sphere"
    if kinds == ["cylinder", "cylinder"]:
        remedy = 'give their bodies as sides, with geometry = "cylinder-on-cylinder"'
    text = f"a {shapes[pair.first]} and a {shapes[pair.second]} do not touch each other; {remedy}"
    yield Fault(path, f"obstacles {pair.first!r} and {pair.second!r}: {text}")


def _pair(
    pair: ContactPair, known: dict[str, ContactSide], bodies: set[str], shapes: Mapping[str, str], path: str
) -> Iterator[Fault]:
    found: list[ContactSide] = []
    for end in ("first", "second"):
        name = getattr(pair, end)
        if pair.geometry is not None:
            if name not in bodies and name != GROUND:
                text = f"no body is called {name!r}{nearest_name(name, [GROUND, *sorted(bodies)])}"
                yield Fault(f"{path}.{end}", f"{text}; a pair with a geometry of its own joins bodies")
        elif name in known and known[name].kind != "body":
            found.append(known[name])
        elif name in bodies:
            yield Fault(f"{path}.{end}", f"body {name!r} has no plate, so it has no face to touch")
        else:
            names = [name for name, side in known.items() if side.kind != "body"]
            text = f"no body, surface or obstacle is called {name!r}{nearest_name(name, names)}"
            yield Fault(f"{path}.{end}", text)
    if pair.geometry is not None:
        if pair.first == pair.second:
            yield Fault(path, f"both sides are {pair.first!r}; a body does not touch itself")
        if pair.shared != "none":
            yield Fault(f"{path}.shared", "only two surfaces share a crease or a chain; remove this key")
    if len(found) < 2:
        return
    kinds = [party.kind for party in found]
    if pair.first == pair.second == SHEET:
        return
    if kinds == ["film", "film"]:
        text = "films, cables and beams do not touch each other; the other side must have a plate or be an obstacle"
        yield Fault(path, f"{pair.first!r} and {pair.second!r}: {text}")
    if kinds == ["obstacle", "obstacle"]:
        yield from _solids(pair, shapes, path)
    if pair.first == pair.second and kinds[0] == "group":
        return
    for name in sorted(set(found[0].bodies) & set(found[1].bodies)):
        if name == GROUND:
            yield Fault(path, f"{pair.first!r} and {pair.second!r} are both fixed to the ground: they cannot touch")
            continue
        yield Fault(path, f"{pair.first!r} and {pair.second!r} are both part of body {name!r}: they cannot touch")
    if pair.shared != "none" and kinds != ["surface", "surface"]:
        yield Fault(f"{path}.shared", "only two surfaces share a crease or a chain; remove this key")


_TIMES = 1001
"""Number of times at which the mass of a gas is computed, besides the points of its function of time."""
_NO_GAS = 1e-9
"""Round-off of this mass, relative to its maximum."""


def gas_faults(case: Case, scene: Scene, plan: Plan | None) -> Iterator[Fault]:
    """Faults of supplies that take out more gas than their chambers have.

    Chambers with orifices, and paths by arc length, are not checked: there the mass depends on the solution.
    """
    methods = {case.solve.method} if plan is None else {step.method for step in plan.steps}
    end = case.solve.end_time if plan is None else plan.steps[-1].end
    if scene.built.orifices or "arc-length" in methods or end is None:
        return
    for number, chamber in enumerate(scene.built.chambers):
        gas = chamber.gas
        key, size, program = "supply_mass", gas.supply_mass, time_function(gas.time)
        if gas.supply_flow is not None:
            key, size, program = "supply_flow", gas.supply_flow, program.integral()
        if size is None:
            continue
        first = gas.at_start * chamber.volume / (gas.gas_constant * gas.temperature)
        times = np.union1d(np.linspace(0.0, end, _TIMES), [t for t in program.breaks() if 0.0 < t < end])
        mass = first + size * np.array([program.at(t)[0] for t in times.tolist()])
        below = np.flatnonzero(mass < -_NO_GAS * np.abs(mass).max())
        if len(below):
            text = f"the chamber has {shown(first, 'kg')} at the start, and is empty before t = {times[below[0]]:.4g} s"
            yield Fault(f"gas.{number}.{key}", f"{text}; take out less gas, or give a larger `pressure` at the start")
