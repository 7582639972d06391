"""Folds of rigid panels: the pulled zig-zag, the z-fold on a line, one vertex of a Miura sheet."""

from __future__ import annotations

import math

import numpy as np

from fsm.builders.scene import build_scene
from fsm.case.models.case import Case, Strip
from fsm.case.models.loads import Drive, Load
from fsm.case.models.materials import LinearCrease, Material
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.case.models.time_program import Ramp
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.equations.newton import equilibrium

__all__ = ["CREASE", "FOLD", "PANEL", "TRAVELS", "miura", "miura_closed", "rigid_strip", "static_curve", "strip_force",
           "zfold", "zfold_closed", "zigzag"]  # fmt: skip

PANEL = 0.08
FOLD = math.radians(80.0)
YOUNG, WIDTH, THICKNESS = 3e9, 0.04, 3e-4
CREASE = YOUNG * WIDTH * THICKNESS**3 / 12 / 0.03
TRAVELS = np.linspace(0.005, 0.1, 20)
"""Beyond 100 mm the symmetric path is unstable in the plane and a static step may leave it."""


def zigzag(
    h: np.ndarray | float, a: float, D: float, k: tuple[float, float, float], phi: tuple[float, float, float]
) -> np.ndarray:
    """Closed form of the pull force of rigid panels, N; validation/references.md.

    Crease 2 is the joint of two bars of length a between crease 1 (fixed) and crease 3 (pulled, at the height h above crease
    1 and the distance D beside it).
    """
    h = np.asarray(h, dtype=float)
    R = np.hypot(D, h)
    gamma, beta, chi = np.arctan2(h, D), np.arccos(R / (2 * a)), 2 * np.arcsin(R / (2 * a))
    root = R * np.sqrt(4 * a * a - R * R)
    d_gamma, d_beta, d_chi = D / R**2, -h / root, 2 * h / root
    return np.asarray(
        2 * k[0] * (gamma - beta - phi[0]) * (d_gamma - d_beta)
        + 2 * k[1] * (chi - phi[1]) * d_chi
        + 2 * k[2] * (2 * (gamma + beta) - phi[2]) * (d_gamma + d_beta)
    )


def strip_force(travel: np.ndarray, crease: float = CREASE) -> np.ndarray:
    """Closed form of the trial strip without moments as folded: phi1 = -theta, phi2 = pi - 2 theta, phi3 = 2 theta."""
    phi = (-FOLD, math.pi - 2 * FOLD, 2 * FOLD)
    return zigzag(travel, PANEL, 2 * PANEL * math.cos(FOLD), (crease,) * 3, phi)


def rigid_strip(
    speed: float = 2e-3, damping: float = 1e-3, stiffen: float = 1.0, crease: float = CREASE, segments: int = 1
) -> SegmentSystem:
    """Strip of six panels, which are rigid with one segment each; springs of stretch and shear are `stiffen` times as stiff
    as those of the strip."""
    case = Case(
        strip=Strip(
            length=6 * PANEL, width=WIDTH, thickness=THICKNESS, panels=6, fold_angle=FOLD, segments_per_panel=segments,
            half_cell=segments > 1,
        ),
        material=Material(young=YOUNG, density=800, damping=damping),
        crease=LinearCrease(stiffness=crease),
        drive=(Drive(crease=3, speed=speed, travel=float(TRAVELS[-1])),),
    )  # fmt: skip
    return compile_scene(stiffened(build_scene(case), stiffen))


def stiffened(scene: Scene, factor: float) -> Scene:
    """Scene in which the stiffness of all translational springs is multiplied by a factor."""
    elements = tuple(
        e.model_copy(
            update={
                "translation": tuple(factor * k for k in e.translation),
                "translation_damping": tuple(factor * c for c in e.translation_damping),
            }
        )
        for e in scene.elements
    )
    return scene.model_copy(update={"elements": elements})


