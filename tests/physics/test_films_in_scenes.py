"""Films and cables joined to rigid bodies: natural frequencies, deflections and energies against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from fsm.case.models.flexible import SceneBeam, SceneCable, SceneFilm, SceneFrame, SceneSeam
from fsm.case.models.loads import Load
from fsm.case.models.materials import LinearCrease
from fsm.case.models.scene import Body, ForceElement, Scene
from fsm.model.compile.compile_joined import compile_model
from fsm.solve.equations.newton import equilibrium
from fsm.solve.modal import modes
from fsm.solve.time.generalized_alpha import GeneralizedAlpha

LENGTH, DIAMETER, YOUNG, DENSITY = 0.3, 2e-3, 2e9, 1200.0
AREA, SECOND = math.pi * DIAMETER**2 / 4.0, math.pi * DIAMETER**4 / 64.0
LINE = DENSITY * AREA * LENGTH
RIGID = (1e8, 1e8, 1e8)
CLAMP = (1e3, 1e3, 1e3)


def weight_on_a_cable(mass: float, elements: int = 8, gravity: float = 0.0) -> Scene:
    """A cable clamped to the ground, with a small heavy body clamped to its end."""
    small = 1e-9 * mass
    bodies = (Body(name="weight", mass=mass, inertia=(small, small, small), position=(LENGTH, 0.0, 0.0)),)
    cable = SceneCable(
        name="rod", start=(0.0, 0.0, 0.0), end=(LENGTH, 0.0, 0.0), diameter=DIAMETER, young=YOUNG, density=DENSITY,
        elements=elements,
    )  # fmt: skip
    frames = tuple(SceneFrame(name=name, on="rod", at=(at,)) for name, at in (("foot", 0.0), ("tip", LENGTH)))
    joints = (
        ForceElement(name="clamp", inner="foot", outer="ground", translation=RIGID, rotation=CLAMP),
        ForceElement(name="weld", inner="weight", outer="tip", translation=RIGID, rotation=CLAMP),
    )
    return Scene(bodies=bodies, cables=(cable,), frames=frames, elements=joints, gravity=(0.0, 0.0, gravity))


def bending_frequency(mass: float) -> float:
    """First frequency (Hz) of a cantilever with a point mass at its tip, by the beam theory of Euler and Bernoulli."""
    ratio = mass / LINE

    def characteristic(x: float) -> float:
        c, s, ch, sh = math.cos(x), math.sin(x), math.cosh(x), math.sinh(x)
        return 1.0 + c * ch + ratio * x * (c * sh - s * ch)

    root = brentq(characteristic, 1e-3, 1.8751041)
    return root**2 / (2.0 * math.pi) * math.sqrt(YOUNG * SECOND / (DENSITY * AREA)) / LENGTH**2


def axial_frequency(mass: float) -> float:
    """First axial frequency (Hz) of a rod with a point mass at its tip."""
    root = brentq(lambda x: x * math.tan(x) - LINE / mass, 1e-3, 0.5 * math.pi - 1e-9)
    return root / (2.0 * math.pi) * math.sqrt(YOUNG / DENSITY) / LENGTH


@pytest.mark.parametrize("mass", [0.001, 0.02])
def test_frequencies_of_a_weight_on_a_cable(mass: float) -> None:
    """Clamps hold slopes by frames: bending and stretching are those of a cantilever."""
    system = compile_model(weight_on_a_cable(mass))
    found = modes(system, 0.0, system.initial()[0], 20).frequencies
    bending, axial = bending_frequency(mass), axial_frequency(mass)
    assert found[0] == pytest.approx(bending, rel=1e-3)
    assert found[1] == pytest.approx(bending, rel=1e-3)
    assert np.abs(found / axial - 1.0).min() < 2e-3


def test_deflection_of_a_heavy_cantilever() -> None:
    """Small deflection: m g L^3/(3 E I) from the weight of the body, and w L^4/(8 E I) from the weight of the rod."""
    mass, gravity = 0.001, -0.05
    system = compile_model(weight_on_a_cable(mass, gravity=gravity))
    q = equilibrium(system, system.initial()[0], np.array([0.0]))
    expected = gravity * LENGTH**3 / (YOUNG * SECOND) * (mass / 3.0 + LINE / 8.0)
    assert q[2] == pytest.approx(expected, rel=2e-3)


def hung_on_a_film(strain: float = 2e-3) -> Scene:
    """A film held at its edges, with a body under its center on a cable."""
    film = SceneFilm(
        name="sail", length=0.3, width=0.3, thickness=5e-5, young=3e9, density=1400.0, mesh=(4, 4),
        strain=(strain, strain), held=("left", "right", "bottom", "top"),
    )  # fmt: skip
    cable = SceneCable(
        name="rope", start=(0.0, 0.0, 0.0), end=(0.0, 0.0, -0.1), diameter=1e-3, young=1e9, density=900.0, elements=2
    )
    frames = (
        SceneFrame(name="center", on="sail", at=(0.0, 0.0)),
        SceneFrame(name="top", on="rope", at=(0.0,), normal=(1.0, 0.0, 0.0)),
        SceneFrame(name="end", on="rope", at=(0.1,), normal=(1.0, 0.0, 0.0)),
    )
    body = Body(name="weight", mass=0.01, inertia=(1e-6, 1e-6, 1e-6), position=(0.0, 0.0, -0.1))
    knot = (1e4, 1e4, 1e4)
    joints = (
        ForceElement(name="knot", inner="top", outer="center", translation=knot),
        ForceElement(name="hook", inner="weight", outer="end", translation=knot),
    )
    return Scene(bodies=(body,), films=(film,), cables=(cable,), frames=frames, elements=joints)


def test_energy_of_a_weight_that_swings_under_a_film() -> None:
    """Constant mean acceleration without dampers: the sum of all energies is constant."""
    scene = hung_on_a_film()
    body = scene.bodies[0].model_copy(update={"velocity": (0.2, 0.0, 0.3)})
    system = compile_model(scene.model_copy(update={"bodies": (body,), "gravity": (0.0, 0.0, -9.81)}))
    q, u = system.initial()
    run = GeneralizedAlpha(system, 0.0, q, u, 1e-6, rho_inf=None, fixed_step=2e-5)
    start = system.energy(0.0, q, u)
    while run.t < 4e-3:
        run.step(4e-3)
    end = system.energy(run.t, run.q, run.u)
    exchanged = sum(abs(end.potential[name] - start.potential[name]) for name in start.potential)
    assert exchanged > 1e-4
    assert abs(end.stored - start.stored) < 1e-3 * exchanged


def test_forces_of_a_seam_balance_the_pull() -> None:
    """A film between held nodes and a plate: the whole force on the plate comes from the seam."""
    film = SceneFilm(
        name="sail", length=0.2, width=0.1, thickness=5e-5, young=3e9, poisson=0.0, density=1400.0, mesh=(4, 3),
        strain=(1e-3, 0.0), held=("left",),
    )  # fmt: skip
    edge = 0.1 * 1.001
    body = Body(name="bar", mass=0.01, inertia=(1e-5, 1e-5, 1e-5), position=(edge, 0.0, 0.0))
    seam = SceneSeam(name="seam", film="sail", edge="right", bodies=("bar",), stiffness=1e9)
    guide = ForceElement(
        name="guide", inner="bar", outer="ground", point_outer=(edge, 0.0, 0.0), translation=(1e3, 1e3, 1e3),
        rotation=(1.0, 1.0, 1.0),
    )  # fmt: skip
    pull = 3e9 * 5e-5 * 0.1 * 2e-3
    load = Load(body="bar", force=(pull, 0.0, 0.0))
    system = compile_model(Scene(bodies=(body,), films=(film,), seams=(seam,), elements=(guide,), loads=(load,)))
    q = equilibrium(system, system.initial()[0], np.array([0.0]))
    moved = q[0] - edge
    # Green's strain e + e^2/2 gives the force E A (e + 3 e^2/2); the guide carries 1e3 N/m times the displacement
    stretch = 1e-3 + moved / 0.2
    force = 3e9 * 5e-5 * 0.1 * (stretch + 1.5 * stretch**2)
    assert force == pytest.approx(pull - 1e3 * moved, rel=1e-3)


WIDTH, THICKNESS = 0.02, 5e-4


def cantilever(angle: float, load: tuple[float, float, float] = (0.0, 0.0, 0.0), elements: int = 6) -> Scene:
    """A beam in the x-z plane, clamped to the ground at an angle (rad), with a force on its end."""
    direction = np.array([math.cos(angle), 0.0, math.sin(angle)])
    beam = SceneBeam(
        name="beam", start=(0.0, 0.0, 0.0), end=tuple((LENGTH * direction).tolist()), width=WIDTH, thickness=THICKNESS,
        young=YOUNG, density=DENSITY, elements=elements,
    )  # fmt: skip
    frames = (SceneFrame(name="foot", on="beam", at=(0.0,)), SceneFrame(name="tip", on="beam", at=(LENGTH,)))
    clamp = ForceElement(name="clamp", inner="foot", outer="ground", translation=RIGID, rotation=CLAMP)
    return Scene(beams=(beam,), frames=frames, elements=(clamp,), loads=(Load(body="tip", force=load),))


@pytest.mark.parametrize("angle", [0.0, 0.9, -2.5])
def test_a_beam_in_a_scene_is_a_cantilever(angle: float) -> None:
    """Deflection F L^3/(3 E I) and the first two frequencies, at any inclination."""
    bending = YOUNG * WIDTH * THICKNESS**3 / 12.0
    force = 1e-4
    normal = np.array([-math.sin(angle), 0.0, math.cos(angle)])
    system = compile_model(cantilever(angle, tuple((force * normal).tolist())))
    start = system.initial()[0]
    poses = [system.place(0.0, q, None)[0][-1, :3] for q in (start, equilibrium(system, start, np.array([0.0])))]
    assert (poses[1] - poses[0]) @ normal == pytest.approx(force * LENGTH**3 / (3.0 * bending), rel=1e-3)
    scale = math.sqrt(bending / (DENSITY * WIDTH * THICKNESS)) / (2.0 * math.pi * LENGTH**2)
    found = modes(system, 0.0, start, 3).frequencies
    assert found[:2] == pytest.approx(np.array([1.8751041, 4.6940911]) ** 2 * scale, rel=2e-3)


def test_a_crease_between_beams_bends_them() -> None:
    """A moment M through a beam, a linear crease and another beam turns the end by M (2 L/(E I) + 1/k)."""
    moment, stiffness = 1e-4, 0.02
    first = cantilever(0.0)
    beam = first.beams[0].model_copy(update={"name": "next", "start": (LENGTH, 0.0, 0.0), "end": (2 * LENGTH, 0.0, 0.0)})
    frames = (SceneFrame(name="begin", on="next", at=(0.0,)), SceneFrame(name="end", on="next", at=(LENGTH,)))
    crease = ForceElement(
        name="crease", inner="begin", outer="tip", translation=RIGID, rotation=(10.0, 0.0, 10.0), kind="crease",
        crease=LinearCrease(stiffness=stiffness, rest_angle=0.0),
    )  # fmt: skip
    scene = first.model_copy(
        update={
            "beams": (*first.beams, beam), "frames": (*first.frames, *frames), "elements": (*first.elements, crease),
            "loads": (Load(body="end", moment=(0.0, moment, 0.0)),),
        }
    )  # fmt: skip
    system = compile_model(scene)
    q = equilibrium(system, system.initial()[0], np.array([0.0]))
    w, _, y, _ = system.place(0.0, q, None)[0][-1, 3:]
    bending = YOUNG * WIDTH * THICKNESS**3 / 12.0
    assert 2.0 * math.atan2(y, w) == pytest.approx(moment * (2.0 * LENGTH / bending + 1.0 / stiffness), rel=2e-3)
