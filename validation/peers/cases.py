"""All problems by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from validation.peers.absolute import cantilever, film_modes, film_vibration, flexible_pendulum
from validation.peers.mechanisms import bouncing_stack, bricard, four_bars, heavy_top, pendulum, wing
from validation.peers.strips import pressed_strip, strip
from validation.peers.sweep import PeerCase

__all__ = ["ALL", "PRESSED", "STRIPS"]

STRIPS = [(segments, spatial) for segments in (4, 10, 20) for spatial in (False, True)]
PRESSED = (10, 20)

ALL: dict[str, Callable[[], PeerCase]] = {
    **{f"strip_{n}_{'space' if spatial else 'plane'}": partial(strip, n, spatial) for n, spatial in STRIPS},
    **{f"strip_{n}_contact": partial(pressed_strip, n) for n in PRESSED},
    "flexible_pendulum": flexible_pendulum, "heavy_top": heavy_top, "A01": pendulum, "A02": four_bars, "A04": bricard,
    "wing": wing,
    "bouncing_stack": bouncing_stack, "cantilever": cantilever, "film_modes": film_modes, "film_vibration": film_vibration,
}  # fmt: skip
"""By name, in the order of the table."""
