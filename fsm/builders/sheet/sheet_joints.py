"""Joints of the facets of a sheet along the edges of its pattern: creases, bend lines and rigid joints.

Dampers, moving rest angles and laws per length of the creases of a sheet.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fsm.builders.patterns.of_sheet import bend_stiffness_per_length, folding_letters, pattern_of
from fsm.case.models.case import Case
from fsm.case.models.flexible_facets import UNIT, FoldData
from fsm.case.models.materials import DAMPING, UNREAD, Crease, LinearCrease, SplineCrease
from fsm.case.models.sheet import Sheet
from fsm.case.models.sheet_parts import SheetCrease
from fsm.case.pattern_files.pattern import ASSIGNMENTS, Pattern
from fsm.errors import CaseError, Fault
from fsm.text.shown_units import count

_LETTERS = {ASSIGNMENTS[letter]: letter for letter in "MVUFJ"}
_NUMBERED = re.compile(r"(crease|bend line)s?\s+(\d+(?:\s*,\s*\d+)*)")


class SheetJoint(NamedTuple):
    """Joint of two facets along an edge.

    Attributes
    ----------
    edge : number of the edge in the pattern
    kind : "crease", "bend line" or "rigid"
    name : "crease 1", "bend line 1" or "joint 1"
    stiffness : N m/rad, of the whole edge; for a measured curve its mean slope
    rest : rad, magnitude of the rest angle; None: the rest angle of the common crease law, or flat for a bend
    line
    """

    edge: int
    kind: str
    name: str
    stiffness: float
    rest: float | None = None


def sheet_joints(case: Case, pattern: Pattern) -> list[SheetJoint]:
    """Joints of the facets of a sheet, in the order of the edges.

    Raises
    ------
    CaseError
        The crease law has no stiffness per length, or `sheet.crease` names creases that do not exist or bend lines that are
        no joints.
    """
    assert case.sheet is not None
    lengths = pattern.lengths
    per_length = _crease_per_length(case)
    by_letter, by_name = _own_laws(case, pattern)
    found: list[SheetJoint] = []
    folding, bends = folding_letters(case.sheet), case.sheet.facets in ("bend-lines", "bars")
    numbers = {"crease": 0, "bend line": 0, "rigid": 0}
    for edge in pattern.creases.tolist():
        letter, length = pattern.assignment[edge], float(lengths[edge])
        laws = by_letter.get(letter, [])
        if letter in folding:
            kind, stiffness = "crease", per_length * length
        elif case.sheet.facets != "rigid":
            kind, stiffness = "bend line", bend_stiffness_per_length(case, length) * length
        else:
            kind, stiffness = "rigid", 0.0
        numbers[kind] += 1
        name = f"{kind if kind != 'rigid' else 'joint'} {numbers[kind]}"
        rest: float | None = None
        for own in (*laws, *by_name.pop(name, [])):
            if kind != "crease" and not bends:
                raise CaseError(_no_joint(case.sheet, own))
            stiffness = stiffness if own.stiffness_per_length is None else own.stiffness_per_length * length
            rest = rest if own.rest_angle is None else own.rest_angle
        found.append(SheetJoint(edge, kind, name, stiffness, rest))
    if by_name:
        name, (own, *_) = next(iter(by_name.items()))
        counted = f"{count(numbers['crease'], 'crease')} and {count(numbers['bend line'], 'bend line')}, numbered from 1"
        path = f"sheet.crease.{case.sheet.crease.index(own)}.of"
        raise CaseError(Fault(path, f"there is no {name}; the sheet has {counted}"))
    return found


def _no_joint(sheet: Sheet, own: SheetCrease) -> Fault:
    """Fault of an item of `sheet.crease` for bend lines of facets that do not bend along lines."""
    why = "facets bend everywhere" if sheet.facets == "flexible" else "facets do not bend"
    text = f'"{own.of}" has no stiffness of its own with facets = "{sheet.facets}", because {why}'
    ways = 'remove this item, give the lines the letter "M", "V" or "U", or use facets = "bend-lines" or "bars"'
    return Fault(f"sheet.crease.{sheet.crease.index(own)}.of", f"{text}; {ways}")


def rest_angle(case: Case, pattern: Pattern, joint: SheetJoint, angle: float) -> float:
    """Rest angle of a joint: zero for a bend line, the value of the crease law if the law gives one, else the fold angle at
    the start.
    """
    size = joint.rest
    if size is None and joint.kind == "crease" and case.crease is not None:
        size = case.crease.rest_angle
    if size is None:
        return 0.0 if joint.kind == "bend line" else angle
    return {"M": -1.0, "V": 1.0}.get(pattern.assignment[joint.edge], math.copysign(1.0, angle)) * size


def _own_laws(case: Case, pattern: Pattern) -> tuple[dict[str, list[SheetCrease]], dict[str, list[SheetCrease]]]:
    """Items of `sheet.crease` by the letter of an assignment and by the name of a joint."""
    by_letter: dict[str, list[SheetCrease]] = {}
    by_name: dict[str, list[SheetCrease]] = {}
    assert case.sheet is not None
    for number, own in enumerate(case.sheet.crease):
        path = f"sheet.crease.{number}"
        of = " ".join(own.of.split())
        if own.stiffness_per_length is not None and not isinstance(case.crease, LinearCrease):
            raise CaseError(Fault(f"{path}.stiffness_per_length", "is used with a linear crease law only; remove this key"))
        letter, match = _LETTERS.get(of), _NUMBERED.fullmatch(of)
        if letter is not None:
            if letter not in pattern.assignment:
                raise CaseError(Fault(f"{path}.of", f'the sheet has no edge of the kind "{of}"; it has {_kinds(pattern)}'))
            by_letter.setdefault(letter, []).append(own)
        elif match is not None:
            for text in match[2].split(","):
                by_name.setdefault(f"{match[1]} {int(text)}", []).append(own)
        else:
            words = ", ".join(f'"{word}"' for word in _LETTERS)
            text = f'"{of}" is not a kind or name of creases; give {words}, "crease 3" or "creases 3, 4"'
            raise CaseError(Fault(f"{path}.of", text))
    return by_letter, by_name


def _kinds(pattern: Pattern) -> str:
    """Kinds of edges of a pattern."""
    return ", ".join(name for letter, name in ASSIGNMENTS.items() if letter in pattern.assignment)


def _crease_per_length(case: Case) -> float:
    """Stiffness of creases over their length, N m/rad per m; for a measured curve, it is the mean slope."""
    crease = case.crease
    if crease is None:
        assert case.sheet is not None
        if case.sheet.crease:
            raise CaseError(Fault("crease", "section [crease] is missing; a sheet with [[sheet.crease]] needs this section"))
        return 0.0  # no edge folds
    if isinstance(crease, LinearCrease):
        if crease.stiffness_per_length is None:
            text = f"{crease.stiffness:g} N m/rad is for a whole strip; give crease.stiffness_per_length (N m/rad per m)"
            raise CaseError(Fault("crease.stiffness", text))
        return crease.stiffness_per_length
    if not isinstance(crease, SplineCrease):
        raise CaseError(Fault("crease.file", UNREAD))
    if crease.width is None:
        text = "missing; a sheet needs the width of the tested crease, to scale the moment with the length of a crease"
        raise CaseError(Fault("crease.width", text))
    return crease.mean_stiffness / crease.width


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
