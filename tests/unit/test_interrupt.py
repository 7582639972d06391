"""Ctrl-C is recognised, however deep within compiled kernels it arrives."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from fsm.errors import is_interrupt
from fsm.io.interrupts import ignore_repeated_interrupts
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
    """The exceptions that Python raises for a signal at any moment of two hundred loops of calls."""
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


IMPATIENT = """
import sys, time
from fsm.io.interrupts import ignore_repeated_interrupts
with ignore_repeated_interrupts():
    try:
        print("ready", flush=True)
        time.sleep(60)
    except KeyboardInterrupt:
        time.sleep(0.6)  # a checkpoint
        print("written", flush=True)
        sys.exit(130)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_several_interrupts_are_one() -> None:
    """The signals arrive within half a second, while a checkpoint is written and while the program ends."""
    process = subprocess.Popen([sys.executable, "-c", IMPATIENT], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    for _ in range(20):
        process.send_signal(signal.SIGINT)
        time.sleep(0.04)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (130, "written\n", "")


def test_interrupts_are_left_alone_where_somebody_handles_them() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with ignore_repeated_interrupts():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
