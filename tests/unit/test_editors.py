"""Cases of `fsm init`, pages of `fsm help`, and the JSON Schema of case files."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any, get_args

import jsonschema
import pytest
from click.testing import CliRunner, Result

from fsm.case.loading.json_schema import case_schema
from fsm.case.loading.key_help import _pages, help_lines
from fsm.case.models.case import Strip, root
from fsm.case.models.sheet import Sheet
from fsm.case.schema.schema import facts_of, section_of
from fsm.cli.command_line import cli
from fsm.cli.init import _ALSO, kinds

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "folding_cases").glob("*/case.toml"))


def fsm(*words: str) -> Result:
    return CliRunner().invoke(cli, list(words))


LONG = ("boom", "cone", "deployed", "film")
"""Cases that run for more than two seconds."""


@pytest.fixture(scope="module")
def validator() -> Any:
    schema = case_schema()
    jsonschema.Draft7Validator.check_schema(schema)
    return jsonschema.Draft7Validator(schema)


def faults(validator: Any, text: str) -> list[str]:
    return [".".join(map(str, error.absolute_path)) for error in validator.iter_errors(tomllib.loads(text))]


@pytest.mark.parametrize("kind", [pytest.param(kind, marks=[pytest.mark.nightly] * (kind in LONG)) for kind in kinds()])
def test_a_new_case_runs(kind: str, validator: Any, tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    found = fsm("init", kind, str(path))
    assert found.exit_code == 0, found.output
    text = path.read_text(encoding="utf-8")
    assert sum("#" in line for line in text.splitlines()) > 5
    assert not faults(validator, text)
    assert fsm("check", str(path)).exit_code == 0
    found = fsm("run", str(path), "--out", str(tmp_path / "out"), "--quiet")
    assert found.exit_code == 0, found.output
    assert (tmp_path / "out" / "summary.json").is_file()


def test_every_builder_has_a_case() -> None:
    built = {name: name for name in ("strip", "lattice", "sheet", "scene")} | {"membrane": "film", "scissor": "array"}
    assert set(built.values()) <= set(kinds())
    builders = {path.stem for path in (ROOT / "fsm" / "builders").glob("[a-z]*.py")} | {"sheet", "membrane", "scissor"}
    parts = {"beside_sheet", "flexible_loads", "flexible_sheet"}  # of a sheet
    parts |= {f"sheet_{part}" for part in ("bars", "contact", "folding", "gas", "joints", "loads", "supports")}
    sheet = Sheet.model_fields
    for kind in (*get_args(get_args(sheet["kind"].annotation)[0]), *get_args(sheet["facets"].annotation)):
        assert _ALSO.get(kind, kind) in kinds(), kind
    texts = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "fsm" / "cli" / "templates").glob("*.toml"))
    for name in ("bodies", "elements", "pairs", "cables", "beams", "trusses", "frames"):
        assert f"[[scene.{name}]]" in texts
    assert builders - parts - {"warm_up", "scissor_bodies"} == set(built), "a new builder needs a template"


def test_a_file_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("mine")
    found = fsm("init", "strip", str(path))
    assert found.exit_code == 2
    assert "exists and is not overwritten; give another name" in found.output
    assert path.read_text() == "mine"
    for wrong in ("stripe", "../strip", ""):
        found = fsm("init", wrong, str(tmp_path / "x.toml"))
        assert found.exit_code == 2
        assert "the kinds are array, beam, boom, cable, cone" in found.output
        assert not (tmp_path / "x.toml").exists()


def test_pages_of_keys() -> None:
    page = "\n".join(help_lines("strip.fold_angle"))
    for part in ("rad", "needed", "0 to pi/2, both excluded", "angle of every panel with the horizontal"):
        assert part in page
    assert help_lines("drive.0.speed") == help_lines("drive.speed")
    assert any(line.startswith("fold_angle") and " rad " in line for line in help_lines("strip"))
    assert any(line.startswith("sheet.fold_angle") for line in help_lines("fold_angle"))
    assert "  only with law = \"spline\"" in help_lines("crease.data")
    assert any(line.startswith("contact ") for line in help_lines(""))


def test_every_key_has_a_page_with_a_meaning() -> None:
    """Each key has a help page with its type, default and meaning."""
    keys = _pages()
    assert {"strip.panels", "scene.films.mesh", "step.drive.travel", "vibration.probes"} <= set(keys)
    for key in keys:
        lines = help_lines(key)
        assert lines[0].strip("[]") == key
        assert any(line.startswith("  type") for line in lines), key
        assert any(line.startswith("  default") for line in lines), key
        assert any(line.startswith("  meaning   ") for line in lines), key


@pytest.mark.parametrize(
    ("key", "facts"),
    [
        ("strip.fold_angle", ("rad", "needed", "0 to pi/2, both excluded", "", "angle of every panel with the horizontal")),
        ("contact.damping", ("N s/m", '0; needed by "impact"', ">= 0", 'law = "hertz", "impact", "linear"', "C of a whole")),
        ("friction.presliding", ("m", 'needed by "lugre"', "> 0", 'law = "lugre"', "deflection of the bristles")),
        ("friction.law", ("text", '"step"', '"step", "tanh", "stribeck", "lugre"', "", "coefficient of friction over")),
        ("load.time.kind", ("text", "needed", '"constant", "ramp", "table", "cycle"', "", '"constant": the factor 1')),
        ("load.time.end", ("s", 'needed by "ramp"', "> start", 'kind = "ramp"', "time at which the ramp ends")),
        ("patch.count", ("-", 'needed by "grid"; else 1', '"diagonals": 1 to 100; "grid": 1 to 100 each',
                         'place = "diagonals", "grid"', '"diagonals": number of patches on each half diagonal; "grid"')),
        ("crease.rest_angle", ("rad", "as folded", '"linear": 0 to pi; "spline", "family": -2 pi to 2 pi', "",
                               '"linear": crease angle (0 flat, pi closed)')),
        ("scene.beams.held", ("list of text", "none", 'a list of "start", "end"', "", "ends that do not move")),
        ("scene.trusses.linear_to", ("rad", "pi", "0 to pi, 0 excluded", "", "fold angle beyond which")),
        ("solve.rtol", ("-", "1e-6; 1e-9 with ideal joints", "1e-12 to 0.01", "", "relative tolerance")),
        ("load.at", ("text, or m", "absent", "", "", "place of a sheet")),
        ("drive.run_up", ("m", "1 % of the travel", "0 to travel", "", "travel over which")),
        ("membrane.mesh", ("-", "[12, 12]", "1 to 200 each", "", "elements along length and width")),
    ],
)  # fmt: skip
def test_facts_of_keys(key: str, facts: tuple[str, ...]) -> None:
    """Default, range and variants follow from the model where its field does not state them in words."""
    section: Any = root({})
    *path, name = key.split(".")
    for part in path:
        section = section_of(section.step(part))
    found = facts_of(section, name)
    assert (found.kind, found.default, found.range, found.used) == facts[:-1]
    assert found.meaning.startswith(facts[-1])


@pytest.mark.parametrize("key", ["strip.fold_angel", "strpi", "strip.panels.x", "../x", "x" * 300])
def test_unknown_keys(key: str) -> None:
    found = fsm("help", key)
    assert found.exit_code == 2
    assert len(found.output.strip().splitlines()) == 1
    assert found.output.startswith("help: unknown key")


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.parent.name)
def test_shipped_cases_fit_the_schema(path: Path, validator: Any) -> None:
    assert faults(validator, path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("change", "place"),
    [
        (("panels = 6", "panels = 1"), "strip.panels"),
        (("panels = 6", "panel = 6"), "strip"),
        (("length = \"480 mm\"", "length = -1"), "strip.length"),
        (("length = \"480 mm\"", "length = \"long\""), "strip.length"),
        (("law = \"linear\"", "law = \"quadratic\""), "crease"),
        (("direction = [0, 0, 1]", "direction = [0, 1]"), "drive.0.direction"),
        (("crease = 3", "crease = true"), "drive.0.crease"),
        (("rtol = 1e-4", "method = \"statics\""), "solve.method"),
        (("damping = \"10 ms\"", "damping = \"\""), "material.damping"),
    ],
)  # fmt: skip
def test_mistakes_are_found_by_the_schema(change: tuple[str, str], place: str, validator: Any) -> None:
    text = (ROOT / "fsm" / "cli" / "templates" / "strip.toml").read_text(encoding="utf-8")
    assert change[0] in text
    assert place in faults(validator, text.replace(*change, 1))


def test_docstrings_have_the_keys() -> None:
    assert "\nfold_angle : rad\n    angle of every panel with the horizontal\n" in str(Strip.__doc__)


def test_descriptions_have_units(tmp_path: Path) -> None:
    path = tmp_path / "fsm.schema.json"
    assert fsm("schema", "--out", str(path)).exit_code == 0
    schema = json.loads(path.read_text(encoding="utf-8"))
    assert schema == json.loads(fsm("schema").output)
    angle = schema["definitions"]["Strip"]["properties"]["fold_angle"]["description"]
    assert angle.startswith("angle of every panel with the horizontal; unit: rad")
    undescribed = [
        f"{name}.{key}" for name, section in schema["definitions"].items() for key, value in section["properties"].items()
        if "description" not in value
    ]  # fmt: skip
    assert not undescribed


EXTENSION = """
from pydantic import Field
from fsm.extend import Section, add_builder, add_element_law
from fsm.case.models.scene import Scene
from fsm.case.schema.units import Force, Length

