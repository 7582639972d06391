"""Failures that the stress campaign found, each reduced to a small scene."""

from __future__ import annotations

import copy
import time
from typing import Any

import numpy as np
import pytest

from fsm.analyses.at_start import equilibrium_at_start
from fsm.analyses.choose import analysis_of
from fsm.analyses.film import build_film
from fsm.analyses.natural import natural_modes
from fsm.analyses.stretch import stretched
from fsm.errors import CaseError, NotConverged
from fsm.model.nodes.loading import Loading
from fsm.results.solution import Solution
from fsm.solve.equations.newton import negative_pivots
from fsm.solve.modal import modes
from fsm.solve.outcome.run_io import InitialState, OutputRequest, Statistics
from fsm.solve.statics.path_recorder import PathRecorder
from fsm.solve.time import scipy_ivp
from validation.stress.attempt import attempt
from validation.stress.campaign import examine
from validation.stress.scenes import draw, loaded

LATTICE: dict[str, Any] = {
    "lattice": {
        "columns": 1, "rows": 3, "spacing": 0.01, "hinge_length": 0.001, "angle": 0.3, "axial": 1e3, "shear": 1e2,
        "rotational": 1e-3, "depth": 0.01, "density": 1e3,
    },
    "drive": [{"edge": "top", "direction": [0, 0, 1], "speed": 1e-6, "travel": 1e-4}],
    "solve": {"method": "static", "rtol": 1e-6},
    "save": {"every": 1e-5},
}  # fmt: skip


def solved(tables: dict[str, Any]) -> Solution:
    found = attempt(tables, 20.0)
    assert found.solution is not None, found.what
    return found.solution


