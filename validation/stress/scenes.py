"""Scenes of a campaign: the kind and the content of a scene by its number."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsm.case.loading.load_case import LoadedCase, read_case
from fsm.case.loading.toml_text import case_text
from fsm.errors import CaseError
from validation.stress.chains import draw_chain, draw_stack
from validation.stress.dice import Dice, Tables
from validation.stress.films import draw_film, draw_scissor
from validation.stress.sheets import draw_sheet
from validation.stress.strips import draw_lattice, draw_strip

__all__ = ["KINDS", "MIXED", "Drawn", "draw", "loaded"]

KINDS: dict[str, tuple[Callable[[Dice], Tables], int]] = {
    "strip": (draw_strip, 28),
    "lattice": (draw_lattice, 14),
    "chain": (draw_chain, 25),
    "stack": (draw_stack, 17),
    "film": (draw_film, 8),
    "scissor": (draw_scissor, 8),
    "sheet": (draw_sheet, 10),
}
"""Function that draws each kind, and its weight."""

MIXED = tuple(kind for kind in KINDS if kind != "sheet")
"""Kinds of the campaign by default. Sheets are drawn on their own, so that the numbers of all other scenes stay the same."""


@dataclass(frozen=True)
class Drawn:
    """Scene of a campaign: its number, kind and case, and whether a second solver checks it."""

    number: int
    kind: str
    tables: Tables
    second: bool


def draw(seed: int, number: int, kinds: tuple[str, ...] = MIXED, sample: float = 0.15) -> Drawn:
    """Scene with a number; `sample` is the fraction of the scenes that a second solver checks."""
    dice = Dice(seed, number)
    kind = dice.one_of(kinds, [KINDS[name][1] for name in kinds])
    second = dice.chance(sample)
    return Drawn(number, kind, json.loads(json.dumps(KINDS[kind][0](dice))), second)


def loaded(tables: dict[str, Any], name: str) -> LoadedCase:
    """Case of these tables, as if read from a file; its text must give the same case again.

    Raises
    ------
    CaseError
    """
    case, faults = read_case(tables, Path())
    if faults or case is None:
        raise CaseError(faults, name)
    return LoadedCase(case, case_text(case), Path(name))
