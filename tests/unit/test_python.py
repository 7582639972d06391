"""Python interface: cases, models and results as objects; the examples of docs/python.md and of the docstrings."""

from __future__ import annotations

import doctest
import inspect
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fsm
from fsm.api import calibration, picture, result
from fsm.api import case as cases
from fsm.api import model as models

ROOT = Path(__file__).parents[2]
STRIP = ROOT / "folding_cases" / "strip_trial" / "case.toml"
PAGE = ROOT / "docs" / "python.md"


@pytest.fixture(scope="module")
def short() -> fsm.Result:
    quick = {"expect": None, "strip.segments_per_panel": 4, "drive.0.travel": "6 mm"}
    return fsm.load(STRIP).set(quick).run(channels=["crease.*"])


def blocks() -> list[str]:
    return re.findall(r"```\{executed\} python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def test_set_reads_units_as_the_file_does() -> None:
    case = fsm.load(STRIP)
    other = case.set("strip.fold_angle", "70 deg")
    assert other["strip.fold_angle"] == pytest.approx(np.radians(70.0))
    assert case["strip.fold_angle"] == pytest.approx(np.radians(80.0))
    assert case.set({"drive.0.speed": "1 mm/s", "drive.0.travel": np.float64(0.02)})["drive.0.travel"] == 0.02
    assert case.set("contact", None)["contact"] is None
    both = [case.set({"strip.length": "0.5 m"}).text, fsm.load(case.path).set("strip.length", 0.5).text]
    assert both[0] == both[1] == fsm.load_case(STRIP, ["strip.length=0.5 m"]).text


def test_text_dict_and_file_give_the_same_case() -> None:
    text = STRIP.read_text(encoding="utf-8")
    import tomllib

    assert fsm.load(text).text == fsm.load(tomllib.loads(text)).text == fsm.load(str(STRIP)).text
    assert fsm.load(fsm.load(STRIP).text).text == fsm.load(STRIP).text


def test_plain_numbers_keep_the_units_of_the_file() -> None:
    squares = fsm.load(ROOT / "folding_cases" / "rotating_squares" / "case.toml")
    assert squares.set("lattice.spacing", 16)["lattice.spacing"] == pytest.approx(0.016)
    with pytest.raises(fsm.CaseError, match="values in SI"):
        squares.set("material", fsm.Material(young=1e9, density=1e3))


@pytest.mark.parametrize(
    ("path", "value", "line"),
    [
        ("strip.thickness", "3 kg", 'strip.thickness: "3 kg" has the wrong unit; give a value in m'),
        ("strip.fold_angel", 1, "strip.fold_angel: unknown key; did you mean `strip.fold_angle`?"),
        ("drive.4.speed", 1, "drive.4.speed: the case has only 1 items there; the next one is number 1"),
        ("strip", 3, "strip: must be a section with the keys"),
    ],
)
def test_a_fault_is_one_line_with_its_parts(path: str, value: object, line: str) -> None:
    with pytest.raises(fsm.CaseError) as caught:
        fsm.load(STRIP).set(path, value)
    (text,) = str(caught.value).splitlines()
    assert text.startswith(f"{STRIP}: {line}")
    (fault,) = caught.value.faults
    assert fault.path == path
    assert fault.value in (value, None)


def test_a_section_made_in_python_has_the_same_messages() -> None:
    with pytest.raises(fsm.CaseError) as caught:
        fsm.Strip(length="3 kg", width=1, thickness=1, panels=1, fold_angle="80 deg")  # type: ignore[arg-type]
    assert str(caught.value).splitlines() == [
        'Strip: length: "3 kg" has the wrong unit; give a value in m', "Strip: panels: must be at least 2; it is 1",
    ]  # fmt: skip
    assert [(fault.value, fault.unit) for fault in caught.value.faults] == [("3 kg", "m"), (1, "")]


WRONG = [3, None, "strip = ", "[strip\n", {"strip": {}}, {"a": {"b": 1}}, Path("none.toml"), "none.toml"]


@pytest.mark.parametrize("case", WRONG)
def test_what_is_no_case_is_refused(case: object) -> None:
    with pytest.raises(fsm.CaseError):
        fsm.load(case)  # type: ignore[arg-type]


def test_result(short: fsm.Result) -> None:
    _, force = short.force()
    assert force.max() == pytest.approx(short.summary["peak_force"])
    assert np.array_equal(short.force("crease 3").force, force)
    moment = short["crease.3.moment"]
    assert moment.unit == "N m"
    assert moment.values.shape == moment.time.shape == short.time.shape
    assert np.allclose(2 * moment - moment, moment.values)
    assert float(np.max(moment)) == moment.max()
    assert set(short["crease.*.moment"]) == {f"crease.{k}.moment" for k in range(1, 6)}
    assert short["contact.*.gap"]["contact.panel 3 - panel 4.gap"].unit == "m"
    assert short["crease.2.force"].columns["crease.2.force x"].shape == short.time.shape
    assert short.case["strip.segments_per_panel"] == 4
    again = fsm.open(short.path)
    assert np.array_equal(again.force().force, force)


def test_unknown_quantities_of_a_result(short: fsm.Result) -> None:
    for wrong in ("crease.3.momen", "bar.*", ""):
        with pytest.raises(fsm.NotInResult, match="no channel") as caught:
            short[wrong]
        assert isinstance(caught.value, KeyError)
        assert len(str(caught.value).splitlines()) == 1
    for drive in (0, 2, "crease 4"):
        with pytest.raises(fsm.NotInResult, match="the drives are 1"):
            short.force(drive)
    with pytest.raises(fsm.NotInResult, match="figures of this result: force"):
        short.plot("forces")
    with pytest.raises(fsm.NotInResult, match="unknown format"):
        short.plot("force", out="x.doc")


def test_tables(short: fsm.Result) -> None:
    frame = short.to_pandas("crease.*.moment", "drive.*")
    assert np.array_equal(frame["crease.3.moment"], short["crease.3.moment"])
    assert frame.attrs["units"]["drive.1.force"] == "N"
    assert np.array_equal(frame.index, short.time)
    data = short.to_xarray()
    assert data["crease.1.force"].attrs["units"] == "N"
    assert np.array_equal(data["crease.1.force"].sel(axis="z"), short["crease.1.force"][:, 2])
    assert data["shape"].dims == ("time", "plate", "corner", "axis")


def test_a_missing_extra_is_named(short: fsm.Result, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(fsm.CaseError, match=r"to_pandas needs the package pandas.*fsm\[tables\]"):
        short.to_pandas()


def test_pictures(short: fsm.Result, tmp_path: Path) -> None:
    assert short.plot()._repr_png_().startswith(b"\x89PNG")  # type: ignore[union-attr]
    short.plot("crease.*.moment", "drive.1.force", out=tmp_path / "m.svg")
    assert "<svg" in (tmp_path / "m.svg").read_text(encoding="utf-8")


def test_report(short: fsm.Result, tmp_path: Path) -> None:
    page = short.report(tmp_path / "report.html", title="pull")
    assert "<title>pull" in page.read_text(encoding="utf-8")


def test_temporary_folders_go_with_the_result() -> None:
    model = fsm.Model().body("a", mass=1, inertia=[1, 1, 1], velocity=[1, 0, 0]).settings(end_time=0.1)
    found = model.solve()
    path = found.path
    assert (path / "result.h5").is_file()
    del found
    assert not path.exists()


def test_texts_are_short(short: fsm.Result) -> None:
    case = fsm.load(STRIP)
    solution = short.solution
    for each in (case, short, solution, solution.layout, short.force(), short["crease.1.force"], case.model, short.plot()):
        assert len(repr(each)) < 600, type(each)
        assert len(repr(each).splitlines()) == 1
    title = "<script>alert(1)</script>"
    for html in (case.set("title", title)._repr_html_(), fsm.Model(title)._repr_html_()):
        assert "&lt;script&gt;" in html
        assert "<script>" not in html


def test_printed_objects_tell_what_they_hold(short: fsm.Result) -> None:
    """The text of a solution was a list of 32 array shapes; the texts of a table and of a compiled scene were similar."""
    lines = str(short.solution).splitlines()
    assert len(lines) <= 5
    parts = (f"{len(short)} records from 0 to", f"{short.shape.shape[1]} drawn facets", "crease 3: ", " N", ": crease.1")
    for part in parts:
        assert part in str(short.solution), part
    assert f"{len(short)} records to" in str(short)
    ball = fsm.Body(name="ball", mass=1.0, inertia=[0.1 + 0.2] * 3)
    assert "inertia=(0.3, 0.3, 0.3)" in repr(ball)  # without round-off
    system = fsm.compile_scene(fsm.Scene(bodies=[ball]))
    assert repr(system) == "SegmentSystem(3 coordinates, 3 degrees of freedom)"
    table = fsm.load_table(ROOT / "folding_cases" / "strip_pull" / "table.csv")
    assert all(len(repr(row)) < 200 for row in table)
    assert len(repr(fsm.load_case(STRIP))) < 200
    files = [ROOT / "folding_cases" / name / "case.toml" for name in ("fold_file", "kresling", "sail_on_cables")]
    words = ("sheet of 12 rigid facets", "kresling sheet with bars", "1 body, 1 film, 4 cables")
    for file, word in zip(files, words, strict=True):
        assert word in repr(fsm.load(file))


def test_models_take_objects_and_keys() -> None:
    model = fsm.Model("two").body("a", mass="1 kg", inertia=[1, 1, 1])
    model.add(fsm.Body(name="b", mass=2.0, inertia=(1, 1, 1)), fsm.Solve(end_time=1.0))
    model.add("scene.bodies", name="c", mass=3, inertia=[1] * 3)
    assert [body.name for body in model.case["scene"].bodies] == ["a", "b", "c"]
    with pytest.raises(fsm.CaseError, match=r"scene\.bodies\.3\.mas: unknown key; did you mean"):
        model.body("d", mas=1, inertia=[1, 1, 1]).case  # noqa: B018
    for wrong in ("bodies", "scene.bodyes"):
        with pytest.raises(fsm.CaseError, match="unknown key"):
            model.add(wrong, name="x")
    with pytest.raises(fsm.CaseError, match="not a section of a case"):
        model.add(3.0)


def test_only_public_names_are_listed() -> None:
    assert dir(fsm) == sorted(fsm.__all__)
    assert (ROOT / "fsm" / "py.typed").is_file()
    for name in fsm.__all__:
        each = getattr(fsm, name)
        assert name == "__version__" or inspect.getdoc(each), name


def test_import_is_lazy() -> None:
    large = "('numpy', 'pydantic', 'numba', 'h5py', 'matplotlib', 'xarray')"
    code = f"import sys, fsm; print([name for name in {large} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"


def test_every_class_has_an_example() -> None:
    shown = set(re.findall(r"fsm\.([A-Z]\w+)", "\n".join(blocks())))
    for name in fsm.__all__:
        each = getattr(fsm, name)
        if inspect.isclass(each) and not issubclass(each, Exception):
            assert name in shown or ">>>" in (each.__doc__ or "") or name in READ_ONLY, name


READ_ONLY = {"Channel", "ChannelInfo", "Dim", "Fault", "Layout", "LoadedCase", "Record", "Solution", "TableCase"}
"""Classes of which users receive objects and make none; api.md describes them."""


@pytest.mark.parametrize("module", [calibration, cases, models, picture, result], ids=lambda module: module.__name__)
def test_examples_of_docstrings(module: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    found = doctest.testmod(module)  # type: ignore[arg-type]
    assert found.attempted
    assert not found.failed


@pytest.mark.nightly
@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "notebooks").glob("*.md")), ids=lambda page: page.stem)
def test_notebooks(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The scripts run, print numbers, and draw the pictures that the pages show."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folding_cases").symlink_to(ROOT / "folding_cases")
    for kind, name, text in re.findall(
        r"```\{executed\} (\w+) (\S+)\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL
    ):
        if not name.endswith(".png"):
            (tmp_path / name).write_text(text)
            continue
        assert kind == "python"
        exec(compile(text, str(page), "exec"), {})
        assert (tmp_path / name).stat().st_size > 5000
        assert re.search(r"\d", capsys.readouterr().out)