def test_static_forces_do_not_depend_on_the_speed() -> None:
    """A fast drive of heavy squares: in statics no square has inertia, not even the driven ones.

    The reaction and the work contained the inertia of the run-up, so the energy balance was off by all supplied work.
    """
    fast = copy.deepcopy(LATTICE)
    fast["drive"][0]["speed"] = 1.0
    slow_result, fast_result = solved(LATTICE), solved(fast)
    assert fast_result.summary["energy_error"] < 1e-3
    np.testing.assert_allclose(fast_result.force, slow_result.force, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(fast_result.energy["work"], slow_result.energy["work"], rtol=1e-6, atol=1e-15)


def test_inertia_of_what_is_driven_counts_in_motion() -> None:
    """In dynamics it does: at the start of a run-up the force is mass times acceleration."""
    moving = copy.deepcopy(LATTICE)
    moving["drive"][0] |= {"speed": 1.0, "run_up": 1e-4}
    moving["solve"] = {"method": "generalized-alpha", "rtol": 1e-6}
    system = analysis_of(loaded(moving, "scene").case).system
    q, u = system.initial()
    t = 1e-7
    speed_up = 1.0 * 6.0 * (t / 2e-4) * (1.0 - t / 2e-4) / 2e-4
    mass = 1e3 * 0.01 * _side(LATTICE) ** 2
    assert system.observe(t, q, u).drive.force[0] == pytest.approx(mass * speed_up, rel=1e-2)
    assert abs(system.observe(t, q, None).drive.force[0]) < 1e-3 * mass * speed_up


def _side(tables: dict[str, Any]) -> float:
    """Side of a square whose corner is half a hinge short of the one beside it."""
    lattice = tables["lattice"]
    half_diagonal = (lattice["spacing"] - lattice["hinge_length"]) / (2.0 * np.cos(lattice["angle"]))
    return float(np.sqrt(2.0) * half_diagonal)


def test_a_slide_takes_no_energy_from_nowhere() -> None:
    """The drive advances a little during a slide; its work was omitted, and the dissipated energy decreased by as much.

    A slide between equilibria of a smooth path: all supplied work is stored.
    """
    result = solved(LATTICE)
    system = analysis_of(loaded(LATTICE, "scene").case).system
    t, q = result.time[5], result.q[5]
    wanted, beginning = OutputRequest([], lambda saved: None, None), InitialState(None, None, [], None)
    recorder = PathRecorder(system, Statistics("static"), wanted, beginning, t, q, np.zeros(system.nu))
    recorder.slide(result.time[6], result.q[6], system.observe(result.time[6], result.q[6], None))
    stored = system.energy(result.time[6], result.q[6], None).stored_at_rest - system.energy(t, q, None).stored_at_rest
    assert stored > 0.0
    assert recorder.energy_balance.work == pytest.approx(stored, rel=1e-2)
    assert abs(recorder.energy_balance.dissipated) < 1e-2 * stored
    assert abs(recorder.energy_balance.error) < 1e-8 * stored


@pytest.mark.parametrize("method", ["Radau", "BDF", "LSODA"])
def test_saved_quaternions_are_unit(method: str) -> None:
    """A spinning body in space; SciPy's methods let the norm of its quaternion grow by 1e-3, but the saved norm is one."""
    body = {
        "name": "top", "mass": 1.0, "inertia": [1.0, 0.7, 0.5], "angular_velocity": [3.0, 20.0, 1.0],
        "plate": {"length": 0.1, "width": 0.1, "thickness": 0.01},
    }  # fmt: skip
    tables = {
        "scene": {"bodies": [body]}, "solve": {"method": method, "rtol": 1e-2, "end_time": 1.0}, "save": {"interval": 0.05},
    }  # fmt: skip
    length = np.linalg.norm(solved(tables).q[:, 3:], axis=1)
    np.testing.assert_allclose(length, 1.0, rtol=0.0, atol=1e-14)


def test_a_scene_in_which_nothing_is_free_is_refused() -> None:
    """Two rows, one held and one driven: no coordinate was free, and an inaccurate energy balance ended in a traceback."""
    rows = copy.deepcopy(LATTICE)
    rows["lattice"]["rows"] = 2
    with pytest.raises(CaseError, match="lattice: all bodies are held or driven, so the system has no degree of freedom"):
        analysis_of(loaded(rows, "scene").case)


@pytest.mark.parametrize("method", ["generalized-alpha", "Radau-blocks"])
def test_what_drives_heavy_bodies_is_balanced(method: str) -> None:
    """A fast drive of heavy squares: in few steps, nearly all supplied work becomes kinetic energy of the driven squares.

    Their kinetic energy was integrated with the other work, at steps chosen for the free squares, so the balance was off by
    a third. When the drive stops, this energy is removed again.
    """
    fast = copy.deepcopy(LATTICE)
    fast["drive"][0]["speed"] = 100.0
    fast["solve"] = {"method": method, "rtol": 1e-3, "end_time": 1.5e-6}
    fast["save"] = {"interval": 1e-7}
    result = solved(fast)
    assert result.summary["energy_error"] < 1e-2
    going = result.travel[:, 0] < 0.99e-4
    mass = 1e3 * 0.01 * _side(LATTICE) ** 2
    assert result.energy["kinetic"][going][-1] > 0.5 * mass * 100.0**2
    assert result.energy["kinetic"][-1] < 0.1 * mass * 100.0**2


def test_lsoda_is_refused_a_matrix_of_gigabytes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A strip of thousands of segments in contact has no band structure; the solver requested 24 GB and ended with a
    traceback."""
    system = analysis_of(loaded(LATTICE, "scene").case).system
    equations = scipy_ivp.FirstOrder(system)
    y = equations.initial()
    scipy_ivp.make_solver("LSODA", equations, 0.0, y, 1.0, 1e-4, np.inf)
    monkeypatch.setattr(scipy_ivp, "_LARGEST", len(y))
    with pytest.raises(NotConverged, match=f"GB for these {len(y)} states; take method"):
        scipy_ivp.make_solver("LSODA", equations, 0.0, y, 1.0, 1e-4, np.inf)


@pytest.mark.nightly
@pytest.mark.parametrize("number", [2489, 3793])
def test_a_reduced_model_of_too_few_modes_tells_its_error(number: int) -> None:
    """Films struck hard or near a corner, solved with few modes: the error is about the whole amplitude, and a warning says
    so."""
    drawn = draw(5, number)
    summary = solved(drawn.tables).summary
    (said,) = [line for line in summary["warnings"] if line.startswith("reduced model: ")]
    assert summary["reduced_error_struck"] > 0.5
    assert "at the impact" in said and 'increase vibration.modes, or set vibration.model = "full"' in said
    line = examine(drawn, 20.0)
    assert (line["class"], line["second"]) == ("warned", "differs")


def test_overdamped_modes_creep_back() -> None:
    """Film 3793 has air damping of 128 1/s and slow modes: they returned at the rate of critical damping, a hundred times
    too fast.

    With nearly all modes the reduced model equals the full model, and there is no warning. (Its 49 ms hold half a period; a
    warning says so.)
    """
    tables = copy.deepcopy(draw(5, 3793).tables)
    tables["vibration"]["modes"] = 150
    summary = solved(tables).summary
    assert summary["reduced_error"] < 0.02
    assert summary["reduced_error_struck"] < 0.02
    assert not any("reduced model" in line for line in summary["warnings"])


def test_modes_are_the_film_s_own() -> None:
    """Film 2489 has 108 free coordinates: the placeholders of held coordinates occurred dozens of times among its modes."""
    tables = copy.deepcopy(draw(5, 2489).tables)
    tables["vibration"]["modes"] = 150
    del tables["impact"]
    frequencies = solved(tables).summary["modes_hz"]
    assert len(frequencies) == 108
    assert np.diff(frequencies).min() > 1e-6 * frequencies[-1]


def test_modes_of_a_nearly_slack_film_are_found_soon() -> None:
    """Film 477: Lanczos' method needed thousands of restarts, 8 s for three modes; with a larger space it needs none."""
    case = loaded(draw(5, 477).tables, "scene").case
    system = stretched(case, build_film(case), Loading())
    q, _ = system.initial()
    natural_modes(system, q, 1)
    begun = time.thread_time()
    found = natural_modes(system, q, 3)
    assert time.thread_time() - begun < 2.0
    dense = modes(system, 0.0, q, system.nu)
    assert found.frequencies == pytest.approx(dense.frequencies[:3], rel=1e-5)


def test_a_reduced_model_that_flies_off_is_told_as_one() -> None:
    """Film 4437, far beyond the range of its cubic terms: the comparison with the full model ended in a traceback."""
    tables = draw(1, 4437).tables
    tables["impact"]["force"] *= 10.0
    found = attempt(tables, 20.0)
    assert found.solution is None
    assert "left the range of its cubic terms" in found.what


@pytest.mark.parametrize(
    ("number", "unstable"),
    [
        pytest.param(388, 6, id="strip in space that stays in its plane"),
        pytest.param(50, 0, id="strip of 28 m on creases of 1e-8 N m/rad"),
        pytest.param(173, 0, id="strip that swings open"),
    ],
)
def test_the_start_of_a_strip_is_stable(number: int, unstable: int) -> None:
    """The path leaves a saddle along its softest mode; curvatures and gains below round-off are ignored."""
    analysis = analysis_of(loaded(draw(1, number).tables, "scene").case, "scene", [])
    q, _ = analysis.system.initial()
    found = equilibrium_at_start(analysis.system, q)
    size = analysis.system.scales().increment
    linear = analysis.system.linearise(0.0, found, None)
    curvatures = np.linalg.eigvalsh(linear.stiffness.symmetric().bsr().toarray() * size * size[:, None])
    assert curvatures[0] > -1e-14 * curvatures[-1]
    assert negative_pivots(analysis.system, 0.0, q) >= unstable
    if number == 50:  # the folded state is this equilibrium
        assert np.abs(analysis.system.difference(q, found) / size).max() < 1e-9


def test_a_pressed_patch_of_a_flat_film_buckles() -> None:
    """By symmetry no force acts along the mode, and the energy falls only within a thousandth of an element."""
    found = solved(draw(1, 58).tables)
    assert np.abs(found.shape[0, ..., 2]).max() > 1e-6
