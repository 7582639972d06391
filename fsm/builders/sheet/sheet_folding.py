"""Dampers, moving rest angles and laws per length of the creases of a sheet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.builders.patterns.of_sheet import pattern_of
from fsm.builders.sheet.sheet_joints import SheetJoint, rest_angle
from fsm.case.models.case import Case
from fsm.case.models.fold_data import UNIT, FoldData
from fsm.case.models.materials import DAMPING, Crease, LinearCrease, SplineCrease
from fsm.case.models.sheet import Sheet
from fsm.case.pattern_files.pattern import Pattern
from fsm.errors import CaseError, Fault

_DAMPING_OF_FOLDING = 1e-2
"""Ratio of the default Kelvin-Voigt time to the time in which a sheet folds itself; the fold angles lag by this part."""


def is_motion(case: Case) -> bool:
    """Whether a sheet moves with inertia: a dynamic method, or no drive and no folding."""
    folds = case.sheet is not None and case.sheet.fold_to is not None
    chosen = case.solve.method
    return chosen not in ("auto", "static", "arc-length") or (chosen == "auto" and not case.drive and not folds)


def crease_damping(case: Case) -> float:
    """Kelvin-Voigt time of creases and bend lines, s; it is the value of the case, or else a fraction of the folding time.

    If a motion has no folding time, rigid facets have the default of materials, and flexible facets and bars have no
    dampers.
    """
    assert case.sheet is not None and case.material is not None
    given = case.material.damping
    if given is not None:
        return given
    if is_motion(case):
        return DAMPING if case.sheet.facets in ("rigid", "bend-lines") else 0.0
    return _DAMPING_OF_FOLDING * (case.solve.end_time or 0.0) if case.sheet.fold_to is not None else 0.0


def facet_damping(case: Case) -> float:
    """Kelvin-Voigt time of flexible facets and of bars, s: the value of the case, else none."""
    assert case.material is not None
    return case.material.damping or 0.0


def time_of_folding(case: Case) -> float | None:
    """Time until which rest angles move, s; None if they do not.

    Raises
    ------
    CaseError
        The crease law is not linear, no crease has a fold angle, or the case has no end time.
    """
    assert case.sheet is not None
    if case.sheet.fold_to is None:
        return None
    if not _has_fold_angles(case.sheet):
        text = "needs mountains or valleys with fold angles, and the sheet has none; remove it"
        raise CaseError(Fault("sheet.fold_to", text))
    if not isinstance(case.crease, LinearCrease):
        text = "is used with a linear crease law only; give crease.stiffness_per_length"
        raise CaseError(Fault("sheet.fold_to", text))
    if case.solve.end_time is None:
        raise CaseError(Fault("solve.end_time", "missing; the rest angles move until this time with sheet.fold_to"))
    return case.solve.end_time


def _has_fold_angles(sheet: Sheet) -> bool:
    """Whether a sheet has mountains or valleys with fold angles."""
    if sheet.is_shell:
        return False
    pattern = pattern_of(sheet)
    return any(pattern.assignment[edge] in "MV" and pattern.target[edge] for edge in pattern.creases.tolist())


def fold_turn(case: Case, pattern: Pattern, joint: SheetJoint, angle: float) -> float:
    """Change of the rest angle of a joint from the start to the end of the run, rad; `angle` is the fold angle at the
    start.
    """
    assert case.sheet is not None
    if case.sheet.fold_to is None or joint.kind != "crease" or pattern.assignment[joint.edge] == "U":
        return 0.0
    return case.sheet.fold_to * float(pattern.target[joint.edge]) - rest_angle(case, pattern, joint, angle)


def crease_of_length(crease: Crease | None, length: float) -> SplineCrease | None:
    """Measured moment curve, scaled to the length of a crease (m); None for a linear law."""
    if not isinstance(crease, SplineCrease):
        return None
    assert crease.width is not None
    return crease.model_copy(update={"scale": crease.scale * length / crease.width, "rest_angle": None})


@dataclass
class Folds:
    """Folds of a sheet of flexible facets or bars, collected joint by joint.

    Parameters
    ----------
    case : Case
    pattern : pattern of the joints
    linear_to : see `FoldData`
    """

    case: Case
    pattern: Pattern
    linear_to: float = np.pi

    def __post_init__(self) -> None:
        measured = crease_of_length(self.case.crease, 1.0)
        self._laws: tuple[Crease, ...] = (UNIT,) if measured is None else (UNIT, measured)
        self._end, self._damping = time_of_folding(self.case), crease_damping(self.case)
        self._rows: list[tuple[float, ...]] = []
        self._names: list[str] = []

    def add(self, joint: SheetJoint, angle: float, lengths: np.ndarray) -> None:
        """Add a crease or a bend line with a fold angle at the start (rad); parts of the given lengths (m) share its
        stiffness.
        """
        whole = float(self.pattern.lengths[joint.edge])
        law = len(self._laws) - 1 if joint.kind == "crease" else 0
        stiffness = joint.stiffness / whole
        number = len(self._names)
        self._names.append(joint.name)
        rest, turn = (of(self.case, self.pattern, joint, angle) for of in (rest_angle, fold_turn))
        for length in lengths.tolist():
            k = stiffness * length
            self._rows.append((law, length if law else k, rest, angle, self._damping * k, k * turn, k, number, length))

    def add_linear(self, stiffness: np.ndarray, angle: float) -> None:
        """Add linear folds (N m/rad each) whose moment is zero at the start."""
        for k in stiffness.tolist():
            self._rows.append((0, k, angle, angle, self._damping * k if is_motion(self.case) else 0.0, 0.0, k, -1, 0.0))

    def data(self) -> FoldData:
        """All folds."""
        law, share, rest, start, damping, turning, rise, joint, length = np.array(self._rows).reshape(-1, 9).T
        return FoldData(
            self._laws, law.astype(np.int64), share, rest, start, damping, turning, rise, self.linear_to, self._end,
            tuple(self._names), joint.astype(np.int64), length,
        )
