"""Report of `fsm check` for a case of any kind; no kernel is compiled."""

from __future__ import annotations

from fsm.analyses.report import describe_film
from fsm.analyses.report_array import describe_array
from fsm.scene.case import Case
from fsm.segments.report import describe as describe_segments

__all__ = ["describe"]


def describe(case: Case) -> list[str]:
    """Lines of the report: the model, the parts left out with the reason, and the approximations.

    Raises
    ------
    CaseError
        All faults that can be found without compilation.
    """
    kinds = {"deploy": describe_segments, "vibrate": describe_film, "scissor": describe_array}
    return [line for step in case.steps for line in kinds[step](case)]
