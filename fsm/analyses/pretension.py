"""The tensioned film: the equilibrium under its pull or with its edges drawn apart, after which all supports are held."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsm.analyses.film import CORNERS, FilmMesh
from fsm.ancf.film import FilmStress, MembraneGroup
from fsm.ancf.loading import Forcing, Loading
from fsm.ancf.pulse import Constant
from fsm.ancf.system import AncfSystem
from fsm.ancf.tension_field import SLACK
from fsm.errors import CaseError, Fault, NotConverged
from fsm.scene.case import Case
from fsm.scene.membrane import CornerCable, Support
from fsm.solve.newton import equilibrium

__all__ = ["Tensioned", "film_stress", "supports", "tensioned"]

_SLACKEST = 0.5
"""Part of the film that may be slack."""


@dataclass(frozen=True, eq=False)
class Tensioned:
    """The film stretched and held.

    Attributes
    ----------
    q : (nq,) array
    held : (k,) int array
        Coordinates of all supports.
    stress : of the film itself, without its patches
    """

    q: np.ndarray
    held: np.ndarray
    stress: FilmStress

    @property
    def slack(self) -> float:
        """Part of the film's area that carries no tension."""
        area = self.stress.area
        return float(np.sum(area[self.stress.state == SLACK]) / np.sum(area))


def supports(case: Case) -> tuple[Support, ...]:
    """What is held: as the case says, or what is drawn at."""
    if case.support:
        return case.support
    if any(isinstance(cable, CornerCable) for cable in case.cable):
        return (Support(at="cables"),)
    assert case.tension is not None
    return (Support(at="corners" if case.tension.pull is not None else "edges"),)


def tensioned(case: Case, film: FilmMesh, source: str) -> Tensioned:
    """Stretch the film of a case.

    Raises
    ------
    CaseError
        It comes out slack.
    NotConverged
    """
    tension = case.tension
    assert tension is not None
    held = np.unique(np.concatenate([film.held_by(support) for support in supports(case)]))
    if tension.pull is not None:
        system = _pulled(case, film, held, tension.pull)
    else:
        assert tension.strain is not None
        strain = tension.strain if isinstance(tension.strain, tuple) else (tension.strain, tension.strain)
        start = _stretched(film, strain)
        system = AncfSystem(film.mesh.holding(held), Loading(gravity=case.gravity), start)
    try:
        q = equilibrium(system, system.start, np.array([0.0]))
    except NotConverged as error:
        raise NotConverged(f"tension of the film: {error}") from None
    state = Tensioned(q, held, film_stress(film, q)[0])
    if state.slack > _SLACKEST or not state.stress.principal.max() > 0.0:
        text = f"the film is slack: {100 * state.slack:.0f} % of it carries no tension; pull harder"
        raise CaseError([Fault("tension", text)], source)
    return state


def film_stress(film: FilmMesh, q: np.ndarray) -> tuple[FilmStress, list[tuple[np.ndarray, FilmStress]]]:
    """Stresses of the film itself; and of all groups with the numbers of their elements, in the order of what is drawn."""
    kinds = film.cells.ravel()
    groups = [group for group in film.mesh.groups if isinstance(group, MembraneGroup)]
    numbers = [np.flatnonzero(kinds == kind) for kind in np.unique(kinds)]
    parts = [(where, group.stress(q)) for where, group in zip(numbers, groups, strict=True)]
    return parts[0][1], parts


def _pulled(case: Case, film: FilmMesh, held: np.ndarray, pull: float) -> AncfSystem:
    """The film under its pull: the ends are free to go outwards, one of them bears what the others draw.

    It starts stretched by about what will come, since a slack film has no stiffness across itself.
    """
    ends = film.ends
    drawn = np.concatenate([ends, ends + 1, ends + 2])
    others = np.setdiff1d(held, drawn)
    anchor = ends[0] + np.arange(3)  # its reaction is its own pull, by equilibrium
    material, membrane = case.material, case.membrane
    assert material is not None and membrane is not None
    resultant = pull * math.sqrt(2.0) / math.sqrt(membrane.length * membrane.width)
    strain = resultant * (1.0 - material.poisson) / (material.young * membrane.thickness)
    forces = np.zeros(len(film.mesh.coordinates))
    for end, outward in zip(ends[1:], film.outwards[1:], strict=True):
        forces[end : end + 3] = pull * outward
    mesh = film.mesh.holding(np.concatenate([others, anchor, ends + 2]))
    loading = Loading((Forcing(forces, Constant()),), gravity=case.gravity)
    return AncfSystem(mesh, loading, _stretched(film, (strain, strain)))


def _stretched(film: FilmMesh, strain: tuple[float, float]) -> np.ndarray:
    """The film drawn out evenly, its Green strain a bit above what is said; cables go along with their corners."""
    factor = np.array([1.0 + strain[0], 1.0 + strain[1], 1.0])
    nodes = film.mesh.coordinates.reshape(-1, 9).copy()
    of_film = np.zeros(len(nodes), dtype=bool)
    of_film[film.grid.position.ravel() // 9] = True
    nodes[of_film] *= np.tile(factor, 3)
    half = np.array([film.grid.x[-1], film.grid.y[-1], 0.0])
    for signs in CORNERS:
        side = np.array([*signs, 0.0])
        here = ~of_film & np.all(nodes[:, :2] * side[:2] > 0.0, axis=1)
        nodes[here, :3] += (factor - 1.0) * half * side
    return nodes.ravel()
