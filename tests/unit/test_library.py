"""Library of measured crease laws: every entry is whole and runs, an unknown name is told, and a case keeps its source."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import fsm
from fsm.case.loading.json_schema import case_schema
from fsm.case.loading.load_case import load_case
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from fsm.library import entries

CASES = Path(__file__).parents[2] / "folding_cases"
HINGE = CASES / "strip_hinge"
NAME = "origami-hinge-unit075"
LAW = f'library = "{NAME}"'
DATA = f'law = "spline"\ndata = "{(HINGE / "hinge.csv").as_posix()}"\nrest_angle = "214 deg"'
"""The same curve from the file of the test: no moment at 54 degrees of the test, 160 degrees from flat."""
SCENE = """
solve.end_time = 1
[scene]
bodies = [
    { name = "a", mass = 0.001, inertia = [1e-6, 1e-6, 1e-6], held = true },
    { name = "b", mass = 0.001, inertia = [1e-6, 1e-6, 1e-6], position = [0.04, 0, 0] },
]
"""
WING = (
    (Path(fsm.__file__).parent / "cli" / "templates" / "wing.toml")
    .read_text(encoding="utf-8")
    .replace('spring = { stiffness = "0.1 N m/rad", rest = "-90 deg" }', 'spring = { library = "kapton" }')
)
HINGED = '{ name = "pin", kind = "revolute", first = "a", second = "b", at = [0.02, 0, 0], axis = [0, 1, 0], spring = '


def command(*words: str) -> Result:
    return CliRunner().invoke(cli, list(words))


def strip(folder: Path, law: str = LAW) -> Path:
    """The shipped strip with another law of its creases."""
    text = re.sub(
        r"(?s)\[crease\]\n.*?\n\n", lambda _: f"[crease]\n{law}\n\n", (HINGE / "case.toml").read_text(encoding="utf-8")
    )
    assert law in text
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


def stated(monkeypatch: pytest.MonkeyPatch, **sizes: float) -> None:
    """Let the source of the entry state sizes."""
    monkeypatch.setitem(entries(), NAME, dataclasses.replace(entries()[NAME], **sizes))


@pytest.mark.parametrize("name", list(entries()))
def test_every_entry_is_whole(name: str) -> None:
    found = entries()[name]
    texts = [getattr(found, field.name) for field in dataclasses.fields(found) if field.name not in ("thickness", "width")]
    page = command("help", "library").output
    own = page[page.index(f"\n{name}\n") :]
    for text in texts:
        assert text.strip() and text in own
    for length in (found.thickness, found.width):
        assert length == "not stated" or (isinstance(length, float) and 0.0 < length < 1.0)
    licence = found.file.with_name(f"LICENSE-{found.licence.partition('-')[0].upper()}.txt")
    assert len(licence.read_text(encoding="utf-8")) > 500
    assert found.source in found.file.read_text(encoding="utf-8")


def test_the_page_tells_the_ranges() -> None:
    page = command("help", "library").output
    assert 'crease = { library = "NAME" }' in page
    assert re.search(r"opening +-184 to 96 deg, 29 points\n +moment +-8.48 to 1.783 N mm\n", page)
    assert "library  measured laws of creases and hinges" in command("help").output


def test_an_entry_is_the_test(tmp_path: Path) -> None:
    """Moments over the crease angle as in the file of the test; the copy of the case needs no library."""
    loaded = load_case(strip(tmp_path))
    found, given = loaded.case.crease, load_case(strip(tmp_path, DATA)).case.crease
    assert isinstance(found, fsm.SplineCrease) and isinstance(given, fsm.SplineCrease)
    assert found.moment == given.moment
    assert np.subtract(math.radians(160.0), found.angle) == pytest.approx(
        np.subtract(given.rest_angle, given.angle), abs=1e-12
    )
    copy = tmp_path / "copy.toml"
    copy.write_text(loaded.text.replace(NAME, "of another version"), encoding="utf-8")
    again = load_case(copy).case.crease
    assert again == found.model_copy(update={"library": "of another version"})
    assert "library" not in command("check", str(copy)).output.split()


def test_an_entry_runs_in_a_strip(tmp_path: Path) -> None:
    coarse = {"strip.segments_per_panel": 2, "drive.0.travel": "3 mm", "save.every": "1 mm"}
    peaks = [fsm.load(strip(tmp_path, law)).set(coarse).run().summary["peak_force"] for law in (LAW, DATA)]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-9)
    assert peaks[0] > 0.01


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("", "crease.library"),
        (
            SCENE + 'elements = [{ name = "c", outer = "a", inner = "b", crease = { library = "kapton" } }]',
            "scene.elements.0.crease.library",
        ),
        (SCENE + f'joints = [{HINGED} {{ library = "kapton" }} }}]', "scene.joints.0.spring: library"),
        (WING, "wing.hinge.spring.library"),
    ],
)
def test_an_unknown_name_lists_the_names(text: str, place: str, tmp_path: Path) -> None:
    path = strip(tmp_path, 'library = "kapton"')
    if text:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        load_case(path)
    (told,) = [str(fault) for fault in caught.value.faults if "kapton" in str(fault)]
    assert place in told and '"kapton" is not in the library, which has ' + NAME in told
    assert command("check", str(path)).exit_code == 2


def test_one_source_of_a_curve(tmp_path: Path) -> None:
    found = command("check", str(strip(tmp_path, LAW + f'\ndata = "{(HINGE / "hinge.csv").as_posix()}"')))
    assert found.exit_code == 2
    assert "give `data` (a CSV file), `library` (a name), or both `angle` and `moment`" in found.output
    found = command("check", str(strip(tmp_path, LAW + '\nfile = "crease.h5"')))
    assert "crease.library: not used with the other keys here, which mean another law; remove this key" in found.output


def test_a_check_names_source_and_thickness(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = str(strip(tmp_path))
    told = command("check", path).output
    for text in (
        "thickness not stated",
        entries()[NAME].scatter,
        entries()[NAME].source,
        "Apache-2.0",
        entries()[NAME].assumed,
    ):
        assert text in told
    assert f"{NAME}: the thickness of the test is not stated; here it is 0.3 mm" in told
    stated(monkeypatch, thickness=0.2e-3)
    assert f"{NAME} was tested at a thickness of 0.2 mm; here it is 0.3 mm" in command("check", path).output
    stated(monkeypatch, thickness=0.3e-3)
    told = command("check", path).output
    assert "thickness 0.3 mm" in told
    assert f"{NAME} was tested" not in told


def test_the_width_of_the_test_scales_a_sheet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "case.toml"
    text = (CASES / "miura_push" / "case.toml").read_text(encoding="utf-8")
    text, number = re.subn(r"(?s)\[crease\]\n.*?\n\n", f"[crease]\n{LAW}\n\n", text)
    assert number == 1
    path.write_text(text, encoding="utf-8")
    assert "crease.width: missing; a sheet needs the width of the tested crease" in command("check", str(path)).output
    stated(monkeypatch, width=0.02)
    told = command("check", str(path))
    assert told.exit_code == 0, told.output
    assert load_case(path).case.crease.width == 0.02


def test_editors_accept_a_name(tmp_path: Path) -> None:
    import tomllib

    import jsonschema

    given = tomllib.loads(strip(tmp_path).read_text(encoding="utf-8"))
    assert not list(jsonschema.Draft7Validator(case_schema()).iter_errors(given))


def test_the_picture_of_the_page_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (CASES.parent / "docs" / "library.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```\{executed\} python library.png\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "docs/library.md", "exec"), {})
    assert (tmp_path / "library.png").stat().st_size > 5000
