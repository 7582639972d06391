"""Tension of a film: pulled system, initial guess of its equilibrium, and supports afterwards.

Pretension of a film: equilibrium under the pull, after which the pulled points are held in place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from fsm.analyses.deployed import DeployedFilm
from fsm.analyses.film import CORNERS, FilmMesh, mean_strain
from fsm.case.models.case import Case
from fsm.case.models.membrane import CornerCable, Support
from fsm.errors import NotConverged
from fsm.kernels.programs import CONSTANT
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.films.wrinkle import corner_wrinkles, lifted
from fsm.model.nodes.loading import Forcing, Loading
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.nodes.tension_field import MOVING, REMAINDER, SETTLING
from fsm.solve.equations.newton import equilibrium
from fsm.solve.equations.relax import Relaxed, relaxed

_PASSES = (
    *((part, 1e-2) for part in SETTLING),
    *((REMAINDER, near) for near in (1e-2, *12 * (1e-3,), 0.0)),
    (MOVING, 0.0),
)
"""Passes of a tension field: remaining stiffness in compression, and largest last step relative to the size of an element.
With 1e-3 in the last pass, a corner-pulled film of 8 x 8 elements keeps compression at its edges. The film's second
frequency is then 1 to 3 % too low. With three passes of 1e-3 in place of twelve, a slack film under .1 N keeps a compression
of 2e-4 of its largest stress. After a single pass with 1e-4 the second frequency of a sail of 12 x 10 elements is 3 % too
low. A pass takes about four iterations. The last pass hardly changes the state at rest. The last pass gives the film the
stiffness `MOVING`, with which the motion is solved."""


def tensioned(
    pulled: AncfSystem,
    ends: np.ndarray,
    loading: Loading | None = None,
    steps: int = 1,
    settle: bool = False,
) -> AncfSystem:
    """System for the vibration: at rest in the tensioned state, with its ends held.

    Parameters
    ----------
    pulled : AncfSystem
        System with the forces or motions of the pull, which reach their final values at 1 s.
    ends : int array
        Coordinates that are held after the pull.
    loading : Loading, optional
        Loading of the vibration.
    steps : int
        Load steps of the pull.
    settle : bool
        Whether to find a stable state by minimising the energy. This is necessary for wrinkles, because the flat state
        is unstable, and for tension fields, because slack parts have no stiffness.

    Raises
    ------
    NotConverged
        No equilibrium exists or it is unstable: the film is slack or wrinkles.
    """
    q, _ = pulled.initial()
    if settle:
        for t in np.linspace(0.0, 1.0, steps + 1)[1:]:
            q = settled(pulled, float(t), q).q
    else:
        q = equilibrium(pulled, q, np.linspace(0.0, 1.0, steps + 1))
    return pulled.held(pulled.place(1.0, q, None)[0], ends, loading)


def settled(
    system: AncfSystem, t: float, q: np.ndarray, tolerance: float = 1e-9, max_iterations: int = 300
) -> Relaxed:
    """Stable equilibrium by `relaxed`, in several passes for films and cables that carry no compression.

    Each pass reduces the remaining stiffness in compression and starts from the equilibrium of the pass before. After the
    last pass the compression is about eps^2 of the stress.
    """
    if not system.tension_field:
        return relaxed(system, t, q, tolerance, max_iterations)
    iterations = 0
    for remainder, near in _PASSES:
        system.release(t, q, remainder)
        found = relaxed(
            system, t, q, max(near, tolerance), max_iterations,
            renew=partial(system.release, t, remainder=remainder),
        )  # fmt: skip
        q, iterations = found.q, iterations + found.iterations
    return Relaxed(q, iterations, found.last_step)


_IMPERFECTION = 0.1
"""Height of the initial waves without a closed form, relative to the thickness."""
_REMEDY = {
    "plain": 'tension.film = "tension-field", which carries no compression',
    "wrinkles": 'tension.film = "tension-field", or a finer membrane.mesh',
    "tension-field": "to hold more of the film by [[support]]",
}


def supports(case: Case) -> tuple[Support, ...]:
    """Supports of the case; without supports, the pulled points."""
    if case.support:
        return case.support
    if any(isinstance(cable, CornerCable) for cable in case.cable):
        return (Support(at="cables"),)
    assert case.tension is not None
    return (Support(at="corners" if case.tension.pull is not None else "edges"),)


def as_deployed(case: Case, deployed: DeployedFilm, loading: Loading) -> AncfSystem:
    """Film of a deployed strip, in equilibrium with the supports and drives of the strip.

    Raises
    ------
    NotConverged
    """
    held = AncfSystem(deployed.film.mesh.holding(deployed.held), Loading(gravity=case.gravity))
    try:
        return tensioned(held, deployed.held, loading, settle=True)
    except NotConverged as error:
        raise NotConverged(f"the deployed strip as a film: {error}; give more elements_per_panel") from None


def stretched(case: Case, film: FilmMesh, loading: Loading) -> AncfSystem:
    """Film of a case under tension, on its supports, and at rest under its weight; `loading` acts after the tensioning.

    Raises
    ------
    NotConverged
    """
    tension, membrane = case.tension, case.membrane
    assert tension is not None and membrane is not None
    held = np.unique(np.concatenate([film.held_by(support) for support in supports(case)]))
    if tension.pull is not None:
        system = _pulled(case, film, held, tension.pull)
    else:
        assert tension.strain is not None
        strain = tension.strain if isinstance(tension.strain, tuple) else (tension.strain, tension.strain)
        system = AncfSystem(film.mesh.holding(held), Loading(gravity=case.gravity), _drawn_out(film, strain))
    if tension.film == "wrinkles":
        start = lifted(system.start, film.grid.position, _waves(case))
        start[system.fixed] = system.start[system.fixed]
        system = AncfSystem(system.mesh, system.loading, start)
    try:
        return tensioned(system, held, loading, settle=tension.film != "plain")
    except NotConverged as error:
        raise NotConverged(f"tension of the film: {error}. Try {_REMEDY[tension.film]}") from None


def _waves(case: Case) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Initial height for wrinkles: closed form at pulled corners, else waves of a few elements."""
    tension, membrane, material = case.tension, case.membrane, case.material
    assert tension is not None and membrane is not None and material is not None
    if tension.pull is not None:
        sheet = FilmMaterial(material.young, material.poisson, material.density, membrane.thickness)
        form = corner_wrinkles(sheet, membrane.length, tension.pull)
        scale = 1.0 if tension.imperfection is None else tension.imperfection / form.amplitude
        shift = (0.5 * membrane.length, 0.5 * membrane.width)
        return lambda x, y: scale * form.height(x + shift[0], (y + shift[1]) * membrane.length / membrane.width)
    size = tension.imperfection or _IMPERFECTION * membrane.thickness
    sides = (membrane.length, membrane.width)
    kx, ky = (math.pi * count / (2.3 * side) for count, side in zip(membrane.mesh, sides, strict=True))
    return lambda x, y: size * (np.sin(kx * x + ky * y + 0.3) + np.sin(kx * x - 1.1 * ky * y + 1.0)) / 2.0


def _pulled(case: Case, film: FilmMesh, held: np.ndarray, pull: float) -> AncfSystem:
    """Film under its pull. The ends move outwards freely; one end is held and carries the reaction of the others.

    The initial guess is stretched by about the final strain, since a slack film has no transverse stiffness.
    """
    ends = film.ends
    drawn = np.concatenate([ends, ends + 1, ends + 2])
    others = np.setdiff1d(held, drawn)
    anchor = ends[0] + np.arange(3)  # by equilibrium, the reaction at the held end equals the pull at this end
    strain = mean_strain(case)
    forces = np.zeros(len(film.mesh.coordinates))
    for end, outward in zip(ends[1:], film.outwards[1:], strict=True):
        forces[end : end + 3] = pull * outward
    mesh = film.mesh.holding(np.concatenate([others, anchor, ends + 2]))
    loading = Loading((Forcing(forces, CONSTANT),), gravity=case.gravity)
    return AncfSystem(mesh, loading, _drawn_out(film, (strain, strain)))


def _drawn_out(film: FilmMesh, strain: tuple[float, float]) -> np.ndarray:
    """Film stretched uniformly, slightly beyond the given Green strain; cables move with their corners."""
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
