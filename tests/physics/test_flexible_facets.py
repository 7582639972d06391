"""Flexible facets against published shells and exact solutions, on coarse meshes from case files."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm.builders.scene import build_scene
from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case
from fsm.errors import CaseError
from fsm.results.store import read_solution
from fsm.run.run_case import run_case
from validation.sheets.strip import by_flexible_facets, by_rigid_facets, by_segments, elastica, forces_of

CASES = Path(__file__).parents[2] / "folding_cases"
CASE, MIURA = CASES / "slit_annulus" / "case.toml", CASES / "miura_push" / "case.toml"


def plate(**changes: Any) -> dict[str, Any]:
    """Cantilever of Sze, Liu and Lo (2004), section 3.1."""
    sheet = {
        "kind": "plate", "length": 10.0, "width": 1.0, "thickness": 0.1, "facets": "flexible", "mesh": [8, 1],
        "support": [{"at": "edge left", "clamped": True}], "probe": [{"name": "tip", "at": "vertex 2"}],
    }  # fmt: skip
    return {
        "sheet": sheet | changes,
        "material": {"young": 1.2e6, "poisson": 0.0, "density": 1.0},
        "load": [{"at": "edge right", "force": [0.0, 0.0, 4.0]}],
        "solve": {"method": "static", "end_time": 1.0, "rtol": 1e-4},
        "save": {"interval": 0.5},
    }


def tip(data: dict[str, Any], folder: Path) -> list[float]:
    return fsm.load(data, folder=folder).run(folder / "out", figures=False).summary["probe_displacement"]["tip"]


def test_slit_annulus(tmp_path: Path) -> None:
    """A tenth of the load of Sze, Liu and Lo (2004), table 4: w 4.277 and 5.876; the mesh has 6 x 40 cells."""
    changed = ["sheet.mesh=[6, 40]", "load.0.force_per_length=[0, 0, 0.08]", "save.interval=0.5", "solve.rtol=1e-3"]
    summary = run_case(load_case(CASE, changed), tmp_path, progress=False, figures=False)
    found = summary["probe_displacement"]
    assert found["inner"][2] == pytest.approx(4.277, rel=1.5e-2)
    assert found["outer"][2] == pytest.approx(5.876, rel=1.2e-2)
    assert summary["newton_iterations"] < 60
    assert summary["folded"] == {}  # a plate has no creases


def test_graded_mesh_resolves_the_free_edges(tmp_path: Path) -> None:
    """A tenth of the load on 6 x 40 cells: errors of 0.6 % with equal cells, and 0.2 % with small cells at both free edges.

    The limits 4.2636 and 5.8600 are those of graded meshes with 8 x 64 to 14 x 112 cells.
    """
    changed = ["sheet.mesh=[6, 40]", "load.0.force_per_length=[0, 0, 0.08]", "save.interval=0.5", "solve.rtol=1e-3"]
    errors = []
    for grading in (0, 1):
        case = load_case(CASE, [*changed, f"sheet.mesh_grading=[{grading}, 0]"])
        found = run_case(case, tmp_path / str(grading), progress=False, figures=False)["probe_displacement"]
        errors.append([abs(found["inner"][2] / 4.2636 - 1.0), abs(found["outer"][2] / 5.86 - 1.0)])
    assert max(errors[1]) < 2.5e-3 < min(errors[0])


@pytest.mark.parametrize("shift", [0.0, 0.3], ids=["regular", "random"])
def test_cantilever(tmp_path: Path, shift: float) -> None:
    """End shear 4: -u 3.286 and w 6.698 (Sze, Liu and Lo, 2004)."""
    x, y, z = tip(plate(mesh=[12, 2], mesh_shift=shift), tmp_path)
    assert x == pytest.approx(-3.286, rel=2e-3)
    assert z == pytest.approx(6.698, rel=1e-3)
    assert abs(y) < 1e-3


def test_roll_up(tmp_path: Path) -> None:
    """The end moment 2 pi EI/L bends a strip to a circle; the gap decreases with finer meshes."""
    ends = []
    for cells in (8, 24):
        data = plate(length=12.0, mesh=[cells, 2])
        data["load"] = [{"at": "edge right", "moment": [0.0, -50.0 * math.pi / 3.0, 0.0]}]
        x, _, z = tip(data, tmp_path)
        ends.append(math.hypot(12.0 + x, z) / 12.0)
    assert ends[1] < 2e-3
    assert ends[1] < 0.1 * ends[0]


def test_load_along_an_edge_is_its_force() -> None:
    """A force per length has the same sum as a force; both act on the same points."""
    given = plate()
    given["load"] = [{"at": "edge right", "force_per_length": [0.0, 0.0, 4.0]}]
    one, two = (build_scene(Case.model_validate(data)).loads for data in (plate(), given))
    assert [load.body for load in one] == [load.body for load in two]
    assert sum(load.force[2] for load in one) == pytest.approx(4.0)
    np.testing.assert_allclose([load.force for load in one], [load.force for load in two])


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"facets": "rigid"}, 'give facets = "flexible"'),
        ({"mesh": None}, "give either `mesh`"),
        ({"support": [{"at": "edge slit-end"}]}, "is not an edge of the sheet"),
        ({"support": [{"at": "vertex 5"}]}, "the sheet has 4 vertices"),
        ({"probe": [{"name": "a", "at": "edge left"}]}, "give one vertex"),
        ({"mesh": [1000, 1000]}, "at most 100,000 are allowed"),
        ({"support": [{"at": "vertex 1", "mirror": "x"}]}, "is not a part of the outline"),
    ],
)
def test_faults_are_told(changes: dict[str, Any], text: str) -> None:
    data = plate()
    data["sheet"] = {key: value for key, value in (data["sheet"] | changes).items() if value is not None}
    with pytest.raises(CaseError, match=text):
        fsm.load(data, folder=Path.cwd()).check()


def test_load_needs_a_place() -> None:
    data = plate()
    data["load"] = [{"force": [0.0, 0.0, 1.0]}]
    with pytest.raises(CaseError, match="give `body`"):
        fsm.load(data, folder=Path.cwd())


def test_thick_facets_are_rigid_facets(tmp_path: Path) -> None:
    """A pushed Miura sheet of facets much stiffer than its creases has the force of rigid facets."""
    forces = []
    common = ["sheet.columns=2", "sheet.rows=2", "drive.0.travel=0.2", "save.every=0.1", "sheet.thickness=20 mm"]
    for facets, more in (("rigid", []), ("flexible", ["sheet.mesh_size=1.0"])):
        loaded = load_case(MIURA, [*common, f"sheet.facets={facets}", *more])
        forces.append(run_case(loaded, tmp_path / facets, progress=False, figures=False)["final_force"])
    assert forces[1] == pytest.approx(forces[0], rel=1e-3)


def test_hinged_roof(tmp_path: Path) -> None:
    """A quarter of a roof by arc length: limit point at 0.7421 of 3000 N (Sze, Liu and Lo, 2004), then a rising force."""
    sheet = {
        "kind": "plate", "length": 254.0, "width": 254.0, "radius": 2540.0, "mesh": [4, 4], "thickness": 12.7,
        "facets": "flexible",
        "support": [{"at": "edge left", "mirror": "x"}, {"at": "edge bottom", "mirror": "y"}, {"at": "edge right"}],
    }  # fmt: skip
    data = {
        "sheet": sheet, "material": {"young": 3102.75, "poisson": 0.3, "density": 1.0},
        "load": [{"name": "force", "at": "vertex 1", "force": [0.0, 0.0, -750.0]}],
        "solve": {"method": "arc-length", "end_time": 1.0}, "save": {"interval": 0.5},
    }  # fmt: skip
    fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False)
    with (tmp_path / "out" / "load.csv").open(encoding="utf-8") as file:
        rows = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
    force = rows[:, -2] / 750.0
    limit = int(np.argmax(np.diff(force) < 0.0))
    assert force[limit] == pytest.approx(0.7421, rel=2e-2)
    assert force[limit:].min() < 0.4 and force[-1] == pytest.approx(1.0)
    assert len(force) < 175  # 151 iterations; with displacements as the only unknowns there are 193


def test_modes_of_a_free_plate(tmp_path: Path) -> None:
    """Six rigid motions, then 13.468, 19.596 and 24.270 times sqrt(D/m)/a^2 (converged with Ritz's method)."""
    sheet = {
        "kind": "plate", "length": 1.0, "width": 1.0, "mesh": [8, 8], "mesh_shift": 0.2, "thickness": 0.01,
        "facets": "flexible",
    }  # fmt: skip
    data = {
        "sheet": sheet, "material": {"young": 70e9, "poisson": 0.3, "density": 2700.0},
        "step": [{"kind": "modes", "modes": 9}],
    }  # fmt: skip
    summary = fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False).summary
    unit = math.sqrt(70e9 * 0.01**3 / (12.0 * 0.91) / 27.0) / (2.0 * math.pi)
    found = np.array(summary["step"][0]["frequencies_hz"]) / unit
    assert np.abs(found[:6]).max() < 1e-2
    np.testing.assert_allclose(found[6:], [13.468, 19.596, 24.270], rtol=6e-3)


