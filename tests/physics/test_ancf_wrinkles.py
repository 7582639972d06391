"""A film under shear wrinkles; a film pulled at its corners is unstable as a plain film and stable as a tension field."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.analyses.stretch import settled, tensioned
from fsm.kernels.programs import ramp
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.films.wrinkle import strip_wrinkles
from fsm.model.nodes.loading import Forcing, Loading
from fsm.model.nodes.system.build import CableMaterial, MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.nodes.system.tension_state import tension_state
from fsm.solve.equations.newton import negative_pivots
from validation.membrane.strip import FILM, HEIGHT, SHEAR, sheared_strip, wrinkled_strip


@pytest.mark.nightly
def test_sheared_strip_wrinkles_as_the_closed_form_says() -> None:
    """A short strip on coarse cells; validation/membrane has the long strip."""
    closed = strip_wrinkles(HEIGHT, FILM.thickness, FILM.poisson, SHEAR / HEIGHT)
    found = wrinkled_strip(0.128, 0.004, seed=0.8)
    assert found.half_wavelength == pytest.approx(closed.half_wavelength, rel=0.15)
    assert found.tension_field == pytest.approx(found.resolved, rel=0.02)
    assert abs(found.smaller) < 0.02 * found.resolved


def test_tension_field_of_a_sheared_strip() -> None:
    system, _ = sheared_strip(0.256, 0.016, tension_field=True)
    found = settled(system, 1.0, system.initial()[0], tolerance=1e-8)
    state = tension_state(system, 1.0, found.q)
    assert state.wrinkled > 0.9
    assert abs(state.smallest) < 1e-2 * state.largest
    assert negative_pivots(system, 1.0, found.q) == 0
    # the principal stress is that of pure shear, E gamma/2, plus the contribution of the pull
    group = system.mesh.groups[0]
    stress = group.stress(system.place(1.0, found.q, None)[0])
    middle = np.abs(stress.position[..., 0] - 0.128) < 0.03
    assert stress.principal[middle][:, 0].mean() == pytest.approx(0.5 * FILM.young * SHEAR / HEIGHT, rel=0.1)


def corner_pulled(tension: float, tension_field: bool) -> AncfSystem:
    """A square film on four cables along its diagonals, pulled at their ends and held there."""
    film, steel = FilmMaterial(3e9, 0.31, 1420.0, 25e-6), CableMaterial(2e11, 7800.0, 1e-3)
    builder = MeshBuilder()
    lines = np.linspace(0.0, 0.3, 9)
    grid = builder.film(lines, lines, (film,), tension_field=tension_field)
    ends, ways = [], []
    for i in (0, -1):
        for j in (0, -1):
            way = np.array([1.0 if i else -1.0, 1.0 if j else -1.0, 0.0]) / np.sqrt(2.0)
            corner = np.array([lines[i], lines[j], 0.0])
            line = builder.cable(corner + 0.1 * way, corner, steel, 3, end_position=int(grid.position[i, j]))
            ends.append(int(line[0, 0]))
            ways.append(way)
    builder.hold(np.array(ends), (2,))
    builder.hold(ends[0], (0, 1))
    mesh = builder.build()
    pull = np.zeros(len(mesh.coordinates))
    for end, way in zip(ends, ways, strict=True):
        pull[end : end + 3] += tension * way
    system = AncfSystem(mesh, Loading((Forcing(pull, ramp()),)))
    held = (np.array(ends)[:, None] + np.arange(3)).ravel()
    return tensioned(system, held, steps=4, settle=tension_field)


def test_corner_pulled_film() -> None:
    plain, field = corner_pulled(15.0, False), corner_pulled(15.0, True)
    assert negative_pivots(plain, 0.0, plain.start) > 0
    assert tension_state(plain, 0.0, plain.start).smallest < -1e6
    assert negative_pivots(field, 0.0, field.start) == 0
    assert tension_state(field, 0.0, field.start).smallest > -1e5
    # every cable has the same tension, whether its end is held or not
    for system in (plain, field):
        cable = system.mesh.groups[-1]
        np.testing.assert_allclose(cable.tension(system.start), 15.0, rtol=1e-3)
        force = system.reactions(0.0, system.start, None)[:, :3]
        np.testing.assert_allclose(np.linalg.norm(force, axis=1).max(), 15.0, rtol=1e-6)
