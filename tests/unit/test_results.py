"""The results file: data are read as they were written, also after a kill; other files are refused by a clear message."""

from __future__ import annotations

import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from fsm.errors import CaseError, FsmError
from fsm.results.channel import AXES, MOST_CHANNELS, ChannelInfo, Dim, select_channels
from fsm.results.checkpoint_file import read_checkpoint, write_checkpoint
from fsm.results.export import write_contact_csv, write_force_csv
from fsm.results.interrupted_file import checksum, is_marked_open, without_open_marks
from fsm.results.solution import ENERGIES, PAIRS, Layout, Record, Solution
from fsm.results.store import part_path, read_solution
from fsm.results.writer import ResultWriter

LAYOUT = Layout(
    case_text='title = "Streifen, 80°"\n[strip]\npanels = 6\n',
    provenance={"version": "0.1.0", "command": "fsm run case.toml"},
    dimension="spatial",
    body_names=("panel 1", "panel 2 segment 1"),
    panel=np.array([1, 2, 2]),
    pair_names=("panel 1 - panel 2", "panel 2 - panel 3"),
    drive_names=("crease 3",),
    thickness=3e-4,
)
STATS = {"steps": 812, "method": "Radau", "seconds": 1.25, "converged": True, "per_stage": [1, 2]}
SUMMARY = {
    "peak_force": 1.992,
    "peak_travel": 0.024,
    "stages": [{"name": "contact", "travel": np.float64(0.013), "force": 1.2}],
    "note": None,
}


def record(i: int, drives: int = 1, pairs: int = 2) -> Record:
    rng = np.random.default_rng(i)
    return Record(
        time=0.5 * i, q=rng.normal(size=6), u=rng.normal(size=5), travel=np.full(drives, 1e-3 * i),
        force=rng.normal(size=drives), energy={name: float(rng.normal()) for name in ENERGIES},
        **{name: rng.normal(size=pairs) for name in PAIRS}, shape=rng.normal(size=(3, 4, 3)), negative_pivots=i % 2,
    )  # fmt: skip


def assert_same(solution: Solution, numbers: range) -> None:
    wanted = Solution.from_records([record(i) for i in numbers], LAYOUT)
    for name in ("time", "q", "u", "travel", "force", *PAIRS, "shape", "negative_pivots"):
        np.testing.assert_array_equal(getattr(solution, name), getattr(wanted, name), err_msg=name)
    for name in ENERGIES:
        np.testing.assert_array_equal(solution.energy[name], wanted.energy[name], err_msg=name)


def finish(writer: ResultWriter, stats: dict[str, object], summary: dict[str, object]) -> None:
    writer.finish(replace(writer.solution(), stats=stats, summary=summary))


def write(path: Path, count: int = 7) -> Path:
    with ResultWriter(path, LAYOUT) as writer:
        for i in range(count):
            writer.append(record(i))
        finish(writer, STATS, SUMMARY)
    return path


