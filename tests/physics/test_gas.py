"""Gas in chambers of sheets: derivatives, work of an ideal gas, supply, flow through orifices, and the energy balance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.compile_case import compile_case

BOX = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
WALLS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
R, T0 = 287.06, 293.15


def box(facets: str, size: Sequence[float] = (0.1, 0.1, 0.1), **sheet: Any) -> dict[str, Any]:
    """Box with square walls, normals outwards; wall 2 is the piston at the top."""
    edges = sorted({tuple(sorted(pair)) for wall in WALLS for pair in zip(wall, (*wall[1:], wall[0]), strict=True)})
    return {
        "vertices": (BOX * size).tolist(), "faces": [list(wall) for wall in WALLS], "edges": [list(e) for e in edges],
        "assignment": ["M"] * len(edges), "angles": [-np.pi / 2] * len(edges), "thickness": 1e-3, "facets": facets,
    } | sheet  # fmt: skip


def case(sheet: dict[str, Any], gas: Sequence[dict[str, Any]], **more: Any) -> dict[str, Any]:
    crease = {} if sheet.get("kind") == "plate" else {"crease": {"law": "linear", "stiffness_per_length": 0.1}}
    return crease | {
        "sheet": sheet, "material": {"young": 1e9, "poisson": 0.3, "density": 1000.0},
        "gas": list(gas),
        "solve": {"method": "static", "end_time": 1.0}, "save": {"interval": 0.1, "channels": ["gas.*"]},
    } | more  # fmt: skip


KRESLING = {
    "kind": "kresling", "sides": 6, "rows": 1, "radius": 0.05, "height": 0.05, "twist": "40 deg", "thickness": 1e-3,
}  # fmt: skip
QUARTER = {
    "kind": "plate", "length": 0.05 * np.pi, "width": 0.05, "radius": 0.1, "mesh": [3, 2], "facets": "flexible",
    "thickness": 1e-3,
    "support": [{"at": "edge left", "mirror": "x"}, {"at": "edge right", "mirror": "z"},
                {"at": "edge bottom", "mirror": "y"}, {"at": "edge top", "mirror": "y"}],
}  # fmt: skip
PLANES = [{"axis": "x"}, {"axis": "z", "at": -0.1}, {"axis": "y"}, {"axis": "y", "at": 0.05}]
BARS = {"facets": "bars", "bend_stiffness_per_length": 0.1}
FLEXIBLE = {"facets": "flexible", "mesh_size": 0.03}
LIDS = [{"cap": "edge bottom"}, {"cap": "edge top"}]
AIR = {"pressure": 2e5, "outside_pressure": 1e5}
CASES = {
    "box of flexible facets": (box("flexible", mesh_size=0.05), {"name": "air", "law": "adiabatic"} | AIR),
    "box of bars": (box("bars", bend_stiffness_per_length=1.0), {"name": "air"} | AIR),
    "planes": (QUARTER, {"closed_by": PLANES} | AIR),
    "lids of flexible facets": (KRESLING | FLEXIBLE, {"closed_by": LIDS} | AIR),
    "lids of bars": (KRESLING | BARS, {"closed_by": LIDS} | AIR),
}


@pytest.mark.parametrize("name", CASES)
def test_force_and_tangent_are_derivatives(name: str, tmp_path: Path) -> None:
    """The force of the gas is the gradient of its energy, and the tangent that of the force, with the part of low rank."""
    sheet, gas = CASES[name]
    data = case(sheet, [gas], solve={"method": "generalized-alpha", "end_time": 1.0})
    _, system = compile_case(fsm.load(data, folder=tmp_path).model)
    chambers = system.chambers
    rng, q = np.random.default_rng(2), system.initial()[0]
    free = ~system._fixed.ravel()
    q = q + 2e-3 * rng.normal(size=len(q)) * free
    nodes = q[system._nq :]

    def force(q: np.ndarray) -> np.ndarray:
        out = np.zeros(len(q))
        chambers.add_force(0.0, q, out)
        return out

    ways = rng.normal(size=(4, len(nodes))) * free
    for way in ways:
        gain = (chambers.energy(0.0, nodes + 1e-6 * way) - chambers.energy(0.0, nodes - 1e-6 * way)) / 2e-6
        assert force(nodes) @ way == pytest.approx(-gain, rel=1e-6)
    linear = system.linearise(0.0, q, None)
    assert linear.stiffness.low_rank is not None
    np.testing.assert_allclose(linear.force, system.force(0.0, q, None), rtol=0.0, atol=1e-12 * np.abs(linear.force).max())
    ways = rng.normal(size=(4, system.nu)) * free
    for way in ways:
        change = (system.force(0.0, q + 1e-7 * way, None) - system.force(0.0, q - 1e-7 * way, None)) / 2e-7
        np.testing.assert_allclose(linear.stiffness.times(way), -change, rtol=0.0, atol=1e-6 * np.abs(change).max())
    dense = free[:, None] * free * linear.stiffness.bsr().toarray()
    np.testing.assert_allclose(dense, dense.T, rtol=0.0, atol=1e-9 * np.abs(dense).max())


HEIGHT = RADIUS = 0.05
AREA = 2.0 * RADIUS**2
STIFF = 1e7 * 1e-6
SQUARE = {
    "kind": "kresling", "sides": 4, "rows": 1, "radius": RADIUS, "height": HEIGHT, "twist": 0.0, "thickness": 1e-3,
    "facets": "bars", "bend_stiffness_per_length": 1e-3, "bars": {"young": 1e7, "area": 1e-6},
    "support": [{"at": "edge bottom"}, {"at": "edge top", "fixed": ["x", "y"]}],
}  # fmt: skip


def elastic(height: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force and energy of the four walls of a square tube of bars: one along its height and one diagonal each."""
    side = np.sqrt(AREA)
    first, length = np.hypot(side, HEIGHT), np.hypot(side, height)
    force = 4.0 * STIFF * ((height / HEIGHT - 1.0) + (length / first - 1.0) * height / length)
    energy = 2.0 * STIFF * (HEIGHT * (height / HEIGHT - 1.0) ** 2 + first * (length / first - 1.0) ** 2)
    return force, energy


