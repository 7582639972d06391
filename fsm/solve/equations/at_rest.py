"""Penalties of locked directions in equilibria and in motions."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fsm.solve.interface.system import System


@contextmanager
def at_rest(system: System, still: bool = True) -> Iterator[None]:
    """Use the penalties of equilibria, or with `still` false those of motions, for a while."""
    before = system.hold_still(still)
    try:
        yield
    finally:
        system.hold_still(before)