def test_strip_of_segments_and_flexible_sheet_agree(tmp_path: Path) -> None:
    """The pulled strip without contact, against the elastica: the error of the force decreases with order 2."""
    exact = elastica(0.02, 6)[1][-1]
    errors = [
        abs(forces_of(by_flexible_facets(cells, travel=0.02), tmp_path)[2] / exact - 1.0) for cells in (2, 4, 8)
    ]
    assert errors[2] < 2e-3
    assert math.log2(errors[1] / errors[2]) > 1.6 and math.log2(errors[0] / errors[1]) > 1.6
    assert forces_of(by_segments(40, travel=0.02), tmp_path)[2] == pytest.approx(exact, rel=5e-4)


def test_strip_of_segments_and_of_rigid_facets_agree(tmp_path: Path) -> None:
    """Rigid facets with springs of the bending stiffness are segments; only segments stretch."""
    rigid, segments = (forces_of(form(4, travel=0.02), tmp_path) for form in (by_rigid_facets, by_segments))
    np.testing.assert_allclose(rigid[:3], segments[:3], rtol=1e-4)


def test_wide_panels_bend_without_anticlastic_curvature(tmp_path: Path) -> None:
    """With Poisson's ratio the force is between those of beams and of plate strips."""
    beam, plate = (forces_of(by_segments(20, 0.3, 0.02, plate), tmp_path)[2] for plate in (False, True))
    facets, alone = (forces_of(by_flexible_facets(6, poisson, 0.02), tmp_path)[2] for poisson in (0.3, 0.0))
    assert 0.6 < (facets / alone - 1.0) / (plate / beam - 1.0) < 0.95


