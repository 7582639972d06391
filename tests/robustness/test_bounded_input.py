"""Input without an end, or of absurd size and shape: the program refuses it at once with a few lines and exit code 2."""

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner, Result

from fsm.case.loading.crease_family import CreaseFamily, FamilyCurve, read_family, write_family
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.results.checkpoint_file import read_checkpoint, write_checkpoint
from tests.robustness.test_bad_input import CASE, SPLINE

MANY = 30_000
ALLOWED = 60 * 500
"""Letters of messages."""


def check(text: str, folder: Path) -> Result:
    (folder / "case.toml").write_text(text)
    return CliRunner().invoke(cli, ["check", str(folder / "case.toml")])


MUCH = {
    "unknown sections": "".join(f"[k{i}]\n" for i in range(MANY)),
    "unknown keys": CASE.replace("[strip]", "[strip]\n" + "".join(f"key{i} = 1\n" for i in range(MANY))),
    "drives": CASE + "[[drive]]\ncrease = 99\n" * MANY,
    "held": CASE.replace("panels = 6", f"panels = 6\nheld = [{','.join(['true'] * MANY)}]"),
    "bodies": '[[scene.bodies]]\nname = "b"\nmass = -1\n' * MANY,
    "expectations": CASE + "[expect]\n" + "".join(f"k{i} = {{ value = 1, rtol = 1 }}\n" for i in range(1000)),
    "title": 'title = "' + 100_000 * "x" + '"\n' + CASE,
    "lists": CASE + "[expect]\na = " + 1200 * "[" + 1200 * "]",
    "inline": 1200 * "{a=" + "1" + 1200 * "}",
    "sections": CASE + "[" + ".".join(1200 * "a") + "]\nb = 1\n",
    "dotted": ".".join(["a"] * MANY) + " = 1\n" + CASE,
    "quoted": ".".join(['"a"'] * MANY) + " = 1\n" + CASE,
}


@pytest.mark.parametrize("name", MUCH)
def test_much_input_gives_few_messages(name: str, tmp_path: Path) -> None:
    result = check(MUCH[name], tmp_path)
    assert result.exit_code == 2, result.output[:1000]
    assert 0 < len(result.stderr.splitlines()) <= 60 and len(result.stderr) < ALLOWED, result.stderr[:1000]


def test_deep_input_is_said_to_be_deep(tmp_path: Path) -> None:
    for name in ("lists", "sections", "dotted", "quoted"):
        assert "nested more than 40 levels deep" in check(MUCH[name], tmp_path).stderr


