"""Gas in chambers of rigid panels: wrenches, derivatives, work of an ideal gas, flow, and agreement with other facets."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.case.models.sheet import Sheet
from fsm.errors import CaseError
from fsm.kernels.blocks import BlockMatrix, LowRank
from fsm.model.bodies.group import BlockSums
from fsm.model.compile.compile_case import compile_case
from fsm.model.joined.panel_gas import PanelGas
from fsm.model.system.system import SegmentSystem
from tests.physics.test_gas import box, case

A, B, SECTOR, FOLD, COLUMNS = 0.05, 0.04, math.radians(60.0), math.radians(20.0), 3
STIFF = 0.1
"""Stiffness of the creases over their length, N m/rad per m."""
TUBE = {
    "kind": "miura-tube", "columns": COLUMNS, "a": A, "b": B, "sector_angle": SECTOR, "fold_angle": FOLD, "thickness": 1e-3,
    "facets": "rigid", "support": [{"at": "facet 1"}],
}  # fmt: skip
LIDS = [{"cap": "edge left"}, {"cap": "edge right"}]
OUTSIDE = 1e5
AIR = {"pressure": 2e5, "outside_pressure": OUTSIDE}
MOVING = {"method": "generalized-alpha", "end_time": 1.0}
CASES = {
    "box": (box("rigid", support=[{"at": "facet 1"}]), {"law": "adiabatic"} | AIR),
    "lids": (TUBE, {"closed_by": LIDS} | AIR),
    "bend lines": (TUBE | {"facets": "bend-lines"}, {"closed_by": LIDS} | AIR),
}


def compiled(sheet: dict[str, Any], gas: list[dict[str, Any]], folder: Path, **more: Any) -> SegmentSystem:
    system = compile_case(fsm.load(case(sheet, gas, **({"solve": MOVING} | more)), folder=folder).model)[1]
    assert isinstance(system, SegmentSystem)
    return system


def gas_of(system: SegmentSystem) -> PanelGas:
    return next(group for group in system.groups if isinstance(group, PanelGas))


def moved(system: SegmentSystem, size: float) -> tuple[np.random.Generator, np.ndarray]:
    """Generator, and a configuration with random displacements and rotations, so that joints have gaps."""
    rng = np.random.default_rng(3)
    return rng, system.retract(system.initial()[0], size * rng.normal(size=system.nu))


def wrenches(system: SegmentSystem, q: np.ndarray) -> np.ndarray:
    """Wrenches (n, 6) of the gas on all bodies."""
    out = np.zeros_like(system.at_rest)
    gas_of(system).add_force(system.state(0.0, q, None), out)
    return out


@pytest.mark.parametrize("name", CASES)
def test_wrenches_and_tangent_are_derivatives(name: str, tmp_path: Path) -> None:
    """Also with gaps of the joints, the wrenches are the gradient of the energy, and the tangent that of the wrenches."""
    sheet, gas = CASES[name]
    system = compiled(sheet, [gas], tmp_path)
    rng, q = moved(system, 1e-3)
    free, pattern = system.bodies.free, system._current_pattern(system.place(0.0, q, None)[0])
    force, stiffness = np.zeros_like(system.at_rest), pattern.zeros()
    gas_of(system).add_linearised(system.state(0.0, q, None), BlockSums(pattern, force, stiffness, stiffness))
    np.testing.assert_allclose(force, wrenches(system, q), rtol=0.0, atol=1e-12 * np.abs(force).max())
    found = gas_of(system).low_rank
    assert found is not None
    low_rank = LowRank(found.vectors.reshape(len(found.vectors), -1, 6)[:, free].reshape(-1, system.nu), found.weights)
    tangent = BlockMatrix(pattern, stiffness, low_rank)
    for way in rng.normal(size=(4, system.nu)):
        ends = [system.retract(q, sign * 1e-6 * way) for sign in (1.0, -1.0)]
        energies = [system.energy(0.0, end, None).potential["gas"] for end in ends]
        assert force[free].ravel() @ way == pytest.approx(-(energies[0] - energies[1]) / 2e-6, rel=1e-6)
        change = (wrenches(system, ends[0]) - wrenches(system, ends[1]))[free].ravel() / 2e-6
        np.testing.assert_allclose(tangent.times(way), -change, rtol=0.0, atol=1e-6 * np.abs(change).max())


def test_pressure_acts_at_the_centroids(tmp_path: Path) -> None:
    """Each closed flat panel carries its area times the pressure along its normal, and no moment about its centroid."""
    sheet, gas = CASES["box"]
    system = compiled(sheet, [gas], tmp_path)
    found = wrenches(system, system.initial()[0])[1:]
    normals = np.array([[0, 0, -1], [0, 0, 1], [0, -1, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0]])
    np.testing.assert_allclose(found[:, :3], 1e5 * 0.01 * normals, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found[:, 3:], 0.0, rtol=0.0, atol=1e-9)


def test_reaction_of_a_driven_panel(tmp_path: Path) -> None:
    """A driven panel compresses the gas: derivatives of its reaction by all other panels, and of their forces by time."""
    sheet, gas = CASES["lids"]
    drive = {"at": "facet 6", "direction": [1, 0, 0], "speed": 0.1, "travel": 0.01}
    system = compiled(sheet, [gas], tmp_path, drive=[drive])
    rng, q = moved(system, 1e-5)
    tangent, rate = system.drive_tangent(0.01, q, None), system.force_rate(0.01, q)
    for way in rng.normal(size=(3, system.nu)):
        ends = [system.balance(0.01, system.retract(q, sign * 1e-6 * way), None)[1] for sign in (1.0, -1.0)]
        change = np.abs(ends[0] - ends[1]) / 2e-6
        assert abs(tangent @ way)[0] == pytest.approx(change[0], rel=1e-6)
    later, sooner = (system.force(0.01 + shift, q, None) for shift in (1e-6, -1e-6))
    change = (later - sooner) / 2e-6
    np.testing.assert_allclose(rate, change, rtol=0.0, atol=1e-6 * np.abs(change).max())


def energy_of_creases(fold: float) -> float:
    """Energy of the linear creases of the tube of rigid panels at the fold angle of its panels, J."""
    angles, lengths = [], np.zeros(0)
    for angle in (FOLD, fold):
        pattern = pattern_of(Sheet.model_validate(TUBE | {"fold_angle": angle}))
        angles.append(pattern.start_angles()[pattern.creases])
        lengths = pattern.lengths[pattern.creases]
    return float(0.5 * STIFF * lengths @ (angles[1] - angles[0]) ** 2)


def balance_of_tube(volume: float) -> float:
    """Pressure above that outside of a tube of rigid panels with the energy U and the volume V: U'/V', Pa.

    V = columns a^2 b sin^2(sector) sin(2 fold) (Tachi, 2009).
    """
    whole = COLUMNS * A**2 * B * math.sin(SECTOR) ** 2
    fold = 0.5 * math.asin(volume / whole)
    slope = (energy_of_creases(fold + 1e-5) - energy_of_creases(fold - 1e-5)) / 2e-5
    return slope / (2.0 * whole * math.cos(2.0 * fold))


@pytest.mark.parametrize(("facets", "error"), [("rigid", 1e-5), ("plane", 1e-5), ("flexible", 1e-4)])
def test_tube_opened_by_its_gas(facets: str, error: float, tmp_path: Path) -> None:
    """The pressure is that of the energy of the creases, with rigid panels and with facets that are nearly rigid."""
    gas = {"closed_by": LIDS, "outside_pressure": OUTSIDE, "supply_mass": 8e-5}
    sheet = TUBE | ({"facets": facets, "mesh_size": 0.05, "thickness": 3e-3} if facets == "flexible" else {})
    if facets == "plane":
        sheet["support"] = [{"at": "edge left", "fixed": ["x"]}, {"at": "vertex 1"}, {"at": "vertex 3", "fixed": ["x", "z"]}]
        gas["closed_by"] = [{"axis": "x"}, LIDS[1]]
    more = {"material": {"young": 1e11, "poisson": 0.3, "density": 1000.0}}
    data = case(sheet, [gas], **more, solve={"method": "static", "end_time": 1.0, "max_step": 0.01})
    run = fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False)
    channels = run.solution.channels
    volume, pressure, mass = (channels[f"gas.gas.{name}"].values for name in ("volume", "pressure", "mass"))
    assert volume[-1] > 1.3 * volume[0]
    np.testing.assert_allclose(pressure * volume, mass * 287.06 * 293.15, rtol=1e-12)
    expected = np.array([balance_of_tube(float(one)) for one in volume])
    np.testing.assert_allclose(pressure - OUTSIDE, expected, rtol=0.0, atol=error * np.abs(expected).max())
    assert run.summary["energy_error"] < 5e-4


def test_work_of_an_ideal_gas(tmp_path: Path) -> None:
    """A tube thrown open by its gas: p V^gamma is constant, and all energies together are the work of the gas."""
    gas = {"closed_by": LIDS, "law": "adiabatic"} | AIR
    more = {
        "material": {"young": 1e9, "poisson": 0.3, "density": 1000.0, "damping": 0.0},
        "solve": {"method": "mean-force", "step": 5e-6, "end_time": 1e-3},
        "save": {"interval": 1e-4, "channels": ["gas.*", "energy.*"]},
    }  # fmt: skip
    run = fsm.load(case(TUBE, [gas], **more), folder=tmp_path).run(tmp_path / "out", figures=False)
    channels = run.solution.channels
    volume, pressure = channels["gas.gas.volume"].values, channels["gas.gas.pressure"].values
    np.testing.assert_allclose(pressure, 2e5 * (volume / volume[0]) ** -1.4, rtol=1e-12)
    work = 2e5 * volume[0] / 0.4 * (1.0 - (volume / volume[0]) ** -0.4) - OUTSIDE * (volume - volume[0])
    stored = sum(channels[name].values for name in channels if name in ("energy.creases", "energy.panels", "energy.kinetic"))
    assert volume.max() > 1.2 * volume[0]
    np.testing.assert_allclose(stored, work, rtol=0.0, atol=1e-5 * np.abs(work).max())
    assert run.summary["energy_error"] < 1e-5


def test_flow_between_two_parts_of_a_tube(tmp_path: Path) -> None:
    """Lids divide a tube; gas flows until both pressures are equal, and its mass is conserved."""
    pattern = pattern_of(Sheet.model_validate(TUBE))
    centres = np.array([pattern.vertices[list(face)].mean(axis=0)[0] for face in pattern.faces])
    column = np.argsort(np.argsort(np.round(centres, 6), kind="stable"), kind="stable") // 4
    sides = [np.flatnonzero(column < 1), np.flatnonzero(column >= 1)]
    parts = [", ".join(str(1 + k) for k in side) for side in sides]
    both = set.intersection(*({vertex for k in side for vertex in pattern.faces[k]} for side in sides))
    lid = {"cap": f"vertex {min(both) + 1}"}
    gases = [
        {"name": "left", "at": f"facets {parts[0]}", "pressure": 1.2e5, "closed_by": [LIDS[0], lid]},
        {"name": "right", "at": f"facets {parts[1]}", "pressure": 1e5, "closed_by": [lid, LIDS[1]]},
    ]  # fmt: skip
    gases = [gas | {"law": "adiabatic", "outside_pressure": OUTSIDE} for gas in gases]
    flow = {"between": ["left", "right"], "area": 2e-6, "discharge": 0.7}
    run = fsm.load(case(TUBE, gases, orifice=[flow]), folder=tmp_path).run(tmp_path / "out", figures=False)
    masses, pressures = (
        np.array([run.solution.channels[f"gas.{name}.{key}"].values for name in ("left", "right")])
        for key in ("mass", "pressure")
    )
    assert masses[0, -1] < 0.95 * masses[0, 0]
    assert np.ptp(masses.sum(axis=0)) <= 1e-15 * masses.sum()
    assert pressures[1, -1] == pytest.approx(pressures[0, -1], rel=1e-3)
    assert run.summary["energy_error"] < 1e-3


def test_orifice_that_follows_a_crease(tmp_path: Path) -> None:
    """The pressure at the end of a step depends on the fold angle of a crease between panels."""
    gas = {"closed_by": LIDS, "law": "adiabatic", "pressure": 1.5e5, "outside_pressure": OUTSIDE}
    flow = {"between": ["gas", "outside"], "crease": "crease 2", "area_by_angle": [[0.0, 0.0], [3.0, 3e-5]]}
    system = compiled(TUBE, [gas], tmp_path, orifice=[flow])
    system.commit(0.0, *system.initial())
    rng, q = moved(system, 1e-4)
    panels = gas_of(system)
    chambers = panels.chambers

    def nodes(x: np.ndarray) -> np.ndarray:
        return panels.nodes(system.place(0.01, x, None)[0])

    assert abs(chambers.state(0.01, nodes(q)).by_area[0, 0]) > 1e8
    system.linearise(0.01, q, None)
    of_area = chambers.low_rank.vectors[1]
    for way in rng.normal(size=(3, system.nu)):
        ends = [nodes(system.retract(q, sign * 1e-6 * way)) for sign in (1.0, -1.0)]
        one, two = (chambers.state(0.01, end) for end in ends)
        change = (one.pressure - two.pressure) / 2e-6
        state = chambers.state(0.01, nodes(q))
        rates = (ends[0] - ends[1]) / 2e-6
        grown = (one.volume - two.volume) / 2e-6
        opened = of_area @ rates
        assert change[0] == pytest.approx(state.by_volume[0, 0] * grown[0] + state.by_area[0, 0] * opened, rel=1e-5)


def test_cables_beside_rigid_panels_with_gas(tmp_path: Path) -> None:
    cable = {
        "name": "rope", "start": [0.0, 0.0, 0.5], "end": [0.1, 0.0, 0.5], "diameter": 1e-3, "young": 1e9, "density": 1000.0,
        "elements": 1, "held": ["start", "end"],
    }  # fmt: skip
    data = case(TUBE, [{"closed_by": LIDS} | AIR], scene={"cables": [cable]})
    with pytest.raises(CaseError, match="gas in rigid panels is not available beside films, cables"):
        fsm.load(data, folder=tmp_path).check()


@pytest.mark.parametrize(
    ("gas", "text"),
    [
        (AIR, r"the chamber is open at the edge .*closed_by"),
        ({"closed_by": LIDS, "at": "facet 99"} | AIR, "there is no number 99"),
        ({"closed_by": LIDS[:1]} | AIR, "the chamber is open at the edge"),
    ],
)
def test_faults(gas: dict[str, Any], text: str, tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=text):
        fsm.load(case(TUBE, [gas]), folder=tmp_path).check()


@pytest.mark.parametrize("supply", [1.2 * OUTSIDE, 0.9 * OUTSIDE])
def test_a_pressure_without_a_time_begins_outside(supply: float, tmp_path: Path) -> None:
    """In statics, a supply of pressure goes from the pressure outside to its value in proportion to time."""
    gas = {"closed_by": LIDS, "supply_pressure": supply, "outside_pressure": OUTSIDE}
    more = {"solve": {"method": "static", "end_time": 1.0}, "save": {"interval": 0.1, "channels": ["gas.*"]}}
    run = fsm.load(case(TUBE | {"thickness": 2e-3}, [gas], crease={"stiffness_per_length": 500.0}, **more), folder=tmp_path)
    solution = run.run(tmp_path / "out", figures=False).solution
    pressure = solution.channels["gas.gas.pressure"].values
    np.testing.assert_allclose(pressure, OUTSIDE + (supply - OUTSIDE) * solution.time, rtol=1e-12)
