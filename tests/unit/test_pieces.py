"""Programs of loads and drives as polynomial pieces, compared with the programs themselves."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.kernels.pieces import program_at
from fsm.scene.time_program import Constant, Cycle, Ramp, Table
from fsm.segments.drive import Parts, RunUp, Timed
from fsm.segments.pieces_of import of_function, of_program, pieces_of
from fsm.segments.time_function import breaks, curvature, factor, slope

ROWS = {"time": (0.1, 0.4, 0.5, 1.7), "value": (0.2, 1.0, -0.5, -0.5)}
FUNCTIONS = {
    "constant": Constant(),
    "smooth ramp": Ramp(kind="ramp", start=0.3, end=1.1),
    "linear ramp": Ramp(kind="ramp", start=0.3, end=1.1, shape="linear"),
    "unbounded ramp": Ramp(kind="ramp", start=0.3, end=1.1, shape="unbounded"),
    "cycles": Cycle(kind="cycle", period=0.4, start=0.2, cycles=2.3),
    "alternating cycles": Cycle(kind="cycle", period=0.4, start=0.2, cycles=2.3, form="alternating"),
    "cycles without end": Cycle(kind="cycle", period=0.4),
    "linear table": Table(kind="table", interpolation="linear", **ROWS),
    "smooth table": Table(kind="table", interpolation="smooth", **ROWS),
}
PROGRAMS = {
    "run-up": RunUp(0.02, 0.05, 0.01),
    "no run-up": RunUp(0.02, 0.05, 0.0),
    "function": Timed(FUNCTIONS["linear table"], 0.3),
    "one after the other": Parts((
        (0.25, 1.0, RunUp(0.02, 0.05, 0.01)),
        (1.0, -1.0, Timed(FUNCTIONS["cycles"], 0.3)),
        (2.0, 1.0, RunUp(0.02, 0.05, 0.01)),
    )),
}  # fmt: skip


def times(ends: tuple[float, ...]) -> list[float]:
    """Times between, at, right before and right after the breaks."""
    near = [np.nextafter(t, way) for t in ends for way in (-np.inf, np.inf)]
    return [*np.linspace(-0.5, 6.0, 137).tolist(), *ends, *near]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions(name: str) -> None:
    """Values and both derivatives agree, at breaks too."""
    function = FUNCTIONS[name]
    pieces = pieces_of([of_function(Constant()), of_function(function)])
    for t in times(breaks(function)):
        expected = factor(function, t), slope(function, t), curvature(function, t)
        assert program_at(pieces, 1, t) == pytest.approx(expected, rel=1e-9, abs=1e-9), t


@pytest.mark.parametrize("name", PROGRAMS)
def test_programs(name: str) -> None:
    """Values and both derivatives agree; at breaks only the value agrees, because their time has round-off in a program of
    parts."""
    program = PROGRAMS[name]
    found = of_program(program)
    assert found is not None
    pieces = pieces_of([found])
    exact = () if isinstance(program, Parts) else program.breaks()
    for t in (t for t in times(exact) if t >= 0.0):
        assert program_at(pieces, 0, t) == pytest.approx(program.at(t), rel=1e-9, abs=1e-9), t
    for t in program.breaks():
        assert program_at(pieces, 0, t)[0] == pytest.approx(program.at(t)[0], rel=1e-9, abs=1e-9)