def test_an_override_may_not_be_deep_either(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(CASE)
    deep = "strip.width=" + 300 * "[" + 300 * "]"
    result = CliRunner().invoke(cli, ["check", str(tmp_path / "case.toml"), "--set", deep])
    assert result.exit_code == 2 and len(result.stderr.splitlines()) == 1


@pytest.mark.skipif(os.name != "posix", reason="pipes and devices")
@pytest.mark.parametrize("what", ["pipe", "device", "folder"])
@pytest.mark.parametrize(
    "read", ["case", *(pytest.param(name, marks=pytest.mark.nightly) for name in ("crease", "table", "calibrate", "beside"))]
)
def test_pipes_devices_and_folders_are_refused(read: str, what: str, tmp_path: Path) -> None:
    """The test runs in a separate process, because reading a pipe would block for ever."""
    names = {"case": "case.toml", "crease": "crease.csv", "table": "rows.csv", "calibrate": "rows.csv"}
    (tmp_path / "case.toml").write_text(SPLINE)
    (tmp_path / "crease.csv").write_text("angle (deg), moment (N mm)\n0, 0\n10, 1\n20, 2\n30, 3\n")
    (tmp_path / "rows.csv").write_text("angle (deg), moment (N mm)\n0, 0\n10, 1\n20, 2\n30, 3\n")
    odd = tmp_path / names.get(read, "rows.toml")
    odd.unlink(missing_ok=True)
    if what == "pipe":
        os.mkfifo(odd)
    elif what == "device":
        odd.symlink_to("/dev/zero")
    else:
        odd.mkdir()
    command = {
        "case": ["check", "case.toml"], "crease": ["check", "case.toml"], "table": ["table", "rows.csv", "--out", "out"],
        "calibrate": ["calibrate", "crease", "rows.csv", "--out", "out"],
        "beside": ["calibrate", "crease", "rows.csv", "--out", "out"],
    }[read]  # fmt: skip
    result = subprocess.run(
        [sys.executable, "-m", "fsm", *command], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert result.returncode == 2, result.stderr
    assert len(result.stderr.splitlines()) == 1 and "Traceback" not in result.stderr
    if (read, what) != ("calibrate", "folder"):  # a folder of tables is allowed
        assert ("is a directory" if what == "folder" else "it is not a regular file") in result.stderr


def test_a_file_too_large_is_refused(tmp_path: Path) -> None:
    result = check("# " + 17 * 2**20 * "x" + "\n" + CASE, tmp_path)
    assert result.exit_code == 2 and "it is larger than 16 MB" in result.stderr


# HDF5 ----------------------------------------------------------------------------------------------------------------


def family(folder: Path) -> Path:
    angle = np.linspace(0.0, 1.0, 5)
    write_family(CreaseFamily((FamilyCurve(angle, angle, 0 * angle),), "cubic"), folder / "crease.h5")
    read_family(folder / "crease.h5")
    return folder / "crease.h5"


def external_link(file: h5py.File) -> None:
    del file["curves/000/angle"]
    file["curves/000/angle"] = h5py.ExternalLink("other.h5", "/angle")


def soft_link(file: h5py.File) -> None:
    file["curves/001"] = h5py.SoftLink("/curves/000")


def external_storage(file: h5py.File) -> None:
    del file["curves/000/angle"]
    file["curves/000"].create_dataset("angle", (5,), float, external=[("/dev/zero", 0, 40)])


def virtual(file: h5py.File) -> None:
    del file["curves/000/angle"]
    layout = h5py.VirtualLayout((5,), float)
    layout[:] = h5py.VirtualSource("other.h5", "angle", (5,))
    file["curves/000"].create_virtual_dataset("angle", layout)


def variable_text(file: h5py.File) -> None:
    del file.attrs["interpolation"]
    file.attrs["interpolation"] = "cubic"


def infinite_version(file: h5py.File) -> None:
    file.attrs["version"] = np.inf


def huge(file: h5py.File) -> None:
    del file["curves/000/angle"]
    file["curves/000"].create_dataset("angle", (50_000,), float, chunks=(50_000,), compression="gzip")


@pytest.mark.parametrize(
    "spoil", [external_link, soft_link, external_storage, virtual, variable_text, infinite_version, huge]
)
def test_odd_families_are_refused(spoil: object, tmp_path: Path) -> None:
    path = family(tmp_path)
    with h5py.File(path, "r+", libver="latest") as file:
        spoil(file)  # type: ignore[operator]
    with pytest.raises(CaseError) as caught:
        read_family(path)
    assert len(caught.value.lines()) == 1


def test_a_group_within_itself_is_no_harm(tmp_path: Path) -> None:
    path = family(tmp_path)
    with h5py.File(path, "r+", libver="latest") as file:
        file["curves/000/again"] = file["curves"]
    assert len(read_family(path).curves) == 1


def test_odd_checkpoints_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "checkpoint.h5"
    write_checkpoint(path, {"q": np.zeros(3)}, {"case": "text"})
    read_checkpoint(path)
    with h5py.File(path, "r+", libver="latest") as file:
        file["attributes"].attrs["steps"] = "many"  # of variable length
    with pytest.raises(CaseError, match="has a variable length"):
        read_checkpoint(path)
