"""Gas in chambers of sheets: derivatives, work of an ideal gas, supply, flow through orifices, and the energy balance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import fsm
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case
from fsm.model.joined.panel_gas import PanelGas
from fsm.solve.modal import modes

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
    "support": [{"at": "edge bottom"}],
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
HALF = QUARTER | {
    "length": 0.1 * np.pi, "mesh": [6, 2],
    "support": [{"at": f"edge {edge}", "mirror": axis} for edge, axis in (("left", "x"), ("right", "x"), ("bottom", "y"))],
}  # fmt: skip
QUARTER_LID = [*PLANES[:3], {"cap": "edge top"}]
HALF_LID = [{"axis": "x"}, {"axis": "y"}, {"cap": "edge top"}]
LIDS = [{"cap": "edge bottom"}, {"cap": "edge top"}]
AIR = {"pressure": 2e5, "outside_pressure": 1e5}
CASES = {
    "box of flexible facets": (box("flexible", mesh_size=0.05), {"name": "air", "law": "adiabatic"} | AIR),
    "box of bars": (box("bars", bend_stiffness_per_length=1.0), {"name": "air"} | AIR),
    "planes": (QUARTER, {"closed_by": PLANES} | AIR),
    "half of a lid": (HALF, {"closed_by": HALF_LID} | AIR),
    "quarter of a lid": (QUARTER | {"support": QUARTER["support"][:3]}, {"closed_by": QUARTER_LID} | AIR),
    "lids of flexible facets": (KRESLING | FLEXIBLE, {"closed_by": LIDS} | AIR),
    "lids of bars": (KRESLING | BARS, {"closed_by": LIDS} | AIR),
}


@pytest.mark.parametrize("name", CASES)
def test_force_and_tangent_are_derivatives(name: str, tmp_path: Path) -> None:
    """The force of the gas is the gradient of its energy, and the tangent, including the part of low rank, is the derivative
    of the force."""
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
        chambers.add_force(q, None, out)
        return out

    ways = rng.normal(size=(4, len(nodes))) * free
    for way in ways:
        gain = (chambers.energy(nodes + 1e-6 * way, None)[0] - chambers.energy(nodes - 1e-6 * way, None)[0]) / 2e-6
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


@pytest.mark.parametrize("kind", [BARS, FLEXIBLE])
def test_tangent_of_an_orifice_that_follows_a_crease(kind: dict[str, Any], tmp_path: Path) -> None:
    """The flow of a step depends on the fold angle at its end, and so does the pressure."""
    gas = {"closed_by": LIDS, "law": "adiabatic", "pressure": 1.5e5, "outside_pressure": 1e5}
    flow = {"between": ["gas", "outside"], "crease": "crease 2", "area_by_angle": [[0.0, 0.0], [3.0, 3e-5]]}
    data = case(KRESLING | kind, [gas], orifice=[flow], solve={"method": "generalized-alpha", "end_time": 1.0})
    _, system = compile_case(fsm.load(data, folder=tmp_path).model)
    free, (q, u), t = ~system._fixed.ravel(), system.initial(), 0.01
    system.commit(0.0, q, u)
    rng = np.random.default_rng(4)
    q = q + 1e-4 * rng.normal(size=len(q)) * free
    state = system.chambers.state(t, q[system._nq :])
    assert 1.05e5 < state.pressure[0] < 1.4e5
    assert abs(state.by_area[0, 0]) > 1e8
    linear = system.linearise(t, q, None)
    for way in rng.normal(size=(4, system.nu)) * free:
        change = (system.force(t, q + 1e-7 * way, None) - system.force(t, q - 1e-7 * way, None)) / 2e-7
        np.testing.assert_allclose(linear.stiffness.times(way), -change, rtol=0.0, atol=1e-6 * np.abs(change).max())


HEIGHT = RADIUS = 0.05
AREA = 2.0 * RADIUS**2
STIFF = 1e7 * 1e-6
SQUARE = {
    "kind": "kresling", "sides": 4, "rows": 1, "radius": RADIUS, "height": HEIGHT, "twist": 0.0, "thickness": 1e-3,
    "facets": "bars", "bend_stiffness_per_length": 1e-3, "bars": {"young": 1e7, "area": 1e-6},
    "support": [{"at": "edge bottom"}, {"at": "edge top", "fixed": ["x", "y"]}],
}  # fmt: skip


def elastic(height: Any) -> tuple[Any, Any]:
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


FILLED = 2e4 * AREA * HEIGHT / (R * T0)
TABLE = {"kind": "table"}
SUPPLIES = {
    "mass": ({"supply_mass": FILLED}, lambda t: t),
    "constant flow": ({"supply_flow": FILLED}, lambda t: t),
    "ramp": ({"supply_flow": 2.0 * FILLED, "time": {"kind": "ramp", "end": 1.0}}, lambda t: 2.0 * t**3 - t**4),
    "late ramp": (
        {"supply_flow": FILLED, "time": {"kind": "ramp", "start": 0.2, "end": 0.7, "shape": "linear"}},
        lambda t: np.clip(t - 0.2, 0.0, 0.5) ** 2 + np.maximum(t - 0.7, 0.0),
    ),
    "table": (
        {"supply_flow": FILLED, "time": TABLE | {"time": [0.0, 0.5, 1.0], "value": [0.0, 1.0, 0.5]}},
        lambda t: np.where(t < 0.5, t**2, t - 0.5 * (t - 0.5) ** 2 - 0.25),
    ),
    "smooth table": (
        {"supply_flow": FILLED, "time": TABLE | {"time": [0.0, 1.0], "value": [0.5, 1.5], "interpolation": "smooth"}},
        lambda t: 0.5 * t + t**3 - 0.5 * t**4,
    ),
    "cycle": (
        {"supply_flow": FILLED, "time": {"kind": "cycle", "period": 1.0}},
        lambda t: 0.5 * t - np.sin(2.0 * np.pi * t) / (4.0 * np.pi),
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "law"), [("mass", "isothermal"), ("smooth table", "isothermal"), *((name, "adiabatic") for name in SUPPLIES)]
)
def test_inflation_of_an_empty_tube_in_vacuum(name: str, law: str, tmp_path: Path) -> None:
    """The mass is the integral of the flow, and the pressure balances the bars.

    Isothermal: p V = m R T. Adiabatic: the gas and the bars have the enthalpy c_p T of the supplied mass.
    """
    supply, filled = SUPPLIES[name]
    run = fsm.load(case(SQUARE, [{"name": "air", "law": law, "closed_by": LIDS} | supply]), folder=tmp_path).run(
        tmp_path / "out", figures=False
    )
    found = run.solution
    mass, volume, pressure = (found.channels[f"gas.air.{key}"].values for key in ("mass", "volume", "pressure"))
    assert mass[0] == pressure[0] == 0.0
    np.testing.assert_allclose(mass, FILLED * filled(found.time), rtol=0.0, atol=1e-12 * FILLED)
    force, energy = elastic(volume / AREA)
    np.testing.assert_allclose(pressure * AREA, force, rtol=0.0, atol=1e-6)
    assert force[-1] > 10.0
    if law == "isothermal":
        np.testing.assert_allclose(pressure * volume, mass * R * T0, rtol=1e-12)
    else:
        brought = 3.5 * R * T0 * mass
        np.testing.assert_allclose(pressure * volume / 0.4 + energy, brought, rtol=0.0, atol=1e-4 * brought[-1])
    assert run.summary["energy_error"] < 1e-4


@pytest.mark.parametrize("name", ["constant flow", "table"])
def test_inflation_in_motion(name: str, tmp_path: Path) -> None:
    """A flow into an empty tube in vacuum moves its lid; mass, p V = m R T, and the energy balance."""
    supply, filled = SUPPLIES[name]
    gas = {"name": "air", "closed_by": LIDS} | supply | {"supply_flow": FILLED / 5e-3}
    if "time" in gas:
        gas["time"] = gas["time"] | {"time": [0.0, 2.5e-3, 5e-3]}
    more = {"solve": {"method": "mean-force", "end_time": 5e-3}, "save": {"interval": 5e-4, "channels": ["gas.*"]}}
    run = fsm.load(case(SQUARE, [gas], **more), folder=tmp_path).run(tmp_path / "out", figures=False)
    found = run.solution
    mass, volume, pressure = (found.channels[f"gas.air.{key}"].values for key in ("mass", "volume", "pressure"))
    np.testing.assert_allclose(mass, FILLED * filled(found.time / 5e-3), rtol=0.0, atol=1e-12 * FILLED)
    np.testing.assert_allclose(pressure * volume, mass * R * T0, rtol=1e-12)
    assert volume[-1] > 1.3 * volume[0]
    assert run.summary["energy_error"] < 1e-6


def test_supply_that_empties_a_chamber(tmp_path: Path) -> None:
    gas = {"name": "air", "closed_by": LIDS, "pressure": 2e4}
    for key, start in (("supply_mass", 1.0), ("supply_flow", 0.8)):
        size = {key: -1.2 * FILLED / start}
        with pytest.raises(CaseError, match=rf"gas.0.{key}: the chamber has {1e6 * FILLED:.4g} mg .* is empty before t ="):
            fsm.load(case(SQUARE, [gas | size]), folder=tmp_path).check()
        fsm.load(case(SQUARE, [gas | {key: -0.7 * FILLED}]), folder=tmp_path).check()


@pytest.mark.parametrize(("law", "exponent"), [("isothermal", 1.0), ("adiabatic", 1.4)])
def test_work_of_an_ideal_gas(law: str, exponent: float, tmp_path: Path) -> None:
    """A lid that the gas accelerates has a kinetic energy equal to the work of the gas, m R T ln(V1/V0) or m c_v (T0 -
    T1)."""
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


def tube_of_bars(half: bool) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Tube with a section of eight sides between the plane y = 0 and a lid, or its half beside the plane x = 0.3."""
    sides = 4 if half else 8
    turn = np.arange(sides + half) * np.pi / 4.0
    ring = np.column_stack([0.3 + 0.1 * np.sin(turn), 0.0 * turn, 0.1 * np.cos(turn)])
    vertices, faces = np.concatenate([ring + [0.0, y, 0.0] for y in (0.0, 0.08, 0.2)]), []
    number = np.arange(len(vertices)).reshape(3, -1)
    for row in (0, 1):
        for k in range(sides):
            (a, b), (d, c) = number[row : row + 2, [k, (k + 1) % len(ring)]].tolist()
            faces += [[a, c, b], [a, d, c]] if (k + row) % 2 else [[a, d, b], [b, d, c]]
    edges = sorted({tuple(sorted(pair)) for face in faces for pair in zip(face, (*face[1:], face[0]), strict=True)})
    letters = []
    for edge in edges:
        folded = np.abs(np.diff(vertices[list(edge)], axis=0))[0, [0, 2]].max() < 1e-9
        border = sum(set(edge) <= set(face) for face in faces) == 1
        letters.append("B" if border else "M" if folded else "F")
    in_plane = (number[:, [0, 4]] if half else number[0, [0, 4]]).ravel()
    places = {"y": number[0], "x": in_plane, "z": number[0, [2]]}
    sheet = {
        "vertices": vertices.tolist(), "faces": faces, "edges": [list(edge) for edge in edges], "assignment": letters,
        "angles": [-np.pi / 4.0 if letter == "M" else 0.0 for letter in letters], "facets": "bars", "thickness": 1e-4,
        "support": [{"at": f"vertices {', '.join(map(str, of + 1))}", "fixed": [axis]} for axis, of in places.items()],
    }  # fmt: skip
    plane = [{"axis": "x", "at": 0.3}] if half else []
    return sheet, [{"axis": "y"}, {"cap": f"vertex {number[2, 1] + 1}"}, *plane]


