"""How a solve ended, with advice."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from fsm.errors import NotConverged

__all__ = ["TORN", "Event", "Outcome", "StepFailed"]

TORN = 0.1
"""Part of a segment's length that the ends of a joint may come apart, whatever the method."""


class Outcome(Enum):
    """Outcome of a solve; the value is what to tell the user."""

    FINISHED = "finished"
    STEP_TOO_SMALL = (
        "the step size fell to nothing; try more damping, softer contacts or stops, a larger speed at which friction sets "
        "in (v_static, friction_speed), or method = \"Radau\""
    )
    TOO_SOFT = "bodies pass through each other at any step size; raise contact.stiffness"
    NO_SOLUTION = (
        "the equations of a step could not be solved; try a smaller step or none, more damping, softer contacts or stops, "
        "or a larger speed at which friction sets in (v_static, friction_speed)"
    )
    NO_EQUILIBRIUM = (
        "no stable equilibrium was found to go on from: what damping there is did not bring the motion of a snap to rest; "
        "give the material more, or solve it as dynamics: method = \"generalized-alpha\""
    )
    NO_EQUILIBRIUM_UNDAMPED = (
        "no stable equilibrium was found to go on from; give the material damping, so that the motion of a snap can die, "
        "or solve it as dynamics: method = \"generalized-alpha\""
    )
    MECHANISM = (
        "the stiffness is singular, so something is not held; give its hinges stiffness, hold it, or solve the motion with "
        "its inertia: method = \"generalized-alpha\""
    )
    TORN = (
        "a joint has come apart by more than a tenth of a segment: the drive pulls beyond what the structure can reach; "
        "shorten its travel"
    )
    TOO_MANY_STEPS = "more steps than [solve] max_steps; raise it, loosen rtol, or pull faster"
    CROSSED = (
        "something passed through a face; take smaller steps (max_step), a stiffer contact, or method = "
        "\"generalized-alpha\" or \"static\", which cut the step"
    )
    NOT_FINITE = "the state is no longer finite; check masses and stiffnesses, or tighten rtol"
    ENERGY = "the energy balance is off by more than [solve] energy_abort; tighten rtol or set max_step"
    ENERGY_OF_STATICS = (
        "the energy balance is off by more than [solve] energy_abort; tighten solve.rtol, by which increments are chosen, "
        "or solve it as dynamics: method = \"generalized-alpha\""
    )
    ENERGY_OF_FIXED_STEPS = "the energy balance is off by more than [solve] energy_abort; take a shorter solve.step"


@dataclass(frozen=True)
class Event:
    """A place where the path is not smooth.

    Attributes
    ----------
    kind : "bifurcation", "snap", "damped snap", "motion", "release" or "unstable"
        A stable branch was taken; the structure snapped, solved with inertia, or held back by its dampers alone; inertia
        mattered for a while; the start was no equilibrium; a motion solved with inertia throughout passed unstable states.
    time, end_time : s
    travel, end_travel : m, of the first drive; 0 without one
    force, end_force : N, of the first drive
    """

    kind: str
    time: float
    end_time: float
    travel: float
    end_travel: float
    force: float
    end_force: float


class StepFailed(NotConverged):
    """A method cannot take its next step.

    Attributes
    ----------
    outcome : Outcome
    time : s
    worst : name of the body that is to blame
    reason : what stood against the last step, if it was not its error
    """

    def __init__(self, outcome: Outcome, time: float, worst: str, reason: str = "") -> None:
        self.outcome, self.time, self.worst, self.reason = outcome, time, worst, reason
        also = f". {reason}" if reason else ""
        super().__init__(f"at t = {time:.6g} s: {outcome.value}. Fastest changing body: {worst}{also}")
