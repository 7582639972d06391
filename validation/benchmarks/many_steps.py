"""Dynamics by generalized-alpha with fixed steps: many steps in one kernel, and step by step in Python, in turn.

    python -m validation.benchmarks.many_steps [--steps 2000] [--repeat 5]

Chains of bodies that swing, in the plane and in space, and the heavy top of `validation.peers`. Processor time a step,
medians, kernels compiled; energies are accounted for at each step in both.
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import statistics
import sys
import time

from fsm.kernels import jit
from fsm.scene.scene import GROUND, Body, ForceElement, Scene
from fsm.segments.compile import compile_scene
from fsm.segments.system import SegmentSystem
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from validation.benchmarks.demo import machine
from validation.peers.rigid import top_model

STEP = 2e-4


def chain(count: int, spatial: bool) -> SegmentSystem:
    """Bars of .1 m on damped springs, released as a straight line."""
    bodies, elements = [], []
    for i in range(count):
        bodies.append(Body(name=f"{i}", mass=0.1, inertia=(1e-5, 8e-5, 8e-5), position=(0.1 * i + 0.05, 0.0, 0.0)))
        elements.append(
            ForceElement(
                name=f"joint {i}", inner=f"{i - 1}" if i else GROUND, outer=f"{i}",
                point_inner=(0.05 if i else 0.0, 0.0, 0.0), point_outer=(-0.05, 0.0, 0.0), translation=(1e5,) * 3,
                rotation=(1.0, 0.1, 1.0), translation_damping=(10.0,) * 3,
            )
        )  # fmt: skip
    return compile_scene(Scene(bodies=tuple(bodies), elements=tuple(elements), gravity=(0.0, 0.0, -9.81)), spatial)


def systems(name: str) -> list[SegmentSystem]:
    """The same system twice, the first without its arrays."""
    made = {
        "chain of 10, plane": lambda: chain(10, False),
        "chain of 10, space": lambda: chain(10, True),
        "heavy top": lambda: top_model(1e6)[0],
    }[name]
    both = [made(), made()]
    both[0].__dict__["arrays"] = lambda ready: None
    return both


def main() -> int:
    """Run all, print a row each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--repeat", type=int, default=5, help="runs of each, after one that compiles")
    chosen = parser.parse_args()
    print(", ".join(f"{name} {value}" for name, value in machine().items()), end="\n\n")
    print("| system | step by step, us | in one kernel, us | ratio | compiled first, s |")
    print("|---|---|---|---|---|")
    settings = Settings("generalized-alpha", 1e-4, chosen.steps * STEP, step=STEP)
    for name in ("chain of 10, plane", "chain of 10, space", "heavy top"):
        both, compiled = systems(name), []
        for system in both:
            before = jit.compile_time()
            simulate(system, settings, [0.0], lambda saved: None)
            compiled.append(jit.compile_time() - before)
        times: list[list[float]] = [[], []]
        for _ in range(chosen.repeat):
            for k, system in enumerate(both):
                begun = time.process_time()
                simulate(system, settings, [0.0], lambda saved: None)
                times[k].append(1e6 * (time.process_time() - begun) / chosen.steps)
        slow, quick = map(statistics.median, times)
        first = " + ".join(f"{taken:.1f}" for taken in compiled)
        print(f"| {name} | {slow:.1f} | {quick:.1f} | {slow / quick:.1f} | {first} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
