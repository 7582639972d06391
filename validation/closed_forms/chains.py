"""Beams made of rigid segments: the unit cantilever, the pinned column, arcs and straight cantilevers in space."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fsm.case.models.loads import Drive, Load
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.case.models.time_program import Ramp
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.equations.newton import equilibrium
from fsm.solve.outcome.run_io import SavedState, Statistics
from fsm.solve.settings import PathSettings
from fsm.solve.statics.static import follow

__all__ = ["Section", "buckled", "cantilever", "column", "lateral_buckling", "space_cantilever", "space_tip", "tip"]

STIFF = 1e8
FULL = Ramp(kind="ramp", end=1.0)


def cantilever(count: int, force: float = 0.0, moment: float = 0.0) -> Scene:
    """Cantilever along x, L = EI = 1, with a dead force in z and a moment about y (taking x towards z) at its tip.

    N equal segments, joints EI/l, and half a cell at the clamp, 2EI/l. EA = GA = 1e8, so the cantilever is practically
    inextensible.
    """
    length = 1.0 / count
    bodies = [
        Body(name=f"{i}", mass=1.0, inertia=(1.0, 1.0, 1.0), position=((i + 0.5) * length, 0.0, 0.0)) for i in range(count)
    ]
    elements = []
    for i in range(count):
        flexible = length if i else length / 2
        elements.append(
            ForceElement(
                name=f"joint {i}",
                inner=f"{i - 1}" if i else GROUND,
                outer=f"{i}",
                point_inner=(length / 2 if i else 0.0, 0.0, 0.0),
                point_outer=(-length / 2, 0.0, 0.0),
                translation=(STIFF / flexible,) * 3,
                rotation=(1 / flexible,) * 3,
            )
        )
    load = Load(
        body=f"{count - 1}", point=(length / 2, 0.0, 0.0), force=(0.0, 0.0, force), moment=(0.0, -moment, 0.0), time=FULL
    )
    return Scene(bodies=tuple(bodies), elements=tuple(elements), loads=(load,))


def tip(scene: Scene, spatial: bool, steps: int = 10) -> np.ndarray:
    """x, z and angle (from x towards z, of the last segment) of the tip under the full load."""
    system = compile_scene(scene, spatial)
    assert system.spatial == spatial
    length = 1.0 / len(scene.bodies)
    q = equilibrium(system, system.initial()[0], np.linspace(0.0, 1.0, steps + 1)).reshape(len(scene.bodies), -1)[-1]
    angle = 2 * math.atan2(-q[5], q[3]) if spatial else -q[2]
    z = q[2] if spatial else q[1]
    return np.array([q[0] + length / 2 * math.cos(angle), z + length / 2 * math.sin(angle), angle])


def column(count: int, spatial: bool = False, damping: float = 0.0, clamped: bool = False) -> SegmentSystem:
    """Column of unit length and EI, pinned (or clamped) at both ends, compressed along x by a drive; it is practically
    inextensible."""
    length = 1.0 / count
    stiff = 1e9
    names = [f"segment {k}" for k in range(count)]
    bodies = [
        Body(name=name, mass=length, inertia=(length**3 / 12,) * 3, position=((k + 0.5) * length, 0.0, 0.0))
        for k, name in enumerate(names)
    ]
    bodies.append(Body(name="end", mass=0.0, inertia=(0.0, 0.0, 0.0), position=(1.0, 0.0, 0.0)))
    half = (length / 2, 0.0, 0.0), (-length / 2, 0.0, 0.0)
    elements = [
        ForceElement(
            name=f"joint {k}", inner=names[k], outer=names[k + 1], point_inner=half[0], point_outer=half[1],
            translation=(stiff,) * 3, rotation=(1.0 / length, 1.0 / length, 4.0 / length),
            rotation_damping=(0.0, damping / length, 0.0), kind="panel",
        )
        for k in range(count - 1)
    ]  # fmt: skip
    turn = 2.0 / length if clamped else 0.0
    pin = {"translation": (stiff,) * 3, "rotation": (1e3, turn, 1e3)}
    elements.append(ForceElement(name="pin", inner=GROUND, outer=names[0], point_outer=half[1], **pin))
    pin["translation_damping"] = (1e6 * damping,) * 3
    elements.append(ForceElement(name="pulled pin", inner="end", outer=names[-1], point_outer=half[0], **pin))
    drive = Drive(body="end", direction=(-1.0, 0.0, 0.0), speed=0.01, travel=0.55)
    return compile_scene(Scene(bodies=tuple(bodies), elements=tuple(elements), drives=(drive,)), spatial)


def buckled(
    system: SegmentSystem, shortenings: tuple[float, ...], imperfection: float = 0.0
) -> tuple[list[SavedState], Statistics]:
    """States of a compressed column at these shortenings (m), along its stable branch."""
    motion = system.motions[0]
    saved: list[SavedState] = []
    settings = PathSettings(system.end_time() or 0.0, motion.time_of(2e-3), imperfection=imperfection)
    statistics, _ = follow(system, settings, [motion.time_of(x) for x in shortenings], saved.append)
    return saved, statistics


@dataclass(frozen=True)
class Section:
    """Stiffness of a section: stretch and both shears (N), torsion, bending about y and about z (N m^2)."""

    stretch: float
    shear: float
    torsion: float
    about_y: float
    about_z: float

    @classmethod
    def rectangle(cls, along_y: float, along_z: float, young: float, shear: float, torsion: float) -> Section:
        """Sides (m), E and G (Pa), torsion constant (m^4); shear factor 5/6."""
        area = along_y * along_z
        return cls(
            young * area, 5 / 6 * shear * area, shear * torsion,
            young * along_y * along_z**3 / 12, young * along_z * along_y**3 / 12,
        )  # fmt: skip


def space_tip(
    count: int,
    length: float,
    arc: float,
    section: Section,
    force: tuple[float, float, float],
    steps: int = 10,
    alternate: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Tip (x, y, z) and quaternion of the last segment of a `space_cantilever` under its whole load."""
    system = space_cantilever(count, length, arc, section, force, alternate)
    q = equilibrium(system, system.initial()[0], np.linspace(0.0, 1.0, steps + 1)).reshape(count, 7)[-1]
    piece, turn = length / count, arc / count
    chord = piece if arc == 0.0 else 2.0 * length / arc * math.sin(turn / 2)
    return q[:3] + 0.5 * chord * _first_axis(q[3:]), q[3:]


