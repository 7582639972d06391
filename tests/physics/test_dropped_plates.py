"""The case of plates that are dropped on a table, from its file: they end on each other, at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.results.store import read_solution
from fsm.run.run_case import run_case

CASE = Path(__file__).parents[2] / "folding_cases" / "dropped_plates" / "case.toml"


@pytest.mark.figures
@pytest.mark.nightly
def test_plates_come_to_rest_on_each_other(tmp_path: Path) -> None:
    summary = run_case(load_case(CASE), tmp_path, progress=False)
    solution = read_solution(tmp_path / "result.h5")
    assert summary["unstable_equilibria"] == 0
    assert summary["energy_error"] < 2e-3
    assert (tmp_path / "contact.png").is_file()
    weight = 2e-3 * 9.81
    force = dict(zip(solution.layout.pair_names, solution.pair_force[-1], strict=True))
    for pair, plates in (("lower - table", 3), ("lower - middle", 2), ("middle - upper", 1)):
        assert force[pair] == pytest.approx(plates * weight, rel=1e-3), pair
    heights = np.sort(solution.q[-1].reshape(-1, 3)[:, 1])
    assert heights == pytest.approx([0.75e-3, 2.25e-3, 3.75e-3], abs=5e-5)
    still = np.abs(solution.q[-1] - solution.q[-20]).max()
    assert still < 1e-5
