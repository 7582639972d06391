"""Exports: other programs read the data of the result, and nothing is written besides the given file."""

from __future__ import annotations

import csv
import json
import re
import struct
from dataclasses import replace
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import fsm
from fsm.builders.patterns.of_sheet import flexible_mesh
from fsm.cli.command_line import cli
from fsm.results.all_channels import all_channels
from fsm.views.exporters import EXPORTERS, export
from fsm.views.plots.mesh import Mesh, mesh_of

ROOT = Path(__file__).parents[2]
CASES = {
    "strip_trial": {"expect": None, "strip.segments_per_panel": 4, "drive.0.travel": "6 mm", "save.every": "2 mm"},
    "rotating_squares": {"drive.0.travel": 0.14},
    "dropped_plates": {"solve.end_time": "5 ms", "save": {"interval": "1 ms"}},
    "sail_on_cables": {"solve.end_time": "1 ms", "save": {"interval": "0.25 ms"}},
    "membrane_impact": {"membrane.mesh": [7, 7], "vibration.modes": 4, "vibration.duration": "20 ms"},
    "scissor_array": {"solve.end_time": "0.02 s"},
    "miura_push": {"sheet.columns": 4, "sheet.rows": 2, "drive.0.travel": 0.1, "save.every": 0.05},
}
CHANNELS = {
    "strip_trial": ["crease.*", "panel.*", "body.*.velocity"], "dropped_plates": ["body.*"], "membrane_impact": ["film.*"],
    "sail_on_cables": ["film.*", "cable.*"],
}  # fmt: skip


@pytest.fixture(scope="module")
def results() -> dict[str, fsm.Result]:
    found: dict[str, fsm.Result] = {}

    class OnDemand(dict):
        def __missing__(self, name: str) -> fsm.Result:
            case = fsm.load(ROOT / "folding_cases" / name / "case.toml").set(CASES[name])
            self[name] = case.run(channels=CHANNELS.get(name))
            return self[name]

    return OnDemand(found)


def middles_of(mesh: Mesh, record: int) -> np.ndarray:
    return np.array([mesh.points[record][cell[:n]].mean(axis=0) for cell, n in zip(mesh.cells, mesh.corners, strict=True)])


@pytest.mark.parametrize("name", CASES)
def test_vtk_reads_the_motion(name: str, results: dict[str, fsm.Result], tmp_path: Path) -> None:
    """Times, points, cells and data of every record, as VTK reads them."""
    from vtkmodules.util.numpy_support import vtk_to_numpy  # not all of VTK, and in this process only: 150 MB
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOHDF import vtkHDFReader

    result = results[name]
    reader = vtkHDFReader()
    reader.SetFileName(str(result.export("vtkhdf", tmp_path / "x.vtkhdf")))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    assert np.array_equal(times, result.time)
    mesh = mesh_of(result.solution)
    for record in (0, len(times) // 2, len(times) - 1):
        reader.UpdateTimeStep(times[record])
        grid = reader.GetOutput()
        assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), mesh.points[record])
        assert grid.GetNumberOfCells() == len(mesh.cells)
        middle = [vtk_to_numpy(grid.GetCell(k).GetPoints().GetData()).mean(axis=0) for k in range(0, len(mesh.cells), 5)]
        assert np.allclose(middle, middles_of(mesh, record)[::5])
        for data, found in ((grid.GetCellData(), mesh.cell_data), (grid.GetPointData(), mesh.point_data)):
            for key, (unit, values) in found.items():
                array = data.GetArray(f"{key} ({unit})".replace("/", "_per_"))
                assert np.array_equal(vtk_to_numpy(array), values[record], equal_nan=True), key
        for key, channel in all_channels(result.solution).items():
            array = grid.GetFieldData().GetArray(f"{key} ({channel.info.unit})".replace("/", "_per_"))
            assert np.array_equal(vtk_to_numpy(array).ravel(), channel.values[record].ravel(), equal_nan=True), key


