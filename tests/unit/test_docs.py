"""The pages of the documentation agree with the program: keys, examples, commands."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import get_args

import pytest
from click import Group
from pydantic import BaseModel

from docs._ext.key_tables import PAGES, sections, with_tables
from fsm.calibrate.crease import calibrate_crease
from fsm.calibrate.report import Options
from fsm.case.loading.crease_family import read_family
from fsm.case.loading.load_case import load_case
from fsm.case.models.contact import FRICTION_KEYS, NORMAL_KEYS, Contact, Friction
from fsm.case.models.coupling import OWN_COUPLINGS
from fsm.case.models.materials import SplineCrease
from fsm.case.models.sheet import _KEYS as KEYS_OF_SHEETS
from fsm.case.models.sheet import BOOMS, Sheet
from fsm.case.models.solve import Solve
from fsm.case.schema.model import Model
from fsm.case.schema.schema import Place, facts_of
from fsm.cli.command_line import CALIBRATIONS, cli
from fsm.run.run_case import run_case
from fsm.solve.outcome.status import Event

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "case_file.md"
README = ROOT / "README.md"
COMMANDS = ROOT / "docs" / "commands.md"
CALIBRATION = ROOT / "docs" / "calibration.md"
CREASE = ROOT / "folding_cases" / "strip_pull" / "crease.csv"

LAWS = {Contact: (NORMAL_KEYS, {"young", "poisson", "radius"}), Friction: (FRICTION_KEYS, set())}
"""Sections of one model whose keys depend on the law: the table of their laws, and optional keys it need not name."""


def rows(heading: str) -> Iterator[list[list[str]]]:
    """The cells of every table below this heading of the page."""
    for block in PAGE.read_text(encoding="utf-8").split("\n\n"):
        lines = block.strip().splitlines()
        if lines[0] == heading:
            yield [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines[2:]]


def test_tables_of_keys_are_those_of_the_models() -> None:
    """`make keys` would not change the pages, and the pages have every section."""
    texts = [page.read_text(encoding="utf-8") for page in PAGES]
    assert [with_tables(text) for text in texts] == texts, "run `make keys`"
    text = "".join(texts)

    def below(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
        yield model
        for child in model.__subclasses__():
            yield from below(child)

    models = {model for model in below(Model) if model is not Model and model.__module__.startswith("fsm.case.")}
    # bases of other models have names with an underscore, or no keys
    models = {model for model in models if model.model_fields and not model.__name__.startswith("_")}
    kinds = {kind.parameters for kind in OWN_COUPLINGS.values()}  # the text lists their keys
    assert models - kinds == {model for section in sections(text).values() for model in section.all_models()}
    of_couplings = text.split("### `[[scene.couplings]]`")[1].split("###")[0]
    assert all(f"`{key}`" in of_couplings for kind in kinds for key in kind.model_fields)


def test_contributing_names_files_that_exist() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    named = set(re.findall(r"`((?:fsm|docs|tests|validation)/[\w./-]+|fsm(?:\.\w+)+)`", text))
    assert len(named) > 100
    for name in sorted(named):
        path = ROOT / (name if "/" in name else name.replace(".", "/"))
        assert path.exists() or path.with_suffix(".py").exists() or ("NAME" in name and path.parent.is_dir()), name


def test_kinds_of_sheets_need_the_stated_keys() -> None:
    """Defaults of the keys of a sheet name every kind that requires them."""
    sheet = Place(Sheet, None, {})
    for key in {key for keys in KEYS_OF_SHEETS.values() for key in keys}:
        said = facts_of(sheet, key).default
        kinds = {kind for kind, keys in KEYS_OF_SHEETS.items() if key in keys}
        named = set(re.findall(r'"([\w-]+)"', said)) | ({*BOOMS} if "booms" in said else set())
        annulus = {"plate"} if key in ("inner_radius", "outer_radius") else set()
        assert said.startswith("needed by"), key
        assert named == kinds | annulus, key


def test_laws_are_described() -> None:
    """Every law of contact and friction has its row, with its needed and optional keys."""
    tables = list(rows("| law | needs | may have | force of a face |"))
    tables += list(rows("| law | needs | may have | friction over normal force |"))
    for table, (laws, left_out) in zip(tables, LAWS.values(), strict=True):
        assert [row[0].strip('"') for row in table] == list(laws)
        for row, keys in zip(table, laws.values(), strict=True):
            assert set(re.findall(r"`(\w+)`", row[1])) == set(keys.needed), row
            assert set(re.findall(r"`(\w+)`", row[2])) == set(keys.optional) - left_out, row


def examples(page: Path) -> list[str]:
    return re.findall(r"```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("page", [README, PAGE], ids=lambda page: page.name)
def test_examples_are_valid(page: Path, tmp_path: Path) -> None:
    shutil.copy(CREASE, tmp_path / "crease.csv")
    found = examples(page)
    assert found
    for text in found:
        (tmp_path / "case.toml").write_text(text, encoding="utf-8")
        load_case(tmp_path / "case.toml")


@pytest.mark.parametrize(("method", "bound"), [("auto", 1e-4), ("Radau", 1e-5)])
def test_the_pendulum_swings(method: str, bound: float, tmp_path: Path) -> None:
    """The example of a scene runs with the results that the page gives."""
    from fsm.results.store import read_solution

    (tmp_path / "case.toml").write_text(examples(PAGE)[1], encoding="utf-8")
    loaded = load_case(tmp_path / "case.toml", [f"solve.method={method}"])
    summary = run_case(loaded, tmp_path / "out", progress=False)
    assert summary["method"] == ("generalized-alpha" if method == "auto" else method)
    solution = read_solution(tmp_path / "out" / "result.h5")
    turned = solution.q[:, 2]
    assert round(180 / 3.141592653589793 * turned.max()) == 167
    assert solution.time[(turned > 1.5707963).argmax()] == pytest.approx(0.215, abs=0.006)
    assert summary["energy_error"] < bound


def test_summary_is_described(tmp_path: Path) -> None:
    """The table has exactly the names of a summary."""
    shutil.copy(CREASE, tmp_path / "crease.csv")
    (tmp_path / "case.toml").write_text(examples(README)[0], encoding="utf-8")
    small = ["strip.segments_per_panel=2", "drive.0.travel=6 mm", "solve.rtol=1e-3", "strip.fold_angle=83 deg"]
    summary = run_case(load_case(tmp_path / "case.toml", small), tmp_path / "out", progress=False)
    (table,) = rows("| name | |")
    said = {name for row in table for name in re.findall(r"`(\w+)`", row[0])}
    others = {"motion_error", "joint_opening", "probe_displacement", "folded"}  # of impacts, of sheets
    others |= {"drives", "start_up_force", "start_up_travel"}  # of several drives, of dynamic runs
    others |= {"report", "reactions", "margins", "smallest_margin", "joint_events"}  # of mechanisms
    assert said - others == set(summary)


def test_summary_of_a_film_is_described(tmp_path: Path) -> None:
    """Further entries of a film's summary are in a separate table."""
    film = ["membrane.mesh=[7, 7]", "vibration.modes=6", "vibration.duration=0.2 s"]
    loaded = load_case(ROOT / "folding_cases" / "membrane_impact" / "case.toml", film)
    summary = run_case(loaded, tmp_path / "out", progress=False)
    (common,) = rows("| name | |")
    (own,) = rows("| name, of a film | |")
    said = {name for row in own for name in re.findall(r"`(\w+)`", row[0])}
    assert said - {"deploy", "stages"} == set(summary) - {name for row in common for name in re.findall(r"`(\w+)`", row[0])}
    assert {"peak_force", "contact", "energy_error", "warnings", "method"} <= set(summary)


