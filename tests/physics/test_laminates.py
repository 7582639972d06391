"""Laminates of flexible plates against classical lamination theory."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.builders.patterns.of_sheet import flexible_mesh, pattern_of
from fsm.case.models.laminate import laminate_of
from fsm.case.models.sheet import Sheet
from fsm.case.models.sheet_parts import SheetPly
from fsm.errors import CaseError

PLY = {"young": 140e9, "young_across": 10e9, "shear": 5e9, "poisson": 0.3}
SIDE, DENSITY = 0.2, 1600.0


def plate(plies: list[dict[str, Any]], mesh: int = 8, **material: Any) -> dict[str, Any]:
    """Square plate whose edges cannot move along z."""
    edges = [{"at": f"edge {name}", "fixed": ["z"]} for name in ("left", "right", "bottom", "top")]
    corners = [{"at": "vertex 1", "fixed": ["x", "y"]}, {"at": "vertex 2", "fixed": ["y"]}]
    thickness = sum(ply["thickness"] for ply in plies) or 1e-3
    sheet = {
        "kind": "plate", "length": SIDE, "width": SIDE, "mesh": [mesh, mesh], "thickness": thickness,
        "facets": "flexible", "support": edges + corners, "ply": plies,
    }  # fmt: skip
    return {
        "sheet": sheet, "material": {"young": 70e9, "poisson": 0.3, "density": DENSITY} | material,
        "step": [{"kind": "modes", "modes": 3}],
    }  # fmt: skip


def frequencies(data: dict[str, Any], folder: Path) -> np.ndarray:
    return np.array(fsm.load(data, folder=folder).run(folder / "out", figures=False).summary["step"][0]["frequencies_hz"])


def test_cross_ply_frequency(tmp_path: Path) -> None:
    """Simply supported square, 0/90/0: f = pi/(2 a^2) sqrt((D11 + 2 D12 + 4 D66 + D22)/m) (Jones, 1999)."""
    plies = [PLY | {"thickness": 2.5e-4, "angle": angle} for angle in (0.0, "90 deg", 0.0)]
    q11, q22 = (PLY[name] / (1.0 - 0.3 * 0.3 / 14.0) for name in ("young", "young_across"))
    whole, inner = 7.5e-4**3 / 12.0, 2.5e-4**3 / 12.0
    d11, d22 = (a * (whole - inner) + b * inner for a, b in ((q11, q22), (q22, q11)))
    d12, d66 = 0.3 * q22 * whole, PLY["shear"] * whole
    exact = 0.5 * math.pi / SIDE**2 * math.sqrt((d11 + 2.0 * d12 + 4.0 * d66 + d22) / (DENSITY * 7.5e-4))
    errors = [abs(frequencies(plate(plies, mesh), tmp_path)[0] / exact - 1.0) for mesh in (8, 16)]
    assert errors[1] < 5e-3
    assert errors[1] < 0.4 * errors[0]


def test_isotropic_plies_are_an_isotropic_plate(tmp_path: Path) -> None:
    """Plies of an isotropic material have its frequencies at any angles."""
    isotropic = {"young": 70e9, "young_across": 70e9, "shear": 70e9 / 2.6, "poisson": 0.3}
    plies = [isotropic | {"thickness": 2.5e-4, "angle": angle} for angle in (0.3, -1.1, 0.7, 2.0)]
    found = frequencies(plate(plies, 4), tmp_path)
    np.testing.assert_allclose(found, frequencies(plate([], 4), tmp_path), rtol=1e-6)


def test_plies_of_a_pattern_have_angles_in_its_flat_state() -> None:
    """Corners of all triangles of a folded Miura sheet have the places of the flat pattern, up to a translation."""
    sheet = {
        "kind": "miura", "columns": 3, "rows": 2, "a": 0.1, "b": 0.08, "sector_angle": 1.0, "fold_angle": 0.7,
        "facets": "flexible", "mesh_size": 0.2, "thickness": 2.5e-4, "ply": [PLY | {"thickness": 2.5e-4, "angle": 0.3}],
    }  # fmt: skip
    made = Sheet.model_validate(sheet)
    mesh, pattern = flexible_mesh(made), pattern_of(made)
    vertex = np.argmin(np.linalg.norm(mesh.positions[:, None] - pattern.vertices, axis=2), axis=1)
    for triangle, plane in zip(mesh.triangles, mesh.plane, strict=True):
        np.testing.assert_allclose(np.diff(plane, axis=0), np.diff(pattern.flat[vertex[triangle]], axis=0), atol=1e-12)


def test_folded_strip_of_plies(tmp_path: Path) -> None:
    """A zigzag strip bends along x: plies without contraction have the force of an isotropic sheet with their D11."""
    sheet = {
        "kind": "zigzag", "columns": 4, "a": 0.08, "b": 0.01, "fold_angle": "60 deg", "facets": "flexible",
        "mesh_size": 0.02, "thickness": 3e-4, "support": [{"at": "facet 1"}],
    }  # fmt: skip
    case = {
        "crease": {"stiffness_per_length": 0.2}, "solve": {"method": "static"}, "save": {"every": 0.01},
        "drive": [{"edge": "right", "direction": [1, 0, 0], "speed": 1e-3, "travel": 0.02}],
    }  # fmt: skip

    def force(young: float, **plies: Any) -> float:
        data = case | {"sheet": sheet | plies, "material": {"young": young, "poisson": 0.0, "density": DENSITY}}
        return float(fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False).summary["final_force"])

    along, across = 20e9, 5e9
    ply = {"young": along, "young_across": across, "poisson": 0.0, "thickness": 3e-4}
    assert force(along, ply=[ply | {"shear": along / 2.0}]) == pytest.approx(force(along), rel=2e-3)
    turned = ply | {"shear": across / 2.0, "angle": "90 deg"}
    assert force(along, ply=[turned]) == pytest.approx(force(across), rel=2e-3)


def test_tubes_have_no_flat_pattern_for_plies() -> None:
    sheet = {
        "kind": "kresling", "sides": 6, "rows": 1, "radius": 0.1, "height": 0.1, "twist": 0.5, "facets": "flexible",
        "mesh_size": 0.05, "thickness": 2.5e-4, "ply": [PLY | {"thickness": 2.5e-4}],
    }  # fmt: skip
    data = {"sheet": sheet, "material": {"young": 70e9, "density": DENSITY}, "crease": {"stiffness_per_length": 0.1}}
    with pytest.raises(CaseError, match="the angles of plies need a flat pattern"):
        fsm.load(data | {"solve": {"method": "static", "end_time": 1.0}}, folder=Path.cwd()).check()


def test_off_axis_modulus() -> None:
    """1/E_x = c^4/E1 + (1/G12 - 2 nu12/E1) c^2 s^2 + s^4/E2."""
    angle = 0.5
    stretch = laminate_of([SheetPly(thickness=1e-3, angle=angle, **PLY)], DENSITY).stretch
    c, s = math.cos(angle), math.sin(angle)
    exact = c**4 / 140e9 + (1.0 / 5e9 - 0.6 / 140e9) * c * c * s * s + s**4 / 10e9
    assert np.linalg.inv(stretch / 1e-3)[0, 0] == pytest.approx(exact, rel=1e-12)


def test_coupling_of_an_unsymmetric_strip() -> None:
    """0/90: B11 = -(Q11 - Q22) t^2/8 with the stiffer ply below."""
    plies = [SheetPly(thickness=5e-4, angle=angle, **PLY) for angle in (0.0, math.pi / 2)]
    stiffer = 130e9 / (1.0 - 0.09 / 14.0)
    assert laminate_of(plies, DENSITY).coupling[0, 0] == pytest.approx(-stiffer * 1e-6 / 8.0, rel=1e-9)


@pytest.mark.parametrize(
    ("plies", "thickness", "text"),
    [
        ([0.0, "90 deg"], 5e-4, "not symmetric about the middle surface"),
        ([0.0], 1e-3, "make them equal"),
    ],
)
def test_faults_are_told(plies: list[Any], thickness: float, text: str) -> None:
    data = plate([PLY | {"thickness": 2.5e-4, "angle": angle} for angle in plies])
    data["sheet"]["thickness"] = thickness
    with pytest.raises(CaseError, match=text):
        fsm.load(data, folder=Path.cwd()).check()


def test_check_prints_the_stiffness() -> None:
    data = plate([PLY | {"thickness": 2.5e-4, "angle": angle} for angle in (0.0, "90 deg", 0.0)])
    text = str(fsm.load(data, folder=Path.cwd()).check())
    assert "3 plies, 1.2 kg/m^2" in text
    assert "D (N m): " in text