def test_vtk_draws_the_last_record(results: dict[str, fsm.Result], tmp_path: Path) -> None:
    """The surface from ParaView's reader is drawn within the bounds of the exported points."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401, registers what draws
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
    from vtkmodules.vtkIOHDF import vtkHDFReader
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

    reader = vtkHDFReader()
    reader.SetFileName(str(results["strip_trial"].export("vtkhdf", tmp_path / "x.vtkhdf")))
    reader.UpdateInformation()
    reader.SetStep(reader.GetNumberOfSteps() - 1)
    surface, mapper, actor = vtkDataSetSurfaceFilter(), vtkPolyDataMapper(), vtkActor()
    surface.SetInputConnection(reader.GetOutputPort())
    mapper.SetInputConnection(surface.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(1.0, 0.0, 0.0)
    actor.GetProperty().LightingOff()
    renderer, window = vtkRenderer(), vtkRenderWindow()
    renderer.AddActor(actor)
    window.SetOffScreenRendering(1)
    window.SetSize(200, 150)
    window.AddRenderer(renderer)
    renderer.GetActiveCamera().Elevation(50.0)
    renderer.ResetCamera()
    window.Render()
    picture = vtkWindowToImageFilter()
    picture.SetInput(window)
    picture.Update()
    pixels = vtk_to_numpy(picture.GetOutput().GetPointData().GetScalars()).reshape(150, 200, -1)
    drawn = pixels[..., 0] > 200
    assert 100 < drawn.sum() < 0.9 * drawn.size
    assert not drawn[:, 0].any() and not drawn[:, -1].any()


def test_channels_belong_to_their_parts(results: dict[str, fsm.Result]) -> None:
    result = results["strip_trial"]
    mesh = mesh_of(result.solution)
    unit, moment = mesh.point_data["crease.moment"]
    assert unit == "N m"
    with_values = np.flatnonzero(np.isfinite(moment[-1]))
    places = {tuple(np.round(mesh.points[0, k, [0, 2]], 6)) for k in with_values}
    assert len(places) == 5  # one line for each crease
    third = with_values[moment[-1, with_values] == result["crease.3.moment"][-1]]
    assert np.allclose(mesh.points[-1, third][:, 2], result["crease.3.position"][-1][2], atol=1e-5)
    curvature = mesh.cell_data["panel.curvature"][1]
    assert np.isfinite(curvature[:, mesh.panel == 3]).all()
    assert curvature[-1][mesh.panel == 3][1] == pytest.approx(result["panel.3.curvature"][-1][:2].mean())
    speed = mesh.cell_data["body.velocity"][1]
    second = np.flatnonzero(mesh.panel == 2)[1]
    assert np.array_equal(speed[-1, second], result["body.panel 2 segment 2.velocity"][-1], equal_nan=True)
    pressed = mesh.cell_data["contact.normal_force"][1][-1]
    forces = [force[-1] for name, force in result["contact.*.normal_force"].items() if "3" in name]
    assert pressed[mesh.panel == 3][0] == pytest.approx(sum(forces))


def glb(path: Path) -> tuple[dict, list[np.ndarray]]:
    """Document and arrays of a binary glTF file, with the checks of its container."""
    data = path.read_bytes()
    magic, version, size = struct.unpack("<4sII", data[:12])
    assert (magic, version, size) == (b"glTF", 2, len(data))
    length, kind = struct.unpack("<I4s", data[12:20])
    assert kind == b"JSON" and length % 4 == 0
    document = json.loads(data[20 : 20 + length])
    binary_size, kind = struct.unpack("<I4s", data[20 + length : 28 + length])
    assert kind == b"BIN\0" and binary_size == size - 28 - length
    binary = data[28 + length :]
    arrays = []
    for accessor in document["accessors"]:
        view = document["bufferViews"][accessor["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= document["buffers"][0]["byteLength"]
        width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
        kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        values = np.frombuffer(binary, kind, accessor["count"] * width, view["byteOffset"]).reshape(-1, width)
        if "min" in accessor:
            assert np.array_equal(values.min(axis=0), np.array(accessor["min"], "f4"))
            assert np.array_equal(values.max(axis=0), np.array(accessor["max"], "f4"))
        arrays.append(values)
    return document, arrays


@pytest.mark.parametrize("name", CASES)
def test_glb_holds_the_motion(name: str, results: dict[str, fsm.Result], tmp_path: Path) -> None:
    """Structure of glTF 2.0, and positions in every frame."""
    result = results[name]
    document, arrays = glb(result.export("glb", tmp_path / "x.glb"))
    mesh = mesh_of(result.solution)
    (drawn,) = document["meshes"]
    start = arrays[drawn["primitives"][0]["attributes"]["POSITION"]]
    assert all("POSITION" in document["accessors"] or "min" in document["accessors"][0] for _ in drawn["primitives"])
    animation = document["animations"][0]
    times = arrays[animation["samplers"][0]["input"]].ravel()
    weights = arrays[animation["samplers"][0]["output"]].reshape(len(times), -1)
    assert animation["channels"][0]["target"] == {"node": 1, "path": "weights"}
    factor = document["asset"]["extras"]["time_factor"]
    assert np.all(np.diff(times) > 0)
    for frame in (0, len(times) // 2, len(times) - 1):
        record = int(np.abs(result.time - result.time[0] - times[frame] / factor).argmin())
        changes = [arrays[target["POSITION"]] for target in drawn["primitives"][0]["targets"]]
        shown = start + sum(weight * change for weight, change in zip(weights[frame], changes, strict=True))
        assert np.allclose(shown, mesh.points[record], atol=1e-6)
    corners = sum(len(arrays[each["indices"]]) for each in drawn["primitives"])
    assert corners == 6 * np.sum(mesh.corners == 4) + 3 * np.sum(mesh.corners == 3) + 2 * np.sum(mesh.corners == 2)
    assert max(arrays[each["indices"]].max() for each in drawn["primitives"]) < len(start)


def test_tables_hold_all_channels(results: dict[str, fsm.Result], tmp_path: Path) -> None:
    from pyarrow.parquet import read_table

    result = results["strip_trial"]
    with result.export("csv", tmp_path / "x.csv").open(newline="") as file:
        heading, *rows = csv.reader(file)
    values = np.array(rows, dtype=float)
    assert np.allclose(values[:, heading.index("crease.3.moment (N m)")], result["crease.3.moment"], rtol=1e-11)
    assert np.allclose(values[:, heading.index("time (s)")], result.time)
    table = read_table(result.export("parquet", tmp_path / "x.parquet"))
    for label, column in result["crease.3.force"].columns.items():
        assert np.array_equal(table[label], column)
    assert table.schema.field("drive.1.force").metadata[b"unit"] == b"N"
    assert len(table.column_names) == len(heading)


@pytest.mark.parametrize("name", ["strip_trial", "sail_on_cables"])
def test_movies_show_the_motion(name: str, results: dict[str, fsm.Result], tmp_path: Path) -> None:
    result = results[name]
    picture = Image.open(result.export("gif", tmp_path / "x.gif"))
    seen = []
    for frame in range(picture.n_frames):
        picture.seek(frame)
        seen.append(np.asarray(picture.convert("L"))[80:-80])
    assert len(seen) >= 2
    assert all((each < 200).any() for each in seen)
    assert not np.array_equal(seen[0], seen[-1])


def test_a_video_has_the_shown_duration(results: dict[str, fsm.Result], tmp_path: Path) -> None:
    frames = imageio_ffmpeg.read_frames(str(results["strip_trial"].export("mp4", tmp_path / "x.mp4")))
    facts = next(frames)
    duration = float(np.ptp(results["strip_trial"].time))
    assert facts["size"] == (960, 720)
    assert facts["duration"] == pytest.approx(duration, abs=0.1)
    pictures = [np.frombuffer(frame, np.uint8) for frame in frames]
    assert not np.array_equal(pictures[0], pictures[-1])


@pytest.mark.parametrize("name", CASES)
def test_inp_holds_the_mesh(name: str, results: dict[str, fsm.Result], tmp_path: Path) -> None:
    """Nodes at their places, elements with known nodes, and a section with a material for every element."""
    text = results[name].export("inp", tmp_path / "x.inp").read_text()
    blocks = [block.splitlines() for block in re.split(r"^\*(?!\*)", text, flags=re.MULTILINE)[1:]]
    nodes, elements, sections, materials = {}, {}, set(), set()
    for head, *lines in blocks:
        rows = [[part.strip() for part in line.split(",")] for line in lines if not line.startswith("**")]
        if head.startswith("NODE"):
            nodes = {int(row[0]): np.array(row[1:], dtype=float) for row in rows}
        elif head.startswith("ELEMENT"):
            group = re.search(r"ELSET=(\w+)", head)[1]  # type: ignore[index]
            corners = {"S4": 4, "S3": 3, "T3D2": 2}[re.search(r"TYPE=(\w+)", head)[1]]  # type: ignore[index]
            assert all(len(row) == corners + 1 for row in rows)
            elements |= {int(row[0]): (group, [nodes[int(k)] for k in row[1:]]) for row in rows}
        elif "SECTION" in head:
            sections.add(re.search(r"ELSET=(\w+)", head)[1])  # type: ignore[index]
            assert re.search(r"MATERIAL=(\w+)", head)[1] in materials  # type: ignore[index]
            assert float(rows[0][0]) > 0
        elif head.startswith("MATERIAL"):
            materials.add(re.search(r"NAME=(\w+)", head)[1])  # type: ignore[index]
    mesh = mesh_of(results[name].solution)
    assert len(elements) == len(mesh.cells)
    assert {group for group, _ in elements.values()} == sections
    middles = np.array([np.mean(corners, axis=0) for _, corners in elements.values()])
    expected = middles_of(mesh, 0)
    order = [np.lexsort(np.round(places, 5).T) for places in (middles, expected)]
    assert np.allclose(middles[order[0]], expected[order[1]], atol=1e-4 * np.ptp(mesh.points[0]))
    assert "units: m, kg, s, N, Pa" in text
    assert ("cables of the film" in text) == (name == "membrane_impact")
    assert ("N m/rad per m" in text) == (name == "miura_push")
    listed = re.search(r"ELSET=ALL_ELEMENTS\n((?:\w+\n)+)", text)
    assert listed is not None and set(listed[1].split()) == sections
    assert not set(unmoved_nodes(text)) & {one for one, _ in equations(text)}  # CalculiX refuses such supports
    if name == "strip_trial":
        assert text.count("*EQUATION") == 5 * 2 * 3
        assert len(nodes) == 2 * (2 + 2 + 4 * 5)  # held panels are one plate, others have four segments


def unmoved_nodes(text: str) -> list[int]:
    found = re.search(r"NSET=UNMOVED\n([\d,\s]+)", text)
    return [int(number) for number in re.findall(r"\d+", found[1])] if found else []


def equations(text: str) -> set[tuple[int, int]]:
    """Pairs of nodes with equal translations."""
    rows = re.findall(r"\*EQUATION\n2\n(\d+), (\d), 1.0, (\d+), \2, -1.0", text)
    assert len(rows) == text.count("*EQUATION")
    pairs = {(int(one), int(other)) for one, _, other in rows}
    assert len(rows) == 3 * len(pairs)
    return pairs


def test_flexible_facets_are_hinged_at_creases_only(tmp_path: Path) -> None:
    """Every triangle was hinged to its neighbours, and the edges of a slit were joined: the exported structure was wrong."""
    ring = fsm.load(ROOT / "folding_cases" / "slit_annulus" / "case.toml")
    ring = ring.set({"sheet.mesh": [2, 8], "load.0.force_per_length": [0, 0, 0.01]})
    folded = fsm.load(ROOT / "fsm" / "cli" / "templates" / "flexible.toml").set("drive.0.travel", "0.5 mm")
    for case in (ring, folded):
        result = case.run()
        text = result.export("inp", tmp_path / "x.inp").read_text()
        mesh = flexible_mesh(case.model.sheet)
        nodes = dict(re.findall(r"^(\d+), ([-\d.e]+, [-\d.e]+, [-\d.e]+)$", text.partition("*ELEMENT")[0], re.MULTILINE))
        assert len(nodes) == len(mesh.owner)
        pairs = equations(text)
        assert len(pairs) == len(mesh.owner) - len(set(mesh.owner.tolist()))
        places = {number: np.array(place.split(","), dtype=float) for number, place in nodes.items()}
        assert all(np.allclose(places[str(one)], places[str(other)], atol=1e-9) for one, other in pairs)
        assert bool(pairs) == (case is folded)
        assert unmoved_nodes(text)
        assert not set(unmoved_nodes(text)) & {one for one, _ in pairs}


WICKED = ["<script>alert(1)</script>", "$HOME", "../../outside", "/etc/passwd", "a/b", "=1+1", 'quo"te', "ü", "*", "%s%n"]


@pytest.mark.parametrize(
    "to",
    [
        pytest.param(name, marks=[pytest.mark.nightly] * (name in ("gif", "mp4")))
        for name in sorted(EXPORTERS.keys() - {"fold"})  # it shows sheets, whose parts have no names
    ],
)
def test_wicked_names_stay_text(to: str, tmp_path: Path) -> None:
    """Names of the case are not used as paths, and exactly one file appears."""
    model = fsm.Model("../<script>$(touch x)")
    for k, name in enumerate(WICKED):
        plate = {"length": "20 mm", "width": "20 mm", "thickness": "1 mm"}
        model.body(name, mass="1 g", inertia=[1e-7] * 3, position=[0.03 * k, 0, 0], velocity=[0, 0, 0.1], plate=plate)
    result = model.settings(end_time="10 ms").solve(out=tmp_path / "run", channels=["body.*.velocity", "energy.*"])
    before = set(tmp_path.rglob("*"))
    out = tmp_path / "deep" / "out" / f"x.{to}"
    found = CliRunner().invoke(cli, ["export", str(result.path), "--to", to, "--out", str(out)])
    assert found.exit_code == 0, found.output
    assert set(tmp_path.rglob("*")) - before == {out, out.parent, out.parent.parent}


@pytest.mark.parametrize("to", ["../x", "x/y", "VTK", "", "csv\n"])
def test_unknown_formats_are_refused(to: str, results: dict[str, fsm.Result]) -> None:
    found = CliRunner().invoke(cli, ["export", str(results["rotating_squares"].path), "--to", to])
    assert found.exit_code == 2
    assert len(found.output.strip().splitlines()) == 1
    assert "the formats are csv, fold, gif, glb, inp, mp4, parquet, vtkhdf" in found.output


@pytest.mark.parametrize("damage", ["cut", "bytes", "empty", "text", "missing", "folder"])
@pytest.mark.parametrize("to", ["vtkhdf", "glb", "inp"])
def test_damaged_results_are_one_line(damage: str, to: str, results: dict[str, fsm.Result], tmp_path: Path) -> None:
    data = bytearray((results["rotating_squares"].path / "result.h5").read_bytes())
    path = tmp_path / "result.h5"
    if damage == "folder":
        path.mkdir()
    elif damage != "missing":
        part = len(data) // 4
        bytes_changed = data[:part] + b"\xff" * (2 * part) + data[3 * part :]
        path.write_bytes({"cut": data[: 2 * part], "bytes": bytes_changed, "empty": b"", "text": b"x" * 999}[damage])
    found = CliRunner().invoke(cli, ["export", str(path), "--to", to, "--out", str(tmp_path / "y")])
    assert found.exit_code == 2, found.output
    assert len(found.output.strip().splitlines()) == 1
    assert not (tmp_path / "y").exists()


def test_a_damaged_case_in_a_result_is_one_line(results: dict[str, fsm.Result], tmp_path: Path) -> None:
    result = results["dropped_plates"]
    text = "[scene]\nbodies = [3]\n"
    damaged = replace(result.solution, layout=replace(result.solution.layout, case_text=text))
    with pytest.raises(fsm.CaseError, match="the case in this result is damaged") as caught:
        export(damaged, "inp", tmp_path / "x")
    assert len(str(caught.value).splitlines()) == 1
    assert not list(tmp_path.iterdir())
    export(damaged, "glb", tmp_path / "x")  # names of parts are in the result


def test_bodies_without_plates(tmp_path: Path) -> None:
    model = fsm.Model("ball").body("ball", mass=1, inertia=[1] * 3, velocity=[1, 0, 0]).settings(end_time=0.1)
    result = model.solve(out=tmp_path / "ball")
    for to in ("vtkhdf", "glb", "inp", "gif"):
        with pytest.raises(fsm.CaseError, match="no plates, films, cables or beams"):
            result.export(to)
    assert result.export("csv").read_text().startswith("time (s),")


def test_every_stage_of_a_run_is_exported(tmp_path: Path) -> None:
    """A folder of two stages was refused."""
    model = fsm.Model("ball").body("ball", mass=1, inertia=[1] * 3, velocity=[1, 0, 0]).settings(end_time=0.1)
    for stage in ("deploy", "vibrate"):
        model.solve(out=tmp_path / "two" / stage)
    found = CliRunner().invoke(cli, ["export", str(tmp_path / "two"), "--to", "csv"])
    assert found.exit_code == 0, found.output
    files = [tmp_path / "two" / stage / "result.csv" for stage in ("deploy", "vibrate")]
    assert found.output.split() == [str(file) for file in files]
    assert all(file.is_file() for file in files)
    named = [tmp_path / "all" / f"ball-{stage}.csv" for stage in ("deploy", "vibrate")]
    command = ["export", str(tmp_path / "two"), "--to", "csv", "--out", str(tmp_path / "all" / "ball.csv")]
    found = CliRunner().invoke(cli, command)
    assert found.output.split() == [str(file) for file in named]
    by_python = fsm.open(tmp_path / "two").export("csv", tmp_path / "py" / "ball.csv")
    assert by_python == [tmp_path / "py" / file.name for file in named]
    assert fsm.open(tmp_path / "two").export("csv") == files
    empty = CliRunner().invoke(cli, ["export", str(tmp_path / "py"), "--to", "csv"])
    assert empty.exit_code == 2
    assert "folder without result.h5" in empty.output
