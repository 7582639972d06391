"""Static solve of a film against its number of unknowns: fill, operations and time by ordering and method, and the exponent.

    python -m validation.benchmarks.sheet_size [--cells 10 20 40 80 105] [--repeat 5]

METIS (pymetis) and PARDISO (pypardiso) are measured if they are installed; the program itself needs neither.
"""

from __future__ import annotations

import argparse
import math
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu

from fsm.kernels.block_lu import factorise, fill_in
from fsm.kernels.blocks import BlockMatrix, BlockPattern, Elimination
from fsm.kernels.fronts import factorise_fronts, solve_by_fronts
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import equilibrium
from fsm.solve.equations.supernodes import supernodes
from validation.membrane.film import pulled_film

__all__ = ["exponent", "main", "nested_dissection", "orders"]

SLOW = 20.0
"""Time of a factorisation (s) above which it is not repeated, and the method is not used for more unknowns."""


def nested_dissection(rows: int, columns: int) -> np.ndarray:
    """Order of the nodes of a grid: the halves of the longer side, and then the line between them (George, 1973)."""
    order: list[int] = []

    def divide(nodes: np.ndarray) -> None:
        if nodes.size <= 4:
            order.extend(nodes.ravel().tolist())
            return
        nodes = nodes.T if nodes.shape[0] < nodes.shape[1] else nodes
        middle = nodes.shape[0] // 2
        divide(nodes[:middle])
        divide(nodes[middle + 1 :])
        order.extend(nodes[middle].tolist())

    divide(np.arange(rows * columns).reshape(rows, columns))
    return np.array(order)


def metis(pattern: BlockPattern) -> np.ndarray | None:
    """Nested dissection of the graph by METIS; None without pymetis."""
    try:
        import pymetis
    except ImportError:
        return None
    neighbours = [row[row != i] for i, row in enumerate(np.split(pattern.indices, pattern.indptr[1:-1]))]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return np.array(pymetis.nested_dissection(neighbours)[0])


def orders(pattern: BlockPattern, cells: int) -> dict[str, np.ndarray]:
    """Orders of elimination by name."""
    solver = LinearSolver()
    found = {"minimum degree": solver.ready(pattern)[0].order, "nested dissection": nested_dissection(cells + 1, cells + 1)}
    by_metis = metis(pattern)
    return found if by_metis is None else found | {"METIS": by_metis}


def seconds(job: Callable[[], Any], repeat: int) -> float:
    """Shortest processor time of several runs after a warm-up run."""
    job()
    times = []
    while len(times) < repeat and sum(times) < SLOW:
        begun = time.process_time()
        job()
        times.append(time.process_time() - begun)
    return min(times)


def exponent(unknowns: Sequence[float], times: Sequence[float]) -> float:
    """Slope of log time against log unknowns, least squares."""
    return float(np.polyfit(np.log(unknowns), np.log(times), 1)[0])


def by_fronts(matrix: BlockMatrix, known: Elimination, repeat: int) -> tuple[float, float]:
    """Times of a factorisation and of a solution."""
    pattern, nodes = matrix.pattern, supernodes(matrix.pattern, known)
    factors, right = np.empty(nodes.factors[-1]), np.ones(matrix.order)
    taken = seconds(lambda: factorise_fronts(nodes, pattern.indptr, pattern.indices, matrix.data, factors), repeat)
    return taken, seconds(
        lambda: solve_by_fronts(nodes, factors, pattern.indptr, pattern.indices, matrix.data, right, 1e-10, True), repeat
    )


def libraries(matrix: BlockMatrix, repeat: int, left_out: set[str]) -> dict[str, float]:
    """Times of factorisations by SuperLU and PARDISO."""
    scalar, found = matrix.bsr().tocsc(), {}
    for spec, options in (("COLAMD", {}), ("MMD_AT_PLUS_A", {"SymmetricMode": True, "DiagPivotThresh": 0.0})):
        name = f"SuperLU, {spec}"
        if name not in left_out:
            found[name] = seconds(lambda: splu(scalar, permc_spec=spec, options=options), min(repeat, 2))  # noqa: B023
    try:
        from pypardiso import PyPardisoSolver
    except ImportError:
        return found
    solver, rows = PyPardisoSolver(), scalar.tocsr()
    solver.set_iparm(8, 0)
    solver._check_A(rows)
    solver.set_phase(11)
    solver._call_pardiso(rows, np.zeros((matrix.order, 1)))
    solver.set_phase(22)
    found["PARDISO, LU"] = seconds(lambda: solver._call_pardiso(rows, np.zeros((matrix.order, 1))), repeat)
    return found


def static_solve(cells: int, repeat: int) -> float:
    """Time of the equilibrium of the stretched film by Newton's method from rest, with all its parts."""
    system, _, _ = pulled_film(cells)
    return seconds(lambda: equilibrium(system, system.start, np.array([0.0, 1.0])), repeat if cells < 40 else 1)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table for each number of cells, and the exponents."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmarks.sheet_size", description=__doc__.split("\n")[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[10, 20, 40, 80, 105])
    parser.add_argument("--repeat", type=int, default=5)
    chosen = parser.parse_args(arguments)
    sizes: list[int] = []
    measured: dict[str, list[float]] = {}
    left_out: set[str] = set()

    def note(name: str, taken: float) -> None:
        measured.setdefault(name, []).append(taken)
        left_out.update({name} if taken > SLOW else ())
        print(f"{sizes[-1]:7d}  {name:48s} {1e3 * taken:10.2f} ms", flush=True)

    for cells in chosen.cells:
        system, _, _ = pulled_film(cells)
        matrix = system.linearise(0.0, system.start, None).stiffness
        pattern, size = matrix.pattern, matrix.pattern.size
        sizes.append(matrix.order)
        for name, order in orders(pattern, cells).items():
            known = Elimination(order, *fill_in(pattern.indptr, pattern.indices, order))
            blocks = int(np.sum(known.indptr[1:] - known.diagonal))
            fill = f"{blocks / pattern.order:.1f} blocks a row, {known.products * size**3:.3g} multiplications"
            print(f"{matrix.order:7d}  {name}: {fill}", flush=True)
            if name == "minimum degree":
                own = np.empty(known.factors(size))
                note("block by block", seconds(
                    lambda: factorise(matrix.data, known.place, known.indptr, known.indices, known.diagonal, True, own),  # noqa: B023
                    chosen.repeat,
                ))  # fmt: skip
            factor, solve = by_fronts(matrix, known, chosen.repeat)
            note(f"fronts, {name}", factor)
            note(f"solution by fronts, {name}", solve)
        for name, taken in libraries(matrix, chosen.repeat, left_out).items():
            note(name, taken)
        note("linearisation", seconds(lambda: system.linearise(0.0, system.start, None), chosen.repeat))  # noqa: B023
        note("static solve", static_solve(cells, chosen.repeat))
    for name, times in measured.items():
        if len(times) > 1 and math.isfinite(sum(times)):
            print(f"{name}: exponent {exponent(sizes[: len(times)], times):.2f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
