"""Factorisation and solution of stiffness matrices with a known pattern: the block LU of this program, and other libraries
with the same interface."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from fsm.errors import FsmError
from fsm.kernels.blocks import BlockMatrix, BlockPattern
from fsm.model.compile.compile import compile_scene
from fsm.solve.equations.linear import Backend, LinearSolver
from validation.benchmarks.precision import Row, say
from validation.benchmarks.scenes import cantilever
from validation.membrane.film import tensioned_film

__all__ = ["LINEAR", "LINEAR_COLUMNS", "linear_table", "measure_linear"]

LINEAR = "linear_algebra.csv"
LINEAR_COLUMNS = ("matrix", "rows", "backend", "time_s", "repeats", "message")
BACKENDS: tuple[Backend, ...] = ("block", "splu", "pardiso")
TOUCHING = 0.05
"""Contacts over segments in a chain that lies on itself."""
AT_LEAST, MOST = 0.2, 200
"""Solutions with a matrix are repeated up to this time (s) and up to this number of times."""


def chain(segments: int) -> BlockMatrix:
    """Tangent stiffness of a chain in the plane, with three rows for each segment."""
    system = compile_scene(cantilever(segments, ramp=10.0, damping=0.0), False)
    q, _ = system.initial()
    q = system.retract(q, 1e-4 * system.scales().increment * np.random.default_rng(0).standard_normal(system.nu))
    return system.linearise(1.0, q, None).stiffness


def touching_chain(segments: int) -> BlockMatrix:
    """The same chain with additional springs between random pairs of segments, like contacts; pairs and directions are
    random."""
    alone, rng = chain(segments), np.random.default_rng(1)
    order, size = alone.pattern.order, alone.pattern.size
    pairs = rng.choice(order, size=(round(TOUCHING * segments), 2), replace=False)
    held = list(zip(alone.pattern.rows.tolist(), alone.pattern.indices.tolist(), strict=True))
    places = sorted(set(held) | {(int(a), int(b)) for a, b in pairs} | {(int(b), int(a)) for a, b in pairs})
    row, column = np.array(places).T
    pattern = BlockPattern(np.searchsorted(row, np.arange(order + 1)).astype(np.int64), column.astype(np.int64), size)
    slot = {place: k for k, place in enumerate(places)}
    data = pattern.zeros()
    for block, place in zip(alone.data, held, strict=True):
        data[slot[place]] += block
    for a, b in pairs.tolist():
        gradient = rng.standard_normal((2, size))
        stiffness = float(np.abs(alone.data).max()) * np.einsum("ai,bj->aibj", gradient, gradient)
        for i, first in enumerate((a, b)):
            for j, second in enumerate((a, b)):
                data[slot[first, second]] += stiffness[i, :, j]
    return BlockMatrix(pattern, data)


def film(cells: int) -> BlockMatrix:
    """Tangent stiffness of the tensioned film, with nine rows for each node."""
    system, _ = tensioned_film(cells)
    return system.linearise(0.0, system.start, None).stiffness


MATRICES: dict[str, Callable[[], BlockMatrix]] = {
    "chain of 40 segments": lambda: chain(40),
    "chain of 200 segments": lambda: chain(200),
    "chain of 2000 segments": lambda: chain(2000),
    "chain of 2000 segments, 100 contacts": lambda: touching_chain(2000),
    "film of 12 x 12 cells": lambda: film(12),
    "film of 40 x 40 cells": lambda: film(40),
}


def measure_linear(names: Sequence[str] = tuple(MATRICES)) -> Iterator[Row]:
    """One row for each matrix and back end: median processor time of a factorisation and a solution with a known pattern."""
    for name in names:
        matrix = MATRICES[name]()
        right = np.random.default_rng(2).standard_normal(matrix.order)
        for backend in BACKENDS:
            row = dict.fromkeys(LINEAR_COLUMNS, "") | {"matrix": name, "rows": str(matrix.order), "backend": backend}
            try:
                times = _times(matrix, right, backend)
            except FsmError as error:
                row["message"] = str(error)
            else:
                row |= {"time_s": f"{statistics.median(times):.4g}", "repeats": str(len(times))}
            say(f"{name}, {backend}: {row['time_s'] or row['message']}")
            yield row


def _times(matrix: BlockMatrix, right: np.ndarray, backend: Backend) -> list[float]:
    solver, times = LinearSolver(backend), []
    while len(times) < 4 or (sum(times[1:]) < AT_LEAST and len(times) <= MOST):  # the first run is a warm-up run
        begun = time.process_time()
        solver.factorise(matrix)
        solver.solve(right)
        times.append(time.process_time() - begun)
    return times[1:]


def linear_table(rows: Sequence[Row]) -> str:
    """Times in ms, with one line for each matrix, in Markdown; back ends that are not installed are omitted."""
    backends = list(dict.fromkeys(row["backend"] for row in rows if row["time_s"]))
    lines = ["| matrix | rows | " + " | ".join(backends) + " |", "|---" * (len(backends) + 2) + "|"]
    for name, order in dict.fromkeys((row["matrix"], row["rows"]) for row in rows):
        own = {row["backend"]: row["time_s"] for row in rows if row["matrix"] == name}
        cells = [f"{1e3 * float(own[backend]):.3g}" if own.get(backend) else "-" for backend in backends]
        lines.append(f"| {name} | {order} | {' | '.join(cells)} |")
    return "\n".join(lines)
