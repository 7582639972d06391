"""Folded sheets of rigid facets against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import fsolve

import fsm
from fsm.analyses.choose import analysis_of
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.builders.scene import build_scene
from fsm.builders.sheet import sheet as builder
from fsm.builders.sheet.sheet_joints import sheet_joints
from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case
from fsm.errors import CaseError, NotConverged
from fsm.model.bodies.group import BodyState
from fsm.model.compile.compile import compile_scene
from fsm.model.elements.actuators import ActuatorGroup
from fsm.run.run_case import run_case
from fsm.solve.equations.newton import equilibrium
from tests.runs import run
from validation.sheets.origami import miura_force

CASE = Path(__file__).parents[2] / "folding_cases" / "miura_push" / "case.toml"


def curve(folder: Path) -> np.ndarray:
    return np.genfromtxt(folder / "force.csv", delimiter=",", skip_header=1)


def test_closed_form_has_the_published_values() -> None:
    """Independent values: force per vertex of the edge at three shortenings."""
    shape = (10, 10, 2.0, 2.0, math.pi / 3.0, math.radians(15.0), 0.1)
    for shortening, force in ((0.526119, 0.781116), (1.14675, 0.846382), (4.07405, 0.731824)):
        assert miura_force(shortening, *shape) / 11.0 == pytest.approx(force, rel=2e-6)


def test_miura_push(tmp_path: Path) -> None:
    """The shipped case follows the closed form to 2e-6 of the largest force, and to 1e-6 from a tenth of the travel on."""
    run_case(load_case(CASE), tmp_path, progress=False)
    travel, force = curve(tmp_path)[:, :2].T
    exact = [miura_force(x, 10, 10, 2.0, 2.0, math.pi / 3.0, math.radians(15.0), 0.1) for x in travel]
    assert travel[-1] == pytest.approx(4.2)
    np.testing.assert_allclose(force, exact, rtol=0.0, atol=2e-6 * max(exact))
    late = travel > 0.42
    np.testing.assert_allclose(force[late], np.array(exact)[late], rtol=1e-6)


@pytest.mark.parametrize(
    ("columns", "rows", "a", "b", "sector", "fold"),
    [(4, 6, 0.02, 0.03, 1.2, 0.9), (3, 3, 3.0, 1.0, 0.7, 0.3), (5, 2, 0.1, 0.1, 1.0, 0.5)],
)
def test_miura_of_other_shapes(
    tmp_path: Path, columns: int, rows: int, a: float, b: float, sector: float, fold: float
) -> None:
    """Odd numbers of panels, unequal sides, and other sizes by the keys of the shipped case."""
    travel = 0.2 * columns * b
    keys = {"columns": columns, "rows": rows, "a": a, "b": b, "sector_angle": sector, "fold_angle": fold}
    changed = [f"sheet.{key}={value}" for key, value in keys.items()]
    changed += [f"drive.0.travel={travel}", f"save.every={travel / 4}", "crease.stiffness_per_length=0.02"]
    run_case(load_case(CASE, changed), tmp_path, progress=False)
    points, force = curve(tmp_path)[:, :2].T
    exact = [miura_force(x, columns, rows, a, b, sector, fold, 0.02) for x in points]
    np.testing.assert_allclose(force, exact, rtol=0.0, atol=1e-5 * max(exact))
    assert np.median(np.abs(force - exact)) < 1e-6 * max(exact)


def test_force_does_not_depend_on_the_rigid_joints(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Locked joints have no flexibility, whatever their stiffness; without multipliers, the error is inverse to it."""
    travel, changed = 0.3, ["sheet.columns=4", "sheet.rows=4", "save.every=0.1", "drive.0.travel=0.3"]
    exact = miura_force(travel, 4, 4, 2.0, 2.0, math.pi / 3.0, math.radians(15.0), 0.1)

    def error(factor: float) -> float:
        monkeypatch.setattr(builder, "RIGID", factor)
        run_case(load_case(CASE, changed), tmp_path / "run", progress=False)
        return float(abs(curve(tmp_path / "run")[-1, 1] / exact - 1.0))

    assert error(1e5) < 1e-7 and error(builder.RIGID) < 1e-7
    monkeypatch.setattr(builder, "_HINGE", ())
    monkeypatch.setattr(builder, "DIRECTIONS", ())
    assert 1e-4 < error(1e5) < 1e-2


