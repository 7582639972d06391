"""Report of `fsm check` for a case of any kind. A case is compiled only if it records channels; kernels are never
compiled.
"""

from __future__ import annotations

from fsm.case.models.case import Case
from fsm.check.array import describe_array
from fsm.check.film import describe_film
from fsm.check.report import describe as describe_segments
from fsm.text.report_text import labelled


def describe(case: Case) -> list[str]:
    """Lines of the report: the model, the parts left out with the reason, and the approximations.

    Raises
    ------
    CaseError
        All faults that can be found without compilation.
    """
    kinds = {"deploy": describe_segments, "vibrate": describe_film, "scissor": describe_array}
    lines = [line for step in case.steps for line in kinds[step](case)]
    if case.extensions:
        files = ", ".join(name.partition("#")[0] for name in case.extensions)
        lines = labelled([("extensions", lambda _: [f"{files} (Python code, executed with the case)"])], case) + lines
    if case.save.channels or case.report:
        from fsm.channels.sample import channel_lines  # this module imports numba, which other cases do not need

        lines += labelled([("channels", channel_lines)], case)
    if case.event:
        from fsm.channels.conditions import event_lines

        lines += labelled([("events", event_lines)], case)
    return lines
