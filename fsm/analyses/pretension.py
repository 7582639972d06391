"""Pretension of a film: equilibrium under the pull, after which the pulled points are held in place."""

from __future__ import annotations

from functools import partial

import numpy as np

from fsm.model.nodes.loading import Loading
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
    end_time: float = 1.0,
    settle: bool = False,
) -> AncfSystem:
    """System for the vibration: at rest in the tensioned state, with its ends held.

    Parameters
    ----------
    pulled : AncfSystem
        System with the forces or motions of the pull, which reach their final values at `end_time`.
    ends : int array
        Coordinates that are held after the pull.
    loading : Loading, optional
        Loading of the vibration.
    steps : int
        Load steps of the pull.
    end_time : float, s
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
        for t in np.linspace(0.0, end_time, steps + 1)[1:]:
            q = settled(pulled, float(t), q).q
    else:
        q = equilibrium(pulled, q, np.linspace(0.0, end_time, steps + 1))
    return pulled.held(pulled.place(end_time, q, None)[0], ends, loading)


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
