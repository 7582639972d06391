"""Readers of files from users, each with the valid files whose damaged copies it reads."""

from __future__ import annotations

import random
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsm.calibrate.bending import calibrate_bending
from fsm.calibrate.crease import calibrate_crease
from fsm.calibrate.relaxation import calibrate_relaxation
from fsm.calibrate.report import Options
from fsm.calibrate.study import read_study
from fsm.case.loading.load_case import load_case
from fsm.case.loading.table import load_table
from fsm.check.report import describe
from fsm.results.checkpoint_file import read_checkpoint
from fsm.results.store import read_solution
from fsm.views.plots.figures import draw
from validation.fuzz.damage import damaged_bytes, damaged_cells, damaged_datasets, damaged_tree, toml_text
from validation.fuzz.seeds import Seeds

__all__ = ["TARGETS", "Target"]


@dataclass(frozen=True)
class Target:
    """A reader.

    Attributes
    ----------
    write : function (seeds, folder, chance) -> file
        It writes a damaged file, and the other files that are needed, into the folder.
    read : file -> anything
        Function of the program that reads such a file.
    """

    write: Callable[[Seeds, Path, random.Random], Path]
    read: Callable[[Path], Any]


def _case(seeds: Seeds, folder: Path, chance: random.Random) -> Path:
    one, other = chance.choice(seeds.cases), chance.choice(seeds.cases)
    for name, data in seeds.beside.items():
        (folder / name).write_bytes(data)
    file = folder / "case.toml"
    if chance.random() < 0.3:
        file.write_bytes(damaged_bytes(one.encode(), chance))
    else:
        tree = damaged_tree(tomllib.loads(one), tomllib.loads(other), chance)
        file.write_text(toml_text(tree), encoding="utf-8", errors="replace")
    return file


def _check(file: Path) -> None:
    describe(load_case(file).case)


def _table(seeds: Seeds, folder: Path, chance: random.Random) -> Path:
    case, tables = chance.choice(seeds.tables)
    (folder / "case.toml").write_text(case, encoding="utf-8")
    for name, data in seeds.beside.items():
        (folder / name).write_bytes(data)
    return _broken_csv(chance.choice(tables), folder, chance, "table.csv")


def _broken_csv(text: str, folder: Path, chance: random.Random, name: str) -> Path:
    file = folder / name
    if chance.random() < 0.3:
        file.write_bytes(damaged_bytes(text.encode(), chance))
    else:
        file.write_bytes(damaged_cells(text, chance).encode("utf-8", errors="replace"))
    return file


def _csv(kind: str) -> Callable[[Seeds, Path, random.Random], Path]:
    return lambda seeds, folder, chance: _broken_csv(chance.choice(seeds.csv[kind]), folder, chance, f"{kind}.csv")


def _calibration(function: Callable[[Path, Options], Any]) -> Callable[[Path], Any]:
    return lambda file: function(file, Options(progress=False))


def _study(seeds: Seeds, folder: Path, chance: random.Random) -> Path:
    file = folder / "study.toml"
    tree = damaged_tree(tomllib.loads(seeds.study), tomllib.loads(seeds.study), chance)
    file.write_text(toml_text(tree), encoding="utf-8", errors="replace")
    return file


def _hdf5(name: str) -> Callable[[Seeds, Path, random.Random], Path]:
    def write(seeds: Seeds, folder: Path, chance: random.Random) -> Path:
        data = chance.choice(seeds.hdf5[name])
        file = folder / f"{name}.h5"
        file.write_bytes(damaged_bytes(data, chance) if chance.random() < 0.5 else damaged_datasets(data, chance))
        return file

    return write


def _plot(file: Path) -> None:
    solution = read_solution(file)
    draw(solution, file.parent / "plots")


def _family(seeds: Seeds, folder: Path, chance: random.Random) -> Path:
    file = _hdf5("crease")(seeds, folder, chance)
    case = folder / "case.toml"
    case.write_text(seeds.with_family, encoding="utf-8")
    assert file.name == "crease.h5"
    return case


TARGETS: dict[str, Target] = {
    "case": Target(_case, _check),
    "table": Target(_table, load_table),
    "crease": Target(_csv("crease"), _calibration(calibrate_crease)),
    "relaxation": Target(_csv("relaxation"), _calibration(calibrate_relaxation)),
    "bending": Target(_csv("bending"), _calibration(calibrate_bending)),
    "study": Target(_study, read_study),
    "family": Target(_family, _check),
    "result": Target(_hdf5("result"), _plot),
    "checkpoint": Target(_hdf5("checkpoint"), read_checkpoint),
}
