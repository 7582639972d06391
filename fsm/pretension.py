"""Pretension: a film is pulled, finds its equilibrium, and its ends are held where they are."""

from __future__ import annotations

import numpy as np

from fsm.ancf.loading import Loading
from fsm.ancf.system import AncfSystem
from fsm.solve.newton import equilibrium
from fsm.solve.relax import relaxed

__all__ = ["tensioned"]


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
            q = relaxed(pulled, float(t), q).q
    else:
        q = equilibrium(pulled, q, np.linspace(0.0, end_time, steps + 1))
    return pulled.held(pulled.place(end_time, q, None)[0], ends, loading)
