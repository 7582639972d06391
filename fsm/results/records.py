"""Records of a run in memory, of which a result consists."""

from __future__ import annotations

import threading
from types import TracebackType
from typing import Any, Self

import numpy as np

from fsm.errors import FsmError, NotConverged
from fsm.io.hdf5_checked import is_finite
from fsm.results.film import Floats, ProbeSamples
from fsm.results.solution import MAY_BE_INFINITE, Layout, Record, Solution, stack
from fsm.results.store import VARIABLES


class Records:
    """Records and samples of a run; a context manager. `fsm.results.writer.ResultWriter` also writes them to a file.

    Parameters
    ----------
    layout : Layout
    """

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._new: list[dict[str, Any]] = []
        self._rows: list[dict[str, Any]] = []
        self._samples: list[tuple[float, Floats]] = []
        self._sample_rows: list[ProbeSamples] = []
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except FsmError:
            if error is None:
                raise

    @property
    def n_records(self) -> int:
        """Number of records so far, including those of a resumed run."""
        return sum(len(rows["time"]) for rows in (*self._rows, *self._new))

    def append(self, record: Record) -> None:
        """Add one record, which the caller must not change after this."""
        self.extend(stack([record], self.layout))

    def extend(self, rows: dict[str, Any]) -> None:
        """Add the rows of several records (`fsm.results.solution.stack`), which the caller must not change after this."""
        self._new.append(rows)

    def sample(self, at: float, displacement: Floats) -> None:
        """Add one sample of the probes, (n_probes, 3), m; it is written with the records."""
        with self._lock:
            self._samples.append((at, displacement))

    def solution(self) -> Solution:
        """Result with all records and samples so far.

        Raises
        ------
        ValueError
            There is no record.
        NotConverged
            A record contains a number that is not finite.
        """
        with self._lock:
            self._stack()
            if not self._rows:
                raise ValueError("a result needs at least one record")
            self._rows = [_joined_rows(self._rows)]
            found = Solution.from_rows(self._rows[0], self.layout)
            if self._sample_rows:
                found.samples = _joined(self._sample_rows)
        for name in ("time", *(name for name in VARIABLES if name not in MAY_BE_INFINITE)):
            if not is_finite(self._rows[0][name]):
                raise NotConverged(f"a record contains values of {name} that are not finite; reduce solve.max_step")
        return found

    def flush(self) -> None:
        """Write all records to disk now, if there is a file."""

    def close(self) -> None:
        """End the writing; the records stay."""

    def finish(self, solution: Solution) -> None:
        """Write the complete result, if there is a file.

        Parameters
        ----------
        solution : Solution
            All records with statistics, summary and data that exist only at the end.
        """

    def _stack(self) -> None:
        """Turn the records and samples since the last call into arrays."""
        if self._new:
            self._rows.append(_joined_rows(self._new))
            self._new = []
        if self._samples:
            times, moved = zip(*self._samples, strict=True)
            self._sample_rows.append(ProbeSamples(np.array(times), np.array(moved)))
            self._samples = []


def _joined_rows(parts: list[dict[str, Any]]) -> dict[str, Any]:
    return parts[0] if len(parts) == 1 else {name: np.concatenate([rows[name] for rows in parts]) for name in parts[0]}


def _joined(parts: list[ProbeSamples]) -> ProbeSamples:
    return ProbeSamples(np.concatenate([one.time for one in parts]), np.concatenate([one.displacement for one in parts]))
