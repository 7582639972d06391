"""Keys that nothing would read are refused, each with its path and a remedy."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from fsm.cli.command_line import cli

CASES = Path(__file__).resolve().parents[2] / "folding_cases"
SCENE = """
gravity = [0, 0, 0]
[[scene.bodies]]
name = "arm"
mass = 0.1
inertia = [1e-4, 1e-4, 1e-4]
[[scene.elements]]
name = "hinge"
inner = "ground"
outer = "arm"
translation = [1, 1, 1]
rotation = [1, 1, 1]
[scene.contact]
stiffness = 1e6
[scene]
gravity = [0, 0, -9.81]
[solve]
end_time = 0.1
"""
UNUSED = {
    "scene": {
        "material={ young = 1e9, density = 100 }": "material: each body and element of a [scene] has its own [material]",
        "crease={ law = 'linear', stiffness = 1 }": "crease: each body and element of a [scene] has its own [crease]",
        "contact={ stiffness = 1 }": "contact: is given here and as scene.contact; remove one of them",
        "gravity=[0, 0, -1]": "gravity: is given here and as scene.gravity; remove one of them",
        "scene.contact.pairs=[[1, 2]]": "scene.contact.pairs: only a [strip] has panel numbers",
        "scene.elements.0.crease_flexibility=3": "scene.elements.0.crease_flexibility: 3 rad/(N m) is in series",
        "scene.elements.0.axes_inner=[2, 0, 0, 0]": "scene.elements.0.axes_inner: the quaternion has norm 2; ",
        "solve.increment=1 mm": "solve.increment: requires a [[drive]], which is missing",
        "solve.imperfection=1": "solve.imperfection: requires a [[drive]]",
    },
    "scissor_array": {
        "gravity=[0, 0, -9.81]": "gravity.2: -9.81 m/s^2 is normal to the plane x, y of the array",
        "material.plate=true": "material.plate: applies to wide strips only",
        "solve.spatial=true": "solve.spatial: an array moves in its plane only",
    },
    "membrane_impact": {"solve.spatial=true": "solve.spatial: a film always moves in space"},
}


@pytest.mark.parametrize(("case", "override"), [(case, text) for case, texts in UNUSED.items() for text in texts])
def test_what_nothing_reads_is_refused(case: str, override: str, tmp_path: Path) -> None:
    path = CASES / case / "case.toml"
    if case == "scene":
        path = tmp_path / "case.toml"
        path.write_text(SCENE)
    assert CliRunner().invoke(cli, ["check", str(path)]).exit_code == 0
    result = CliRunner().invoke(cli, ["check", str(path), "--set", override])
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith(f"{path}: {UNUSED[case][override]}"), result.stderr
