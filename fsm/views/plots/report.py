"""Figure of the results that a case asks for over time, and of the reactions of its joints."""

from __future__ import annotations

from pathlib import Path

from fsm.results.reported import ROUND_OFF, columns_of, reactions, shown_name
from fsm.results.solution import Solution
from fsm.views.plots.channels import QUANTITY, Diagrams, draw_diagrams


def plot_report(solution: Solution, path: str | Path) -> None:
    """Draw the diagrams of `report_diagrams` over time, with dotted lines where latches close and open."""
    marks: dict[str, list[float]] = {}
    for event in solution.summary.get("joint_events", ()):
        if event["what"].startswith("latch"):
            marks.setdefault(event["what"], []).append(event["time"])
    draw_diagrams(path, solution.time, "time (s)", report_diagrams(solution), marks)


def report_diagrams(solution: Solution) -> Diagrams:
    """Channels of `report`, one diagram for each unit; without `report` in the case, then the sizes of the reactions of all
    ideal joints.
    """
    labels = [str(row["name"]) for row in solution.summary.get("report", ())]
    diagrams: Diagrams = {}
    for label, (unit, values) in columns_of(solution.channels, labels).items():
        diagrams.setdefault((unit, QUANTITY.get(unit, "value")), {})[shown_name(label)] = values
    if not solution.layout.case.get("report"):
        for name, sizes in reactions(solution.channels).items():
            for kind, unit, values in zip(("force", "moment"), ("N", "N m"), sizes, strict=True):
                if values.max(initial=0.0) > ROUND_OFF:
                    diagrams.setdefault((unit, f"{kind} of joints"), {})[name] = values
    return diagrams
