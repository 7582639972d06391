"""Dynamics by generalized-alpha with fixed steps: many steps in one kernel, and step by step in Python; the runs alternate.

    python -m validation.benchmarks.many_steps [--steps 2000] [--repeat 5]

The models are: chains of bodies that swing in the plane and in space, with a varying load, or moved at the first body; the
heavy top of `validation.peers`; balls, plates and a strip in contact; shipped cases with films, cables and beams, by the
mean-force method with error control. The results are median processor times of a step with compiled kernels. Both variants
compute the energies, and the forces of drives and contacts, at each step.
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from fsm.builders.strip import build_strip
from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.loads import Drive, Load
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import GROUND, Body, ContactPair, ForceElement, Plate, Scene
from fsm.case.models.time_program import Cycle
from fsm.kernels import jit
from fsm.model.compile.compile import compile_scene
from fsm.model.compile.compile_case import compile_case
from fsm.model.system.system import SegmentSystem
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from validation.benchmarks.demo import machine
from validation.peers.rigid import top_model

STEP = 2e-4
END = 4e-3
"""End of the motions of shipped cases, s."""


LOAD = Load(body="9", force=(0.0, 0.0, 1.0), follower=True, time=Cycle(kind="cycle", period=0.1))
BRISTLES = Friction(law="lugre", mu_static=0.4, mu_dynamic=0.3, v_stribeck=1e-2, presliding=1e-5)
DRIVE = Drive(body="0", travel=0.01, time=Cycle(kind="cycle", period=0.1, cycles=1000))


def chain(
    count: int, spatial: bool, loads: tuple[Load, ...] = (), drives: tuple[Drive, ...] = ()
) -> SegmentSystem:
    """Bars of 0.1 m on damped springs, released as a straight line; the first bar is joined to the ground, or driven."""
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


def heap(kind: str, count: int, friction: Friction | None = None) -> SegmentSystem:
    """Balls or plates that fall on the floor and on each other, in space."""
    shapes, bodies = [Obstacle(name="floor", shape="plane")], []
    for i in range(count):
        plate = Plate(length=0.08, width=0.06, thickness=0.004) if kind == "plate" else None
        height = 0.0025 + 0.0045 * i if plate else 0.0205 + 0.041 * i
        bodies.append(
            Body(
                name=f"{i}", mass=0.2, inertia=(3.2e-5,) * 3, position=(0.0, 0.0, height), plate=plate,
                velocity=(0.05 * i, 0.0, 0.0),
            )
        )  # fmt: skip
        if plate is None:
            shapes.append(Obstacle(name=f"ball {i}", shape="sphere", radius=0.02, body=f"{i}"))
    names = [body.name for body in bodies] if kind == "plate" else [shape.name for shape in shapes[1:]]
    pairs = tuple(ContactPair(first=a, second=b) for i, a in enumerate(names) for b in (*names[i + 1 :], "floor"))
    contact = Contact.model_validate({"law": "impact", "stiffness": 1e6, "damping": 50.0, "ramp": 1e-5})
    parts = {"bodies": tuple(bodies), "obstacles": tuple(shapes), "pairs": pairs, "contact": contact, "friction": friction}
    return compile_scene(Scene(**parts, gravity=(0.0, 0.0, -9.81)), True)


def strip(spatial: bool) -> SegmentSystem:
    """Driven strip of six panels of four segments that come into contact, with friction."""
    data = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 1e-4, "panels": 6, "fold_angle": 1.4, "segments_per_panel": 4,
        },
        "material": {"young": 3e9, "density": 800.0, "damping": 1e-4}, "crease": {"law": "linear", "stiffness": 0.02},
        "contact": {"stiffness": 1e6, "damping": 1.0}, "drive": [{"crease": 3, "speed": 0.1, "travel": 0.04}],
        "friction": {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 0.01, "v_dynamic": 0.02},
    }  # fmt: skip
    return compile_scene(build_strip(Case.model_validate(data)), spatial)


MADE: dict[str, Callable[[], SegmentSystem]] = {
    "chain of 10, plane": lambda: chain(10, False),
    "chain of 10, space": lambda: chain(10, True),
    "chain with a load, plane": lambda: chain(10, False, loads=(LOAD,)),
    "chain with a load, space": lambda: chain(10, True, loads=(LOAD,)),
    "chain with a drive, plane": lambda: chain(11, False, drives=(DRIVE,)),
    "chain with a drive, space": lambda: chain(11, True, drives=(DRIVE,)),
    "heavy top": lambda: top_model()[0],
    "bouncing ball": lambda: heap("ball", 1),
    "4 balls with friction": lambda: heap("ball", 4, BRISTLES),
    "4 plates with friction": lambda: heap("plate", 4, BRISTLES),
    "strip with contact, plane": lambda: strip(False),
    "strip with contact, space": lambda: strip(True),
}


CASES = Path(__file__).parents[2] / "folding_cases"
JOINED = ("beam_between_panels", "sail_on_cables", "plate_on_film")


def joined(name: str) -> SegmentSystem:
    """System of a shipped case with films, cables or beams."""
    return compile_case(load_case(CASES / name / "case.toml", []).case)[1]


MADE |= {name: partial(joined, name) for name in JOINED}


def systems(name: str) -> list[SegmentSystem]:
    """The same system twice; the first copy has no arrays."""
    both = [MADE[name](), MADE[name]()]
    both[0].__dict__["arrays"] = lambda ready: None
    return both


def main() -> int:
    """Run all models and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--only", nargs="+", choices=list(MADE), default=list(MADE))
    parser.add_argument("--repeat", type=int, default=5, help="runs of each, after one that compiles")
    chosen = parser.parse_args()
    print(", ".join(f"{name} {value}" for name, value in machine().items()), end="\n\n")
    print("| system | step by step, us | in one kernel, us | ratio | compiled first, s |")
    print("|---|---|---|---|---|")
    fixed = Settings("generalized-alpha", 1e-4, chosen.steps * STEP, step=STEP)
    controlled = Settings("mean-force", 1e-3, END)
    for name in chosen.only:
        settings = controlled if name in JOINED else fixed
        both, compiled = systems(name), []
        for system in both:
            before = jit.compile_time()
            simulate(system, settings, [0.0], lambda saved: None)
            compiled.append(jit.compile_time() - before)
        times: list[list[float]] = [[], []]
        for _ in range(chosen.repeat):
            for k, system in enumerate(both):
                begun = time.process_time()
                done, _ = simulate(system, settings, [0.0], lambda saved: None)
                times[k].append(1e6 * (time.process_time() - begun) / done.steps)
        slow, quick = map(statistics.median, times)
        first = " + ".join(f"{taken:.1f}" for taken in compiled)
        print(f"| {name} | {slow:.1f} | {quick:.1f} | {slow / quick:.1f} | {first} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
