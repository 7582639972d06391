"""Dynamics by generalized-alpha with fixed steps: many steps in one kernel, and step by step in Python, in turn.

    python -m validation.benchmarks.many_steps [--steps 2000] [--repeat 5]

Chains of bodies that swing, in the plane and in space, with a load that varies, or moved at the first body; and the heavy
top of `validation.peers`. Processor time a step, medians, kernels compiled; energies, and forces of drives, are accounted
for at each step in both.
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import statistics
import sys
import time
from collections.abc import Callable

from fsm.kernels import jit
from fsm.scene.loads import Drive, Load
from fsm.scene.scene import GROUND, Body, ForceElement, Scene
from fsm.scene.time_program import Cycle
from fsm.segments.compile import compile_scene
from fsm.segments.system import SegmentSystem
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from validation.benchmarks.demo import machine
from validation.peers.rigid import top_model

STEP = 2e-4


LOAD = Load(body="9", force=(0.0, 0.0, 1.0), follower=True, time=Cycle(kind="cycle", period=0.1))
DRIVE = Drive(body="0", travel=0.01, time=Cycle(kind="cycle", period=0.1, cycles=1000))


def chain(
    count: int, spatial: bool, loads: tuple[Load, ...] = (), drives: tuple[Drive, ...] = ()
) -> SegmentSystem:
    """Bars of .1 m on damped springs, released as a straight line; the first one on the ground, or driven."""
    bodies, elements = [], []
    for i in range(count):
        bodies.append(Body(name=f"{i}", mass=0.1, inertia=(1e-5, 8e-5, 8e-5), position=(0.1 * i + 0.05, 0.0, 0.0)))
        if drives and i == 0:
            continue
        elements.append(
            ForceElement(
                name=f"joint {i}", inner=f"{i - 1}" if i else GROUND, outer=f"{i}",
                point_inner=(0.05 if i else 0.0, 0.0, 0.0), point_outer=(-0.05, 0.0, 0.0), translation=(1e5,) * 3,
                rotation=(1.0, 0.1, 1.0), translation_damping=(10.0,) * 3,
            )
        )  # fmt: skip
    parts = {"bodies": tuple(bodies), "elements": tuple(elements), "loads": loads, "drives": drives}
    return compile_scene(Scene(**parts, gravity=(0.0, 0.0, -9.81)), spatial)


MADE: dict[str, Callable[[], SegmentSystem]] = {
    "chain of 10, plane": lambda: chain(10, False),
    "chain of 10, space": lambda: chain(10, True),
    "chain with a load, plane": lambda: chain(10, False, loads=(LOAD,)),
    "chain with a load, space": lambda: chain(10, True, loads=(LOAD,)),
    "chain with a drive, plane": lambda: chain(11, False, drives=(DRIVE,)),
    "chain with a drive, space": lambda: chain(11, True, drives=(DRIVE,)),
    "heavy top": lambda: top_model(1e6)[0],
}


def systems(name: str) -> list[SegmentSystem]:
    """The same system twice, the first without its arrays."""
    both = [MADE[name](), MADE[name]()]
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
    for name in MADE:
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
