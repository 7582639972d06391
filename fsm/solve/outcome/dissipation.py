"""Energy dissipated in a step of a time integrator, from the states at its ends."""

from __future__ import annotations

import numpy as np

from fsm.solve.interface.records import PreviousState
from fsm.solve.interface.system import System


def mean_dissipation(
    system: System, begin: PreviousState, end: PreviousState, pairs: int, halfway: bool = False
) -> tuple[float, np.ndarray]:
    """Mean dissipated power (W) of a step between two states (time, configuration), total and by contact pairs.

    The power follows from mean rates and the forces at both ends. Rates at the ends of a step contain stiff vibrations;
    the square of these rates would overestimate the loss. The power of pairs is as in `Energy.pair_power`.

    With `halfway` the forces are those in the middle of the step, where the chord of a rotation causes no strain rate. At
    the ends, a rotation of slopes by an angle d causes an apparent strain of d^2/2, which a stiff material dissipates.
    """
    if not system.rate_dependent and not len(system.memory()):
        return 0.0, np.zeros((2, pairs))
    way = system.difference(begin[1], end[1])
    mean = way / (end[0] - begin[0])
    if halfway:
        energy = system.energy(0.5 * (begin[0] + end[0]), system.retract(begin[1], 0.5 * way), mean, begin)
        return energy.dissipated_power, energy.pair_power
    first, last = (system.energy(*here, mean, there) for here, there in ((begin, end), (end, begin)))
    return 0.5 * (first.dissipated_power + last.dissipated_power), 0.5 * (first.pair_power + last.pair_power)
