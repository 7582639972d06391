"""Files beside cases: of the commands that vary a case."""

from __future__ import annotations

from fsm.case.models.optimise import OptimiseFile
from fsm.case.models.study import StudyFile
from fsm.case.schema.model import Model

FILES: dict[str, type[Model]] = {"study": StudyFile, "optimise": OptimiseFile}
"""Models of the files, by the names of their commands, which are also the names of their pages of help."""