def zigzag_case(**changes: object) -> Case:
    sheet = {"kind": "zigzag", "columns": 2, "a": 0.1, "b": 0.05, "fold_angle": 0.5, "thickness": 1e-3}
    sheet["support"] = [{"at": "edge left"}]
    drive = {"edge": "right", "direction": [-1, 0, 0], "speed": 1e-3, "travel": 0.02}
    data = {
        "sheet": sheet | changes, "material": {"young": 3e9, "density": 1000.0}, "crease": {"stiffness_per_length": 0.2},
        "drive": [drive], "solve": {"method": "static"}, "save": {"every": 0.01},
    }  # fmt: skip
    return Case.model_validate(data)


def test_measured_crease_scales_with_its_length() -> None:
    """A measured linear curve of a crease of 20 mm has the moment of a linear law with the same stiffness per length."""
    linear = analysis_of(zigzag_case()).system
    data = zigzag_case().model_copy(update={"crease": None}).model_dump(exclude_none=True)
    data["crease"] = {"law": "spline", "angle": [-2.0, -1.0, 1.0, 2.0], "moment": [-8e-3, -4e-3, 4e-3, 8e-3], "width": 0.02}
    measured = analysis_of(Case.model_validate(data)).system
    forces = []
    for system in (linear, measured):
        q = system.initial()[0]
        forces.append(system.force(10.0, system.retract(q, 1e-3 * np.sin(np.arange(system.nu))), None))
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-6, atol=1e-9 * np.abs(forces[0]).max())


def test_mass_and_bodies_of_a_sheet() -> None:
    scene = build_scene(zigzag_case())
    assert sum(body.mass for body in scene.bodies) == pytest.approx(1000.0 * 1e-3 * 2 * 0.1 * 0.05)
    assert [body.name for body in scene.bodies] == ["facet 1", "facet 2", "edge right"]
    (crease,) = [element for element in scene.elements if element.kind == "crease"]
    assert abs(crease.initial_angle or 0.0) == pytest.approx(1.0)
    assert crease.rotation[1] == pytest.approx(0.2 * 0.05)


def test_bend_lines_have_the_preset_or_the_given_stiffness() -> None:
    def stiffness(**changes: object) -> float:
        scene = build_scene(zigzag_case(facets="bend-lines", **changes))
        return next(element for element in scene.elements if element.name == "bend line 1").rotation[1]

    length = math.hypot(0.1, 0.05)
    plate = 3e9 * 1e-9 / (12.0 * (1.0 - 0.3**2))
    assert stiffness() == pytest.approx(plate * (length / 1e-3) ** (1.0 / 3.0))
    assert stiffness(bend_stiffness_per_length=0.7) == pytest.approx(0.7 * length)


def test_a_stiffness_of_a_strip_is_refused() -> None:
    case = zigzag_case()
    data = case.model_dump(exclude_none=True) | {"crease": {"law": "linear", "stiffness": 0.2}}
    with pytest.raises(CaseError, match=r"give crease\.stiffness_per_length"):
        build_scene(Case.model_validate(data))


FOLD_CASE = CASE.parents[1] / "fold_file" / "case.toml"


def test_sheet_folds_itself_from_flat(tmp_path: Path) -> None:
    """A pattern file folded from flat: tangents of half the fold angles have the ratio cos(sector angle) at every vertex."""
    loaded = load_case(FOLD_CASE)
    summary = run_case(loaded, tmp_path, progress=False)
    table = np.genfromtxt(tmp_path / "channels.csv", delimiter=",", names=True, deletechars="")
    pattern = pattern_of(loaded.case.sheet)
    angles = np.array([table[name] for name in table.dtype.names[1:]]).T
    columns = np.abs(np.diff(pattern.vertices[pattern.edges[pattern.creases], 0], axis=1)[:, 0]) < 1e-9
    np.testing.assert_allclose(angles[0], 0.0, atol=1e-9)
    assert (np.sign(angles[-1]) == np.sign(pattern.target[pattern.creases])).all()
    assert np.degrees(np.abs(angles[-1])).min() > 150.0
    tangents = np.tan(0.5 * np.abs(angles[5:]))
    along, across = tangents[:, columns], tangents[:, ~columns]
    np.testing.assert_allclose(along.min(axis=1), along.max(axis=1), rtol=1e-4)
    np.testing.assert_allclose(along.mean(axis=1) / across.mean(axis=1), math.cos(math.radians(65.0)), rtol=1e-4)
    assert summary["unstable_equilibria"] == 0 and summary["joint_opening"] < 1e-6


