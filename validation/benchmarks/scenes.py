"""Scenes of the benchmark, one function each; README.md states their purposes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from fsm.builders.scene import build_scene
from fsm.case.loading.load_case import load_case
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.loads import Load
from fsm.case.models.scene import GROUND, Body, ContactPair, ForceElement, Plate, Scene, Surface
from fsm.case.models.time_program import Ramp
from fsm.model.compile.compile import compile_scene
from fsm.solve.outcome.run_io import SavedState
from validation.benchmarks.problem import Problem, Tight
from validation.closed_forms.bodies import top_scene

__all__ = [
    "PENDULUM_TIP",
    "PROBLEMS",
    "QUICK",
    "TOP_ENERGY",
    "cantilever",
    "heavy_top",
    "pendulum",
    "roll_up",
    "stack",
    "strip",
    "strip_in_space",
    "strip_scene",
]

TRIAL = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"

# tip (x, y) of the flexible pendulum by time and the heavy top's position by time and energy: validation/references.md
PENDULUM_TIP = {
    0.1: (1.200000, -0.049049),
    0.2: (1.179924, -0.196180),
    0.3: (1.078738, -0.441262),
    0.4: (0.852851, -0.784469),
    0.5: (0.394834, -1.215096),
}
TOP_POSITION = {
    0.05: (0.2257411175, 0.9734319843, -0.0383551802),
    1.0: (0.1733439641, 0.6400885921, -0.7484907911),
}
TOP_ENERGY = 5435.696790865


# what is compared ---------------------------------------------------------------------------------------------------


def _over_peak(values: np.ndarray, reference: np.ndarray) -> float:
    """Root mean square difference of two curves over the peak of the reference."""
    return float(np.sqrt(np.mean((values - reference) ** 2)) / np.abs(reference).max())


def _distance(length: float) -> Callable[[np.ndarray, np.ndarray], float]:
    """Root mean square, over rows, of the distance between corresponding points, relative to a length."""

    def error(values: np.ndarray, reference: np.ndarray) -> float:
        return float(np.sqrt(np.mean(np.sum((values - reference) ** 2, axis=1))) / length)

    return error


def _pull_force(saved: SavedState) -> np.ndarray:
    return saved.observation.drive.force


def _end_of_last(length: float) -> Callable[[SavedState], np.ndarray]:
    """x and z of the outer end of the last body, in the plane."""

    def tip(saved: SavedState) -> np.ndarray:
        x, z, turned = saved.q[-3:]
        return np.array([x + length / 2 * math.cos(turned), z - length / 2 * math.sin(turned)])

    return tip


# scenes -------------------------------------------------------------------------------------------------------------


def strip_scene(segments: int, travel: float = 0.04) -> Scene:
    """The trial strip (folding_cases/strip_trial) with its segments per panel and its travel (m)."""
    overrides = [f"strip.segments_per_panel={segments}", f"drive.0.travel={travel}", "expect=none"]
    return build_scene(load_case(TRIAL, overrides).case)


def strip(segments: int = 10, travel: float = 0.04, spatial: bool = False) -> Problem:
    """The trial strip in the plane: the force at 81 even travels."""
    scene = strip_scene(segments, travel)
    (motion,) = compile_scene(scene, spatial).motions
    where = "space" if spatial else "the plane"
    return Problem(
        name="strip_in_space" if spatial else "strip",
        title=f"pulled strip with contact in {where}, {segments} segments per panel",
        measure="RMS error of the force / peak",
        scene=scene,
        times=tuple(motion.time_of(float(x)) for x in np.linspace(0.0, travel, 81)),
        sample=_pull_force,
        error=_over_peak,
        reference=Tight("Radau", 3e-8),
        spatial=spatial,
        static=True,
        tightest=1e-7,
    )


def strip_in_space(segments: int = 5, travel: float = 0.02) -> Problem:
    """The same strip in space with fewer segments and a shorter travel, which extends well into contact (from 5 mm on)."""
    return strip(segments, travel, spatial=True)


def pendulum(count: int = 20) -> Problem:
    """A soft bar, hinged at one end, falls from the horizontal."""
    length, area, inertia, density, young, poisson = 1.2, 0.0018, 1.215e-8, 5540.0, 0.7e6, 0.3
    piece = length / count
    width, thickness = 0.2, 0.009  # sides of the rectangle with this area and second moment
    plate = Plate(length=piece, width=width, thickness=thickness)
    mass = density * area * piece
    squares = np.array([piece, width, thickness]) ** 2
    moments = tuple(float(x) for x in mass / 12 * (squares.sum() - squares))
    shear = 5 / 6 * young / (2 * (1 + poisson)) * area / piece
    joint = {
        "translation": (young * area / piece, shear, shear),
        "rotation": (0.0, young * inertia / piece, 0.0),
    }
    # the bar has a hinge here, so the half cell beside it is stiff in translation only
    hinge = {"translation": tuple(2 * k for k in joint["translation"])}
    scene = Scene(
        bodies=tuple(
            Body(name=f"{i}", mass=mass, inertia=moments, position=((i + 0.5) * piece, 0.0, 0.0), plate=plate)
            for i in range(count)
        ),
        elements=tuple(
            ForceElement(
                name=f"joint {i}",
                inner=f"{i - 1}" if i else GROUND,
                outer=f"{i}",
                point_inner=(piece / 2 if i else 0.0, 0.0, 0.0),
                point_outer=(-piece / 2, 0.0, 0.0),
                **(joint if i else hinge),
            )
            for i in range(count)
        ),
        gravity=(0.0, 0.0, -9.81),
    )
    return Problem(
        name="pendulum",
        title=f"flexible pendulum, {count} segments",
        measure="RMS error of the tip's position / length",
        scene=scene,
        times=tuple(PENDULUM_TIP),
        sample=_end_of_last(piece),
        error=_distance(length),
        reference=Tight("Radau", 1e-10),
        tightest=1e-8,
    )


def heavy_top(end: float = 1.0) -> Problem:
    """A fast top on a stiff fixed point."""
    return Problem(
        name="top",
        title="heavy top",
        measure=f"error of the position at {end:g} s / arm",
        scene=top_scene(),
        times=(end,),
        sample=lambda saved: saved.q[:3],
        error=_distance(1.0),
        reference=np.array([TOP_POSITION[end]]),
        tightest=1e-8,
    )


def stack(count: int = 4) -> Problem:
    """Plates that are dropped one above the other on a held plate; they bounce, slide, and come to rest on each other.

    They start with alternating tilts and slide apart, so that edges touch first and friction does work.
    """
    length, width, thickness, mass, clearance = 0.1, 0.04, 2e-3, 0.02, 4e-3
    squares = np.array([length, width, thickness]) ** 2
    moments = tuple(float(x) for x in mass / 12 * (squares.sum() - squares))
    bodies = [
        Body(
            name="0",
            mass=mass,
            inertia=moments,
            held=True,
            plate=Plate(length=3 * length, width=width, thickness=thickness),
        )
    ]
    for i in range(1, count + 1):
        side = 1 if i % 2 else -1
        tilt = 0.02 * side
        bodies.append(
            Body(
                name=f"{i}",
                mass=mass,
                inertia=moments,
                position=(0.0, 0.0, i * (thickness + clearance)),
                orientation=(math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0),
                velocity=(0.05 * side, 0.0, 0.0),
                plate=Plate(length=length * (1.0 - 0.15 * i), width=width, thickness=thickness),
            )
        )
    scene = Scene(
        bodies=tuple(bodies),
        surfaces=tuple(Surface(name=f"plate {i}", bodies=(f"{i}",)) for i in range(count + 1)),
        pairs=tuple(ContactPair(first=f"plate {i}", second=f"plate {i + 1}") for i in range(count)),
        contact=Contact(stiffness=1e8, damping=60.0, ramp=1e-5),
        friction=Friction(mu_static=0.3, mu_dynamic=0.2, v_static=1e-2, v_dynamic=5e-2),
        gravity=(0.0, 0.0, -9.81),
    )
    return Problem(
        name="stack",
        title=f"{count} plates dropped on one another",
        measure="RMS error of the positions / plate's length",
        scene=scene,
        times=tuple(float(t) for t in np.linspace(0.0, 0.2, 41)),
        sample=lambda saved: saved.q.reshape(-1, 3)[:, :2].ravel(),
        error=_distance(length * math.sqrt(count)),  # the root mean square also runs over all plates
        reference=Tight("Radau", 1e-9),
        tightest=1e-7,
    )


def cantilever(count: int, ramp: float, damping: float, slenderness: float = 100.0) -> Scene:
    """Straight cantilever with length, EI and mass per length one; an end moment of 2 pi grows over `ramp` (s).

    Parameters
    ----------
    count : segments
    ramp : s
    damping : Kelvin-Voigt time, s
    slenderness : length over thickness, which determines the stiffness in tension and shear
    """
    piece = 1.0 / count
    stretch = 12.0 * slenderness**2
    mass, thickness = piece, 1.0 / slenderness
    turn = mass * (piece**2 + thickness**2) / 12
    bodies = tuple(
        Body(
            name=f"{i}",
            mass=mass,
            inertia=(turn, turn, turn),
            position=((i + 0.5) * piece, 0.0, 0.0),
            plate=Plate(length=piece, width=thickness, thickness=thickness),
        )
        for i in range(count)
    )
    elements = []
    for i in range(count):
        flexible = piece if i else piece / 2  # this is the half cell at the clamp
        translation = (stretch / flexible, 0.3 * stretch / flexible, 0.3 * stretch / flexible)
        rotation = (1 / flexible,) * 3
        elements.append(
            ForceElement(
                name=f"joint {i}",
                inner=f"{i - 1}" if i else GROUND,
                outer=f"{i}",
                point_inner=(piece / 2 if i else 0.0, 0.0, 0.0),
                point_outer=(-piece / 2, 0.0, 0.0),
                translation=translation,
                rotation=rotation,
                translation_damping=tuple(damping * k for k in translation),
                rotation_damping=tuple(damping * k for k in rotation),
            )
        )
    load = Load(body=f"{count - 1}", moment=(0.0, -2 * math.pi, 0.0), time=Ramp(kind="ramp", end=ramp))
    return Scene(bodies=bodies, elements=tuple(elements), loads=(load,))


def roll_up(count: int = 200) -> Problem:
    """A cantilever rolls up into a circle in 10 s; in 15 s more the remaining motion decays.

    The first mode (3.5 rad/s for the straight cantilever) has half of the critical damping, and faster modes have more.
    """
    return Problem(
        name="roll_up",
        title=f"roll-up of {count} segments",
        measure="distance of the tip from the clamp / length",
        scene=cantilever(count, ramp=10.0, damping=0.3),
        times=(25.0,),
        sample=_end_of_last(1.0 / count),
        error=_distance(1.0),
        reference=np.zeros((1, 2)),
        static=True,
        tightest=1e-7,
    )


PROBLEMS: dict[str, Callable[[], Problem]] = {
    "strip": lambda: strip(20),
    "strip_10": lambda: replace(strip(10), name="strip_10"),
    "strip_in_space": strip_in_space,
    "pendulum": pendulum,
    "top": heavy_top,
    "stack": stack,
    "roll_up": roll_up,
}
"""All scenes by name. A new one is a function here, and a section in README.md."""

QUICK: dict[str, Callable[[], Problem]] = {
    "strip": lambda: strip(4, travel=0.01),
    "strip_in_space": lambda: strip_in_space(2, travel=0.006),
    "pendulum": lambda: pendulum(10),
    "top": lambda: heavy_top(0.05),
    "stack": lambda: stack(2),
    "roll_up": lambda: roll_up(20),
}
"""Small scenes that take seconds, for `--quick`; other scenes are omitted with this option."""