# a writer that will be killed: it writes without end, and prints to stdout how many records are certainly on disk
ENDLESS = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("test_results", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
writer = module.ResultWriter(sys.argv[2], module.LAYOUT, flush_every=float(sys.argv[3]))
for i in range(10**9):
    writer.append(module.record(i))
    if i % 10 == 9:
        writer.flush()
        print(i + 1, flush=True)
"""


def killed_run(path: Path, after: float, flush_every: float = 1e3) -> int:
    """Start the endless writer, kill it, and give back how many records it was sure of."""
    command = [sys.executable, "-c", ENDLESS, __file__, str(path), str(flush_every)]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert run.stdout is not None
    first = int(run.stdout.readline())
    time.sleep(after)
    run.kill()
    lines = [line for line in run.stdout.read().splitlines() if line.strip()]
    run.wait()
    return int(lines[-1]) if lines else first


def test_round_trip(tmp_path: Path) -> None:
    solution = read_solution(write(tmp_path / "result.h5"))
    assert_same(solution, range(7))
    assert solution.stats == STATS
    assert solution.summary == SUMMARY
    fields = ["case_text", "provenance", "dimension", "body_names", "pair_names", "drive_names", "thickness"]
    assert [getattr(solution.layout, name) for name in fields] == [getattr(LAYOUT, name) for name in fields]
    np.testing.assert_array_equal(solution.layout.panel, LAYOUT.panel)


def test_temporary_name_until_finished(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "result.h5"
    with ResultWriter(path, LAYOUT) as writer:
        writer.append(record(0))
        writer.flush()
        assert not path.exists()
        assert part_path(path).name == "result.part.h5"
        assert part_path(path).exists()
        finish(writer, {}, {})
    assert [entry.name for entry in path.parent.iterdir()] == ["result.h5"]


def test_scene_without_drive_and_contact(tmp_path: Path) -> None:
    path = tmp_path / "result.h5"
    with ResultWriter(path, Layout(panel=np.array([0, 0, 0]))) as writer:
        for i in range(3):
            writer.append(record(i, drives=0, pairs=0))
        finish(writer, {}, {})
    with h5py.File(path) as file:
        assert "drive" not in file
        assert "contact" not in file
    solution = read_solution(path)
    assert solution.travel.shape == solution.force.shape == (3, 0)
    assert {getattr(solution, name).shape for name in PAIRS} == {(3, 0)}


def test_records_of_another_size_than_the_layout_are_refused(tmp_path: Path) -> None:
    writer = ResultWriter(tmp_path / "result.h5", LAYOUT)
    writer.append(record(0, drives=0))
    with pytest.raises(ValueError, match="travel"):
        writer.flush()
    with pytest.raises(ValueError, match="travel"):
        writer.close()


def test_every_dataset_has_a_unit_and_named_dimensions(tmp_path: Path) -> None:
    faults = []

    def look(name: str, item: object) -> None:
        if not isinstance(item, h5py.Dataset):
            return
        if "units" not in item.attrs or "long_name" not in item.attrs:
            faults.append(f"{name}: no unit or no name")
        if not item.is_scale and any(len(dim) != 1 for dim in item.dims):
            faults.append(f"{name}: a dimension without a scale")

    with h5py.File(write(tmp_path / "result.h5")) as file:
        file.visititems(look)
        assert file["drive/force"].attrs["units"] == "N"
        assert [dim[0].name for dim in file["shape"].dims] == ["/time", "/quad", "/corner", "/axis"]
        wanted = {"case", "provenance", "time", "shape", "stats", "state/q", "state/u", "drive/travel"}
        wanted |= {"drive/force", *(f"contact/{name}" for name in PAIRS)}
        wanted |= {f"energy/{name}" for name in ENERGIES}
        for name, (units, _) in PAIRS.items():
            assert file[f"contact/{name}"].attrs["units"] == units
            assert [dim[0].name for dim in file[f"contact/{name}"].dims] == ["/time", "/pair"]
        assert not [name for name in wanted if name not in file]
    assert not faults


def test_channels_are_kept_when_a_run_is_resumed(tmp_path: Path) -> None:
    """Names with a slash or a colon, coordinates with a unit; the records after the restart point are written again."""
    along = Dim("panel.1.position", (0.1, 0.25), "m", "distance")
    infos = (ChannelInfo("energy.work", "J"), ChannelInfo("panel.1.moment", "N m", (along,)),
             ChannelInfo("support.a/b: c.force", "N", (AXES,), "reaction"))  # fmt: skip
    layout = replace(LAYOUT, channels=infos)

    def with_channels(i: int) -> Record:
        rng = np.random.default_rng(100 + i)
        values = {info.name: rng.normal(size=[len(dim.labels) for dim in info.dims]) for info in infos}
        return replace(record(i), channels=values)

    path = tmp_path / "result.h5"
    with ResultWriter(path, layout) as writer:
        for i in range(5):
            writer.append(with_channels(i))
    with ResultWriter(path, layout, resume_at=3) as writer:
        for i in range(3, 7):
            writer.append(with_channels(i))
        finish(writer, STATS, SUMMARY)
    found, wanted = read_solution(path), Solution.from_records([with_channels(i) for i in range(7)], layout)
    assert found.layout.channels == infos
    for info in infos:
        assert found.channels[info.name].info == info
        np.testing.assert_array_equal(found.channels[info.name].values, wanted.channels[info.name].values)
    assert list(found.channels["panel.1.moment"].columns) == ["panel.1.moment 0.1", "panel.1.moment 0.25"]


def test_patterns_match_names() -> None:
    names = ["crease.1.angle", "crease.2.angle", "energy.work"]
    assert select_channels(names, ["energy.*", "crease.?.angle"]) == (names, [])
    chosen, (fault,) = select_channels(names, ["crease.2.*", "creas.1.angle"])
    assert chosen == ["crease.2.angle"] and "crease.1.angle" in fault.message and '"creas.1.angle"' in fault.message
    _, (fault,) = select_channels([f"body.{i}.position" for i in range(MOST_CHANNELS + 1)], ["*"])
    assert "10,001 channels match; at most 10,000" in fault.message


def test_opens_with_xarray(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with xarray.open_datatree(write(tmp_path / "result.h5"), engine="h5netcdf") as tree:
        assert tree["drive/force"].dims == ("time", "drive_name")
        assert tree["drive/force"].sel(drive_name="crease 3").sizes == {"time": 7}
        assert tree["shape"].dims == ("time", "quad", "corner", "axis")
        assert tree["contact/pair_gap"].attrs["units"] == "m"
        np.testing.assert_array_equal(tree["drive"]["time"], 0.5 * np.arange(7))


@pytest.mark.nightly
@pytest.mark.parametrize("after", [0.0, 0.05, 0.2])
def test_killed_run_keeps_what_was_flushed(tmp_path: Path, after: float) -> None:
    sure = killed_run(tmp_path / "result.h5", after)
    assert not (tmp_path / "result.h5").exists()
    solution = read_solution(tmp_path / "result.part.h5")
    assert len(solution) >= sure
    assert_same(solution, range(len(solution)))
    assert solution.layout.case_text == LAYOUT.case_text


def test_killed_run_resumes_to_the_same_file(tmp_path: Path) -> None:
    sure = killed_run(tmp_path / "result.h5", 0.05)
    kept = sure - 3
    with ResultWriter(tmp_path / "result.h5", LAYOUT, resume_at=kept) as writer:
        assert writer.n_records == kept
        for i in range(kept, sure + 20):
            writer.append(record(i))
        finish(writer, STATS, SUMMARY)
    assert_same(read_solution(tmp_path / "result.h5"), range(sure + 20))


def test_an_error_in_the_run_keeps_all_records(tmp_path: Path) -> None:
    def run() -> None:
        with ResultWriter(tmp_path / "result.h5", LAYOUT) as writer:
            for i in range(4):
                writer.append(record(i))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run()
    assert_same(read_solution(tmp_path / "result.part.h5"), range(4))
    with h5py.File(tmp_path / "result.part.h5"):
        pass  # closed properly: other programs can open the file too


def test_a_lone_record_is_flushed_in_time_and_can_be_read_while_the_run_goes_on(tmp_path: Path) -> None:
    with ResultWriter(tmp_path / "result.h5", LAYOUT, flush_every=0.2) as writer:
        for i in range(3):
            writer.append(record(i))
        deadline = time.monotonic() + 20
        part = tmp_path / "result.part.h5"
        while not part.is_file() or len(read_solution(part)) < 3:
            assert time.monotonic() < deadline, "the record was never written"
            time.sleep(0.02)
        assert_same(read_solution(tmp_path / "result.part.h5"), range(3))


def test_resume_is_refused_in_plain_words(tmp_path: Path) -> None:
    path = tmp_path / "result.h5"
    with pytest.raises(CaseError, match="no unfinished run"):
        ResultWriter(path, LAYOUT, resume_at=3)
    with ResultWriter(path, LAYOUT) as writer:
        writer.append(record(0))
    with pytest.raises(CaseError, match="contains 1 records, but the checkpoint was saved after 3"):
        ResultWriter(path, LAYOUT, resume_at=3)
    with pytest.raises(CaseError, match="another scene"):
        ResultWriter(path, Layout(), resume_at=1)


def test_a_file_that_is_not_ours_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "result.h5"
    with pytest.raises(CaseError, match="no such file"):
        read_solution(path)
    path.write_text("travel (m),force (N)\n")
    with pytest.raises(CaseError, match="not HDF5"):
        read_solution(path)
    with h5py.File(path, "w") as file:
        file["time"] = [0.0, 1.0]
    with pytest.raises(CaseError, match="not an fsm result"):
        read_solution(path)
    write_checkpoint(path, {}, {})
    with pytest.raises(CaseError, match="not an fsm result"):
        read_solution(path)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.95])
def test_a_file_cut_short_is_refused(tmp_path: Path, share: float) -> None:
    path = write(tmp_path / "result.h5")
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(CaseError, match=r"result\.h5: .*(damaged|not HDF5)"):
        read_solution(path)


def test_a_file_with_a_missing_part_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "result.h5")
    with h5py.File(path, "r+") as file:
        del file["pair"]
    with pytest.raises(CaseError, match="damaged"):
        read_solution(path)


def test_a_case_that_is_no_toml_is_told_to_whoever_asks_for_it(tmp_path: Path) -> None:
    path = write(tmp_path / "result.h5")
    with h5py.File(path, "r+") as file:
        del file["case"]
        file["case"] = np.bytes_(b"[[[ strip")
    with pytest.raises(CaseError, match="the case in this result is damaged"):
        _ = read_solution(path).layout.case


def test_a_missing_quantity_is_damage(tmp_path: Path) -> None:
    path = write(tmp_path / "result.h5")
    with h5py.File(path, "r+") as file:
        del file["contact/pair_area"]
    with pytest.raises(CaseError, match=r"damaged.*pair_area"):
        read_solution(path)


def test_a_missing_result_points_to_the_part_file(tmp_path: Path) -> None:
    with ResultWriter(tmp_path / "result.h5", LAYOUT) as writer:
        writer.append(record(0))
    with pytest.raises(CaseError, match=r"see result\.part\.h5"):
        read_solution(tmp_path / "result.h5")


@pytest.mark.parametrize("version", [1, 99])
def test_a_file_of_another_version_is_refused(tmp_path: Path, version: int) -> None:
    path = write(tmp_path / "result.h5")
    with h5py.File(path, "r+") as file:
        file.attrs["version"] = version
    with pytest.raises(CaseError, match=rf"another version of fsm \(layout {version}; .* run the case again"):
        read_solution(path)


def test_a_folder_that_cannot_be_is_an_error_in_plain_words(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file where the folder should be")
    with pytest.raises(FsmError, match="cannot be written"):
        ResultWriter(tmp_path / "out" / "result.h5", LAYOUT)


def test_checkpoint_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "checkpoint.h5"
    arrays = {"q": np.arange(3.0), "pivots": np.array([1, 2]), "empty": np.zeros((0, 3))}
    write_checkpoint(path, arrays, {"time": 0.1, "n_records": 7, "solver": {"order": 3}})
    read, attributes = read_checkpoint(path)
    assert attributes == {"time": 0.1, "n_records": 7, "solver": {"order": 3}}
    assert read.keys() == arrays.keys()
    for name, values in arrays.items():
        np.testing.assert_array_equal(read[name], values)
        assert read[name].dtype == values.dtype


def test_checkpoint_that_fails_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "checkpoint.h5"
    write_checkpoint(path, {"q": np.arange(3.0)}, {"time": 1.0})
    with pytest.raises(TypeError):
        write_checkpoint(path, {"q": np.arange(4.0)}, {"time": object()})
    assert read_checkpoint(path)[1] == {"time": 1.0}
    with pytest.raises(CaseError, match="not an fsm checkpoint"):
        read_checkpoint(write(tmp_path / "result.h5"))


def test_an_energy_without_a_name_is_not_lost() -> None:
    one = record(0)
    one.energy["springs"] = 1.0
    with pytest.raises(ValueError, match="unknown energies in a record: springs"):
        Solution.from_records([one], LAYOUT)


def test_force_csv(tmp_path: Path) -> None:
    run = Solution.from_records([record(i) for i in range(4)], LAYOUT)
    write_force_csv(run, tmp_path / "force.csv")
    lines = (tmp_path / "force.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "travel (m),force (N),time (s)"
    read = np.loadtxt(tmp_path / "force.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(read, np.column_stack([run.travel, run.force, run.time]), rtol=1e-11, atol=0)

    layout = Layout(drive_names=("crease 3", "crease 5"))
    write_force_csv(Solution.from_records([record(0, drives=2)], layout), tmp_path / "two.csv", energies=True)
    heading = (tmp_path / "two.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert heading[:2] == ["travel of crease 3 (m)", "force of crease 3 (N)"]
    assert heading[2:4] == ["travel of crease 5 (m)", "force of crease 5 (N)"]
    assert heading[4:] == ["time (s)", *(f"energy {name} (J)" for name in ENERGIES)]


def test_contact_csv(tmp_path: Path) -> None:
    run = Solution.from_records([record(i) for i in range(4)], LAYOUT)
    run.pair_force[:, 0] = 0.0
    run.pair_force[1:3, 1] = 2.0, 3.0
    run.pair_slip[:, 1] = 0.1
    write_contact_csv(run, tmp_path / "contact.csv")
    heading, *lines = (tmp_path / "contact.csv").read_text(encoding="utf-8").splitlines()
    assert heading == (
        "travel (m),time (s),pair,normal force (N),gap (m),area (m^2),friction (N),slip speed (m/s),"
        "sliding distance (m),friction energy (J),damping energy (J)"
    )
    rows = [line.split(",") for line in lines]
    assert [row[2] for row in rows] == ["panel 2 - panel 3"] * 4  # the other never touches
    numbers = np.array([[float(cell) for cell in row[:2] + row[3:]] for row in rows])
    np.testing.assert_allclose(numbers[:, 1], run.time)
    np.testing.assert_allclose(numbers[:, 2], run.pair_force[:, 1], rtol=1e-11)
    np.testing.assert_allclose(numbers[:, 7], 0.1 * run.time, atol=1e-12)
    np.testing.assert_allclose(numbers[:, 9], run.pair_damping_energy[:, 1], rtol=1e-11)


def test_a_killed_file_cut_short_is_refused_and_does_not_hang(tmp_path: Path) -> None:
    killed_run(tmp_path / "result.h5", 0.0)
    path = tmp_path / "result.part.h5"
    data = path.read_bytes()
    for share in (0.3, 0.7, 0.9):
        path.write_bytes(data[: int(share * len(data))])
        with pytest.raises(CaseError, match="damaged"):
            read_solution(path)


def test_checksum_of_lookup3() -> None:
    assert checksum(b"") == 0xDEADBEEF
    assert checksum(b"Four score and seven years ago") == 0x17770551  # from lookup3.c itself


def test_part_file_is_written_in_the_mode_that_survives_a_kill(tmp_path: Path) -> None:
    with ResultWriter(tmp_path / "result.h5", LAYOUT) as writer:
        writer.append(record(0))
        writer.flush()
        assert is_marked_open(tmp_path / "result.part.h5")
        assert (tmp_path / "result.part.h5").read_bytes()[11] & 4  # SWMR writing, HDF5 file format III.A
        finish(writer, {}, {})
    assert not is_marked_open(tmp_path / "result.h5")


def test_copy_without_marks_is_a_plain_hdf5_file(tmp_path: Path) -> None:
    killed_run(tmp_path / "result.h5", 0.0)
    data = bytearray((tmp_path / "result.part.h5").read_bytes())
    data[28:36] = (200).to_bytes(8, "little")  # an end of file that was not updated
    (tmp_path / "stale.h5").write_bytes(data)
    (tmp_path / "plain.h5").write_bytes(without_open_marks(tmp_path / "stale.h5").getvalue())
    with h5py.File(tmp_path / "plain.h5") as file:
        assert file["time"][0] == 0.0
    assert len(read_solution(tmp_path / "plain.h5")) >= 10


ODD_SUMMARIES = {
    "stages that are a word": {"stages": "contact"},
    "stages of numbers": {"stages": [1, 2]},
    "a stage without a travel": {"stages": [{"name": "contact", "force": 1.0}]},
    "a stage at a word": {"stages": [{"name": "contact", "travel": "here", "force": 1.0}]},
    "a stage at infinity": {"stages": [{"name": "contact", "travel": np.inf, "force": 1.0}]},
    "a stage without a name": {"stages": [{"name": None, "travel": 0.0, "force": 1.0}]},
    "events that are none": {"events": [{"kind": "snap"}]},
    "warnings of numbers": {"warnings": [1]},
    "a peak that is a list": {"peak_force": [1.0]},
    "stages without a peak": {"stages": [], "peak_force": 1.0, "peak_travel": None},
    "a frequency without that of the spectrum": {"frequency_hz": 3.0, "frequency_resolution_hz": 0.1},
    "frequencies that are words": {"modes_hz": ["one"]},
    "a tension without stresses": {"tension_state": {"slack_fraction": 0.1}},
}


@pytest.mark.parametrize("name", ODD_SUMMARIES)
def test_a_summary_that_is_none_is_damage(name: str, tmp_path: Path) -> None:
    with ResultWriter(tmp_path / "result.h5", LAYOUT) as writer:
        writer.append(record(0))
        finish(writer, STATS, SUMMARY | ODD_SUMMARIES[name])
    with pytest.raises(CaseError, match="in the summary"):
        read_solution(tmp_path / "result.h5")


def test_a_folder_is_no_result(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match="is a folder, a pipe or a device"):
        read_solution(tmp_path)
    write(tmp_path / "result.h5")
    with pytest.raises(CaseError, match=r"is a folder; give .*result\.h5"):
        read_solution(tmp_path)
