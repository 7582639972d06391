"""A strip of many steep folds in a channel between a wall and a press; the press flattens and releases it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fsm.builders.strip import build_strip
from fsm.case.models.case import Case, Strip
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.loads import Load
from fsm.case.models.materials import LinearCrease, Material
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import GROUND, Body, ContactPair, ForceElement, Scene
from fsm.case.models.time_program import Table
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, SavedState, Statistics
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.simulate import simulate
from fsm.solve.statics.static import follow

__all__ = ["CONTACT", "END", "FOLD", "LENGTH", "RTOL", "THICKNESS", "PressedStack", "crossings", "press", "stack_scene"]

LENGTH, WIDTH, THICKNESS = 0.08, 0.04, 3e-4
"""Size of a panel, m."""
CREASE = 9e-3
"""Stiffness of a crease, N m/rad."""
FOLD = math.radians(80.0)
CONTACT = Contact(stiffness=1e8, damping=0.0)
AWAY = 1e-3
"""Between the strip and the wall, and the strip and the press, at the start, m."""
ROOM = 1e-3
"""Between the ends of the panels, when they stand upright, and floor or lid, m."""
RTOL = 1e-5
"""Relative tolerance of the path; afterwards the strip may deviate by this part of the length of a panel."""
END = 45.0
"""Duration of pressing and letting go, s."""


@dataclass(frozen=True)
class PressedStack:
    """Result of the run.

    Attributes
    ----------
    system : SegmentSystem
    saved : states
    statistics, energy_balance
    deepest : (n_pairs,) array
        Of all steps, m.
    allowed : (n_pairs,) array
        Largest depth that the largest force of each pair could cause if one smallest point carried the whole force, m.
    """

    system: SegmentSystem
    saved: list[SavedState]
    statistics: Statistics
    energy_balance: EnergyBalance
    deepest: np.ndarray
    allowed: np.ndarray

    @property
    def not_back(self) -> float:
        """Largest difference between the last and the first state, m or rad."""
        return float(np.abs(self.saved[-1].q - self.saved[0].q).max())


def stack_scene(
    panels: int = 20,
    segments: int = 3,
    force: float = 2.0,
    contact: Contact = CONTACT,
    friction: Friction | None = None,
) -> Scene:
    """The press is a half-space fixed to a body that is guided along x; the strip begins at the wall with an additional
    crease.

    Parameters
    ----------
    force : N
        Force at the end of the pressing.
    """
    case = Case(
        strip=Strip(
            length=panels * LENGTH, width=WIDTH, thickness=THICKNESS, panels=panels, fold_angle=FOLD,
            segments_per_panel=segments, held=(),
        ),
        material=Material(young=3e9, density=800.0, damping=10e-3),
        crease=LinearCrease(stiffness=CREASE),
        contact=contact,
        friction=friction,
    )  # fmt: skip
    strip = build_strip(case)
    # there are a wall on the left at x = 0, the press on the right, a floor and a lid; without them the strip would buckle
    # sideways
    start = 0.5 * THICKNESS + AWAY
    run = panels * LENGTH * math.cos(FOLD) + start
    press_at = (run, 0.0, 0.5 * LENGTH)
    press_body = Body(name="press", mass=0.02, inertia=(1e-4, 1e-4, 1e-4), position=press_at)
    guide = ForceElement(
        name="guide", inner="press", outer=GROUND, point_outer=press_at, translation=(0.05, 1e4, 1e4),
        rotation=(1e2, 1e2, 1e2), translation_damping=(0.06, 1.0, 1.0), rotation_damping=(1e-2, 1e-2, 1e-2),
    )  # fmt: skip
    first = strip.bodies[0]
    hinge = ForceElement(
        name="hinge", inner=first.name, outer=GROUND, point_inner=(-0.5 * LENGTH / segments, 0.0, 0.0),
        translation=(1e4, 1e4, 1e4), translation_damping=(1.0, 1.0, 1.0), rotation=(1.0, CREASE, 1.0),
        rotation_damping=(1e-2, 1e-2 * CREASE, 1e-2), rest_angle=-FOLD, initial_angle=-FOLD,
    )  # fmt: skip
    half_turn = math.sqrt(0.5)
    left, right = (half_turn, 0.0, half_turn, 0.0), (half_turn, 0.0, -half_turn, 0.0)
    obstacles = (
        Obstacle(name="plate", shape="plane", body="press", orientation=right),
        Obstacle(name="wall", shape="plane", position=(-start, 0.0, 0.0), orientation=left),
        Obstacle(name="floor", shape="plane", position=(0.0, 0.0, -ROOM)),
        Obstacle(name="lid", shape="plane", position=(0.0, 0.0, LENGTH + ROOM), orientation=(0.0, 0.0, 1.0, 0.0)),
    )
    pairs = [ContactPair(first=f"panel {k + 1}", second=o.name) for o in obstacles for k in range(panels)]
    times = (0.0, 12.0, 15.0, 16.0, 19.0, 31.0)
    load = Load(
        body="press", force=(-force, 0.0, 0.0),
        time=Table(kind="table", time=times, value=(0.0, 0.03, 1.0, 1.0, 0.03, 0.0)),
    )  # fmt: skip
    return strip.model_copy(
        update={
            "bodies": (*strip.bodies, press_body),
            "elements": (*strip.elements, guide, hinge),
            "obstacles": obstacles,
            "pairs": (*strip.pairs, *pairs),
            "loads": (load,),
        }
    )


def press(
    scene: Scene, method: str = "static", rtol: float = RTOL, interval: float = 0.25, end: float = END
) -> PressedStack:
    """Press the strip and release it."""
    system = compile_scene(scene)
    saved: list[SavedState] = []
    deepest, largest = np.zeros(len(scene.pairs)), np.zeros(len(scene.pairs))

    def look(state: AcceptedStep) -> None:
        pairs = system.observe(state.time, state.q, state.u).pairs
        np.maximum(deepest, -pairs.gap, out=deepest)
        np.maximum(largest, pairs.force, out=largest)

    times = np.arange(0.0, end + 0.5 * interval, interval).tolist()
    if method == "static":
        statistics, energy_balance = follow(system, PathSettings(end, 1e-2, rtol=rtol), times, saved.append, look)
    else:
        statistics, energy_balance = simulate(system, Settings(method, rtol, end), times, saved.append, look)
    assert scene.contact is not None
    smallest = np.full(len(scene.pairs), np.inf)
    for group in system.contacts:
        np.minimum.at(smallest, group.geometry.pair, group.geometry.share)
    allowed = (largest / (smallest * scene.contact.stiffness)) ** (1.0 / scene.contact.exponent)
    return PressedStack(system, saved, statistics, energy_balance, deepest, allowed)


def crossings(system: SegmentSystem, state: SavedState) -> list[tuple[int, int]]:
    """Pairs of panels whose middle lines cross, except at a common crease; found by a comparison of all lines."""
    plates = system.shape(state.time, state.q)[:, :, [0, 2]]
    panel = np.array([panel for _, _, panel in system.bodies.plates])
    start, along = plates[:, 0], plates[:, 1] - plates[:, 0]
    found = set()
    for i in range(len(panel)):
        others = np.flatnonzero(panel > panel[i])
        gap = start[others] - start[i]
        area = along[i, 0] * along[others, 1] - along[i, 1] * along[others, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            own = (gap[:, 0] * along[others, 1] - gap[:, 1] * along[others, 0]) / area
            other = (gap[:, 0] * along[i, 1] - gap[:, 1] * along[i, 0]) / area
        inside = (own > 1e-3) & (own < 1 - 1e-3) & (other > 1e-3) & (other < 1 - 1e-3)
        found |= {(int(panel[i]), int(panel[k])) for k in others[inside]}
    return sorted(found)
