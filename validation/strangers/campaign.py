"""Campaign: rows by kind and number, each run as a user would run it, judged and stored as a line of a file; it can be
resumed."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from fsm.io.provenance import made_by
from validation.strangers.cases import Row, draw
from validation.strangers.drawn import Drawn
from validation.strangers.family import crease_family
from validation.strangers.joint_equations import by_equations
from validation.strangers.launch import Command, Course, side_by_side
from validation.strangers.second import compared, otherwise, worst
from validation.strangers.sheets import FAMILY_FILE
from validation.strangers.verdict import cause_of, first_words, intersections_of, numbers_of

__all__ = ["LIMIT", "Line", "course_of", "fsm_command", "nudge_of", "read_lines", "row_key", "run_campaign"]

Line = dict[str, Any]
"""Saved data of a row."""

LIMIT = 120.0
"""Processor time of a case, s."""
_SECOND = 5.0
"""Times that for the second solver."""
_NUDGE = 1e-6
"""Part by which a case is changed to see whether it is one in which differences grow without bound."""


def run_campaign(
    path: Path, rows: Sequence[Row], seed: int, workers: int = 1, limit: float = LIMIT,
    told: Callable[[Line], None] = lambda line: None, earlier: bool = False,
) -> list[Line]:  # fmt: skip
    """Run the rows that the file lacks, append a line for each, and return the lines of all rows.

    A line counts for a row of the same case and sources; with `earlier`, a solved case counts whatever the sources.
    """
    keys = {row: row_key(draw(row.kind, row.index, seed)) for row in rows}
    done: dict[tuple[str, int, str], Line] = {}
    for line in read_lines(path):
        if line["source"] == made_by()["source"] or (earlier and _stands(line)):
            done[(line["kind"], line["index"], line["key"])] = line
    wanted = {row: (row.kind, row.index, key) for row, key in keys.items()}
    missing = [row for row in rows if wanted[row] not in done or (row.checked and "second" not in done[wanted[row]])]
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.parent / f"{path.stem}_running"
    courses = (course_of(row, seed, scratch / f"{row.kind}_{row.index}", limit, path.parent) for row in missing)
    with path.open("a", encoding="utf-8") as file:
        for line in side_by_side(courses, workers, fsm_command):
            done[(line["kind"], line["index"], line["key"])] = line
            file.write(json.dumps(line) + "\n")
            file.flush()
            told(line)
        os.fsync(file.fileno())
    shutil.rmtree(scratch, ignore_errors=True)
    return [done[wanted[row]] for row in rows]


def _stands(line: Line) -> bool:
    """Whether a line of other sources is valid: the case was solved, and the second solver found no error."""
    return line["code"] == 0 and line.get("second", "agrees") in ("agrees", "sensitive")


def read_lines(path: Path) -> list[Line]:
    """Saved lines; an incomplete last line is omitted, so its row runs again."""
    if not path.is_file():
        return []
    text = path.read_text(encoding="utf-8")
    if text and not text.endswith("\n"):
        text = text[: text.rfind("\n") + 1]
        path.write_text(text, encoding="utf-8")
    return [json.loads(line) for line in text.splitlines()]


def row_key(drawn: Drawn) -> str:
    """Digest of the generated case."""
    content = json.dumps([drawn.text, drawn.files], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()[:16]


def fsm_command(command: Command) -> int:
    """Command line of fsm, in this process."""
    from fsm.cli.command_line import cli

    try:
        cli.main(list(command.arguments), prog_name="fsm")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


def course_of(row: Row, seed: int, folder: Path, limit: float, shared: Path, keep: bool = False) -> Course:
    """Write the case as a user would, run it, and check it by a second solver if the row is in the sample."""
    drawn = draw(row.kind, row.index, seed)
    case = _written(drawn, folder, shared)
    first = yield Command(("run", str(case), "--out", str(folder / "out")), folder / "said.txt", limit)
    line: Line = {"kind": row.kind, "index": row.index, "key": row_key(drawn), "source": made_by()["source"]}
    line |= {"cause": cause_of(first), "code": first.code}
    line |= {"said": "" if first.code == 0 else first_words(first, f"{folder}/"), "wall_s": round(first.wall, 2)}
    line |= {"cpu_s": round(first.cpu, 2)} | numbers_of(folder / "out")
    if row.kind == "packed" and "contact" in drawn.tables and first.code == 0:
        line |= intersections_of(folder / "out")
    if row.checked:
        line |= (yield from _checked(row, drawn, line, case, folder, limit)) if first.code == 0 else {"second": "none"}
    if not keep:
        shutil.rmtree(folder, ignore_errors=True)
    return line


def _checked(row: Row, drawn: Drawn, line: Line, case: Path, folder: Path, limit: float) -> Course:
    """Verdict of the second solver: "agrees", "differs", "sensitive" (a slightly changed case differs as much) or
    "failed"."""
    if row.kind == "mechanisms":
        return by_equations(drawn.tables, folder / "out")
    other = otherwise(row.kind, drawn.tables, line["method"])
    run = ("run", str(case), "--quiet", "--out")
    settings = [word for text in other.settings for word in ("--set", text)]
    ended = yield Command((*run, str(folder / "second"), *settings), folder / "said_second.txt", _SECOND * limit)
    if ended.code != 0:
        return {"second": "failed", "by": f"{other.by}: {first_words(ended, f'{folder}/')}"}
    rtol = float(drawn.tables.get("solve", {}).get("rtol", 1e-6))
    found = compared(row.kind, folder / "out", folder / "second", rtol)
    if not found:
        return {"second": "failed", "by": f"{other.by}: nothing to compare"}
    name, off, allowed = worst(found)
    verdict: Line = {
        "second": "agrees" if off <= allowed else "differs",
        "by": other.by,
        "of": name,
        "off": off,
        "allowed": allowed,
    }
    nudge = nudge_of(drawn)
    if off <= allowed or not nudge:
        return verdict
    ended = yield Command((*run, str(folder / "nudged"), *settings, *nudge), folder / "said_nudged.txt", _SECOND * limit)
    if ended.code == 0:
        moved = {item[0]: item[1] for item in compared(row.kind, folder / "second", folder / "nudged", rtol)}
        verdict["nudged"] = moved.get(name, 0.0)
        if verdict["nudged"] > 0.2 * off:
            verdict["second"] = "sensitive"
    return verdict


def nudge_of(drawn: Drawn) -> list[str]:
    """Setting that changes a case by a millionth."""
    tables = drawn.tables
    places: list[tuple[str, object]] = [
        (f"{section}.{key}", tables.get(section, {}).get(key))
        for section, key in (("strip", "length"), ("scissor", "bar_length"), ("material", "young"), ("lattice", "axial"))
    ]
    places += [(f"scene.bodies.{i}.mass", body["mass"]) for i, body in enumerate(tables.get("scene", {}).get("bodies", ()))]
    for path, value in places:
        if value is not None:
            number, _, unit = str(value).partition(" ")
            return ["--set", f"{path}={float(number) * (1.0 + _NUDGE):.12g} {unit}".rstrip()]
    return []


def _written(drawn: Drawn, folder: Path, shared: Path) -> Path:
    """The case file and all files that belong to it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    case = folder / "case.toml"
    case.write_text(drawn.text, encoding="utf-8")
    for name, text in drawn.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    if drawn.tables.get("crease", {}).get("file") == FAMILY_FILE:
        shutil.copy(crease_family(shared / "family"), folder / FAMILY_FILE)
    return case
