"""Case files of films: accepted and refused input, and the report of `fsm check`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from fsm.case.loading.load_case import load_case
from fsm.check.film import MINAMI
from fsm.cli.command_line import cli
from fsm.errors import CaseError

CASE = Path(__file__).parents[2] / "folding_cases" / "membrane_impact" / "case.toml"
STAGES = Path(__file__).parents[2] / "folding_cases" / "deployed_strip" / "case.toml"


def faults(*overrides: str, case: Path = CASE) -> list[str]:
    with pytest.raises(CaseError) as caught:
        load_case(case, overrides)
    return [str(fault) for fault in caught.value.faults]


def test_the_case_is_read_in_si() -> None:
    loaded = load_case(CASE, ["membrane.thickness=50 um", "patch.0.distance=9 cm"])
    case = loaded.case
    assert case.steps == ("vibrate",)
    assert case.membrane is not None and case.membrane.thickness == pytest.approx(50e-6)
    assert case.patch[0].place == "diagonal" and case.patch[0].distance == pytest.approx(0.09)
    assert case.tension is not None and case.tension.pull == 15.0
    assert load_case_text(loaded.text) == case
    staged = load_case(STAGES)
    assert load_case_text(staged.text) == staged.case


def load_case_text(text: str) -> Any:
    import tomllib

    from fsm.case.loading.load_case import read_case

    case, found = read_case(tomllib.loads(text), Path())
    assert not found
    return case


@pytest.mark.parametrize(
    ("overrides", "path", "words"),
    [
        (["patch.0.distance=250 mm"], "patch.0", "beyond the film along its length"),
        (['patch.1={place="centre", size=0.02, thickness=1e-3, young=2e11, density=7850}', "patch.0.distance=10 mm"],
         "patch.1", "overlaps patch.0"),
        (["patch.0.size=2 mm"], "membrane.mesh", "too coarse for patch.0"),
        (["tension=none"], "tension", "without it the film is slack"),
        (["tension.pull=0 N"], "tension.pull", "the film is slack"),
        (["tension.pull=none", "tension.strain=-1e-3"], "tension.strain", "the film is slack"),
        (["tension.pull=none", "tension.strain=0.5"], "tension.strain", "must be at most 0.2"),
        (["impact.point=[0.2, 0]"], "impact.point", "outside the film"),
        (["solve.increment=1 mm"], "solve.increment", "has no drive"),
        (["solve.imperfection=0.5"], "solve.imperfection", "has no drive"),
        (["vibration.probes={ far = [0, 1] }"], "vibration.probes.far", "outside the film"),
        (["material.damping=2 ms"], "material.damping", "`damping.material`"),
        (["solve.method=static"], "solve.method", "a vibration is dynamic"),
        (["solve.end_time=1 s"], "solve.end_time", "`vibration.duration`"),
        (["save.every=1 mm"], "save.every", "travel of a drive"),
        (["cable=none", 'support=[{at="cables"}]'], "support.0.at", "no corner cables"),
        (['support=[{at="point"}]'], "support.0", "requires `position`"),
        (["strip.length=1"], "strip", 'not used with analysis = "vibrate"'),
        (["patch.0.place=corner"], "patch.0.place", '"centre" or "diagonal"'),
        (["impact.duration=none"], "impact.duration", "missing"),
        (["tension.strain=1e-3"], "tension", "give either `pull`"),
        (["cable=none", "tension.pull=none", "tension.strain=1e-3", 'support=[{at="left"}]'], "support",
         'only the edge "left" is supported'),
    ],
)  # fmt: skip
def test_what_is_refused(overrides: list[str], path: str, words: str) -> None:
    """Mistakes are reported early, with the path and a remedy, and nothing is compiled."""
    found = faults(*overrides)
    assert any(line.startswith(f"{path}") and words in line for line in found), found


def test_all_faults_at_once() -> None:
    found = faults("patch.0.distance=250 mm", "impact.point=[0.2, 0]", "tension.pull=0 N", "membrane.mash=[3, 3]")
    assert any("did you mean `membrane.mesh`" in line for line in found)
    assert len(faults("patch.0.distance=250 mm", "impact.point=[0.2, 0]", "tension.pull=0 N")) == 3


def test_stages() -> None:
    case = load_case(STAGES).case
    assert case.steps == ("deploy", "vibrate")
    assert any(line.startswith("analysis: is given together") for line in faults("analysis=vibrate", case=STAGES))
    assert any("membrane: not used with these stages" in line for line in faults("membrane.length=1", case=STAGES))
    assert any("vibration: not used" in line for line in faults("stages=none", case=STAGES))


def test_check_says_what_will_be_built() -> None:
    result = CliRunner().invoke(cli, ["check", str(CASE)])
    assert result.exit_code == 0, result.output
    for words in (
        "14 x 14 ANCF elements", "785 mg each", "tension field", "6.9 times the mass of the film", "80 natural modes",
        "outer ends of the cables (default support)", "half-sine of 0.2 N for 5 ms",
    ):  # fmt: skip
        assert words in result.output
    result = CliRunner().invoke(cli, ["check", str(STAGES)])
    assert result.exit_code == 0, result.output
    assert "6 panels" in result.output or "crease 5 moves" in result.output
    assert "the strip at the end of the travel" in result.output


def test_check_compiles_nothing() -> None:
    code = (
        f"import sys; from fsm.cli.command_line import cli; cli(['check', {str(CASE)!r}], standalone_mode=False); "
        "assert not {'numba', 'h5py', 'matplotlib'} & set(sys.modules), sorted(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_one_number_of_the_air() -> None:
    from fsm.model.nodes.films import air

    assert air.MINAMI == MINAMI