def test_complete_case_needs_no_pattern_file(tmp_path: Path) -> None:
    """The text of a loaded case contains the pattern, and gives the same scene elsewhere."""
    loaded = load_case(FOLD_CASE)
    copy = tmp_path / "copy.toml"
    copy.write_text(loaded.text, encoding="utf-8")
    assert build_scene(load_case(copy).case) == build_scene(loaded.case)


def test_actuator_turns_a_single_crease() -> None:
    """One crease: the fold angle at equilibrium is the rest angle; force and power of the actuator agree."""
    case = Case.model_validate({
        "sheet": {
            "vertices": [[0, 0, 0], [0.1, 0, 0], [0.1, 0.05, 0], [0, 0.05, 0], [0.2, 0, 0], [0.2, 0.05, 0]],
            "edges": [[1, 2]], "assignment": ["V"], "angles": [2.0], "faces": [[0, 1, 2, 3], [1, 4, 5, 2]],
            "fold_to": 0.5, "thickness": 1e-3, "support": [{"at": "facet 1"}],
        },
        "material": {"young": 3e9, "density": 1000.0, "damping": 0.0}, "crease": {"stiffness_per_length": 0.2},
        "solve": {"method": "static", "end_time": 10.0},
    })  # fmt: skip
    analysis = analysis_of(case)
    system = analysis.system
    q = system.initial()[0]
    for t in (5.0, 10.0):
        q = equilibrium(system, q, np.array([t]))
        normal = np.array([2.0 * (q[4] * q[6] + q[3] * q[5]), 1.0 - 2.0 * (q[4] ** 2 + q[5] ** 2)])
        assert abs(math.atan2(*normal)) == pytest.approx(0.1 * t, abs=1e-7)
    u = np.random.default_rng(1).normal(size=system.nu)
    (group,) = [group for group in system.groups if isinstance(group, ActuatorGroup)]
    poses, rates = system.place(7.0, q, u)
    force = np.zeros_like(rates)
    group.add_force(BodyState(7.0, poses, rates), force)
    moving = np.array(rates)
    power = float(np.sum(force * moving))
    assert group.energy(BodyState(7.0, poses, rates))[2] == pytest.approx(power, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["sheet.scale=1", 'sheet.pattern="none.fold"'], "cannot read"),
        (['sheet.pattern="case.toml"'], "is no .fold, .svg, .cp, .opx or .ori file"),
        (["sheet.columns=3"], "`columns` is not used by a pattern file"),
        (["solve.end_time=none"], "solve.end_time"),
        (['crease.law="spline"', "crease.stiffness_per_length=none", "crease.angle=[0,1,2,3]", "crease.moment=[0,1,2,3]",
          "crease.width=0.01"], "is used with a linear crease law only"),
        (['sheet.support.0.at="facet 13"'], "there is no number 13; the sheet has 12 facets"),
        (['sheet.support.0.fixed=["x"]'], "a facet is held as a whole"),
    ],
)  # fmt: skip
def test_faults_of_a_sheet(changes: list[str], message: str) -> None:
    with pytest.raises(CaseError) as error:
        build_scene(load_case(FOLD_CASE, changes).case)
    assert message in str(error.value)


@pytest.mark.parametrize("letter", ["U", "F"])
def test_folding_needs_mountains_or_valleys(letter: str) -> None:
    sheet = {
        "vertices": [[0, 0, 0], [0.1, 0, 0], [0.1, 0.05, 0], [0, 0.05, 0], [0.2, 0, 0], [0.2, 0.05, 0]],
        "edges": [[1, 2]], "assignment": [letter], "angles": [0.0], "faces": [[0, 1, 2, 3], [1, 4, 5, 2]],
        "fold_to": 0.5, "thickness": 1e-3, "support": [{"at": "facet 1"}],
    }  # fmt: skip
    data = {
        "sheet": sheet, "material": {"young": 3e9, "density": 1000.0}, "crease": {"stiffness_per_length": 0.2},
        "solve": {"method": "static", "end_time": 10.0},
    }  # fmt: skip
    with pytest.raises(CaseError, match=r"sheet\.fold_to: needs mountains or valleys with fold angles"):
        build_scene(Case.model_validate(data))