def test_events_are_described() -> None:
    """Every kind of event is described, and the row of `events` names all its entries."""
    (table,) = rows("| name | |")
    (meaning,) = [row[1] for row in table if row[0] == "`events`"]
    names = {field.name for field in fields(Event)}
    assert names <= set(re.findall(r"\w+", meaning))
    kinds = re.findall(r'"([\w ]+)"', str(Event.__doc__))
    assert len(kinds) == 7
    assert kinds == re.findall(r'"([\w ]+)"', meaning)


def test_methods_are_described() -> None:
    """The table has exactly one row for every method."""
    (table,) = rows("| method | for | limits |")
    known = get_args(Solve.model_fields["method"].annotation)
    assert [row[0].strip('`"') for row in table] == list(known)


def test_exit_codes_are_described() -> None:
    (table,) = rows("| code | meaning |")
    help_text = cli.get_help(cli.make_context("fsm", [], resilient_parsing=True))
    assert {row[0] for row in table} == set(re.findall(r"\b\d+(?= )", help_text.split("Exit codes:")[1]))


@pytest.mark.parametrize("page", [README, COMMANDS, PAGE], ids=lambda page: page.name)
def test_commands_exist(page: Path) -> None:
    """Every `fsm ...` of a page is a command, and its options are known."""
    assert isinstance(cli, Group)
    text = page.read_text(encoding="utf-8")
    lines = [line.strip() for line in text.splitlines() if line.startswith("    fsm ")]
    lines += list(re.findall(r"`(fsm [^`]*)`", text))
    assert lines
    for line in lines:
        _, name, *rest = line.split("#")[0].split()
        if name == "--help":
            continue
        assert name in cli.commands, line
        options = {option for parameter in cli.commands[name].params for option in parameter.opts}
        assert {word for word in rest if word.startswith("--")} <= options, line
    if page == COMMANDS:
        assert set(cli.commands) == {line.split()[1] for line in lines} - {"--help"}


def test_calibrations_are_described() -> None:
    """Every kind of case has its command and every option its line, and README links to the page."""
    page = CALIBRATION.read_text(encoding="utf-8")
    command = cli.commands["calibrate"]
    for kind in CALIBRATIONS:
        assert f"fsm calibrate {kind} " in page, kind
    options = [name for parameter in command.params for name in parameter.opts if name.startswith("--")]
    for option in options:
        assert option in page or option in ("--quiet", "--debug"), option
    assert "docs/calibration.md" in README.read_text(encoding="utf-8")


def test_the_measured_hinge_is_calibrated_as_it_ships(tmp_path: Path) -> None:
    """`crease.h5` beside the case agrees with its CSV file, and the case names it."""
    folder = ROOT / "folding_cases" / "strip_hinge"
    found = calibrate_crease(folder / "hinge.csv", Options())
    found.files[0][1](tmp_path / "crease.h5")
    ours, ships = (read_family(path / "crease.h5").curves[0] for path in (tmp_path, folder))
    assert ours.angle == pytest.approx(ships.angle)
    assert ours.loading == pytest.approx(ships.loading, abs=1e-9)
    crease = load_case(folder / "case.toml").case.crease
    free = next(quantity for quantity in found.quantities if quantity.name.endswith("zero moment at"))
    assert isinstance(crease, SplineCrease)
    assert crease.rest_angle == pytest.approx(math.radians(160.0) + free.value, abs=1e-3)
    assert crease.moment == pytest.approx(ships.loading)


def test_files_that_a_contributor_looks_for_exist() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = {re.sub(r"/\w*NAME\w*\.py", "", name) for name in re.findall(r"`(fsm/[^`]+)`", text)}
    assert len(named) > 20
    assert sorted(name for name in named if not (ROOT / name).exists()) == []
