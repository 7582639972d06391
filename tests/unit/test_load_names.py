"""Units of loads in curves, tables and texts: forces, moments and pressures."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fsm.case.models.loads import Load
from fsm.model.bodies.loads import applied
from fsm.results.step_data import LoadPath, write_load_path_csv
from fsm.run.summary_text import summary_lines
from fsm.text.load_names import MOMENT, PRESSURE, force_name, load_units
from fsm.views.report.plots import curves_of
from tests.unit.plot_runs import strip_run


def path_of(*names: str) -> LoadPath:
    values = np.linspace(0.0, 1.0, 5)[:, None] * np.ones(len(names))
    return LoadPath(np.ones(5, dtype=np.int64), values[:, 0], np.zeros(5), names, values, 1e-3 * values)


@pytest.mark.parametrize(
    ("load", "unit"),
    [({"force": [0, 0, 1]}, "N"), ({"moment": [0, 1, 0]}, "N m"), ({"force": [1, 0, 0], "moment": [0, 1, 0]}, "N")],
)
def test_a_load_without_force_is_a_moment(load: dict[str, Any], unit: str) -> None:
    for spatial in (False, True):
        found = applied(Load(body="lid", name="load on lid", **load), 0, spatial)
        assert load_units(found.called).size == unit
        assert found.called.startswith("load on lid")
        assert load_units(f"{found.called}#2").size == unit


def test_a_given_name_does_not_change_the_unit() -> None:
    """The name of a force may end as those of pressures and moments do."""
    for name in ("a", f"a{PRESSURE}", f"a{MOMENT}", f"a{MOMENT}#2", "#1"):
        assert load_units(force_name(name)).size == "N"
    assert force_name("a") == "a"


@pytest.mark.parametrize(
    ("name", "across", "up", "column"),
    [
        ("a", "displacement along the load (mm)", "load (N)", "displacement of a (m)"),
        ("a, moment", "rotation about the moment (deg)", "moment (N m)", "rotation of a, moment (rad)"),
        ("a, pressure", "swept volume (litre)", "pressure (Pa)", "volume of a, pressure (m^3)"),
    ],
)
def test_curves_and_tables_have_the_unit(name: str, across: str, up: str, column: str, tmp_path: Path) -> None:
    """A page gave the pressure on a film as a load in N, and its volume as a displacement in mm."""
    run = replace(strip_run(11), load_path=path_of(name))
    (curve,) = (plot for plot in curves_of(run) if plot["key"] == "load")
    assert (curve["xlabel"], curve["ylabel"]) == (across, up)
    assert run.load_path is not None
    write_load_path_csv(run.load_path, tmp_path / "load.csv")
    with (tmp_path / "load.csv").open(encoding="utf-8", newline="") as file:
        assert column in next(csv.reader(file))


def test_limit_points_have_the_unit() -> None:
    loads = {"a": (2.0, 3e-3), "b, moment": (0.5, 4e-3)}
    point = {
        "program_time": 0.5, "negative_modes": 1,
        "loads": {name: {"size": size, "displacement": way} for name, (size, way) in loads.items()},
    }  # fmt: skip
    step = {"name": "press", "kind": "static", "end_time": 1.0, "limit_points": [point]}
    text = "\n".join(summary_lines({"step": [step]}, Path("out")))
    assert "a 2 N at 3 mm, b, moment 0.5 N m at 0.2292 deg" in text