@pytest.mark.parametrize("block", range(len(blocks())))
def test_examples_of_the_page(block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    exec(compile(blocks()[block], f"{PAGE}, block {block + 1}", "exec"), {})


HINGE = STRIP.parents[1] / "strip_hinge" / "hinge.csv"


def test_a_calibration_is_an_object(tmp_path: Path) -> None:
    found = fsm.calibrate("crease", HINGE, level=0.9)
    assert isinstance(found, fsm.Calibrated)
    assert repr(found) == "Calibrated('crease': 4 quantities, 2 figures)"
    stiffness = found["curve: mean stiffness"]
    assert stiffness.low < stiffness.value < stiffness.high
    assert "90 % interval" in str(found)
    assert found.plot().kind == ".png"
    assert found.plot("residuals", tmp_path / "r.svg").kind == ".svg"
    names = {path.name for path in found.write(tmp_path / "out")}
    assert names == {"calibration.json", "curves.png", "residuals.png", "crease.h5"}
    wider = fsm.calibrate("crease", str(HINGE), level=0.99)["curve: mean stiffness"]
    assert wider.high - wider.low > stiffness.high - stiffness.low


def test_the_package_of_calibrations_stays_a_package() -> None:
    from fsm.calibrate.crease import calibrate_crease

    assert fsm.calibrate.crease.calibrate_crease is calibrate_crease
    assert "calibrate" in dir(fsm)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("creases", HINGE), 'unknown kind "creases"; the kinds are crease, relaxation, bending, force'),
        (("crease", "none.csv"), "none.csv"),
    ],
)
def test_faults_of_calibrations_are_one_line(arguments: tuple[str, Path], text: str) -> None:
    with pytest.raises(fsm.CaseError) as caught:
        fsm.calibrate(*arguments)
    assert text in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
    with pytest.raises(fsm.CaseError, match=r"level: must be between 0\.5 and 0\.9999; it is 2"):
        fsm.calibrate("crease", HINGE, level=2)
    with pytest.raises(fsm.NotInResult, match="the figures are curves, residuals"):
        fsm.calibrate("crease", HINGE).plot("loops")
