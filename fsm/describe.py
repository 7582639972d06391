"""Report of `fsm check` for a case of any kind; only a case with channels is compiled, but no kernel is."""

from __future__ import annotations

from fsm.analyses.report import describe_film
from fsm.analyses.report_array import describe_array
from fsm.scene.case import Case
from fsm.segments.report import describe as describe_segments

__all__ = ["describe"]

_LABEL = 14


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
        lines.insert(0, f"{'extensions':<{_LABEL}}{files} (Python code, executed with the case)")
    if case.save.channels:
        from fsm.channels.sample import channel_lines  # imports numba, which other cases do not need

        for number, text in enumerate(channel_lines(case)):
            lines.append(f"{'channels' if number == 0 else '':<{_LABEL}}{text}")
    return lines
