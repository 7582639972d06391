"""Resumed runs whose steps end where a drive ends except for round-off, and whose energy is checked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fsm.run.recorder
from fsm.case.loading.load_case import load_case
from fsm.errors import EnergyAbort
from fsm.model.compile.compile_case import compile_case
from fsm.model.plan.plan import plan_of
from fsm.results.store import read_solution
from fsm.run.run_case import run_case
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, CurvePoint
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from tests.runs import run
from tests.scene_text import BLOCK_AND_HAND, ROPE

CASE = BLOCK_AND_HAND + ROPE + '[save]\ninterval = "2 ms"\n'
SHAKE = 'body = "hand"\ndirection = [1, 0, 0]\ntravel = "3 mm"\ntime = { kind = "cycle", period = "0.2 s", cycles = 4 }\n'


def test_the_last_record_is_written_after_a_restart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The drive ends at 0.8, and 0.3 + 0.3 + 0.1 + 0.1 is less than 0.8 by round-off."""
    text = CASE + '[[step]]\nkind = "dynamic"\nduration = "0.3 s"\n[[step.drive]]\n' + SHAKE
    text += "".join(f'[[step]]\nkind = "dynamic"\nduration = "{duration} s"\n' for duration in (0.3, 0.1, 0.1))
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    loaded = load_case(tmp_path / "case.toml")
    run_case(loaded, tmp_path / "whole", progress=False)
    whole = read_solution(tmp_path / "whole" / "result.h5")
    monkeypatch.setattr(fsm.run.recorder, "CHECKPOINT_EVERY", 0.0)

    def stop(fraction: float) -> None:
        if fraction > 0.95:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_case(loaded, tmp_path / "cut", progress=stop)
    run_case(loaded, tmp_path / "cut", progress=False, resume=True)
    resumed = read_solution(tmp_path / "cut" / "result.h5")
    np.testing.assert_array_equal(resumed.time, whole.time)
    np.testing.assert_array_equal(resumed.q, whole.q)
    plan = plan_of(loaded.case, compile_case(loaded.case)[0])
    assert plan.steps[-1].end == plan.programs[0].end_time == whole.time[-1]


def test_a_resumed_solve_judges_its_energy_as_the_whole_one(tmp_path: Path) -> None:
    """The bound is far below the errors of the steps, so both solves stop, at the same time."""
    (tmp_path / "case.toml").write_text(CASE + "[[drive]]\n" + SHAKE, encoding="utf-8")
    _, system = compile_case(load_case(tmp_path / "case.toml").case)
    settings = Settings("generalized-alpha", 1e-6, 0.8, energy_abort=1e-15, step=5e-5)
    kept: list[tuple[AcceptedStep, EnergyBalance, list[CurvePoint]]] = []
    seen: list[CurvePoint] = []
    balance = EnergyBalance.opened(system.energy(0.0, *system.initial()))

    def keep(end: AcceptedStep) -> None:
        if end.state is not None:
            kept.append((end, EnergyBalance(**vars(balance)), list(seen)))

    start = (0.0, *system.initial())
    with pytest.raises(EnergyAbort) as whole:
        simulate(system, settings, [], lambda saved: None, keep, start, balance, seen)
    assert kept
    end, until_then, points = kept[0]
    with pytest.raises(EnergyAbort) as resumed:
        simulate(system, settings, [], lambda saved: None, None, None, until_then, points, end)
    assert str(resumed.value) == str(whole.value)


@pytest.mark.parametrize("method", ["newmark", "generalized-alpha"])
def test_steps_grow_without_numerical_damping(tmp_path: Path, method: str) -> None:
    """A block falls on a spring; if all steps were as short as the first, there would be 17,000."""
    text = CASE.replace("[save]", "[x]").split("[x]")[0].replace('"hand"\nouter', '"ground"\nouter')
    text += f'[solve]\nmethod = "{method}"\nend_time = "0.6 s"\n' + ("rho_inf = 1.0\n" if method != "newmark" else "")
    _, summary = run(tmp_path, "gravity = [0, 0, -9.81]\n" + text)
    assert summary["steps"] < 2000
