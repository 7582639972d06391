"""Selection of the analysis of a case; films and arrays are imported when a case has them."""

from __future__ import annotations

from fsm.analyses.analysis import Analysis
from fsm.analyses.deploy import Deployment
from fsm.case.models.case import Case


def analysis_of(case: Case, source: str = "", warnings: list[str] | None = None) -> Analysis:
    """Compile a case of one analysis.

    Parameters
    ----------
    case : Case
    source : str
        Name of the file in messages.
    warnings : list of str, optional
        Warnings on changed values are appended.

    Raises
    ------
    CaseError
        Compilation finds faults; the error lists all of them.
    """
    if case.analysis == "vibrate":
        from fsm.analyses.vibrate import VibrationAnalysis

        return VibrationAnalysis(case, source)
    if case.analysis == "scissor":
        from fsm.analyses.scissor import ScissorArray

        return ScissorArray(case, source)
    return Deployment(case, source, warnings)
