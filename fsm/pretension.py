"""Pretension: a film is pulled, finds its equilibrium, and its ends are held where they are."""

from __future__ import annotations

from functools import partial

import numpy as np

from fsm.ancf.loading import Loading
from fsm.ancf.system import AncfSystem
from fsm.ancf.tension_field import REMAINDER, SETTLING
from fsm.solve.newton import equilibrium
from fsm.solve.relax import Relaxed, relaxed

__all__ = ["settled", "tensioned"]

_PASSES = (*((part, 1e-2) for part in SETTLING), *((REMAINDER, near) for near in (1e-2, 1e-3, 1e-3, 1e-3, 0.0)))
"""Remainder of a tension field, and the size of the last step, over that of an element, to which it is settled.

Corner-pulled film of 8 x 8: 1e-3 at the end leaves compression at the edges, and the second frequency is 1 to 3 % low;
of the sail of 12 x 10 one pass with 1e-4 leaves it 3 % low. A pass more takes some four iterations.
"""


def tensioned(
    pulled: AncfSystem,
    ends: np.ndarray,
    loading: Loading | None = None,
    steps: int = 1,
    end_time: float = 1.0,
    settle: bool = False,
) -> AncfSystem:
    """The system that vibrates: at rest in the tensioned state, its ends held, under another loading.

    Parameters
    ----------
    pulled : AncfSystem
        With the forces or motions that pull, which reach what they are to be at `end_time`.
    ends : int array
        Coordinates that are held from then on.
    loading : what acts afterwards
    steps : load steps
    settle : whether to go down the energy to a stable state
        For wrinkles, beside which the plain state is unstable, and tension fields, whose slack parts nothing holds.

    Raises
    ------
    NotConverged
        No equilibrium was found: the film is slack, or wants to wrinkle.
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
    """A stable equilibrium as by `relaxed`, in which films and cables that carry no compression do not.

    The equilibrium of a reference is the next reference; the last one leaves of compression about eps^2 of the stress.
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