@pytest.mark.figures
def test_static_loads_have_a_curve_whose_area_is_the_energy(tmp_path: Path) -> None:
    """load.csv of a static step: a load along an edge of facets with cells of different sizes, which move differently."""
    sheet = {
        "vertices": [[0, 0, 0], [1, 0, 0], [4, 0, 0], [0, 2, 0], [1, 2, 0], [4, 2, 0]],
        "edges": [[0, 1], [1, 4], [4, 3], [3, 0], [1, 2], [2, 5], [5, 4]], "assignment": list("BFBBBBB"),
        "angles": [0.0] * 7, "faces": [[0, 1, 4, 3], [1, 2, 5, 4]], "facets": "flexible", "mesh_size": 0.8,
        "thickness": 0.03, "support": [{"at": "facet 1"}],
    }  # fmt: skip
    data = {
        "sheet": sheet, "material": {"young": 21e6, "poisson": 0.3, "density": 1000.0},
        "crease": {"stiffness_per_length": 1.0},
        "load": [{"name": "lift", "at": "edge top", "force_per_length": [0.0, 0.0, 1.0]}],
        "solve": {"method": "static", "end_time": 1.0}, "save": {"interval": 0.01},
    }  # fmt: skip
    fsm.load(data, folder=tmp_path).run(tmp_path / "out")
    with (tmp_path / "out" / "load.csv").open(encoding="utf-8") as file:
        rows = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
    assert (tmp_path / "out" / "load.png").is_file()
    way, force = rows[:, -1], rows[:, -2]
    assert force[-1] == pytest.approx(4.0) and len(rows) == 101
    work = read_solution(tmp_path / "out" / "result.h5").energy["work"][-1]
    assert float(np.trapezoid(force, way)) == pytest.approx(work, rel=1e-3)


@pytest.mark.parametrize("edge", ["inner", "outer", "slit-start", "slit-end"])
def test_driven_edges_of_an_annulus(edge: str) -> None:
    changed = [f'drive=[{{edge="{edge}", direction=[0, 0, 1], speed=1.0, travel=1.0}}]', "load=none", "sheet.mesh=[1, 4]"]
    (drive,) = build_scene(load_case(CASE, changed).case).drives
    assert drive.body == f"edge {edge}"


def test_a_lattice_has_four_edges() -> None:
    with pytest.raises(CaseError, match=r"drive\.0\.edge: must be .* in a \[lattice\]; it is .inner"):
        load_case(CASES / "rotating_squares" / "case.toml", ["drive.0.edge=inner"])
