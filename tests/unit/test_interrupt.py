"""Ctrl-C is known for what it is, however deep within compiled kernels it came."""

from __future__ import annotations

import signal
import sys
import time

import numpy as np
import pytest

from fsm.errors import is_interrupt
from fsm.kernels.jit import kernel

DUE = 1e-3
"""Seconds until the signal."""


@kernel
def _turned(row: np.ndarray, other: np.ndarray, shift: float) -> tuple[float, np.ndarray, tuple[np.ndarray, float]]:
    return 2.0 * row[0] + shift, row, (other, shift)


def _wrapped(error: BaseException, times: int) -> BaseException:
    for _ in range(times):
        outer = SystemError("returned a result with an exception set")
        outer.__cause__ = error
        error = outer
    return error


@pytest.mark.parametrize("times", [0, 1, 2, 3])
def test_wrapped(times: int) -> None:
    assert is_interrupt(_wrapped(KeyboardInterrupt(), times))
    assert not is_interrupt(_wrapped(MemoryError(), times))


def test_other_errors() -> None:
    assert not is_interrupt(SystemError("a fault of the interpreter"))
    asked = ValueError()
    asked.__cause__ = KeyboardInterrupt()
    assert not is_interrupt(asked)


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_between_calls_of_kernels() -> None:
    """Whatever Python makes of a signal at whatever moment of two hundred loops of calls."""
    row, other = np.ones(3), np.ones(2)
    _turned(row, other, 1.0)
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    found: list[BaseException] = []
    try:
        for round_ in range(200):
            end = time.perf_counter() + 60.0
            try:
                signal.setitimer(signal.ITIMER_REAL, DUE * (1.0 + round_ / 200.0))
                while time.perf_counter() < end:
                    _turned(row, other, 1.0)
            except (KeyboardInterrupt, SystemError) as error:
                found.append(error)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert len(found) == 200
    assert [error for error in found if not is_interrupt(error)] == []
