"""Derivatives of responses: exact ones against differences of runs, propagation of scatter, mistakes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import fsm
from fsm.builders.scene import build_scene
from fsm.calibrate.response import force_response
from fsm.calibrate.sensitivity import vary_parameters
from fsm.calibrate.study import value_at
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.model.compile.compile import compile_scene
from fsm.studies.problem import case_problem, numbers_of
from fsm.studies.sensitivity import differentiated_peak

CASES = Path(__file__).parents[2] / "folding_cases"
STRIP = CASES / "strip_trial" / "case.toml"


def strip() -> fsm.Case:
    small = {"strip.segments_per_panel": 4, "drive.0.travel": "30 mm", "solve.rtol": 1e-7, "expect": None}
    return fsm.load(STRIP).set(small)


def test_derivatives_of_the_peak_of_a_strip() -> None:
    """All stiffnesses together scale the force: their relative derivatives add up to one, through contact too."""
    paths = ["material.young", "crease.stiffness", "contact.stiffness", "strip.fold_angle"]
    found = strip().sensitivity(by=paths)
    assert all(one.exact for one in found.derivatives)
    assert found.warnings == ()
    assert sum(found.elasticity(found[path]) for path in paths[:3]) == pytest.approx(1.0, abs=2e-4)
    angle = found["strip.fold_angle"]
    fine = strip().set("save.every", "0.1 mm")  # the peak of a run is that of its records
    peaks = [fine.set("strip.fold_angle", angle.value * (1.0 + k)).run().summary["peak_force"] for k in (-1e-4, 1e-4)]
    assert angle.slope == pytest.approx((peaks[1] - peaks[0]) / (2e-4 * angle.value), rel=1e-3)


def test_unequal_steps_at_the_peak_give_a_warning() -> None:
    """Dampers move the top of a parabola through states whose steps are unequal, as with a tight tolerance."""
    (text,) = strip().set("solve.rtol", 1e-9).sensitivity(by=["strip.fold_angle"]).warnings
    assert "solve.rtol" in text


def test_derivatives_do_not_depend_on_the_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """The force scales with all stiffnesses together; a smaller step of the numbers, also of those that move bodies, gives
    the same derivatives.
    """
    case = strip().set({"solve.rtol": 1e-8, "material.damping": None, "strip.segments_per_panel": 2})._loaded.case
    paths = ["material.young", "crease.stiffness", "contact.stiffness", "strip.thickness", "strip.width", "strip.length"]
    values = [value_at(case, path) for path in paths]

    def parts() -> np.ndarray:
        found = force_response(case, np.linspace(0.002, 0.03, 8), paths)
        assert found.jacobian is not None
        return found.jacobian * values / found.force[:, None]

    part = parts()
    still = np.isfinite(part).all(axis=1)
    assert still.sum() > 5
    assert part[still, :3].sum(axis=1) == pytest.approx(1.0, abs=1e-6)
    monkeypatch.setattr("fsm.calibrate.sensitivity._STEP", 1e-7)
    monkeypatch.setattr("fsm.calibrate.sensitivity._CONTACT_STEP", 3e-9)
    assert part[still] == pytest.approx(parts()[still], rel=5e-5, abs=1e-5)


def test_numbers_of_the_drive_at_the_end_of_its_travel() -> None:
    """Without dampers the force at the end depends on the travel, not on the speed."""
    case = strip().set({"drive.0.travel": "4 mm", "material.damping": 0, "strip.segments_per_panel": 2})
    found = case.sensitivity(by=["drive.0.travel", "drive.0.speed"])
    travel = found["drive.0.travel"]
    ends = [case.set("drive.0.travel", travel.value * (1.0 + k)).run().summary["peak_force"] for k in (-1e-3, 1e-3)]
    assert travel.slope == pytest.approx((ends[1] - ends[0]) / (2e-3 * travel.value), rel=1e-4)
    assert found.elasticity(found["drive.0.speed"]) == pytest.approx(0.0, abs=1e-7)


def test_derivatives_of_the_peak_of_flexible_facets() -> None:
    """Both stiffnesses together scale the force; a number that changes the mesh has differences, the others do not."""
    text = (Path(fsm.__file__).parent / "cli" / "templates" / "flexible.toml").read_text()
    changes = {"drive.0.travel": "0.4 mm", "sheet.mesh_size": "10 mm", "solve.error_estimates": "off", "solve.rtol": 1e-6}
    case = fsm.load(text).set(changes)
    stiffnesses = ["material.young", "crease.stiffness_per_length"]
    found = case.sensitivity(by=[*stiffnesses, "sheet.fold_angle", "sheet.a"])
    assert [one.exact for one in found.derivatives] == [True, True, True, False]
    assert sum(found.elasticity(found[path]) for path in stiffnesses) == pytest.approx(1.0, abs=1e-5)
    angle = found["sheet.fold_angle"]
    ends = [case.set("sheet.fold_angle", angle.value * (1.0 + k)).run().summary["peak_force"] for k in (-2e-3, 2e-3)]
    assert angle.slope == pytest.approx((ends[1] - ends[0]) / (4e-3 * angle.value), rel=1e-4)


@pytest.mark.parametrize(("path", "shared"), [("material.young", True), ("contact.stiffness", True), ("strip.width", False)])
def test_a_number_needs_one_compilation(path: str, shared: bool) -> None:
    """Contacts keep their table if their sides are the same."""
    case = strip()._loaded.case
    scene = build_scene(case)
    system = compile_scene(scene)
    ((one,),) = [number.systems for number in vary_parameters(case, scene, system, [path])]
    assert (one.system.contacts[0].geometry is system.contacts[0].geometry) == shared


def test_differences_where_there_are_no_exact_derivatives() -> None:
    """The force at the end of the travel of a sheet of creases alone is proportional to their stiffness."""
    case = fsm.load(CASES / "miura_push" / "case.toml").set({"sheet.columns": 2, "sheet.rows": 2, "drive.0.travel": 0.4})
    found = case.sensitivity("peak_force", ["crease.stiffness_per_length"])
    assert found.elasticity(found.derivatives[0]) == pytest.approx(1.0, abs=1e-5)
    channel = case.sensitivity("max of energy.creases", ["crease.stiffness_per_length"])
    (one,) = channel.derivatives
    assert not one.exact
    assert channel.unit == "J"
    assert channel.elasticity(one) == pytest.approx(1.0, abs=1e-4)  # joints of facets are stiff, not rigid
    assert one.error <= 1e-6 * abs(one.slope)
    assert any("differences of runs in place of exact derivatives" in text for text in channel.warnings)


def test_responses_of_joints() -> None:
    """Largest reactions and the largest impulse of a latch are numbers with units."""
    events = [
        {"what": "latch closes", "impulse": 0.2},
        {"what": "stop is hit", "impulse": 0.9},
        {"what": "latch closes", "impulse": 0.3},
    ]
    summary = {
        "drive": "crease 3", "peak_force": 2.0, "peak_kind": "static", "smallest_margin": 0.5, "joint_events": events,
        "reactions": [{"joint": "root", "force": 26.0, "force_time": 1.0, "moment": 3.0, "moment_time": 1.0}],
    }  # fmt: skip
    found = numbers_of(summary)
    assert found["force at root"] == (26.0, "N")
    assert found["moment at root"] == (3.0, "N m")
    assert found["latch_impulse"] == (0.3, "N m s")
    assert found["smallest_margin"] == (0.5, "")
    assert found["peak_force"] == (2.0, "N")


def test_a_motion_has_no_exact_derivatives() -> None:
    file = CASES / "dropped_plates" / "case.toml"
    problem, _ = case_problem(fsm.load(file)._tables, file, ["solve.end_time=2 ms"], ["contact.stiffness"], (), str(file))
    with pytest.raises(CaseError, match=r"exact derivatives need one equilibrium path: no motion"):
        differentiated_peak(problem, {}, ["contact.stiffness"])


def test_scatter_is_propagated_with_correlations(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(f"""
case = "{STRIP}"
correlation = [{{ between = ["material.young", "crease.stiffness"], value = 0.5 }}]
[[parameter]]
path = "material.young"
distribution = "normal"
sigma = "10 %"
[[parameter]]
path = "crease.stiffness"
distribution = "normal"
sigma = "20 %"
""")
    case = strip().set("drive.0.travel", "2 mm")
    found = case.sensitivity(study=tmp_path / "study.toml")
    young, crease = (found.elasticity(one) * part for one, part in zip(found.derivatives, (0.1, 0.2), strict=True))
    wanted = found.value * np.sqrt(young**2 + crease**2 + young * crease)
    assert found.deviation() == pytest.approx(wanted, rel=2e-3)


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (["--by", "strip.thicknes"], "strip.thicknes: unknown key; did you mean `strip.thickness`?"),
        (["--by", "strip.panels"], "strip.panels: is 6, a whole number; only continuous numbers have derivatives"),
        (["--by", "contact.law"], "contact.law: is not a number of the case"),
        ([], "name the numbers to differentiate by"),
        (["--by", "friction.mu_static"], "friction.mu_static: the case has no number there"),
    ],
)
def test_a_mistake_gives_one_line(words: list[str], wanted: str) -> None:
    found = CliRunner().invoke(cli, ["sensitivity", str(STRIP), *words])
    assert found.exit_code == 2
    assert wanted in found.output
    assert len(found.output.splitlines()) == 1
