"""Times of the tensioned membrane: prestress, modes, force, tangent; medians, warm, one thread.

python -m validation.membrane.speed [--quick]
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from fsm.solve.equations.newton import equilibrium
from fsm.solve.modal import modes
from validation.benchmarks.demo import machine
from validation.membrane.film import pulled_film, tensioned_film


def _timed(run: Callable[[], Any], repeat: int) -> str:
    run()
    wall, processor = [], []
    for _ in range(repeat):
        begun = time.perf_counter(), time.thread_time()
        run()
        wall.append(time.perf_counter() - begun[0])
        processor.append(time.thread_time() - begun[1])
    return f"{statistics.median(wall):9.4f} s wall {statistics.median(processor):9.4f} s processor"


def speed(quick: bool) -> None:
    """Print them."""
    print(machine())
    for n in (12,) if quick else (12, 40):
        pulled, _, _ = pulled_film(n)
        repeat = 5 if n == 12 else 3
        taken = _timed(lambda p=pulled: equilibrium(p, p.start, np.array([0.0, 1.0])), repeat)
        print(f"{n} x {n} prestress         {taken}")
        system, _ = tensioned_film(n)
        print(f"{n} x {n} 20 modes          " + _timed(lambda s=system: modes(s, 0.0, s.start, 20), repeat))
        shaken = system.start + 1e-4 * np.random.default_rng(0).normal(size=system.nq) * ~system.fixed
        print(f"{n} x {n} force             " + _timed(lambda s=system, q=shaken: s.force(0.0, q, None), 25))
        print(f"{n} x {n} force and tangent " + _timed(lambda s=system, q=shaken: s.linearise(0.0, q, None), 25))


if __name__ == "__main__":
    speed("--quick" in sys.argv)
