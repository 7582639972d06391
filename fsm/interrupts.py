"""Ctrl-C pressed several times counts once: the first ends the command, which writes a checkpoint on its way out."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["counting_interrupts_once"]

TOGETHER = 3.0
"""Interrupts within so many seconds of one that was heeded are the same, s."""


@contextmanager
def counting_interrupts_once() -> Iterator[None]:
    """The life of a process; it ends deaf to interrupts. Nothing if interrupts are ignored or handled already."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    heeded = time.monotonic() - TOGETHER

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal heeded
        if time.monotonic() - heeded < TOGETHER:
            return
        heeded = time.monotonic()
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
