"""The stated error of a film's mesh compared with a much finer mesh, for taut and for wrinkled films."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from fsm.analyses.film import build_film, on_other_mesh
from fsm.analyses.natural import natural_modes
from fsm.analyses.stretch import stretched
from fsm.analyses.vibrate import VibrationAnalysis
from fsm.case.derived.membrane import MeshLines
from fsm.case.loading.load_case import load_case
from fsm.cli.command_line import cli
from fsm.model.nodes.loading import Loading

FILM = """
analysis = "vibrate"
[membrane]
length = "300 mm"
width = "240 mm"
thickness = "25 um"
mesh = [8, 7]
[material]
young = "3 GPa"
poisson = 0.31
density = "1420 kg/m^3"
[[patch]]
place = "centre"
size = "60 mm"
thickness = "100 um"
young = "70 GPa"
density = "2700 kg/m^3"
[tension]
strain = 1e-3
[damping]
air = "4 1/s"
[impact]
pulse = "half-sine"
force = "5 mN"
size = "60 mm"
duration = "4 ms"
[vibration]
duration = "0.1 s"
modes = 6
model = "reduced"
"""
PULLED = ("tension.strain=none", "tension.pull=10 N", "tension.film=tension-field")
PATCHES_ONLY = (
    "membrane.width=0.3",
    'patch=[{ place = "grid", count = [3, 3], spacing = [0.1, 0.1], size = 0.05, thickness = 1e-4, young = 7e10, '
    "density = 2700 }]",
    "membrane.mesh=[1, 1]",
)


def summary(tmp_path: Path, *overrides: str) -> dict[str, Any]:
    case = tmp_path / "case.toml"
    case.write_text(FILM, encoding="utf-8")
    options = [word for text in overrides for word in ("--set", text)]
    done = CliRunner().invoke(cli, ["run", str(case), "--quiet", "--out", str(tmp_path / "out"), *options])
    assert done.exit_code == 0, done.output
    found: dict[str, Any] = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    return found


@pytest.mark.parametrize("overrides", [(), pytest.param(PULLED, marks=pytest.mark.nightly)], ids=["taut", "wrinkled"])
def test_the_stated_error_is_that_against_a_fine_mesh(tmp_path: Path, overrides: tuple[str, ...]) -> None:
    own = summary(tmp_path, *overrides)
    fine = summary(tmp_path, *overrides, "membrane.mesh=[20, 17]")
    stated = np.array(own["mesh_error_modes"])
    off = np.abs(np.array(fine["modes_hz"]) / own["modes_hz"] - 1.0)
    assert np.all(off <= 1.5 * stated + 1e-3)
    assert off.max() > 0.01  # otherwise there is no error to state
    # in a wrinkled film the change of each mode counts as at least half of the largest change
    assert np.all(stated[:2] <= 10.0 * (np.full(2, off.max()) if overrides else off[:2]) + 0.02)
    for name in ("frequency", "amplitude"):
        key = f"{name}_hz" if name == "frequency" else f"{name}_center"
        assert abs(fine[key] / own[key] - 1.0) <= 1.5 * own[f"mesh_error_{name}"] + 2e-3


def test_a_coarse_mesh_is_warned_of(tmp_path: Path) -> None:
    coarse, fine = (summary(tmp_path, f"membrane.mesh={mesh}", "patch=none") for mesh in ("[2, 2]", "[10, 10]"))
    found = [[text for text in made["warnings"] if "mesh of the film is coarse" in text] for made in (coarse, fine)]
    assert len(found[0]) == 1 and "largest displacement: error about" in found[0][0] and "finer membrane.mesh" in found[0][0]
    assert not found[1]


def test_the_other_mesh(tmp_path: Path) -> None:
    """Every element is halved where that is cheap; else there are half as many, and none if patches determine the mesh."""
    case = tmp_path / "case.toml"
    case.write_text(FILM, encoding="utf-8")

    def other(*overrides: str) -> tuple[int, int, float] | None:
        found = on_other_mesh(load_case(case, overrides).case)
        return None if found is None else (len(found[0].x) - 1, len(found[0].y) - 1, found[1])

    assert other() == (20, 16, 2.0)  # lines at the edges of the patch divide the 8 x 7 elements into 10 x 8
    assert other("membrane.mesh=[30, 24]") == (15, 13, pytest.approx(1.0 / 1.8))
    assert other(*PATCHES_ONLY) == (14, 14, 2.0)
    assert other("membrane.mesh=[30, 24]", "patch.0.size=5 mm") is None


def test_the_error_at_a_small_patch_is_stated(tmp_path: Path) -> None:
    """The edge of a patch reduces the order below 1; a comparison with order 2 states half of the error."""
    case = tmp_path / "case.toml"
    case.write_text(FILM, encoding="utf-8")
    patch = '[{ place = "position", size = 0.02, thickness = 2e-4, young = 3e9, density = 1420, position = [0.05, 0.03] }]'
    loaded = load_case(case, ("tension.strain=2e-3", f"patch={patch}", "impact=none", "membrane.mesh=[8, 8]")).case
    analysis = VibrationAnalysis(loaded, "")
    analysis.initialise([])
    assert analysis.mesh_error is not None
    finer = on_other_mesh(loaded)
    assert finer is not None
    x, y = (np.interp(np.arange(2 * len(of) - 1) / 2, np.arange(len(of)), of) for of in (finer[0].x, finer[0].y))
    lines = MeshLines(tuple(x.tolist()), tuple(y.tolist()))
    system = stretched(loaded, build_film(loaded, lines), Loading())
    fine = natural_modes(system, system.initial()[0], 6).frequencies
    off = np.abs(fine / analysis.modes.frequencies - 1.0)
    assert np.all(off < analysis.mesh_error.modes)
    assert np.all(analysis.mesh_error.modes < 5.0 * off + 1e-3)
    assert off[0] > 1e-3