@pytest.mark.parametrize(("law", "exponent"), [("isothermal", 1.0), ("adiabatic", 1.4)])
def test_piston(law: str, exponent: float, tmp_path: Path) -> None:
    """A lid pulled by a force: p V^gamma is constant, and the force is that of the bars and of the gas."""
    gas = {"name": "air", "law": law, "closed_by": LIDS, "pressure": 1e5, "outside_pressure": 1e5}
    ramp = {"kind": "ramp", "end": 1.0, "shape": "linear"}
    load = {"at": "edge top", "force": [0.0, 0.0, 150.0], "time": ramp}
    run = fsm.load(case(SQUARE, [gas], load=[load]), folder=tmp_path).run(tmp_path / "out", figures=False)
    found, volume = run.solution, run.solution.channels["gas.air.volume"].values
    height = volume / AREA
    above = 1e5 * (HEIGHT / height) ** exponent - 1e5
    assert height[-1] > 1.2 * HEIGHT
    np.testing.assert_allclose(elastic(height)[0] - above * AREA, 150.0 * found.time, rtol=0.0, atol=1.5e-6)
    np.testing.assert_allclose(found.channels["gas.air.pressure"].values, above + 1e5, rtol=1e-12)
    warm = T0 * (HEIGHT / height) ** (exponent - 1.0)
    np.testing.assert_allclose(found.channels["gas.air.temperature"].values, warm, rtol=1e-12)
    assert run.summary["energy_error"] < 1e-4


@pytest.mark.parametrize(("law", "exponent"), [("isothermal", 1.0), ("adiabatic", 1.4)])
def test_work_of_an_ideal_gas(law: str, exponent: float, tmp_path: Path) -> None:
    """A lid that the gas throws up has the kinetic energy of the work of the gas, m R T ln(V1/V0) or m c_v (T0 - T1)."""
    gas = {"name": "air", "law": law, "closed_by": LIDS, "pressure": 2e5, "outside_pressure": 1e5}
    more = {
        "solve": {"method": "mean-force", "step": 2e-5, "end_time": 2e-3},
        "save": {"interval": 2e-4, "channels": ["gas.*", "energy.*"]},
    }  # fmt: skip
    run = fsm.load(case(SQUARE, [gas], **more), folder=tmp_path).run(tmp_path / "out", figures=False)
    channels, first = run.solution.channels, AREA * HEIGHT
    volume, kinetic = channels["gas.air.volume"].values, channels["energy.kinetic"].values
    grown = volume / first
    work = 2e5 * first * (np.log(grown) if exponent == 1.0 else (1.0 - grown ** (1.0 - exponent)) / (exponent - 1.0))
    assert grown.max() > 1.5
    expected = work - 1e5 * (volume - first) - elastic(volume / AREA)[1]
    np.testing.assert_allclose(kinetic, expected, rtol=0.0, atol=1e-6 * np.abs(work).max())
    assert run.summary["energy_error"] < 1e-6
