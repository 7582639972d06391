"""Kernels compiled in advance: all kernels that a case needs, each once."""

import subprocess
import sys
from pathlib import Path

import pytest

from fsm.run import warm_up

CASES = Path(__file__).parents[2] / "folding_cases"


def test_what_is_asked_for(monkeypatch, capsys):
    done = []
    kinds = {kind: (lambda kind=kind: done.append(kind),) for kind in "abc"}
    monkeypatch.setattr(warm_up, "KINDS", kinds)
    warm_up.compile_ahead("ca")
    assert done == ["c", "a"]
    assert capsys.readouterr() == ("", "")  # no kernel had to be compiled


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("case", "overrides"),
    [
        ("strip_pull", []),
        ("strip_trial", []),
        ("strip_trial", ["solve.spatial=true", 'drive.0.travel="20 mm"']),
        ("strip_trial", ["contact=none", 'drive.0.travel="20 mm"']),
        ("strip_trial", ["contact=none", "solve.spatial=true", 'drive.0.travel="20 mm"']),
        ("strip_pull", ["contact=none", "friction=none", 'drive.0.travel="20 mm"']),
        ("rotating_squares", []),
        ("membrane_impact", ['vibration.duration="0.02 s"']),
        ("scissor_array", ["scissor.units=2", "solve.end_time=0.3"]),
        ("miura_push", ['drive.0.travel="1 mm"']),
        ("kresling", []),
        ("gas_kresling", ["solve.end_time=0.1"]),
        ("slit_annulus", ["sheet.mesh=[2, 8]"]),
        ("tape_spring", ["sheet.mesh=[6, 4]", "drive.0.turn=0.05"]),
        ("plate_on_film", []),
        ("dropped_plates", ["solve.end_time=0.02"]),
        ("dropped_plates", ["solve.end_time=0.02", 'solve.method="mean-force"', "solve.step=1e-3"]),
    ],
)
def test_no_kernel_is_left_for_a_run(case, overrides, tmp_path):
    """Called by Python; the kernels that they call are compiled with them."""
    code = f"""
from pathlib import Path
from fsm.analyses.choose import analysis_of
from fsm.kernels import jit
from fsm.run.run_case import run_case
from fsm.case.loading.load_case import load_case
from fsm.run.warm_up import KINDS
def known():
    return {{jit._name(d): set(d.signatures) for d in jit._kernels.values()}}
loaded = load_case({str(CASES / case / "case.toml")!r}, ["expect=none", *{overrides!r}])
kinds = analysis_of(loaded.case).kernels
for kind in kinds:
    for use in KINDS[kind]:
        use()
before = known()
run_case(loaded, Path({str(tmp_path)!r}), progress=False)
print(sorted(name for name, found in known().items() if found - before[name]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "[]"