@pytest.mark.parametrize(
    ("facets", "of", "text"),
    [
        ("flexible", "bend line", "because facets bend everywhere"),
        ("flexible", "bend line 1", "because facets bend everywhere"),
        ("rigid", "bend line", "because facets do not bend"),
        ("bend-lines", "bend line 1", ""),
        ("bars", "bend line", ""),
    ],
)
def test_bend_lines_have_own_stiffness_only_where_they_are_joints(facets: str, of: str, text: str) -> None:
    sheet = {
        "vertices": [[x, y, 0.0] for x in (0.0, 0.1, 0.2, 0.3) for y in (0.0, 0.05)],
        "edges": [[2, 3], [4, 5]], "assignment": ["V", "J"], "angles": [0.0, 0.0],
        "faces": [[0, 2, 3, 1], [2, 4, 5, 3], [4, 6, 7, 5]], "facets": facets, "thickness": 1e-3,
        "support": [{"at": "facet 1"}], "crease": [{"of": of, "stiffness_per_length": 7.0}],
    }  # fmt: skip
    sheet |= {"mesh_size": 0.05} if facets == "flexible" else {}
    case = Case.model_validate({
        "sheet": sheet, "material": {"young": 3e9, "poisson": 0.3, "density": 1000.0},
        "crease": {"stiffness_per_length": 0.2}, "solve": {"method": "static", "end_time": 10.0},
    })  # fmt: skip
    if not text:
        bent = [joint for joint in sheet_joints(case, pattern_of(case.sheet)) if joint.kind == "bend line"]
        assert bent and bent[0].stiffness == pytest.approx(7.0 * 0.05)
        return
    with pytest.raises(CaseError, match=rf'^sheet\.crease\.0\.of: "{of}" .*{text}; remove this item'):
        build_scene(case)


@pytest.mark.parametrize("facets", ["rigid", "bend-lines"])
def test_folded_start_of_a_flat_pattern(facets: str) -> None:
    """Distances in facets are kept, the first facet stays in place, and the creases fold to their sides at rest."""
    flat = pattern_of(load_case(FOLD_CASE, [f'sheet.facets="{facets}"']).case.sheet)
    loaded = load_case(FOLD_CASE, [f'sheet.facets="{facets}"', "sheet.fold=0.3", "sheet.fold_to=none"])
    folded = pattern_of(loaded.case.sheet)
    np.testing.assert_allclose(folded.lengths, flat.lengths, rtol=1e-10)
    np.testing.assert_allclose(folded.vertices[list(folded.faces[0])], flat.vertices[list(flat.faces[0])], atol=1e-12)
    angles = folded.fold_angles()
    creases = [k for k in folded.creases if folded.assignment[k] in "MV"]
    assert (np.sign(angles[creases]) == np.sign(folded.target[creases])).all()
    assert 30.0 < np.degrees(np.abs(angles[creases])).mean() < 80.0
    if facets == "rigid":
        columns = np.abs(np.diff(folded.flat[folded.edges[creases], 0], axis=1)[:, 0]) < 1e-9
        tangents = np.tan(0.5 * np.abs(angles[creases]))
        ratio = tangents[columns].mean() / tangents[~columns].mean()
        assert ratio == pytest.approx(math.cos(math.radians(65.0)), rel=1e-9)
    system = analysis_of(loaded.case).system
    assert system.energy(0.0, system.initial()[0], None).potential["creases"] < 1e-12


def test_a_pattern_that_cannot_fold_is_refused() -> None:
    """Three creases at one inner vertex cannot fold with rigid facets."""
    star = Case.model_validate({
        "sheet": {
            "vertices": [[0, 0, 0], [0.1, 0, 0], [-0.05, 0.09, 0], [-0.05, -0.09, 0]], "edges": [[0, 1], [0, 2], [0, 3]],
            "assignment": ["M", "V", "M"], "angles": [-3.0, 3.0, -3.0], "faces": [[0, 1, 2], [0, 2, 3], [0, 3, 1]],
            "fold": 0.5, "thickness": 1e-3,
        },
        "material": {"young": 3e9, "density": 1000.0}, "crease": {"stiffness_per_length": 0.2},
        "solve": {"end_time": 10.0},
    })  # fmt: skip
    with pytest.raises(CaseError, match=r"sheet\.fold: .*rigid facets"):
        build_scene(star)


