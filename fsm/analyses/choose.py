"""The one place where a case's kind of analysis is looked at."""

from __future__ import annotations

from fsm.analyses.analysis import Analysis
from fsm.analyses.deploy import Deployment
from fsm.analyses.scissor import ScissorArray
from fsm.analyses.vibrate import VibrationAnalysis
from fsm.scene.case import Case

__all__ = ["analysis_of"]


def analysis_of(case: Case, source: str = "", warnings: list[str] | None = None) -> Analysis:
    """Compile a case of one analysis.

    Parameters
    ----------
    case : Case
    source : str
        File that faults are told of.
    warnings : list of str, optional
        What was changed is added to it.

    Raises
    ------
    CaseError
        All faults that compiling finds.
    """
    if case.analysis == "vibrate":
        return VibrationAnalysis(case, source)
    if case.analysis == "scissor":
        return ScissorArray(case, source)
    return Deployment(case, source, warnings)