def space_cantilever(
    count: int,
    length: float,
    arc: float,
    section: Section,
    force: tuple[float, float, float],
    alternate: bool = False,
) -> SegmentSystem:
    """Cantilever in space under a dead force at its tip that grows in 1 s.

    The cantilever starts at the origin along x and bends towards y by the angle `arc` in total. Segments are chords of a
    true circle, joints are at its points, and the clamp has half a cell. `alternate` swaps inner and outer body of every
    other joint.
    """
    piece, turn = length / count, arc / count
    chord = piece if arc == 0.0 else 2.0 * length / arc * math.sin(turn / 2)
    half_turn = (math.cos(turn / 4), 0.0, 0.0, math.sin(turn / 4))
    back = (half_turn[0], 0.0, 0.0, -half_turn[3])
    nodes = np.zeros((count + 1, 2))
    for i in range(count):
        middle = (i + 0.5) * turn
        nodes[i + 1] = nodes[i] + chord * np.array([math.cos(middle), math.sin(middle)])
    bodies, elements = [], []
    for i in range(count):
        at, middle = 0.5 * (nodes[i] + nodes[i + 1]), (i + 0.5) * turn
        bodies.append(
            Body(
                name=f"{i}", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(float(at[0]), float(at[1]), 0.0),
                orientation=(math.cos(middle / 2), 0.0, 0.0, math.sin(middle / 2)),
            )
        )  # fmt: skip
        flexible = piece if i else piece / 2
        before = (f"{i - 1}" if i else GROUND, (chord / 2 if i else 0.0, 0.0, 0.0), half_turn if i else (1.0, 0.0, 0.0, 0.0))
        after = (f"{i}", (-chord / 2, 0.0, 0.0), back)
        inner, outer = (after, before) if alternate and i % 2 else (before, after)
        elements.append(
            ForceElement(
                name=f"joint {i}", inner=inner[0], outer=outer[0], point_inner=inner[1], point_outer=outer[1],
                axes_inner=inner[2], axes_outer=outer[2],
                translation=(section.stretch / flexible, section.shear / flexible, section.shear / flexible),
                rotation=(section.torsion / flexible, section.about_y / flexible, section.about_z / flexible),
            )
        )  # fmt: skip
    load = Load(body=f"{count - 1}", point=(chord / 2, 0.0, 0.0), force=force, time=FULL)
    return compile_scene(Scene(bodies=tuple(bodies), elements=tuple(elements), loads=(load,)), True)


_ON_EDGE = Section(stretch=1e7, shear=1e7, torsion=0.6, about_y=1e6, about_z=1.0)
"""A strip whose bending about y is as good as rigid, so that nothing but buckling lets the tip move sideways."""


def _sideways(count: int, load: float, alternate: bool) -> tuple[float, float]:
    """Determinant (sign, logarithm) of the stiffness of a loaded straight strip against moving out of its plane."""
    system = space_cantilever(count, 1.0, 0.0, _ON_EDGE, (0.0, 0.0, load), alternate)
    q = equilibrium(system, system.initial()[0], np.array([1.0]))
    matrix = system.linearise(1.0, q, None).stiffness.symmetric().bsr().toarray()
    out_of_plane = np.concatenate([6 * i + np.array([1, 3, 5]) for i in range(count)])
    sign, size = np.linalg.slogdet(matrix[np.ix_(out_of_plane, out_of_plane)])
    return float(sign), float(size)


def lateral_buckling(count: int, alternate: bool = False) -> float:
    """Load P L^2/sqrt(EI GJ) at the tip of a straight strip, along its width, at which the strip buckles laterally."""
    scale = math.sqrt(_ON_EDGE.about_z * _ON_EDGE.torsion)
    at_three = _sideways(count, 3.0 * scale, alternate)[1]

    def determinant(load: float) -> float:
        sign, size = _sideways(count, load * scale, alternate)
        return sign * math.exp(size - at_three)

    return float(brentq(determinant, 3.5, 5.0, xtol=1e-9))


def _first_axis(p: np.ndarray) -> np.ndarray:
    w, x, y, z = p
    return np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
