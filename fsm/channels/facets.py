"""Sheets: displacements of probes of flexible facets, pressures and the volumes that they sweep."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fsm.analyses.facet_results import mesh_point
from fsm.case.models.facet_mesh import MeshPoint
from fsm.case.models.loads import Load
from fsm.case.plan.step_items import loads_of
from fsm.channels.offer import Model, Offer, State, offers
from fsm.model.joined.system import JoinedSystem, pressure_of
from fsm.model.nodes.facets.pressure import PressureGroup
from fsm.results.channel import AXES


@offers
def facet_probes(model: Model) -> Iterator[Offer]:
    """point.<probe>.displacement of the probes of flexible facets."""
    facets = None if model.scene is None else model.scene.built.facets
    for name, point in () if facets is None else facets.probes.items():
        yield Offer(f"point.{name}.displacement", "m", "displacement from the start", _displacement(point), (AXES,))


@offers
def pressures(model: Model) -> Iterator[Offer]:
    """load.<name>.pressure and .volume of pressures on flexible facets and on sheets of bars."""
    system = model.system
    if not isinstance(system, JoinedSystem) or system.faces is None:
        return
    for _, load in loads_of(model.case):
        if load.pressure is not None:
            whole = pressure_of(load, system.faces)
            yield Offer(f"load.{load.called}.pressure", "Pa", "pressure, positive along the normals", _pressure(load))
            text = "volume that the loaded facets have swept along their normals since the start"
            yield Offer(f"load.{load.called}.volume", "m^3", text, _volume(whole))


def _pressure(load: Load) -> Callable[[State], float]:
    return lambda state: sum(one.size(state.time) for one in state.system.pressures if one.load == load.called)


def _volume(pressure: PressureGroup) -> Callable[[State], float]:
    def at(state: State) -> float:
        elements = state.system.elements
        states = (q[len(q) - elements.nq :] for q in (state.system.initial()[0], state.q))
        return pressure.swept(*(elements.place(state.time, q, None)[0] for q in states))

    return at


def _displacement(point: MeshPoint) -> Callable[[State], np.ndarray]:
    def at(state: State) -> np.ndarray:
        start, _ = state.system.initial()
        return mesh_point(state.system, point, state.q) - mesh_point(state.system, point, start)

    return at
