"""A run and a row of a table give bitwise equal results, whatever number of threads the shell sets."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from fsm.io.threads import one_thread
from tests.physics.test_film_run import FILM

CHANGED = [
    f"--set={change}"
    for change in (
        "membrane.mesh=[10, 10]", "impact.point=[0.03, 0.07]", "vibration.duration=20 ms", "vibration.modes=20",
        "vibration.model=reduced",
    )
]  # fmt: skip


def arrays(path: Path) -> dict[str, np.ndarray]:
    found: dict[str, np.ndarray] = {}
    with h5py.File(path) as file:
        file.visititems(
            lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None
        )
    return {name: value for name, value in found.items() if isinstance(value, np.ndarray) and value.dtype.kind == "f"}


@pytest.mark.nightly
def test_run_and_table_agree_to_the_last_bit(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(FILM, encoding="utf-8")
    with open(tmp_path / "table.csv", "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([["case", "impact.force"], ["one", "1 mN"]])
    shell = os.environ | {"OPENBLAS_NUM_THREADS": "4", "OMP_NUM_THREADS": "4"}
    for command in (["run", "case.toml", "--out", "run"], ["table", "table.csv", "--out", "table", "--workers", "1"]):
        words = [sys.executable, "-m", "fsm", *command, "--quiet", *CHANGED]
        subprocess.run(words, cwd=tmp_path, env=shell, check=True, capture_output=True)
    one, two = arrays(tmp_path / "run" / "result.h5"), arrays(tmp_path / "table" / "one" / "result.h5")
    assert one.keys() == two.keys() and any(name.endswith("frequency") for name in one)
    for name in one:
        np.testing.assert_array_equal(one[name], two[name], err_msg=name)


def test_threads_are_those_of_before_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with one_thread():
        assert os.environ["OMP_NUM_THREADS"] == os.environ["MKL_NUM_THREADS"] == "1"
    assert os.environ["OMP_NUM_THREADS"] == "3" and "MKL_NUM_THREADS" not in os.environ
