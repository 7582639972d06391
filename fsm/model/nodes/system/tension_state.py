"""Summary of the state of tension of the films of a system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.model.nodes.films.film import FilmStress, MembraneGroup
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.nodes.tension_field import SLACK, TAUT, WRINKLED


@dataclass(frozen=True)
class TensionState:
    """Tension of a film.

    Attributes
    ----------
    largest, smallest : Pa
        Principal stress.
    taut, wrinkled, slack : fractions of the area, by the mixed criterion of stress and strain
    """

    largest: float
    smallest: float
    taut: float
    wrinkled: float
    slack: float


def film_stresses(system: AncfSystem, t: float, q: np.ndarray) -> dict[str, FilmStress]:
    """Stresses of every group of membrane elements by name; if two groups have the same name, the stresses of the last
    group.
    """
    here, _ = system.place(t, q, None)
    return {group.name: group.stress(here) for group in system.mesh.groups if isinstance(group, MembraneGroup)}


def tension_state(system: AncfSystem, t: float, q: np.ndarray) -> TensionState:
    """State of tension of the film; stiff patches have other names."""
    stress = film_stresses(system, t, q)["film"]
    total = float(stress.area.sum())
    taut, wrinkled, slack = (
        float(stress.area[stress.state == state].sum()) / total for state in (TAUT, WRINKLED, SLACK)
    )
    largest, smallest = float(stress.principal.max()), float(stress.principal.min())
    return TensionState(largest, smallest, taut, wrinkled, slack)