def static_curve(system: SegmentSystem, travels: np.ndarray = TRAVELS) -> np.ndarray:
    """Static pull force at these travels, N."""
    forces: list[float] = []
    times = [system.motions[0].time_of(x) for x in np.concatenate([[0.0], travels])]
    equilibrium(
        system,
        system.initial()[0],
        np.array(times),
        on_state=lambda t, q: forces.append(float(system.observe(t, q, None).drive.force[0])),
    )
    return np.array(forces[1:])


def zfold_closed(half: np.ndarray, rest: float, n: int, a: float, k: float) -> np.ndarray:
    """F = (n - 1) 2 k (2 th - 2 th0)/(n a cos th), N; th is half the angle between panels."""
    return np.asarray((n - 1) * 2 * k * (2 * half - 2 * rest) / (n * a * np.cos(half)))


def zfold(n: int, a: float, k: float, rest: float, forces: np.ndarray) -> np.ndarray:
    """Half angles th (rad) of a z-fold of n rigid panels that these forces (N) pull along x; the centres stay on the line.

    Panel i makes the angle +-(90 deg - th) with the line; its ends are at x = +-a/2 in its own axes.
    """
    stiff, bodies, elements = 1e8, [], []
    for i in range(n):
        tilt = (math.pi / 2 - rest) * (1 if i % 2 == 0 else -1)  # about -y: + rises along x
        bodies.append(
            Body(
                name=f"{i}", mass=1e-3, inertia=(1e-6,) * 3, position=((i + 0.5) * a * math.sin(rest), 0.0, 0.0),
                orientation=(math.cos(tilt / 2), 0.0, -math.sin(tilt / 2), 0.0),
            )
        )  # fmt: skip
        elements.append(ForceElement(name=f"rail {i}", inner=f"{i}", outer=GROUND, translation=(0.0, 0.0, stiff)))
        if i:
            turn = -2.0 * tilt
            elements.append(
                ForceElement(
                    name=f"crease {i}", inner=f"{i - 1}", outer=f"{i}", point_inner=(a / 2, 0.0, 0.0),
                    point_outer=(-a / 2, 0.0, 0.0), translation=(stiff,) * 3, rotation=(0.0, k, 0.0),
                    rest_angle=-turn, initial_angle=-turn,
                )
            )  # fmt: skip
    elements.append(
        ForceElement(name="end", inner="0", outer=GROUND, point_inner=(-a / 2, 0.0, 0.0), translation=(stiff, 0.0, 0.0))
    )
    found = []
    last = np.array([])
    for force in forces:
        load = Load(body=f"{n - 1}", point=(a / 2, 0.0, 0.0), force=(force, 0.0, 0.0), time=Ramp(kind="ramp", end=1.0))
        system = compile_scene(Scene(bodies=tuple(bodies), elements=tuple(elements), loads=(load,)), False)
        last = equilibrium(system, system.initial()[0], np.linspace(0.0, 1.0, 21))
        found.append(math.pi / 2 - float(np.abs(last.reshape(n, 3)[n // 2, 2])))
    return np.array(found)


def miura_closed(a: float, b: float, gamma: float, theta: float) -> tuple[float, float, float, float]:
    """H, S, L, V of a Miura unit (Schenk and Guest 2013, PNAS 110, 3276): height, width, length, offset."""
    t = math.cos(theta) * math.tan(gamma)
    root = math.sqrt(1 + t * t)
    height, length = a * math.sin(theta) * math.sin(gamma), a * math.sqrt(1 - (math.sin(theta) * math.sin(gamma)) ** 2)
    return height, b * t / root, length, b / root


def miura(a: float, b: float, gamma: float, start: float, moment: float) -> tuple[np.ndarray, np.ndarray]:
    """Angles theta (n,), rad, and H, S, L, V (n, 4) of four rigid plates joined by hinges, folded by a couple from `start`.

    Plates are parallelograms with sides a, b and the angle gamma; hinges are creases of 1 N mm/rad between stiff springs.
    theta is half the angle between the normals of two plates; sizes are measured between corners.
    """
    height, width, length, offset = miura_closed(a, b, gamma, start)
    corners = {
        (i, j): np.array([i * length + offset * (j % 2), j * width, height * (i % 2)]) for i in range(3) for j in range(3)
    }
    centres, frames, bodies = {}, {}, []
    for i, j in FACES:
        centre = 0.25 * sum((corners[i + di, j + dj] for di in (0, 1) for dj in (0, 1)), np.zeros(3))
        first = (corners[i + 1, j] - corners[i, j]) / a
        normal = np.cross(first, corners[i, j + 1] - corners[i, j])
        normal /= np.linalg.norm(normal)
        frames[i, j], centres[i, j] = np.column_stack([first, np.cross(normal, first), normal]), centre
        bodies.append(
            Body(
                name=f"{i}{j}", mass=1e-3, inertia=(1e-5,) * 3, position=_tuple(centre), held=(i, j) == (0, 0),
                orientation=_quaternion(frames[i, j]),
            )
        )  # fmt: skip
    elements = []
    for one, two, ends in (
        ((0, 0), (1, 0), ((1, 0), (1, 1))), ((0, 1), (1, 1), ((1, 1), (1, 2))),
        ((0, 0), (0, 1), ((0, 1), (1, 1))), ((1, 0), (1, 1), ((1, 1), (2, 1))),
    ):  # fmt: skip
        along = corners[ends[1]] - corners[ends[0]]
        along /= np.linalg.norm(along)
        across = np.cross(along, frames[two][:, 2])
        joint = np.column_stack([across, along, np.cross(across, along)])
        middle = 0.5 * (corners[ends[0]] + corners[ends[1]])
        places = [(_tuple(frames[f].T @ (middle - centres[f])), _quaternion(frames[f].T @ joint)) for f in (one, two)]
        elements.append(
            ForceElement(
                name=f"hinge {one} {two}", inner=f"{one[0]}{one[1]}", outer=f"{two[0]}{two[1]}", point_inner=places[0][0],
                point_outer=places[1][0], axes_inner=places[0][1], axes_outer=places[1][1], translation=(1e6,) * 3,
                rotation=(1e3, 1e-3, 1e3),
            )
        )  # fmt: skip
    fixed = (corners[1, 1] - corners[1, 0]) / b  # the crease between the held plate and the rotated plate
    load = Load(body="10", moment=_tuple(moment * fixed), time=Ramp(kind="ramp", end=1.0))
    system = compile_scene(Scene(bodies=tuple(bodies), elements=tuple(elements), loads=(load,)), True)
    angles: list[float] = []
    sizes: list[list[float]] = []

    def measure(t: float, q: np.ndarray) -> None:
        turned, moved = dict(frames), dict(centres)
        for face, pose in zip(FACES[1:], q.reshape(3, 7), strict=True):
            turned[face], moved[face] = _matrix(pose[3:]), pose[:3]

        def at(face: tuple[int, int], corner: tuple[int, int]) -> np.ndarray:
            return moved[face] + turned[face] @ frames[face].T @ (corners[corner] - centres[face])

        bend = at((0, 0), (1, 0)) - 0.5 * (at((0, 0), (0, 0)) + at((1, 0), (2, 0)))
        aside = at((0, 0), (0, 1)) - 0.5 * (at((0, 0), (0, 0)) + at((0, 1), (0, 2)))
        long = at((1, 0), (2, 0)) - at((0, 0), (0, 0))
        wide = at((0, 1), (0, 2)) - at((0, 0), (0, 0))
        angles.append(0.5 * math.acos(float(np.clip(turned[0, 0][:, 2] @ turned[1, 0][:, 2], -1.0, 1.0))))
        sizes.append([float(np.linalg.norm(x)) for x in (bend, 0.5 * wide, 0.5 * long, aside)])

    equilibrium(system, system.initial()[0], np.linspace(0.0, 1.0, 61), on_state=measure)
    return np.array(angles), np.array(sizes)


FACES = ((0, 0), (1, 0), (0, 1), (1, 1))


def _tuple(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in vector)
    return x, y, z


def _quaternion(matrix: np.ndarray) -> tuple[float, float, float, float]:
    from scipy.spatial.transform import Rotation

    x, y, z, w = (float(v) for v in Rotation.from_matrix(matrix).as_quat())
    return w, x, y, z


def _matrix(p: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(np.roll(p, -1)).as_matrix())
