"""Settings of all tests."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("fsm", deadline=None)  # the first call may compile kernels, and processors differ in speed
settings.load_profile("fsm")