def test_folded_parts_are_in_the_summary(tmp_path: Path) -> None:
    """All creases of a flat-foldable sheet reach their rest angles, except for the lag due to the dampers."""
    summary = run_case(load_case(FOLD_CASE, ["save.interval=50"]), tmp_path, progress=False, figures=False)
    assert 0.95 < summary["folded"]["least"] <= summary["folded"]["median"] < 1.05
    assert summary["folded"]["creases"] == {} and not any("rest angle" in text for text in summary["warnings"])


def test_flasher_folds_around_its_hub(tmp_path: Path) -> None:
    """Facets with bend lines reach the folded state; rigid facets cannot leave the flat state, and the run warns."""
    case = Path(builder.__file__).parents[2] / "cli" / "templates" / "flasher.toml"
    summary = run_case(load_case(case, ["save.interval=50"]), tmp_path / "bends", progress=False, figures=False)
    assert summary["folded"]["least"] > 0.9 and summary["folded"]["creases"] == {}
    changes = ["save.interval=50", 'sheet.facets="rigid"', "sheet.sides=4"]
    summary = run_case(load_case(case, changes), tmp_path / "rigid", progress=False, figures=False)
    assert summary["folded"]["median"] < 0.5 and any("less than half of the rest angle" in w for w in summary["warnings"])


CROSS = """
[sheet]
vertices = [
    [-0.1, -0.1, 0], [0, -0.1, 0], [0.1, -0.1, 0], [-0.1, 0, 0], [0, 0, 0], [0.1, 0, 0], [-0.1, 0.1, 0], [0, 0.1, 0],
    [0.1, 0.1, 0],
]
faces = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]
edges = [[1, 4], [4, 7], [3, 4], [4, 5]]
assignment = ["V", "V", "V", "V"]
angles = [3, 3, 3, 3]
fold_to = 0.9
facets = "rigid"
thickness = 1e-4
support = [{ at = "facet 1" }]
[material]
young = 3e9
density = 1000
[crease]
stiffness_per_length = 0.05
[solve]
method = "static"
end_time = 100
[save]
interval = 25
"""


def test_creases_that_stay_behind_are_named_with_the_reason(tmp_path: Path) -> None:
    """Two crossing lines of a square cannot fold together: the sheet folds along one of them."""
    _, summary = run(tmp_path, CROSS)
    assert summary["folded"]["least"] < 1e-3 and len(summary["folded"]["creases"]) == 2
    (text,) = [warning for warning in summary["warnings"] if "less than half of the rest angle" in warning]
    told = "rigid facets do not allow all these fold angles together: the mountains and valleys at vertex 5 cannot all"
    assert told in text
    energy = summary["folded"]["strain_energy"]
    assert energy["mountains_and_valleys"] == pytest.approx(0.05 * 0.2 * 2.7**2 / 2.0, rel=0.02)
    assert energy["bend_lines"] == energy["unassigned"] == 0.0


@pytest.mark.parametrize(
    ("supports", "free"),
    [
        ('[{at="edge left", fixed=["x"]}, {at="vertex 1", fixed=["y", "z"]}]', "rotate about (1, 0, 0) through"),
        ('[{at="edge left", fixed=["x"]}]', "move along"),
        ("[]", "and rotate about (1, 0, 0)"),
    ],
)
def test_a_sheet_that_can_move_as_a_whole_is_refused(supports: str, free: str) -> None:
    """The free motions are named; the shipped supports leave none."""
    changes = ["sheet.columns=4", "sheet.rows=4", "drive.0.travel=0.1"]
    build_scene(load_case(CASE, changes).case)
    with pytest.raises(CaseError, match=r"sheet\.support: supports and drives let the sheet ") as error:
        build_scene(load_case(CASE, [*changes, f"sheet.support={supports}"]).case)
    assert free in str(error.value)


def test_motion_of_a_sheet(tmp_path: Path) -> None:
    """A released sheet opens towards its rest angles, keeps its facets together, and loses energy in its dampers only."""
    changes = ["sheet.fold=0.3", "sheet.fold_to=none", 'solve.method="auto"', "solve.end_time=0.005", "save.interval=0.0005"]
    summary = run_case(load_case(FOLD_CASE, [*changes, 'crease.rest_angle="20 deg"']), tmp_path, progress=False)
    table = np.genfromtxt(tmp_path / "channels.csv", delimiter=",", skip_header=1)
    assert (np.abs(table[-1, 1:]) < np.abs(table[0, 1:])).all()
    assert summary["method"] == "generalized-alpha" and summary["steps"] < 2000
    assert summary["energy_error"] < 1e-3 and summary["joint_opening"] < 1e-4