ENDS = {"interval": 0.5, "channels": ["gas.*"]}
Z_MIDDLE = {"at": [[0.099, -1e-3, -0.101], [0.101, 1e-3, -0.099]], "fixed": ["z"]}
PARTS = {
    "half of the whole": (tube_of_bars(False), tube_of_bars(True)),
    "quarter of the half": (
        (HALF | {"support": [*HALF["support"], Z_MIDDLE]}, HALF_LID),
        (QUARTER | {"support": QUARTER["support"][:3]}, QUARTER_LID),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", PARTS)
def test_part_of_a_lid(name: str, tmp_path: Path) -> None:
    """A tube between planes of symmetry through its axis and a part of a lid deforms as the whole tube does."""
    found = []
    for number, (sheet, closed) in enumerate(PARTS[name]):
        gas = {"name": "air", "closed_by": closed, "supply_pressure": 2e4}
        data = case(sheet, [gas], crease={"law": "linear", "stiffness_per_length": 1e-6}, save=ENDS)
        data["solve"]["rtol"] = 1e-3
        if sheet["facets"] == "flexible":
            del data["crease"]
        run = fsm.load(data, folder=tmp_path).run(tmp_path / str(number), figures=False)
        found.append(2**number * run.solution.channels["gas.air.volume"].values)
    assert found[0][-1] > 1.001 * found[0][0]
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)


def test_part_of_a_lid_over_rigid_panels(tmp_path: Path) -> None:
    found = []
    for half in (False, True):
        sheet, closed = tube_of_bars(half)
        data = case(sheet | {"facets": "rigid"}, [{"name": "air", "closed_by": closed, "supply_mass": 1e-4}])
        _, system = compile_case(fsm.load(data, folder=tmp_path).model)
        gas = next(group for group in system.groups if isinstance(group, PanelGas))
        (volume,) = gas.chambers.state(0.0, gas.nodes(system.bodies.pose)).volume
        found.append(volume)
    assert 2.0 * found[1] == pytest.approx(found[0], rel=1e-12)


def test_chamber_between_two_walls(tmp_path: Path) -> None:
    """A quarter of a tube between two planes, and a second wall normal to one of them that it does not reach."""
    gas = {"name": "air", "closed_by": [*QUARTER_LID, {"axis": "x", "at": 0.4}]} | AIR
    data = case(QUARTER | {"support": QUARTER["support"][:3]}, [gas])
    _, system = compile_case(fsm.load(data, folder=tmp_path).model)
    (volume,) = system.chambers.state(0.0, system.initial()[0]).volume
    section = 3 * 0.5 * 0.1**2 * np.sin(np.pi / 6.0)  # the three triangles of a section of twelve sides
    assert volume == pytest.approx(0.05 * section, rel=1e-12)


def test_flow_between_two_storeys(tmp_path: Path) -> None:
    """A tube with a lid between its storeys: gas flows until both pressures are equal; mass and energy are conserved."""
    sheet = SQUARE | {
        "rows": 2,
        "support": [{"at": "edge bottom"}, {"at": "edge top", "fixed": ["x", "y"]},
                    {"at": "vertices 5, 6, 7, 8", "fixed": ["x", "y"]}],
    }  # fmt: skip
    gases = [
        {"name": "low", "at": f"facets {', '.join(map(str, range(1, 9)))}", "pressure": 1.5e5,
         "closed_by": [{"cap": "edge bottom"}, {"cap": "vertex 5"}]},
        {"name": "up", "at": f"facets {', '.join(map(str, range(9, 17)))}", "pressure": 1e5,
         "closed_by": [{"cap": "vertex 5"}, {"cap": "edge top"}]},
    ]  # fmt: skip
    gases = [gas | {"law": "adiabatic", "outside_pressure": 1e5} for gas in gases]
    flow = {"between": ["low", "up"], "area": 2e-6, "discharge": 0.7}
    run = fsm.load(case(sheet, gases, orifice=[flow]), folder=tmp_path).run(tmp_path / "out", figures=False)
    masses, pressures = (
        np.array([run.solution.channels[f"gas.{name}.{key}"].values for name in ("low", "up")])
        for key in ("mass", "pressure")
    )
    assert masses[0, -1] < 0.9 * masses[0, 0]
    assert np.ptp(masses.sum(axis=0)) <= 1e-15 * masses.sum()
    assert pressures[1, -1] == pytest.approx(pressures[0, -1], rel=1e-3)
    assert run.summary["energy_error"] < 1e-4


def test_limit_points(tmp_path: Path) -> None:
    """A Kresling tube collapses when gas is removed. The equilibria do not depend on the supply, but the stability does.

    With a given pressure the tube is unstable from the extremum of the pressure on, and with a given mass from that of the
    mass on, which comes later.
    """
    sheet = KRESLING | {
        "sides": 8, "radius": 1.0, "height": 1.0, "twist": "45 deg", "facets": "bars", "thickness": 1e-3,
        "bars": {"young": 5e3, "area": 0.1, "law": "ogden", "linear_to": "135 deg"}, "support": [{"at": "edge bottom"}],
    }  # fmt: skip
    table = {"kind": "table", "time": [0.0, 1.0], "value": [1.0, 0.2]}
    curves = {}
    for key, supply in (("mass", {"supply_mass": -5e-5}), ("pressure", {"supply_pressure": 2.0, "time": table})):
        gas = {"name": "air", "closed_by": LIDS, "outside_pressure": 2.0} | supply
        data = case(sheet, [gas], solve={"method": "arc-length", "end_time": 1.0})
        data["crease"] = {"law": "linear", "stiffness_per_length": 1e-3}
        data["save"] = {"channels": ["gas.*"], "interval": 0.01}
        found = fsm.load(data, folder=tmp_path).run(tmp_path / key, figures=False).solution
        names = ("volume", "pressure", "mass")
        volume, *others = (found.channels[f"gas.air.{name}"].values for name in names)
        part = slice(0, int(np.argmin(np.where(volume > 1.2, volume, np.inf))) + 1)
        curves[key] = volume[part], dict(zip(names[1:], others, strict=True))[key][part], found.negative_pivots[part]
        at = int(np.argmin(curves[key][1]))
        assert 5 < at < len(volume[part]) - 5
        assert not np.any(curves[key][2][: at - 1])
        assert np.all(curves[key][2][at + 2 :] > 0)
        if key == "mass":
            known = CubicSpline(volume[part][::-1], others[0][part][::-1])
        else:
            np.testing.assert_allclose(known(volume[part]), others[0][part], rtol=0.0, atol=1e-5)
    assert curves["mass"][0][np.argmin(curves["mass"][1])] < curves["pressure"][0][np.argmin(curves["pressure"][1])] - 0.03


@pytest.mark.parametrize(
    ("gas", "sheet", "text"),
    [
        (AIR, KRESLING | BARS, r"the chamber is open at the edge .*closed_by"),
        ({"closed_by": [{"cap": "edge left"}]} | AIR, KRESLING | BARS, "is not a place of the sheet"),
        ({"closed_by": LIDS, "pressure": 0.0}, KRESLING | BARS, "the chamber is empty and has no supply"),
        ({"closed_by": PLANES[1:]} | AIR, QUARTER, "open at the edge"),
        ({"closed_by": HALF_LID[1:]} | AIR, HALF, "edge top is not on a closed ring .* or on a line that ends in a plane"),
        ({"closed_by": PLANES, "supply_mass": 1.0, "supply_flow": 1.0}, QUARTER, "give one supply"),
        ({"at": "facet 9"} | AIR, QUARTER, "there is no number 9"),
        ({"closed_by": [{"axis": "x", "cap": "edge top"}]} | AIR, QUARTER, "both are given"),
    ],
)
def test_faults(gas: dict[str, Any], sheet: dict[str, Any], text: str, tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=text):
        fsm.load(case(sheet, [gas]), folder=tmp_path).check()


@pytest.mark.parametrize("facets", [{"facets": "rigid"}, {"facets": "bars"}, {"facets": "flexible", "mesh_size": 0.05}])
@pytest.mark.parametrize("letter", ["C", "V"])
def test_a_cut_does_not_hold_gas(letter: str, facets: dict[str, Any], tmp_path: Path) -> None:
    """A lid on a ring that both sides of a cut join does not close the cut."""
    corners, square = range(4), ((0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1))
    walls = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in corners]
    rings = [(low + k, low + (k + 1) % 4) for low in (0, 4) for k in corners]
    sheet = facets | {
        "vertices": [(x, y, z) for z in (0.0, 0.1) for x, y in square], "faces": walls,
        "edges": rings + [(k, k + 4) for k in corners], "assignment": [*"BBBBBBBB", letter, *"VVV"],
        "angles": [0.0] * 8 + [0.0 if letter == "C" else np.pi / 2, *[np.pi / 2] * 3],
        "thickness": 1e-4, "support": [{"at": "facet 1"}],
    }  # fmt: skip
    gas = {"name": "air", "supply_pressure": 1e3, "closed_by": [{"cap": f"vertex {number}"} for number in (2, 6)]}
    if letter == "V":
        report = fsm.load(case(sheet, [gas]), folder=tmp_path).check()
        assert any("around 1 litre" in line for line in report.lines)
        return
    for lids in (gas["closed_by"][:1], gas["closed_by"]):
        with pytest.raises(CaseError, match=r"gas.0.at: the chamber is open at the cut \(0, 0, .*; a cut does not hold gas"):
            fsm.load(case(sheet, [gas | {"closed_by": lids}]), folder=tmp_path).check()


