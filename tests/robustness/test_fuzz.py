"""Broken files are read or refused by a message: some files of `python -m validation.fuzz`, and the failures that it
found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from fsm.case.loading.crease_family import CreaseFamily, FamilyCurve, Relaxation, read_family, write_family
from fsm.case.loading.load_case import load_case
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.results.checkpoint_file import read_checkpoint, write_checkpoint
from fsm.results.store import read_solution
from validation.fuzz.campaign import run_fuzz
from validation.fuzz.seeds import seeds
from validation.fuzz.targets import TARGETS

CASES = Path(__file__).parents[2] / "folding_cases"


@pytest.mark.parametrize("target", TARGETS)
def test_broken_files_are_read_or_refused(target: str, tmp_path: Path) -> None:
    lines = run_fuzz(target, 0, 25, tmp_path, lambda line: None)
    assert len(lines) == 25
    assert [line for line in lines if line["class"] not in ("read", "refused")] == []


@pytest.mark.parametrize("case", sorted(CASES.glob("*/case.toml")), ids=lambda path: path.parent.name)
def test_check_of_every_shipped_case(case: Path) -> None:
    result = CliRunner().invoke(cli, ["check", str(case)])
    assert result.exit_code == 0, result.output


@pytest.mark.parametrize(
    ("case", "override", "words"),
    [
        ("strip_pull", "save.every=1e-12", "save.every: gives more than 1,000,000 records"),
        ("strip_pull", "save={interval=1e-12}", "save.interval: gives more than 1,000,000 records"),
        ("scissor_array", "save.interval=1e-12", "save.interval: gives more than 1,000,000 records"),
        ("strip_pull", "strip.thickness=1e-200", "strip.thickness: 1e-200 is outside 1e-60 to 1e+60 in SI"),
        ("strip_pull", "strip.thickness=1e200", "strip.thickness: 1e+200 is outside 1e-60 to 1e+60 in SI"),
        ("strip_pull", "strip.length=1.7e308", "strip.length: 1.7e+308 is outside 1e-60 to 1e+60 in SI"),
        ("strip_pull", "strip.panels=1000 strip.segments_per_panel=5000", "= 5,000,000 segments; at most 50,000"),
        ("rotating_squares", "lattice.hinge_length=100", "less than spacing"),
    ],
)
def test_what_cannot_be_built_is_refused_at_once(case: str, override: str, words: str) -> None:
    command = "check" if case != "scissor_array" else "run"
    out = ["--out", "/nonexistent/out"] if command == "run" else []
    sets = [word for text in override.split() for word in ("--set", text)]
    result = CliRunner().invoke(cli, [command, str(CASES / case / "case.toml"), *out, *sets])
    assert result.exit_code == 2
    assert words in result.output


def test_a_drive_faster_than_numbers_go_has_a_method() -> None:
    result = CliRunner().invoke(cli, ["check", str(CASES / "strip_trial/case.toml"), "--set", "drive.0.speed=1e59"])
    assert result.exit_code == 0, result.output


def test_a_dataset_larger_than_the_file_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "checkpoint.h5"
    write_checkpoint(file, {"q": np.zeros(3)}, {"case": "x"})
    with h5py.File(file, "r+") as changed:
        del changed["arrays/q"]
        changed.create_dataset("arrays/q", (10**12,), float)
    with pytest.raises(CaseError, match="more than the file holds"):
        read_checkpoint(file)


@pytest.mark.parametrize("length", [9, 11, 12, 13, 43, 44, 47, 48, 100])
def test_a_file_that_ends_in_its_first_block_is_refused(length: int, tmp_path: Path) -> None:
    """The beginning of the file is marked as open in another program; from byte 44 on a checksum follows."""
    whole = tmp_path / "whole.h5"
    write_checkpoint(whole, {"q": np.zeros(3)}, {"case": "x"})
    data = bytearray(whole.read_bytes()[:length])
    data[8:12] = bytes([3, 8, 8, 255])[: len(data) - 8]
    file = tmp_path / "checkpoint.h5"
    file.write_bytes(data)
    with pytest.raises(CaseError, match=r"checkpoint\.h5"):
        read_checkpoint(file)


def test_the_old_layout_without_checksums_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "result.h5"
    with h5py.File(file, "w") as old:
        old.attrs["format"] = "fsm result"
    with pytest.raises(CaseError, match="is not an fsm result file"):
        read_solution(file)


def _no_group(file: h5py.File) -> None:
    """So many points, in a dataset that takes no room, that looking through them would take for ever."""
    del file["points"]
    file.create_dataset("points", (10**9,), complex)


def _no_time(file: h5py.File) -> None:
    file["time"][0] = np.inf


def _far_away(file: h5py.File) -> None:
    file["shape"][0, 0, 0, 0] = 4e307


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (_no_group, "damaged or cannot be read"),
        (_no_time, r"/points/displacement has the shape \(3, "),
        (_far_away, "/shape contains numbers that are not finite or exceed 1e"),
    ],
)
def test_the_result_of_an_array_that_cannot_be_is_refused(
    damage: Callable[[h5py.File], None], words: str, tmp_path: Path
) -> None:
    file = tmp_path / "result.h5"
    (array,) = (data for data in seeds().hdf5["result"] if b"rigid_displacement" in data)
    file.write_bytes(array)
    assert read_solution(file).array is not None
    with h5py.File(file, "r+", libver="latest") as changed:
        damage(changed)
    with pytest.raises(CaseError, match=words):
        read_solution(file)


def test_a_family_that_is_a_table_is_refused(tmp_path: Path) -> None:
    case = CASES / "strip_hinge" / "case.toml"
    (tmp_path / "case.toml").write_text(case.read_text(encoding="utf-8"), encoding="utf-8")
    with h5py.File(tmp_path / "crease.h5", "w", libver="latest") as broken:
        broken.attrs.update(format="fsm crease family", version=1)
        broken.create_dataset("curves", (10**9,), float)
    with pytest.raises(CaseError, match="not a crease family"):
        load_case(tmp_path / "case.toml")


@pytest.mark.parametrize(
    "law",
    [
        Relaxation(2.0, -0.1, 0.0, 1e5),
        Relaxation(2.0, -0.1, -20.0, 1e5),
        Relaxation(2.0, -0.1, 20.0, float("nan")),
        Relaxation(2.0, float("inf"), 20.0, 1e5),
    ],
    ids=["tau 0", "tau below 0", "no longest time", "infinite slope"],
)
def test_a_family_whose_relaxation_cannot_be_is_refused(law: Relaxation, tmp_path: Path) -> None:
    case = CASES / "strip_hinge" / "case.toml"
    (tmp_path / "case.toml").write_text(case.read_text(encoding="utf-8"), encoding="utf-8")
    curve = FamilyCurve(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1e-3, 2e-3]), np.full(3, 1e-5))
    write_family(CreaseFamily((curve,), "pchip", relaxation=law), tmp_path / "crease.h5")
    with pytest.raises(CaseError, match=r"crease.h5 has a relaxation with impossible parameters"):
        load_case(tmp_path / "case.toml", ["crease.rest_angle=none", "crease.since_release=1 h"])


@pytest.mark.parametrize(
    ("name", "count", "words"),
    [("angle", 200_000, "200000 angles; at most 100000"), ("loading", 10**8, r"/loading has the shape \(100000000,\)")],
)
def test_a_curve_of_more_points_than_there_are_is_not_read(name: str, count: int, words: str, tmp_path: Path) -> None:
    """They take room in the file, without anything being written to it."""
    curve = FamilyCurve(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1e-3, 2e-3]), np.full(3, 1e-5))
    file = tmp_path / "crease.h5"
    write_family(CreaseFamily((curve,), "pchip"), file)
    with h5py.File(file, "r+", libver="latest") as changed:
        del changed[f"curves/000/{name}"]
        early = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        early.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        early.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        space = h5py.h5s.create_simple((count,))
        h5py.h5d.create(changed["curves/000"].id, name.encode(), h5py.h5t.NATIVE_DOUBLE, space, early)
        assert changed[f"curves/000/{name}"].id.get_storage_size() == 8 * count
    with pytest.raises(CaseError, match=words):
        read_family(file)
