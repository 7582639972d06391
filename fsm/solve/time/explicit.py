"""The explicit Runge-Kutta method, step by step; see `fsm.solve.stepping.explicit` for the equations."""

from __future__ import annotations

import math

import numpy as np

from fsm.solve.interface.system import System
from fsm.solve.stepping.explicit import ExplicitMotion, ExplicitRules, march_explicit, march_explicit_arrays, take_step
from fsm.solve.stepping.generalized_alpha import LONGEST, MAX_STEP, STARTED, STEP_SIZE
from fsm.solve.time.array_steps import StepMethod


class Explicit(StepMethod):
    """The explicit Runge-Kutta method of order 8, step by step.

    Parameters
    ----------
    system : System
    t, q, u : time and state to start from
    rtol : -
        Bound of the local error of a step, root mean square over all components, relative to the system's scales; of
        velocities relative to scales and size.
    max_step : s
    """

    one_step, in_python = staticmethod(take_step), staticmethod(march_explicit)
    in_kernel = staticmethod(march_explicit_arrays)
    following = STEP_SIZE
    kept = "rate", "sizes", "counts"

    def __init__(
        self, system: System, t: float, q: np.ndarray, u: np.ndarray, rtol: float, max_step: float = math.inf
    ) -> None:
        from scipy.integrate import DOP853

        sizes, counts, still = np.zeros(11), np.zeros(13, dtype=np.int64), np.zeros(len(u))
        sizes[MAX_STEP], sizes[LONGEST] = max_step, math.inf
        observed, stages = system.observe(t, q, u), len(DOP853.B)
        q, u = np.array(q, dtype=float), np.array(u, dtype=float)
        of_q, of_u = np.zeros((stages, len(q))), np.zeros((stages, len(u)))
        y, at_q = np.zeros((2, len(q)))
        v, at_u, moved, faster = np.zeros((4, len(u)))
        motion = ExplicitMotion(
            q, u, still, sizes, counts, y, v, of_q, of_u, at_q, at_u, moved, faster, np.zeros((stages, 2)),
            np.zeros((2, len(observed.pairs.force))), np.zeros(len(observed.drive.force)),
        )  # fmt: skip
        super().__init__(system, t, q, motion, True)
        scales = system.scales()
        nodes, weights, table, fifth, third = (
            np.ascontiguousarray(each[..., :stages]) for each in
            (DOP853.C[:stages], DOP853.B, DOP853.A[:stages, :stages], DOP853.E5, DOP853.E3)
        )  # fmt: skip
        self.rules = ExplicitRules(
            rtol, nodes, weights, table, fifth, third, rtol * scales.increment, scales.velocity, scales.increment,
            np.array(sorted(system.break_times()), dtype=float),
        )  # fmt: skip

    @property
    def _pace(self) -> np.ndarray:
        return np.asarray(self.motion.rate / self.rules.velocity)

    def _without_factors(self) -> None:
        self.motion.counts[STARTED] = 0
