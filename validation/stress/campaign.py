"""Campaign of numbered scenes: each is solved and judged, and a line is saved; saved scenes do not run again."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsm.results.solution import Solution
from fsm.run.workers import run_jobs
from validation.stress.attempt import Attempt, attempt
from validation.stress.feasible import better_asked, turned_right_over
from validation.stress.judge import free_of_ground, judge, momentum_error
from validation.stress.scenes import MIXED, Drawn, draw
from validation.stress.second import second_opinion

__all__ = ["CLASSES", "Job", "examine", "read_lines", "run_campaign"]

CLASSES = ("right", "warned", "refused", "asked", "singular", "failed", "cut off", "wrong")
"""Classes of results; README.md defines them."""

Line = dict[str, Any]
"""Saved data of a scene."""

_OWNED_UP = 0.3
"""Stated error of a run relative to the difference of a second solver above which a run is "warned" and not "wrong"."""
_WHOLE = 40
"""Distance of the numbers of scenes that run with curves and plots."""


@dataclass(frozen=True)
class Job:
    """Scene for a worker."""

    seed: int
    number: int
    kinds: tuple[str, ...]
    limit: float


def run_campaign(
    path: Path, seed: int, numbers: Sequence[int], limit: float, workers: int = 1, kinds: tuple[str, ...] = MIXED,
    told: Callable[[Line], None] = lambda line: None,
) -> list[Line]:  # fmt: skip
    """Run the scenes that are not in the file, and append a line for each; returns all lines."""
    done = read_lines(path)
    jobs = [Job(seed, number, kinds, limit) for number in numbers if number not in done]
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file, closing(run_jobs(work, jobs, workers)) as outcomes:
        for outcome in outcomes:
            job = jobs[outcome.job]
            line = outcome.value or _died(job, outcome.error or ("no word",))
            done[job.number] = line
            file.write(json.dumps(line) + "\n")
            file.flush()
            told(line)
        os.fsync(file.fileno())
    return [done[number] for number in numbers]


def read_lines(path: Path) -> dict[int, Line]:
    """Saved lines by number of the scene; an incomplete last line is omitted, so its scene runs again."""
    if not path.is_file():
        return {}
    text = path.read_text(encoding="utf-8")
    if text and not text.endswith("\n"):
        text = text[: text.rfind("\n") + 1]
        path.write_text(text, encoding="utf-8")
    lines = [json.loads(line) for line in text.splitlines()]
    return {line["scene"]: line for line in lines}


def work(job: Job) -> Line:
    """A scene in a worker."""
    return examine(draw(job.seed, job.number, job.kinds), job.limit)


def _died(job: Job, error: Sequence[str]) -> Line:
    kind = draw(job.seed, job.number, job.kinds).kind
    return {"scene": job.number, "kind": kind, "class": "wrong", "what": error[0], "cpu_s": 0.0}


def examine(drawn: Drawn, limit: float) -> Line:
    """Solve a scene, judge it, and check it by a second solver if it is in the sample."""
    first = attempt(drawn.tables, limit, whole=drawn.number % _WHOLE == 0)
    line: Line = {"scene": drawn.number, "kind": drawn.kind}
    line["class"], line["what"] = _classified(first)
    line |= {"method": first.method, "cpu_s": round(first.cpu, 3)}
    if line["class"] == "failed":
        turned = turned_right_over(drawn.tables, first, limit)
        line["class"] = "singular" if turned else better_asked(drawn.tables, first, limit) or "failed"
    if first.warned:
        line["warned"] = first.warned[0][:200]
    if first.solution is None or first.loaded is None:
        return line
    case, solution = first.loaded.case, first.solution
    against = judge(case, solution)
    line |= {"dof": solution.summary["dof"], "steps": solution.summary["steps"]}
    line |= {"energy_error": solution.summary["energy_drift"], "told": len(solution.summary["warnings"])}
    if free_of_ground(case):
        line["linear"], line["angular"] = momentum_error(case, solution)
    if drawn.second and not against:
        opinion = second_opinion(drawn.tables, first, limit)
        line["second"], line["difference"], line["by"] = opinion.says, opinion.difference, opinion.by
        if opinion.says == "differs":
            off = f"off by {opinion.difference:.2g} from {opinion.by}"
            if stated_error(solution) >= _OWNED_UP * opinion.difference:
                line["class"], line["what"] = "warned", off
            else:
                against.append(off)
    if against:
        line["class"], line["what"] = "wrong", "; ".join(against)
    return line


def stated_error(solution: Solution) -> float:
    """Largest error of a reduced model of a film that the warnings of a run state; 0 without such a warning.

    The error is infinite if the run states that it is not known.
    """
    summary = solution.summary
    if not any(line.startswith("reduced model: ") for line in summary["warnings"]):
        return 0.0
    names = ("reduced_error", "reduced_error_struck", "reduced_force_error")
    return max(math.inf if summary[name] is None else summary[name] for name in names)


def _classified(first: Attempt) -> tuple[str, str]:
    """Class and first line of the message."""
    said = first.what.splitlines()[0][:300] if first.what else ""
    if first.end == "refused" and not _clear(first.what):
        return "wrong", f"refused, but not clearly: {said}"
    if first.end in ("hang", "trace"):
        return "wrong", f"{first.end}: {said}"
    return {"finished": "right"}.get(first.end, first.end), said


def _clear(what: str) -> bool:
    """Whether every line of the message states the place of the fault."""
    return bool(what) and all(line.startswith(("scene: ", " ")) for line in what.splitlines())