class Wire(Section):
    "Section [wire_of_a_test]."
    span: Length = Field(gt=0, description="distance of the `supports`")

class Slack(Section):
    "Parameters of a law."
    pull: Force = Field(default=2.0, description="force of a taut wire")

add_element_law("slack_of_a_test", None, Slack)
add_builder("wire_of_a_test", Wire, lambda section, others: Scene())
"""


def test_sections_of_extensions_are_in_the_schema(tmp_path: Path, validator: Any) -> None:
    from fsm.registry import BUILDERS, ELEMENT_LAWS

    (tmp_path / "wire.py").write_text(EXTENSION, encoding="utf-8")
    words = ("--extension", str(tmp_path / "wire.py"))
    try:
        printed = fsm("schema", *words)
        assert printed.exit_code == 0, printed.output
        assert fsm("help", "wire_of_a_test.span", *words).output.splitlines() == [
            "wire_of_a_test.span", "  type      number, or text with a unit", "  unit      m", "  default   needed",
            "  range     > 0", "  meaning   distance of the supports",
        ]  # fmt: skip
        assert "span  m  needed  distance of the supports" in fsm("help", "wire_of_a_test", *words).output
        assert "wire_of_a_test" in fsm("help", *words).output
        assert "force of a taut wire" in fsm("help", "scene.elements.parameters", *words).output
        assert "  unit      N" in fsm("help", "scene.elements.parameters.pull", *words).output.splitlines()
    finally:
        BUILDERS.pop("wire_of_a_test", None)
        ELEMENT_LAWS.pop("slack_of_a_test", None)
    assert fsm("help", "wire_of_a_test").exit_code == 2
    schema = json.loads(printed.output)
    span = schema["definitions"]["extension wire_of_a_test"]["properties"]["span"]
    assert span["description"] == "distance of the supports; unit: m; range: > 0; default: needed"
    jsonschema.Draft7Validator.check_schema(schema)
    wider = jsonschema.Draft7Validator(schema)
    case = {"extensions": ["wire.py"], "wire_of_a_test": {"span": "1 m"}}
    assert not wider.is_valid({**case, "wire_of_a_test": {"spam": "1 m"}})
    assert wider.is_valid(case)
    assert not validator.is_valid(case)
    missing = fsm("schema", "--extension", "none.py")
    assert missing.exit_code == 2
    assert "none.py" in missing.output


def test_pages_of_joints_and_couplings_list_their_parts() -> None:
    gear = help_lines("scene.couplings")
    assert any(line.startswith("backlash") for line in gear)
    assert {'parameters of kind "gear":', 'parameters of kind "rack":'} <= set(gear)
    assert any(line.startswith("opens_at") for line in help_lines("scene.joints"))
    assert any(line.startswith("column") for line in help_lines("scene.springs"))
