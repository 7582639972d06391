"""Films, cables and scissor arrays: supports of nodes, stress resultants, tensions, points, bars and hinges."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from fsm.case.derived.scissor import array_at
from fsm.channels.offer import Model, Offer, State, offers
from fsm.model.nodes.beams.hinge import HingeGroup
from fsm.model.nodes.cable import CableGroup
from fsm.model.nodes.films.film import MembraneGroup
from fsm.model.nodes.system.scissor_system import ScissorSystem
from fsm.results.channel import AXES, Dim

_PRINCIPAL = Dim("principal_axis", ("larger", "smaller"), "1", "principal stress resultant")


@offers
def films(model: Model) -> Iterator[Offer]:
    """film.resultant, film.strain and cable.tension over the elements, and support.nodes.force."""
    mesh = _mesh(model)
    if isinstance(model.system, ScissorSystem):
        return
    if mesh is None:
        if model.system is None:  # this is the film of a deployed strip, whose mesh is not known yet
            for name, unit in (("film.resultant", "N/m"), ("film.strain", "1"), ("support.nodes.force", "N")):
                yield Offer(name, unit, "of the film of the deployed strip", _unknown)
        return
    films = [k for k, group in enumerate(mesh.groups) if isinstance(group, MembraneGroup)]
    if films:
        element = Dim("film_element", _numbers(mesh, films), "1", "film element")
        text = "principal stress resultants of the film (Cauchy), mean over the element"
        yield Offer("film.resultant", "N/m", text, _over(films, _resultant), (element, _PRINCIPAL))
        strains = Dim("strain_component", ("xx", "yy", "xy"), "1", "component of Green's strain in material axes")
        yield Offer("film.strain", "1", "Green's strain, mean over the element", _over(films, _strain), (element, strains))
    cables = [k for k, group in enumerate(mesh.groups) if isinstance(group, CableGroup)]
    if cables:
        element = Dim("cable_element", _numbers(mesh, cables), "1", "cable element")
        yield Offer("cable.tension", "N", "axial force at the middle of the element", _over(cables, _tension), (element,))
    if model.system is None or np.any(_elements_of(model.system).fixed):
        text = "sum of the reactions of all held nodes of films and cables"
        yield Offer("support.nodes.force", "N", text, _support, (AXES,))


@offers
def probes(model: Model) -> Iterator[Offer]:
    """point.<probe>.displacement of the probes of a film: along it, across it, and normal to it."""
    if model.film is None and model.system is not None:
        return
    points = getattr(model.analysis, "points", None)
    if points is None:
        points = ["center", *(model.case.vibration.probes if model.case.vibration else ())]
    local = Dim("film_axis", ("along", "across", "normal"), "1", "axis of the film at the probe")
    for k, name in enumerate(points):
        yield Offer(f"point.{name}.displacement", "m", "displacement from rest", _probe(model, k), (local,))


@offers
def arrays(model: Model) -> Iterator[Offer]:
    """point.<name>.position and .velocity, bar.<name>.stress, hinge.<name>.angle, support.<point>.force of an array."""
    system = model.system
    if not isinstance(system, ScissorSystem):
        return
    plane = Dim("plane_axis", ("x", "y"), "1", "axis of the plane of the array")
    for name, first in sorted(system.points.items()):
        yield Offer(f"point.{name}.position", "m", "position of the point", _coordinates("q", first), (plane,))
        yield Offer(f"point.{name}.velocity", "m/s", "velocity of the point", _coordinates("u", first), (plane,))
        if system.fixed[first : first + 2].any():
            text = "reaction of the supports of the point"
            yield Offer(f"support.{name}.force", "N", text, _point_support(first), (plane,))
    assert model.case.scissor is not None
    for k, bar in enumerate(array_at(model.case.scissor, model.case.scissor.initial_angle).bars):
        yield Offer(f"bar.{bar.name}.stress", "Pa", "largest normal stress of the bar", _bar(k))
    for group in system.mesh.groups:
        if isinstance(group, HingeGroup):
            for k in range(len(group.vectors)):
                text = "rotation of the hinge since the start, positive in deployment"
                yield Offer(f"hinge.{k + 1}.angle", "rad", text, _turn(group, k))


def _unknown(state: State) -> float:
    raise AssertionError("the names of channels are known, but not the film")


def _mesh(model: Model) -> Any:
    if model.system is None:
        return None if model.film is None else model.film.mesh
    return getattr(_elements_of(model.system), "mesh", None)


def _elements_of(system: Any) -> Any:
    """System of the ANCF elements of a system; the system itself without rigid bodies."""
    return getattr(system, "elements", system)


def _numbers(mesh: Any, groups: list[int]) -> tuple[float, ...]:
    return tuple(float(k + 1) for k in range(sum(len(mesh.groups[g].vectors) for g in groups)))


def _nodes(state: State) -> np.ndarray:
    """Coordinates of the ANCF nodes, with moved coordinates at their present values."""
    system = state.system
    elements = _elements_of(system)
    return np.asarray(elements.place(state.time, state.q[len(state.q) - elements.nq :], None)[0])


def _over(groups: list[int], value: Callable[[Any, np.ndarray], np.ndarray]) -> Callable[[State], np.ndarray]:
    def at(state: State) -> np.ndarray:
        mesh = _elements_of(state.system).mesh
        return np.concatenate([value(mesh.groups[k], state.once(_nodes)) for k in groups])

    return at


def _resultant(group: MembraneGroup, q: np.ndarray) -> np.ndarray:
    return np.asarray(group.stress(q).principal.mean(axis=1) * group.material.thickness)


def _strain(group: MembraneGroup, q: np.ndarray) -> np.ndarray:
    return np.asarray(group.strains(q).mean(axis=1))


def _tension(group: CableGroup, q: np.ndarray) -> np.ndarray:
    return group.tension(q)


def _reactions(state: State) -> np.ndarray:
    """Reactions of all coordinates of ANCF nodes, flat."""
    system = state.system
    if hasattr(system, "node_reactions"):
        return np.asarray(system.node_reactions(state.time, state.q, state.u, state.before))
    here, rates = system.place(state.time, state.q, state.u, state.before)
    force = system.all_forces(state.time, here, rates)
    return np.asarray(system.held_forces(force) if state.before is None else np.where(system.fixed, -force, 0.0))


def _support(state: State) -> np.ndarray:
    mesh = _elements_of(state.system).mesh
    return np.asarray(mesh.positions(state.once(_reactions)).sum(axis=0))


def _point_support(first: int) -> Callable[[State], np.ndarray]:
    return lambda state: state.once(_reactions)[first : first + 2]


def _coordinates(which: str, first: int) -> Callable[[State], np.ndarray]:
    return lambda state: getattr(state.saved, which)[first : first + 2]


def _stresses(state: State) -> np.ndarray:
    return np.asarray(state.system.stress(state.q))


def _bar(k: int) -> Callable[[State], float]:
    return lambda state: float(state.once(_stresses)[k])


def _turn(group: HingeGroup, k: int) -> Callable[[State], float]:
    return lambda state: float(group.turns(state.q)[k])


def _probe(model: Model, k: int) -> Callable[[State], np.ndarray]:
    return lambda state: model.analysis.probes(state.q)[k]
