"""Files appear complete or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fsm.io.atomic_write import atomic_write, remove_partial_files


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_the_new_file_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    target = tmp_path / "force.csv"
    target.write_text("old")
    with atomic_write(target) as part:
        assert part.parent == tmp_path and part.suffix == ".csv" and part.name.startswith(".")
        part.write_text("new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert names(tmp_path) == ["force.csv"]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()], ids=["full disk", "Ctrl-C"])
@pytest.mark.parametrize("there", [True, False], ids=["old", "none"])
def test_an_error_leaves_the_old_file(tmp_path: Path, error: BaseException, there: bool) -> None:
    target = tmp_path / "force.csv"
    if there:
        target.write_text("old")

    def write_half() -> None:
        with atomic_write(target) as part:
            part.write_text("half")
            raise error

    with pytest.raises(type(error)):
        write_half()
    assert names(tmp_path) == (["force.csv"] if there else [])
    assert not there or target.read_text() == "old"


def test_an_error_before_the_first_byte(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="nothing to write"), atomic_write(tmp_path / "force.csv"):
        raise ValueError("nothing to write")
    assert names(tmp_path) == []


def test_a_block_that_writes_nothing_is_an_error_and_leaves_the_old_file(tmp_path: Path) -> None:
    (tmp_path / "force.csv").write_text("old")
    with pytest.raises(FileNotFoundError), atomic_write(tmp_path / "force.csv"):
        pass
    assert (tmp_path / "force.csv").read_text() == "old"


def test_what_a_kill_left_goes_and_nothing_else(tmp_path: Path) -> None:
    for name in (".force.part.csv", ".result.part.h5"):  # temporary files of a killed process
        (tmp_path / name).write_text("half")
    for name in ("force.csv", "result.part.h5", ".hidden", ".parts"):
        (tmp_path / name).write_text("whole")
    (tmp_path / "case").mkdir()
    (tmp_path / "case" / ".force.part.csv").write_text("half")
    remove_partial_files(tmp_path)
    assert names(tmp_path) == [".hidden", ".parts", "case", "force.csv", "result.part.h5"]
    assert names(tmp_path / "case") == [".force.part.csv"], "of a folder that has its own"


def test_parts_are_what_is_cleared(tmp_path: Path) -> None:
    with atomic_write(tmp_path / "result.h5") as part:
        part.write_text("half")
        remove_partial_files(tmp_path)
        assert names(tmp_path) == []
        part.write_text("whole")
    assert names(tmp_path) == ["result.h5"]


def test_a_folder_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "summary.csv").mkdir()
    with pytest.raises(IsADirectoryError, match="is a folder") as caught, atomic_write(tmp_path / "summary.csv") as part:
        part.write_text("x")
    assert caught.value.filename == str(tmp_path / "summary.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["summary.csv"]


def test_an_error_names_the_file_and_not_its_part(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as caught, atomic_write(tmp_path / "nowhere" / "summary.csv") as part:
        part.write_text("x")
    assert caught.value.filename == str(tmp_path / "nowhere" / "summary.csv")


def test_a_link_stays_and_its_file_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    real, link = tmp_path / "far" / "force.csv", tmp_path / "force.csv"
    real.write_text("old")
    link.symlink_to(real)
    with atomic_write(link) as part:
        part.write_text("new")
    assert link.is_symlink() and real.read_text() == "new"
    assert names(tmp_path / "far") == ["force.csv"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes in folders")
def test_a_pipe_or_a_device_is_refused_and_stays(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for target, kind in ((pipe, "pipe"), (Path(os.devnull), "device")):
        before = target.stat().st_mode
        with pytest.raises(OSError, match=f"is a {kind}, not a file"), atomic_write(target) as part:
            part.write_text("new")
        assert target.stat().st_mode == before
