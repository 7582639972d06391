"""Report of a campaign: a table of kinds, a CSV file of rows, and every failure with its command."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

from validation.strangers.campaign import Line
from validation.strangers.cases import KINDS
from validation.strangers.verdict import CAUSES

__all__ = ["report", "write_csv"]

COLUMNS = (
    "kind", "index", "cause", "code", "wall_s", "cpu_s", "method", "dof", "steps", "energy_error", "events", "peak_force",
    "frequency_hz", "states", "intersecting", "touches", "second", "by", "of", "off", "allowed", "said", "warnings",
)  # fmt: skip


def report(lines: Sequence[Line], seed: int) -> str:
    """The table of kinds, the disagreements with the second solver, and all failures."""
    text = ["| kind | cases | solved | % | failed by cause | checked | wrong | time, median (s) | worst |", "|" + "---|" * 9]
    for kind in [*KINDS, "all"]:
        own = [line for line in lines if kind in ("all", line["kind"])]
        if own:
            text.append(_row(kind, own))
    sources = Counter(line["source"] for line in lines).most_common()
    listed = ", ".join(f"{count} cases by {name}" for name, count in sources)
    text += ["", f"Sources (their digest stands in the provenance of a result): {listed}."]
    text += ["", *_checks(lines), *_intersections(lines), "", *_failures(lines, seed)]
    return "\n".join(text)


def _row(kind: str, own: Sequence[Line]) -> str:
    causes = Counter(line["cause"] for line in own)
    failed = ", ".join(f"{causes[cause]} {cause}" for cause in CAUSES if causes[cause]) or "-"
    checked = [line for line in own if line.get("second") in ("agrees", "differs", "sensitive")]
    wrong = sum(line["second"] == "differs" for line in checked)
    times = [line["cpu_s"] for line in own]
    solved = causes["solved"]
    cells = [
        kind,
        len(own),
        solved,
        f"{100.0 * solved / len(own):.1f}",
        failed,
        len(checked),
        wrong,
        f"{median(times):.1f}",
        f"{max(times):.0f}",
    ]
    return "| " + " | ".join(map(str, cells)) + " |"


def _checks(lines: Sequence[Line]) -> Iterator[str]:
    """Counts of the second solver, and its disagreements."""
    says = Counter(line["second"] for line in lines if line.get("second", "none") != "none")
    yield "Second solver: " + (", ".join(f"{count} {what}" for what, count in says.most_common()) or "none asked") + "."
    for line in lines:
        if line.get("second") in ("differs", "sensitive"):
            off = f"{line['of']} off by {100 * line['off']:.2g} % (allowed {100 * line['allowed']:.2g} %)"
            yield f"* {line['second']}: {line['kind']}:{line['index']}, {off} from {line['by']}"
        elif line.get("second") == "failed":
            yield f"* no opinion: {line['kind']}:{line['index']}, {line['by']}"


def _intersections(lines: Sequence[Line]) -> Iterator[str]:
    """Counts of the test for intersections, and the cases with intersections."""
    tested = [line for line in lines if "states" in line]
    if tested:
        states, touching = (sum(line[name] for line in tested) for name in ("states", "touches"))
        yield f"Test for intersections: {states} saved states of {len(tested)} cases; facets touch in {touching} of them."
    for line in tested:
        if line["intersecting"]:
            yield f"* {line['kind']}:{line['index']}: {line['intersecting']} of {line['states']} states have intersections"


def _failures(lines: Sequence[Line], seed: int) -> Iterator[str]:
    """Every failure: the command that runs it again, its message, and its outcome."""
    yield f"Failures; each again with `python -m validation.strangers --seed {seed} --only KIND:INDEX`:"
    yield ""
    for line in lines:
        if line["code"] != 0:
            ended = f"{line['cause']} (exit code {line['code']}, {line['cpu_s']:.0f} s)"
            yield f"* {line['kind']}:{line['index']}, {ended}: {line['said']}"


def write_csv(path: Path, lines: Sequence[Line]) -> None:
    """A row a case."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for line in lines:
            values = line | {"warnings": "; ".join(line.get("warnings", ()))}
            writer.writerow([_cell(values.get(name)) for name in COLUMNS])


def _cell(value: object) -> object:
    return f"{value:.6g}" if isinstance(value, float) else ("" if value is None else value)
