"""What `fsm check` says of a case, of whatever kind; nothing is compiled."""

from __future__ import annotations

from fsm.analyses.report import describe_film
from fsm.analyses.report_array import describe_array
from fsm.scene.case import Case
from fsm.segments.report import describe as describe_segments

__all__ = ["describe"]


def describe(case: Case) -> list[str]:
    """What is computed, what is left out and why, and the approximations that apply, a line each.

    Raises
    ------
    CaseError
        All faults that can be found without compiling.
    """
    kinds = {"deploy": describe_segments, "vibrate": describe_film, "scissor": describe_array}
    return [line for step in case.steps for line in kinds[step](case)]
