"""Kernels compiled ahead: all that a case takes, and once."""

import subprocess
import sys
from pathlib import Path

import pytest

from fsm import warm_up
from fsm.kernels import jit

CASES = Path(__file__).parents[2] / "folding_cases"


@pytest.fixture
def asked(tmp_path, monkeypatch):
    calls = []
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warm_up, "KINDS", {kind: (lambda kind=kind: calls.append(kind),) for kind in ("a b", "c")})
    return calls


def test_once(asked, capsys):
    warm_up.compile_ahead(["a b"])
    warm_up.compile_ahead(["a b", "c"], tell=False)
    warm_up.compile_ahead(["c"])
    assert asked == ["a b", "c"]
    assert capsys.readouterr().err == "compiling kernels, once: a b\n"


def test_again_where_it_failed(asked, monkeypatch):
    def fail() -> None:
        raise MemoryError

    with monkeypatch.context() as patch:
        patch.setitem(warm_up.KINDS, "c", (fail,))
        with pytest.raises(MemoryError):
            warm_up.compile_ahead(["c"])
    warm_up.compile_ahead(["c"])
    assert asked == ["c"]


def test_nothing_where_nothing_is_kept(asked, monkeypatch):
    monkeypatch.setattr(jit, "cache_folder", lambda: None)
    warm_up.compile_ahead(["c"])
    assert asked == []


@pytest.mark.parametrize("case", ["strip_pull", "strip_trial", "rotating_squares"])
def test_no_kernel_is_left_for_a_run_in_the_plane(case, tmp_path):
    """Asked for by Python; what those call is compiled with them."""
    code = f"""
from pathlib import Path
from fsm.kernels import jit
from fsm.run import run_case
from fsm.scene.load_case import load_case
from fsm.warm_up import KINDS
def known():
    return {{jit._name(d): set(d.signatures) for d in jit._kernels.values()}}
for use in KINDS["planar"]:
    use()
before = known()
run_case(load_case({str(CASES / case / "case.toml")!r}, ["expect=none"]), Path({str(tmp_path)!r}), progress=False)
print(sorted(name for name, found in known().items() if found - before[name]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
