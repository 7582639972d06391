"""ADAMS function IMPACT: the law of `fsm.laws.normal.hertz` with mandatory damping and ramp.

    N = w max(0, K d^e + STEP(d, 0, 0, ramp, C) d')

It has no coefficient of restitution; the restitution depends on mass and speed (docs/theory.md).
"""

from __future__ import annotations

from fsm.laws.normal.hertz import HERTZ

IMPACT = HERTZ
