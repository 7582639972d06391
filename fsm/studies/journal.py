"""Journal of runs: one line of JSON for each finished run, so that a study or a search can be continued."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path

from fsm.errors import CannotWrite
from fsm.io.provenance import made_by
from fsm.studies.problem import Problem, Run

JOURNAL = "runs.jsonl"
"""Name of the journal in the folder of the results."""


class Journal:
    """Finished runs by the digest of the problem and the values; only this process writes.

    Parameters
    ----------
    folder : folder of the results
    problem : Problem
    text : complete case, or the text of the file of the function
    resume : whether to keep the runs of an earlier journal
    """

    def __init__(self, folder: Path, problem: Problem, text: str, resume: bool) -> None:
        self.path = folder / JOURNAL
        responses = [one.model_dump(mode="json") for one in problem.responses]
        start = json.dumps([text, problem.function, responses, made_by()["source"]], sort_keys=True)
        self._start = hashlib.sha256(start.encode())
        self._known: dict[str, Run] = dict(_read(self.path)) if resume else {}
        try:
            folder.mkdir(parents=True, exist_ok=True)
            _cut(self.path, keep=resume)
        except OSError as error:
            raise CannotWrite(f"{self.path}: {error.strerror}") from None

    def find(self, values: Mapping[str, float]) -> Run | None:
        """Finished run with these values; None if there is none."""
        return self._known.get(self._key(values))

    def add(self, values: Mapping[str, float], run: Run) -> None:
        """Append a finished run.

        Raises
        ------
        CannotWrite
            The disk is full; earlier runs are kept.
        """
        key = self._key(values)
        self._known[key] = run
        try:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"key": key, **asdict(run)}) + "\n")
        except OSError as error:
            raise CannotWrite(f"{self.path}: {error.strerror}; the runs before are kept, continue with --resume") from None

    def _key(self, values: Mapping[str, float]) -> str:
        digest = self._start.copy()
        digest.update(json.dumps(dict(values), sort_keys=True).encode())
        return digest.hexdigest()[:24]


def _read(path: Path) -> Iterator[tuple[str, Run]]:
    """Runs of a journal; a line that was cut off when a process was killed is left out."""
    if not path.is_file():
        return
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            data = json.loads(line)
            yield data.pop("key"), Run(**{**data, "curve": tuple(data["curve"])})
        except (ValueError, LookupError, TypeError):
            continue


def _cut(path: Path, keep: bool) -> None:
    """Begin a journal; a kept one ends with a whole line."""
    if not keep or not path.is_file():
        path.write_text("", encoding="utf-8")
        return
    data = path.read_bytes()
    if data and not data.endswith(b"\n"):
        path.write_bytes(data[: data.rfind(b"\n") + 1])
