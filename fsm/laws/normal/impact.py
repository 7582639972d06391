"""The ADAMS function IMPACT: the law of `fsm.laws.normal.hertz` with damping and ramp that must be given.

    N = w max(0, K d^e + STEP(d, 0, 0, ramp, C) d')

It has no restitution parameter: what is delivered depends on mass and speed (docs/theory.md).
"""

from __future__ import annotations

from fsm.laws.normal.hertz import HERTZ

__all__ = ["IMPACT"]

IMPACT = HERTZ
