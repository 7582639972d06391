"""ANCF membrane against plates and tensioned membranes; energy; air; agreement of methods."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fsm.analyses.stretch import tensioned
from fsm.kernels.programs import ramp
from fsm.model.nodes.films.air import air_mass
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.loading import Loading, SupportMotion
from fsm.model.nodes.system.build import FilmGrid, MeshBuilder
from fsm.model.nodes.system.reduced import ReducedModel
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.modal import modes
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate

FILM = FilmMaterial(2.5e9, 0.34, 1420.0, 25e-6)
SIDE, STRAIN = 0.3, 1e-3


def stretched(n: int, material: FilmMaterial = FILM, air: float = 0.0) -> tuple[AncfSystem, FilmGrid]:
    """A square film on n x n cells; all edges are moved outwards by the same strain and held there."""
    builder = MeshBuilder()
    lines = np.linspace(0.0, SIDE, n + 1)
    grid = builder.film(lines, lines, (material,), air=air)
    edge = grid.edge()
    builder.hold(edge, (2,))
    mesh = builder.build()
    plane = np.concatenate([edge, edge + 1])
    middle = np.where(plane % 9 < 2, 0.5 * SIDE, 0.0)
    motion = SupportMotion(plane, STRAIN * (mesh.coordinates[plane] - middle), ramp())
    return tensioned(AncfSystem(mesh, Loading(motions=(motion,))), plane), grid


def exact(count: int, material: FilmMaterial = FILM) -> np.ndarray:
    """Frequencies of a stretched plate, hinged all around, in material lengths: the Green strain and N are uniform."""
    tension = material.stretch * (1 + material.poisson) * STRAIN * (1 + 0.5 * STRAIN)
    k = np.array([(i * math.pi / SIDE) ** 2 + (j * math.pi / SIDE) ** 2 for i in range(1, 12) for j in range(1, 12)])
    squared = (material.bending * k**2 / (1 + STRAIN) ** 2 + tension * k) / material.areal_density
    return np.sort(np.sqrt(squared) / (2 * math.pi))[:count]


def test_six_lowest_frequencies_of_a_tensioned_square() -> None:
    errors = {}
    for n in (6, 12):
        system, _ = stretched(n)
        found = modes(system, 0.0, system.start, 6).frequencies
        errors[n] = np.abs(found / exact(6) - 1.0)
    assert errors[12].max() < 2e-5
    order = np.log2(errors[6] / errors[12])
    np.testing.assert_allclose(order, 5.75, atol=0.6)


def test_plate_under_tension() -> None:
    thick = FilmMaterial(2.5e9, 0.34, 1420.0, 2e-3)  # bending contributes a twentieth
    system, _ = stretched(12, thick)
    found = modes(system, 0.0, system.start, 6).frequencies
    without = FilmMaterial(2.5e9, 0.34, 1420.0, 1e-6)
    assert found[0] > 1.02 * exact(1, without)[0]
    np.testing.assert_allclose(found, exact(6, thick), rtol=5e-3)


SUPPORTED = np.array([19.739209, 49.348022, 49.348022, 78.956835])
CLAMPED = np.array([35.985191, 73.393845, 73.393846, 108.216502])


@pytest.mark.parametrize(("clamped", "wanted"), [(False, SUPPORTED), (True, CLAMPED)])
def test_square_plate(clamped: bool, wanted: np.ndarray) -> None:
    """omega a^2 sqrt(rho h/D), nu = 0.3; the element is nonconforming, and the values converge from below at second
    order."""
    material = FilmMaterial(7e10, 0.3, 2700.0, 1e-3)
    errors = []
    for n in (16, 32):
        builder = MeshBuilder()
        lines = np.linspace(0.0, SIDE, n + 1)
        grid = builder.film(lines, lines, (material,))
        builder.hold(grid.edge())
        if clamped:
            builder.hold(np.unique(grid.edge() // 9) * 9 + 3, (2, 5))
        system = AncfSystem(builder.build())
        found = 2 * math.pi * modes(system, 0.0, system.start, 4).frequencies
        rigidity = 7e10 * 1e-3**3 / (12 * (1 - 0.3**2))  # this value does not come from this program
        scaled = found * SIDE**2 * math.sqrt(2700.0 * 1e-3 / rigidity)
        errors.append(scaled / wanted - 1.0)
    assert np.all(errors[1] < 0.0)
    assert np.abs(errors[1]).max() < 0.005
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 2.0, atol=0.1)


def test_air_slows_the_normal_motion_only() -> None:
    vacuum, _ = stretched(8)
    still, _ = stretched(8, air=air_mass(SIDE))
    ratio = air_mass(SIDE) / FILM.areal_density
    assert 6.9 < ratio < 7.0
    for count in (1, 6):
        fast, slow = (modes(s, 0.0, s.start, count).frequencies for s in (vacuum, still))
        np.testing.assert_allclose(slow / fast, 1 / math.sqrt(1 + ratio), rtol=1e-6)
    assert 1 / math.sqrt(1 + ratio) == pytest.approx(0.355, abs=1e-3)
    assert still.full_mass_matrix.diagonal()[0] == pytest.approx(vacuum.full_mass_matrix.diagonal()[0], rel=1e-14)


def plucked(n: int, amplitude: float) -> tuple[AncfSystem, int, float]:
    """A film that passes through its rest position with the velocity of its first mode; height of the centre, and
    frequency."""
    system, grid = stretched(n)
    first = modes(system, 0.0, system.start, 1)
    height = int(grid.nearest(0.5 * SIDE, 0.5 * SIDE)) + 2
    rate = first.shapes[0] / first.shapes[0][height] * amplitude * 2 * math.pi * first.frequencies[0]
    return AncfSystem(system.mesh, None, system.start, rate), height, float(first.frequencies[0])


def crossings(time: np.ndarray, height: np.ndarray) -> float:
    """Frequency from the times at which the height passes upwards through zero."""
    here = np.flatnonzero((height[:-1] < 0.0) & (height[1:] >= 0.0))
    # cubic through four points around each
    roots = []
    for i in here:
        part = slice(max(i - 1, 0), i + 3)
        polynomial = np.polynomial.Polynomial.fit(time[part], height[part], 3)
        inside = [r.real for r in polynomial.roots() if abs(r.imag) < 1e-12 and time[i] <= r.real <= time[i + 1]]
        roots.append(inside[0])
    return (len(roots) - 1) / (roots[-1] - roots[0])


def vibrate(system: AncfSystem, height: int, settings: Settings, every: float) -> tuple[float, float]:
    """Frequency (Hz) and energy error of a run."""
    states: list[SavedState] = []
    _, energy_balance = simulate(system, settings, np.arange(0.0, settings.end_time * (1 + 1e-9), every), states.append)
    times, heights = np.array([s.time for s in states]), np.array([s.q[height] for s in states])
    return crossings(times, heights), energy_balance.relative_error


@pytest.mark.nightly
def test_energy_balance_of_an_undamped_free_vibration() -> None:
    system, _, _ = plucked(4, 2e-4)
    _, energy_balance = simulate(system, Settings("Radau-blocks", 1e-7, 0.2), [0.2], lambda saved: None)
    assert energy_balance.relative_error < 1e-6


def test_frequency_does_not_depend_on_the_method() -> None:
    """The amplitude is 20 thicknesses, where stretch raises the frequency by 2e-3."""
    system, height, linear = plucked(4, 5e-4)
    end, every = 0.05, 2.5e-4
    radau, _ = vibrate(system, height, Settings("Radau-blocks", 1e-5, end), every)
    alpha, _ = vibrate(system, height, Settings("generalized-alpha", 1e-4, end, rho_inf=0.9, step=4e-5), every)
    assert alpha == pytest.approx(radau, rel=1e-3)
    assert radau > 1.0015 * linear
    found = modes(system, 0.0, system.start, 6)
    reduced = ReducedModel.of(system, 0.0, system.start, found.squared, found.shapes, cubic=True)
    response = reduced.respond(end, every / 10, rate=found.shapes @ (system.mass(system.start) @ system.rate))
    lift = reduced.coordinates(response.amplitude)[:, height]
    assert crossings(response.time, lift) == pytest.approx(radau, rel=1e-3)


def test_reduced_model_keeps_its_energy_and_is_exact_when_linear() -> None:
    system, height, frequency = plucked(4, 5e-4)
    found = modes(system, 0.0, system.start, 4)
    rate = found.shapes @ (system.mass(system.start) @ system.rate)
    linear = ReducedModel.of(system, 0.0, system.start, found.squared, found.shapes)
    response = linear.respond(0.1, 1e-3, rate=rate)
    lift = linear.coordinates(response.amplitude)[:, height]
    np.testing.assert_allclose(lift, 5e-4 * np.sin(2 * math.pi * frequency * response.time), atol=1e-9)
    cubic = ReducedModel.of(system, 0.0, system.start, found.squared, found.shapes, cubic=True)
    energy = cubic.energy(cubic.respond(0.2, 2.5e-5, rate=rate))
    np.testing.assert_allclose(energy, energy[0], rtol=1e-4)
    # the potential is that of the full system after relaxation in its plane
    assert np.linalg.norm(cubic.cubic - cubic.cubic.transpose(3, 1, 2, 0)) < 1e-6 * np.linalg.norm(cubic.cubic)