def test_orifice_between_different_gases(tmp_path: Path) -> None:
    gases = [{"name": "a", "closed_by": LIDS} | AIR, {"name": "b", "closed_by": LIDS, "gas_constant": 2077.0} | AIR]
    for between, text in ((["a", "b"], "joins gases with gas_constant"), (["a", "c"], "there is no gas 'c'")):
        data = case(KRESLING | BARS, gases, orifice=[{"between": between, "area": 1e-6}])
        with pytest.raises(CaseError, match=text):
            fsm.load(data, folder=tmp_path).check()
    flow = {"between": ["a", "outside"], "crease": "crease 99", "area_by_angle": [[0, 0], [1, 1e-6]]}
    with pytest.raises(CaseError, match='there is no "crease 99"; the sheet has "crease 1" to'):
        fsm.load(case(KRESLING | BARS, gases[:1], orifice=[flow]), folder=tmp_path).check()


def test_frequency_of_a_lid_on_gas(tmp_path: Path) -> None:
    """m omega^2 is the stiffness gamma p A^2/V of the gas plus that of the bars; modes see the part of low rank."""
    gas = {"name": "air", "law": "adiabatic", "closed_by": LIDS, "pressure": 1e5, "outside_pressure": 1e5}
    data = case(SQUARE, [gas], solve={"method": "generalized-alpha", "end_time": 1.0})
    _, system = compile_case(fsm.load(data, folder=tmp_path).model)
    q = system.initial()[0]
    mass = 0.5 * 4.0 * np.sqrt(AREA) * HEIGHT * 1e-3 * 1000.0  # half of the walls' mass: thickness 1 mm, 1000 kg/m^3
    stiffness = 1.4 * 1e5 * AREA / HEIGHT + (elastic(HEIGHT + 1e-7)[0] - elastic(HEIGHT - 1e-7)[0]) / 2e-7
    squared = modes(system, 0.0, q, system.nu).squared
    assert np.abs(squared / (stiffness / mass) - 1.0).min() < 1e-7
