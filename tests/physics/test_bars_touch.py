"""Sheets of bars: contact of their facets with each other, and tubes that open by their gas or are pushed together."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import fsm
from fsm.builders.patterns.generators import kresling, miura_tube
from fsm.case.pattern_files.pattern import Pattern
from fsm.model.compile.compile_case import compile_case
from fsm.results.quantities import contact_rows
from fsm.results.solution import Solution
from fsm.results.store import read_solution

A, B, SECTOR = 0.04, 0.06, math.radians(70.0)
COLUMNS = 3


def tube(fold: float, **more: Any) -> dict[str, Any]:
    """Miura tube of bars, held at its left ring."""
    sheet = {
        "kind": "miura-tube", "columns": COLUMNS, "a": A, "b": B, "sector_angle": SECTOR, "fold_angle": fold,
        "facets": "bars", "thickness": 2e-4,
        "support": [{"at": "vertices 1, 3", "fixed": ["x", "z"]}, {"at": "vertex 1", "fixed": ["y"]},
                    {"at": "vertices 2, 4", "fixed": ["x"]}],
    }  # fmt: skip
    return {
        "sheet": sheet, "material": {"young": 3e9, "poisson": 0.3, "density": 1400.0, "damping": "5 ms"},
        "crease": {"stiffness_per_length": 0.01}, "solve": {"method": "static"},
    } | more  # fmt: skip


CONTACT = {"contact": {"law": "linear", "stiffness": "1e4 N/m", "ramp": "1 nm"}}


def run(data: dict[str, Any], folder: Path) -> tuple[dict[str, Any], Solution]:
    result = fsm.load(data, folder=folder).run(folder / "out", figures=False)
    return result.summary, read_solution(folder / "out" / "result.h5")


def rings(solution: Solution) -> np.ndarray:
    """Mean x of each ring in each record, (n, columns + 1), m."""
    count = 4 * (COLUMNS + 1)
    return np.asarray(solution.q[:, -3 * count :].reshape(-1, COLUMNS + 1, 4, 3)[..., 0].mean(axis=2))


@pytest.mark.parametrize("friction", [False, True])
def test_the_tangent_is_that_of_the_force(friction: bool) -> None:
    """Columns are shifted into each other, and vertices by random amounts."""
    more = {"friction": {"law": "tanh", "mu_dynamic": 0.4, "v_static": "10 mm/s"}} if friction else {}
    _, system = compile_case(fsm.load(tube(1.55, **CONTACT, **more) | {"solve": {"end_time": 1.0}}).model)
    q, u = system.initial()
    random = np.random.default_rng(3)
    system.commit(0.0, q, u)
    nodes = q[-system.elements.nq :].reshape(-1, 4, 3)
    nodes[1:, :, 0] *= np.array([0.3, 0.15, 0.1])[:, None]
    nodes += random.normal(scale=2e-5, size=nodes.shape)
    assert len(system.contacts[0].geometry.find(system.place(0.0, q, u)[0], 0.0).slot) > 10
    free = ~system._fixed.ravel()
    u = random.normal(scale=0.01, size=len(u)) * free
    stiffness, damping = system.tangent(0.0, q, u)
    for _ in range(3):
        v = random.normal(size=system.nu) * free
        for matrix, step, ahead, back in (
            (stiffness, 1e-8, *(system.force(0.0, system.retract(q, s * 1e-8 * v), u) for s in (1.0, -1.0))),
            (damping, 1e-6, *(system.force(0.0, q, u + s * 1e-6 * v) for s in (1.0, -1.0))),
        ):
            exact, measured = matrix @ v, (back - ahead) / (2.0 * step)
            np.testing.assert_allclose(exact[free], measured[free], atol=2e-6 * np.abs(exact[free]).max(), rtol=0)


@pytest.mark.parametrize("touch", [True, False])
def test_columns_of_a_tube_that_is_pushed_together(touch: bool, tmp_path: Path) -> None:
    """With contact the rings stay in their order; without it they pass through each other."""
    length = float(miura_tube(COLUMNS, A, B, SECTOR, 1.51).vertices[-1, 0])
    push = {"edge": "right", "direction": [-1, 0, 0], "guide": False, "speed": "1 mm/s", "travel": 0.98 * length}
    save = {"every": "1 mm"} | ({"channels": ["contact.facets.force"]} if touch else {})
    summary, solution = run(tube(1.51, drive=[push], save=save) | (CONTACT if touch else {}), tmp_path)
    gaps = np.diff(rings(solution), axis=1)
    if touch:
        assert summary["contact"][0]["largest_force"] > 0.01
        on_facets = solution.channels["contact.facets.force"].values.sum(axis=1)
        np.testing.assert_allclose(on_facets, 2.0 * solution.pair_force[:, 0], rtol=1e-12)
        names, force, _ = contact_rows(solution)
        assert len(names) == len(set(names)) > 4 and force.shape == (len(solution), len(names))
    assert (gaps.min() > -2e-4) == touch


def fold_energy(fold: float, rest: Pattern) -> float:
    """Energy of the creases, J."""
    at = miura_tube(COLUMNS, A, B, SECTOR, fold)
    turned = at.fold_angles() - rest.fold_angles()
    inside = [letter != "B" for letter in at.assignment]
    return float(0.5 * 0.01 * (rest.lengths * turned**2)[inside].sum())


def test_a_tube_that_is_filled_with_gas(tmp_path: Path) -> None:
    """The work of the gas on stiff facets is the energy of the creases: (p - p0) V' = U' along the fold angle."""
    start, lids = 1.5, [{"cap": "edge left"}, {"cap": "edge right"}]
    rest = miura_tube(COLUMNS, A, B, SECTOR, start)
    size = COLUMNS * A * A * B * math.sin(SECTOR) ** 2
    gas = {"closed_by": lids, "outside_pressure": 1e5, "supply_mass": 0.7 * size * 1e5 / (287.06 * 293.15)}
    solve, save = {"method": "static", "end_time": "1 s", "max_step": 0.01}, {"interval": 0.1, "channels": ["gas.*"]}
    data = tube(start, gas=[gas], solve=solve, save=save)
    data["sheet"] |= {"bars": {"young": 3e12}, "bend_stiffness_per_length": 10.0}
    data["material"]["damping"] = 0
    result = fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False)
    assert result.summary["energy_error"] < 1e-4
    pressure, volume = (np.asarray(result[f"gas.gas.{name}"].values) for name in ("pressure", "volume"))
    assert volume[0] == pytest.approx(size * math.sin(2.0 * start), rel=1e-9)
    folds = math.pi / 2.0 - 0.5 * np.arcsin(volume[1:] / size)
    assert folds[-1] < 1.2
    along = np.linspace(1.0, 1.51, 200)
    slope = CubicSpline(along, [fold_energy(fold, rest) for fold in along])(folds, 1)
    exact = slope / (2.0 * size * np.cos(2.0 * folds))
    np.testing.assert_allclose(pressure[1:] - 1e5, exact, rtol=1e-3)


def test_both_flat_states_of_a_tapered_kresling_tube() -> None:
    """If the sum of the twists is 180 - 360/sides degrees, both heights have edges of equal lengths, and therefore no
    strain."""
    sides, taper, low, twist = 12, 0.85, 0.005, math.radians(90.0)
    other = math.pi - 2.0 * math.pi / sides - twist
    high = math.sqrt(low**2 + 2.0 * taper * 0.1**2 * (math.cos(other) - math.cos(twist)))
    flat, deployed = (kresling(sides, 5, 0.1, *state, taper) for state in ((low, twist), (high, other)))
    np.testing.assert_allclose(flat.lengths, deployed.lengths, rtol=1e-12)
    assert np.ptp(deployed.vertices[:, 2]) == pytest.approx(high * (1.0 - taper**5) / (1.0 - taper))


CASES = Path(fsm.__file__).parents[1] / "folding_cases"


@pytest.mark.nightly
def test_a_shorter_tube_is_packed_and_pulled(tmp_path: Path) -> None:
    """Two columns of the shipped tube: facets touch in the packed state, and pulling opens all of them again."""
    case = fsm.load(CASES / "z_tube" / "case.toml").set({"sheet.columns": 2, "save.interval": "40 s"})
    travel = ["0 mm", "-5.2 mm", "90 mm"]
    case = case.set("drive.0.time", {"kind": "table", "time": [0, 200, 1200], "travel": travel})
    result = case.run(tmp_path, figures=False)
    touching = (result["contact.facets.force"].values > 0.0).sum(axis=1)
    assert touching[5] >= 12 and touching[-1] == 0  # packed at 200 s
    assert result.summary["peak_force"] > 0.1 and result.summary["energy_error"] < 1e-4


def test_a_shorter_tube_is_inflated(tmp_path: Path) -> None:
    """Two columns of the shipped tube open nearly to the largest volume without packing."""
    case = fsm.load(CASES / "z_tube" / "gas.toml").set({"sheet.columns": 2, "save.interval": "40 s", "load": None})
    result = case.set("save.channels", ["gas.*", "body.vertex 9.position"]).run(tmp_path, figures=False)
    longest = 2.0 * miura_tube(1, A, B, SECTOR, math.pi / 4.0).vertices[-1, 0]
    assert 0.9 * longest < result["body.vertex 9.position"].values[-1, 0] < longest
    largest = 2.0 * A * A * B * math.sin(SECTOR) ** 2
    assert result["gas.air.volume"].values[-1] == pytest.approx(largest, rel=0.01)
    assert result.summary["energy_error"] < 1e-4


@pytest.mark.nightly
def test_a_single_pleat_of_the_cone(tmp_path: Path) -> None:
    """It is pressed flat until all facets touch, and is then pulled to its second state without strain."""
    case = fsm.load(CASES / "pleated_cone" / "case.toml").set({"sheet.rows": 1, "save.interval": "40 s"})
    travel = ["0 mm", "-4.8 mm", "87.33 mm"]  # facets touch at a height near their thickness, 0.2 mm
    case = case.set("drive.0.time", {"kind": "table", "time": [0, 400, 2400], "travel": travel})
    result = case.run(tmp_path, figures=False)
    touching = (result["contact.facets.force"].values > 0.0).sum(axis=1)
    assert touching.max() == 24 and touching[-1] == 0
    solution = read_solution(tmp_path / "result.h5")
    vertices = solution.q[:, -3 * 24 :].reshape(-1, 2, 12, 3)
    angle = np.arctan2(vertices[..., 1], vertices[..., 0])
    twist = np.mod(angle[:, 1] - angle[:, 0], 2.0 * np.pi)
    np.testing.assert_allclose(twist, np.repeat(twist[:, :1], 12, axis=1), rtol=0.0, atol=1e-6)
    assert math.degrees(twist[-1, 0]) == pytest.approx(60.0, abs=0.2)
    force, at = solution.force[:, 0], solution.travel[:, 0]
    assert force.max() > 1.0 and abs(force[-1]) < 0.1 * force.max()
    assert at[force.argmax()] < 0.08
