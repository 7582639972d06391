"""Summary of a campaign as text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from validation.stress.campaign import CLASSES
from validation.stress.judge import TOLD
from validation.stress.scenes import KINDS

__all__ = ["failed_of_feasible", "summarised"]


def summarised(lines: Sequence[Mapping[str, Any]]) -> str:
    """Scenes by kind and class, errors of energy and momentum, second solvers, frequent messages, wrong results."""
    text = ["| kind | scenes | " + " | ".join(CLASSES) + " | time (s) |", "|" + "---|" * (len(CLASSES) + 3)]
    for kind in [*KINDS, "all"]:
        own = [line for line in lines if kind in ("all", line["kind"])]
        counts = Counter(line["class"] for line in own)
        cells = [kind, len(own), *(counts[name] for name in CLASSES), f"{sum(line['cpu_s'] for line in own):.0f}"]
        text.append("| " + " | ".join(map(str, cells)) + " |")
    part, feasible = failed_of_feasible(lines)
    text += ["", f"failed: {100.0 * part:.1f} % of {feasible} feasible scenes that were not cut off"]
    right = [line for line in lines if line["class"] == "right"]
    text += ["", *_errors(right), "", *_opinions(lines), "", *_said(lines), "", "Wrong:"]
    text += [f"  {line['scene']} {line['kind']}: {line['what']}" for line in lines if line["class"] == "wrong"] or ["  none"]
    return "\n".join(text)


def failed_of_feasible(lines: Sequence[Mapping[str, Any]]) -> tuple[float, int]:
    """Failed fraction of the feasible scenes, and their number; scenes that were cut off do not count."""
    counts = Counter(line["class"] for line in lines)
    feasible = sum(counts[name] for name in ("right", "warned", "failed", "wrong"))
    return counts["failed"] / max(1, feasible), feasible


def _errors(right: Sequence[Mapping[str, Any]]) -> list[str]:
    energy = [line["energy_error"] for line in right if "energy_error" in line]
    if not energy:
        return ["nothing came out right"]
    untold = [error for error in energy if error <= TOLD]
    found = [
        f"energy error: median {np.median(energy):.1e}, worst {max(energy):.1e}; "
        f"{len(energy) - len(untold)} above {TOLD:g}, all with a warning of the run"
    ]
    for name in ("linear", "angular"):
        values = [line[name] for line in right if name in line]
        if values:
            of = f"{name} momentum of {len(values)} free scenes"
            found.append(f"{of}: median {np.median(values):.1e}, worst {max(values):.1e}")
    warned = Counter(line["warned"] for line in right if "warned" in line)
    return found + [f"warned of by Python, {count} times: {what}" for what, count in warned.most_common(5)]


def _opinions(lines: Sequence[Mapping[str, Any]]) -> list[str]:
    says = Counter(line["second"] for line in lines if "second" in line)
    return ["second solver: " + (", ".join(f"{count} {what}" for what, count in says.most_common()) or "none asked")]


def _said(lines: Sequence[Mapping[str, Any]]) -> list[str]:
    found = []
    for name in ("refused", "failed"):
        said = Counter((line["kind"], _stripped(line["what"])) for line in lines if line["class"] == name)
        found += [f"{name}, most often:", *(f"  {count} {kind}: {what}" for (kind, what), count in said.most_common(12))]
    return found


def _stripped(what: str) -> str:
    """Text without its numbers, so that equal messages are counted together."""
    words = what.split("Fastest changing body")[0]
    return "".join("#" if c.isdigit() else c for c in words).replace("##", "#").replace("##", "#")[:150]
