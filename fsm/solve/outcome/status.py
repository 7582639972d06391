"""Outcomes of a solve, with remedies."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from fsm.errors import NotConverged

TORN = 0.1
"""Largest separation of the two sides of a joint relative to the length of a segment, for all methods."""


class Outcome(Enum):
    """Outcome of a solve; the value is the message for the user."""

    FINISHED = "finished"
    STEP_TOO_SMALL = (
        "the step size fell below its lower bound; use more damping, softer contacts or stops, a larger friction speed "
        "(v_static, friction_speed), or method = \"Radau\""
    )
    TOO_SOFT = (
        "bodies pass through each other at any step size; raise contact.stiffness, or press less: "
        "packed faces need the room of their thickness"
    )
    NO_SOLUTION = (
        "the equations of a step could not be solved; reduce or remove solve.step, use more damping, softer contacts or "
        "stops, or a larger friction speed (v_static, friction_speed)"
    )
    NO_EQUILIBRIUM = (
        "no stable equilibrium was found: the damping did not bring the motion after a snap to rest; raise "
        "material.damping, or solve with inertia: method = \"generalized-alpha\""
    )
    NO_EQUILIBRIUM_UNDAMPED = (
        "no stable equilibrium was found; set material.damping, so that the motion after a snap decays, or solve with "
        "inertia: method = \"generalized-alpha\""
    )
    MECHANISM = (
        "the stiffness is singular: a part of the model can move without resistance; add a stiffness or a support, or "
        "solve with inertia: method = \"generalized-alpha\""
    )
    TORN = (
        "the sides of a joint are over a tenth of a segment apart: the drive pulls beyond the full length of the "
        "structure; shorten the travel of the drive"
    )
    TOO_MANY_STEPS = "more steps than solve.max_steps; raise solve.max_steps, loosen solve.rtol, or pull faster"
    TOO_MANY_STEPS_IN_SNAP = (
        "more steps than solve.max_steps, in the motion after a snap; raise solve.max_steps, or raise material.damping, so "
        "that the motion comes to rest sooner"
    )
    CROSSED = (
        "a body passed through a face; reduce solve.max_step, raise contact.stiffness, or use method = "
        "\"generalized-alpha\" or \"static\", which shorten the step at such a contact"
    )
    NOT_FINITE = "the state is no longer finite; check masses and stiffnesses, or tighten solve.rtol"
    ENERGY = "the energy balance residual is above [solve] energy_abort; tighten solve.rtol, or set solve.max_step"
    ENERGY_OF_STATICS = (
        "the energy balance residual is above [solve] energy_abort; tighten solve.rtol, which sets the increments, "
        "or solve with inertia: method = \"generalized-alpha\""
    )
    ENERGY_OF_FIXED_STEPS = "the energy balance residual is above [solve] energy_abort; reduce solve.step"


@dataclass(frozen=True)
class Event:
    """Event on a path: a bifurcation, a snap or a motion.

    Attributes
    ----------
    kind : "bifurcation", "snap", "damped snap", "motion", "release", "unstable" or "vibration"
        In this order: change to a stable branch; snap, solved with inertia; snap that dampers slow; phase in which
        inertia is not negligible; start that is no equilibrium; unstable states in a motion; unstable states while the
        drive stands still.
    time, end_time : s
    travel, end_travel : m, of the first drive; 0 without one
    force, end_force : N, of the first drive
    loads : size (N, N m) and displacement (m, rad) of every load at the start, by name; empty in a motion
    """

    kind: str
    time: float
    end_time: float
    travel: float
    end_travel: float
    force: float
    end_force: float
    loads: dict[str, tuple[float, float]] = field(default_factory=dict, kw_only=True)


class StepFailed(NotConverged):
    """A method cannot take its next step.

    Attributes
    ----------
    outcome : Outcome
    time : s
    worst : name of the body with the largest acceleration
    reason : reason of the last rejection, if it was not the error
    """

    def __init__(self, outcome: Outcome, time: float, worst: str, reason: str = "") -> None:
        self.outcome, self.time, self.worst, self.reason = outcome, time, worst, reason
        also = f". {reason}" if reason else ""
        super().__init__(f"at t = {time:.6g} s: {outcome.value}. Fastest changing body: {worst}{also}")
