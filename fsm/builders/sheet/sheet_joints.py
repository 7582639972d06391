"""Joints of the facets of a sheet along the edges of its pattern: creases, bend lines and rigid joints."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from fsm.builders.patterns.of_sheet import bend_stiffness_per_length, folding_letters
from fsm.case.models.case import Case
from fsm.case.models.materials import UNREAD, LinearCrease, SplineCrease
from fsm.case.models.sheet import Sheet
from fsm.case.models.sheet_parts import SheetCrease
from fsm.case.pattern_files.pattern import ASSIGNMENTS, Pattern
from fsm.errors import CaseError, Fault
from fsm.text.report_text import count

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
