"""The stated error of a film's mesh compared with a much finer mesh, for taut and for wrinkled films."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from fsm.analyses.film import on_other_mesh
from fsm.cli import cli
from fsm.scene.load_case import load_case

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


@pytest.mark.parametrize("overrides", [(), PULLED], ids=["taut", "wrinkled"])
def test_the_stated_error_is_that_against_a_fine_mesh(tmp_path: Path, overrides: tuple[str, ...]) -> None:
    own = summary(tmp_path, *overrides)
    fine = summary(tmp_path, *overrides, "membrane.mesh=[20, 17]")
    stated = np.array(own["mesh_error_modes"])
    off = np.abs(np.array(fine["modes_hz"]) / own["modes_hz"] - 1.0)
    assert np.all(off <= 1.5 * stated + 1e-3)
    assert off.max() > 0.01  # otherwise there is no error to state
    assert np.all(stated[:2] <= 10.0 * off[:2] + 0.02)
    for name in ("frequency", "amplitude"):
        key = f"{name}_hz" if name == "frequency" else f"{name}_center"
        assert abs(fine[key] / own[key] - 1.0) <= 1.5 * own[f"mesh_error_{name}"] + 2e-3


def test_a_coarse_mesh_is_warned_of(tmp_path: Path) -> None:
    coarse, fine = (summary(tmp_path, f"membrane.mesh={mesh}", "patch=none") for mesh in ("[2, 2]", "[10, 10]"))
    found = [[text for text in made["warnings"] if "mesh of the film is coarse" in text] for made in (coarse, fine)]
    assert len(found[0]) == 1 and "natural frequencies: error about" in found[0][0] and "finer membrane.mesh" in found[0][0]
    assert not found[1]


def test_the_other_mesh(tmp_path: Path) -> None:
    """The comparison mesh is finer where that is cheap, else coarser; there is none if only patches determine the mesh."""
    case = tmp_path / "case.toml"
    case.write_text(FILM, encoding="utf-8")

    def other(*overrides: str) -> tuple[int, int] | None:
        found = on_other_mesh(load_case(case, overrides).case)
        return None if found is None or found.membrane is None else found.membrane.mesh

    assert other() == (12, 10)
    assert other("membrane.mesh=[30, 24]") == (20, 16)
    assert other(*PATCHES_ONLY) is None
