"""Error of a reduced model's restoring force: it must not grow with modes that lie in the plane of the film."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fsm.analyses.reduced import reduced_model, stretch_left_out
from fsm.analyses.stretch import tensioned
from fsm.kernels.programs import half_sine, ramp
from fsm.model.nodes.films.film import FilmMaterial
from fsm.model.nodes.loading import Forcing, Loading, SupportMotion
from fsm.model.nodes.system.build import MeshBuilder
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.modal import modes


def struck(force: float) -> AncfSystem:
    """A square film of 300 mm on 4 x 4 cells, tensioned by a strain of 1e-3, struck in its middle for 1 ms."""
    builder = MeshBuilder()
    lines = np.linspace(0.0, 0.3, 5)
    grid = builder.film(lines, lines, (FilmMaterial(2.5e9, 0.34, 1420.0, 25e-6),))
    edge = grid.edge()
    builder.hold(edge, (2,))
    mesh = builder.build()
    plane = np.concatenate([edge, edge + 1])
    middle = np.where(plane % 9 < 2, 0.15, 0.0)
    motion = SupportMotion(plane, 1e-3 * (mesh.coordinates[plane] - middle), ramp())
    film = tensioned(AncfSystem(mesh, Loading(motions=(motion,))), plane)
    load = np.zeros(film.nq)
    load[int(grid.nearest(0.15, 0.15)) + 2] = force
    return AncfSystem(film.mesh, Loading((Forcing(load, half_sine(1e-3)),)), film.start)


def test_modes_within_the_film_do_not_add_to_the_error() -> None:
    """21 of the 60 modes lie in the plane and do not move in a linear model: the reported error was twice too large."""
    system = struck(0.1)
    found = modes(system, 0.0, system.start, 60)
    model = reduced_model(system, found, False)
    across = np.array([np.abs(s[2::3]).max() > np.abs(s.reshape(-1, 3)[:, :2]).max() for s in found.shapes])
    assert 10 < np.sum(~across) < 30
    alone = replace(model, shapes=model.shapes[across], squared=model.squared[across], damping=model.damping[across])
    wanted = stretch_left_out(system, alone, 0.03)
    assert wanted is not None
    assert 5e-4 < wanted < 5e-3
    assert stretch_left_out(system, model, 0.03) == pytest.approx(wanted, rel=0.05)


def test_it_grows_with_the_square_of_the_displacement() -> None:
    errors = []
    for force in (0.02, 0.04):
        system = struck(force)
        model = reduced_model(system, modes(system, 0.0, system.start, 6), False)
        error = stretch_left_out(system, model, 0.03)
        assert error is not None
        errors.append(error)
    assert errors[1] / errors[0] == pytest.approx(4.0, rel=0.02)


def test_it_is_at_most_the_whole_and_not_told_where_nothing_is_known() -> None:
    """Amplitudes of millimetres in a linear model have a force error of most of the film's force; for metres no estimate is
    given."""
    errors = []
    for force in (5.0, 1e4):
        system = struck(force)
        model = reduced_model(system, modes(system, 0.0, system.start, 6), False)
        errors.append(stretch_left_out(system, model, 0.03))
    assert errors[0] is not None and 0.5 < errors[0] < 1.0
    assert errors[1] is None
