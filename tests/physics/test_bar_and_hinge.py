"""Sheets of bars and hinges compared with results of independent programs for models of Liu and Paulino (2017)."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from fsm.analyses.choose import analysis_of
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.builders.scene import build_scene
from fsm.builders.sheet.sheet_bars import bar_areas
from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case
from fsm.errors import CaseError
from fsm.results.store import read_solution
from fsm.run.run_case import run_case
from tests.runs import run

KRESLING = Path(__file__).parents[2] / "folding_cases" / "kresling" / "case.toml"
MIURA = """
[sheet]
kind = "miura"
columns = 10
rows = 10
a = 2.0
b = 2.0
sector_angle = "60 deg"
facets = "bars"
bars = { young = 1e4, area = 0.1, law = "ogden" }
bend_stiffness_per_length = 1.0
thickness = "1 mm"
"""
REST = """
[material]
young = 1e4
density = 1000
[crease]
stiffness_per_length = 0.1
[solve]
method = "arc-length"
end_time = "6 s"
"""
RAMP = 'time = { kind = "ramp", end = "1 s", shape = "unbounded" }'


def vertex_of(x: np.ndarray, y: np.ndarray) -> float:
    """Extremum of the parabola through three points."""
    parabola = np.polyfit(x - x[1], y, 2)
    return float(np.polyval(parabola, -0.5 * parabola[1] / parabola[0]))


def test_bending_of_a_miura_sheet(tmp_path: Path) -> None:
    """Load factors at five displacements of a loaded corner."""
    supports = """fold_angle = "54.7356 deg"
    support = [{ at = "vertex 56", fixed = ["x"] }, { at = "vertex 57" }, { at = "vertex 65", fixed = ["x", "z"] }]
    """
    load = "".join(f'[[load]]\nat = "vertex {k}"\nforce = [0, 0, -1]\n{RAMP}\n' for k in (56, 66))
    solution, _ = run(tmp_path, MIURA + supports + REST + load)
    path = solution.load_path
    way, size = path.way[:, 0], path.size[:, 0]
    for at, force in ((0.1, 0.2645), (0.2, 0.6591), (0.3, 1.3043), (0.4, 2.5431), (0.5, 5.816)):
        near = np.argsort(np.abs(way - at))[:4]
        assert np.polyval(np.polyfit(way[near] - at, size[near], 3), 0.0) == pytest.approx(force, rel=1e-3)
    assert (path.negative_modes == 0.0).all()


@pytest.mark.nightly
def test_pop_through_of_a_miura_sheet(tmp_path: Path) -> None:
    """Limit point and snap-back of a sheet that is loaded at its middle."""
    supports = """fold_angle = "30 deg"
    support = [
        { at = "vertex 1" }, { at = "vertices 3, 5, 7, 9, 11", fixed = ["x", "z"] },
        { at = "vertex 111", fixed = ["y", "z"] }, { at = "vertices 113, 115, 117, 119, 121", fixed = ["z"] },
    ]
    """.replace("\n    ", " ")
    load = f'[[load]]\nat = "vertex 61"\nforce = [0, 0, -1]\n{RAMP}\n'
    solution, summary = run(tmp_path, MIURA + supports.replace(" support", "\nsupport") + REST + load)
    first = summary["step"][0]["limit_points"][0]
    assert first["negative_modes"] == 1
    assert first["program_time"] == pytest.approx(2.312, rel=1e-3)
    assert first["loads"]["load on vertex 61"]["displacement"] == pytest.approx(0.941, rel=1e-3)
    way = solution.load_path.way[:, 0]
    k = int(np.flatnonzero(np.diff(way) < 0.0)[0])
    assert way[k] == pytest.approx(1.373, rel=1e-3)
    assert solution.load_path.size[-1, 0] == pytest.approx(6.0)


def test_kresling_tube(tmp_path: Path) -> None:
    """The symmetric path: limit point, barrier, minimum and second stable state."""
    summary = run_case(load_case(KRESLING), tmp_path, progress=False, figures=False)
    high, low = summary["step"][0]["limit_points"][:2]
    top = "load on edge top"
    assert high["loads"][top]["size"] == pytest.approx(8 * 0.43230, rel=1e-3)  # force of eight vertices together
    assert high["loads"][top]["displacement"] == pytest.approx(0.12376, rel=1e-3)
    assert low["loads"][top]["size"] == pytest.approx(-8 * 0.10213, rel=1e-3)
    assert low["loads"][top]["displacement"] == pytest.approx(0.6406, rel=1e-3)
    solution = read_solution(tmp_path / "result.h5")
    assert summary["unstable_equilibria"] == np.count_nonzero(solution.negative_pivots) > 50
    assert not summary["events"]
    assert "equilibria are unstable" in summary["warnings"][0]
    path, stored = solution.load_path, solution.energy["bars"] + solution.energy["creases"]
    way = path.way[:, 0]
    k = int(np.argmax(np.where(way < 0.6, stored, 0.0)))
    assert vertex_of(way[k - 1 : k + 2], stored[k - 1 : k + 2]) == pytest.approx(0.86199, rel=1e-3)
    assert path.negative_modes[k] == 4
    second = np.flatnonzero((way > 0.7) & (path.size[:, 0] > 0.0))[0]
    well = float(np.interp(0.0, path.size[second - 1 : second + 1, 0], way[second - 1 : second + 1]))
    assert well == pytest.approx(0.9525, rel=1e-3)
    energy = np.interp(well, way[second - 1 : second + 1], stored[second - 1 : second + 1])
    assert float(energy) == pytest.approx(0.57946, rel=1e-3)


def test_negative_modes_are_the_negative_eigenvalues(tmp_path: Path) -> None:
    """Count of negative pivots in the factorisation, compared with eigenvalues of the dense stiffness, at states of the
    Kresling tube."""
    loaded = load_case(KRESLING)
    run_case(loaded, tmp_path, progress=False, figures=False)
    solution = read_solution(tmp_path / "result.h5")
    system = analysis_of(loaded.case).system
    path = solution.load_path
    for k in range(0, len(path.time), 10):
        stiffness = system.linearise(float(path.time[k]), solution.q[k], None).stiffness.bsr().toarray()
        values = np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))
        if np.abs(values).min() > 1e-4:
            assert int((values < 0.0).sum()) == path.negative_modes[k]


def case_of(sheet: str, more: str = "") -> Case:
    """Two panels with a crease between them."""
    text = f"""
    [sheet]
    kind = "zigzag"
    columns = 2
    a = 0.1
    b = 0.05
    fold_angle = 0.5
    thickness = 1e-3
    facets = "bars"
    support = [{{ at = "facet 1" }}]
    {sheet}
    [material]
    young = 3e9
    density = 1000
    [crease]
    stiffness_per_length = 0.2
    [solve]
    method = "static"
    {more}
    """
    return Case.model_validate(tomllib.loads(text))


def test_masses_stiffness_and_presets() -> None:
    """Mass of the sheet, springs of creases and bend lines, and areas by the energy of a uniform expansion."""
    case = case_of("", "end_time = 1")
    (truss,) = build_scene(case).trusses
    assert sum(truss.mass) == pytest.approx(1000.0 * 1e-3 * 2 * 0.1 * 0.05)
    assert truss.fold_stiffness[0] == pytest.approx(0.2 * 0.05)
    length = math.hypot(0.1, 0.05)
    assert truss.fold_stiffness[1:] == pytest.approx([3e9 * 1e-9 / (12.0 * (1.0 - 0.3**2)) * (length / 1e-3) ** (1 / 3)] * 2)
    assert truss.fold_rest == pytest.approx([-1.0, 0.0, 0.0]) and truss.bend_lines == 2
    pattern = pattern_of(case.sheet)
    strain = 1e-4
    energy = 0.5 * 3e9 * strain**2 * float(bar_areas(case, pattern) @ pattern.lengths)
    assert energy == pytest.approx(3e9 * strain**2 / (1.0 - 0.3) * 1e-3 * 2 * 0.1 * 0.05)


def test_driven_edge_has_the_force_of_the_held_edge(tmp_path: Path) -> None:
    """A drive of vertices, compared with the closed form of two rigid panels on one crease."""
    text = """
    [sheet]
    kind = "zigzag"
    columns = 2
    a = 0.1
    b = 0.05
    fold_angle = 0.5
    thickness = 1e-3
    facets = "bars"
    bend_stiffness_per_length = 10.0
    support = [{ at = "edge left" }]
    [material]
    young = 3e9
    density = 1000
    [crease]
    stiffness_per_length = 0.02
    [[drive]]
    edge = "right"
    direction = [-1, 0, 0]
    speed = 1e-3
    travel = 0.05
    [solve]
    method = "static"
    """
    solution, summary = run(tmp_path, text)
    travel, force = solution.travel[:, 0], solution.force[:, 0]
    # both panels have the angle p with the base, 2 a cos p is the distance of the edges, and 2 p the fold angle
    angle = np.arccos(np.cos(0.5) - travel / 0.2)
    exact = 0.02 * 0.05 * 2.0 * (angle - 0.5) / (0.1 * np.sin(angle))
    np.testing.assert_allclose(force[1:], exact[1:], rtol=2e-3, atol=1e-6 * exact.max())
    assert summary["unstable_equilibria"] == 0


@pytest.mark.parametrize(
    ("sheet", "more", "message"),
    [
        ("fold_to = 0.5", "", "solve.end_time: missing; the rest angles move until this time"),
        ("", 'end_time = 1\n[[load]]\nat = "vertex 9"\nforce = [1, 0, 0]', "load.0.at: there is no number 9"),
        ("", 'end_time = 1\n[[load]]\nat = "vertex 2"\nmoment = [1, 0, 0]', "load.0.moment: vertices carry no moment"),
        ("", 'end_time = 1\n[[drive]]\nbody = "facet 1"\nspeed = 1\ntravel = 1', "drive.0.body: not available for"),
    ],
)
def test_faults_of_bars(sheet: str, more: str, message: str) -> None:
    with pytest.raises(CaseError) as error:
        build_scene(case_of(sheet, more))
    assert message in str(error.value)


def test_tube_that_snaps_shut_keeps_its_energy(tmp_path: Path) -> None:
    """A tube in motion under more than its limit load falls by nearly its height; facets meet with about 100 times the
    energy that the springs of its creases store in a turn of 1 rad. The tube then vibrates by 1 to 2 % about the equilibrium
    of its second branch (38.03 mm, slow static load)."""
    text = """
    [sheet]
    kind = "kresling"
    sides = 6
    rows = 1
    radius = "40 mm"
    height = "40 mm"
    twist = "45 deg"
    facets = "bars"
    thickness = "0.3 mm"
    bars = { law = "ogden", linear_to = "135 deg" }
    support = [{ at = "edge bottom" }]
    [material]
    young = "3 GPa"
    density = "1000 kg/m^3"
    damping = "1 ms"
    [crease]
    stiffness_per_length = "0.05 N m/rad/m"
    [[load]]
    at = "edge top"
    force = [0, 0, "-80 N"]
    time = { kind = "ramp", end = "0.02 s" }
    [solve]
    rtol = 1e-3
    end_time = "0.05 s"
    error_estimates = "off"
    """
    _, summary = run(tmp_path, text)
    assert summary["energy_error"] < 1e-4
    assert summary["step"][0]["loads"]["load on edge top"]["displacement"] == pytest.approx(0.03803, rel=0.03)
