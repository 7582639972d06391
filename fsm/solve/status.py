"""How a solve ended, with advice."""

from __future__ import annotations

from enum import Enum

__all__ = ["Outcome"]


class Outcome(Enum):
    """Outcome of a solve; the value is what to tell the user."""

    FINISHED = "finished"
    STEP_TOO_SMALL = (
        "the step size fell to nothing; try a larger [material] damping, a softer contact stiffness, a larger friction "
        "v_static, or method = \"Radau\""
    )
    TOO_MANY_STEPS = "more steps than [solve] max_steps; raise it, loosen rtol, or pull faster"
    NOT_FINITE = "the state is no longer finite; check masses and stiffnesses, or tighten rtol"
    ENERGY = "the energy balance is off by more than [solve] energy_abort; tighten rtol or set max_step"