def test_rigid_facets_that_cannot_follow_a_drive(tmp_path: Path) -> None:
    """A tube of rigid triangles cannot be compressed: the run warns that its creases open."""
    _, summary = run(
        tmp_path,
        """
        [sheet]
        kind = "kresling"
        sides = 6
        rows = 1
        radius = 0.05
        height = 0.04
        twist = "35 deg"
        thickness = "0.2 mm"
        support = [{ at = "edge bottom" }]
        [material]
        young = 3e9
        density = 800
        [crease]
        stiffness_per_length = 0.1
        [[drive]]
        edge = "top"
        direction = [0, 0, -1]
        guide = false
        speed = "1 mm/s"
        travel = "5 mm"
        [solve]
        method = "static"
        """,
    )
    assert any("rigid facets cannot follow this motion" in warning for warning in summary["warnings"])
    assert summary["joint_opening"] > 1e-4


def test_a_vertex_that_does_not_move_cannot_be_driven(tmp_path: Path) -> None:
    """Vertex 5 belongs to the fixed facet; the springs of its drive count as joints that open."""
    template = Path(fsm.__file__).parent / "cli" / "templates" / "pattern.toml"
    drive = "drive=[{at='vertex 5', direction=[1, 0, 0], guide=false, speed='1 mm/s', travel='12 mm'}]"
    changes = ["sheet.fold_to=none", "sheet.fold=0.5", "sheet.facets=rigid", drive, "solve.end_time=none", "save=none"]
    case = load_case(template, changes)
    with pytest.raises(NotConverged, match="the drive pulls beyond the full length of the structure"):
        run_case(case, tmp_path, progress=False, figures=False)


def test_a_long_chain_of_facets(tmp_path: Path) -> None:
    """Ten panels, the first held and the end pulled: round-off of the joints must not exceed the small forces at the
    start."""
    count, length, width, fold, stiffness, travel = 10, 0.042, 0.044, math.radians(41.0), 0.565, 0.0249
    data = {
        "sheet": {
            "kind": "zigzag", "columns": count, "a": length, "b": width, "fold_angle": fold, "thickness": 5e-4,
            "support": [{"at": "facet 1"}],
        },
        "material": {"young": 5.73e9, "density": 800.0}, "crease": {"stiffness_per_length": stiffness},
        "drive": [{"edge": "right", "direction": [1, 0, 0], "speed": "0.5 mm/s", "travel": travel, "guide": False}],
        "solve": {"method": "static"},
    }  # fmt: skip
    summary = fsm.load(data, folder=tmp_path).run(tmp_path / "out", figures=False).summary
    angles = fold * (-1.0) ** np.arange(count)
    rest = np.diff(angles)

    def equations(unknown: np.ndarray, part: float) -> np.ndarray:
        """Balance of moments of the free panels, whose force along x is the last unknown, and the length."""
        turned, force = np.concatenate([angles[:1], unknown[:-1]]), unknown[-1]
        moments = stiffness * width * (np.diff(turned) - rest)
        balance = moments - np.append(moments[1:], 0.0) + force * length * np.sin(turned[1:])
        gap = length * (np.cos(turned) - np.cos(angles)).sum() - travel * part
        return np.append(balance / (stiffness * width), gap / length)

    unknown = np.append(angles[1:], 0.0)
    for part in np.linspace(0.0, 1.0, 11)[1:]:
        unknown = fsolve(equations, unknown, args=(part,), xtol=1e-12)
    assert np.abs(equations(unknown, 1.0)).max() < 1e-9
    assert summary["final_force"] == pytest.approx(unknown[-1], rel=1e-4)


def test_locked_directions_need_a_stiffness() -> None:
    scene = build_scene(zigzag_case())
    joints = (element for element in scene.elements if element.kind == "joint")
    elements = [element.model_copy(update={"locked": ("e1", "psi")}) for element in joints]
    with pytest.raises(CaseError, match=r"scene\.elements\.0\.locked\.1: psi has no stiffness"):
        compile_scene(scene.model_copy(update={"elements": tuple(elements)}))
