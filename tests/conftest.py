"""Settings of all tests."""

from __future__ import annotations

import signal

from hypothesis import settings

# a shell that starts tests in the background ignores interrupts, and so would all processes that the tests interrupt
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("fsm", deadline=None)  # the first call may compile kernels, and processors differ in speed
settings.load_profile("fsm")
